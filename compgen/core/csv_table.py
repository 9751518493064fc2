"""CSV files to columns: names with units, numbers that are numbers, one line for whatever is wrong."""

import csv
import difflib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError

MAX_ROWS = 1_000_000


@dataclass(frozen=True, slots=True)
class CsvTable:
    """The cells of a file as text, with the line of each row for messages."""

    name: str  # the file, for messages
    header: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]  # rows
    line: tuple[int, ...]  # of each row in the file

    def has(self, column: str) -> bool:
        """Whether a column is there."""
        return column in self.header

    def where(self, row: int, column: str = "") -> str:
        """A place for a message: file, line and column."""
        return f"{self.name}: line {self.line[row]}" + (f", column {column}" if column else "")

    def words(self, column: str) -> list[str]:
        """A column as text.

        Raises:
            InputError: A cell is empty.
        """
        k = self.header.index(column)
        found = [row[k].strip() for row in self.cells]
        for i, word in enumerate(found):
            if not word:
                raise InputError(f"{self.where(i, column)}: empty; fill it in, or remove the row")
        return found

    def numbers(self, column: str, may_be_empty: bool = False) -> Array:
        """A column as numbers, (N,); an empty cell is NaN where it may be empty.

        Raises:
            InputError: A cell is empty, NaN, infinite or not a number.
        """
        k = self.header.index(column)
        found = np.empty(len(self.cells))
        for i, row in enumerate(self.cells):
            text = row[k].strip()
            if not text and may_be_empty:
                found[i] = np.nan
                continue
            try:
                found[i] = float(text)
            except ValueError:
                told = "empty" if not text else f"'{text}' is not a number"
                raise InputError(
                    f"{self.where(i, column)}: {told}; give a number with a decimal point, or remove the row"
                ) from None
            if not np.isfinite(found[i]):
                raise InputError(f"{self.where(i, column)}: '{text}' is not a finite number; remove the row")
        return found


def read_table(source: str, needed: Sequence[str], known: Sequence[str]) -> CsvTable:
    """A file's cells.

    Args:
        source: A CSV file: commas, a header with units in its names, lines that begin with # are remarks.
        needed: Columns that must be there.
        known: All columns that may be there.

    Raises:
        InputError: Not there, not readable, no rows, a column missing, unknown or double, a row of another length.
    """
    try:
        text = Path(source).read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; give a CSV file of measurements") from None
    except UnicodeDecodeError:
        raise InputError(f"{source}: not UTF-8 text; save it as CSV with UTF-8") from None
    except OSError as failure:
        raise InputError(f"{source}: cannot be read: {failure.strerror}; give a CSV file") from None
    if "\0" in text:
        raise InputError(f"{source}: holds zero bytes, so it is no text; give a CSV file")
    try:
        rows = [(i, row) for i, row in _rows(text) if any(c.strip() for c in row)]
    except csv.Error as failure:
        raise InputError(f"{source}: not CSV: {failure}; save it as CSV with commas") from None
    if not rows:
        raise InputError(f"{source}: empty; the first line names the columns: {', '.join(needed)}")
    header = tuple(c.strip() for c in rows[0][1])
    _check_header(source, header, needed, known)
    body = rows[1:]
    if not body:
        raise InputError(f"{source}: no rows below the header; give measurements")
    if len(body) > MAX_ROWS:
        raise InputError(f"{source}: {len(body)} rows are over {MAX_ROWS}; thin them")
    for line, row in body:
        if len(row) != len(header):
            raise InputError(
                f"{source}: line {line}: {len(row)} cells where the header has {len(header)}; give each column a cell"
            )
    return CsvTable(source, header, tuple(tuple(r) for _, r in body), tuple(i for i, _ in body))


def _rows(text: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text), strict=True)
    return [(reader.line_num, row) for row in reader if not (row and row[0].lstrip().startswith("#"))]


def _check_header(source: str, header: Sequence[str], needed: Sequence[str], known: Sequence[str]) -> None:
    if len(header) == 1 and ";" in header[0]:
        raise InputError(f"{source}: line 1: cells are parted by semicolons; save it with commas")
    for name in header:
        if header.count(name) > 1:
            raise InputError(f"{source}: column {name}: stands twice in the header; keep one")
    unknown = next((c for c in header if c not in known), None)
    missing = [c for c in needed if c not in header]
    if missing:
        close = difflib.get_close_matches(missing[0], [c for c in header if c not in known], n=1, cutoff=0.4)
        other = f"; is it '{close[0]}', in another unit or spelling?" if close else ""
        raise InputError(
            f"{source}: column {missing[0]}: missing{other}; the header needs {', '.join(needed)}; "
            f"missing are {', '.join(missing)}"
        )
    if unknown is not None:
        close = difflib.get_close_matches(unknown, known, n=1, cutoff=0.5)
        mend = f"did you mean '{close[0]}'?" if close else f"known: {', '.join(known)}"
        raise InputError(f"{source}: column {unknown}: unknown; {mend}")
