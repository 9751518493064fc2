"""The two files: a path file and a robot file, of the tables of each room."""

from typing import Annotated, Any

from pydantic import Field

from compgen.compensation.tables import CompensationTable
from compgen.core.exceptions import InputError
from compgen.core.quantities import Positive
from compgen.core.toml import Table, check, suggest
from compgen.error_model.schema import SourcesTable
from compgen.identification.tables import IdentifiedTable
from compgen.planning.tables import PATTERNS, BoundaryTable, PatternTable, ProcessTable, SurfaceTable
from compgen.robot.tables import (
    ControllerTable,
    DhTable,
    LimitsTable,
    PendantTable,
    PostureTable,
    SingularityTable,
    ToolTable,
)
from compgen.thermal.tables.schema import AmbientTable, LogTable, ShiftTable, StepTable, ThermalTable
from compgen.verification.tables import BoundsTable


class BeforeFile(Table):
    """A file, or words, that say only what went before."""

    before: list[StepTable] = []


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


class RobotFile(Table):
    """A robot file."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.+-]*$", max_length=24)]
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


def path_model(data: dict[str, Any], where: str) -> PathFile:
    """The path file's model, with ``path`` read by its pattern's own table."""
    table = data.get("path")
    if not isinstance(table, dict):
        raise InputError(f"{where}: path: missing table; give [path] with a pattern and its sizes")
    known = ", ".join(PATTERNS)
    if "pattern" not in table:
        raise InputError(f"{where}: path.pattern: missing; known: {known}")
    name = table["pattern"]
    if not isinstance(name, str) or name not in PATTERNS:
        close = suggest(str(name), list(PATTERNS), listed=True)
        raise InputError(f"{where}: path.pattern: {name!r} is unknown; known: {known}{close}")
    pattern = check(PATTERNS[name], table, where, "path")
    rest = check(PathFile, {**data, "path": {k: table[k] for k in ("x_mm", "y_mm", "z_mm")}}, where)
    return rest.model_copy(update={"path": pattern})
