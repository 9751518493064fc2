"""A logger's or an instrument's table as the columns that compgen knows, and in words how it was read.

The header is the row above the readings, or the last one that has all names that the user says. A column is known by
its name or by ``columns``; its unit stands in the header, in a row of units, beside each value, in a line that is no
reading, or in ``unit``.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple

from compgen.core.csv_table import MAX_BYTES, CsvTable, Recorded, Row, read_csv
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.recorded.cells import (
    LONG,
    brief_name,
    in_unit,
    is_number,
    measured_by,
    name_and_unit,
    number_text,
    plain_name,
    unit_named,
    units_like,
)
from compgen.core.recorded.sheets import Sheet, kinds, sheet_of
from compgen.core.recorded.times import seconds_of, time_of
from compgen.core.toml import Table, check, read_toml

TIME = "time_s"
#: what others call a column
_ALIASES = {
    "target": {"point", "point name", "point id", "pointid", "name", "id", "punkt", "punktname", "punktnummer"},
    "ambient": {"air", "room", "luft", "raum", "umgebung", "raumluft", "ambient temperature", "air temperature"},
}
#: of rows behind the last reading
_STATISTICS = {
    *("mean", "average", "avg", "median", "mittel", "mittelwert", "min", "minimum", "max", "maximum", "range", "rms"),
    *("sum", "summe", "total", "count", "anzahl", "std", "std dev", "std. dev", "stdev", "stddev", "sigma"),
}
#: a line beside the readings that says their unit: "Units: Inches, Degrees", "Temperature unit;Fahrenheit"
_SAYS_UNIT = re.compile(
    r"(?i).*\b(?:units?|einheit(?:en)?|angles?|lengths?|(?:coordinates|temperatures?|values|(?:mess)?werte|messung) in)"
    r"\b\W*(.+)$"
)
#: what a row of units above the header is called: "Unit", "Y_Unit_Label"
_UNIT_ROW = re.compile(r"(?i)\w*(?:unit|einheit)\w*[\w ]*:?")
#: columns of the day to which a clock time belongs
_DAYS = {"date", "datum", "day", "tag", "fecha", "jour", "giorno"}
#: a line that says of columns named x, y, z that they are others
_POLAR = re.compile(r"(?i)coordinate.*\b(cylind|spheric|polar)|(zylinder|kugel|polar)koordinat")
_MOMENT = "2026-11-22 08:15:00"
_WORDS = {"d": "dates", "c": "clock times", "dc": "dates and times"}
_SIGNS = {"point": ".", "comma": ","}


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


class _Layout(NamedTuple):
    """A file's readings under its header, and what the user says of them."""

    place: str  # the file
    table: str  # of a TOML file in which the user may say more; or nothing
    dialect: DialectTable
    names: Sequence[str]
    units: Sequence[set[str]]  # that the file says of each column
    unit_of_all: set[str]  # that a line beside the table says
    line: int  # of the header
    parted: str  # by what
    body: Sequence[Row]

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
        listed = ", ".join(map(brief_name, self.names))
        line = f"line {self.line}" if self.line else f"line {self.body[0][0]}: no header above it"
        return InputError(f"{self.place}: {line}: {what}; there are: {listed[: 200 - len(what)]}")

    def both(self, columns: Sequence[int], are: str, key: str, otherwise: str) -> InputError:
        """A refusal of two columns where one is wanted."""
        mend = self.mend(f'columns = {{ {key} = "#{columns[0] + 1}" }}', otherwise)
        return self.refuse(f"columns {columns[0] + 1} and {columns[1] + 1} {are}; {mend}")


def read_findings(notes: Iterable[str]) -> list[Finding]:
    """How files were understood, for the user."""
    return [Finding(Level.NOTE, Code.FILE_READ_AS, note) for note in dict.fromkeys(notes)]


def read_table(source: str | Path, required: Sequence[str], known: Sequence[str]) -> CsvTable:
    """A table of compgen's own form, or of another writer's as ``<source>.toml`` beside it says.

    Raises:
        InputError: What ``read_recorded`` and ``read_csv`` refuse, or a file beside it that has other keys.
    """
    beside = Path(f"{source}.toml")
    dialect = check(DialectTable, read_toml(beside, "."), str(beside)) if beside.exists() else PLAIN
    return read_recorded(source, required, known, dialect, beside.name) or read_csv(source, required, known)


def read_recorded(
    source: str | Path,
    required: Sequence[str],
    known: Sequence[str],
    dialect: DialectTable = PLAIN,
    table: str = "",
    data: bytes | None = None,
) -> CsvTable | None:
    """A table of columns with units in their names, of another writer's form; None for a file of compgen's own.

    Args:
        source: The file: text by any delimiter, or a workbook.
        required: Columns that must be there.
        known: All columns that are read; others of another writer's file are left out.
        dialect: What the user says of the file.
        table: Where the user says it, for messages, as ``[log]``.
        data: Its bytes, where they are at hand.

    Raises:
        InputError: It cannot be read, leaves something open or contradicts itself.
    """
    data = read_named(source, "give a CSV file", MAX_BYTES) if data is None else data
    lines = data[:100_000].decode("utf-8-sig", "ignore").splitlines()
    first = next((line for line in lines if line.strip() and not line.lstrip().startswith("#")), "")
    remarks = ((0, [line]) for line in lines if line.lstrip().startswith("#"))
    is_plain = not any(getattr(dialect, key) for key in DialectTable.model_fields) and not _unit_of_all(remarks)
    if not first or (is_plain and set(required) <= {cell.strip(' "') for cell in first.split(",")}):
        return None
    layout = _layout(str(source), sheet_of(str(source), data, dialect.delimiter), dialect, table)
    times = _times(layout) if TIME in known else []
    assigned = _assigned(layout, [column for column in known if column != TIME or not times])
    missing = [c for c in required if c not in assigned and not (c == TIME and times)]
    if missing:
        taken = {k for k, _ in assigned.values()}
        cells = enumerate(layout.body[0][1][: len(layout.names)])
        theirs = next((k for k, cell in cells if cell and is_number(cell) and k not in taken), -1)
        several = len(missing) > 1
        example = "its name here" if several and layout.line else layout.key(theirs)
        pair = f'{missing[0]} = "{example}"{", ..." * several}'
        mend = layout.mend(f"columns = {{ {pair} }}", f"name {'them' if several else 'it'} so in a header")
        mend = mend if theirs >= 0 else f"no other column has numbers, or times as {_MOMENT}; add it so"
        raise layout.refuse(f"column{'s' * several} {', '.join(missing)}: missing; {mend}")
    return _table(layout, assigned, times)


def _layout(source: str, sheet: Sheet, dialect: DialectTable, table: str) -> _Layout:
    """Where the header and the readings are."""
    rows, begin = sheet.rows, sheet.begin
    wanted = {plain_name(name) for name in dialect.columns.values() if not name.startswith("#")}
    heads = [
        n for n in range(begin + 1) if wanted <= {p for c in rows[n][1] for p in (plain_name(c), name_and_unit(c)[0])}
    ]
    head = heads[-1] if wanted and heads else begin - 1
    while head > 0 and not wanted and _says_more(rows[head][1], rows[head - 1][1]):
        head -= 1
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
    names = [(given[k] if k < len(given) else "") or f"#{k + 1}" for k in range(width)]
    least = width if sheet.name == "blanks" else min(width, len(body[0][1]))
    other = next(((n, c) for n, c in body if any(c[width:]) or len(c) < least), None)
    if other is not None:
        raise InputError(
            f"{source}: line {other[0]}: {len(other[1])} cells where the header has {width}; give each column a cell "
            "(commas, or blanks, in cells and between them? use others)"
        )
    beside = [*sheet.remarks, *rows[: max(head, 0)], *rows[head + 1 : first], *rows[first + len(body) :]]
    polar = next((n for n, cells in beside if _POLAR.search(" ".join(cells))), None)
    if polar is not None:
        raise InputError(f"{source}: line {polar}: it says that the places are no X, Y, Z; export Cartesian ones")
    return _Layout(
        place=source,
        table=table,
        dialect=dialect,
        names=names,
        units=_units(rows, head, begin, names, body),
        unit_of_all=_unit_of_all(beside),
        line=line,
        parted=sheet.name,
        body=body,
    )


def _units(rows: Sequence[Row], head: int, begin: int, names: Sequence[str], body: Sequence[Row]) -> list[set[str]]:
    """The units that each column's name has, a row of units, or a column beside it that has nothing else."""
    above = [cells for _, cells in rows[: max(head, 0)] if _UNIT_ROW.fullmatch(cells[0])]
    units = []
    for k, name in enumerate(names):
        beside = {cells[k + 1] if k + 1 < len(cells) else "" for _, cells in body}
        under = [cells[k] for _, cells in rows[head + 1 : begin] if k < len(cells)]
        alone = {*map(unit_named, [*under, *list(beside) * (len(beside) == 1)])}
        of_row = {unit_named(cells[k]) for cells in above if k < len(cells)}
        alone |= {unit for unit in of_row if measured_by(unit) == "temperature"}  # lengths and angles may be of all
        units.append(({name_and_unit(cell)[1] for cell in (name, *under)} | alone) - {""})
    return units


def _unit_of_all(rows: Iterable[Row]) -> set[str]:
    """What lines that are no readings say of the unit of all; a line of other words than units says nothing."""
    lines = (_SAYS_UNIT.match(" ".join(cells)) for _, cells in rows)
    units = [{unit_named(word) for word in re.findall(r"[^\s,;]*\w[^\s,;]*", line[1])} for line in lines if line]
    return {unit for said in units if "" not in said for unit in said}


def _says_more(cells: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a row has no names of its own, but units, or words like ``Avg``, of the names above it.

    A title above it is sparse and names nothing: K is a normal's then.
    """
    filled = [cell for cell in cells if cell]
    more = len(set(filled)) < len(filled) or any(map(unit_named, filled))
    return more and set(kinds(above)) <= set("a-") and 2 * sum(map(bool, above)) > len(filled)


def _sums_up(cells: Sequence[str], at: int, in_first: set[str]) -> bool:
    """Whether a row is no reading: a word in the time's column, or one of statistics that the first reading has not."""
    return "".join(cells[at : at + 1]).isalpha() or bool(_STATISTICS.intersection(map(plain_name, cells)) - in_first)


def _assigned(layout: _Layout, known: Sequence[str]) -> dict[str, tuple[int, str]]:
    """The columns that are known by their names or that the user names: which they are, and their units."""
    bases = {name_and_unit(column)[0]: column for column in known}
    named = {name_and_unit(key)[0]: (key, _index(layout, text)) for key, text in layout.dialect.columns.items()}
    unknown = next((base for base in named if base not in bases and base not in ("time", "date")), None)
    if unknown is not None:
        known_keys = ", ".join(base.replace(" ", "_") for base in bases)
        raise InputError(f"{layout.table} columns: {unknown.replace(' ', '_')}: unknown; known: {known_keys}")
    assigned, taken = {}, {k for _, k in named.values()}
    for base, column in bases.items():
        wanted, (key, k) = name_and_unit(column)[1], named.get(base, ("", -1))
        others = _fitting(layout, {base}, wanted) or _fitting(layout, _ALIASES.get(base, set()), wanted)
        fits = [k] if key else [n for n in others if n not in taken]
        if len(fits) > 1:
            raise layout.both(fits, f"both may be {column}", base, "rename one")
        if fits:
            assigned[column] = fits[0], _unit(layout, fits[0], name_and_unit(key)[1], column) if wanted else ""
    return assigned


def _fitting(layout: _Layout, names: set[str], wanted: str) -> list[int]:
    """The columns of some names, or of seconds, whose units measure what is wanted or are not said."""
    fits = [k for k, name in enumerate(layout.names) if name_and_unit(name)[0] in names]
    if wanted == "s" and not fits:
        fits = [k for k, units in enumerate(layout.units) if units]
    return [k for k in fits if all(measured_by(unit) == measured_by(wanted) for unit in layout.units[k])]


def _index(layout: _Layout, text: str) -> int:
    """The column that the user names, by its name or its number."""
    names = [(plain_name(name), name_and_unit(name)[0], f"#{k + 1}") for k, name in enumerate(layout.names)]
    whole = [k for k, (name, _, number) in enumerate(names) if plain_name(text) == name or text == number]
    fits = whole or [k for k, (_, base, _) in enumerate(names) if plain_name(text) == base]
    if len(fits) != 1:
        raise layout.refuse(
            f"{len(fits) or 'no'} columns are '{text[:30]}'; name it, or its number as \"#{(fits or [2])[0] + 1}\""
        )
    return fits[0]


def _unit(layout: _Layout, k: int, by_key: str, column: str) -> str:
    """The unit of a column's cells: the one that the file, its key or the user says."""
    wanted = name_and_unit(column)[1]
    by_user, measured = unit_named(layout.dialect.unit or ""), measured_by(wanted)
    of_column = layout.units[k] | layout.unit_of_all
    others = {unit for unit in (by_key, by_user, *of_column) if unit and measured_by(unit) == measured}
    units = sorted(others or layout.units[k])  # beside degC, Min is a smallest reading
    if len(units) == 1 and measured_by(units[0]) == measured:
        return units[0]
    some, name = units_like(wanted)[:3], layout.key(k)
    keys = ", or ".join(column.removesuffix(wanted) + unit for unit in some[1:])
    words = f'columns = {{ {column} = "{name}" }}, or {keys},'
    if measured in ("temperature", "length"):
        words = " or ".join(f'unit = "{unit}"' for unit in some)
    mend = layout.mend(words, f"write it in the header, as '{name} [{some[0]}]'")
    cell = layout.column(k)[0]
    what = (
        f"names no unit; {mend}"
        if is_number(cell)
        else f"'{cell[:24]}' is no number, no time as {_MOMENT}; write it so"
    )
    what = f"has the units {', '.join(units)}; keep one of {measured}, here or in its key" if units else what
    raise InputError(f"{layout.where(k, layout.line)}: {what}")


def _times(layout: _Layout) -> list[int]:
    """The columns of the date and of the clock, or of both; none where there are none, or seconds are named."""
    keys = sorted(key for key in layout.dialect.columns if name_and_unit(key)[0] in ("date", "time"))
    named = [_index(layout, layout.dialect.columns[key]) for key in keys]
    is_time = {k: time_of(cell)[0].strip("z") for k, cell in enumerate(layout.body[0][1]) if not is_number(cell)}
    if named:
        return named if is_time.get(named[0]) else []
    both, dates, clocks = ([k for k, kind in is_time.items() if kind == wanted] for wanted in ("dc", "d", "c"))
    several = next((some for some in (both, dates, clocks) if len(some) > 1), [])
    if several:
        date = f'date = "#{dates[0] + 1}", ' if dates and several is clocks else ""
        raise layout.both(several, "both hold times", f"{date}time", "keep one")
    return both or dates + clocks


def _table(layout: _Layout, assigned: Mapping[str, tuple[int, str]], times: Sequence[int]) -> CsvTable:
    """The columns that were assigned, in our units, and how they were read."""
    cells = {column: layout.column(k) for column, (k, _) in assigned.items()}
    numeric = [c for c, (_, unit) in assigned.items() if unit or all(map(is_number, cells[c]))]
    sign = _decimal(layout, [assigned[c][0] for c in numeric])
    units = {unit for _, unit in assigned.values()} - {""}
    words = ", ".join([layout.parted, f"decimal {'comma' if sign == ',' else 'point'}", *sorted(units)])
    for column in numeric:
        given, wanted = assigned[column][1], name_and_unit(column)[1]
        cells[column] = [in_unit(number_text(cell, sign) or "", given, wanted) for cell in cells[column]]
    lines = [line for line, _ in layout.body]
    if times:
        parts = [layout.column(k) for k in times]
        for row in range(1, len(lines) if len(parts) > 1 else 0):
            parts[0][row] = parts[0][row] or parts[0][row - 1]  # a date that is written once
        moments = [" ".join(part).strip() for part in zip(*parts, strict=True)]
        mend = partial(layout.mend, otherwise="write 2026-11-22")
        seconds = seconds_of(moments, layout.dialect.dates, lambda row: layout.where(times[0], lines[row]), mend)
        cells[TIME] = list(map(repr, seconds))
        kind = time_of(moments[0])[0]
        if "d" not in kind and not _DAYS.isdisjoint(map(plain_name, layout.names)):
            what = f"'{moments[0]}' is of a day that is not read; write {_MOMENT}"
            raise InputError(f"{layout.where(times[0], lines[0])}: {what}")
        clock = " in hours and minutes" if moments[0].count(":") == 1 else ""
        words += f", {_WORDS[kind.strip('z')]}{clock} with{'' if 'z' in kind else 'out'} a zone"
    own = {c: layout.names[k] for c, (k, _) in assigned.items()}
    used = {*times, *(k for k, _ in assigned.values())}
    left = tuple(name for k, name in enumerate(layout.names) if k not in used and any(layout.column(k)))
    words += "".join(f"; {brief_name(name)} is {c}" for c, name in own.items() if plain_name(c) != plain_name(name))
    words += f"; left out: {', '.join(map(brief_name, left))}" if left else ""
    return CsvTable(
        source=layout.place,
        header=tuple(cells),
        columns=tuple(map(tuple, cells.values())),
        line=lines,
        recorded=Recorded(words, left, layout.parted, sign, assigned),
    )


def _decimal(layout: _Layout, columns: Sequence[int]) -> str:
    """The decimal sign by which all cells of some columns are numbers.

    A point alone is a decimal point: it parts thousands only in a file with decimal commas. ``1,234`` may be either.
    """
    cells = [(k, n, row[k]) for k in columns for n, row in layout.body if k < len(row)]
    signs = [_SIGNS[layout.dialect.decimal]] if layout.dialect.decimal else list(_SIGNS.values())
    misfits = {sign: [c for c in cells if number_text(c[2], sign) is None] for sign in signs}
    sign = min(signs, key=lambda sign: len(misfits[sign]))
    open_cells = [] if any(misfits.values()) or len(signs) == 1 else [c for c in cells if "," in c[2]]
    if not open_cells and not misfits[sign]:
        return sign
    k, line, cell = (open_cells or misfits[sign])[0]
    mend = layout.mend('decimal = "comma" or "point"', "write a decimal point and no thousands")
    otherwise = f"is no number with a decimal {'comma' if sign == ',' else 'point'}; mend it, or empty the cell"
    what = f"may be thousands or a decimal comma; {mend}" if open_cells else otherwise
    raise InputError(f"{layout.where(k, line)}: '{cell[:24]}' {what}")
