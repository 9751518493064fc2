"""What the error sources of a robot file may say: every key with its unit in its name; what is left out is zero."""

from typing import Annotated, Any, Literal

from pydantic import Field, FiniteFloat

from compgen.core.toml import Table

# Upper ends are far beyond any arm that still works: they keep a slip of the keyboard from becoming a long search.
Value = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
Offset = Annotated[FiniteFloat, Field(ge=-5e4, le=5e4)]  # um
Turn = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mdeg
Ratio = Annotated[FiniteFloat, Field(ge=-1e5, le=1e5)]  # ppm
Share = Annotated[FiniteFloat, Field(ge=-10, le=10)]
Give = Annotated[FiniteFloat, Field(ge=-1e3, le=1e3)]  # urad per N m, arcsec per K
Mass = Annotated[FiniteFloat, Field(ge=0, le=1e4)]
Width = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
Place = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mm
Three = Annotated[list[Value], Field(min_length=3, max_length=3)]
ThreeOffsets = Annotated[list[Offset], Field(min_length=3, max_length=3)]
ThreeTurns = Annotated[list[Turn], Field(min_length=3, max_length=3)]
Spot = Annotated[list[Place], Field(min_length=3, max_length=3)]
Six = Annotated[list[Value], Field(min_length=6, max_length=6)]
SixOffsets = Annotated[list[Offset], Field(min_length=6, max_length=6)]
SixTurns = Annotated[list[Turn], Field(min_length=6, max_length=6)]
SixShares = Annotated[list[Share], Field(min_length=6, max_length=6)]
SixGives = Annotated[list[Give], Field(min_length=6, max_length=6)]
SixByTwo = Annotated[list[Annotated[list[Turn], Field(min_length=2, max_length=2)]], Field(min_length=6, max_length=6)]
SixBySix = Annotated[list[Annotated[list[Ratio], Field(min_length=6, max_length=6)]], Field(min_length=6, max_length=6)]
Vectors = Annotated[list[ThreeOffsets], Field(min_length=2, max_length=1000)]
Cycles = Annotated[FiniteFloat, Field(gt=0, le=1e4)]
Node = Annotated[str, Field(max_length=40)]
Link = Literal["column", "a1", "a2", "a3", "d4"]


class SourceTable(Table):
    """What every source has: where its values are from, and how well they are known, by the same keys."""

    provenance: Annotated[str, Field(max_length=400)] = ""
    sigma: dict[str, Any] = {}
    prior: dict[str, Any] = {}


class ThermalGrowthTable(SourceTable):
    """Own cte of each length over the one of ``thermal.cte_um_m_K``, less one."""

    excess_a: SixShares = 6 * [0.0]
    excess_d: SixShares = 6 * [0.0]


class LinkOffsetsTable(SourceTable):
    """DH offsets and Hayati angles."""

    d_um: SixOffsets = 6 * [0.0]
    a_um: SixOffsets = 6 * [0.0]
    alpha_mdeg: SixTurns = 6 * [0.0]
    beta_mdeg: SixTurns = 6 * [0.0]


class JointZerosTable(SourceTable):
    """Mastering."""

    offset_mdeg: SixTurns = 6 * [0.0]


class JointCouplingTable(SourceTable):
    """Row: the joint that errs; column: the one that moves."""

    ratio_ppm: SixBySix = 6 * [6 * [0.0]]


class ComplianceTable(SourceTable):
    """Turn per torque."""

    compliance_urad_Nm: SixGives = 6 * [0.0]


class GearHarmonicsTable(SourceTable):
    """Rows: joints; columns: first and second order."""

    sine_mdeg: SixByTwo = 6 * [[0.0, 0.0]]
    cosine_mdeg: SixByTwo = 6 * [[0.0, 0.0]]
    cycles: Annotated[list[Annotated[FiniteFloat, Field(gt=0, le=1e4)]], Field(min_length=6, max_length=6)] = 6 * [1.0]


Order = Annotated[int, Field(ge=1, le=1000)]
Waves = Annotated[list[Annotated[list[Value], Field(max_length=200)]], Field(min_length=6, max_length=6)]


class JointRippleTable(SourceTable):
    """Rows: joints; columns: the orders, in waves a turn of the joint."""

    order: Annotated[list[Order], Field(max_length=200)]
    sine_mdeg: Waves
    cosine_mdeg: Waves


class HysteresisTable(SourceTable):
    """Half-widths, and how far a joint turns to be on the other side."""

    backlash_mdeg: SixTurns = 6 * [0.0]
    windup_urad_Nm: SixGives = 6 * [0.0]
    width_mdeg: Annotated[list[Width], Field(min_length=6, max_length=6)]


class FrameTable(SourceTable):
    """A place and a rotation vector."""

    position_um: ThreeOffsets = 3 * [0.0]
    rotation_mdeg: ThreeTurns = 3 * [0.0]


class ThermalBendTable(SourceTable):
    """Bends, one an entry: of which link, in the arm's plane or sideways (the column: x or y), with which node.

    ``twist`` turns the link's end about the link itself.
    """

    link: list[Link]
    plane: list[Literal["arm", "side", "x", "y", "twist"]]
    node: list[Node]
    rate_arcsec_K: list[Give]
    column_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 0.0  # from the base plate to World's origin


class ThermalShiftTable(SourceTable):
    """Shifts, one an entry: the tool along its axis, or the fixture along a World axis, with which node."""

    of: list[Literal["tool", "fixture x", "fixture y", "fixture z"]]
    node: list[Node]
    rate_um_K: list[Value]


class MapTable(SourceTable):
    """One line of stations along a World axis."""

    axis: Literal["x", "y", "z"]
    at_mm: Spot
    station_mm: Annotated[list[Place], Field(min_length=2, max_length=1000)]
    forward_um: Vectors
    reverse_um: Vectors
    width_mm: Width = 10.0


class LoadsTable(Table):
    """Masses and forces; link centres from each joint in World axes at pendant zero, the payload's in the flange."""

    link_kg: Annotated[list[Mass], Field(min_length=6, max_length=6)] = 6 * [0.0]
    link_centre_mm: Annotated[list[Spot], Field(min_length=6, max_length=6)] = 6 * [[0.0, 0.0, 0.0]]
    payload_kg: Mass = 0.0
    payload_centre_mm: Spot = [0.0, 0.0, 0.0]
    gravity_m_s2: Three = [0.0, 0.0, -9.80665]
    force_N: Three = [0.0, 0.0, 0.0]


class JointBoxTable(Table):
    """Pendant angles that the parameters were identified in; beyond, a finding."""

    low_deg: Six
    high_deg: Six


class SourcesTable(Table):
    """All error sources of a robot."""

    thermal_growth: ThermalGrowthTable = ThermalGrowthTable()
    link_offsets: LinkOffsetsTable | None = None
    joint_zeros: JointZerosTable | None = None
    joint_coupling: JointCouplingTable | None = None
    compliance: ComplianceTable | None = None
    gear_harmonics: GearHarmonicsTable | None = None
    joint_ripple: JointRippleTable | None = None
    hysteresis: HysteresisTable | None = None
    base_frame: FrameTable | None = None
    thermal_bend: ThermalBendTable | None = None
    thermal_shift: ThermalShiftTable | None = None
    tool_frame: FrameTable | None = None
    map: list[MapTable] = []
    loads: LoadsTable = LoadsTable()
    box: JointBoxTable | None = None
