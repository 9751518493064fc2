"""Motion statements of a program, as columns: lines of one shape together, the others one by one."""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.lines import line_of
from compgen.fanuc.listing.position_parser import Span
from compgen.fanuc.listing.statement_parser import Move, Statements, own_number, target_text
from compgen.fanuc.listing.statement_templates import Pattern, sorted_out
from compgen.fanuc.listing.templates import Filled

_LOOK = 16  # characters at either end of a line that tell whether it goes on


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


def read_motions(data: bytes, start: int, end: int) -> tuple[Motions, IntArray, IntArray, tuple[str, ...]]:
    """The motions in /MN, the line and the byte at which each statement begins, and the remarks.

    Raises:
        InputError: A move whose target is not understood, or a C without its end point; names the line.
    """
    view = templates.padded(memoryview(data)[:end])
    first, lines = line_of(data, start), _lines(view, start, end)
    unit = _units(view, lines)
    edge = lines[unit]
    groups = sorted_out(data, view, lines, unit) if len(unit) > templates.FEW else []
    fits, numbered = np.zeros(len(unit), dtype=bool), np.zeros(len(unit), dtype=bool)
    for pattern, filled in groups:
        fits[filled.which], numbered[filled.which] = True, pattern.numbered
    read, met = _one_by_one(data, lines, unit, first, fits, numbered)
    groups = [(pattern, templates.only(filled, met)) for pattern, filled in groups]
    begins = [unit[filled.which] + first for _, filled in groups]
    remarks = read.remarks
    for (pattern, filled), here in zip(groups, begins):
        if ("remark", 0) in pattern.what:
            texts = templates.texts(view, filled.span[:, pattern.what["remark", 0]])
            remarks += [(line, text.rstrip()) for line, text in zip(here.tolist(), texts)]
    statements = np.sort(np.concatenate([*begins, np.array(read.lines, dtype=np.int64)]))
    return (
        _table(data, view, edge, unit + first, groups, read.moves),
        statements,
        lines[statements - first],
        tuple(text for _, text in sorted(remarks)),
    )


def _lines(view: Bytes, start: int, end: int) -> IntArray:
    """Where each physical line begins, and the end of the last."""
    ends = templates.found(view, start, end, lambda d: (d[:-1] == 10) | ((d[:-1] == 13) & (d[1:] != 10))) + 1
    return np.concatenate([[start], ends[ends < end], [end] if end > start else []]).astype(np.int64)


def _units(view: Bytes, lines: IntArray) -> IntArray:
    """Lines at which something new begins, and the number of lines; a line that goes on with an open statement is none.

    A guess by the first and the last characters only; the careful reader decides.
    """
    if len(lines) <= templates.FEW:
        return np.arange(len(lines))
    head, tail = (
        templates.windows(view, lines[:-1], _LOOK),
        templates.windows(view, np.maximum(lines[:-1] - _LOOK, 0), _LOOK),
    )
    blank = (head == ord(" ")) | (head == ord("\t"))
    goes_on = head[np.arange(len(head)), blank.argmin(axis=1)] == ord(":")
    blank = (tail == ord(" ")) | (tail == ord("\t")) | (tail == ord("\r")) | (tail == ord("\n"))
    goes_on &= tail[np.arange(len(tail)), _LOOK - 1 - blank[:, ::-1].argmin(axis=1)] != ord(";")
    goes_on[0] = False
    return np.append(np.flatnonzero(~goes_on), len(lines) - 1)


def _one_by_one(
    data: bytes, lines: IntArray, unit: IntArray, first: int, fits: BoolArray, numbered: BoolArray
) -> tuple[Statements, BoolArray]:
    """The lines that fit no shape, and which of those that do were met where a statement may begin."""
    places, units, bad = lines.tolist(), unit.tolist(), np.flatnonzero(~fits).tolist()
    fit, begins = fits.tolist(), numbered.tolist()
    met = np.zeros_like(fits)
    read = Statements(data)
    k = 0
    while k < len(units) - 1:
        if fit[k] and (begins[k] or read.state == ""):
            read.between()
            after = bad[bisect_left(bad, k)]
            met[k:after] = True
            k = after
        else:
            for i in range(units[k], units[k + 1]):
                read.read(places[i], places[i + 1], first + i)
            k += 1
    read.between()
    return read, met


def _table(
    data: bytes, view: Bytes, edge: IntArray, number: IntArray, groups: list[tuple[Pattern, Filled]], moves: list[Move]
) -> Motions:
    """Columns of all motions in the order they stand."""
    parts = [_many(data, view, edge, number, p, p.move, filled) for p, filled in groups if p.move is not None]
    parts.append(_singly(data, moves))
    line = np.concatenate([p.line for p in parts])
    order = np.argsort(line, kind="stable")
    rank = order.tolist()
    columns: dict[str, Any] = {}
    for column in fields(Motions):
        pieces = [getattr(p, column.name) for p in parts]
        if isinstance(pieces[0], np.ndarray):
            columns[column.name] = np.concatenate(pieces)[order]
        else:
            whole = [item for piece in pieces for item in piece]
            columns[column.name] = tuple([whole[i] for i in rank])
    return Motions(**columns)


def _many(
    data: bytes, view: Bytes, edge: IntArray, number: IntArray, pattern: Pattern, move: Move, filled: Filled
) -> Motions:
    """Motions of one shape."""
    n = len(filled.which)

    def places(span: Span) -> IntArray:
        return np.column_stack([pattern.place(edge, filled, at) for at in span])

    def said(name: str, span: IntArray, same: Span) -> list[str]:
        if (name, 0) in pattern.what:
            return templates.texts(view, span)
        return [data[slice(*same)].decode("latin-1")] * n

    targets, numbers = [], []
    for i, (start, end) in enumerate(move.target):
        hole = pattern.what.get(("target", i))
        if hole is None:
            targets.append([target_text(data, move, i)] * n)
            numbers.append([own_number(data, move, i)] * n)
        else:
            targets.append(templates.texts(view, places((start - 2, end + 1))))
            numbers.append(filled.value[:, hole].astype(np.int64).tolist())
    speed_span = places(move.speed)
    if ("speed", 0) in pattern.what:
        speed_span[:, 0] = filled.span[:, pattern.what["speed", 0], 0]
    return Motions(
        line=number[filled.which],
        letter=(move.letter,) * n,
        disabled=np.full(n, move.disabled),
        target=tuple(zip(*targets)),
        position=tuple(zip(*numbers)),
        speed=tuple(said("speed", speed_span, move.speed)),
        termination=tuple(said("termination", places(move.termination), move.termination)),
        options=(move.options,) * n,
        span=places(move.span),
        speed_span=speed_span,
    )


def _singly(data: bytes, moves: list[Move]) -> Motions:
    """Motions that were read one by one."""

    def said(spans: Iterable[Span]) -> tuple[str, ...]:
        return tuple(data[start:end].decode("latin-1") for start, end in spans)

    return Motions(
        line=np.array([m.line for m in moves], dtype=np.int64),
        letter=tuple(m.letter for m in moves),
        disabled=np.array([m.disabled for m in moves], dtype=bool),
        target=tuple(tuple(target_text(data, m, i) for i in range(len(m.target))) for m in moves),
        position=tuple(tuple(own_number(data, m, i) for i in range(len(m.target))) for m in moves),
        speed=said(m.speed for m in moves),
        termination=said(m.termination for m in moves),
        options=tuple(m.options for m in moves),
        span=np.array([m.span for m in moves], dtype=np.int64).reshape(-1, 2),
        speed_span=np.array([m.speed for m in moves], dtype=np.int64).reshape(-1, 2),
    )
