"""Statements of a program, read with care, one physical line after the other.

Two traps of real files are met here: a remark that wraps to a line looking like a move, and numbers that restart inside
point logic.
"""

from dataclasses import dataclass, field

from compgen.core.exceptions import InputError
from compgen.fanuc.listing.position_parser import NO_NUMBER, Span
from compgen.fanuc.vocabulary import (
    LINE_NUMBER,
    MOTION,
    NUMBER_AND_NAME,
    SPEED,
    SPEED_NUMBER,
    TARGET,
    TERMINATION,
    VIA_OPTIONS,
)

LONGEST_STATEMENT = 65_536  # characters, far beyond what a controller prints
LARGEST_NUMBER = 999_999_999  # of all numbers of positions


@dataclass(slots=True, kw_only=True)
class ParsedMotion:
    """A motion statement, and where its parts stand."""

    line: int  # physical line at which it begins, from 1
    letter: str
    disabled: bool
    target: list[Span] = field(default_factory=list)  # inside the brackets
    kind: list[str] = field(default_factory=list)  # P, PR or PAL_n
    speed: Span = (0, 0)
    termination: Span = (0, 0)
    options: str = ""
    has_tail: bool = False  # options stand behind speed and termination, or where these should: nothing else is taken
    span: Span = (0, 0)  # from the letter to the end of the statement's text


@dataclass(slots=True, kw_only=True)
class StatementParser:
    """What was read so far: moves, statements, remarks; and what the next line may belong to."""

    data: bytes
    moves: list[ParsedMotion] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)  # at which statements begin
    remarks: list[tuple[int, str]] = field(default_factory=list)  # line and text
    state: str = ""  # "" between statements, "!" in a remark, "C" a motion without its end, "m" one, "x" other text
    move: ParsedMotion = field(
        default_factory=lambda: ParsedMotion(line=0, letter="", disabled=False)
    )  # the one at work

    def begin_statement(self) -> None:
        """A statement begins here, whatever came before.

        Raises:
            InputError: What came before is a C without its end point.
        """
        if self.state == "C":
            raise InputError(f"program: line {self.move.line}: this C has no end point; a C has a via and an end")
        self.state = ""

    def read(self, at: int, stop: int, number: int) -> None:
        """The next physical line.

        Raises:
            InputError: A move whose target is not understood, a C without its end point, or two statements in one line;
                names the line.
        """
        data = self.data
        while stop > at and data[stop - 1] in b"\r\n":
            stop -= 1
        mark = LINE_NUMBER.match(data, at, stop)
        if mark is None:
            return
        if mark[1]:
            self.begin_statement()
        body = mark.end()
        close = data.find(b";", body, stop)
        limit = close if close >= 0 else stop
        if self.state == "":
            body = self._open_statement(body, limit, number)
        if self.state == "C" and (close >= 0 or number == self.move.line or data[body:limit].strip(b" \t")):
            self._continue_motion(body, limit, number)
        elif self.state == "m":
            if limit - self.move.span[0] > LONGEST_STATEMENT:
                raise too_long(self.move.line)
            _continue_options(data, self.move, body, limit)
        if close >= 0:
            other = LINE_NUMBER.match(data, close + 1, stop)
            if other and other[1] and self.state != "!":
                raise InputError(f"program: line {number}: a second statement stands behind its ';'; part the lines")
            self.begin_statement()

    def _open_statement(self, body: int, limit: int, number: int) -> int:
        """What kind of statement begins on a line; where the rest of it is to be read."""
        self.lines.append(number)
        if match := MOTION.match(self.data, body, limit):
            self.state, body = "C", match.end()
            self.move = ParsedMotion(
                line=number, letter=match[2].decode().upper(), disabled=bool(match[1]), span=(match.start(2), limit)
            )
        elif self.data[body:limit].lstrip()[:1] == b"!":
            self.state = "!"
            self.remarks.append((number, self.data[body:limit].lstrip()[1:].decode("latin-1").rstrip()))
        else:
            self.state = "x"
        return body

    def _continue_motion(self, at: int, limit: int, number: int) -> None:
        """Targets of a motion, and what follows the last of them."""
        data, move = self.data, self.move
        at = take_targets(data, move, at, limit)
        is_via = move.letter == "C" and len(move.target) == 1 and number == move.line
        if is_via and (match := VIA_OPTIONS.match(data, at, limit)):
            move.options = match[1].decode("latin-1")
            at = take_targets(data, move, match.end(), limit)
        if not move.target:
            raise InputError(f"program: line {number}: target or speed of this move is not understood; mend it")
        if any(position_number(data, move, i) > LARGEST_NUMBER for i in range(len(move.target))):
            raise InputError(f"program: line {number}: no position has a number above {LARGEST_NUMBER}; mend it")
        if move.letter != "C" or len(move.target) > 1:
            options = _take_speed_and_termination(data, move, at, limit)
            move.options = f"{move.options} {options}".strip(" \t")
            move.has_tail = bool(options)
            move.span = (move.span[0], limit)
            self.moves.append(move)
            self.state = "m"


def too_long(line: int) -> InputError:
    """The refusal of a statement that no controller prints."""
    return InputError(f"program: line {line}: a statement of more than {LONGEST_STATEMENT} characters; mend it")


def take_targets(data: bytes, move: ParsedMotion, at: int, limit: int) -> int:
    """Adds the targets from a place on; gives where they end."""
    while target := TARGET.match(data, at, limit):
        move.kind.append(target[1].decode().upper())
        move.target.append(target.span(2))
        at = target.end()
    return at


def _take_speed_and_termination(data: bytes, move: ParsedMotion, at: int, limit: int) -> str:
    """Takes what is still missing of speed and termination from a place on; gives the rest."""
    if move.speed[1] == 0:
        match = SPEED.match(data, at, limit)
        at = match.end() if match else at
        move.speed = (match.start(1 if match[1] else 3), at) if match else (at, at)
    if match := TERMINATION.match(data, at, limit):
        move.termination, at = match.span(1), match.end()
    return data[at:limit].decode("latin-1").strip(" \t")


def _continue_options(data: bytes, move: ParsedMotion, at: int, limit: int) -> None:
    """A motion whose statement runs on: what is still missing is taken from the next line, the rest are options."""
    if move.termination[1] or move.has_tail:
        rest = data[at:limit].decode("latin-1").strip(" \t")
    else:  # the options before it are those of a via point
        if move.speed[0] == move.speed[1]:
            move.speed = (0, 0)
        rest = _take_speed_and_termination(data, move, at, limit)
    move.options = f"{move.options} {rest}".strip(" \t")
    move.has_tail |= bool(rest)
    move.span = (move.span[0], limit)


def target_text(data: bytes, move: ParsedMotion, i: int) -> str:
    """A target as written: ``P[3:name]``, ``PR[1]``."""
    return f"{move.kind[i]}[{data[slice(*move.target[i])].decode('latin-1')}]"


def number_and_name_spans(data: bytes, move: ParsedMotion, i: int) -> tuple[Span, Span]:
    """Where n and the name of a target P[n:name] stand; nowhere when it is another target."""
    match = NUMBER_AND_NAME.match(data, *move.target[i]) if move.kind[i] == "P" else None
    return (match.span(1), match.span(2)) if match else ((-1, -1), (-1, -1))


def position_number(data: bytes, move: ParsedMotion, i: int) -> int:
    """n of a target P[n] or P[n:name]; anything else is not in the file."""
    (start, end), _ = number_and_name_spans(data, move, i)
    return int(data[start : min(end, start + 10)]) if end > start else NO_NUMBER


def speed_number_span(data: bytes, move: ParsedMotion) -> Span:
    """Where the number of a speed stands; nowhere when it is a register or a word."""
    match = SPEED_NUMBER.match(data, *move.speed)
    return match.span() if match else (-1, -1)


def line_number_span(data: bytes, at: int, stop: int) -> Span | None:
    """Where the number of a numbered line stands."""
    match = LINE_NUMBER.match(data, at, stop)
    return match.span(1) if match and match[1] else None
