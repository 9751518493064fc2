"""Positions of a program, as columns: those of one template together, the others one by one."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.core.exceptions import InputError
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.lines import line_ends, line_of
from compgen.fanuc.listing.position_parser import (
    AXES,
    J1,
    NO_NUMBER,
    Block,
    Span,
    blanks_before,
    parse_block,
    skip_blanks,
    unquoted_name,
)
from compgen.fanuc.listing.templates import Matches, Template


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ListedPositions:
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
    remote: BoolArray  # (G,) RX to RR instead of X to R: the part in the frame of a tool that stands still

    @property
    def first_group(self) -> IntArray:
        """Rows of group 1, one for each position."""
        return np.flatnonzero(self.group <= 1)

    @property
    def joints(self) -> Array:
        """J1 to J6 as they are printed, (G, 6) [deg]; NaN of Cartesian positions."""
        return self.value[:, J1 : J1 + 6]

    @property
    def joint_form(self) -> BoolArray:
        """Which rows are told in joints, (G,)."""
        return np.asarray(self.span[:, J1, 1] > 0)

    def row_of(self) -> dict[int, int]:
        """The row of each position's number, group 1."""
        first = self.first_group
        return dict(zip(self.number[first].tolist(), first.tolist(), strict=True))

    def six_of(self, rows: IntArray) -> tuple[IntArray, IntArray]:
        """Where in ``value`` and ``span`` the six numbers of some rows are: X to R, or J1 to J6 in joint form."""
        return rows[:, None], np.where(self.joint_form[rows], J1, 0)[:, None] + np.arange(6)


def position_rows(number: IntArray, defined: IntArray) -> IntArray:
    """Row that holds each number; NO_NUMBER for numbers that are not there."""
    if not len(defined):
        return np.full(len(number), NO_NUMBER)
    order = np.argsort(defined, kind="stable")
    at = np.minimum(np.searchsorted(defined[order], number), len(defined) - 1)
    row = order[at]
    return np.where((defined[row] == number) & (number != NO_NUMBER), row, NO_NUMBER)


@dataclass(frozen=True, slots=True)
class _BlockTemplate:
    """What the parser read in one position: others of its template mean the same, save for their fields."""

    block: Block
    what: tuple[tuple[str, int, int], ...]  # what fills each: of which group, and in which column
    ends: int  # line ends in the text
    behind: int  # bytes behind the position


def read_positions(data: bytes, start: int, end: int, few_texts: int = templates.FEW_TEXTS) -> ListedPositions:
    """The positions in /POS.

    Raises:
        InputError: Something that is no position, or is given twice; names the line.
    """
    view = templates.padded(data)
    bounds = _block_starts(view, start, end)
    groups = _group_blocks(data, view, bounds) if len(bounds) > few_texts else []
    matched = np.zeros(len(bounds), dtype=bool)
    for _, matches in groups:
        matched[matches.which] = True
    blocks, reached = _parse_singly(data, start, end, bounds, matched)
    groups = [(template, templates.select(matches, reached)) for template, matches in groups]
    return _table(data, view, end, bounds, groups, blocks)


def _block_starts(view: Bytes, start: int, end: int) -> IntArray:
    """Where something like P[ stands, and the end of the last."""
    begins = templates.find_places(view, start, end, lambda d: ((d[:-1] | 32) == ord("p")) & (d[1:] == ord("[")))
    return np.append(begins, end)


def _group_blocks(data: bytes, view: Bytes, bounds: IntArray) -> list[tuple[_BlockTemplate, Matches]]:
    def template_at(k: int) -> tuple[Template, _BlockTemplate] | None:
        first, last = int(bounds[k]), int(bounds[k + 1])
        try:
            block = parse_block(data, first, last)
        except InputError:
            return None
        if block is None or skip_blanks(data, block.span[1], last) < last:
            return None
        fields, what = _block_fields(data, block)
        text_template = templates.template_of(data, first, last, fields)
        ends = line_ends(data, first, last)
        return (
            None if text_template is None else (text_template, _BlockTemplate(block, what, ends, last - block.span[1]))
        )

    return templates.group_by_template(view, bounds, template_at)


def _block_fields(data: bytes, block: Block) -> tuple[list[templates.Field], tuple[tuple[str, int, int], ...]]:
    """Fields of a position: numbers and names. Which groups and axes it has belongs to the template."""
    marked: list[tuple[Span, int, tuple[str, int, int]]] = [(block.number_span, templates.DIGITS, ("number", 0, 0))]
    if block.name:
        marked.append((block.name_span, templates.TEXT, ("name", 0, 0)))
    for g, group in enumerate(block.groups):
        for what, frame, span in zip(("uframe", "utool"), group.frame, group.frame_span, strict=True):
            if frame != NO_NUMBER:
                marked.append((span, templates.DIGITS, (what, g, 0)))
        if group.config is not None:
            marked.append((group.config_span, templates.TEXT, ("config", g, 0)))
        for column, (value, span) in group.axes.items():
            marked.append((span, templates.STARS if np.isnan(value) else templates.NUMBER, ("axis", g, column)))
    marked.sort()
    fields = [
        (kind, first if kind == templates.TEXT else blanks_before(data, first), last)
        for (first, last), kind, _ in marked
    ]
    return fields, tuple(what for _, _, what in marked)


def _parse_singly(
    data: bytes, start: int, end: int, bounds: IntArray, matched: BoolArray
) -> tuple[list[Block], BoolArray]:
    """The positions that match no template, and which of the others were reached where a position may begin."""
    places, unmatched = bounds.tolist(), np.flatnonzero(~matched).tolist()
    reached = np.zeros_like(matched)
    blocks = []
    at = skip_blanks(data, start, end)
    while at < end:
        k = bisect_left(places, at)
        if places[k] == at and matched[k]:
            after = unmatched[bisect_left(unmatched, k)]
            reached[k:after] = True
            at = places[after]
        else:
            block = parse_block(data, at, end)
            if block is None:
                raise InputError(f"program: line {line_of(data, at)}: not a position; mend it")
            blocks.append(block)
            at = skip_blanks(data, block.span[1], end)
    return blocks, reached


def _table(
    data: bytes,
    view: Bytes,
    end: int,
    bounds: IntArray,
    groups: list[tuple[_BlockTemplate, Matches]],
    blocks: list[Block],
) -> ListedPositions:
    """Columns of all positions in the order they stand."""
    parts = [
        (bounds[f.which], len(p.block.groups), p.ends, f.value[:, 0], bounds[f.which + 1] - p.behind) for p, f in groups
    ]
    singly = np.array([(b.span[0], len(b.groups), 0, b.number, b.span[1]) for b in blocks]).reshape(-1, 5)
    unordered = np.concatenate([*(np.column_stack(np.broadcast_arrays(*p)) for p in parts), singly]).astype(np.int64)
    order = np.argsort(unordered[:, 0])
    place, many, ends, number, stop = unordered[order].T
    rank = np.argsort(order)
    first = (np.cumsum(many) - many)[rank]  # row of a position's first group
    parsed = rank[len(rank) - len(blocks) :]
    following = np.append(place, end)[parsed + 1].tolist()
    ends[parsed] = [line_ends(data, b.span[0], n) for b, n in zip(blocks, following, strict=True)]
    line = np.cumsum(ends) - ends + (line_of(data, int(place[0])) if len(place) else 0)
    _refuse_duplicates(number, line)
    table = _blank(
        np.repeat(number, many), np.repeat(line, many), np.repeat(np.column_stack([place, stop]), many, axis=0)
    )
    names: list[str] = [""] * len(table.number)
    configs: list[str | None] = [None] * len(table.number)
    *of_groups, of_blocks = np.split(first, np.cumsum([len(matches.which) for _, matches in groups]))
    for (template, matches), rows in zip(groups, of_groups, strict=True):
        _fill_matched(view, table, names, configs, template, matches, rows)
    for block, row in zip(blocks, of_blocks.tolist(), strict=True):
        _fill_parsed(table, names, configs, block, row)
    return replace(table, name=tuple(names), config=tuple(configs))


def _blank(number: IntArray, line: IntArray, block: IntArray) -> ListedPositions:
    """Rows of groups of which nothing is known yet but where they stand: their position's number, line and span."""
    rows = len(number)
    return ListedPositions(
        number=number,
        group=np.zeros(rows, dtype=np.int64),
        line=line,
        name=(),
        uframe=np.full(rows, NO_NUMBER),
        utool=np.full(rows, NO_NUMBER),
        config=(),
        config_span=np.zeros((rows, 2), dtype=np.int64),
        value=np.full((rows, len(AXES)), np.nan),
        span=np.zeros((rows, len(AXES), 2), dtype=np.int64),
        block=block,
        remote=np.zeros(rows, dtype=bool),
    )


def _fill_matched(
    view: Bytes,
    table: ListedPositions,
    names: list[str],
    configs: list[str | None],
    template: _BlockTemplate,
    matches: Matches,
    first: IntArray,
) -> None:
    """Rows of positions of one template."""
    for g, group in enumerate(template.block.groups):
        table.group[first + g], table.remote[first + g] = group.group, group.remote
    axes: dict[int, list[tuple[int, int]]] = {}
    for field, (what, g, column) in enumerate(template.what):
        rows = first + g
        if what == "axis":
            axes.setdefault(g, []).append((field, column))
        elif what in ("uframe", "utool"):
            getattr(table, what)[rows] = matches.value[:, field]
        elif what == "config":
            table.config_span[rows] = matches.span[:, field]
            _put(configs, rows, templates.decode_texts(view, matches.span[:, field]))
        elif what == "name":
            texts = [unquoted_name(text) for text in templates.decode_texts(view, matches.span[:, field])]
            for k in range(len(template.block.groups)):
                _put(names, rows + k, texts)
    for g, pairs in axes.items():
        fields, columns = (np.array(numbers) for numbers in zip(*pairs, strict=True))
        table.value[(first + g)[:, None], columns] = matches.value[:, fields]
        table.span[(first + g)[:, None], columns] = matches.span[:, fields]


def _put(column: list[Any], rows: IntArray, texts: Sequence[str]) -> None:
    """Texts into their rows of a column."""
    for row, text in zip(rows.tolist(), texts, strict=True):
        column[row] = text


def _fill_parsed(table: ListedPositions, names: list[str], configs: list[str | None], block: Block, row: int) -> None:
    """Rows of one position."""
    for i, group in enumerate(block.groups, row):
        names[i], configs[i] = block.name, group.config
        table.group[i], (table.uframe[i], table.utool[i]) = group.group, group.frame
        table.config_span[i], table.remote[i] = group.config_span, group.remote
        for column, (value, span) in group.axes.items():
            table.value[i, column], table.span[i, column] = value, span


def decimal_places(data: bytes, span: IntArray) -> IntArray:
    """Digits behind the point of numbers at places (..., 2); 0 where there is none."""
    begin, end = span[..., 0], span[..., 1]
    view = np.frombuffer(data, dtype=np.uint8)
    decimals = np.zeros(begin.shape, dtype=np.int64)
    for k in range(int((end - begin).max(initial=0))):
        at = begin + k
        is_point = (at < end) & (view[np.minimum(at, len(view) - 1)] == ord("."))
        decimals[is_point] = (end - at - 1)[is_point]
    return decimals


def units(data: bytes, span: IntArray) -> np.ndarray:
    """The unit behind each number at places (..., 2): "mm", "deg", or "" where there is none."""
    view = np.frombuffer(data, dtype=np.uint8)
    at = span[..., 1].copy()
    while (blank := np.isin(view[at], (ord(" "), ord("\t"))) & (at > 0)).any():
        at += blank
    letter = np.where(at > 0, view[at] | 0x20, 0)  # small
    return np.select([letter == ord("m"), letter == ord("d")], ["mm", "deg"], "")


def _refuse_duplicates(number: IntArray, line: IntArray) -> None:
    """Raises InputError for a position that is defined twice."""
    order = np.argsort(number, kind="stable")
    again = order[1:][np.diff(number[order]) == 0]
    if len(again):
        i = int(again.min())
        raise InputError(f"program: line {line[i]}: P[{number[i]}] is defined twice; remove one")
