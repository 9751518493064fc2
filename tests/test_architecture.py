"""Import order is data flow: a room imports only from rooms above it."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "compgen"

ROOMS = [
    {"exceptions", "units", "arrays", "stopping"},
    {"evaluation", "banded"},
    {"rotations"},
    {"robot", "boundaries", "surfaces", "pieces"},
    {"patterns", "geometry", "thinning"},
    {"toolpath"},
    {"kinematics", "ik"},
    {"motion", "ramps"},
    {"timing", "thermal"},
    {"sources"},
    {"predict"},
    {"problem"},
    {"interior"},
    {"limits"},
    {"compensate", "sparing", "ripple"},
    {"dialects"},
    {"inspection"},
    {"twin"},
    {"verify", "flaws"},
    {"job"},
    {"extrapolation", "waypoints", "waiting"},
    {"paging"},
    {"delivery"},
    {"correction"},
    {"rehearsal"},
    {"agenda"},
    {"tables"},
    {"schema_heat", "schema_sources"},
    {"identify"},
    {"schema"},
    {"reading"},
    {"heating", "faults"},
    {"cells"},
    {"findings"},
    {"config", "pipeline"},
    {"study"},
    {"report", "outbox"},
    {"cli"},
    {"__main__"},
]
LEVEL = {room: level for level, rooms in enumerate(ROOMS) for room in rooms}
FILES = sorted(p for p in PACKAGE.rglob("*.py") if "data" not in p.parts)
ONLY = {
    "casadi": {
        "evaluation",
        "rotations",
        "boundaries",
        "pieces",
        "surfaces",
        "geometry",
        "ik",
        "motion",
        "kinematics",
        "sources",
        "predict",
        "problem",
        "limits",
        "compensate",
        "twin",
        "verify",
        "identify",
    },
    "ruckig": {"ramps"},
    "pinocchio": {"twin", "thermal"},  # thermal: inverse dynamics of the drives' losses
    "plotly": {"report"},
    "distributed": {"study"},
    "rich": {"cli"},
    "typer": {"cli"},
    "pydantic_core": {"tables", "reading"},
    "pydantic": set(),
}


def room(path):
    parts = path.relative_to(PACKAGE).parts
    return parts[0].removesuffix(".py")


def imports(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
            if node.module == "compgen":
                yield from (f"compgen.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_rooms_import_only_from_above(path):
    here = room(path)
    if here == "__init__":
        assert not list(imports(path))
        return
    assert here in LEVEL, f"{here} has no place in the house"
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "compgen" and len(parts) > 1 and parts[1] != "__version__":
            assert parts[1] == here or LEVEL[parts[1]] < LEVEL[here], f"{here} imports {name}"
        if parts[0] in ONLY:
            assert here in ONLY[parts[0]], f"{here} imports {parts[0]}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_one_idea_a_file(path):
    assert len(path.read_text().splitlines()) <= 400


def test_the_twin_shares_no_chain_with_the_optimiser():
    reached, todo = set(), ["twin"]
    while todo:
        here = todo.pop()
        if here in reached:
            continue
        reached.add(here)
        for path in FILES:
            if room(path) == here:
                todo += [n.split(".")[1] for n in imports(path) if n.startswith("compgen.") and "." in n]
    assert not reached & {"kinematics", "sources", "predict", "problem", "limits", "compensate"}


def test_the_remote_service_of_ruckig_is_never_called():
    for path in FILES:
        assert "intermediate_" + "positions" not in path.read_text()


def test_only_the_command_line_prints_or_writes():
    for path in FILES:
        if room(path) not in {"cli", "outbox"}:
            names = {
                n.func.id
                for n in ast.walk(ast.parse(path.read_text()))
                if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
            }
            assert not names & {"print", "open", "input"}, path
