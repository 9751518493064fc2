"""The two files: a path file and a robot file, of the tables of each room; and their JSON Schema (draft 2020-12)."""

import ast
import inspect
import sys
from functools import cache
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Field

from compgen.compensation.tables import CompensationTable
from compgen.core.toml import NAME, Positive, Table
from compgen.core.units import parted
from compgen.error_model.schema import SourcesTable
from compgen.error_model.unmeasured import UnknownTable
from compgen.job.tables import AnchorTable, BoundsTable, IdentifiedTable
from compgen.planning.boundary_schema import BoundaryTable
from compgen.planning.tables import AnyPattern, FrameTable, ProcessTable, SurfaceTable
from compgen.robot.motion_tables import ExpectedMotionTable, MotionTable
from compgen.robot.tables import (
    ControllerTable,
    DhTable,
    LimitsTable,
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

#: where a shipped file's first line, ``#:schema ./path.schema.json``, finds its schema
SCHEMA_FILES = {"path": "paths/path.schema.json", "robot": "robots/robot.schema.json"}

#: keys of a path file that say what the cell does before and after its program
HISTORY = ("before", "cycle", "after", "shift", "start", "ambient", "log", "state")


class BeforeFile(Table):
    """A file, or words, that say only what went before, and how warm the air is."""

    before: list[StepTable] = []
    ambient: AmbientTable = AmbientTable()


class PathFile(Table):
    """A path file of compgen: where the tool shall go, how it is driven, and what went before."""

    robot: str = "m710ic50"
    """Name of a file in robots/, or a robot file."""
    title: str = ""
    """Title of the report."""
    path: Annotated[AnyPattern, Field(examples=["[path], below it pattern = 'raster'"])]
    """The pattern and where it stands; the key pattern decides which other keys there are."""
    surface: SurfaceTable = SurfaceTable()
    boundary: BoundaryTable | None = None
    frame: FrameTable | None = None
    tool: ToolTable = ToolTable()
    process: Annotated[ProcessTable, Field(examples=["[process], below it feed_mm_s = 100"])]
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
    bounds: Annotated[BoundsTable, Field(examples=["[bounds], below it max_um = 5"])]


class RobotFile(Table):
    """A robot file of compgen: the nominal arm, its controller, how it warms, and what makes it err."""

    name: Annotated[str, Field(pattern=NAME, max_length=24)]
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
    expected_motion: ExpectedMotionTable | None = None
    thermal: ThermalTable | None = None
    sources: SourcesTable = SourcesTable()
    identified: IdentifiedTable | None = None
    anchor: AnchorTable | None = None
    unknown: list[UnknownTable] = []
    """What the file does not know and a part will see: named beside every band."""


def path_schema() -> dict[str, Any]:
    """JSON Schema of a path file."""
    return _document(PathFile, "path")


def robot_schema() -> dict[str, Any]:
    """JSON Schema of a robot file."""
    return _document(RobotFile, "robot")


def _document(model: type[Table], name: str) -> dict[str, Any]:
    head = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:compgen:{name}-file",
        "title": f"compgen {name} file",
    }
    schema, tables = model.model_json_schema(), _tables()
    for described in (*schema["$defs"].values(), schema):
        for key, text in _texts(tables[described["title"], *sorted(described["properties"])]).items():
            described["properties"][key] = dict(sorted({"description": text, **described["properties"][key]}.items()))
    return {**head, **_plain(schema)}


def _tables(model: type[Table] = Table) -> dict[tuple[str, ...], type[Table]]:
    """A table and all that are made from it, by name and keys: two rooms may have tables of one name."""
    own = (model.__name__, *sorted(_key(model, field) for field in model.model_fields))
    return {own: model, **{name: m for made in model.__subclasses__() for name, m in _tables(made).items()}}


def _key(model: type[Table], field: str) -> str:
    """What a field is called in the file."""
    return model.model_fields[field].alias or field


def _texts(model: type[Table]) -> dict[str, str]:
    """The texts below a table's fields, by their keys; its own before those that it inherits."""
    texts: dict[str, str] = {}
    for base in (m for m in reversed(model.__mro__) if issubclass(m, Table)):
        for field, below in pairwise(_classes(base.__module__)[base.__name__].body):
            match field, below:
                case ast.AnnAssign(target=ast.Name(id=key)), ast.Expr(value=ast.Constant(value=str(text))):
                    texts[_key(model, key)] = inspect.cleandoc(text)
    return texts


@cache
def _classes(module: str) -> dict[str, ast.ClassDef]:
    """The classes of a module as its source has them, by name."""
    source = inspect.getsource(sys.modules[module])
    return {node.name: node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)}


def _plain(schema: dict[str, Any], key: str = "") -> dict[str, Any]:
    """A schema as TOML needs it: no null, no titles made of names, defaults at the keys alone, units in the text."""
    plain = {k: v for k, v in schema.items() if k not in ("title", "discriminator")}
    choices = [c for c in plain.pop("anyOf", []) if c != {"type": "null"}]
    if len(choices) == 1:
        plain |= choices[0]
    elif choices:
        plain["anyOf"] = [_plain(c) for c in choices]
    if plain.get("default") is None or "$ref" in plain:
        plain.pop("default", None)
    if "description" in plain and (unit := parted(key)[1]):
        first, *rest = plain["description"].rstrip(".").split(";", 1)
        plain["description"] = ";".join([f"{first} [{unit}]", *rest]) + "."
    for word in ("properties", "$defs"):
        if word in plain:
            plain[word] = {name: _plain(inner, name) for name, inner in plain[word].items()}
    for word in ("items", "additionalProperties"):
        if isinstance(plain.get(word), dict):
            plain[word] = _plain(plain[word])
    return plain
