"""Positions of a program, as columns: those of one shape together, the others one by one."""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.core.exceptions import InputError
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.lines import line_ends, line_of
from compgen.fanuc.listing.position_parser import (
    AXES,
    NO_NUMBER,
    Block,
    Span,
    before_blanks,
    plain_name,
    read_block,
    skip,
)
from compgen.fanuc.listing.templates import Filled, Shape


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


@dataclass(frozen=True, slots=True)
class _Pattern:
    """What the careful reader found in one position: the others of its shape mean the same, save for their holes."""

    block: Block
    what: tuple[tuple[str, int, int], ...]  # what fills each: of which group, and in which column
    ends: int  # line ends in the text
    behind: int  # bytes behind the position


def read_positions(data: bytes, start: int, end: int) -> Positions:
    """The positions in /POS.

    Raises:
        InputError: Something that is no position, or is given twice; names the line.
    """
    view = templates.padded(data)
    edge = _edges(view, start, end)
    groups = _sorted_out(data, view, edge) if len(edge) > templates.FEW else []
    fits = np.zeros(len(edge), dtype=bool)
    for _, filled in groups:
        fits[filled.which] = True
    blocks, met = _one_by_one(data, start, end, edge, fits)
    groups = [(pattern, templates.only(filled, met)) for pattern, filled in groups]
    return _table(data, view, end, edge, groups, blocks)


def _edges(view: Bytes, start: int, end: int) -> IntArray:
    """Where something like P[ stands, and the end of the last."""
    begins = templates.found(view, start, end, lambda d: ((d[:-1] | 32) == ord("p")) & (d[1:] == ord("[")))
    return np.append(begins, end)


def _sorted_out(data: bytes, view: Bytes, edge: IntArray) -> list[tuple[_Pattern, Filled]]:
    def shape_at(k: int) -> tuple[Shape, _Pattern] | None:
        first, last = int(edge[k]), int(edge[k + 1])
        try:
            block = read_block(data, first, last)
        except InputError:
            return None
        if block is None or skip(data, block.span[1], last) < last:
            return None
        holes, what = _holes(data, block)
        shape = templates.shape_of(data, first, last, holes)
        ends = line_ends(data, first, last)
        return None if shape is None else (shape, _Pattern(block, what, ends, last - block.span[1]))

    return templates.sorted_out(view, edge, shape_at)


def _holes(data: bytes, block: Block) -> tuple[list[templates.Hole], tuple[tuple[str, int, int], ...]]:
    """What differs between positions of one shape: numbers and names; which groups and axes there are is the shape."""
    found: list[tuple[Span, int, tuple[str, int, int]]] = [(block.number_span, templates.DIGITS, ("number", 0, 0))]
    if block.name:
        found.append((block.name_span, templates.TEXT, ("name", 0, 0)))
    for g, group in enumerate(block.groups):
        for what, frame, span in zip(("uframe", "utool"), group.frame, group.frame_span):
            if frame != NO_NUMBER:
                found.append((span, templates.DIGITS, (what, g, 0)))
        if group.config is not None:
            found.append((group.config_span, templates.TEXT, ("config", g, 0)))
        for column, (value, span) in group.axes.items():
            found.append((span, templates.STARS if np.isnan(value) else templates.NUMBER, ("axis", g, column)))
    found.sort()
    holes = [
        (kind, first if kind == templates.TEXT else before_blanks(data, first), last)
        for (first, last), kind, _ in found
    ]
    return holes, tuple(what for _, _, what in found)


def _one_by_one(data: bytes, start: int, end: int, edge: IntArray, fits: BoolArray) -> tuple[list[Block], BoolArray]:
    """The positions that fit no shape, and which of those that do were met where a position may begin."""
    places, bad = edge.tolist(), np.flatnonzero(~fits).tolist()
    met = np.zeros_like(fits)
    blocks = []
    at = skip(data, start, end)
    while at < end:
        k = bisect_left(places, at)
        if places[k] == at and fits[k]:
            after = bad[bisect_left(bad, k)]
            met[k:after] = True
            at = places[after]
        else:
            block = read_block(data, at, end)
            if block is None:
                raise InputError(f"program: line {line_of(data, at)}: not a position; mend it")
            blocks.append(block)
            at = skip(data, block.span[1], end)
    return blocks, met


def _table(
    data: bytes, view: Bytes, end: int, edge: IntArray, groups: list[tuple[_Pattern, Filled]], blocks: list[Block]
) -> Positions:
    """Columns of all positions in the order they stand."""
    place = np.concatenate([*(edge[f.which] for _, f in groups), _ints(b.span[0] for b in blocks)])
    order = np.argsort(place)
    rank = np.argsort(order)
    count = np.concatenate([*(_same(len(p.block.groups), f) for p, f in groups), _ints(len(b.groups) for b in blocks)])
    first = (np.cumsum(count[order]) - count[order])[rank]  # row of a position's first group
    following = np.append(place[order], end)[rank + 1]
    singles = slice(len(place) - len(blocks), None)
    lines = [line_ends(data, b.span[0], n) for b, n in zip(blocks, following[singles].tolist())]
    ends = np.concatenate([*(_same(p.ends, f) for p, f in groups), _ints(lines)])[order]
    line = np.cumsum(ends) - ends + (line_of(data, int(place[order[0]])) if len(place) else 0)
    number = np.concatenate([*(f.value[:, 0].astype(np.int64) for _, f in groups), _ints(b.number for b in blocks)])
    stop = np.concatenate([*(edge[f.which + 1] - p.behind for p, f in groups), _ints(b.span[1] for b in blocks)])
    _once(number[order], line)
    many = count[order]
    rows = int(many.sum())
    table = Positions(
        number=np.repeat(number[order], many),
        group=np.zeros(rows, dtype=np.int64),
        line=np.repeat(line, many),
        name=(),
        uframe=np.full(rows, NO_NUMBER),
        utool=np.full(rows, NO_NUMBER),
        config=(),
        config_span=np.zeros((rows, 2), dtype=np.int64),
        value=np.full((rows, len(AXES)), np.nan),
        span=np.zeros((rows, len(AXES), 2), dtype=np.int64),
        block=np.repeat(np.column_stack([place, stop])[order], many, axis=0),
    )
    names: list[str] = [""] * rows
    configs: list[str | None] = [None] * rows
    done = 0
    for pattern, filled in groups:
        _many(view, table, names, configs, pattern, filled, first[done : done + len(filled.which)])
        done += len(filled.which)
    for block, row in zip(blocks, first[singles].tolist()):
        _one(table, names, configs, block, row)
    return replace(table, name=tuple(names), config=tuple(configs))


def _many(
    view: Bytes,
    table: Positions,
    names: list[str],
    configs: list[str | None],
    pattern: _Pattern,
    filled: Filled,
    first: IntArray,
) -> None:
    """Rows of positions of one shape."""
    for g, group in enumerate(pattern.block.groups):
        table.group[first + g] = group.group
    axes: dict[int, list[tuple[int, int]]] = {}
    for hole, (what, g, column) in enumerate(pattern.what):
        rows = first + g
        if what == "axis":
            axes.setdefault(g, []).append((hole, column))
        elif what in ("uframe", "utool"):
            getattr(table, what)[rows] = filled.value[:, hole]
        elif what == "config":
            table.config_span[rows] = filled.span[:, hole]
            for row, text in zip(rows.tolist(), templates.texts(view, filled.span[:, hole])):
                configs[row] = text
        elif what == "name":
            said = templates.texts(view, filled.span[:, hole])
            for row, text in zip(rows.tolist(), said):
                for k in range(len(pattern.block.groups)):
                    names[row + k] = plain_name(text)
    for g, pairs in axes.items():
        holes, columns = (np.array(numbers) for numbers in zip(*pairs))
        table.value[(first + g)[:, None], columns] = filled.value[:, holes]
        table.span[(first + g)[:, None], columns] = filled.span[:, holes]


def _one(table: Positions, names: list[str], configs: list[str | None], block: Block, row: int) -> None:
    """Rows of one position."""
    for i, group in enumerate(block.groups, row):
        names[i], configs[i] = block.name, group.config
        table.group[i], (table.uframe[i], table.utool[i]) = group.group, group.frame
        table.config_span[i] = group.config_span
        for column, (value, span) in group.axes.items():
            table.value[i, column], table.span[i, column] = value, span


def _once(number: IntArray, line: IntArray) -> None:
    """Raises InputError for a position that is defined twice."""
    order = np.argsort(number, kind="stable")
    again = order[1:][np.diff(number[order]) == 0]
    if len(again):
        i = int(again.min())
        raise InputError(f"program: line {line[i]}: P[{number[i]}] is defined twice; remove one")


def _ints(values: Iterable[int]) -> IntArray:
    return np.array(list(values), dtype=np.int64)


def _same(value: int, filled: Filled) -> IntArray:
    return np.full(len(filled.which), value)
