"""What a statement makes of registers, where constants tell: PR[n]=..., PR[n,i]=..., R[n]=..., UFRAME[n]=PR[m].

Position registers are added and subtracted number by number, W P R among them; that is what a controller does (measured
on a simulated R-2000iC and published, with the manual's own words, by makers of converters; see docs/correct.md).
Whatever is not understood leaves what it names unknown.
"""

import ast
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from compgen.program.registers import CARTESIAN, EITHER, JOINT, Register

Key = tuple[str, int]  # kind and number: ("PR", 5), ("R", 1), ("UFRAME", 4), ("UTOOL", 2), ("OFFSET", 0)
UNKNOWN = Register()
ANY = -1  # some frame, found at run time; of registers, those that are not named
_NAME = re.compile(r"\s*(PR|R|P|UFRAME|UTOOL)\[", re.IGNORECASE)
_INDEX = re.compile(r"\s*(\d{1,9})\s*(?:,\s*([1-6])\s*)?(?::.*)?$", re.DOTALL)
_NUMBER = re.compile(r"\s*(\d+\.?\d*|\.\d+)")
_HERE = re.compile(r"\s*(LPOS|JPOS)(?![^\W_])", re.IGNORECASE)
_MOST_TOKENS = 200  # numbers, registers and signs of an expression; a longer one is not followed
_OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}


@dataclass(frozen=True, slots=True)
class KnownValues:
    """What is known at one place of a program.

    Of a frame or tool that is missing the value is that of the table, unless ``(kind, ANY)`` is there; of anything else
    that is missing none is known. A register that may be in joint form stays so until it is written whole.
    """

    known: Mapping[Key, Register | float | None]
    position: Callable[[int], Register]  # of P[n]
    frame: Callable[[str, int], Register]  # of a UFRAME or UTOOL by the table

    def register(self, number: int) -> Register:
        """A position register."""
        value = self.known.get(("PR", number), self.known.get(("PR", ANY), UNKNOWN))
        return value if isinstance(value, Register) else UNKNOWN

    def frame_value(self, kind: str, number: int) -> Register:
        """A frame or tool: as written, else as the table has it."""
        if (kind, number) not in self.known:
            return UNKNOWN if (kind, ANY) in self.known else self.frame(kind, number)
        value = self.known[kind, number]
        return value if isinstance(value, Register) else UNKNOWN

    def of(self, kind: str, number: int) -> Register:
        """A position register, a position, a frame or a tool."""
        if kind == "PR":
            return self.register(number)
        return self.position(number) if kind == "P" else self.frame_value(kind, number)


def bracketed(text: str, at: int) -> tuple[str, int] | None:
    """What stands in the brackets that open at a place, and where they end; None where they do not close."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == "[") - (text[i] == "]")
        if depth == 0:
            return text[at + 1 : i], i + 1
    return None


def element(text: str, at: int = 0) -> tuple[str, int | None, int | None, int] | None:
    """Kind, number, component and end of a register, position or frame at a place; None where there is none.

    The number is None where run time tells it.
    """
    match = _NAME.match(text, at)
    inside = bracketed(text, match.end() - 1) if match else None
    if match is None or inside is None:
        return None
    index = _INDEX.match(inside[0])
    number = int(index[1]) if index else None
    return match[1].upper(), number, int(index[2]) - 1 if index and index[2] else None, inside[1]


def evaluate_register(text: str, values: KnownValues) -> Register:
    """The position register that an expression makes: registers, positions and frames, added and subtracted."""
    terms: list[tuple[float, Register, str]] = []  # sign, and a name under which it is the same again
    at, sign = 0, 1.0
    while (term := _register_term(text, at, values)) is not None:
        register, name, at = term
        terms.append((sign, register, name))
        rest = text[at:].lstrip()
        if not rest or rest[0] == ";":
            return _sum(terms)
        if rest[0] not in "+-":
            break
        sign, at = (1.0 if rest[0] == "+" else -1.0), len(text) - len(rest) + 1
    return UNKNOWN


def _register_term(text: str, at: int, values: KnownValues) -> tuple[Register, str, int] | None:
    """A term, its name, and where it ends; None where none is understood."""
    if here := _HERE.match(text, at):
        return Register(CARTESIAN if here[1].upper() == "LPOS" else JOINT), "", here.end()
    kind, number, component, end = element(text, at) or ("R", None, None, at)
    if kind == "R" or number is None or component is not None:
        return None
    return values.of(kind, number), f"{kind}{number}", end


def _sum(terms: Sequence[tuple[float, Register, str]]) -> Register:
    """The sum, number by number; a register less itself is zero, whatever it holds."""
    (_, total, first), *others = terms
    for k, (sign, term, name) in enumerate(others):
        if k == 0 and sign < 0 and name and name == first:
            total = Register(term.form, (0.0,) * 6)
        elif JOINT in (total.form, term.form) and total.form != term.form:
            total = UNKNOWN
        else:
            pairs = zip(total.values, term.values, strict=True)
            numbers = (None if a is None or b is None else a + sign * b for a, b in pairs)
            total = Register(total.form or term.form, tuple(numbers))
    return total


def evaluate_number(text: str, values: KnownValues) -> float | None:
    """The number that an expression makes of constants and known registers; None where it is not known."""
    tokens, operands, at, text = list[str](), list[float](), 0, text.strip(" ;")
    while at < len(text):
        if text[at] in "+-*/() \t":
            tokens.append(text[at].strip())
            at += 1
            continue
        operand = _operand(text, at, values)
        if operand is None or len(tokens) > _MOST_TOKENS:
            return None
        tokens.append(f"_{len(operands)}")
        operands.append(operand[0])
        at = operand[1]
    try:
        return _value(ast.parse(" ".join(filter(None, tokens)), mode="eval").body, operands)
    except SyntaxError:
        return None


def _operand(text: str, at: int, values: KnownValues) -> tuple[float, int] | None:
    """A constant, R[n] or PR[n,i] that is known, and where it ends."""
    if match := _NUMBER.match(text, at):
        return float(match[1]), match.end()
    kind, number, component, end = element(text, at) or ("", None, None, at)
    value: Register | float | None = None
    if number is not None and kind == "R" and component is None:
        value = values.known.get(("R", number))
    elif number is not None and kind == "PR" and component is not None:
        value = values.register(number).values[component]
    return (value, end) if isinstance(value, float) else None


def _value(node: ast.expr, operands: Sequence[float]) -> float | None:
    """The value of an expression whose operands are named _0, _1, ...; None for what is no sum or product of them."""
    if isinstance(node, ast.Name):
        return operands[int(node.id[1:])]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        value = _value(node.operand, operands)
        return None if value is None else -value
    if not isinstance(node, ast.BinOp) or type(node.op) not in _OPERATIONS:
        return None
    left, right = _value(node.left, operands), _value(node.right, operands)
    if left is None or right is None or (isinstance(node.op, ast.Div) and right == 0):
        return None
    return _OPERATIONS[type(node.op)](left, right)


def with_component(register: Register, component: int, value: float | None) -> Register:
    """A register with one of its numbers set."""
    numbers = list(register.values)
    numbers[component] = value
    return Register(register.form or EITHER, tuple(numbers))
