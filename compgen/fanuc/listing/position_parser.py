"""One position of a program, read with care; names may hold ``:`` and ``]``."""

import re
from dataclasses import dataclass, field

import numpy as np

from compgen.core.exceptions import InputError
from compgen.fanuc.listing.lines import line_of

NO_NUMBER = -1  # a frame that is F, a target that is not in the file
#: Columns of ``Positions.value``.
AXES = ("X", "Y", "Z", "W", "P", "R", "J1", "J2", "J3", "J4", "J5", "J6", "J7", "J8", "J9", "E1", "E2", "E3")
J1 = AXES.index("J1")
_COLUMN = {axis: i for i, axis in enumerate(AXES)}
_BETWEEN = b" \t\r\n\f\v,;"  # may stand between two fields of a position
_PHRASE = re.compile(rb"[^,;\r\n]+")
_BLOCK_HEAD = re.compile(rb"\s*(P\[[ \t]*(\d{1,9})[ \t]*(?::([^\r\n]*?))?\][ \t]*\{)", re.IGNORECASE)
_BLOCK_FIELD = re.compile(
    rb"[\s,;]*(?:(?P<group>GP(\d{1,9})[ \t]*:)"
    rb"|(?P<frame>UF[ \t]*:[ \t]*(\d{1,9}|F)[ \t]*,[ \t]*UT[ \t]*:[ \t]*(\d{1,9}|F))"
    rb"|CONFIG[ \t]*:[ \t]*'(?P<config>[^'\r\n]*)'"
    rb"|(?P<axis>R?[XYZWPR]|[JE]\d)[ \t]*=[ \t]*"
    rb"(?P<number>[-+]?(?:\d{1,15}(?!\d)(?:\.\d*)?|\.\d+)|\*+)[ \t]*(?P<unit>mm|deg)?"
    rb"|(?P<end>\}[ \t]*;?))",
    re.IGNORECASE,
)

_LENGTHS, _ANGLES = ("X", "Y", "Z"), ("W", "P", "R")
_JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")  # of group 1; those of other groups may be of length

Span = tuple[int, int]


@dataclass(slots=True, kw_only=True)
class Group:
    """One motion group of a position; a place (0, 0) is none."""

    group: int = 0
    frame: tuple[int, int] = (NO_NUMBER, NO_NUMBER)
    frame_span: tuple[Span, Span] = ((0, 0), (0, 0))
    config: str | None = None
    config_span: Span = (0, 0)
    axes: dict[int, tuple[float, Span]] = field(default_factory=dict)  # by column
    remote: bool = False  # RX to RR: of the part in the frame of a tool that stands still, in the columns of X to R


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """``P[number:name]{ groups };`` and where its parts stand."""

    number: int
    number_span: Span
    name: str
    name_span: Span
    groups: tuple[Group, ...]
    span: Span


def parse_block(data: bytes, at: int, end: int) -> Block | None:
    """The position that begins at a place, blanks and line ends left aside; None when none begins there.

    Raises:
        InputError: It begins and is not understood; names the line.
    """
    opened = _BLOCK_HEAD.match(data, at, end)
    if opened is None:
        return None
    number = int(opened[2])
    groups: list[Group] = []
    group, begun = Group(), False
    at = opened.end()
    while True:
        token = _BLOCK_FIELD.match(data, at, end)
        if token is None:
            place = skip_blanks(data, at, end, _BETWEEN)
            text = _PHRASE.match(data, place, min(place + 40, end))
            what = f"{text[0].decode('latin-1').rstrip()!r} is not understood" if text else "its } is missing"
            raise _refusal(data, place, f"P[{number}]: {what}; mend the position")
        at = token.end()
        if token["group"] is not None or token["end"] is not None:
            if begun:
                groups.append(group)
            if token["end"] is not None:
                break
            group, begun = Group(group=int(token[2])), True
            if any(g.group == group.group for g in groups):
                raise _refusal(data, opened.start(1), f"P[{number}] has GP{group.group} twice; remove one")
        else:
            _take_field(data, group, token, opened)
            begun = True
    if not groups:
        raise _refusal(data, opened.start(1), f"P[{number}] is empty; teach or remove it")
    name = unquoted_name((opened[3] or b"").decode("latin-1"))
    return Block(
        number=number,
        number_span=opened.span(2),
        name=name,
        name_span=opened.span(3),
        groups=tuple(groups),
        span=(opened.start(1), at),
    )


def _refusal(data: bytes, place: int, why: str) -> InputError:
    return InputError(f"program: line {line_of(data, place)}: {why}")


def _take_field(data: bytes, group: Group, token: re.Match[bytes], opened: re.Match[bytes]) -> None:
    """Put frames, CONFIG or an axis, and where they stand, into a group of the position that was opened."""
    if token["frame"] is not None:
        group.frame = _frame_number(token[4]), _frame_number(token[5])
        group.frame_span = token.span(4), token.span(5)
        return
    if token["config"] is not None:
        group.config, group.config_span = token["config"].decode("latin-1"), token.span("config")
        return
    place, position = opened.start(1), f"P[{int(opened[2])}]"
    axis, text = token["axis"].decode().upper(), token["number"]
    if len(axis) == 2 and axis[0] == "R":
        axis, group.remote = axis[1], True
    if axis not in _COLUMN:
        raise _refusal(data, place, f"{position} has an axis {axis}; there are {', '.join(AXES)}")
    if _COLUMN[axis] in group.axes:
        raise _refusal(data, place, f"{position} has {axis} twice; remove one")
    unit, right = (token["unit"] or b"").decode().lower(), _unit_of(axis, group.group)
    if unit and right and unit != right:
        raise _refusal(data, token.start("unit"), f"{position}: {axis} is in {unit}; give it in {right}")
    group.axes[_COLUMN[axis]] = np.nan if text[:1] == b"*" else float(text), token.span("number")


def _unit_of(axis: str, group: int) -> str:
    """The only unit that an axis may have; empty where it may have either."""
    if axis in _LENGTHS:
        return "mm"
    return "deg" if axis in _ANGLES or (axis in _JOINTS and group <= 1) else ""


def unquoted_name(text: str) -> str:
    """A position's name without the blanks and the quotes around it."""
    text = text.strip()
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else text


def skip_blanks(data: bytes, at: int, end: int, over: bytes | None = None) -> int:
    """First byte from a place on that is not blank."""
    while at < end:
        piece = data[at : min(at + 256, end)]
        rest = piece.lstrip(over)
        at += len(piece) - len(rest)
        if rest:
            return at
    return end


def _frame_number(text: bytes) -> int:
    return int(text) if text.isdigit() else NO_NUMBER


def blanks_before(data: bytes, at: int) -> int:
    """Where the blanks in front of a number begin: a wider number leaves fewer of them."""
    while data[at - 1 : at] in (b" ", b"\t"):
        at -= 1
    return at
