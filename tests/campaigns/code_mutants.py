"""One-line changes of the library: operators, comparisons, constants, conditions and returned values."""

import ast
import copy
import functools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = ("cli", "report", "tables", "tables.py", "schema.py", "__main__.py")
OPERATORS: dict[type[ast.AST], type[Any]] = {  # an operator's other, of its own kind
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


def span(node: ast.expr | ast.stmt, starts: list[int]) -> tuple[int, int]:
    """Where a node of a parsed text begins and ends [byte]."""
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    return starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset


def mutants_of(path: Path) -> Iterator[Mutant]:
    text = path.read_bytes()
    lines, starts = text.splitlines(keepends=True), line_starts(text)
    tree = ast.parse(text)
    choices = [(node, new) for node in expressions(tree) for new in replacements(node)]
    for node in ast.walk(tree):
        if isinstance(node, ast.Return) and node.value is not None and not isinstance(node.value, ast.Constant):
            choices.append((node.value, ast.Constant(None)))
        elif isinstance(node, ast.If | ast.While) and not isinstance(node.test, ast.Compare | ast.BoolOp | ast.UnaryOp):
            choices.append((node.test, ast.UnaryOp(ast.Not(), node.test)))
    for node, new in choices:
        start, end = span(node, starts)
        after = ast.unparse(new)
        after = after if isinstance(new, ast.Constant) else f"({after})"
        statement = lines[node.lineno - 1].decode().strip()
        yield Mutant(str(path.relative_to(ROOT)), node.lineno, start, end, text[start:end].decode(), after, statement)


def library(room: str = "") -> list[Mutant]:
    """All changes of the library, or of one room."""
    files = sorted(p for p in (ROOT / "compgen" / room).rglob("*.py") if not set(p.parts) & set(LEFT_OUT))
    return [m for p in files for m in mutants_of_file(p)]


@functools.cache
def mutants_of_file(path: Path) -> tuple[Mutant, ...]:
    """All changes of a module, looked for once."""
    return tuple(mutants_of(path))


def functions_around(mutant: Mutant) -> list[int]:
    """First lines of the functions in whose bodies a change stands, from the outermost; none at a module's level.

    A function's first line is that of its first decorator, as code objects have it. Its default arguments are worked
    out outside of it.
    """
    text = (ROOT / mutant.file).read_bytes()
    starts = line_starts(text)
    lines = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            first, last = node.body[0], node.body[-1]
            begin, end = span(first, starts)[0], span(last, starts)[1]
            if begin <= mutant.start < end:
                lines.append(min([node.lineno, *(d.lineno for d in node.decorator_list)]))
    return sorted(lines)


def line_starts(text: bytes) -> list[int]:
    """The byte at which each line begins."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    return starts


def changed(text: bytes, mutant: Mutant) -> bytes:
    """A module with the change made."""
    return text[: mutant.start] + mutant.after.encode() + text[mutant.end :]
