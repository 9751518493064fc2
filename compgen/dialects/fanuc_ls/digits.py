"""Numbers to characters and back for whole columns: look-up tables, no Python per row.

A table of text rows is a byte matrix with zero bytes where a row is shorter; ``ragged`` squeezes them out.
"""

from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from compgen.arrays import Array, IntArray

Bytes = NDArray[np.uint8]

WHOLE, DECIMALS, MOST_DECIMALS = 5, 3, 6  # %9.3f, to %12.6f
BLOCK = 8192  # rows at a time: they stay in cache
_LIMIT = 10**WHOLE  # below which a positive number has room
_MINUS, _ZERO, _SPACE = np.frombuffer(b"-0 ", dtype=np.uint8)


_POSITIVE = 100_000  # whole numbers from 0; behind them those below 0
_HEADS = np.frombuffer(
    "".join([f"{i:5d}.00" for i in range(_POSITIVE)] + [f"{'-' + str(i):>5}.00" for i in range(10_000)]).encode(),
    dtype=np.uint64,
)
_TAILS = np.frombuffer("".join([f".{i:03d}" for i in range(1000)]).encode(), dtype=np.uint32)
_BELOW = 10**9  # a minus sign in front adds a multiple of it
_WORTH = np.zeros(256, dtype=np.int64)  # of a character
_WORTH[_ZERO : _ZERO + 10] = np.arange(10)
_WORTH[_MINUS] = _BELOW // 1000
_TWO = np.arange(65536, dtype=np.uint16).view(np.uint8).reshape(-1, 2)
_PAIR = _WORTH[_TWO[:, 0]] * 10 + _WORTH[_TWO[:, 1]]  # of two characters as they lie in memory


def fits(units: IntArray, decimals: int = DECIMALS) -> bool:
    """Whether every number has room: five characters before the point, its sign among them."""
    limit = _LIMIT * 10**decimals
    return bool(np.all((units < limit) & (units > -limit // 10)))


def fixed(units: IntArray, decimals: int = DECIMALS) -> Bytes:
    """Columns of ``%9.3f`` (or ``%10.4f``, ``%11.5f``, ``%12.6f``) from units of the last digit, (N,) to (N, width).

    The first nine characters are a word of eight, and over its end one of four.
    """
    more = 10 ** (decimals - DECIMALS)
    size = np.abs(units)
    thousandths = (size // more if more > 1 else size).astype(np.int32)
    whole = thousandths // 1000
    rest = thousandths - whole * 1000
    rows, width = len(size), WHOLE + 1 + decimals
    out = np.empty((rows, width), dtype=np.uint8)
    np.ndarray(rows, np.uint64, out, 0, (width,))[:] = _HEADS[np.where(units < 0, whole + _POSITIVE, whole)]
    np.ndarray(rows, np.uint32, out, 5, (width,))[:] = _TAILS[rest]
    left = size % more
    for column in range(width - 1, WHOLE + DECIMALS, -1):
        out[:, column] = left % 10 + _ZERO
        left //= 10
    return out


def read_fixed(data: Bytes, at: IntArray, decimals: int = DECIMALS) -> IntArray:
    """Units of the last digit of the fields at places, (N,); anything else gives a wrong number: check by writing."""
    width = WHOLE + 1 + decimals
    windows = sliding_window_view(data, width)
    out = np.empty(len(at), dtype=np.int64)
    for first in range(0, len(at), BLOCK):
        text = np.ascontiguousarray(windows[at[first : first + BLOCK]])
        rows = len(text)
        a, b, d = (_PAIR[np.ndarray(rows, np.uint16, text, place, (width,))] for place in (0, 2, 6))
        said = ((a * 100 + b) * 10 + _WORTH[text[:, 4]]) * 1000 + d * 10 + _WORTH[text[:, 8]]
        size = said % _BELOW
        for column in range(WHOLE + 1 + DECIMALS, width):
            size = size * 10 + _WORTH[text[:, column]]
        out[first : first + BLOCK] = np.where(said >= _BELOW, -size, size)
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
        out.append(flat.tobytes() if flat.all() else flat.tobytes().replace(b"\0", b""))
    return b"".join(out)


def different(rows: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Numbers of rows that stand for all, and which of them each row equals.

    Rows are told apart by a sum over their bytes, eight at a time, with odd weights; that this sufficed is checked.
    """
    flat = np.ascontiguousarray(rows).reshape(len(rows), -1).view(np.uint8)
    if len(flat) and (flat == flat[0]).all():
        return np.zeros(1, dtype=np.int64), np.zeros(len(flat), dtype=np.int64)
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
