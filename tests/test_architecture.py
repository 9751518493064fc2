"""Import order is data flow: a room imports only from rooms above it, and inside a room nothing runs in a circle."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "compgen"

ROOMS = (
    "core",
    "robot",
    "planning",
    "thermal",
    "error_model",
    "compensation",
    "program",
    "fanuc",
    "job",
    "verification",
    "identification",
    "pipelines",
    "report",
    "cli",
)
#: sub-rooms in their order; what else stands in a room may lie anywhere between, without a circle
SUB_ROOMS = {
    "fanuc": ("listing", "canonical", "analysis", "editing", "paging"),
    "pipelines": ("files", "uncertainty", "findings", "planned", "correct", "study", "resume"),
    "cli": ("output_files", "screen", "options", "commands"),
}

#: which rooms (or files) a library is imported in
ONLY = {
    "casadi": (
        "core/evaluation",
        "core/rotations.py",
        "robot",
        "planning",
        "error_model",
        "compensation",
        "verification",
        "identification",
    ),
    "ruckig": ("planning/retiming/state_to_state.py",),
    "pinocchio": ("verification/twin", "thermal/drive_losses.py"),
    "plotly": ("report",),
    "jinja2": ("report/page.py",),
    "markupsafe": ("report",),
    "distributed": ("pipelines/study/workers.py",),
    "pandas": ("report/notebook",),
    "python_calamine": ("core/recorded/sheets.py", "verification/own_file/second_reading.py"),
    "rich": ("cli",),
    "typer": ("cli",),
}

WRITES = {
    "write_text", "write_bytes", "write", "writelines", "mkdir", "makedirs", "unlink", "rmdir", "rename", "renames",
    "touch", "symlink_to", "hardlink_to", "rmtree", "mkstemp", "mkdtemp", "copyfile", "move", "truncate",
}  # fmt: skip
EXITS = {"exit", "_exit", "abort", "kill", "killpg"}
#: who writes, prints or leaves although it is not the command line, and why
MAY = {
    "core/evaluation/compiler.py": "keeps compiled functions in a cache folder that the command line names",
    "core/interrupts.py": "answers Ctrl-C while libraries load, before there is a command line to do it",
    "pipelines/study/workers.py": "ends worker processes whose parent is gone",
}

FILES = sorted(p for p in PACKAGE.rglob("*.py") if "data" not in p.parts)
MODULES = {
    ".".join(("compgen", *p.relative_to(PACKAGE).with_suffix("").parts)).removesuffix(".__init__"): p for p in FILES
}
NAMES = {p: m for m, p in MODULES.items()}


def label(path):
    return str(path.relative_to(PACKAGE))


@cache
def nodes(path):
    """All of a file's syntax, read once."""
    return tuple(ast.walk(ast.parse(path.read_text())))


@pytest.fixture(scope="module", autouse=True)
def _read_once():
    """What was read is let go behind the last test here: all files' syntax fills a hundred megabytes."""
    yield
    nodes.cache_clear()


@cache
def imports(path):
    """Modules that a file imports, wherever in it."""
    names = []
    for node in nodes(path):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}: imports are absolute"
            inner = [f"{node.module}.{alias.name}" for alias in node.names]
            names += [name if name in MODULES else str(node.module) for name in inner]
    return tuple(names)


def own(path):
    return [name for name in imports(path) if name == "compgen" or name.startswith("compgen.")]


def test_the_house_has_fourteen_rooms_and_nothing_beside_them():
    folders = {p.name for p in PACKAGE.iterdir() if p.is_dir() and p.name not in ("__pycache__", "data")}
    assert folders == set(ROOMS)
    assert {p.name for p in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py"}
    assert all((PACKAGE / room / "__init__.py").is_file() for room in ROOMS)


@pytest.mark.parametrize("path", [p for p in FILES if p.parent != PACKAGE], ids=label)
def test_a_room_imports_only_from_rooms_above_it(path):
    room = path.relative_to(PACKAGE).parts[0]
    above = set(ROOMS[: ROOMS.index(room) + 1])
    for name in own(path):
        parts = name.split(".")
        assert len(parts) == 1 or parts[1] in above, f"{label(path)} imports {name}"


@pytest.mark.parametrize("room", ROOMS)
def test_nothing_inside_a_room_runs_in_a_circle(room):
    arrows: dict[str, set[str]] = {}
    for path in (p for p in FILES if p.relative_to(PACKAGE).parts[0] == room):
        child = NAMES[path].split(".")[2:3]
        for name in own(path):
            parts = name.split(".")
            if child and len(parts) > 2 and parts[1] == room and parts[2:3] != child:
                arrows.setdefault(child[0], set()).add(parts[2])
    try:
        tuple(TopologicalSorter(arrows).static_order())
    except CycleError as circle:
        pytest.fail(f"{room}: {' -> '.join(circle.args[1])}")
    order = SUB_ROOMS.get(room, ())
    for inner, others in arrows.items():
        if inner in order:
            later = set(order[order.index(inner) + 1 :])
            assert not others & later, f"{room}/{inner} imports {others & later}"


def test_no_file_imports_itself_through_others():
    lazily = ("compgen",)  # the public face, which everything may ask for its version
    arrows = {m: {n for n in own(p) if n != m} for m, p in MODULES.items() if m not in lazily}
    try:
        tuple(TopologicalSorter(arrows).static_order())
    except CycleError as circle:
        pytest.fail(" -> ".join(circle.args[1]))


@pytest.mark.parametrize("path", FILES, ids=label)
def test_a_library_is_imported_only_where_the_page_says(path):
    for name in imports(path):
        places = ONLY.get(name.split(".")[0])
        assert places is None or label(path).startswith(places), f"{label(path)} imports {name}"


@pytest.mark.parametrize("path", FILES, ids=label)
def test_one_idea_a_file(path):
    assert len(path.read_text().splitlines()) <= 400


def reached_from(room):
    """Modules that a room imports, itself or through others, its own among them."""
    reached, todo = set(), [m for m in MODULES if f"{m}.".startswith(f"compgen.{room}.")]
    while todo:
        module = todo.pop()
        if module not in reached:
            reached.add(module)
            todo += [n for n in own(MODULES[module]) if n in MODULES and n != "compgen"]
    return reached


def test_the_twin_shares_no_chain_with_the_optimiser():
    reached = reached_from("verification.twin")
    assert not [m for m in reached if m.split(".")[1] in ("error_model", "compensation")]
    assert "compgen.robot.kinematics" not in reached


def test_the_page_lists_all_that_twin_and_planner_share():
    page = (PACKAGE.parent / "docs" / "conventions.md").read_text()
    for module in reached_from("verification"):
        path = MODULES[module].relative_to(PACKAGE)
        names = [path.as_posix(), *(f"{folder.as_posix()}/" for folder in path.parents[:-1] if folder.parent.name)]
        assert path.parts[0] == "verification" or any(f"`{name}`" in page for name in names), (
            f"{path} is not in the page"
        )


def test_the_remote_service_of_ruckig_is_never_called():
    for path in FILES:
        assert "intermediate_" + "positions" not in path.read_text()


def calls(path):
    """Names of functions and methods that a file calls, with the module of a method where it is plain."""
    for node in nodes(path):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name):
                yield "", node.func.id, node
            elif isinstance(node.func, ast.Attribute):
                owner = node.func.value
                yield owner.id if isinstance(owner, ast.Name) else "?", node.func.attr, node


def opened_to_write(node):
    words = [a.value for a in (*node.args, *(k.value for k in node.keywords)) if isinstance(a, ast.Constant)]
    return any(isinstance(w, str) and set(w) <= set("rwaxbt+") and set(w) & set("wax+") for w in words)


#: extras that are looked for when they are asked for
OPTIONAL = ("import distributed", "import pandas")
#: parts of scipy that take longer to load than a short run, and that few runs need: where they are needed
SELDOM = ("from scipy.interpolate", "from scipy.optimize", "from scipy.sparse", "from scipy.spatial")
#: what is written to in memory
BUFFERS = ("text",)
OUTSIDE = [p for p in FILES if p.relative_to(PACKAGE).parts[0] != "cli" and p.name != "__main__.py"]


@pytest.mark.parametrize("path", [p for p in OUTSIDE if label(p) not in MAY], ids=label)
def test_only_the_command_line_prints_writes_or_exits(path):
    for owner, name, node in calls(path):
        where = f"{label(path)}:{node.lineno} calls {owner}.{name}"
        assert not (owner == "" and name in ("print", "input", "breakpoint")), where
        assert not (name == "open" and opened_to_write(node)), where
        assert name not in WRITES or owner in BUFFERS or (owner == "" and name in ("write", "move")), where
        assert name not in EXITS, where
    assert "SystemExit" not in path.read_text(), label(path)


def test_the_exceptions_are_still_needed():
    for name in MAY:
        touched = {called for _, called, _ in calls(PACKAGE / name)}
        assert touched & (WRITES | EXITS), name


@pytest.mark.parametrize("path", OUTSIDE, ids=label)
def test_no_clock_no_chance_no_environment_outside_the_command_line(path):
    if label(path) in MAY:
        return
    forbidden = {"time", "random", "secrets", "socket", "urllib", "http", "datetime"}
    if label(path) == "core/recorded/times.py":  # reads dates that a file has
        assert not {"now", "today", "utcnow"} & {name for _, name, _ in calls(path)}
        forbidden.remove("datetime")
    for name in imports(path):
        assert name.split(".")[0] not in forbidden, f"{label(path)} imports {name}"
    text = path.read_text()
    assert "os.environ" not in text, label(path)
    assert "default_rng()" not in text, label(path)


@pytest.mark.parametrize("path", OUTSIDE, ids=label)
def test_imports_stand_at_the_top(path):
    if path == PACKAGE / "__init__.py":
        return
    for node in nodes(path):
        if isinstance(node, ast.FunctionDef):
            inner = [n for n in ast.walk(node) if isinstance(n, ast.Import | ast.ImportFrom)]
            inner = [n for n in inner if not ast.unparse(n).startswith((*OPTIONAL, *SELDOM))]
            assert not inner, f"{label(path)}: {node.name} imports inside"
            assert node.name != "__getattr__", label(path)


#: unit factors as numbers; they stand in core/units alone, with a name
FACTORS = {1e-6, 1e-3, 1e3, 1e6, 60, 180, 3600}
#: files where such a number is no unit, and why
NO_UNITS = {
    "core/decimals.py": "digits",
    "report/job_summary.py": "a published number, mid_spatial_rms_nm, keeps its last digit",
}


def raw_factors(path):
    """Products and quotients with a bare unit factor; a tolerance has a name, so it is none of them."""
    for node in nodes(path):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
            sides = [s.value for s in (node.left, node.right) if isinstance(s, ast.Constant)]
            if any(value in FACTORS for value in sides if not isinstance(value, str | bytes)):
                yield f"{label(path)}:{node.lineno}: {ast.unparse(node)}"


@pytest.mark.parametrize("path", [p for p in FILES if label(p) != "core/units.py"], ids=label)
def test_unit_factors_have_their_names(path):
    raw = list(raw_factors(path))
    assert not raw or label(path) in NO_UNITS, raw


def test_files_without_units_still_need_their_exception():
    for name in NO_UNITS:
        assert list(raw_factors(PACKAGE / name)), name


def is_private(name):
    return name.startswith("_") and not name.startswith("__") and name != "_"


def given_names():
    """What the package gives a name: functions, classes, constants, attributes, modules."""
    for path in FILES:
        yield path.stem
        for node in nodes(path):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                yield node.name
            elif isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                yield node.id if isinstance(node, ast.Name) else node.attr


@cache
def private_names():
    """Names with a leading underscore: what the package keeps to itself."""
    return {name for name in given_names() if is_private(name)}


PATCHES = {"getattr", "setattr", "delattr", "object"}  # whose arguments name what is patched


def reached(tree):
    """Private names of the package that a test imports, asks an object for, or names in a string to patch."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("compgen"):
            yield from (f"{node.lineno}: {alias.name}" for alias in node.names if is_private(alias.name))
        elif isinstance(node, ast.Attribute) and node.attr in private_names():
            if ast.unparse(node.value) not in ("self", "os"):
                yield f"{node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in PATCHES:
            texts = [x.value for x in node.args if isinstance(x, ast.Constant) and isinstance(x.value, str)]
            yield from (f"{node.lineno}: {text!r}" for text in texts if text.split(".")[-1] in private_names())


TEST_FILES = sorted(Path(__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("path", TEST_FILES, ids=lambda path: path.relative_to(Path(__file__).parent).as_posix())
def test_no_test_reaches_behind_the_public_face(path):
    assert not list(reached(ast.parse(path.read_text())))


def test_what_reaches_behind_the_public_face_is_seen():
    name = min(private_names())
    patches = f"setattr(x, '{name}', 1)", f"monkeypatch.setattr('compgen.core.{name}', 1)"
    for text in (f"from compgen.core import {name}", f"x.{name}", *patches):
        assert len(list(reached(ast.parse(text)))) == 1
    assert not list(reached(ast.parse(f"self.{name}")))


MANY = 6  # fields from which on a record is built by keywords
MOST_IN_ORDER = 7  # arguments of a call without their names


def test_records_of_many_fields_are_built_by_keywords():
    wrong = []
    for file in FILES:
        for record in (node for node in nodes(file) if isinstance(node, ast.ClassDef)):
            how = next((ast.unparse(d) for d in record.decorator_list if "dataclass" in ast.unparse(d)), None)
            count = sum(
                isinstance(n, ast.AnnAssign) and "ClassVar" not in ast.unparse(n.annotation) for n in record.body
            )
            if how is not None and count >= MANY and "kw_only=True" not in how:
                wrong.append(f"{label(file)}: {record.name}")
    assert wrong == []


def test_no_call_gives_many_arguments_by_their_order():
    wrong = [
        f"{label(file)}: line {call.lineno}"
        for file in FILES
        for call in (node for node in nodes(file) if isinstance(node, ast.Call))
        if len(call.args) > MOST_IN_ORDER and not is_listing(call)
    ]
    assert wrong == []


def is_listing(call):
    """Things of one kind, as many as there are: columns of a table, arguments of an expression."""
    return ast.unparse(call.func).split(".")[-1] in ("Table", "evaluate")
