"""What the error sources of a robot file may say: every key with its unit in its name; what is left out is zero."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

Value = Annotated[FiniteFloat, Field(ge=-1e6, le=1e6)]
Mass = Annotated[FiniteFloat, Field(ge=0, le=1e4)]
Width = Annotated[FiniteFloat, Field(gt=0, le=1e6)]
Place = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]  # mm
Three = Annotated[list[Value], Field(min_length=3, max_length=3)]
Spot = Annotated[list[Place], Field(min_length=3, max_length=3)]
Six = Annotated[list[Value], Field(min_length=6, max_length=6)]
SixByTwo = Annotated[list[Annotated[list[Value], Field(min_length=2, max_length=2)]], Field(min_length=6, max_length=6)]
SixBySix = Annotated[list[Six], Field(min_length=6, max_length=6)]
Vectors = Annotated[list[Three], Field(min_length=2, max_length=1000)]
Node = Annotated[str, Field(max_length=40)]
Link = Literal["column", "a1", "a2", "a3", "d4"]


class Table(BaseModel):
    """A TOML table: unknown keys are refused, numbers are numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class SourceTable(Table):
    """What every source has: where its values are from, and how well they are known, by the same keys."""

    provenance: Annotated[str, Field(max_length=400)] = ""
    sigma: dict[str, Any] = {}
    prior: dict[str, Any] = {}


class ThermalGrowthTable(SourceTable):
    """Own cte of each length over the one of ``thermal.cte_um_m_K``, less one."""

    excess_a: Six = 6 * [0.0]
    excess_d: Six = 6 * [0.0]


class LinkOffsetsTable(SourceTable):
    """DH offsets and Hayati angles."""

    d_um: Six = 6 * [0.0]
    a_um: Six = 6 * [0.0]
    alpha_mdeg: Six = 6 * [0.0]
    beta_mdeg: Six = 6 * [0.0]


class JointZerosTable(SourceTable):
    """Mastering."""

    offset_mdeg: Six = 6 * [0.0]


class JointCouplingTable(SourceTable):
    """Row: the joint that errs; column: the one that moves."""

    ratio_ppm: SixBySix = 6 * [6 * [0.0]]


class ComplianceTable(SourceTable):
    """Turn per torque."""

    compliance_urad_Nm: Six = 6 * [0.0]


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

    backlash_mdeg: Six = 6 * [0.0]
    windup_urad_Nm: Six = 6 * [0.0]
    width_mdeg: Annotated[list[Width], Field(min_length=6, max_length=6)]


class FrameTable(SourceTable):
    """A place and a rotation vector."""

    position_um: Three = 3 * [0.0]
    rotation_mdeg: Three = 3 * [0.0]


class ThermalBendTable(SourceTable):
    """Bends, one an entry: of which link, in the arm's plane or sideways (the column: x or y), with which node."""

    link: list[Link]
    plane: list[Literal["arm", "side", "x", "y"]]
    node: list[Node]
    rate_arcsec_K: list[Value]
    column_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 0.0  # from the base plate to World's origin


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

    thermal_growth: ThermalGrowthTable | None = None
    link_offsets: LinkOffsetsTable | None = None
    joint_zeros: JointZerosTable | None = None
    joint_coupling: JointCouplingTable | None = None
    compliance: ComplianceTable | None = None
    gear_harmonics: GearHarmonicsTable | None = None
    joint_ripple: JointRippleTable | None = None
    hysteresis: HysteresisTable | None = None
    base_frame: FrameTable | None = None
    thermal_bend: ThermalBendTable | None = None
    tool_frame: FrameTable | None = None
    map: list[MapTable] = []
    loads: LoadsTable = LoadsTable()
    box: JointBoxTable | None = None
