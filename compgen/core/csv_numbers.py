"""The body of a CSV file whose cells are all numbers or empty, read at once: what files of millions of rows need."""

import io
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray, frozen

_PLAIN = b"0123456789eE+-., \t\n"  # what numbers and the gaps between them are written with
_REMARK = re.compile(r"(?m)^[ \t]*#.*$")
_GAP = re.compile(r"(?m)(?:(?<=,)|^(?=[ \t]*,))[ \t]*(?=,|$)")
_EMPTY_ROW = re.compile(r"(?m)^[ \t]*,[ \t,]*$")  # cells, and nothing in any


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


def numbers_at_once(body: str, width: int) -> tuple[Array, IntArray] | None:
    """The numbers of a body, (N, ``width``), NaN where a cell is empty, and the line of each row from 0.

    Lines that begin with # are remarks, lines without a filled cell are none. None for a body that has anything else in
    it than ``width`` finite numbers or gaps a row.
    """
    plain = _REMARK.sub("", body) if "#" in body else body
    if not plain.isascii() or not plain.strip() or plain.encode().translate(None, _PLAIN):
        return None
    numbers = plain
    if _has_gaps(plain):
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


def _has_gaps(plain: str) -> bool:
    """Whether any cell is empty."""
    cells = f"\n{plain}\n".encode().translate(None, b" \t")
    return b",," in cells or b",\n" in cells or b"\n," in cells
