r"""Any .LS file, without loss: the bytes as they are, and where in them motions and positions stand.

Text is kept whole; a record is a place in it. So reading and writing unchanged gives the same bytes, and an edit
replaces the bytes of one number and nothing else. What is neither motion nor position is opaque: it is never looked
into and never changed. Tables are columns (numpy), so that a million positions are a few arrays.

Three traps of real files are met here: a remark that wraps to a line looking like a move, numbers that restart inside
point logic, and names that hold ``:`` or ``]``.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.arrays import Array, BoolArray, IntArray
from compgen.exceptions import InputError

#: Columns of ``Positions.value``.
AXES = ("X", "Y", "Z", "W", "P", "R", "J1", "J2", "J3", "J4", "J5", "J6", "J7", "J8", "J9", "E1", "E2", "E3")
_COLUMN = {axis: i for i, axis in enumerate(AXES)}
_BETWEEN = b" \t\r\n\f\v,;"  # may stand between two fields of a position
NO_NUMBER = -1  # a frame that is F, a target that is not in the file

_BEGIN = rb"(?:\A|(?<=[\r\n]))"  # of a line: ^ knows no lone CR
_TRANSLATED = re.compile(
    _BEGIN + rb"/?(?:EIGN\.|KOMMENTAR|PROPRIETAIRE|COMENTARIO|PROPIETARIO|ZEILEN)[ \t]*(?=[=\r\n])", re.IGNORECASE
)
_SECTION = re.compile(_BEGIN + rb"/(PROG|ATTR|APPL|MN|POS|END)\b[^\r\n]*", re.IGNORECASE)
_NAME = re.compile(rb"/PROG[ \t]+([^\s]+)[ \t]*([^\r\n]*)", re.IGNORECASE)
_ATTRIBUTE = re.compile(_BEGIN + rb"([A-Z_]+)[ \t]*=([^\r\n]*)", re.IGNORECASE)
_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\n|\r|$)")
_NUMBERED = re.compile(rb"[ \t]*+(\d*+)[ \t]*+:")
_MOVE = re.compile(rb"[ \t]*+(//)?+[ \t]*+([JLCAS])[ \t]++(?=PR?\[)", re.IGNORECASE)
_NUMBER = rb"(?:\d++\.?\d*+|\.\d++)"
_UNIT = rb"(?:%|mm/sec|cm/min|inch/min|deg/sec|msec|sec)"
_TARGET = re.compile(
    rb"[ \t]*(PR?)\[([^\r\n]*?)\](?=[ \t]+(?:"
    + _NUMBER
    + rb"[ \t]*"
    + _UNIT
    + rb"|A?R\[|WELD_SPEED|max_speed|PR?\[)|[ \t]*$)",
    re.IGNORECASE,
)
_SPEED = re.compile(
    rb"[ \t]*(?:(" + _NUMBER + rb"|A?R\[[^\r\n]*?\])[ \t]*(" + _UNIT + rb")|(WELD_SPEED|max_speed))",
    re.IGNORECASE,
)
_END_OF_MOVE = re.compile(rb"[ \t]*(FINE|CNT[ \t]*(?:\d+|R\[[^\r\n]*?\])|C[RD][ \t]*\d+)", re.IGNORECASE)
_BLOCK = re.compile(rb"\s*P\[[ \t]*(\d{1,9})[ \t]*(?::([^\r\n]*?))?\][ \t]*\{", re.IGNORECASE)
_INSIDE = re.compile(
    rb"[\s,;]*(?:(?P<group>GP(\d{1,9})[ \t]*:)"
    rb"|(?P<frame>UF[ \t]*:[ \t]*(\d{1,9}|F)[ \t]*,[ \t]*UT[ \t]*:[ \t]*(\d{1,9}|F))"
    rb"|CONFIG[ \t]*:[ \t]*'(?P<config>[^'\r\n]*)'"
    rb"|(?P<axis>[XYZWPR]|[JE]\d)[ \t]*=[ \t]*"
    rb"(?P<number>[-+]?(?:\d{1,15}(?!\d)(?:\.\d*)?|\.\d+)|\*+)[ \t]*(?P<unit>mm|deg)?"
    rb"|(?P<end>\}[ \t]*;?))",
    re.IGNORECASE,
)


#: line, letter, disabled, targets, speed, termination, options, place of the speed, of the statement
_Row = tuple[int, str, bool, list[str], str, str, str, tuple[int, int], tuple[int, int]]


@dataclass(frozen=True, eq=False, slots=True)
class Motions:
    """M motion statements, in the order they stand; the via point of a C is its first target."""

    line: IntArray  # (M,) physical line, from 1
    letter: tuple[str, ...]  # J L C A S
    disabled: BoolArray  # (M,) begins with //
    target: tuple[tuple[str, ...], ...]  # text inside the brackets, with what stands before: "P[3:name]", "PR[1]"
    position: tuple[IntArray, ...]  # P numbers, NO_NUMBER for a target that is not in the file
    speed: tuple[str, ...]  # as written, empty when there is none
    termination: tuple[str, ...]
    options: tuple[str, ...]
    span: IntArray  # (M, 2) from the letter to the end of the statement's text
    speed_span: IntArray  # (M, 2)


@dataclass(frozen=True, eq=False, slots=True)
class Positions:
    """G rows, one for each motion group of each position."""

    number: IntArray  # (G,) n of P[n]
    group: IntArray  # (G,)
    line: IntArray  # (G,) physical line of P[n], from 1
    name: tuple[str, ...]
    uframe: IntArray  # (G,) NO_NUMBER for F or none
    utool: IntArray  # (G,)
    config: tuple[str | None, ...]
    config_span: IntArray  # (G, 2)
    value: Array  # (G, 18) mm or deg, NaN where there is none or ****
    span: IntArray  # (G, 18, 2) of each number, zero where there is none
    block: IntArray  # (G, 2) of the whole P[n]{...};


@dataclass(frozen=True, eq=False, slots=True)
class LsProgram:
    """A program file: its bytes, and what stands where."""

    data: bytes
    name: str
    subtype: str
    attributes: tuple[tuple[str, str], ...]
    remarks: tuple[str, ...]
    statements: IntArray  # (S,) physical line at which each statement of /MN begins
    motions: Motions
    positions: Positions

    def text(self, span: Iterable[int]) -> str:
        """The text at a place."""
        start, end = span
        return self.data[start:end].decode("latin-1")


def loads(data: bytes) -> LsProgram:
    """Read a program file.

    Args:
        data: The file's bytes, any line ends, any single-byte code page.

    Returns:
        The program; ``dumps`` gives the same bytes back.

    Raises:
        InputError: Not a program, truncated, in another language, or a position that cannot be read; names the line.
    """
    sections = _sections(data)
    head = data[: sections["MN"][0]]
    named = _NAME.search(head)
    attributes = tuple(
        (k.decode("latin-1"), v.decode("latin-1").strip().removesuffix(";").rstrip())
        for k, v in _ATTRIBUTE.findall(head)
    )
    motions, statements, remarks = _motions(data, *sections["MN"])
    positions = _positions(data, *sections["POS"])
    return LsProgram(
        data=data,
        name=named.group(1).decode("latin-1") if named else "",
        subtype=named.group(2).decode("latin-1").strip() if named else "",
        attributes=attributes,
        remarks=remarks,
        statements=statements,
        motions=motions,
        positions=positions,
    )


def dumps(program: LsProgram) -> bytes:
    """The program's bytes."""
    return program.data


def edited(program: LsProgram, edits: dict[tuple[int, int], bytes]) -> LsProgram:
    """The program with the bytes at some places replaced, read anew.

    Raises:
        InputError: Two places overlap, or the result is no program.
    """
    parts, at = [], 0
    for (start, end), text in sorted(edits.items()):
        if start < at or end < start:
            raise InputError(f"program {program.name}: two edits overlap, or one runs backwards, at byte {start}")
        parts += [program.data[at:start], text]
        at = end
    return loads(b"".join([*parts, program.data[at:]]))


def line_of(data: bytes, place: int) -> int:
    """Physical line of a byte, from 1; CR LF, LF and CR each end a line."""
    before = data[:place]
    return 1 + before.count(b"\n") + before.count(b"\r") - before.count(b"\r\n")


def _sections(data: bytes) -> dict[str, tuple[int, int]]:
    """Bytes of /MN and /POS, after their tags."""
    start = data.lstrip()[:5]
    if start[:5].upper() != b"/PROG":
        if b"\0" in data[:4096]:
            raise InputError("program: this is a binary file; convert the .TP to .LS on the controller first")
        raise InputError("program: line 1: it does not begin with /PROG; give a program listing (.LS)")
    found = [(m.group(1).decode().upper(), m.start(), m.end()) for m in _SECTION.finditer(data)]
    tags = [tag for tag, _, _ in found]
    if _TRANSLATED.search(data, 0, found[tags.index("MN")][1] if "MN" in tags else len(data)):
        raise InputError("program: its keywords are in another language; export it from a controller set to English")
    if "MN" not in tags:
        raise InputError("program: /MN is missing; is this a complete .LS file?")
    mn = tags.index("MN")
    after = [t for t in found[mn + 1 :] if t[0] in ("POS", "END")]
    if not any(t[0] == "END" for t in after):
        raise InputError(f"program: line {line_of(data, len(data))}: /END is missing; the file is cut off")
    end = next(t for t in after if t[0] == "END")
    pos = next((t for t in after if t[0] == "POS" and t[1] < end[1]), None)
    stop = pos[1] if pos else end[1]
    return {"MN": (found[mn][2], stop), "POS": (pos[2], end[1]) if pos else (end[1], end[1])}


def _motions(data: bytes, start: int, end: int) -> tuple[Motions, IntArray, tuple[str, ...]]:
    rows: list[_Row] = []
    statements, remarks = [], []
    number = line_of(data, start)
    state = ""  # "" between statements, "!" in a remark, "C" a motion without its end, "x" in other text
    pending: list[str] = []
    begin = (0, "", False)
    at = start
    while at < end:
        found = _LINE.match(data, at, end)
        stop = found.end() if found else end
        text_end = stop - len(data[at:stop]) + len(data[at:stop].rstrip(b"\r\n"))
        mark = _NUMBERED.match(data, at, text_end)
        if mark and mark.group(1):
            _whole(state, begin[0])
            state = ""  # a numbered line begins a statement, whatever came before
        if mark:
            body = mark.end()
            close = data.find(b";", body, text_end)
            done = close >= 0
            limit = close if done else text_end
            move = _MOVE.match(data, body, limit) if state == "" else None
            if state == "":
                statements.append(number)
            if move:
                begin = (number, move.group(2).decode().upper(), bool(move.group(1)))
                pending, after = _targets(data, move.end(), limit)
                where = move.start(2)
                if not pending:
                    raise InputError(f"program: line {number}: the target of this move is not understood; mend it")
                if any(_own_number(t) > 999_999_999 for t in pending):
                    raise InputError(f"program: line {number}: no position has a number as large; mend it")
            elif state == "C":
                more, after = _targets(data, body, limit)
                pending = [*pending, *more]
            elif state == "m":
                rows[-1] = _continued(rows[-1], _tail(data, body, limit), data[body:limit], (where, limit))
            elif state == "" and data[body:limit].lstrip()[:1] == b"!":
                remarks.append(data[body:limit].lstrip()[1:].decode("latin-1").rstrip())
                state = "!"
            elif state == "":
                state = "x"
            if (move or state == "C") and (done or not move or begin[1] != "C" or len(pending) > 1):
                rows.append((*begin, pending, *_tail(data, after, limit), (where, limit)))
                state = "" if done else "m"
            elif move:
                state = "C"
            if done:
                state = ""
        at, number = stop, number + 1
        if stop == found.start() if found else True:
            break
    _whole(state, begin[0])
    columns: list[Any] = list(zip(*rows)) if rows else [()] * 9
    line, letter, disabled, target, speed, termination, options, speed_span, span = columns
    return (
        Motions(
            line=np.array(line, dtype=np.int64),
            letter=tuple(letter),
            disabled=np.array(disabled, dtype=bool),
            target=tuple(tuple(t) for t in target),
            position=tuple(np.array([_own_number(t) for t in ts], dtype=np.int64) for ts in target),
            speed=tuple(speed),
            termination=tuple(termination),
            options=tuple(options),
            span=np.array(span, dtype=np.int64).reshape(-1, 2),
            speed_span=np.array(speed_span, dtype=np.int64).reshape(-1, 2),
        ),
        np.array(statements, dtype=np.int64),
        tuple(remarks),
    )


def _continued(row: _Row, more: tuple[str, str, str, tuple[int, int]], text: bytes, span: tuple[int, int]) -> _Row:
    """A motion whose statement runs on: what is still missing is taken from the next line, the rest are options."""
    *begin, speed, termination, options, place, _ = row
    if termination or options:
        return (*begin, speed, termination, f"{options} {text.decode('latin-1').strip()}".strip(), place, span)  # type: ignore[return-value]
    if not speed:
        speed, place = more[0], more[3]
    return (*begin, speed, more[1], more[2], place, span)  # type: ignore[return-value]


def _whole(state: str, line: int) -> None:
    """Raises InputError for a C without its end point."""
    if state == "C":
        raise InputError(f"program: line {line}: this C has no end point; mend it")


def _targets(data: bytes, at: int, limit: int) -> tuple[list[str], int]:
    """Targets from a place on, and where they end."""
    found = []
    while target := _TARGET.match(data, at, limit):
        found.append(f"{target.group(1).decode().upper()}[{target.group(2).decode('latin-1')}]")
        at = target.end()
    return found, at


def _tail(data: bytes, at: int, limit: int) -> tuple[str, str, str, tuple[int, int]]:
    """Speed, termination and options after the last target, and where the speed stands."""
    speed, place = "", (at, at)
    if found := _SPEED.match(data, at, limit):
        speed = data[found.start() : found.end()].strip().decode("latin-1")
        at = found.end()
        place = (at - len(speed), at)
    termination = ""
    if found := _END_OF_MOVE.match(data, at, limit):
        termination, at = found.group(1).decode("latin-1"), found.end()
    return speed, termination, data[at:limit].decode("latin-1").strip(), place


def _own_number(target: str) -> int:
    """n of P[n] or P[n:name]; anything else is not in the file."""
    found = re.match(r"P\[\s*(\d+)\s*(?::.*)?\]$", target, re.DOTALL)
    return int(found.group(1)[:10]) if found else NO_NUMBER


def _positions(data: bytes, start: int, end: int) -> Positions:
    rows: list[tuple[int, int, int, str, int, int, str | None, tuple[int, int], tuple[int, int]]] = []
    values: list[tuple[int, int, float, int, int]] = []
    at, number, counted = start, line_of(data, start), start
    taught: set[int] = set()
    while block := _BLOCK.match(data, at, end):
        opened = block.start(1)
        number += _ends(data, counted, opened)
        counted = opened
        name = (block.group(2) or b"").decode("latin-1").strip()
        if len(name) > 1 and name[0] == name[-1] == '"':
            name = name[1:-1]
        if int(block.group(1)) in taught:
            raise InputError(f"program: line {number}: P[{block.group(1).decode()}] is defined twice; remove one")
        taught.add(int(block.group(1)))
        groups: set[int] = set()
        axes: set[str] = set()
        group, frame, config, config_place = 0, (NO_NUMBER, NO_NUMBER), None, (0, 0)
        first = len(rows)
        begun = False
        at = block.end()
        while True:
            token = _INSIDE.match(data, at, end)
            if token is None:
                raise InputError(
                    f"program: line {number + _ends(data, counted, _skip(data, at, end, _BETWEEN))}: "
                    f"not understood in P[{block.group(1).decode()}]; mend the position"
                )
            at = token.end()
            if token["group"] is not None or token["end"] is not None:
                if begun:
                    rows.append((int(block.group(1)), group, number, name, *frame, config, config_place, (0, 0)))
                if token["end"] is not None:
                    break
                if int(token[2]) in groups:
                    raise InputError(
                        f"program: line {number}: P[{block.group(1).decode()}] has GP{int(token[2])} twice"
                    )
                groups.add(int(token[2]))
                axes = set()
                group, frame, config, config_place, begun = int(token[2]), (NO_NUMBER, NO_NUMBER), None, (0, 0), True
            elif token["frame"] is not None:
                frame, begun = (_frame(token[4]), _frame(token[5])), True
            elif token["config"] is not None:
                config, config_place, begun = token["config"].decode("latin-1"), token.span("config"), True
            else:
                axis = token["axis"].decode().upper()
                if axis in axes:
                    raise InputError(f"program: line {number}: P[{block.group(1).decode()}] has {axis} twice")
                axes.add(axis)
                if axis not in _COLUMN:
                    raise InputError(f"program: line {number}: P[{block.group(1).decode()}] has an axis {axis}")
                text = token["number"]
                value = np.nan if text[:1] == b"*" else float(text)
                values.append((len(rows), _COLUMN[axis], value, *token.span("number")))
                begun = True
        if len(rows) == first:
            raise InputError(f"program: line {number}: P[{block.group(1).decode()}] is empty; teach or remove it")
        whole = (block.start(1) - 2, at)
        for i in range(first, len(rows)):
            rows[i] = (*rows[i][:-1], whole)
    rest = _skip(data, at, end)
    if rest < end:
        raise InputError(f"program: line {number + _ends(data, counted, rest)}: not a position; mend it")
    table = np.full((len(rows), len(AXES)), np.nan)
    spans = np.zeros((len(rows), len(AXES), 2), dtype=np.int64)
    if values:
        r, c, v, s, e = (np.array(column) for column in zip(*values))
        table[r, c] = v
        spans[r, c, 0], spans[r, c, 1] = s, e
    columns: list[Any] = list(zip(*rows)) if rows else [()] * 9
    n, g, line, names, uf, ut, config_text, config_span, blocks = columns
    return Positions(
        number=np.array(n, dtype=np.int64),
        group=np.array(g, dtype=np.int64),
        line=np.array(line, dtype=np.int64),
        name=tuple(names),
        uframe=np.array(uf, dtype=np.int64),
        utool=np.array(ut, dtype=np.int64),
        config=tuple(config_text),
        config_span=np.array(config_span, dtype=np.int64).reshape(-1, 2),
        value=table,
        span=spans,
        block=np.array(blocks, dtype=np.int64).reshape(-1, 2),
    )


def _frame(text: bytes) -> int:
    return int(text) if text.isdigit() else NO_NUMBER


def _skip(data: bytes, at: int, end: int, over: bytes | None = None) -> int:
    """First byte from a place on that is not blank."""
    rest = data[at:end]
    return end - len(rest.lstrip(over))


def _ends(data: bytes, start: int, stop: int) -> int:
    """Line ends between two places."""
    part = data[start:stop]
    return part.count(b"\n") + part.count(b"\r") - part.count(b"\r\n")
