"""Statements of one template: their fields, and where in each statement its parts stand."""

from dataclasses import dataclass

from compgen.core.arrays import IntArray
from compgen.core.decimals import Bytes
from compgen.core.exceptions import InputError
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.position_parser import blanks_before, skip_blanks
from compgen.fanuc.listing.statement_parser import (
    ParsedMotion,
    StatementParser,
    line_number_span,
    number_and_name_spans,
    speed_number_span,
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
