"""Numbers to characters and back for whole columns: look-up tables, no Python per row.

A column of a text table is a few words a row, of one, four or eight characters: a word goes to its place in all rows in
one step. Zero bytes stand where a row is shorter than others; ``table`` squeezes them out.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.fanuc.listing.byte_tables import Bytes, Words, word

WHOLE, DECIMALS, MOST_DECIMALS = 5, 3, 6  # %9.3f, to %12.6f
BLOCK = 4096  # rows at a time: they stay in cache
_LIMIT = 10**WHOLE  # below which a positive number has room
_MINUS, _ZERO, _BLANK = np.frombuffer(b"-0 ", dtype=np.uint8)


def _digits(count: int) -> Bytes:
    """The numbers below 10^count, (10^count, count)."""
    numbers = np.arange(10**count)[:, None] // 10 ** np.arange(count)[::-1]
    return np.asarray(numbers % 10 + _ZERO, dtype=np.uint8)


def _tens() -> Words:
    """Blanks, sign and all digits but the last of a number of up to five places: 0 to 9999, then -0 to -999."""
    text = _digits(4)
    blanks = (text == _ZERO).cumprod(axis=1).sum(axis=1)
    text[np.arange(4) < blanks[:, None]] = _BLANK
    below = text[:1000].copy()
    below[np.arange(1000), blanks[:1000] - 1] = _MINUS
    return np.concatenate([text, below]).view(np.uint32)[:, 0]


_FOUR = _digits(4).view(np.uint32)[:, 0]
_TENS = _tens().astype(np.uint64)  # a number's first four characters; the next four are d.dd
_HUNDREDTHS = np.insert(_digits(3), 1, ord("."), axis=1).view(np.uint32)[:, 0].astype(np.uint64) << np.uint64(32)
_BELOW = 1 << 24  # marks a sign in what two characters are worth
_TWO = np.arange(65536, dtype="<u2").view(np.uint8).reshape(-1, 2)
_ONE = np.where((_TWO >= _ZERO) & (_TWO < _ZERO + 10), _TWO - _ZERO, 0).astype(np.int32)
_PAIR = 10 * _ONE[:, 0] + _ONE[:, 1] + _BELOW * (_TWO == _MINUS).any(axis=1)  # as they lie in memory


@dataclass(frozen=True, eq=False, slots=True)
class Column:
    """Characters of N rows."""

    width: int
    words: tuple[tuple[int, Words], ...]  # at which character of the column, and what
    loose: bool = False  # whether some rows are shorter and hold zero bytes


def fits(units: Array | IntArray, decimals: int = DECIMALS) -> bool:
    """Whether every number has room: five characters before the point, its sign among them; none is NaN."""
    limit = _LIMIT * 10**decimals
    return units.size == 0 or bool(units.max() < limit and units.min() > -limit // 10)


def fixed(units: IntArray, decimals: int = DECIMALS) -> list[Column]:
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


def read_fixed(text: Bytes, places: list[int], decimals: int = DECIMALS) -> IntArray:
    """Units of the last digit of k such columns of a table of text (N, width), (k, N).

    What is no number is read as a wrong one: check by writing.
    """
    words = np.empty((len(places), len(text), 8), dtype="<u2")
    for row, at in zip(words, places):
        row.view(np.complex128)[:, 0] = word(text, at, np.complex128)
    tens = _PAIR.take(words[..., 0]) * 100 + _PAIR.take(words[..., 1])
    rest = _PAIR.take(words[..., 2]) * 10 + _PAIR.take(words[..., 3])
    size = ((tens & (_BELOW - 1)) * 1000 + rest) * 10 + (words[..., 4] & 15)
    if decimals > DECIMALS:
        size = size.astype(np.int64)
        for place in range(WHOLE + 1 + DECIMALS, WHOLE + 1 + decimals):
            size = size * 10 + (words.view(np.uint8)[..., place] & 15)
    return np.asarray(np.where(tens >= _BELOW, -size, size))


def counted(first: int, last: int, pad: int = 0) -> Column:
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
    return Column(width, tuple(words), loose=width > pad)


def places_of(first: int, last: int) -> IntArray:
    """How many digits the numbers from first to before last have, (last - first,), or (1,) when it is the same."""
    if len(str(first)) == len(str(last - 1)):
        return np.array([len(str(first))])
    edges = np.clip(10 ** np.arange(len(str(last)) + 1), first, last)
    return np.repeat(np.arange(1, len(edges)), np.diff(edges))


def chosen(texts: list[bytes], which: IntArray) -> bytes | Column:
    """Row k is the text that ``which`` names."""
    if len(which) and (which == which[0]).all():
        return texts[int(which[0])]
    longest = max(len(t) for t in texts)
    words = np.array(texts, dtype=f"S{longest}")[which]
    return Column(longest, ((0, words),), loose=any(len(t) < longest for t in texts))


def table(rows: int, parts: list[bytes | Column]) -> bytes | memoryview:
    """Rows side by side, the same text in each or a column."""
    row = b"".join(part if isinstance(part, bytes) else bytes(part.width) for part in parts)
    block = np.empty((rows, len(row)), dtype=np.uint8)
    block[:] = np.frombuffer(row, dtype=np.uint8)
    start = 0
    for part in parts:
        if isinstance(part, bytes):
            start += len(part)
            continue
        for at, words in part.words:
            word(block, start + at, words.dtype)[:] = words
        start += part.width
    loose = any(isinstance(part, Column) and part.loose for part in parts)
    return block.tobytes().replace(b"\0", b"") if loose else block.reshape(-1).data


def units(values: Array, decimals: int = DECIMALS) -> IntArray:
    """Nearest whole units of the last digit."""
    return np.asarray(np.rint(values * 10**decimals), dtype=np.int64)
