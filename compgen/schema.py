"""What a path file and a robot file may say: every key with its unit in its name, its range and its default."""

from typing import Annotated, Literal

from compgen.schema_heat import (
    AmbientTable,
    Length,
    LogTable,
    NetworkTable,
    NotNegative,
    Place,
    Positive,
    ShiftTable,
    SixRates,
    StepTable,
    Word,
)
from compgen.schema_sources import SourcesTable
from compgen.tables import FiniteFloat, Table, within

# Upper ends are far beyond any cell: they keep a slip of the keyboard from becoming a number that overflows.
Number = Annotated[FiniteFloat, within(ge=-1e6, le=1e6)]
Angle = Annotated[FiniteFloat, within(ge=-3600, le=3600)]  # deg
SixPlaces = Annotated[list[Place], within(min_length=6, max_length=6)]
SixAngles = Annotated[list[Angle], within(min_length=6, max_length=6)]
SixNumbers = Annotated[list[Annotated[FiniteFloat, within(ge=-10, le=10)]], within(min_length=6, max_length=6)]
Range = Annotated[list[Number], within(min_length=2, max_length=2)]
AngleRange = Annotated[list[Angle], within(min_length=2, max_length=2)]


class PatternTable(Table):
    """What every pattern has: its name and where its centre stands."""

    x_mm: Place
    y_mm: Place
    z_mm: Place


class LineTable(PatternTable):
    """A line along an axis; along z it starts at the centre."""

    pattern: Literal["line"]
    axis: Literal["x", "y", "z"]
    length_mm: Length


class CircleTable(PatternTable):
    """A full circle."""

    pattern: Literal["circle"]
    diameter_mm: Length


class SpiralTable(PatternTable):
    """A spiral from the centre; its pitch as a number of turns or as a stepover."""

    pattern: Literal["spiral"]
    diameter_mm: Length | None = None
    turns: Annotated[FiniteFloat, within(gt=0, le=1e4)] | None = None
    stepover_mm: Length | None = None


class RasterTable(PatternTable):
    """Sweeps along x, clipped to a circle of ``diameter_mm`` or to the boundary."""

    pattern: Literal["raster"]
    stepover_mm: Length
    diameter_mm: Length | None = None
    lead_mm: Annotated[FiniteFloat, within(ge=0, le=50)] = 5.0
    turn: Literal["square", "smooth"] = "square"


class Iso9283Table(PatternTable):
    """Test path after ISO 9283 in a square plane."""

    pattern: Literal["iso9283"]
    size_mm: Length


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
    radius_of_curvature_m: Annotated[FiniteFloat, within(ge=0.1, le=1e6)] | None = None
    conic_constant: Annotated[FiniteFloat, within(ge=-1e3, le=1e3)] | None = None
    off_axis_m: Annotated[FiniteFloat, within(ge=0, le=1e4)] | None = None


class BoundaryTable(Table):
    """The part's edge."""

    shape: Literal["circle", "hexagon"]
    diameter_mm: Length | None = None
    corner_to_corner_mm: Length | None = None
    rotation_deg: Angle | None = None


class ToolTable(Table):
    """The TCP in the flange frame, FANUC's X Y Z W P R; all zero is the flange itself (UT 0)."""

    number: Annotated[int, within(ge=0, le=10)] | None = None
    x_mm: Place = 0.0
    y_mm: Place = 0.0
    z_mm: Place = 0.0
    w_deg: Angle = 0.0
    p_deg: Angle = 0.0
    r_deg: Angle = 0.0
    spin_deg: Angle = 0.0
    axisymmetric: bool = False


class ProcessTable(Table):
    """How the path is driven and cut into waypoints."""

    feed_mm_s: Annotated[FiniteFloat, within(ge=0.05, le=2000)]
    chord_um: Annotated[FiniteFloat, within(ge=0.01, le=1000)] = 1.5
    spacing_mm: Annotated[FiniteFloat, within(ge=1e-3, le=10)] = 10.0
    thin_um: Annotated[FiniteFloat, within(ge=0.01, le=1000)] | None = None
    lift_mm: Annotated[FiniteFloat, within(ge=0, le=1e4)] = 20.0
    page_stops: Literal["off the part", "anywhere"] = "off the part"


class PostureTable(Table):
    """The branch of the inverse kinematics, for the whole program."""

    arm: Literal["front", "back"] = "front"
    elbow: Literal["up", "down"] = "up"
    wrist: Literal["no flip", "flip"] = "no flip"


class CompensationTable(Table):
    """What a correction may look like; see docs/conventions.md."""

    clamp_mm: Annotated[FiniteFloat, within(ge=0.001, le=100)] = 3.0
    clamp_deg: Annotated[FiniteFloat, within(ge=0.001, le=10)] = 0.5
    rate_um_mm: Annotated[FiniteFloat, within(ge=0.01, le=1000)] = 10.0
    rate_period_mm: Annotated[FiniteFloat, within(ge=0, le=100)] = 1.0
    curvature_period_mm: Annotated[FiniteFloat, within(ge=0, le=100)] = 10.0
    start_drift_um: Annotated[FiniteFloat, within(ge=0.01, le=1e4)] = 5.0


class BeforeFile(Table):
    """A file, or words, that say only what went before."""

    before: list[StepTable] = []


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
    before: list[StepTable] = []
    cycle: list[StepTable] = []
    after: list[StepTable] = []
    shift: list[ShiftTable] = []
    ambient: AmbientTable = AmbientTable()
    log: LogTable | None = None
    bounds: BoundsTable


class DhTable(Table):
    """Standard DH rows."""

    d_mm: SixPlaces
    a_mm: SixPlaces
    alpha_deg: SixAngles


class PendantTable(Table):
    """theta = matrix pendant + offset."""

    matrix: Annotated[list[SixNumbers], within(min_length=6, max_length=6)]
    offset_deg: SixAngles


class LimitsTable(Table):
    """Joint limits as the data sheet prints them, and speeds."""

    j1_deg: AngleRange
    j2_deg: AngleRange
    j2_plus_j3_deg: AngleRange | None = None  # of theta_3, where the pendant's J3 is coupled to J2
    j3_deg: AngleRange | None = None  # of theta_3 elsewhere
    j4_deg: AngleRange
    j5_deg: AngleRange
    j6_deg: AngleRange
    speed_deg_s: SixRates
    acceleration_deg_s2: SixRates
    jerk_deg_s3: SixRates


class SingularityTable(Table):
    """How near a singularity a program may come."""

    shoulder_mm: NotNegative
    elbow_mm: NotNegative
    wrist_deg: NotNegative


class ControllerTable(Table):
    """What the controller does with a program, and holds."""

    compensation: Literal["none", "signature", "unknown"]
    signature: str = ""  # the calibration that is active on the controller
    identified_with: str = ""  # the calibration that was active when this file's errors were identified
    interpolation_ms: Annotated[FiniteFloat, within(ge=0.1, le=1000)]
    max_lines: Annotated[int, within(gt=0)]
    max_positions: Annotated[int, within(gt=0)]
    memory_kB: Positive
    name_length: Annotated[int, within(ge=8, le=36)]
    decimals: Annotated[int, within(ge=3, le=6)] = 3
    turn_joints: Annotated[list[Annotated[int, within(ge=1, le=6)]], within(min_length=3, max_length=3)]


class BoxTable(Table):
    """Where the thermal parameters hold."""

    feed_mm_s: Range
    hours: Positive
    rise_K: Positive


class NodeTable(Table):
    """One thermal node."""

    name: Word
    rise_K: Annotated[FiniteFloat, within(ge=-500, le=500)]
    exponent: Annotated[FiniteFloat, within(ge=0, le=5)]
    tau_h: Annotated[FiniteFloat, within(ge=0.001, le=1e4)]


class SectionTable(Table):
    """A stretch of link, from the end of the one before."""

    to_mm: Positive
    from_: str
    to: str
    shape: Literal["linear", "exponential"]


class ProfileTable(Table):
    """One heated length."""

    length: Literal["d1", "a1", "a2", "a3", "d4", "d6"]
    sections: Annotated[list[SectionTable], within(min_length=1)]


Cte = Annotated[FiniteFloat, within(ge=-1000, le=1000)]


class ThermalTable(Table):
    """The thermal models: the study's nodes, and the conduction network when the file has one."""

    model: Literal["nodes", "network"] = "nodes"
    cte_um_m_K: Cte | dict[str, Cte]
    reference_feed_mm_s: Annotated[FiniteFloat, within(ge=0.001, le=1e4)]
    reference_h: Annotated[FiniteFloat, within(ge=0.001, le=1e4)]
    idle_fraction: Annotated[FiniteFloat, within(ge=0, le=1)]
    box: BoxTable
    node: Annotated[list[NodeTable], within(min_length=1)]
    profile: list[ProfileTable]
    sensors: dict[str, str] = {}
    network: NetworkTable | None = None


class IdentifiedTable(Table):
    """What identification found beside the sources: where instrument and reflectors were, and how good it is."""

    model: str = ""
    noise_um: NotNegative = 0.0
    held_out_um: Annotated[list[Number], within(max_length=3)] = []  # mean and its 95 % interval
    instrument_mm: Annotated[list[Number], within(min_length=3, max_length=3)]
    instrument_deg: Annotated[list[Angle], within(min_length=3, max_length=3)]  # rotation vector, World to instrument
    reflector_mm: dict[str, Annotated[list[Place], within(min_length=3, max_length=3)]]  # in the flange


class RobotFile(Table):
    """A robot file."""

    name: Annotated[str, within(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=24)]
    maker: str = ""
    payload_kg: Positive | None = None
    dh: DhTable
    pendant: PendantTable
    limits: LimitsTable
    singularity: SingularityTable
    controller: ControllerTable
    thermal: ThermalTable | None = None
    sources: SourcesTable = SourcesTable()
    identified: IdentifiedTable | None = None
