"""Motion statements of a program, as places in its bytes.

Two traps of real files are met here: a remark that wraps to a line looking like a move, and numbers that restart inside
point logic.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.arrays import BoolArray, IntArray
from compgen.dialects.fanuc_ls.lines import line_of
from compgen.exceptions import InputError

NO_NUMBER = -1  # a frame that is F, a target that is not in the file
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

#: What nearly all motions of a long program look like; the careful way below reads them the same.
_USUAL = re.compile(
    rb"[ \t]*+\d++[ \t]*+:[ \t]*+([JL])[ \t]++(P\[\d{1,9}\])[ \t]++"
    rb"(\d++(?:%|mm/sec|cm/min|\.\d++inch/min))[ \t]++(FINE|CNT\d++)[ \t]*+;[ \t]*+(?:\r\n|\n)"
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
    position: tuple[tuple[int, ...], ...]  # P numbers, NO_NUMBER for a target that is not in the file
    speed: tuple[str, ...]  # as written, empty when there is none
    termination: tuple[str, ...]
    options: tuple[str, ...]
    span: IntArray  # (M, 2) from the letter to the end of the statement's text
    speed_span: IntArray  # (M, 2)


def read_motions(data: bytes, start: int, end: int) -> tuple[Motions, IntArray, tuple[str, ...]]:
    """The motions in /MN, the line at which each statement begins, and the remarks.

    Raises:
        InputError: A move whose target is not understood, or a C without its end point; names the line.
    """
    rows: list[_Row] = []
    statements, remarks = [], []
    number = line_of(data, start)
    state = ""  # "" between statements, "!" in a remark, "C" a motion without its end, "x" in other text
    pending: list[str] = []
    begin = (0, "", False)
    at = start
    while at < end:
        if usual := _USUAL.match(data, at, end):
            _whole(state, begin[0])
            letter, place, speed, termination = (text.decode() for text in usual.groups())
            begin, state = (number, letter, False), ""
            spans = usual.regs
            rows.append(
                (
                    *begin,
                    [place],
                    speed,
                    termination,
                    "",
                    spans[3],
                    (spans[1][0], usual.end(4) + data[usual.end(4) : usual.end()].find(b";")),
                )
            )
            statements.append(number)
            at, number = usual.end(), number + 1
            continue
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
            position=tuple(tuple(map(_own_number, ts)) for ts in target),
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
    if target[:2] == "P[" and target[2:-1].isdecimal():
        return int(target[2:-1][:10])
    found = re.match(r"P\[\s*(\d+)\s*(?::.*)?\]$", target, re.DOTALL)
    return int(found.group(1)[:10]) if found else NO_NUMBER
