"""A file's rows of cells, whoever wrote it: text of any code page and delimiter, or a sheet of a workbook."""

import csv
import io
from collections.abc import Sequence
from contextlib import suppress
from itertools import groupby
from typing import NamedTuple

from python_calamine import CalamineError, CalamineWorkbook

from compgen.core.csv_table import CsvRow
from compgen.core.exceptions import InputError
from compgen.core.recorded.cells import is_number
from compgen.core.recorded.times import time_of

DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "blanks": " "}
_SAMPLE = 200_000  # characters that say what parts the cells
_SEEN = 2000  # rows that say how a file is laid out
_TRENDS = (("varname", "timestring", "varvalue"), ("series", "time", "value"))  # of WinCC, of Grafana
_REMARK = ("#", "//", "!")
_WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")  # xlsx or ods, and xls


class Sheet(NamedTuple):
    """Rows with a filled cell."""

    values: int  # how many of its cells are, less some for words
    begin: int  # the row of the first reading
    name: str  # what parts its cells, or which sheet of a workbook it is
    rows: list[CsvRow]
    remarks: list[CsvRow]


def kinds(cells: Sequence[str]) -> str:
    """A letter for each cell: nothing, a number or a missing reading, a time, or a word."""
    return "".join("-" if not c else "0" if is_number(c) else "t" if time_of(c)[0] else "a" for c in cells)


def sheet_of(source: str, data: bytes, delimiter: str | None) -> Sheet:
    """The table of a file: by its delimiter where one is named, else by the one with which most cells are values.

    Raises:
        InputError: No text and no workbook, or no table in it.
    """
    if data.startswith(_WORKBOOKS):
        *others, best = sorted(_of_workbook(source, data))
        head = {cell for _, cells in best.rows[best.begin - 1 : best.begin] for cell in cells}
        like = [s for s in others if s.begin and 2 * len(head.intersection(s.rows[s.begin - 1][1])) > len(head)]
        twin = next(
            (s.name for s in like if kinds(s.rows[s.begin][1][:1]) == kinds(best.rows[best.begin][1][:1])), None
        )  # sums have no times
        if twin is not None:
            raise InputError(f"{source}: {twin} and {best.name} both hold such readings; keep one in the file")
    else:
        text = _text(data)
        tried = [_of_text(text[:_SAMPLE], name) for name in ([delimiter] if delimiter else DELIMITERS)]
        best = _of_text(text, max(tried, key=lambda sheet: sheet.values).name)
    if not best.values:
        raise InputError(
            f"{source}: no rows of readings in it; give CSV in UTF-8, a line a reading, numbers without units"
        )
    return best


def _text(data: bytes) -> str:
    """Text by its byte order mark, else UTF-8, else Windows's Latin letters, else what Japanese loggers write."""
    wide = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-16-le" if data[1:2] == b"\0" else ""
    for code in (wide or "utf-8-sig", "cp1252"):
        with suppress(UnicodeDecodeError):
            return data.decode(code)
    return data.decode("cp932", "replace")


def _of_text(text: str, name: str) -> Sheet:
    lines = io.StringIO(text, None) if name != "blanks" else (f"{line.strip()}\n" for line in text.splitlines())
    reader = csv.reader(lines, delimiter=DELIMITERS[name], skipinitialspace=True)
    try:
        return _sheet(name, [(reader.line_num, cells) for cells in reader])
    except csv.Error:  # a cell of a megabyte: no table by this delimiter
        return Sheet(0, 0, name, [], [])


def _of_workbook(source: str, data: bytes) -> list[Sheet]:
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(data))
        sheets = [(name, book.get_sheet_by_name(name).to_python(skip_empty_area=False)) for name in book.sheet_names]
    except CalamineError as failure:
        raise InputError(f"{source}: no workbook that can be read: {failure}; save it as CSV") from None
    return [
        _sheet(f"sheet '{name}'", [(n, list(map(str, row))) for n, row in enumerate(rows, 1)]) for name, rows in sheets
    ]


def _sheet(name: str, lines: Sequence[CsvRow]) -> Sheet:
    """Rows, and where the longest run of rows of one kind begins."""
    rows = [(line, [cell.strip() for cell in cells]) for line, cells in lines if any(map(str.strip, cells))]
    kept = [not cells[0].startswith(_REMARK) or (cells[0] == "#" and name != "blanks") for _, cells in rows]
    remarks = [row for row, keep in zip(rows, kept, strict=True) if not keep]
    rows = [row for row, keep in zip(rows, kept, strict=True) if keep]  # "#" alone is a name, of the row's number
    seen = [kinds(cells) for _, cells in rows[:_SEEN]]
    worth = [4 * (row.count("0") + row.count("t") - 1) - row.count("a") for row in seen]  # a word and a number: nothing
    values = begin = at = 0
    for _, run in groupby(seen, lambda row: row.replace("-", "0").rstrip("0")):
        end = at + len(list(run))
        values, begin = max((values, begin), (sum(worth[at:end]), at), key=lambda best: best[0])
        at = end
    while begin > 0 and worth[begin - 1] > 4 and ("t" in seen[begin - 1]) >= ("t" in seen[begin]):
        begin -= 1
    names = [cell.strip("#/! ") for cell in remarks[-1][1]] if remarks else []
    names = names[names[:1] == [""] :]  # a sign that stands alone names nothing
    if rows and not begin and len(names) == len(rows[0][1]):  # the header is a remark
        begin, rows = 1, [(remarks[-1][0], names), *rows]
    return _by_time(Sheet(values, begin, name, rows, remarks))


def _by_time(sheet: Sheet) -> Sheet:
    """A row a time, of a trend that has a row for each variable."""
    head = [cell.casefold() for cell in sheet.rows[sheet.begin - 1][1]] if sheet.begin else []
    trend = next((names for names in _TRENDS if set(names) <= set(head)), ())
    if not trend:
        return sheet
    variable, moment, value = map(head.index, trend)
    body = [row for row in sheet.rows[sheet.begin :] if not row[1][variable].startswith("$")]  # $RT_OFF$: it stopped
    names = list(dict.fromkeys(cells[variable] for _, cells in body))
    rows: dict[str, CsvRow] = {}
    for line, cells in body:
        row = rows.setdefault(cells[moment], (line, [cells[moment], *[""] * len(names)]))
        is_bad = "validity" in head and cells[head.index("validity")] == "0"
        row[1][1 + names.index(cells[variable])] = "" if is_bad else cells[value]
    header = (sheet.rows[sheet.begin - 1][0], ["time", *names])
    return sheet._replace(begin=1, rows=[header, *rows.values()])
