"""Numbers as text for whole columns: eight characters at a time from tables, squeezed together at the end.

A column is one or two words of eight bytes a row, with zero bytes where a row is shorter; they are taken out when a
block of rows is whole.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.arrays import Array, IntArray

Words = NDArray[np.uint64]

WHOLE = 100_000  # digits before the point reach up to here


def decimal(values: Array, decimals: int) -> list[Words] | None:
    """``,`` and then %.4f, %.5f or %.6f, never a negative zero; None where a number has no room."""
    scaled = np.rint(values * 10.0**decimals)
    if not np.all(np.abs(scaled) < WHOLE * 10**decimals):  # also not a number
        return None
    number = scaled.astype(np.int64)
    size = np.abs(number)
    whole = size // 10**decimals
    rest = size - whole * 10**decimals
    first = np.take(_whole(), whole + WHOLE * (number < 0))
    if decimals != 6:
        return [first, np.take(_fraction(decimals, 0), rest)]
    high = rest // 1000
    return [first, np.take(_fraction(3, 0), high) | np.take(_fraction(3, 3), rest - 1000 * high)]


def counted(numbers: IntArray) -> list[Words]:
    """A line end and whole numbers from 0 to 10^8."""
    high = numbers // 10_000
    low = numbers - 10_000 * high
    return [np.take(_high(), high), np.take(_low(), low + 10_000 * (high > 0))]


def digit(numbers: IntArray) -> list[Words]:
    """``,`` and a number from 0 to 9."""
    return [np.take(_words([f",{k}" for k in range(10)]), numbers)]


def blank(rows: int) -> list[Words]:
    """``,`` and nothing."""
    return [np.full(rows, _words([","])[0])]


def squeezed(columns: list[Words]) -> bytes:
    """The rows side by side, without zero bytes."""
    flat = np.stack(columns, axis=1).view(np.uint8).ravel()
    return bytes(flat[flat != 0].tobytes())


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


@lru_cache(maxsize=1)
def _whole() -> Words:
    digits = _digits(WHOLE, 5, 1)
    return np.concatenate([_table(b",", digits, b"."), _table(b",-", digits, b".")])


@lru_cache(maxsize=8)
def _fraction(decimals: int, shift: int) -> Words:
    return _table(bytes(shift), _digits(10**decimals, decimals, decimals))


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
