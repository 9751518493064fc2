"""Numbers as text for whole columns: words of up to eight characters from tables, side by side, squeezed at the end.

A column is one or two words a row. A word has as many places as the longest of its block needs, with zero bytes where a
row is shorter; they are taken out when a block of rows is whole.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.core.arrays import Array, IntArray

Words = NDArray[np.uint64]
Column = list[tuple[int, Words]]  # of each word: how many of its eight bytes count; the others are zero

WHOLE = 100_000  # digits before the point reach up to here
SPLIT = 1000  # more decimals than four are two look-ups, the second of three digits


def decimals(table: Array | IntArray, places: int) -> Column | None:
    """``,`` and then %.4f, %.5f or %.6f of each column (N, k), never a negative zero; None where one has no room."""
    scale = 10.0**places
    number = np.rint(np.multiply(table.T, scale, order="C"))
    negative = number < 0
    size = np.abs(number, out=number)
    most = float(size.max())
    if not most < WHOLE * scale:  # also not a number
        return None
    width, signed = len(str(int(most / scale))), bool(negative.any())
    whole = np.floor(size / scale)  # exact: a quotient below 1e5 that is no integer is 1e-6 off the next
    size -= whole * scale
    if signed:
        whole += negative * 10.0**width
    before = np.take(_whole(width, signed), whole.astype(np.int64))
    if places <= 4:
        after = np.take(_fraction(places, 0), size.astype(np.int64))
    else:
        high = np.floor(size / SPLIT)
        size -= high * SPLIT
        after = np.take(_fraction(places - 3, 0), high.astype(np.int64))
        after |= np.take(_fraction(3, places - 3), size.astype(np.int64))
    point = 2 + signed + width
    return [word for pair in zip(before, after) for word in ((point, pair[0]), (places, pair[1]))]


def counted(numbers: IntArray) -> Column:
    """A line end and whole numbers from 0 to 10^8."""
    high = numbers // 10_000
    low = numbers - 10_000 * high
    return [(5, np.take(_high(), high)), (4, np.take(_low(), low + 10_000 * (high > 0)))]


def digit(numbers: IntArray) -> Column:
    """``,`` and a number from 0 to 9."""
    return [(2, np.take(_words([f",{k}" for k in range(10)]), numbers))]


def blank(rows: int) -> Column:
    """``,`` and nothing."""
    return [(1, np.full(rows, _words([","])[0]))]


def squeezed(column: Column) -> bytes:
    """The rows side by side, without zero bytes."""
    rows, width = len(column[0][1]), sum(count for count, _ in column)
    width += 8 - column[-1][0]
    sheet = np.zeros((rows, width), dtype=np.uint8)
    at = 0
    for count, words in column:  # what does not count of a word lies under the next
        np.ndarray((rows,), np.uint64, sheet, at, (width,))[:] = words
        at += count
    return sheet.tobytes().translate(None, b"\0")


def _words(texts: list[str]) -> Words:
    return np.frombuffer(b"".join(t.encode("ascii").ljust(8, b"\0") for t in texts), dtype=np.uint64)


def _digits(count: int, width: int, least: int) -> NDArray[np.uint8]:
    """Numbers from 0, right-aligned in a width, with at least so many digits and zero bytes before them."""
    number = np.arange(count)
    out = np.zeros((count, width), dtype=np.uint8)
    for column in range(width):
        place = width - 1 - column
        shown = (number >= 10**place) | (place < least)
        out[:, column] = np.where(shown, number // 10**place % 10 + ord("0"), 0)
    return out


def _table(*parts: NDArray[np.uint8] | bytes) -> Words:
    """A word a row, of parts side by side."""
    rows = max(len(p) for p in parts if not isinstance(p, bytes))
    out = np.zeros((rows, 8), dtype=np.uint8)
    at = 0
    for part in parts:
        text = np.frombuffer(part, dtype=np.uint8)[None] if isinstance(part, bytes) else part
        out[:, at : at + text.shape[1]] = text
        at += text.shape[1]
    return out.view(np.uint64).ravel()


@lru_cache(maxsize=10)
def _whole(width: int, signed: bool) -> Words:
    digits = _digits(10**width, width, 1)
    signs = (b"\0", b"-") if signed else (b"",)
    return np.concatenate([_table(b"," + sign, digits, b".") for sign in signs])


@lru_cache(maxsize=8)
def _fraction(places: int, shift: int) -> Words:
    return _table(bytes(shift), _digits(10**places, places, places))


@lru_cache(maxsize=1)
def _high() -> Words:
    return _table(b"\n", _digits(10_000, 4, 0))


@lru_cache(maxsize=1)
def _low() -> Words:
    return np.concatenate([_table(_digits(10_000, 4, least)) for least in (1, 4)])


def plain(columns: list[tuple[str, Any]]) -> bytes:
    """The same row by row, for numbers of any size: (format, values) of each column; every row after a line end."""
    form = "\n" + ",".join(form for form, _ in columns)
    return "".join(map(form.__mod__, zip(*(values.tolist() for _, values in columns)))).encode("ascii")
