"""Where the header and the readings of a recorded table are, and what the file says of its units.

The header is the row above the readings, or the last one that has all names that the user says.
"""

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, NamedTuple

from compgen.core.csv_table import CsvRow
from compgen.core.exceptions import InputError
from compgen.core.recorded.cells import LONG, brief_name, measured_by, name_and_unit, plain_name, unit_named
from compgen.core.recorded.sheets import Sheet, kinds
from compgen.core.toml import Table

#: what says of two columns of one name which is the wanted place or joint, and which the measured one: x ist, no wrist
SIDE = re.compile(
    r"^(?:{0})(?: (?=.)|(?=[xyz]$))|(?:(?<=.) |(?<=^[xyz])|(?<=^j\d))(?:{0})$".format(
        "(?:nominal|nom|soll|commanded|command|comm|cmd|target|ref|reference|theo|theoretical|théorique|"
        "actual|act|ist|measured|meas|mess|gemessen|mesuré|measurement)(?: ?(?:values?|werte?|points?|coordinates?))?"
    )
)
#: what a row above the header calls columns that are no places
_DIFFERENCE = re.compile(r"(?i)\W*(dev|diff|delta|abw|[eé]cart|err|tol|soll ?- ?ist|ist ?- ?soll)")
#: of rows behind the last reading
_STATISTICS = {
    *("mean", "average", "avg", "median", "mittel", "mittelwert", "min", "minimum", "max", "maximum", "range", "rms"),
    *("sum", "summe", "total", "count", "anzahl", "std", "std dev", "stdev", "stddev", "std abw", "sigma"),
    *("moyenne", "somme", "écart type", "ecart type", "media", "promedio", "standardabweichung", "stabw", "spannweite"),
}
#: a line beside the readings that says their unit: "Units: Inches, Degrees", "Temperature unit;Fahrenheit"
_SAYS_UNIT = re.compile(
    r"(?i).*\b(?:units?|einheit(?:en)?|angles?|lengths?|(?:coordinates|temperatures?|values|(?:mess)?werte|messung) in)"
    r"\b\W*(.+)$"
)
#: what a row of units above the header is called: "Unit", "Y_Unit_Label"
_UNIT_ROW = re.compile(r"(?i)\w*(?:unit|einheit)\w*[\w ]*:?")
#: a line that says of columns named x, y, z that they are others
_POLAR = re.compile(r"(?i)coordinate.*\b(cylind|spheric|polar)|(zylinder|kugel|polar)koordinat")


class DialectTable(Table):
    """How a file is written, where it does not say so itself."""

    columns: dict[str, str] = {}  # noqa: RUF012 - pydantic copies it
    """What the file calls a column, by the name it has here: j2 = "TC 03", or "#4" for the fourth."""
    unit: str | None = None
    """Unit of columns that name none: degC, degF or K; mm, m or inch."""
    delimiter: Literal["comma", "semicolon", "tab", "bar", "blanks"] | None = None
    """What parts the cells; default: recognised."""
    decimal: Literal["point", "comma"] | None = None
    """The decimal sign; default: recognised."""
    dates: Literal["dmy", "mdy", "ymd"] | None = None
    """Order of day, month and year; default: the one that fits every row."""


PLAIN = DialectTable()


class Layout(NamedTuple):
    """A file's readings under its header, and what the user says of them."""

    place: str  # the file
    table: str  # of a TOML file in which the user may say more; or nothing
    dialect: DialectTable
    names: Sequence[str]
    units: Sequence[set[str]]  # that the file says of each column
    unit_of_all: set[str]  # that a line beside the table says
    line: int  # of the header
    parted: str  # by what
    body: Sequence[CsvRow]
    summed: Sequence[str]  # lines behind it, and remarks like readings, that are none, though they have numbers

    def column(self, k: int) -> list[str]:
        """The cells of a column."""
        return [cells[k] if k < len(cells) else "" for _, cells in self.body]

    def where(self, k: int, line: int) -> str:
        """File, line and column, for a message."""
        return f"{self.place}: line {line or self.body[0][0]}, column {k + 1} '{brief_name(self.names[k], 32)}'"

    def key(self, k: int) -> str:
        """A column as the user may name it: by its number, where its name is long or another's too."""
        return self.names[k] if len(self.names[k]) <= LONG and self.names.count(self.names[k]) == 1 else f"#{k + 1}"

    def mend(self, words: str, otherwise: str) -> str:
        """What the user can say of the file, or else do to it."""
        return f"say {words} in {self.table}" if self.table else otherwise

    def refuse(self, what: str) -> InputError:
        """A refusal of the header, which lists its columns."""
        listed = f"; there are: {', '.join(map(brief_name, self.names))}" if len(what) < 180 else ""
        line = f"line {self.line}" if self.line else f"line {self.body[0][0]}: no header above it"
        return InputError(f"{self.place}: {line}: {what}{listed[: 213 - len(what)]}")

    def unsure(self, columns: Mapping[str, Sequence[int]]) -> InputError:
        """A refusal of columns that stand in the file twice, or as what they shall be or were measured to be."""
        column, own = next(iter(columns.items()))
        sets = zip(*list(columns.values())[: 3 if len(own) > 1 else 9], strict=False)  # a line may have 300 characters
        pairs = (", ".join(f'{c} = "#{k + 1}"' for c, k in zip(columns, ks, strict=False)) for ks in sets)
        mend = self.mend(" or ".join(f"columns = {{ {pair} }}" for pair in pairs), "rename one")
        return self.refuse(
            f"column{'s' * (len(own) > 1)} {' and '.join(str(k + 1) for k in own)}{' both' * (len(own) > 1)} may be "
            f"{column} ({', '.join(brief_name(self.names[k]) for k in own)}); {mend}"
        )


def layout_of(source: str, sheet: Sheet, dialect: DialectTable, table: str) -> Layout:
    """Where the header and the readings are."""
    rows, begin = sheet.rows, sheet.begin
    head = _header_row(rows, begin, dialect)
    first = max(begin, head + 1)
    body = rows[first:]
    at = kinds(body[0][1]).find("t")  # the time's column
    in_first = set(map(plain_name, body[0][1]))
    while set(kinds(body[-1][1])) <= set("a-") or _sums_up(body[-1][1], at, in_first):
        body = body[:-1]  # words behind the last reading, or the mean of all
    line, given = rows[head] if head >= 0 else (0, [])
    lengths = [len(cells) for _, cells in body]
    width = len(given) or max(lengths)
    if sheet.name not in ("comma", "blanks") and any(len(cells) == min(lengths) for _, cells in rows[:head]):
        width = max(width, min(lengths))  # another row of the header says so
    names = _grouped(rows[head - 1][1] if head > 0 else [], [*given, *[""] * (width - len(given))])
    least = width if sheet.name == "blanks" else min(width, len(body[0][1]))
    other = next(((n, c) for n, c in body if any(c[width:]) or len(c) < least), None)
    if other is not None:
        raise InputError(
            f"{source}: line {other[0]}: {len(other[1])} cells where the header has {width}; give each column a cell "
            "(commas, or blanks, in cells and between them? use others)"
        )
    behind = rows[first + len(body) :]
    beside = [*sheet.remarks, *rows[: max(head, 0)], *rows[head + 1 : first], *behind]
    polar = next((n for n, cells in beside if _POLAR.search(" ".join(cells))), None)
    if polar is not None:
        raise InputError(f"{source}: line {polar}: it says that the places are no X, Y, Z; export Cartesian ones")
    return Layout(
        place=source,
        table=table,
        dialect=dialect,
        names=names,
        units=_units(rows, head, begin, names, body),
        unit_of_all=units_of_all(beside),
        line=line,
        parted=sheet.name,
        body=body,
        summed=[str(n) for n, cells in sorted([*behind, *_like(sheet.remarks, body[0][1])]) if "0" in kinds(cells)],
    )


def _like(remarks: Sequence[CsvRow], reading: Sequence[str]) -> list[CsvRow]:
    """The remarks that have a reading's cells behind the first."""
    wanted = kinds(reading[1:])
    return [(n, cells) for n, cells in remarks if kinds(cells[1:]) == wanted]


def _header_row(rows: Sequence[CsvRow], begin: int, dialect: DialectTable) -> int:
    """The last that has all names of the dialect, else of those above the readings the one that says most; -1: none."""
    wanted = {plain_name(name) for name in dialect.columns.values() if not name.startswith("#")}
    heads = [
        n
        for n in range(begin + 1)
        if wanted <= {p for c in _with_above(rows, n) for p in (plain_name(c), name_and_unit(c)[0])}
    ]
    head = heads[-1] if wanted and heads else begin - 1
    while head > 0 and not wanted and _says_more(rows[head][1], rows[head - 1][1]):
        head -= 1
    return head


def _with_above(rows: Sequence[CsvRow], n: int) -> list[str]:
    """The cells of a row; of one of words alone, what stands above an empty one, too."""
    cells = rows[n][1]
    if n == 0 or not set(kinds(cells)) <= set("a-"):
        return cells
    return [cell or above for cell, above in itertools.zip_longest(cells, rows[n - 1][1], fillvalue="")]


def _grouped(above: Sequence[str], given: Sequence[str]) -> list[str]:
    """Names with what the row above says of a set of them, Nominal of X, Y, Z; empty ones from there, else a number."""
    twice = {name for name in given if name and given.count(name) > 1}
    above = [*above, *[""] * len(given)][: len(given)]
    names = [name or cell or f"#{k}" for k, (name, cell) in enumerate(zip(given, above, strict=True), 1)]
    for k in (k for k, name in enumerate(given) if name in twice or (name and not twice)):
        group = _group_of(above, k)
        base, unit = name_and_unit(group)
        if SIDE.sub("", f"{base} x") == "x" or (twice and _DIFFERENCE.match(group)):
            names[k] = names[k] if unit and name_and_unit(names[k])[1] else f"{group} {names[k]}"
    return names


def _group_of(above: Sequence[str], k: int) -> str:
    """What the row above the header calls the set of columns that one is of; its first cell is a title's."""
    return next(filter(None, above[k:0:-1]), "")


def _units(
    rows: Sequence[CsvRow], head: int, begin: int, names: Sequence[str], body: Sequence[CsvRow]
) -> list[set[str]]:
    """The units that each column's name has, a row of units, a column beside it that has nothing else, or its group."""
    above = [cells for _, cells in rows[: max(head, 0)] if _UNIT_ROW.fullmatch(cells[0])]
    groups = rows[head - 1][1] if head > 0 and not units_of_all([rows[head - 1]]) else []
    units = []
    for k, name in enumerate(names):
        beside = {cells[k + 1] if k + 1 < len(cells) else "" for _, cells in body}
        under = [cells[k] for _, cells in rows[head + 1 : begin] if k < len(cells)]
        alone = {*map(unit_named, [*under, *list(beside) * (len(beside) == 1)])}
        of_row = {unit_named(cells[k]) for cells in above if k < len(cells)}
        alone |= {unit for unit in of_row if measured_by(unit) == "temperature"}  # lengths and angles may be of all
        of_column = ({name_and_unit(cell)[1] for cell in (name, *under)} | alone) - {""}
        units.append(of_column or {name_and_unit(_group_of(groups, k))[1]} - {""})
    return units


def units_of_all(rows: Iterable[CsvRow]) -> set[str]:
    """What lines that are no readings say of the unit of all; a line of other words than units says nothing."""
    lines = (_SAYS_UNIT.match(" ".join(cells)) for _, cells in rows)
    units = [{unit_named(word) for word in re.findall(r"[^\s,;]*\w[^\s,;]*", line[1])} for line in lines if line]
    return {unit for said in units if "" not in said for unit in said}


def _says_more(cells: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a row has no names of its own, but units, or words like ``Avg``, of the names above it.

    A title above it is sparse and names nothing: K is a normal's then.
    """
    filled = [cell for cell in cells if cell]
    twice = [pair for pair in zip(cells, above, strict=False) if pair[0] and cells.count(pair[0]) > 1]
    is_set = len({a for _, a in twice}) < len({c for c, _ in twice})  # it says whose X, Y, Z they are
    more = not is_set and (len(set(filled)) < len(filled) or any(map(unit_named, filled)))
    return more and set(kinds(above)) <= set("a-") and 2 * sum(map(bool, above)) > len(filled)


def _sums_up(cells: Sequence[str], at: int, in_first: set[str]) -> bool:
    """Whether a row is no reading: a word in the time's column, or one of statistics that the first reading has not."""
    return "".join(cells[at : at + 1]).isalpha() or bool(
        _STATISTICS.intersection(plain_name(cell.replace(".", " ")) for cell in cells) - in_first
    )


def check_last_rows(layout: Layout, used: set[int]) -> None:
    """Raises InputError where rows below the readings have another kind of cell in a first column that is not read."""
    first, *others = [kinds(cells[:1]) for _, cells in layout.body]
    behind = "".join(others).lstrip(first)
    if 0 not in used and first != "-" and 0 < len(behind) < min(5, len(others)) and set(behind) <= set("a-"):
        raise InputError(
            f"{layout.where(0, layout.body[-len(behind)][0])}: another kind of cell than in all rows above: is it "
            "their mean or sum? remove it"
        )
