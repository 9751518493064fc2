"""Statements of a program, read with care, one physical line after the other.

Two traps of real files are met here: a remark that wraps to a line looking like a move, and numbers that restart inside
point logic.
"""

from dataclasses import dataclass, field

from compgen.core.exceptions import InputError
from compgen.fanuc.listing.position_parser import NO_NUMBER, Span
from compgen.fanuc.statements import (
    LINE_NUMBER,
    MOTION,
    NUMBER_AND_NAME,
    SPEED,
    SPEED_NUMBER,
    TARGET,
    TERMINATION,
)

LARGEST = 999_999_999  # of all numbers of positions


@dataclass(slots=True)
class Move:
    """A motion statement, and where its parts stand."""

    line: int  # physical line at which it begins, from 1
    letter: str
    disabled: bool
    target: list[Span] = field(default_factory=list)  # inside the brackets
    kind: list[str] = field(default_factory=list)  # P or PR
    speed: Span = (0, 0)
    termination: Span = (0, 0)
    options: str = ""
    span: Span = (0, 0)  # from the letter to the end of the statement's text


@dataclass(slots=True)
class Statements:
    """What was read so far: moves, statements, remarks; and what the next line may belong to."""

    data: bytes
    moves: list[Move] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)  # at which statements begin
    remarks: list[tuple[int, str]] = field(default_factory=list)  # line and text
    state: str = ""  # "" between statements, "!" in a remark, "C" a motion without its end, "m" one, "x" other text
    move: Move = field(default_factory=lambda: Move(0, "", False))  # the one at work

    def between(self) -> None:
        """A statement begins here, whatever came before.

        Raises:
            InputError: What came before is a C without its end point.
        """
        if self.state == "C":
            raise InputError(f"program: line {self.move.line}: this C has no end point; mend it")
        self.state = ""

    def read(self, at: int, stop: int, number: int) -> None:
        """The next physical line.

        Raises:
            InputError: A move whose target is not understood, or a C without its end point; names the line.
        """
        data = self.data
        while stop > at and data[stop - 1] in b"\r\n":
            stop -= 1
        mark = LINE_NUMBER.match(data, at, stop)
        if mark is None:
            return
        if mark[1]:
            self.between()
        body = mark.end()
        close = data.find(b";", body, stop)
        limit = close if close >= 0 else stop
        if self.state == "":
            self.lines.append(number)
            if found := MOTION.match(data, body, limit):
                self.state, body = "C", found.end()
                self.move = Move(number, found[2].decode().upper(), bool(found[1]), span=(found.start(2), limit))
            elif data[body:limit].lstrip()[:1] == b"!":
                self.state = "!"
                self.remarks.append((number, data[body:limit].lstrip()[1:].decode("latin-1").rstrip()))
            else:
                self.state = "x"
        if self.state == "C":
            self._go_on(body, limit, number, close >= 0)
        elif self.state == "m":
            _more(data, self.move, body, limit)
        if close >= 0:
            self.state = ""

    def _go_on(self, at: int, limit: int, number: int, last: bool) -> None:
        """Targets of a motion, and what follows the last of them."""
        data, move = self.data, self.move
        at = _targets(data, move, at, limit)
        if not move.target:
            raise InputError(f"program: line {number}: the target of this move is not understood; mend it")
        if any(own_number(data, move, i) > LARGEST for i in range(len(move.target))):
            raise InputError(f"program: line {number}: no position has a number above {LARGEST}; mend it")
        if last or move.letter != "C" or len(move.target) > 1 or number > move.line:
            move.options = _tail(data, move, at, limit)
            move.span = (move.span[0], limit)
            self.moves.append(move)
            self.state = "m"


def _targets(data: bytes, move: Move, at: int, limit: int) -> int:
    """Adds the targets from a place on; gives where they end."""
    while target := TARGET.match(data, at, limit):
        move.kind.append(target[1].decode().upper())
        move.target.append(target.span(2))
        at = target.end()
    return at


def _tail(data: bytes, move: Move, at: int, limit: int) -> str:
    """Takes what is still missing of speed and termination from a place on; gives the rest."""
    if move.speed[1] == 0:
        found = SPEED.match(data, at, limit)
        at = found.end() if found else at
        move.speed = (found.start(1 if found[1] else 3), at) if found else (at, at)
    if found := TERMINATION.match(data, at, limit):
        move.termination, at = found.span(1), found.end()
    return data[at:limit].decode("latin-1").strip()


def _more(data: bytes, move: Move, at: int, limit: int) -> None:
    """A motion whose statement runs on: what is still missing is taken from the next line, the rest are options."""
    if move.termination[1] or move.options:
        move.options = f"{move.options} {data[at:limit].decode('latin-1').strip()}".strip()
    else:
        if move.speed[0] == move.speed[1]:
            move.speed = (0, 0)
        move.options = _tail(data, move, at, limit)
    move.span = (move.span[0], limit)


def target_text(data: bytes, move: Move, i: int) -> str:
    """A target as written: ``P[3:name]``, ``PR[1]``."""
    return f"{move.kind[i]}[{data[slice(*move.target[i])].decode('latin-1')}]"


def own_parts(data: bytes, move: Move, i: int) -> tuple[Span, Span]:
    """Where n and the name of a target P[n:name] stand; nowhere when it is another target."""
    found = NUMBER_AND_NAME.match(data, *move.target[i]) if move.kind[i] == "P" else None
    return (found.span(1), found.span(2)) if found else ((-1, -1), (-1, -1))


def own_number(data: bytes, move: Move, i: int) -> int:
    """n of a target P[n] or P[n:name]; anything else is not in the file."""
    (start, end), _ = own_parts(data, move, i)
    return int(data[start : min(end, start + 10)]) if end > start else NO_NUMBER


def speed_number(data: bytes, move: Move) -> Span:
    """Where the number of a speed stands; nowhere when it is a register or a word."""
    found = SPEED_NUMBER.match(data, *move.speed)
    return found.span() if found else (-1, -1)


def line_number(data: bytes, at: int, stop: int) -> Span | None:
    """Where the number of a numbered line stands."""
    found = LINE_NUMBER.match(data, at, stop)
    return found.span(1) if found and found[1] else None
