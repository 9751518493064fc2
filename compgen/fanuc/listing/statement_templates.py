"""Statements of one shape: what differs between them, and where."""

from dataclasses import dataclass

from compgen.core.arrays import IntArray
from compgen.core.decimals import Bytes
from compgen.core.exceptions import InputError
from compgen.fanuc.listing import templates
from compgen.fanuc.listing.position_parser import before_blanks, skip
from compgen.fanuc.listing.statement_parser import Move, Statements, line_number, own_parts, speed_number
from compgen.fanuc.listing.templates import Filled, Shape


@dataclass(frozen=True, slots=True)
class Pattern:
    """What the careful reader found in one statement: others of its shape are the same."""

    start: int  # of its first line
    numbered: bool
    move: Move | None
    holes: tuple[templates.Hole, ...]
    what: dict[tuple[str, int], int]  # which hole holds a part: ("target", 0), ("speed", 0), ...

    def place(self, edge: IntArray, filled: Filled, at: int) -> IntArray:
        """Where a place of this statement is in the others; it lies outside the holes, or where one begins."""
        behind = [(h, last) for h, (_, _, last) in enumerate(self.holes) if last <= at]
        if not behind:
            return edge[filled.which] + (at - self.start)
        hole, last = behind[-1]
        return filled.span[:, hole, 1] + (at - last)


def sorted_out(data: bytes, view: Bytes, lines: IntArray, unit: IntArray) -> list[tuple[Pattern, Filled]]:
    """Statements of one shape together, by number of unit; what is left out is read line by line.

    Args:
        data: The whole file.
        view: The same, ``shapes.padded``.
        lines: Where each physical line begins, and the end of the last.
        unit: Lines at which something new begins, and the number of lines.
    """

    def shape_at(k: int) -> tuple[Shape, Pattern] | None:
        read = Statements(data)
        try:
            for i in range(unit[k], unit[k + 1]):
                read.read(int(lines[i]), int(lines[i + 1]), i)
        except InputError:
            return None
        if read.state or read.lines != [unit[k]]:
            return None
        first, last = int(lines[unit[k]]), int(lines[unit[k + 1]])
        number = line_number(data, first, last)
        found = [] if number is None else [("line", 0, templates.DIGITS, before_blanks(data, number[0]), number[1])]
        found += _holes(data, read.moves[0]) if read.moves else _opaque(data, first, last)
        holes = tuple((kind, begin, end) for *_, kind, begin, end in found)
        what = {(name, i): hole for hole, (name, i, *_) in enumerate(found)}
        shape = templates.shape_of(data, first, last, holes)
        move = read.moves[0] if read.moves else None
        return None if shape is None else (shape, Pattern(first, number is not None, move, holes, what))

    return templates.sorted_out(view, lines[unit], shape_at)


def _opaque(data: bytes, first: int, last: int) -> list[tuple[str, int, int, int, int]]:
    """What differs between statements that are no motion: all behind the mark of a remark, or behind two letters.

    Two characters that no motion begins with stay, so that what fills the hole cannot make it one.
    """
    body = data.index(b":", first, last) + 1
    close = data.find(b";", body, last)
    begin = skip(data, body, last)
    if data[begin : begin + 1] == b"!":
        return [("remark", 0, templates.TEXT, begin + 1, close)]
    plain = data[begin : begin + 2].isalnum() and begin + 2 <= close
    return [("text", 0, templates.TEXT, begin + 2, close)] if plain else []


def _holes(data: bytes, move: Move) -> list[tuple[str, int, int, int, int]]:
    """What differs between motions of one shape: numbers and names of positions, speeds, CNT."""
    found = []
    for i, (start, _) in enumerate(move.target):
        number, name = own_parts(data, move, i)
        if number[0] == start and data[start - 2 : start] == b"P[":
            found.append(("target", i, templates.DIGITS, *number))
            found += [("name", i, templates.TEXT, *name)] if name[1] > name[0] else []
    start, end = speed_number(data, move)
    if end > start:
        found.append(("speed", 0, templates.DECIMAL, before_blanks(data, start) + 1, end))
    start, end = move.termination
    if data[start : start + 3].upper() == b"CNT" and data[start + 3 : end].isdigit():
        found.append(("termination", 0, templates.DIGITS, start + 3, end))
    return found
