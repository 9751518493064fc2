"""Texts of one shape, many at a time: what the careful reader found in one text is found in all texts like it.

A shape is a text with holes. Outside its holes a text must be the same byte for byte, so it means the same; only what
fills the holes is read anew, by columns. A text that fits no shape is left to the careful reader: nothing is guessed.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.fanuc.listing.byte_tables import different

#: What fills a hole: a whole number, a decimal without and with a sign, stars (untaught), any text up to what follows.
DIGITS, DECIMAL, NUMBER, STARS, TEXT = range(5)
P = TypeVar("P")
Hole = tuple[int, int, int]  # kind, and from where to where; blanks in front of a number belong to the hole

FEW = 1000  # texts: below it the careful reader is as quick
_ROWS = 8192  # texts at a time: they stay in cache
_CHUNK = 1 << 16  # bytes at a time
_PAD = 80  # zero bytes behind the last text, so that a look ahead stays inside
_WIDTH = {DIGITS: 20, DECIMAL: 28, NUMBER: 28, STARS: 20, TEXT: 64}  # characters of a hole, blanks in front included
_MOST = {DIGITS: 9, DECIMAL: 15, NUMBER: 15, STARS: 12}
_POWERS = 10.0 ** np.arange(16)
_ZERO, _STAR, _SPACE, _TAB, _DOT, _MINUS, _PLUS = np.frombuffer(b"0* \t.-+", dtype=np.uint8)
_TRIES = 8  # shapes in a row that fit few texts, and the search is over


@dataclass(frozen=True, slots=True)
class Shape:
    """A text with holes: ``literals[0] hole literals[1] hole ... literals[-1]``."""

    literals: tuple[bytes, ...]
    kinds: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Filled:
    """n texts of one shape, and what fills their H holes."""

    which: IntArray  # (n,) numbers of the texts
    span: IntArray  # (n, H, 2) places, without the blanks in front
    value: Array  # (n, H) NaN for stars and texts


def padded(data: bytes | memoryview) -> Bytes:
    """The bytes, with room to look ahead behind the last."""
    out = np.zeros(len(data) + _PAD, dtype=np.uint8)
    out[: len(data)] = np.frombuffer(data, dtype=np.uint8)
    return out


def found(data: Bytes, start: int, end: int, is_start: Callable[[Bytes], BoolArray]) -> IntArray:
    """Places at which a test of a byte and the next is true; the test gets a chunk and one byte more."""
    places = [np.flatnonzero(is_start(data[at : min(at + _CHUNK, end) + 1])) + at for at in range(start, end, _CHUNK)]
    return np.concatenate(places) if places else np.zeros(0, dtype=np.int64)


def shape_of(data: bytes, start: int, end: int, holes: Iterable[Hole]) -> Shape | None:
    """The shape of one text, or None when its holes cannot be told from what follows them."""
    holes = list(holes)
    literals, at = [], start
    for _, first, last in holes:
        if first < at or last < first:
            return None
        literals.append(data[at:first])
        at = last
    literals.append(data[at:end])
    for (kind, *_), after in zip(holes, literals[1:]):
        if not after or (kind != TEXT and after[:1] in b"0123456789.+-*"):
            return None
    return Shape(tuple(literals), tuple(kind for kind, *_ in holes))


def sorted_out(
    data: Bytes, edge: IntArray, shape_at: Callable[[int], tuple[Shape, P] | None]
) -> list[tuple[P, Filled]]:
    """Texts of one shape together; texts that are left out fit none.

    Args:
        data: All bytes, ``padded``.
        edge: (N + 1,) where each of N texts begins, and where the last one ends.
        shape_at: Shape of the text of a number, with anything the caller wants back; None when it has none.
    """
    groups = []
    left = np.arange(len(edge) - 1)
    tries = 0
    while len(left) and tries < _TRIES:
        chosen = int(left[len(left) * (2 * tries + 1) // (2 * _TRIES)])
        known = shape_at(chosen)
        filled = None if known is None else fill(data, edge, left, known[0])
        if known is None or filled is None or chosen not in filled.which:
            tries += 1
            left = left[left != chosen]
            continue
        groups.append((known[1], filled))
        tries = 0 if len(filled.which) > len(left) // 64 else tries + 1
        rest = np.ones(len(edge), dtype=bool)
        rest[filled.which] = False
        left = left[rest[left]]
    return groups


def only(filled: Filled, met: BoolArray) -> Filled:
    """Those texts of a shape whose number is marked."""
    keep = met[filled.which]
    return filled if keep.all() else Filled(filled.which[keep], filled.span[keep], filled.value[keep])


def fill(data: Bytes, edge: IntArray, which: IntArray, shape: Shape) -> Filled:
    """Which of some texts have a shape, and what fills it."""
    parts = [_fill(data, edge, which[i : i + _ROWS], shape) for i in range(0, len(which), _ROWS)]
    return Filled(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("which", "span", "value")))


def _fill(data: Bytes, edge: IntArray, which: IntArray, shape: Shape) -> Filled:
    length = edge[which + 1] - edge[which]
    which = which[length >= sum(map(len, shape.literals)) + sum(kind != TEXT for kind in shape.kinds)]
    at = edge[which]
    span = np.zeros((len(which), len(shape.kinds), 2), dtype=np.int64)
    value = np.full((len(which), len(shape.kinds)), np.nan)
    for hole, literal in enumerate(shape.literals):
        if literal:
            same = windows(data, at, len(literal)) == np.frombuffer(literal, dtype=np.uint8)
            if not same.all():
                keep = same.all(axis=1)
                at, which, span, value = at[keep], which[keep], span[keep], value[keep]
            at = at + len(literal)
        if hole < len(shape.kinds) and len(at):
            kind = shape.kinds[hole]
            if kind == TEXT:
                length, keep = _text(windows(data, at, _WIDTH[kind]), shape.literals[hole + 1][0])
                blanks, number = np.zeros_like(length), np.full(len(at), np.nan)
            else:
                blanks, length, number, keep = _number(windows(data, at, _WIDTH[kind]), kind)
            span[:, hole, 0], span[:, hole, 1], value[:, hole] = at + blanks, at + length, number
            at = at + length
            if not keep.all():
                at, which, span, value = at[keep], which[keep], span[keep], value[keep]
    keep = at == edge[which + 1]
    return Filled(which[keep], span[keep], value[keep])


def windows(data: Bytes, at: IntArray, width: int) -> Bytes:
    """The bytes from places on, (N, width); near the end of the data the row of a text that ends before is wrong."""
    if width > len(data):
        return np.zeros((len(at), width), dtype=np.uint8)
    every = np.ndarray((len(data) - width + 1, width), np.uint8, data, 0, (1, 1))
    return np.asarray(every[np.minimum(at, len(data) - width)])


def _text(window: Bytes, after: int) -> tuple[IntArray, BoolArray]:
    """Length of the text before a character, and whether it is there, with no end of line or statement before it."""
    stop = (window == after) | (window == 10) | (window == 13) | (window == 0) | (window == ord(";"))
    length = stop.argmax(axis=1)
    return length, window[np.arange(len(window)), length] == after


def _number(window: Bytes, kind: int) -> tuple[IntArray, IntArray, Array, BoolArray]:
    """Blanks in front, length with them, value, and whether it is a number of the kind; exact to the last bit."""
    rows = len(window)
    value, decimals = np.zeros(rows, dtype=np.int64), np.zeros(rows, dtype=np.int64)
    blanks, length, digits = (np.zeros(rows, dtype=np.int64) for _ in range(3))
    begun, dotted, below = (np.zeros(rows, dtype=bool) for _ in range(3))
    going = np.ones(rows, dtype=bool)
    for character in np.ascontiguousarray(window.T):
        digit = character - _ZERO  # wraps
        is_digit = going & ((character == _STAR) if kind == STARS else (digit < 10))
        blank = going & ~begun & ((character == _SPACE) | (character == _TAB))
        going &= is_digit | blank | (_decimal_mark(character, kind, begun, dotted))
        if kind in (DECIMAL, NUMBER):
            dot = going & (character == _DOT)
            decimals += is_digit & dotted
            dotted |= dot
            below |= going & (character == _MINUS)
        begun |= going & ~blank
        value = np.where(is_digit, value * 10 + digit, value)
        digits += is_digit
        blanks += blank
        length += going
        if not going.any():
            break
    keep = ~going & (digits >= 1) & (digits <= _MOST[kind])
    number = value / _POWERS[np.minimum(decimals, len(_POWERS) - 1)]  # both exact, so rounded once
    return blanks, length, np.where(below, -number, number) if kind != STARS else np.full(rows, np.nan), keep


def _decimal_mark(character: Bytes, kind: int, begun: BoolArray, dotted: BoolArray) -> BoolArray:
    """A point, the first; a sign, in front."""
    none = np.zeros(len(character), dtype=bool)
    dot = (character == _DOT) & ~dotted if kind in (DECIMAL, NUMBER) else none
    sign = ((character == _MINUS) | (character == _PLUS)) & ~begun if kind == NUMBER else none
    return np.asarray(dot | sign)


def texts(data: Bytes, span: IntArray) -> list[str]:
    """The text at each place (N, 2); equal texts are one object. They hold no zero byte and no end of line."""
    if len(span) == 0:
        return []
    start, end = span.T
    parts: list[str] = []
    for first in range(0, len(span), _ROWS):
        here = slice(first, first + _ROWS)
        width = int((end[here] - start[here]).max()) + 1
        window = windows(data, start[here], width).copy()
        column = np.arange(width)
        length = (end[here] - start[here])[:, None]
        window[column > length] = 0
        window[column == length] = 10
        rows, which = different(window)
        flat = window[rows].ravel()
        said = flat[flat != 0].tobytes().decode("latin-1").split("\n")
        parts += [said[k] for k in which.tolist()]
    return parts
