"""What a path file and a robot file may say: every key with its unit in its name, its range and its default."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

Positive = Annotated[FiniteFloat, Field(gt=0)]
NotNegative = Annotated[FiniteFloat, Field(ge=0)]
Six = Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)]
SixPositive = Annotated[list[Positive], Field(min_length=6, max_length=6)]
Range = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class Table(BaseModel):
    """A TOML table: unknown keys are refused, numbers are numbers."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class PatternTable(Table):
    """What every pattern has: its name and where its centre stands."""

    x_mm: FiniteFloat
    y_mm: FiniteFloat
    z_mm: FiniteFloat


class LineTable(PatternTable):
    """A line along an axis; along z it starts at the centre."""

    pattern: Literal["line"]
    axis: Literal["x", "y", "z"]
    length_mm: Positive


class CircleTable(PatternTable):
    """A full circle."""

    pattern: Literal["circle"]
    diameter_mm: Positive


class SpiralTable(PatternTable):
    """A spiral from the centre; its pitch as a number of turns or as a stepover."""

    pattern: Literal["spiral"]
    diameter_mm: Positive | None = None
    turns: Positive | None = None
    stepover_mm: Positive | None = None


class RasterTable(PatternTable):
    """Sweeps along x, clipped to a circle of ``diameter_mm`` or to the boundary."""

    pattern: Literal["raster"]
    stepover_mm: Positive
    diameter_mm: Positive | None = None
    lead_mm: Annotated[FiniteFloat, Field(ge=0, le=50)] = 5.0
    turn: Literal["square", "smooth"] = "square"


class Iso9283Table(PatternTable):
    """Test path after ISO 9283 in a square plane."""

    pattern: Literal["iso9283"]
    size_mm: Positive


PATTERNS: dict[str, type[PatternTable]] = {
    "line": LineTable,
    "circle": CircleTable,
    "spiral": SpiralTable,
    "raster": RasterTable,
    "iso9283": Iso9283Table,
}


class SurfaceTable(Table):
    """What the path lies on; a conic needs its three numbers."""

    kind: Literal["plane", "conic"] = "plane"
    radius_of_curvature_m: Positive | None = None
    conic_constant: FiniteFloat | None = None
    off_axis_m: NotNegative | None = None


class BoundaryTable(Table):
    """The part's edge."""

    shape: Literal["circle", "hexagon"]
    diameter_mm: Positive | None = None
    corner_to_corner_mm: Positive | None = None
    rotation_deg: FiniteFloat | None = None


class ToolTable(Table):
    """The TCP in the flange frame, FANUC's X Y Z W P R; all zero is the flange itself (UT 0)."""

    number: Annotated[int, Field(ge=0, le=10)] | None = None
    x_mm: FiniteFloat = 0.0
    y_mm: FiniteFloat = 0.0
    z_mm: FiniteFloat = 0.0
    w_deg: FiniteFloat = 0.0
    p_deg: FiniteFloat = 0.0
    r_deg: FiniteFloat = 0.0
    spin_deg: FiniteFloat = 0.0
    axisymmetric: bool = False


class ProcessTable(Table):
    """How the path is driven and cut into waypoints."""

    feed_mm_s: Annotated[FiniteFloat, Field(gt=0, le=2000)]
    chord_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 1.5
    lift_mm: NotNegative = 20.0


class PostureTable(Table):
    """The branch of the inverse kinematics, for the whole program."""

    arm: Literal["front", "back"] = "front"
    elbow: Literal["up", "down"] = "up"
    wrist: Literal["no flip", "flip"] = "no flip"


class CompensationTable(Table):
    """What a correction may look like; see docs/conventions.md."""

    clamp_mm: Positive = 3.0
    clamp_deg: Positive = 0.5
    rate_um_mm: Positive = 10.0
    rate_period_mm: NotNegative = 1.0
    curvature_period_mm: NotNegative = 10.0
    start_drift_um: Positive = 5.0


class BeforeTable(Table):
    """What the cell did before the program, in order."""

    state: Literal["moving", "idle", "off"]
    feed_mm_s: Positive | None = None
    duration_h: NotNegative


class BoundsTable(Table):
    """The promise: largest values allowed after correction."""

    max_um: Positive | None = None
    p99_um: Positive | None = None
    rms_um: Positive | None = None
    feed_um: Positive | None = None
    cross_um: Positive | None = None
    normal_um: Positive | None = None
    axis_mdeg: Positive | None = None


class PathFile(Table):
    """A path file; ``path`` is read by its pattern's own table."""

    robot: str = "m710ic50"
    title: str = ""
    path: PatternTable
    surface: SurfaceTable = SurfaceTable()
    boundary: BoundaryTable | None = None
    tool: ToolTable = ToolTable()
    process: ProcessTable
    posture: PostureTable = PostureTable()
    compensation: CompensationTable = CompensationTable()
    before: list[BeforeTable] = []
    bounds: BoundsTable


class DhTable(Table):
    """Standard DH rows."""

    d_mm: Six
    a_mm: Six
    alpha_deg: Six


class PendantTable(Table):
    """theta = matrix pendant + offset."""

    matrix: Annotated[list[Six], Field(min_length=6, max_length=6)]
    offset_deg: Six


class LimitsTable(Table):
    """Joint limits as the data sheet prints them, and speeds."""

    j1_deg: Range
    j2_deg: Range
    j2_plus_j3_deg: Range | None = None
    j3_deg: Range | None = None
    j4_deg: Range
    j5_deg: Range
    j6_deg: Range
    speed_deg_s: SixPositive
    acceleration_deg_s2: SixPositive
    jerk_deg_s3: SixPositive


class SingularityTable(Table):
    """How near a singularity a program may come."""

    shoulder_mm: NotNegative
    elbow_mm: NotNegative
    wrist_deg: NotNegative


class ControllerTable(Table):
    """What the controller does with a program, and holds."""

    compensation: Literal["none", "signature", "unknown"]
    interpolation_ms: Positive
    max_lines: Annotated[int, Field(gt=0)]
    max_positions: Annotated[int, Field(gt=0)]
    memory_kB: Positive
    name_length: Annotated[int, Field(ge=8, le=36)]
    turn_joints: Annotated[list[Annotated[int, Field(ge=1, le=6)]], Field(min_length=3, max_length=3)]


class BoxTable(Table):
    """Where the thermal parameters hold."""

    feed_mm_s: Range
    hours: Positive
    rise_K: Positive


class NodeTable(Table):
    """One thermal node."""

    name: str
    rise_K: FiniteFloat
    exponent: NotNegative
    tau_h: Positive


class SectionTable(BaseModel):
    """A stretch of link, from the end of the one before."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    to_mm: Positive
    from_: str = Field(alias="from")
    to: str
    shape: Literal["linear", "exponential"]


class ProfileTable(Table):
    """One heated length."""

    length: Literal["a1", "a2", "a3", "d4", "d6"]
    sections: Annotated[list[SectionTable], Field(min_length=1)]


class ThermalTable(Table):
    """The first thermal model."""

    cte_um_m_K: FiniteFloat | dict[str, FiniteFloat]
    reference_feed_mm_s: Positive
    reference_h: Positive
    idle_fraction: Annotated[FiniteFloat, Field(ge=0, le=1)]
    box: BoxTable
    node: Annotated[list[NodeTable], Field(min_length=1)]
    profile: list[ProfileTable]


class RobotFile(Table):
    """A robot file."""

    name: str
    maker: str = ""
    payload_kg: Positive | None = None
    dh: DhTable
    pendant: PendantTable
    limits: LimitsTable
    singularity: SingularityTable
    controller: ControllerTable
    thermal: ThermalTable
