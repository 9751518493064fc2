"""The two files: a path file and a robot file, of the tables of each room."""

from typing import Annotated

from pydantic import Field

from compgen.compensation.tables import CompensationTable
from compgen.core.toml import Positive, Table
from compgen.error_model.schema import SourcesTable
from compgen.error_model.unknown import UnknownTable
from compgen.job.tables import AnchorTable, BoundsTable, IdentifiedTable
from compgen.planning.tables import AnyPattern, BoundaryTable, FrameTable, ProcessTable, SurfaceTable
from compgen.robot.tables import (
    ControllerTable,
    DhTable,
    LimitsTable,
    MotionTable,
    PendantTable,
    PostureTable,
    SingularityTable,
    ToolTable,
)
from compgen.thermal.tables.schema import (
    AmbientTable,
    LogTable,
    ShiftTable,
    StartTable,
    StateTable,
    StepTable,
    ThermalTable,
)


class BeforeFile(Table):
    """A file, or words, that say only what went before."""

    before: list[StepTable] = []


class PathFile(Table):
    """A path file of compgen: where the tool shall go, how it is driven, and what went before."""

    robot: str = "m710ic50"
    """Name of a file in robots/, or a robot file."""
    title: str = ""
    """Title of the report."""
    path: AnyPattern
    """The pattern and where it stands; the key pattern decides which other keys there are."""
    surface: SurfaceTable = SurfaceTable()
    boundary: BoundaryTable | None = None
    frame: FrameTable | None = None
    tool: ToolTable = ToolTable()
    process: ProcessTable
    posture: PostureTable = PostureTable()
    compensation: CompensationTable = CompensationTable()
    before: list[StepTable] = []
    """What the cell did before the program; nothing: the robot is cold."""
    cycle: list[StepTable] = []
    """Runs of the program and what is between them; nothing: it runs once."""
    after: list[StepTable] = []
    """What the cell does after the program."""
    shift: list[ShiftTable] = []
    """Working hours of every day, for the stretches with shifts = true."""
    start: StartTable | None = None
    ambient: AmbientTable = AmbientTable()
    log: LogTable | None = None
    state: StateTable | None = None
    bounds: BoundsTable


class RobotFile(Table):
    """A robot file of compgen: the nominal arm, its controller, how it warms, and what makes it err."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=24)]
    """Name of the robot."""
    maker: str = ""
    """Maker of the robot."""
    payload_kg: Positive | None = None
    """Largest payload."""
    dh: DhTable
    pendant: PendantTable
    limits: LimitsTable
    singularity: SingularityTable
    controller: ControllerTable
    motion: MotionTable | None = None
    thermal: ThermalTable | None = None
    sources: SourcesTable = SourcesTable()
    identified: IdentifiedTable | None = None
    anchor: AnchorTable | None = None
    unknown: list[UnknownTable] = []
    """What the file does not know and a part will see: named beside every band."""
