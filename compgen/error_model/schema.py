"""Tables of a robot file for its error sources: every key with its unit in its name; what is left out is zero."""

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat

from compgen.core.toml import Coordinate, Number, Point, Table

# Upper ends are far beyond any arm that still works: they keep a slip of the keyboard from becoming a long search.
LengthError = Annotated[FiniteFloat, Field(ge=-5e4, le=5e4)]  # um
SmallAngle = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mdeg
Ratio = Annotated[FiniteFloat, Field(ge=-1e5, le=1e5)]  # ppm
Factor = Annotated[FiniteFloat, Field(ge=-10, le=10)]
Rate = Annotated[FiniteFloat, Field(ge=-1e3, le=1e3)]  # urad per N m, arcsec per K
Mass = Annotated[FiniteFloat, Field(ge=0, le=1e4)]  # kg
Width = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
Order = Annotated[int, Field(ge=1, le=1000)]
NodeName = Annotated[str, Field(max_length=40)]
Link = Literal["column", "a1", "a2", "a3", "d4"]
Shifted = Literal["tool", "fixture x", "fixture y", "fixture z", "base x", "base y", "d1", "a1", "a2", "a3", "d4", "d6"]
ThreeNumbers = Annotated[list[Number], Field(min_length=3, max_length=3)]
ThreeOffsets = Annotated[list[LengthError], Field(min_length=3, max_length=3)]
ThreeAngles = Annotated[list[SmallAngle], Field(min_length=3, max_length=3)]
SixNumbers = Annotated[list[Number], Field(min_length=6, max_length=6)]
SixOffsets = Annotated[list[LengthError], Field(min_length=6, max_length=6)]
SixAngles = Annotated[list[SmallAngle], Field(min_length=6, max_length=6)]
SixFactors = Annotated[list[Factor], Field(min_length=6, max_length=6)]
SixRates = Annotated[list[Rate], Field(min_length=6, max_length=6)]
SixCycles = Annotated[list[Annotated[FiniteFloat, Field(gt=0, le=1e4)]], Field(min_length=6, max_length=6)]
SixWidths = Annotated[list[Width], Field(min_length=6, max_length=6)]
SixByTwo = Annotated[
    list[Annotated[list[SmallAngle], Field(min_length=2, max_length=2)]], Field(min_length=6, max_length=6)
]
SixBySix = Annotated[list[Annotated[list[Ratio], Field(min_length=6, max_length=6)]], Field(min_length=6, max_length=6)]
SixByOrder = Annotated[list[Annotated[list[Number], Field(max_length=200)]], Field(min_length=6, max_length=6)]
Vectors = Annotated[list[ThreeOffsets], Field(min_length=2, max_length=1000)]


class SourceTable(Table):
    """What every source has: where its values are from, and how well they are known."""

    provenance: Annotated[str, Field(max_length=400)] = ""
    """Where the values are from."""
    sigma: dict[str, Any] = {}
    """Standard deviations after identification, by key: one number, or the shape of the values."""
    prior: dict[str, Any] = {}
    """Standard deviations before identification, by key, where the declared ones do not fit; 0 holds an entry."""


class ThermalGrowthTable(SourceTable):
    """Growth of each length: its own coefficient of expansion, relative to that of thermal.cte_um_m_K."""

    excess_a: SixFactors = 6 * [0.0]
    """Excess of the coefficient of each a: 0.1 is 10 % more."""
    excess_d: SixFactors = 6 * [0.0]
    """Excess of the coefficient of each d."""


class LinkOffsetsTable(SourceTable):
    """Offsets of the DH parameters, and the Hayati angle between parallel axes."""

    d_um: SixOffsets = 6 * [0.0]
    """Offset of each d."""
    a_um: SixOffsets = 6 * [0.0]
    """Offset of each a."""
    alpha_mdeg: SixAngles = 6 * [0.0]
    """Offset of each alpha."""
    beta_mdeg: SixAngles = 6 * [0.0]
    """Hayati angle about y of each row."""


class JointZerosTable(SourceTable):
    """Errors of the mastering."""

    offset_mdeg: SixAngles = 6 * [0.0]
    """Offset of each joint's zero."""


class JointCouplingTable(SourceTable):
    """Errors of the transmissions: a joint turns when another one does."""

    ratio_ppm: SixBySix = 6 * [6 * [0.0]]
    """Error per turn of another joint; rows: the joint that errs; columns: the joint that moves."""


class ComplianceTable(SourceTable):
    """Joints give under gravity and process force."""

    compliance_urad_Nm: SixRates = 6 * [0.0]
    """Turn of each joint per torque."""
    hardening_nrad_Nm2: SixRates = 6 * [0.0]
    """Change of that per torque; negative where a joint grows stiffer under load."""


class GearHarmonicsTable(SourceTable):
    """Periodic errors of the gears, first and second harmonic."""

    sine_mdeg: SixByTwo = 6 * [[0.0, 0.0]]
    """Sine amplitudes; rows: joints; columns: first and second harmonic."""
    cosine_mdeg: SixByTwo = 6 * [[0.0, 0.0]]
    """Cosine amplitudes; in the same shape."""
    cycles: SixCycles = 6 * [1.0]
    """Cycles of the first harmonic per turn of each joint."""


class JointRippleTable(SourceTable):
    """Periodic errors of the joints, of any orders."""

    order: Annotated[list[Order], Field(max_length=200)]
    """Orders, in cycles per turn of the joint."""
    sine_mdeg: SixByOrder
    """Sine amplitudes; rows: joints; columns: orders."""
    cosine_mdeg: SixByOrder
    """Cosine amplitudes; in the same shape."""


class HysteresisTable(SourceTable):
    """Lost motion of the joints, which depends on the direction they come from."""

    backlash_mdeg: SixAngles = 6 * [0.0]
    """Half of each joint's backlash."""
    windup_urad_Nm: SixRates = 6 * [0.0]
    """Half-width of the windup per torque on the gear."""
    width_mdeg: SixWidths
    """How far a joint turns, after a reversal, until 63 % of the change is done; with the play law half of its way."""
    law: Literal["dahl", "play"] = "dahl"
    """How the change goes on after a reversal: dahl fades, play is a straight ramp with an end."""


class FrameErrorTable(SourceTable):
    """Displacement of a frame."""

    position_um: ThreeOffsets = 3 * [0.0]
    """Displacement along x, y, z."""
    rotation_mdeg: ThreeAngles = 3 * [0.0]
    """Rotation vector."""


class ThermalBendTable(SourceTable):
    """Links that bend with temperature; the lists have one entry for each bend."""

    link: list[Link]
    """Link that bends; column is the base."""
    plane: list[Literal["arm", "side", "x", "y", "twist"]]
    """In the arm's plane or sideways; the column about World x or y; twist turns the end about the link."""
    node: list[NodeName]
    """Rise that bends it, by name."""
    rate_arcsec_K: list[Rate]
    """Turn of the link's end per rise."""
    column_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 0.0
    """Height of World's origin above the foot of the column."""


class ThermalShiftTable(SourceTable):
    """Shifts with temperature; the lists have one entry for each shift."""

    of: list[Shifted]
    """What shifts: the tool along its axis, the fixture or the base along an axis of World, or a length that grows."""
    node: list[NodeName]
    """Rise that shifts it, by name."""
    rate_um_K: list[Rate]
    """Shift per rise."""


class MapTable(SourceTable):
    """Errors measured along a line parallel to an axis of World, in both directions."""

    axis: Literal["x", "y", "z"]
    """Axis of World that the line is parallel to."""
    at_mm: Point
    """A point of the line, World."""
    station_mm: Annotated[list[Coordinate], Field(min_length=2, max_length=1000)]
    """Coordinates of the stations on the axis, rising."""
    forward_um: Vectors
    """Error vector at each station, approached towards larger coordinates."""
    reverse_um: Vectors
    """Error vector at each station, approached towards smaller coordinates."""
    width_mm: Width = 10.0
    """How far the tool travels, after a reversal, until 63 % of the change is done."""


class LoadsTable(Table):
    """Masses and forces that load the joints."""

    link_kg: Annotated[list[Mass], Field(min_length=6, max_length=6)] = 6 * [0.0]
    """Mass of each link."""
    link_centre_mm: Annotated[list[Point], Field(min_length=6, max_length=6)] = 6 * [[0.0, 0.0, 0.0]]
    """Centre of each link's mass from its joint, World axes, pendant angles zero."""
    payload_kg: Mass = 0.0
    """Mass of the payload."""
    payload_centre_mm: Point = [0.0, 0.0, 0.0]
    """Centre of the payload's mass in the flange."""
    gravity_m_s2: ThreeNumbers = [0.0, 0.0, -9.80665]
    """Acceleration of gravity, World."""
    force_N: ThreeNumbers = [0.0, 0.0, 0.0]
    """Force of the process on the tool, tool axes."""


class JointBoxTable(Table):
    """Pendant angles at which the parameters were identified; beyond them a finding."""

    low_deg: SixNumbers
    """Lowest angle of each joint."""
    high_deg: SixNumbers
    """Highest angle of each joint."""


class SourcesTable(Table):
    """Error sources of the robot: what makes the real arm differ from the nominal one."""

    thermal_growth: ThermalGrowthTable = ThermalGrowthTable()
    link_offsets: LinkOffsetsTable | None = None
    joint_zeros: JointZerosTable | None = None
    joint_coupling: JointCouplingTable | None = None
    compliance: ComplianceTable | None = None
    gear_harmonics: GearHarmonicsTable | None = None
    joint_ripple: JointRippleTable | None = None
    hysteresis: HysteresisTable | None = None
    base_frame: FrameErrorTable | None = None
    """Displacement of the arm's base, World."""
    thermal_bend: ThermalBendTable | None = None
    thermal_shift: ThermalShiftTable | None = None
    tool_frame: FrameErrorTable | None = None
    """Displacement of the tool, in the flange."""
    map: list[MapTable] = []
    """Errors measured along lines, at most one for each axis of World."""
    loads: LoadsTable = LoadsTable()
    box: JointBoxTable | None = None
