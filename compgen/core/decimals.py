"""Numbers as decimal text, and back, for whole columns: look-up tables, no Python per row.

A column is a few words a row, of one to eight characters; each word goes to its place in all rows in one step. Zero
bytes stand where a row is shorter than others, and ``join_columns`` takes them out.

Two layouts: fixed width, as in ``%9.3f`` to ``%12.6f``, and as short as can be, as in ``%.4f`` to ``%.6f``.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.core.arrays import Array, IntArray

Bytes = NDArray[np.uint8]
Words = NDArray[Any]  # (N,) as many characters of each row as an item has bytes

WHOLE, DECIMALS, MOST_DECIMALS = 5, 3, 6  # characters before the point; least and most after it
_LIMIT = 10**WHOLE  # below which a positive number has room
_SPLIT = 1000  # more decimals than four are two look-ups, the second of three digits
_MINUS, _ZERO, _BLANK = np.frombuffer(b"-0 ", dtype=np.uint8)


def word_view(text: Bytes, at: int, kind: Any) -> Words:
    """The words at a place of all rows of a table of text, as a view."""
    return np.asarray(text[:, at : at + np.dtype(kind).itemsize].view(kind)[:, 0])


@dataclass(frozen=True, eq=False, slots=True)
class Column:
    """Characters of N rows. A word may reach beyond the width with zero bytes: the next column lies over them."""

    width: int
    words: tuple[tuple[int, Words], ...]  # at which character of the column, and what
    ragged: bool = False  # whether some rows are shorter and hold zero bytes

    @property
    def end(self) -> int:
        """Where the last word ends; it may be beyond the width."""
        return max([self.width, *(at + words.dtype.itemsize for at, words in self.words)])


def join_columns(rows: int, parts: list[bytes | Column]) -> bytes | memoryview:
    """Rows side by side; a part is a column, or text that is the same in each row."""
    width = sum(len(part) if isinstance(part, bytes) else part.width for part in parts)
    columns = [part for part in parts if isinstance(part, Column)]
    reach = any(column.end > column.width for column in columns)
    room = max((column.end - column.width for column in columns), default=0)
    block = np.empty((rows, width + room), dtype=np.uint8)
    if reach:
        block[:, width:] = 0
    else:
        text = b"".join(part if isinstance(part, bytes) else bytes(part.width) for part in parts)
        block[:] = np.frombuffer(text, dtype=np.uint8)
    start = 0
    for part in parts:
        if isinstance(part, bytes):
            if reach:
                block[:, start : start + len(part)] = np.frombuffer(part, dtype=np.uint8)
            start += len(part)
            continue
        for at, words in part.words:
            word_view(block, start + at, words.dtype)[:] = words
        start += part.width
    ragged = reach or any(column.ragged for column in columns)
    return block.tobytes().translate(None, b"\0") if ragged else block.reshape(-1).data


def text_column(texts: list[bytes], which: IntArray) -> bytes | Column:
    """Row k is the text that ``which`` names."""
    if len(which) and (which == which[0]).all():
        return texts[int(which[0])]
    longest = max(len(text) for text in texts)
    words = np.array(texts, dtype=f"S{longest}")[which]
    return Column(longest, ((0, words),), ragged=any(len(text) < longest for text in texts))


def _digits(width: int, least: int) -> Bytes:
    """The numbers below 10^width, with at least so many digits and zero bytes before them, (10^width, width)."""
    number = np.arange(10**width)[:, None]
    power = 10 ** np.arange(width)[::-1]
    shown = (number >= power) | (power < 10**least)
    return np.asarray(np.where(shown, number // power % 10 + _ZERO, 0), dtype=np.uint8)


# ---- Whole numbers ---------------------------------------------------------------------------------------------------

_FOUR = _digits(4, 4).view(np.uint32)[:, 0]


def consecutive(first: int, last: int, pad: int = 0) -> Column:
    """The numbers from first to before last, right-aligned; blanks up to ``pad`` characters, zero bytes before them."""
    values = np.arange(first, last, dtype=np.int32)
    width = len(str(last - 1))
    if 4 <= len(str(first)) == width <= 8:
        front, back = values // 10 ** (width - 4), values - values // 10_000 * 10_000
        return Column(width, ((0, _FOUR.take(front)), (width - 4, _FOUR.take(back))))
    width, words = max(pad, width), []
    for place in range(width):
        rest = values // 10 ** (width - 1 - place)
        blank = _BLANK if place >= width - pad else 0
        shown = (rest > 0) | (place == width - 1)
        words.append((place, np.where(shown, rest % 10 + _ZERO, blank).astype(np.uint8)))
    return Column(width, tuple(words), ragged=width > pad)


def digit_counts(first: int, last: int) -> IntArray:
    """How many digits the numbers from first to before last have, (last - first,), or (1,) when all have as many."""
    if len(str(first)) == len(str(last - 1)):
        return np.array([len(str(first))])
    powers = np.clip(10 ** np.arange(len(str(last)) + 1), first, last)
    return np.repeat(np.arange(1, len(powers)), np.diff(powers))


# ---- Fixed width -----------------------------------------------------------------------------------------------------


def _tens() -> Words:
    """Blanks, sign and all digits but the last of a number of up to five places: 0 to 9999, then -0 to -999."""
    text = _digits(4, 4)
    blanks = (text == _ZERO).cumprod(axis=1).sum(axis=1)
    text[np.arange(4) < blanks[:, None]] = _BLANK
    below = text[:1000].copy()
    below[np.arange(1000), blanks[:1000] - 1] = _MINUS
    return np.concatenate([text, below]).view(np.uint32)[:, 0]


_TENS = _tens().astype(np.uint64)  # a number's first four characters; the next four are d.dd
_HUNDREDTHS = np.insert(_digits(3, 3), 1, ord("."), axis=1).view(np.uint32)[:, 0].astype(np.uint64) << np.uint64(32)
_NEGATIVE = 1 << 24  # marks a sign in what two characters are worth
_TWO = np.arange(65536, dtype="<u2").view(np.uint8).reshape(-1, 2)
_ONE = np.where((_TWO >= _ZERO) & (_TWO < _ZERO + 10), _TWO - _ZERO, 0).astype(np.int32)
_PAIR = 10 * _ONE[:, 0] + _ONE[:, 1] + _NEGATIVE * (_TWO == _MINUS).any(axis=1)  # as they lie in memory


def fits_fixed(units: Array | IntArray, decimals: int) -> bool:
    """Whether every number has room: five characters before the point, its sign among them; none is NaN."""
    limit = _LIMIT * 10**decimals
    return units.size == 0 or bool(units.max() < limit and units.min() > -limit // 10)


def fixed_columns(units: IntArray, decimals: int) -> list[Column]:
    """k columns of ``%9.3f`` (or ``%10.4f``, ``%11.5f``, ``%12.6f``) from units of the last digit, (k, N)."""
    size = np.abs(units)
    more = 10 ** (decimals - DECIMALS)
    thousandths = (size // more if more > 1 else size).astype(np.int32)
    tens = thousandths // 10_000
    rest = thousandths - tens * 10_000
    hundredths = rest // 10
    head = _TENS.take(tens + (units < 0) * np.int32(10_000)) | _HUNDREDTHS.take(hundredths)
    words = [(0, head), (WHOLE + DECIMALS, (rest - hundredths * 10 + _ZERO).astype(np.uint8))]
    left = size % more if more > 1 else size
    for place in range(WHOLE + decimals, WHOLE + DECIMALS, -1):
        words.append((place, (left % 10 + _ZERO).astype(np.uint8)))
        left //= 10
    return [Column(WHOLE + 1 + decimals, tuple((at, word[k]) for at, word in words)) for k in range(len(units))]


def parse_fixed(text: Bytes, places: list[int], decimals: int) -> IntArray:
    """Units of the last digit of k such columns of a table of text (N, width), (k, N).

    What is no number is read as a wrong one: check by writing.
    """
    words = np.empty((len(places), len(text), 8), dtype="<u2")
    for row, at in zip(words, places, strict=False):
        row.view(np.complex128)[:, 0] = word_view(text, at, np.complex128)
    tens = _PAIR.take(words[..., 0]) * 100 + _PAIR.take(words[..., 1])
    rest = _PAIR.take(words[..., 2]) * 10 + _PAIR.take(words[..., 3])
    size = ((tens & (_NEGATIVE - 1)) * 1000 + rest) * 10 + (words[..., 4] & 15)
    if decimals > DECIMALS:
        size = size.astype(np.int64)
        for place in range(WHOLE + 1 + DECIMALS, WHOLE + 1 + decimals):
            size = size * 10 + (words.view(np.uint8)[..., place] & 15)
    return np.asarray(np.where(tens >= _NEGATIVE, -size, size))


# ---- As short as can be ----------------------------------------------------------------------------------------------


def short_columns(table: Array | IntArray, decimals: int, before: bytes = b"") -> list[Column] | None:
    """Columns of ``%.4f``, ``%.5f`` or ``%.6f`` of a table (N, k), never a negative zero; None where one has no room.

    Args:
        table: Numbers.
        decimals: 4 to 6.
        before: At most one character in front of each number.
    """
    scale = 10.0**decimals
    number = np.rint(np.multiply(table.T, scale, order="C"))
    negative = number < 0
    size = np.abs(number, out=number)
    most = float(size.max())
    if not most < _LIMIT * scale:  # also not a number
        return None
    width, signed = len(str(int(most / scale))), bool(negative.any())
    whole = np.floor(size / scale)  # exact: a quotient below 1e5 that is no integer is 1e-6 off the next
    size -= whole * scale
    if signed:
        whole += negative * 10.0**width
    head = np.take(_whole_words(width, before, signed=signed), whole.astype(np.int64))
    if decimals <= 4:
        tail = np.take(_fraction_words(decimals, 0), size.astype(np.int64))
    else:
        high = np.floor(size / _SPLIT)
        size -= high * _SPLIT
        tail = np.take(_fraction_words(decimals - 3, 0), high.astype(np.int64))
        tail |= np.take(_fraction_words(3, decimals - 3), size.astype(np.int64))
    point = len(before) + signed + width + 1
    return [Column(point + decimals, ((0, h), (point, t)), ragged=True) for h, t in zip(head, tail, strict=False)]


def _words(*parts: Bytes | bytes) -> Words:
    """A word of eight characters a row, of parts side by side."""
    rows = max(len(part) for part in parts if not isinstance(part, bytes))
    out = np.zeros((rows, 8), dtype=np.uint8)
    at = 0
    for part in parts:
        text = np.frombuffer(part, dtype=np.uint8)[None] if isinstance(part, bytes) else part
        out[:, at : at + text.shape[1]] = text
        at += text.shape[1]
    return out.view(np.uint64).ravel()


@lru_cache(maxsize=10)
def _whole_words(width: int, before: bytes, *, signed: bool) -> Words:
    """Sign, digits and point: numbers below 10^width, then the negative ones."""
    signs = (b"\0", b"-") if signed else (b"",)
    return np.concatenate([_words(before + sign, _digits(width, 1), b".") for sign in signs])


@lru_cache(maxsize=8)
def _fraction_words(places: int, shift: int) -> Words:
    return _words(bytes(shift), _digits(places, places))
