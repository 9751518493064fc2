"""CSV files to columns: names with units, numbers that are numbers, one line for whatever is wrong."""

import csv
import difflib
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, first_true, frozen
from compgen.core.exceptions import InputError
from compgen.core.files import read_named

MAX_ROWS = 1_000_000
MAX_BYTES = 500_000_000
LONG = 100_000  # characters, from where a file of numbers alone is read in one go
LARGEST = 1e12  # of a number in any unit; beyond it squares and products overflow
MAX_CELL = 131_072  # characters; the csv module's own limit
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
QUOTABLE = re.compile(r"[A-Za-z0-9_.+-]{1,32}")
PARTED = {";": "semicolons", "\t": "tabs"}  # what else cells are parted by, where a file has no comma
_PLAIN = b"0123456789eE+-., \t\n"  # what numbers and the gaps between them are written with
_REMARK = re.compile(r"(?m)^[ \t]*#.*$")
_GAP = re.compile(r"(?m)(?:(?<=,)|^(?=[ \t]*,))[ \t]*(?=,|$)")
_EMPTY_ROW = re.compile(r"(?m)^[ \t]*,[ \t,]*$")  # cells, and nothing in any

CsvRow = tuple[int, list[str]]  # its line in the file, its cells


class CellsOf(Sequence[Sequence[str]]):
    """The cells of each column of a body of numbers, parted when somebody wants them as text."""

    def __init__(self, body: str, rows: IntArray, width: int) -> None:
        """Of some lines of a body, from 0, ``width`` cells a line."""
        self._body, self._rows, self._width = body, rows, width

    def __len__(self) -> int:
        return self._width

    def __getitem__(self, index: Any) -> Any:
        lines = self._body.split("\n")
        return tuple(lines[row].split(",")[index] for row in self._rows)


class Recorded(NamedTuple):
    """How the file of another writer's form was understood."""

    words: str
    left_out: tuple[str, ...]  # columns
    parted: str  # by what, or the sheet of a workbook
    sign: str  # of decimals
    columns: Mapping[str, tuple[int, str]]  # by the names they have here: which of the file's they are, and their units


@dataclass(frozen=True, slots=True, kw_only=True)
class CsvTable:
    """The cells of a file as text, with the line of each row for messages."""

    source: str  # the file, for messages
    header: tuple[str, ...]
    columns: Sequence[Sequence[str]]  # the cells of each column, one a row
    line: Sequence[int] | IntArray  # of each row in the file
    values: Array | None = None  # (N, C) the numbers, where every cell is one or empty: NaN
    recorded: Recorded | None = None  # None: of compgen's own form

    @property
    def notes(self) -> tuple[str, ...]:
        """How another writer's file was understood, for a finding."""
        return (f"{self.source}: read as: {self.recorded.words}",) if self.recorded else ()

    def has(self, column: str) -> bool:
        """Whether the header names a column."""
        return column in self.header

    def location(self, row: int, column: str = "") -> str:
        """File, line and column of a cell, or of a row, for a message."""
        return f"{self.source}: line {self.line[row]}" + (f", {self.label(column)}" if column else "")

    def label(self, column: str) -> str:
        """A column for a message: by its name, or by its number from 1 where it cannot be quoted or is ours."""
        if self.recorded and column in self.recorded.columns:
            return f"column {self.recorded.columns[column][0] + 1} ({column})"
        return f"column {column if QUOTABLE.fullmatch(column) else self.header.index(column) + 1}"

    def words(self, column: str) -> list[str]:
        """A column as text.

        Raises:
            InputError: A cell is empty.
        """
        words = self._cells(column)
        is_empty = np.array([not word for word in words])
        self.refuse_first(is_empty, column, lambda row: "empty; fill it in, or remove the row")
        return words

    def numbers(self, column: str, *, gaps: bool = False, largest: float = LARGEST) -> Array:
        """A column as numbers, (N,).

        Args:
            column: Its name in the header.
            gaps: Whether cells may be empty or ``nan``; they become NaN.
            largest: What a number may be at most, in the column's unit, whatever its sign.

        Raises:
            InputError: A cell is not a finite number, is empty where it may not be, or is beyond ``largest``.
        """
        if self.values is not None:
            numbers = self.values[:, self.header.index(column)].copy()
        else:
            numbers = np.array([float_of(cell) for cell in self._cells(column)])
        bad = np.isinf(numbers) if gaps else ~np.isfinite(numbers)
        self.refuse_first(bad, column, lambda row: _not_a_number(self._cells(column)[row]))
        beyond = f"is beyond {largest:g}; mend it, or remove the row"
        self.refuse_first(np.abs(numbers) > largest, column, lambda row: f"{numbers[row]:g} {beyond}")
        return numbers

    def refuse_first(self, bad: BoolArray, column: str, fault: Callable[[int], str]) -> None:
        """Refuse the first bad row.

        Args:
            bad: Which rows are, (N,).
            column: That the message names; empty: none.
            fault: Of a row, and its mend.

        Raises:
            InputError: There is one.
        """
        row = first_true(bad)
        if row is not None:
            raise InputError(f"{self.location(row, column)}: {fault(row)}")

    def _cells(self, column: str) -> list[str]:
        return [cell.strip() for cell in self.columns[self.header.index(column)]]


def quote_cell(cell: str, otherwise: str = "the cell") -> str:
    """A cell of somebody's file for a message: quoted where it is a plain word or number, else not repeated."""
    return f"'{cell}'" if QUOTABLE.fullmatch(cell) else otherwise


def text_cell(text: str) -> str:
    """A text for a cell of a file that is written: a spreadsheet shall not take it for a formula."""
    if not text.startswith(("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")) or _NUMBER.fullmatch(text):
        return text
    return f"'{text}"


def read_csv(
    source: str | Path, required: Sequence[str] = (), known: Sequence[str] | None = None, most_rows: int = MAX_ROWS
) -> CsvTable:
    """Read a file: commas, a header with units in its names; lines that begin with # are remarks.

    Args:
        source: The file; UTF-8, with or without a byte order mark.
        required: Columns that must be there.
        known: All columns that may be there; None allows any.
        most_rows: How many rows it may have.

    Raises:
        InputError: Not a regular file, not readable, not CSV, no rows, a column missing, unknown or double, a row of
            another length than the header.
    """
    name = str(source)
    text = read_text(name)
    table = _all_numbers(name, text, required, known, most_rows) if len(text) > LONG else None
    if table is not None:
        return table
    rows = _rows(name, text)
    if not rows:
        columns = f"the first line names the columns: {', '.join(required)}" if required else "give a header and rows"
        raise InputError(f"{name}: empty; {columns}")
    table = table_of_rows(name, rows, required, known)
    if not table.line:
        raise InputError(f"{name}: empty: no rows below the header; give each row a line")
    if len(table.line) > most_rows:
        raise InputError(f"{name}: {len(table.line)} rows are over {most_rows}; thin them")
    return table


def table_of_rows(
    source: str, rows: Sequence[CsvRow], required: Sequence[str], known: Sequence[str] | None = None
) -> CsvTable:
    """The header and the rows below it; raises InputError as ``check_header``, and for a row of another length."""
    (line, names), *body = rows
    header = tuple(cell.strip() for cell in names)
    check_header(source, line, header, required, known)
    other = next(((n, len(cells)) for n, cells in body if len(cells) != len(header)), None)
    if other is not None:
        raise InputError(
            f"{source}: line {other[0]}: {other[1]} cells where the header has {len(header)}; give each column a cell"
        )
    columns = tuple(zip(*(cells for _, cells in body), strict=True))
    return CsvTable(source=source, header=header, columns=columns, line=tuple(n for n, _ in body))


def ended_rows(data: bytes) -> list[CsvRow]:
    """The cells of each line with an end, of a file that is still being written; without remarks and empty lines."""
    lines = data[: data.rfind(b"\n") + 1].replace(b"\0", b"").decode("utf-8-sig", "replace")
    return [
        (n, [cell.strip().strip('"') for cell in line.split(",")])
        for n, line in enumerate(lines.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]


def _all_numbers(
    source: str, text: str, required: Sequence[str], known: Sequence[str] | None, most_rows: int
) -> CsvTable | None:
    """A file whose every cell below a plain header is a finite number or empty; None for any other."""
    begin = 0
    while text.startswith("#", begin):
        begin = text.find("\n", begin) + 1 or len(text)
    head, _, body = text[begin:].partition("\n")
    if not head.strip() or not head.isascii() or any(c in head for c in '"#\v\f\x1c\x1d\x1e'):
        return None
    header = tuple(cell.strip() for cell in head.split(","))
    read = numbers_at_once(body, len(header))
    if read is None or len(read[0]) > most_rows:
        return None
    first = text.count("\n", 0, begin) + 1
    check_header(source, first, header, required, known)
    values, rows = read
    columns = CellsOf(body, rows, len(header))
    return CsvTable(source=source, header=header, columns=columns, line=rows + first + 1, values=values)


def read_text(source: str) -> str:
    """The text of a CSV file, its lines ended by LF.

    Raises:
        InputError: Not a regular file, too large, not UTF-8, zero bytes or bare carriage returns in it.
    """
    try:
        text = read_named(source, "give a CSV file", MAX_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{source}: cannot be read: it is not UTF-8 text; save it as CSV with UTF-8") from None
    lines = text.replace("\r\n", "\n")
    for character, message in (
        ("\0", "holds zero bytes, so it is no text; save it as CSV with UTF-8"),
        ("\r", "its lines end in carriage returns alone; save it with line ends LF or CRLF"),
    ):
        if character in lines:
            line = lines.count("\n", 0, lines.index(character)) + 1
            raise InputError(f"{source}: line {line}: {message}")
    return lines


def _rows(source: str, text: str) -> list[CsvRow]:
    """Rows with the line they end in, less empty ones and remarks."""
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        return [
            (reader.line_num, row) for row in reader if any(map(str.strip, row)) and not row[0].lstrip().startswith("#")
        ]
    except csv.Error as exception:
        location = f"{source}: line {reader.line_num}"
        if "field limit" in str(exception):
            raise InputError(
                f"{location}: a cell is over {MAX_CELL:,} characters; close its quotes, or shorten it"
            ) from None
        raise InputError(f"{location}: not CSV: {exception}; save it as CSV with commas") from None


def check_header(
    source: str, line: int, header: Sequence[str], required: Sequence[str], known: Sequence[str] | None
) -> None:
    """Raises InputError for a header that is not CSV's, has a name twice or none, or lacks or adds a column."""
    for sign, name in PARTED.items():
        if len(header) == 1 and sign in header[0]:
            raise InputError(f"{source}: line {line}: cells are parted by {name}; save it with commas")
    if all(map(_NUMBER.fullmatch, header)):
        raise InputError(f"{source}: line {line}: numbers, and no header; put a line above that names the columns")
    labels = [name if QUOTABLE.fullmatch(name) else str(n) for n, name in enumerate(header, 1)]
    for name, label in zip(header, labels, strict=False):
        if not name:
            raise InputError(f"{source}: line {line}, column {label}: has no name; name it, or remove it")
        if header.count(name) > 1:
            raise InputError(f"{source}: column {label}: stands twice in the header; keep one")
    others = [name for name in header if known is None or name not in known]
    missing = [name for name in required if name not in header]
    if missing:
        quotable = [name for name in others if QUOTABLE.fullmatch(name)]
        close = difflib.get_close_matches(missing[0], quotable, n=1, cutoff=0.4)
        hint = f"; is it '{close[0]}', in another unit or spelling?" if close else ""
        raise InputError(
            f"{source}: column {missing[0]}: missing{hint}; the header needs {', '.join(required)}; "
            f"missing are {', '.join(missing)}"
        )
    if known is not None and others:
        close = difflib.get_close_matches(others[0], [name for name in known if name not in header], n=1, cutoff=0.6)
        mend = f"did you mean '{close[0]}'?" if close else f"remove it; known: {', '.join(known)}"
        raise InputError(f"{source}: column {labels[header.index(others[0])]}: unknown; {mend}")


def float_of(cell: str) -> float:
    """A cell's number: NaN where it is empty, infinite where it is none."""
    if "_" in cell or not cell.isascii():  # float takes 1_0 for ten, and the digits of every alphabet
        return np.inf
    try:
        return float(cell) if cell else np.nan
    except ValueError:
        return np.inf


def _not_a_number(cell: str) -> str:
    """What is wrong with a cell, and the mend."""
    if not cell:
        return "empty; give a number with a decimal point, or remove the row"
    if re.fullmatch(r"[+-]?(nan|inf|infinity)", cell, re.ASCII | re.IGNORECASE) or _NUMBER.fullmatch(cell):
        return f"{quote_cell(cell)} is not a finite number; remove the row"
    return f"{quote_cell(cell)} is not a number; give a number with a decimal point, or remove the row"


def numbers_at_once(body: str, width: int) -> tuple[Array, IntArray] | None:
    """The numbers of a body, (N, ``width``), NaN where a cell is empty, and the line of each row from 0.

    Lines that begin with # are remarks, lines without a filled cell are none. None for a body that has anything else in
    it than ``width`` finite numbers or gaps a row.
    """
    plain = _REMARK.sub("", body) if "#" in body else body
    if not plain.isascii() or not plain.strip() or plain.encode().translate(None, _PLAIN):
        return None
    numbers = plain
    cells = f"\n{plain}\n".encode().translate(None, b" \t")
    if any(gap in cells for gap in (b",,", b",\n", b"\n,")):
        plain = _EMPTY_ROW.sub("", plain)
        numbers = _GAP.sub("nan", plain)
    try:
        values = np.loadtxt(io.StringIO(numbers), delimiter=",", ndmin=2, comments=None)
    except ValueError:
        return None
    if values.shape[1] != width or np.isinf(values).any():
        return None
    if plain.rstrip("\n").count("\n") + 1 == len(values):
        return frozen(values), np.arange(len(values))
    return frozen(values), np.array([n for n, line in enumerate(plain.split("\n")) if line.strip()])
