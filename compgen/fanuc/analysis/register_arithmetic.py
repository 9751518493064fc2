"""What a statement makes of registers, where constants tell: PR[n]=..., PR[n,i]=..., R[n]=..., UFRAME[n]=PR[m].

Position registers are added and subtracted number by number, W P R among them; that is what a controller does (measured
on a simulated R-2000iC and published, with the manual's own words, by makers of converters; see docs/correct.md).
Whatever is not understood leaves what it names unknown.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from compgen.fanuc.registers import CARTESIAN, EITHER, JOINT, Register

Key = tuple[str, int]  # kind and number: ("PR", 5), ("R", 1), ("UFRAME", 4), ("UTOOL", 2), ("OFFSET", 0)
UNKNOWN = Register()
ANY = -1  # some frame, found at run time; of registers, those that are not named
_NAME = re.compile(r"\s*(PR|R|P|UFRAME|UTOOL)\[", re.IGNORECASE)
_INDEX = re.compile(r"\s*(\d{1,9})\s*(?:,\s*([1-6])\s*)?(?::.*)?$", re.DOTALL)
_NUMBER = re.compile(r"\s*(\d+\.?\d*|\.\d+)")
_DEEPEST = 20  # brackets in brackets


@dataclass(frozen=True, slots=True)
class Values:
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


def evaluate_register(text: str, values: Values) -> Register:
    """The position register that an expression makes: registers, positions and frames, added and subtracted."""
    total: Register | None = None
    seen: list[tuple[str, str]] = []
    at, sign = 0, "+"
    while True:
        term, at, name = _register_term(text, at, values)
        if term is None:
            return UNKNOWN
        if seen and sign == "-" and len(seen) == 1 and seen[0] == ("+", name) and name:
            total = Register(term.form, (0.0,) * 6)  # a register less itself, whatever it holds
        else:
            total = term if total is None else _added(total, term, 1.0 if sign == "+" else -1.0)
        seen.append((sign, name))
        rest = text[at:].lstrip()
        if not rest or rest[0] == ";":
            return total
        if rest[0] not in "+-":
            return UNKNOWN
        sign, at = rest[0], len(text) - len(rest) + 1


def _register_term(text: str, at: int, values: Values) -> tuple[Register | None, int, str]:
    """A term, where it ends, and a name under which it is the same again."""
    rest = text[at:].lstrip()
    at = len(text) - len(rest)
    for word, form in (("LPOS", CARTESIAN), ("JPOS", JOINT)):
        if rest[:4].upper() == word and not rest[4:5].isalnum():
            return Register(form), at + 4, ""
    part = element(text, at)
    if part is None:
        return None, at, ""
    kind, number, component, end = part
    if number is None or component is not None or kind == "R":
        return None, at, ""
    if kind == "PR":
        return values.register(number), end, f"PR{number}"
    if kind == "P":
        return values.position(number), end, f"P{number}"
    return values.frame_value(kind, number), end, f"{kind}{number}"


def _added(a: Register, b: Register, sign: float) -> Register:
    if JOINT in (a.form, b.form) and a.form != b.form:
        return UNKNOWN
    numbers = (None if x is None or y is None else x + sign * y for x, y in zip(a.values, b.values, strict=True))
    return Register(a.form or b.form, tuple(numbers))


def evaluate_number(text: str, values: Values) -> float | None:
    """The number that an expression makes of constants and known registers; None where it is not known."""
    result = _sum(text, 0, values, 0)
    if result is None or text[result[1] :].strip(" ;"):
        return None
    return result[0]


def _sum(text: str, at: int, values: Values, depth: int) -> tuple[float, int] | None:
    total = _product(text, at, values, depth)
    while total is not None:
        rest = text[total[1] :].lstrip()
        if rest[:1] not in ("+", "-") or not rest:
            return total
        term = _product(text, len(text) - len(rest) + 1, values, depth)
        if term is None:
            return None
        total = (total[0] + term[0] if rest[0] == "+" else total[0] - term[0]), term[1]
    return None


def _product(text: str, at: int, values: Values, depth: int) -> tuple[float, int] | None:
    total = _factor(text, at, values, depth)
    while total is not None:
        rest = text[total[1] :].lstrip()
        if rest[:1] not in ("*", "/") or not rest:
            return total
        term = _factor(text, len(text) - len(rest) + 1, values, depth)
        if term is None or (rest[0] == "/" and term[0] == 0):
            return None
        total = (total[0] * term[0] if rest[0] == "*" else total[0] / term[0]), term[1]
    return None


def _factor(text: str, at: int, values: Values, depth: int) -> tuple[float, int] | None:
    rest = text[at:].lstrip()
    at = len(text) - len(rest)
    if depth > _DEEPEST or not rest:
        return None
    if rest[0] == "-":
        term = _factor(text, at + 1, values, depth + 1)
        return None if term is None else (-term[0], term[1])
    if rest[0] == "(":
        inner = _sum(text, at + 1, values, depth + 1)
        if inner is None or not text[inner[1] :].lstrip().startswith(")"):
            return None
        return inner[0], text.index(")", inner[1]) + 1
    if match := _NUMBER.match(text, at):
        return float(match[1]), match.end()
    part = element(text, at)
    if part is None:
        return None
    kind, number, component, end = part
    if number is None:
        return None
    if kind == "R" and component is None:
        value = values.known.get(("R", number))
        return (value, end) if isinstance(value, float) else None
    if kind == "PR" and component is not None:
        of = values.register(number).values[component]
        return None if of is None else (of, end)
    return None


def with_component(register: Register, component: int, value: float | None) -> Register:
    """A register with one of its numbers set."""
    numbers = list(register.values)
    numbers[component] = value
    return Register(register.form or EITHER, tuple(numbers))
