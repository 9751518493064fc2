"""Numbers to characters and back for whole columns: look-up tables, no Python per row.

A table of text rows is a byte matrix with zero bytes where a row is shorter; ``ragged`` squeezes them out.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.arrays import Array, IntArray

Bytes = NDArray[np.uint8]

WIDTH, DECIMALS = 9, 3  # %9.3f
BLOCK = 8192  # rows at a time: they stay in cache
_LIMIT = 10**8  # thousandths: what nine characters hold of a positive number
_DOT, _MINUS, _ZERO, _SPACE = np.frombuffer(b".-0 ", dtype=np.uint8)


def _digits(count: int, width: int, blank: int) -> Bytes:
    """Numbers from 0, right-aligned, with a character before the first digit."""
    number = np.arange(count)
    out = np.empty((count, width), dtype=np.uint8)
    for column in range(width):
        place = 10 ** (width - 1 - column)
        out[:, column] = np.where((number >= place) | (place == 1), number // place % 10 + _ZERO, blank)
    return out


def _below_zero(count: int, width: int) -> Bytes:
    """The same with a minus sign before the first digit."""
    out = _digits(count, width, int(_SPACE))
    first = (out == _SPACE).sum(axis=1) - 1
    out[np.arange(count), first] = _MINUS
    return out


_WHOLE = _digits(100_000, 5, int(_SPACE))
_NEGATIVE = _below_zero(10_000, 5)
_THOUSANDTHS = _digits(1000, 3, int(_ZERO))


def fits(thousandths: IntArray) -> bool:
    """Whether every number has room in nine characters."""
    return bool(np.all((thousandths < _LIMIT) & (thousandths > -_LIMIT // 10)))


def fixed(thousandths: IntArray) -> Bytes:
    """Columns of ``%9.3f``, (N,) to (N, 9)."""
    size = np.abs(thousandths)
    whole, rest = size // 1000, size % 1000
    out = np.empty((len(size), WIDTH), dtype=np.uint8)
    out[:, :5] = _WHOLE[whole]
    below = np.flatnonzero(thousandths < 0)
    out[below, :5] = _NEGATIVE[whole[below]]
    out[:, 5] = _DOT
    out[:, 6:] = _THOUSANDTHS[rest]
    return out


def read_fixed(data: Bytes, at: IntArray) -> IntArray:
    """Thousandths of the ``%9.3f`` fields at places, (N,); anything else gives a wrong number: check by writing."""
    out = np.empty(len(at), dtype=np.int64)
    for first in range(0, len(at), BLOCK):
        place = at[first : first + BLOCK]
        value = np.zeros(len(place), dtype=np.int64)
        below = np.zeros(len(place), dtype=bool)
        for column in range(WIDTH):
            if column != WIDTH - DECIMALS - 1:
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


def thousandths(values: Array) -> IntArray:
    """Nearest whole thousandths."""
    return np.asarray(np.rint(values * 1000), dtype=np.int64)
