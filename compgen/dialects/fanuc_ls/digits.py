"""Numbers to characters and back for whole columns: look-up tables, no Python per row.

A table of text rows is a byte matrix with zero bytes where a row is shorter; ``ragged`` squeezes them out.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.arrays import Array, IntArray

Bytes = NDArray[np.uint8]

WHOLE, DECIMALS, MOST_DECIMALS = 5, 3, 6  # %9.3f, to %12.6f
BLOCK = 8192  # rows at a time: they stay in cache
_LIMIT = 10**WHOLE  # below which a positive number has room
_DOT, _MINUS, _ZERO, _SPACE = np.frombuffer(b".-0 ", dtype=np.uint8)


def _table(form: str, count: int, step: int = 1) -> Bytes:
    text = "".join(form % (i * step) for i in range(count))
    return np.frombuffer(text.encode("ascii"), dtype=np.uint8).reshape(count, -1)


_WHOLE = _table("%5d", 100_000)
_NEGATIVE = np.frombuffer("".join(f"{'-' + str(i):>5}" for i in range(10_000)).encode(), dtype=np.uint8).reshape(-1, 5)
_THOUSANDTHS = _table("%03d", 1000)


def fits(units: IntArray, decimals: int = DECIMALS) -> bool:
    """Whether every number has room: five characters before the point, its sign among them."""
    limit = _LIMIT * 10**decimals
    return bool(np.all((units < limit) & (units > -limit // 10)))


def fixed(units: IntArray, decimals: int = DECIMALS) -> Bytes:
    """Columns of ``%9.3f`` (or ``%10.4f``, ``%11.5f``, ``%12.6f``) from units of the last digit, (N,) to (N, width)."""
    size = np.abs(units)
    whole, rest = size // 10**decimals, size % 10**decimals
    out = np.empty((len(size), WHOLE + 1 + decimals), dtype=np.uint8)
    out[:, :WHOLE] = _WHOLE[whole]
    below = np.flatnonzero(units < 0)
    out[below, :WHOLE] = _NEGATIVE[whole[below]]
    out[:, WHOLE] = _DOT
    more = decimals - DECIMALS
    out[:, WHOLE + 1 : WHOLE + 4] = _THOUSANDTHS[rest // 10**more]
    if more:
        out[:, WHOLE + 4 :] = _THOUSANDTHS[rest % 10**more][:, DECIMALS - more :]
    return out


def read_fixed(data: Bytes, at: IntArray, decimals: int = DECIMALS) -> IntArray:
    """Units of the last digit of the fields at places, (N,); anything else gives a wrong number: check by writing."""
    out = np.empty(len(at), dtype=np.int64)
    for first in range(0, len(at), BLOCK):
        place = at[first : first + BLOCK]
        value = np.zeros(len(place), dtype=np.int64)
        below = np.zeros(len(place), dtype=bool)
        for column in range(WHOLE + 1 + decimals):
            if column != WHOLE:
                character = data[place + column]
                digit = character - _ZERO  # wraps below zero for blanks and signs
                value = value * 10 + np.where(digit < 10, digit, 0)
                below |= character == _MINUS
        out[first : first + BLOCK] = np.where(below, -value, value)
    return out


def integers(values: IntArray, pad: int = 0) -> Bytes:
    """Decimal digits of numbers from 0, right-aligned; blanks up to ``pad`` columns, zero bytes before them."""
    width = max(pad, len(str(int(values.max(initial=0)))))
    out = np.zeros((len(values), width), dtype=np.uint8)
    rest = values.copy()
    for column in range(width - 1, -1, -1):
        shown = (rest > 0) | (column == width - 1)
        blank = _SPACE if column >= width - pad else 0
        out[:, column] = np.where(shown, rest % 10 + _ZERO, blank)
        rest //= 10
    return out


def chosen(texts: list[bytes], which: IntArray) -> Bytes:
    """Row k is the text that ``which`` names, (N, longest)."""
    longest = max(len(t) for t in texts)
    table = np.frombuffer(b"".join(t.ljust(longest, b"\0") for t in texts), dtype=np.uint8).reshape(-1, longest)
    return np.asarray(table[which])


def ragged(rows: int, parts: list[bytes | Bytes]) -> bytes:
    """Rows side by side, the same text or a matrix each, without the zero bytes."""
    widths = [len(p) if isinstance(p, bytes) else p.shape[1] for p in parts]
    block = np.empty((min(rows, BLOCK), sum(widths)), dtype=np.uint8)
    edges = np.concatenate([[0], np.cumsum(widths)])
    for part, start, end in zip(parts, edges[:-1], edges[1:]):
        if isinstance(part, bytes):
            block[:, start:end] = np.frombuffer(part, dtype=np.uint8)
    out = []
    for first in range(0, rows, BLOCK):
        here = block[: min(BLOCK, rows - first)]
        for part, start, end in zip(parts, edges[:-1], edges[1:]):
            if not isinstance(part, bytes):
                here[:, start:end] = part[first : first + BLOCK]
        flat = here.ravel()
        out.append(flat[flat != 0].tobytes())
    return b"".join(out)


def different(rows: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Numbers of rows that stand for all, and which of them each row equals.

    Rows are told apart by a sum over their bytes, eight at a time, with odd weights; that this sufficed is checked.
    """
    flat = np.ascontiguousarray(rows).reshape(len(rows), -1).view(np.uint8)
    padded = np.zeros((len(rows), -(-flat.shape[1] // 8) * 8), dtype=np.uint8)
    padded[:, : flat.shape[1]] = flat
    words = padded.view(np.uint64)
    key = np.zeros(len(rows), dtype=np.uint64)
    for column, weight in zip(words.T, _weights(words.shape[1])):
        key += column * weight
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(words, words[first][which]):
        _, first, which = np.unique(words, axis=0, return_index=True, return_inverse=True)
    return first, which.ravel()


def _weights(count: int) -> NDArray[np.uint64]:
    """Odd numbers that spread bits: powers of the golden ratio's, modulo 2^64."""
    weights = [pow(0x9E3779B97F4A7C15, k + 1, 2**64) for k in range(count)]
    return np.array(weights, dtype=np.uint64)


def units(values: Array, decimals: int = DECIMALS) -> IntArray:
    """Nearest whole units of the last digit."""
    return np.asarray(np.rint(values * 10**decimals), dtype=np.int64)
