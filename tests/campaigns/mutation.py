"""One-line changes of the library, and whether a test notices: what passes every test is a hole in the tests.

python tests/campaigns/mutation.py --seeds 0:300            draws, tries and adds to mutation.jsonl; again goes on
python tests/campaigns/mutation.py --seeds 0:300 --table    only the table of what is in mutation.jsonl
python tests/campaigns/mutation.py --seeds 0:300 --wide     survivors of their room meet all other tests too

A seed draws one place of the library (operator, comparison, constant, condition or returned value outside cli, report,
tables and messages) and changes it in a copy of the tree. The tests that import the module run first, then its room's.
equivalent.toml lists the changes that cannot be noticed, each with its reason.
"""

import argparse
import ast
import copy
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

ROOT = Path(__file__).resolve().parents[2]
JOURNAL = ROOT / "tests" / "campaigns" / "mutation.jsonl"
EQUIVALENT = ROOT / "tests" / "campaigns" / "equivalent.toml"
LEFT_OUT = ("cli", "report", "tables", "tables.py", "schema.py", "__main__.py")
OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Div,
    ast.Mod: ast.Mult, ast.Pow: ast.Mult, ast.BitOr: ast.BitAnd, ast.BitAnd: ast.BitOr,
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change: file, line, the bytes that go, and those that come."""

    file: str
    line: int
    start: int
    end: int
    before: str
    after: str
    statement: str  # the line as it was, to recognise it when lines have moved


def replacements(node: ast.AST) -> Iterator[ast.expr]:
    """What may stand in an expression's place."""
    other = copy.deepcopy(node)
    match other:
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            other.op = OPERATORS[type(op)]()
            yield other
        case ast.Compare(ops=[op]) if type(op) in OPERATORS:
            other.ops = [OPERATORS[type(op)]()]
            yield other
        case ast.BoolOp(op=op):
            other.op = OPERATORS[type(op)]()
            yield other
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(2 * value if value else 1.0)
        case ast.IfExp(test=test):
            other.test = ast.UnaryOp(ast.Not(), test)
            yield other


def expressions(node: ast.AST) -> Iterator[ast.expr]:
    """Expressions under a node that calculate: no annotations, messages, decorators and docstrings."""
    if isinstance(node, ast.Raise | ast.JoinedStr):
        return
    if isinstance(node, ast.expr):
        yield node
    for name, field in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "slice" if isinstance(node, ast.AnnAssign) else ""):
            continue
        for child in field if isinstance(field, list) else [field]:
            if isinstance(child, ast.AST):
                yield from expressions(child)


def mutants_of(path: Path) -> Iterator[Mutant]:
    text = path.read_bytes()
    lines = text.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    tree = ast.parse(text)
    choices = [(node, new) for node in expressions(tree) for new in replacements(node)]
    for node in ast.walk(tree):
        if isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
            choices.append((node.value, ast.Constant(None)))
        elif isinstance(node, ast.If | ast.While) and not isinstance(node.test, ast.Compare | ast.BoolOp | ast.UnaryOp):
            choices.append((node.test, ast.UnaryOp(ast.Not(), node.test)))
    for node, new in choices:
        start, end = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        after = ast.unparse(new)
        after = after if isinstance(new, ast.Constant) else f"({after})"
        statement = lines[node.lineno - 1].decode().strip()
        yield Mutant(str(path.relative_to(ROOT)), node.lineno, start, end, text[start:end].decode(), after, statement)


def library() -> list[Mutant]:
    files = sorted(p for p in (ROOT / "compgen").rglob("*.py") if not set(p.parts) & set(LEFT_OUT))
    return [m for p in files for m in mutants_of(p)]


# Trying ----------------------------------------------------------------------------------------------------------


def stages(mutant: Mutant, wide: bool) -> list[list[str]]:
    """Test files in the order tried: those that import the module, the rest of its room, and everything else."""
    module = Path(mutant.file).with_suffix("")
    name, package = module.parts[-1], ".".join(module.parts[:-1])
    files = sorted(str(p.relative_to(ROOT)) for p in (ROOT / "tests").rglob("test_*.py"))
    imports = re.compile(rf"{package}\.{name}\b|from {package} import .*\b{name}\b")
    near = [f for f in files if f.endswith(f"/test_{name}.py") or imports.search((ROOT / f).read_text())]
    own = [f for f in files if f.split("/")[1] == module.parts[1] and f not in near]
    others = [f for f in files if f not in near and f not in own and "test_architecture" not in f]
    return [stage for stage in (near, own, others if wide else []) if stage]


def pytest_run(tree: Path, *arguments: str, seconds: float | None = None) -> tuple[int | None, list[str]]:
    """Exit code, None when the time is over, and the tests that failed."""
    command = [sys.executable, "-m", "pytest", "--no-header", "--tb=no", "-p", "no:cacheprovider", *arguments]
    process = subprocess.Popen(
        command, cwd=tree, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
    )
    try:
        output, _ = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return None, []
    failed = [line.split(" ")[1] for line in output.splitlines() if line.startswith(("FAILED ", "ERROR "))]
    return process.returncode, failed


class Baseline:
    """Tests that fail without any change prove nothing: each file is run once as it is, and they are left out."""

    def __init__(self, tree: Path) -> None:
        self._tree = tree
        self._failing: dict[str, list[str]] = {}
        self._lock = Lock()

    def deselected(self, files: list[str]) -> list[str]:
        with self._lock:
            for file in files:
                if file not in self._failing:
                    self._failing[file] = pytest_run(self._tree, file)[1]
            return [f"--deselect={test}" for file in files for test in self._failing[file]]


def tested(tree: Path, files: list[str], deselected: list[str], seconds: float) -> str:
    """``passed``, ``timed out``, or the first test that fails."""
    code, failed = pytest_run(tree, "-x", *files, *deselected, seconds=seconds)
    if code is None:
        return "timed out"
    if code in (0, 5):  # 5: nothing to run
        return "passed"
    return failed[0] if failed else f"exit {code}"


def attempt(tree: Path, mutant: Mutant, baseline: Baseline, wide: bool, seconds: float) -> tuple[str, str]:
    """``caught``, ``timed out`` or ``survived``, and the test that noticed."""
    path = tree / mutant.file
    text = path.read_bytes()
    try:
        rewrite(path, text[: mutant.start] + mutant.after.encode() + text[mutant.end :])
        for files in stages(mutant, wide):
            answer = tested(tree, files, baseline.deselected(files), seconds)
            if answer != "passed":
                return ("timed out", "") if answer == "timed out" else ("caught", answer)
        return "survived", ""
    finally:
        rewrite(path, text)


def rewrite(path: Path, text: bytes) -> None:
    """Another text of a module, without what was compiled of the last: it may have the same size and second."""
    path.write_bytes(text)
    for compiled in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
        compiled.unlink()


def copied_tree(folder: Path) -> Path:
    ignore = shutil.ignore_patterns(".git", ".venv", "outputs", "__pycache__", ".*_cache", "*.jsonl")
    return Path(shutil.copytree(ROOT, folder, ignore=ignore))


def campaign(seeds: range, wide: bool, seconds: float, processes: int) -> None:
    done = {row["seed"] for row in journal() if row["wide"] >= wide or row["result"] != "survived"}
    pool = library()
    with tempfile.TemporaryDirectory() as folder:
        trees: SimpleQueue[Path] = SimpleQueue()
        baseline = Baseline(copied_tree(Path(folder) / "as it is"))
        for n in range(processes):
            trees.put(copied_tree(Path(folder) / str(n)))

        def work(seed: int) -> None:
            mutant = random.Random(seed).choice(pool)
            tree = trees.get()
            try:
                outcome, test = attempt(tree, mutant, baseline, wide, seconds)
            finally:
                trees.put(tree)
            row = {"seed": seed, "wide": wide, "result": outcome, "test": test, **asdict(mutant)}
            with JOURNAL.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{seed} {outcome} {mutant.file}:{mutant.line} {mutant.before} -> {mutant.after} {test}", flush=True)

        with ThreadPoolExecutor(processes) as executor:
            list(executor.map(work, [s for s in seeds if s not in done]))


# Telling ---------------------------------------------------------------------------------------------------------


def journal() -> list[dict]:
    return [json.loads(line) for line in JOURNAL.read_text().splitlines()] if JOURNAL.exists() else []


def table(seeds: range) -> str:
    """Counts and each survivor; the last trial of a seed counts."""
    rows = {row["seed"]: row for row in journal() if row["seed"] in seeds}
    reasons = {
        (e["file"], e["statement"], e["after"]): e["reason"]
        for e in tomllib.loads(EQUIVALENT.read_text()).get("mutant", [])
    }
    counts: Counter[str] = Counter()
    lines = []
    for seed, row in sorted(rows.items()):
        result = row["result"]
        if result == "survived" and (row["file"], row["statement"], row["after"]) in reasons:
            result = "equivalent"
        counts[result] += 1
        if result in ("survived", "timed out"):
            lines.append(f"  {seed} {result}: {row['file']}:{row['line']}: {row['before']} -> {row['after']}")
            lines.append(f"      {row['statement']}")
    total, judged = len(rows), len(rows) - counts["equivalent"]
    noticed = counts["caught"]  # whether one that timed out is noticed is for a reader to say
    head = f"tried {total}, caught {counts['caught']}, timed out {counts['timed out']}, survived {counts['survived']}, "
    head += f"equivalent {counts['equivalent']}: {100 * noticed / max(judged, 1):.1f} % of {judged} noticed"
    return "\n".join([head, *lines])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0:10", help="first:end")
    parser.add_argument("--wide", action="store_true", help="also the tests of other rooms")
    parser.add_argument("--seconds", type=float, default=300, help="limit of each stage")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--table", action="store_true", help="only tell what was tried")
    arguments = parser.parse_args()
    first, end = (int(part) for part in arguments.seeds.split(":"))
    if not arguments.table:
        campaign(range(first, end), arguments.wide, arguments.seconds, arguments.processes)
    print(table(range(first, end)))


if __name__ == "__main__":
    main()
