"""CSV files of numbers with millions of rows: read at once, and row by row only where something is wrong.

The same form as ``csv_table`` reads: a header with units in its names, commas, lines that begin with # are remarks,
empty cells are gaps. Every cell is a number, so nothing is quoted.
"""

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.csv_table import LARGEST, QUOTABLE, check_header, float_of, not_a_number, read_text
from compgen.core.exceptions import InputError

_EMPTY = re.compile(r"(?m)(?:(?<=,)|^(?=[ \t]*,))[ \t]*(?=,|$)")  # cells with nothing in them


@dataclass(frozen=True, eq=False, slots=True)
class LongTable:
    """Numbers of a file, with the line of each row for messages."""

    source: str  # the file, for messages
    header: tuple[str, ...]
    values: Array  # (M, columns); NaN where a cell is empty
    text: str  # of the file, header and all

    def __post_init__(self) -> None:
        own(self, values=("M", "K"))

    def column(self, name: str) -> Array:
        """A column, (M,)."""
        return np.asarray(self.values[:, self.header.index(name)])

    def columns(self, names: Sequence[str]) -> Array:
        """Some columns, (M, k)."""
        return np.asarray(self.values[:, [self.header.index(name) for name in names]])

    def line(self, row: int) -> int:
        """The line in the file of a row; looked for from the beginning."""
        return next(number for k, (number, _) in enumerate(_rows(self.text)) if k == row + 1)

    def location(self, row: int, column: str = "") -> str:
        """File, line and column of a cell, or of a row, for a message."""
        return f"{self.source}: line {self.line(row)}" + (f", column {column}" if column else "")


def read_long_csv(source: str | Path, required: Sequence[str] = (), known: Sequence[str] | None = None) -> LongTable:
    """Read a file of numbers.

    Args:
        source: The file; UTF-8, with or without a byte order mark.
        required: Columns that must be there.
        known: All columns that may be there; None allows any.

    Raises:
        InputError: Not a regular file, not readable, no rows, a column missing, unknown or double, a row of another
            length than the header, a cell that is no finite number.
    """
    name = str(source)
    text = read_text(name)
    rows = _rows(text)
    first, second = next(rows, None), next(rows, None)
    if first is None:
        raise InputError(f"{name}: empty; the first line names the columns: {', '.join(required)}")
    line, words = first
    header = tuple(cell.strip() for cell in words.split(","))
    check_header(name, line, header, required, known)
    if second is None:
        raise InputError(f"{name}: empty: no rows below the header; give each row a line")
    body = text.split("\n", line)[line]
    try:
        values = np.loadtxt(io.StringIO(body), delimiter=",", comments="#", ndmin=2)
    except ValueError:
        values = _with_gaps(name, text, header)
    if values.shape[1] != len(header) or not _are_plain(body, values):
        _refuse_worst(name, text, header)
        if values.shape[1] != len(header):
            raise InputError(f"{name}: rows have {values.shape[1]} cells where the header has {len(header)}")
    return LongTable(name, header, values, text)


def _with_gaps(name: str, text: str, header: tuple[str, ...]) -> Array:
    """The numbers of a file with empty cells."""
    _refuse_worst(name, text, header)
    rows = _rows(text)
    next(rows)
    lines = "\n".join(words for _, words in rows)
    try:
        return np.loadtxt(io.StringIO(_EMPTY.sub("nan", lines)), delimiter=",", comments="#", ndmin=2)
    except ValueError as failure:
        raise InputError(f"{name}: cannot be read: {failure}"[:300]) from None


def _are_plain(body: str, values: Array) -> bool:
    """Whether no cell says ``nan`` or ``inf``, is beyond what squares can hold, or stands in other digits."""
    return bool(body.isascii() and "_" not in body and (np.abs(values) <= LARGEST).all())


def _refuse_worst(name: str, text: str, header: tuple[str, ...]) -> None:
    """Raises InputError at the first row or cell that is wrong."""
    rows = _rows(text)
    next(rows)
    for line, words in rows:
        cells = [cell.strip() for cell in words.split(",")]
        if len(cells) != len(header):
            raise InputError(
                f"{name}: line {line}: {len(cells)} cells where the header has {len(header)}; give each column a cell"
            )
        for column, cell in zip(header, cells):
            value = float_of(cell)
            if np.isinf(value) or (cell and np.isnan(value)):
                label = column if QUOTABLE.fullmatch(column) else str(header.index(column) + 1)
                raise InputError(f"{name}: line {line}, column {label}: {not_a_number(cell)}")
            if abs(value) > LARGEST:
                raise InputError(f"{name}: line {line}, column {column}: {value:g} is beyond {LARGEST:g}; mend it")


def _rows(text: str) -> Iterator[tuple[int, str]]:
    """Number and words of each line that is neither empty nor a remark, the header among them."""
    begin, line = 0, 0
    while begin < len(text):
        end = text.find("\n", begin)
        end = len(text) if end < 0 else end
        line += 1
        words = text[begin:end]
        if words.strip(" \t,") and not words.lstrip().startswith("#"):
            yield line, words
        begin = end + 1
