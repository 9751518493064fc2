"""Motion statements of a program, as columns: lines of one template together, the others one by one.

A statement's template knows its fields, and where in each statement of it the parts stand.
"""

from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.core.exceptions import InputError
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.lines import line_of
from compgen.fanuc.listing.position_parser import Span, blanks_before, skip_blanks
from compgen.fanuc.listing.statement_parser import (
    LONGEST_STATEMENT,
    ParsedMotion,
    StatementParser,
    line_number_span,
    number_and_name_spans,
    position_number,
    speed_number_span,
    target_text,
    too_long,
)
from compgen.fanuc.listing.templates import Matches, Template


@dataclass(frozen=True, slots=True)
class StatementTemplate:
    """What the parser read in one statement: others of its template are the same."""

    start: int  # of its first line
    numbered: bool
    move: ParsedMotion | None
    fields: tuple[templates.Field, ...]
    field_of: dict[tuple[str, int], int]  # which field holds a part: ("target", 0), ("speed", 0), ...

    def place(self, bounds: IntArray, matches: Matches, at: int) -> IntArray:
        """Where a place of this statement is in the others; it lies outside the fields, or where one begins."""
        behind = [(k, last) for k, (_, _, last) in enumerate(self.fields) if last <= at]
        if not behind:
            return bounds[matches.which] + (at - self.start)
        field, last = behind[-1]
        return matches.span[:, field, 1] + (at - last)


def group_statements(
    data: bytes, view: Bytes, lines: IntArray, unit: IntArray
) -> list[tuple[StatementTemplate, Matches]]:
    """Statements of one template together, by number of unit; those left out are read line by line.

    Args:
        data: The whole file.
        view: Its bytes, ``templates.padded``.
        lines: Where each physical line begins, and the end of the last.
        unit: Lines at which something new begins, and the number of lines.
    """

    def template_at(k: int) -> tuple[Template, StatementTemplate] | None:
        parser = StatementParser(data=data)
        try:
            for i in range(unit[k], unit[k + 1]):
                parser.read(int(lines[i]), int(lines[i + 1]), i)
        except InputError:
            return None
        if parser.state or parser.lines != [unit[k]]:
            return None
        first, last = int(lines[unit[k]]), int(lines[unit[k + 1]])
        number = line_number_span(data, first, last)
        named_fields = (
            [] if number is None else [("line", 0, templates.DIGITS, blanks_before(data, number[0]), number[1])]
        )
        named_fields += _motion_fields(data, parser.moves[0]) if parser.moves else _text_fields(data, first, last)
        fields = tuple((kind, begin, end) for *_, kind, begin, end in named_fields)
        field_of = {(name, i): field for field, (name, i, *_) in enumerate(named_fields)}
        template = templates.template_of(data, first, last, fields)
        move = parser.moves[0] if parser.moves else None
        return (
            None
            if template is None
            else (template, StatementTemplate(first, number is not None, move, fields, field_of))
        )

    return templates.group_by_template(view, lines[unit], template_at)


def _text_fields(data: bytes, first: int, last: int) -> list[tuple[str, int, int, int, int]]:
    """Field of a statement that is no motion: all behind the mark of a remark, or behind two letters.

    Two characters that no motion begins with stay, so that the field cannot make it one.
    """
    body = data.index(b":", first, last) + 1
    close = data.find(b";", body, last)
    begin = skip_blanks(data, body, last)
    if data[begin : begin + 1] == b"!":
        return [("remark", 0, templates.TEXT, begin + 1, close)]
    plain = data[begin : begin + 2].isalnum() and begin + 2 <= close
    return [("text", 0, templates.TEXT, begin + 2, close)] if plain else []


def _motion_fields(data: bytes, move: ParsedMotion) -> list[tuple[str, int, int, int, int]]:
    """Fields of a motion: numbers and names of positions, speed, CNT."""
    named_fields = []
    for i, (start, _) in enumerate(move.target):
        number, name = number_and_name_spans(data, move, i)
        if number[0] == start and data[start - 2 : start] == b"P[":
            named_fields.append(("target", i, templates.DIGITS, *number))
            named_fields += [("name", i, templates.TEXT, *name)] if name[1] > name[0] else []
    start, end = speed_number_span(data, move)
    if end > start:
        named_fields.append(("speed", 0, templates.DECIMAL, blanks_before(data, start) + 1, end))
    start, end = move.termination
    if data[start : start + 3].upper() == b"CNT" and data[start + 3 : end].isdigit():
        named_fields.append(("termination", 0, templates.DIGITS, start + 3, end))
    return named_fields


_ENDS_WIDTH = 16  # characters at either end of a line that tell whether it goes on


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
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


def read_motions(
    data: bytes, start: int, end: int, few_texts: int = templates.FEW_TEXTS
) -> tuple[Motions, IntArray, IntArray, tuple[str, ...]]:
    """The motions in /MN, the line and the byte at which each statement begins, and the remarks.

    Raises:
        InputError: A move whose target is not understood, a C without its end point, or a statement that is too long;
            names the line.
    """
    view = templates.padded(memoryview(data)[:end])
    first, lines = line_of(data, start), _lines(view, start, end)
    long = np.flatnonzero(np.diff(lines) > LONGEST_STATEMENT)
    if len(long):
        raise too_long(first + int(long[0]))
    unit = _statement_starts(view, lines) if len(lines) > few_texts else np.arange(len(lines))
    bounds = lines[unit]
    groups = group_statements(data, view, lines, unit) if len(unit) > few_texts else []
    matched, numbered = np.zeros(len(unit), dtype=bool), np.zeros(len(unit), dtype=bool)
    for template, matches in groups:
        matched[matches.which], numbered[matches.which] = True, template.numbered
    parser, reached = _parse_singly(data, lines, unit, first, matched, numbered)
    groups = [(template, templates.select(matches, reached)) for template, matches in groups]
    begins = [unit[matches.which] + first for _, matches in groups]
    remarks = parser.remarks
    for (template, matches), lines_of_group in zip(groups, begins, strict=True):
        if ("remark", 0) in template.field_of:
            texts = templates.decode_texts(view, matches.span[:, template.field_of["remark", 0]])
            remarks += [(line, text.rstrip()) for line, text in zip(lines_of_group.tolist(), texts, strict=True)]
    statements = np.sort(np.concatenate([*begins, np.array(parser.lines, dtype=np.int64)]))
    return (
        _table(data, view, bounds, unit + first, groups, parser.moves),
        statements,
        lines[statements - first],
        tuple(text for _, text in sorted(remarks)),
    )


def _lines(view: Bytes, start: int, end: int) -> IntArray:
    """Where each physical line begins, and the end of the last."""
    ends = templates.find_places(view, start, end, lambda d: (d[:-1] == 10) | ((d[:-1] == 13) & (d[1:] != 10))) + 1
    return np.concatenate([[start], ends[ends < end], [end] if end > start else []]).astype(np.int64)


def _statement_starts(view: Bytes, lines: IntArray) -> IntArray:
    """Lines at which something new begins, and the number of lines; a line that goes on with an open statement is none.

    A guess by the first and the last characters only; the parser decides.
    """
    head, tail = (
        templates.byte_windows(view, lines[:-1], _ENDS_WIDTH),
        templates.byte_windows(view, np.maximum(lines[:-1] - _ENDS_WIDTH, 0), _ENDS_WIDTH),
    )
    blank = (head == ord(" ")) | (head == ord("\t"))
    goes_on = head[np.arange(len(head)), blank.argmin(axis=1)] == ord(":")
    blank = (tail == ord(" ")) | (tail == ord("\t")) | (tail == ord("\r")) | (tail == ord("\n"))
    goes_on &= tail[np.arange(len(tail)), _ENDS_WIDTH - 1 - blank[:, ::-1].argmin(axis=1)] != ord(";")
    goes_on[0] = False
    return np.append(np.flatnonzero(~goes_on), len(lines) - 1)


def _parse_singly(
    data: bytes, lines: IntArray, unit: IntArray, first: int, matched: BoolArray, numbered: BoolArray
) -> tuple[StatementParser, BoolArray]:
    """The lines that match no template, and which of the others were reached where a statement may begin."""
    places, units, unmatched = lines.tolist(), unit.tolist(), np.flatnonzero(~matched).tolist()
    is_matched, begins = matched.tolist(), numbered.tolist()
    reached = np.zeros_like(matched)
    parser = StatementParser(data=data)
    k = 0
    while k < len(units) - 1:
        if is_matched[k] and (begins[k] or parser.state == ""):
            parser.begin_statement()
            after = unmatched[bisect_left(unmatched, k)]
            reached[k:after] = True
            k = after
        else:
            for i in range(units[k], units[k + 1]):
                parser.read(places[i], places[i + 1], first + i)
            k += 1
    parser.begin_statement()
    return parser, reached


def _table(
    data: bytes,
    view: Bytes,
    bounds: IntArray,
    number: IntArray,
    groups: list[tuple[StatementTemplate, Matches]],
    moves: list[ParsedMotion],
) -> Motions:
    """Columns of all motions in the order they stand."""
    parts = [
        _matched_motions(data, view, bounds, number, p, p.move, matches) for p, matches in groups if p.move is not None
    ]
    parts.append(_parsed_motions(data, moves))
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


def _matched_motions(
    data: bytes,
    view: Bytes,
    bounds: IntArray,
    number: IntArray,
    template: StatementTemplate,
    move: ParsedMotion,
    matches: Matches,
) -> Motions:
    """Motions of one template."""
    n = len(matches.which)

    def places(span: Span) -> IntArray:
        return np.column_stack([template.place(bounds, matches, at) for at in span])

    def column_texts(name: str, span: IntArray, span_in_template: Span) -> list[str]:
        if (name, 0) in template.field_of:
            return templates.decode_texts(view, span)
        return [data[slice(*span_in_template)].decode("latin-1")] * n

    targets, numbers = [], []
    for i, (start, end) in enumerate(move.target):
        field = template.field_of.get(("target", i))
        if field is None:
            targets.append([target_text(data, move, i)] * n)
            numbers.append([position_number(data, move, i)] * n)
        else:
            targets.append(templates.decode_texts(view, places((start - 2, end + 1))))
            numbers.append(matches.value[:, field].astype(np.int64).tolist())
    speed_span = places(move.speed)
    if ("speed", 0) in template.field_of:
        speed_span[:, 0] = matches.span[:, template.field_of["speed", 0], 0]
    return Motions(
        line=number[matches.which],
        letter=(move.letter,) * n,
        disabled=np.full(n, move.disabled),
        target=tuple(zip(*targets, strict=True)),
        position=tuple(zip(*numbers, strict=True)),
        speed=tuple(column_texts("speed", speed_span, move.speed)),
        termination=tuple(column_texts("termination", places(move.termination), move.termination)),
        options=(move.options,) * n,
        span=places(move.span),
        speed_span=speed_span,
    )


def _parsed_motions(data: bytes, moves: list[ParsedMotion]) -> Motions:
    """Motions that were read one by one."""

    def column_texts(spans: Iterable[Span]) -> tuple[str, ...]:
        return tuple(data[start:end].decode("latin-1") for start, end in spans)

    return Motions(
        line=np.array([m.line for m in moves], dtype=np.int64),
        letter=tuple(m.letter for m in moves),
        disabled=np.array([m.disabled for m in moves], dtype=bool),
        target=tuple(tuple(target_text(data, m, i) for i in range(len(m.target))) for m in moves),
        position=tuple(tuple(position_number(data, m, i) for i in range(len(m.target))) for m in moves),
        speed=column_texts(m.speed for m in moves),
        termination=column_texts(m.termination for m in moves),
        options=tuple(m.options for m in moves),
        span=np.array([m.span for m in moves], dtype=np.int64).reshape(-1, 2),
        speed_span=np.array([m.speed for m in moves], dtype=np.int64).reshape(-1, 2),
    )
