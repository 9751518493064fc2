"""Motion statements of a program, as columns: lines of one shape together, the others one by one."""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from compgen.arrays import BoolArray, IntArray
from compgen.dialects.fanuc_ls import shapes
from compgen.dialects.fanuc_ls.block import NO_NUMBER as NO_NUMBER
from compgen.dialects.fanuc_ls.block import Span, before_blanks
from compgen.dialects.fanuc_ls.digits import Bytes
from compgen.dialects.fanuc_ls.lines import line_of
from compgen.dialects.fanuc_ls.shapes import Filled, Shape
from compgen.dialects.fanuc_ls.statement import (
    Move,
    Statements,
    line_number,
    own_number,
    own_parts,
    speed_number,
    target_text,
)
from compgen.exceptions import InputError


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


@dataclass(frozen=True, slots=True)
class _Pattern:
    """What the careful reader found in one line that is a whole statement: others of its shape are the same."""

    start: int  # of the line
    numbered: bool
    move: Move | None
    remark: str | None
    holes: tuple[shapes.Hole, ...]
    what: dict[tuple[str, int], int]  # which hole holds a part: ("target", 0), ("speed", 0), ...

    def place(self, edge: IntArray, filled: Filled, at: int) -> IntArray:
        """Where a place of this line is in the others; it lies outside the holes, or where one begins."""
        behind = [(h, last) for h, (_, _, last) in enumerate(self.holes) if last <= at]
        if not behind:
            return edge[filled.which] + (at - self.start)
        hole, last = behind[-1]
        return filled.span[:, hole, 1] + (at - last)


def read_motions(data: bytes, start: int, end: int) -> tuple[Motions, IntArray, IntArray, tuple[str, ...]]:
    """The motions in /MN, the line and the byte at which each statement begins, and the remarks.

    Raises:
        InputError: A move whose target is not understood, or a C without its end point; names the line.
    """
    view = shapes.padded(data[:end])
    ends = shapes.found(view, start, end, lambda d: (d[:-1] == 10) | ((d[:-1] == 13) & (d[1:] != 10))) + 1
    edge = np.concatenate([[start], ends[ends < end], [end] if end > start else []]).astype(np.int64)
    first = line_of(data, start)
    groups = _sorted_out(data, view, edge) if len(edge) > shapes.FEW else []
    fits, numbered = np.zeros(len(edge), dtype=bool), np.zeros(len(edge), dtype=bool)
    for pattern, filled in groups:
        fits[filled.which], numbered[filled.which] = True, pattern.numbered
    read, met = _one_by_one(data, edge, first, fits, numbered)
    groups = [(pattern, shapes.only(filled, met)) for pattern, filled in groups]
    begins = [filled.which + first for _, filled in groups]
    remarks = read.remarks + [
        (line, p.remark) for (p, _), here in zip(groups, begins) if p.remark is not None for line in here.tolist()
    ]
    lines = np.sort(np.concatenate([*begins, np.array(read.lines, dtype=np.int64)]))
    return (
        _table(data, view, edge, first, groups, read.moves),
        lines,
        edge[lines - first],
        tuple(text for _, text in sorted(remarks)),
    )


def _sorted_out(data: bytes, view: Bytes, edge: IntArray) -> list[tuple[_Pattern, Filled]]:
    def shape_at(k: int) -> tuple[Shape, _Pattern] | None:
        first, last = int(edge[k]), int(edge[k + 1])
        read = Statements(data)
        try:
            read.read(first, last, 1)
        except InputError:
            return None
        if read.state or not read.lines:
            return None
        move = read.moves[0] if read.moves else None
        number = line_number(data, first, last)
        found = [] if number is None else [("line", 0, shapes.DIGITS, before_blanks(data, number[0]), number[1])]
        found += [] if move is None else _holes(data, move)
        holes = tuple((kind, begin, end) for *_, kind, begin, end in found)
        what = {(name, i): hole for hole, (name, i, *_) in enumerate(found)}
        shape = shapes.shape_of(data, first, last, holes)
        remark = read.remarks[0][1] if read.remarks else None
        return None if shape is None else (shape, _Pattern(first, number is not None, move, remark, holes, what))

    return shapes.sorted_out(view, edge, shape_at)


def _holes(data: bytes, move: Move) -> list[tuple[str, int, int, int, int]]:
    """What differs between motions of one shape: numbers and names of positions, speeds, CNT."""
    found = []
    for i, (start, _) in enumerate(move.target):
        number, name = own_parts(data, move, i)
        if number[0] == start and data[start - 2 : start] == b"P[":
            found.append(("target", i, shapes.DIGITS, *number))
            found += [("name", i, shapes.TEXT, *name)] if name[1] > name[0] else []
    start, end = speed_number(data, move)
    if end > start:
        found.append(("speed", 0, shapes.DECIMAL, before_blanks(data, start) + 1, end))
    start, end = move.termination
    if data[start : start + 3].upper() == b"CNT" and data[start + 3 : end].isdigit():
        found.append(("termination", 0, shapes.DIGITS, start + 3, end))
    return found


def _one_by_one(
    data: bytes, edge: IntArray, first: int, fits: BoolArray, numbered: BoolArray
) -> tuple[Statements, BoolArray]:
    """The lines that fit no shape, and which of those that do were met where a statement may begin."""
    places, bad = edge.tolist(), np.flatnonzero(~fits).tolist()
    fit, begins = fits.tolist(), numbered.tolist()
    met = np.zeros_like(fits)
    read = Statements(data)
    k = 0
    while k < len(places) - 1:
        if fit[k] and (begins[k] or read.state == ""):
            read.between()
            after = bad[bisect_left(bad, k)]
            met[k:after] = True
            k = after
        else:
            read.read(places[k], places[k + 1], first + k)
            k += 1
    read.between()
    return read, met


def _table(
    data: bytes, view: Bytes, edge: IntArray, first: int, groups: list[tuple[_Pattern, Filled]], moves: list[Move]
) -> Motions:
    """Columns of all motions in the order they stand."""
    parts = [_many(data, view, edge, first, p, p.move, filled) for p, filled in groups if p.move is not None]
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
    data: bytes, view: Bytes, edge: IntArray, first: int, pattern: _Pattern, move: Move, filled: Filled
) -> Motions:
    """Motions of one shape."""
    n = len(filled.which)

    def places(span: Span) -> IntArray:
        return np.column_stack([pattern.place(edge, filled, at) for at in span])

    def said(name: str, span: IntArray, same: Span) -> list[str]:
        if (name, 0) in pattern.what:
            return shapes.texts(view, span)
        return [data[slice(*same)].decode("latin-1")] * n

    targets, numbers = [], []
    for i, (start, end) in enumerate(move.target):
        hole = pattern.what.get(("target", i))
        if hole is None:
            targets.append([target_text(data, move, i)] * n)
            numbers.append([own_number(data, move, i)] * n)
        else:
            targets.append(shapes.texts(view, places((start - 2, end + 1))))
            numbers.append(filled.value[:, hole].astype(np.int64).tolist())
    speed_span = places(move.speed)
    if ("speed", 0) in pattern.what:
        speed_span[:, 0] = filled.span[:, pattern.what["speed", 0], 0]
    return Motions(
        line=filled.which + first,
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
