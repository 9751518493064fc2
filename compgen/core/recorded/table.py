"""A logger's or an instrument's table as the columns that compgen knows, and in words how it was read.

A column is known by its name or by ``columns``; its unit stands in the header, in a row of units, beside each value,
in a line that is no reading, or in ``unit``.
"""

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from compgen.core.csv_table import MAX_BYTES, CsvTable, Recorded, read_csv
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.recorded.cells import (
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
from compgen.core.recorded.layout import PLAIN, SIDE, DialectTable, Layout, check_last_rows, layout_of, units_of_all
from compgen.core.recorded.sheets import sheet_of
from compgen.core.recorded.times import seconds_of, time_of
from compgen.core.toml import check, read_toml

TIME = "time_s"
#: what others call a column
_ALIASES = {
    "target": {
        *("point", "point name", "point id", "pointid", "name", "id", "nom"),
        *("punkt", "punktname", "punktnummer", "pkt"),
    },
    "ambient": {"air", "room", "luft", "raum", "umgebung", "raumluft", "ambient temperature", "air temperature"},
}
#: columns of the day to which a clock time belongs
_DAYS = {"date", "datum", "day", "tag", "fecha", "jour", "giorno"}
_MOMENT = "2026-11-22 08:15:00"
_WORDS = {"d": "dates", "c": "clock times", "dc": "dates and times"}
_SIGNS = {"point": ".", "comma": ","}
_NAMED = 9  # lines in a note


def read_findings(notes: Iterable[str]) -> list[Finding]:
    """How files were understood, for the user."""
    return [Finding.of(Code.FILE_READ_AS, note) for note in dict.fromkeys(notes)]


def read_table(source: str | Path, required: Sequence[str], known: Sequence[str]) -> CsvTable:
    """A table of compgen's own form, or of another writer's as ``<source>.toml`` beside it says.

    Raises:
        InputError: What ``read_recorded`` and ``read_csv`` refuse, or a file beside it that has other keys.
    """
    dialect, beside = dialect_beside(source)
    return read_recorded(source, required, known, dialect, beside) or read_csv(source, required, known)


def dialect_beside(source: str | Path) -> tuple[DialectTable, str]:
    """What ``<source>.toml`` says of a file, where there is one, and its name for messages."""
    beside = Path(f"{source}.toml")
    return check(DialectTable, read_toml(beside, "."), str(beside)) if beside.exists() else PLAIN, beside.name


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
    if _is_ours(data, dialect, known, required):
        return None
    layout = layout_of(str(source), sheet_of(str(source), data, dialect.delimiter), dialect, table)
    upright = next((k for k in range(len(layout.names)) if set("xyz") <= {*map(str.lower, layout.column(k))}), None)
    if upright is not None and "x_mm" in required:
        raise InputError(f"{layout.where(upright, layout.line)}: a row for each of X, Y and Z; export one row a point")
    times = _times(layout) if TIME in known else []
    assigned = _assigned(layout, [column for column in known if column != TIME or not times], required)
    missing = [c for c in required if c not in assigned and not (c == TIME and times)]
    if missing:
        taken = {k for k, _ in assigned.values()}
        cells = enumerate(layout.body[0][1][: len(layout.names)])
        theirs = [k for k, cell in cells if cell and is_number(cell) and k not in taken]
        several = len(missing) > 1
        example = "its name here" if several and layout.line else layout.key(theirs[0]) if theirs else ""
        mend = layout.mend(
            f'columns = {{ {missing[0]} = "{example}"{", ..." * several} }}'
            f"{' if it counts seconds (or time_min, time_h, time_d)' * (missing[0] == TIME)}",
            f"name {'them' if several else 'it'} so in a header",
        )
        if len(theirs) < len(missing):
            mend = f"beside them, numbers stand only in {', '.join(map(layout.key, theirs[:3]))}; add columns"
        mend = mend if theirs else f"no other column has numbers, or times as {_MOMENT}; add it so"
        raise layout.refuse(f"column{'s' * several} {', '.join(missing)}: missing; {mend}")
    return _table(layout, assigned, times)


def _is_ours(data: bytes, dialect: DialectTable, known: Sequence[str], required: Sequence[str]) -> bool:
    """Whether a file is empty, or its names, units and times are compgen's own."""
    lines = data[:100_000].decode("utf-8-sig", "ignore").splitlines()
    filled = (line for line in lines if line.strip() and not line.lstrip().startswith("#"))
    first, second = next(filled, ""), next(filled, "")
    if not first:
        return True
    says = units_of_all((0, [line]) for line in lines if line.lstrip().startswith("#"))
    if says or any(getattr(dialect, key) for key in DialectTable.model_fields):
        return False
    names, values = ([cell.strip(' "') for cell in line.split(",")] for line in (first, second))
    others = {*names} - {*known}
    has_moments = any(time_of(value)[0] for name, value in zip(names, values, strict=False) if name in others)
    if TIME in {*known} - {*names} and has_moments:
        return False
    return {*required} <= {*names} and not in_other_units(others, known)


def in_other_units(cells: Iterable[str], known: Sequence[str]) -> bool:
    """Whether one of some names is a column that is known, in another unit."""
    measured = {(base, measured_by(unit)) for base, unit in map(name_and_unit, known) if unit}
    return any((base, measured_by(unit)) in measured for base, unit in map(name_and_unit, cells) if unit)


def _assigned(layout: Layout, known: Sequence[str], required: Sequence[str]) -> dict[str, tuple[int, str]]:
    """The columns that are known by their names or that the user names: which they are, and their units."""
    bases = {name_and_unit(column)[0]: column for column in known}
    named = {name_and_unit(key)[0]: (key, _index(layout, text)) for key, text in layout.dialect.columns.items()}
    unknown = next((base for base in named if base not in bases and base not in ("time", "date")), None)
    if unknown is not None:
        known_keys = ", ".join(base.replace(" ", "_") for base in bases)
        raise InputError(f"{layout.table} columns: {unknown.replace(' ', '_')}: unknown; known: {known_keys}")
    taken, fits = {k for _, k in named.values()}, {}
    for base, column in bases.items():
        wanted = name_and_unit(column)[1]
        others = _fitting(layout, {base}, wanted) or _fitting(layout, _ALIASES.get(base, set()), wanted)
        fits[column] = [named[base][1]] if base in named else [k for k in others if k not in taken]
    warm = {k for c, ks in fits.items() if measured_by(name_and_unit(c)[1]) == "temperature" for k in ks}
    strange = {k: base for k, name in enumerate(layout.names) if (base := name_and_unit(name)[0]) not in bases}
    sided = {k for k, base in strange.items() if SIDE.search(base)} - taken - warm
    unsure = {c: ks for c, ks in fits.items() if len(ks) > 1 or (c in required and sided.issuperset(ks[:1]) and ks)}
    if unsure:
        raise layout.unsure(unsure)
    return {
        c: (
            ks[0],
            _unit(layout, ks[0], name_and_unit(named.get(base, ("",))[0])[1], c, fits) if name_and_unit(c)[1] else "",
        )
        for (base, c), ks in zip(bases.items(), fits.values(), strict=True)
        if ks and ks[0] not in sided
    }


def _fitting(layout: Layout, names: set[str], wanted: str) -> list[int]:
    """The columns of some names, or of seconds, whose units measure what is wanted or are not said."""
    bare = [name_and_unit(name)[0] for name in layout.names]
    fits = [k for k, name in enumerate(bare) if not names.isdisjoint((name, SIDE.sub("", name)))]
    if wanted == "s" and not fits:
        fits = [k for k, units in enumerate(layout.units) if units]
    return [k for k in fits if all(measured_by(unit) == measured_by(wanted) for unit in layout.units[k])]


def _index(layout: Layout, text: str) -> int:
    """The column that the user names, by its name or its number."""
    names = [(plain_name(name), name_and_unit(name)[0], f"#{k + 1}") for k, name in enumerate(layout.names)]
    whole = [k for k, (name, _, number) in enumerate(names) if plain_name(text) == name or text == number]
    fits = whole or [k for k, (_, base, _) in enumerate(names) if plain_name(text) == base]
    if len(fits) != 1:
        raise layout.refuse(
            f"{len(fits) or 'no'} columns are '{text[:30]}'; name it, or its number as \"#{(fits or [2])[0] + 1}\""
        )
    return fits[0]


def _unit(layout: Layout, k: int, by_key: str, column: str, fits: Mapping[str, Sequence[int]]) -> str:
    """The unit of a column's cells: the one that the file, its key or the user says; ``fits``: what the others are."""
    wanted = name_and_unit(column)[1]
    by_user, measured = unit_named(layout.dialect.unit or ""), measured_by(wanted)
    of_column = layout.units[k] | layout.unit_of_all
    others = {unit for unit in (by_key, by_user, *of_column) if unit and measured_by(unit) == measured}
    units = sorted(others or layout.units[k])  # beside degC, Min is a smallest reading
    if len(units) == 1 and measured_by(units[0]) == measured:
        return units[0]
    some, name = units_like(wanted)[:3], layout.key(k)
    keys = ", or ".join(column.removesuffix(wanted) + unit for unit in some[1:])
    bare = {c: ks[0] for c, ks in fits.items() if ks and name_and_unit(c)[1] == wanted and not layout.units[ks[0]]}
    pairs = ", ".join(f'{c} = "{f"#{n + 1}" if len(bare) > 1 else name}"' for c, n in (bare or {column: k}).items())
    words = (
        " or ".join(f'unit = "{unit}"' for unit in some)
        if measured in ("temperature", "length")
        else f"columns = {{ {pairs} }}, or {keys},"
    )
    mend = layout.mend(words, f"write it in the header, as '{name} [{some[0]}]'")
    cell = layout.column(k)[0]
    what = (
        f"names no unit; {mend}"
        if is_number(cell)
        else f"'{cell[:24]}' is no number, no time as {_MOMENT}; write it so"
    )
    what = f"has the units {', '.join(units)}; keep one of {measured}, here or in its key" if units else what
    raise InputError(f"{layout.where(k, layout.line)}: {what}")


def _times(layout: Layout) -> list[int]:
    """The columns of the date and of the clock, or of both; none where there are none, or seconds are named."""
    keys = sorted(key for key in layout.dialect.columns if name_and_unit(key)[0] in ("date", "time"))
    named = [_index(layout, layout.dialect.columns[key]) for key in keys]
    is_time = {k: time_of(cell)[0].strip("z") for k, cell in enumerate(layout.body[0][1]) if not is_number(cell)}
    if named:
        return named if is_time.get(named[0]) else []
    both, dates, clocks = ([k for k, kind in is_time.items() if kind == wanted] for wanted in ("dc", "d", "c"))
    several = next((some for some in (both, dates, clocks) if len(some) > 1), [])
    if several:
        key = f'date = "#{dates[0] + 1}", time' if dates and several is clocks else "time"
        mend = layout.mend(f'columns = {{ {key} = "#{several[0] + 1}" }}', "keep one")
        raise layout.refuse(f"columns {several[0] + 1} and {several[1] + 1} both hold times; {mend}")
    return both or dates + clocks


def _table(layout: Layout, assigned: Mapping[str, tuple[int, str]], times: Sequence[int]) -> CsvTable:
    """The columns that were assigned, in our units, and how they were read."""
    cells = {column: layout.column(k) for column, (k, _) in assigned.items()}
    numeric = [c for c, (_, unit) in assigned.items() if unit or all(map(is_number, cells[c]))]
    sign = _decimal(layout, [assigned[c][0] for c in numeric])
    words = f"{layout.parted}, decimal {'comma' if sign == ',' else 'point'}"
    words += "".join(f", {unit}" for unit in sorted({unit for _, unit in assigned.values()} - {""}))
    for column in numeric:
        given, wanted = assigned[column][1], name_and_unit(column)[1]
        cells[column] = [in_unit(number_text(cell, sign) or "", given, wanted) for cell in cells[column]]
    if times:
        cells[TIME], of_clock = _seconds(layout, times)
        words += of_clock
    used = {*times, *(k for k, _ in assigned.values())}
    left = tuple(name for k, name in enumerate(layout.names) if k not in used and any(layout.column(k)))
    check_last_rows(layout, used)
    words += "".join(
        f"; {brief_name(layout.names[k])} is {c}"
        for c, (k, _) in assigned.items()
        if plain_name(c) != plain_name(layout.names[k])
    )
    words += f"; left out: {', '.join(map(brief_name, left))}" if left else ""
    words += f"; no readings in line {', '.join(layout.summed[:_NAMED])}" if layout.summed else ""
    words += f" and {len(layout.summed) - _NAMED} more" if len(layout.summed) > _NAMED else ""
    return CsvTable(
        source=layout.place,
        header=tuple(cells),
        columns=tuple(map(tuple, cells.values())),
        line=[line for line, _ in layout.body],
        recorded=Recorded(words, left, layout.parted, sign, assigned),
    )


def _seconds(layout: Layout, times: Sequence[int]) -> tuple[list[str], str]:
    """The cells of ``TIME``, of the columns that hold dates and clock times, and how these were read."""
    parts, lines = [layout.column(k) for k in times], [line for line, _ in layout.body]
    for row in range(1, len(lines) if len(parts) > 1 else 0):
        parts[0][row] = parts[0][row] or parts[0][row - 1]  # a date that is written once
    moments = [" ".join(part).strip() for part in zip(*parts, strict=True)]
    mend = partial(layout.mend, otherwise="write 2026-11-22")
    seconds = seconds_of(moments, layout.dialect.dates, lambda row: layout.where(times[0], lines[row]), mend)
    kind = time_of(moments[0])[0]
    if "d" not in kind and not _DAYS.isdisjoint(map(plain_name, layout.names)):
        raise InputError(
            f"{layout.where(times[0], lines[0])}: '{moments[0]}' is of a day that is not read; write {_MOMENT}"
        )
    clock = " in hours and minutes" if moments[0].count(":") == 1 else ""
    zone = " with a zone, in UTC" if "z" in kind else " without a zone"
    return list(map(repr, seconds)), f", {_WORDS[kind.strip('z')]}{clock}{zone}"


def _decimal(layout: Layout, columns: Sequence[int]) -> str:
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
