"""Texts of one template, many at a time: what the parser read in one text holds for all texts like it.

A template is a text with fields. Outside its fields a text must be the same byte for byte, so it means the same; only
the fields are read anew, by columns. A text that matches no template is left to the parser: nothing is guessed.
Texts are taken as windows onto a table of bytes, and compared by rows.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.decimals import Bytes
from compgen.core.unique_rows import unique_rows

#: Kinds of fields: a whole number, a decimal without and with a sign, stars (untaught), any text up to what follows.
DIGITS, DECIMAL, NUMBER, STARS, TEXT = range(5)
Described = TypeVar("Described")
Field = tuple[int, int, int]  # kind, first byte, behind the last; blanks in front of a number belong to the field

FEW_TEXTS = 1000  # texts: below it the parser is as quick
_ROWS = 8192  # texts at a time: they stay in cache
CHUNK = 1 << 16  # bytes at a time
_PAD = 80  # zero bytes behind the last text, so that a look ahead stays inside
_WIDTH = {DIGITS: 20, DECIMAL: 28, NUMBER: 28, STARS: 20, TEXT: 64}  # characters of a field, blanks in front included
_MOST_DIGITS = {DIGITS: 9, DECIMAL: 15, NUMBER: 15, STARS: 12}
_POWERS = 10.0 ** np.arange(16)
_ZERO, _STAR, _SPACE, _TAB, _DOT, _MINUS, _PLUS = np.frombuffer(b"0* \t.-+", dtype=np.uint8)
_TRIES = 8  # templates in a row that match few texts, and the search is over


@dataclass(frozen=True, slots=True)
class Template:
    """A text with fields: ``literals[0] field literals[1] field ... literals[-1]``."""

    literals: tuple[bytes, ...]
    kinds: tuple[int, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """n texts of one template with F fields."""

    which: IntArray  # (n,) numbers of the texts
    span: IntArray  # (n, F, 2) places, without the blanks in front
    value: Array  # (n, F) NaN for stars and texts


def padded(data: bytes | memoryview) -> Bytes:
    """The bytes, with room to look ahead behind the last."""
    out = np.zeros(len(data) + _PAD, dtype=np.uint8)
    out[: len(data)] = np.frombuffer(data, dtype=np.uint8)
    return out


def find_places(
    data: Bytes, start: int, end: int, is_start: Callable[[Bytes], BoolArray], chunk: int = CHUNK
) -> IntArray:
    """Places at which a test of a byte and the next is true; the test gets a chunk and one byte more."""
    places = [np.flatnonzero(is_start(data[at : min(at + chunk, end) + 1])) + at for at in range(start, end, chunk)]
    return np.concatenate(places) if places else np.zeros(0, dtype=np.int64)


def template_of(data: bytes, start: int, end: int, fields: Iterable[Field]) -> Template | None:
    """The template of one text, or None when the end of a field cannot be seen from what follows it."""
    fields = list(fields)
    literals, at = [], start
    for _, first, last in fields:
        if first < at or last < first:
            return None
        literals.append(data[at:first])
        at = last
    literals.append(data[at:end])
    for (kind, *_), after in zip(fields, literals[1:], strict=True):
        if not after or (kind != TEXT and after[:1] in b"0123456789.+-*"):
            return None
    return Template(tuple(literals), tuple(kind for kind, *_ in fields))


def group_by_template(
    data: Bytes, bounds: IntArray, template_at: Callable[[int], tuple[Template, Described] | None]
) -> list[tuple[Described, Matches]]:
    """Texts of one template together; texts that are left out match none.

    Args:
        data: All bytes, ``padded``.
        edge: (N + 1,) where each of N texts begins, and where the last one ends.
        template_at: Template of the text of a number, with anything the caller wants back; None when it has none.
    """
    groups = []
    rest = np.arange(len(bounds) - 1)
    failures = 0
    while len(rest) and failures < _TRIES:
        candidate = int(rest[len(rest) * (2 * failures + 1) // (2 * _TRIES)])
        described = template_at(candidate)
        matches = None if described is None else match_template(data, bounds, rest, described[0])
        if described is None or matches is None or candidate not in matches.which:
            failures += 1
            rest = rest[rest != candidate]
            continue
        groups.append((described[1], matches))
        failures = 0 if len(matches.which) > len(rest) // 64 else failures + 1
        unmatched = np.ones(len(bounds), dtype=bool)
        unmatched[matches.which] = False
        rest = rest[unmatched[rest]]
    return groups


def select(matches: Matches, marked: BoolArray) -> Matches:
    """Those texts of a template whose number is marked."""
    keep = marked[matches.which]
    return matches if keep.all() else Matches(matches.which[keep], matches.span[keep], matches.value[keep])


def match_template(data: Bytes, bounds: IntArray, which: IntArray, template: Template) -> Matches:
    """Which of some texts match a template, and their fields."""
    parts = [_match_rows(data, bounds, which[i : i + _ROWS], template) for i in range(0, len(which), _ROWS)]
    return Matches(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("which", "span", "value")))


def _match_rows(data: Bytes, bounds: IntArray, which: IntArray, template: Template) -> Matches:
    length = bounds[which + 1] - bounds[which]
    which = which[length >= sum(map(len, template.literals)) + sum(kind != TEXT for kind in template.kinds)]
    at = bounds[which]
    span = np.zeros((len(which), len(template.kinds), 2), dtype=np.int64)
    value = np.full((len(which), len(template.kinds)), np.nan)
    for field, literal in enumerate(template.literals):
        if literal:
            same = byte_windows(data, at, len(literal)) == np.frombuffer(literal, dtype=np.uint8)
            if not same.all():
                keep = same.all(axis=1)
                at, which, span, value = at[keep], which[keep], span[keep], value[keep]
            at = at + len(literal)
        if field < len(template.kinds) and len(at):
            kind = template.kinds[field]
            if kind == TEXT:
                length, keep = _match_text(byte_windows(data, at, _WIDTH[kind]), template.literals[field + 1][0])
                blanks, number = np.zeros_like(length), np.full(len(at), np.nan)
            else:
                blanks, length, number, keep = _match_number(byte_windows(data, at, _WIDTH[kind]), kind)
            span[:, field, 0], span[:, field, 1], value[:, field] = at + blanks, at + length, number
            at = at + length
            if not keep.all():
                at, which, span, value = at[keep], which[keep], span[keep], value[keep]
    keep = at == bounds[which + 1]
    return Matches(which[keep], span[keep], value[keep])


def _match_text(window: Bytes, after: int) -> tuple[IntArray, BoolArray]:
    """Length of the text before a character, and whether it is there, with no end of line or statement before it."""
    stop = (window == after) | (window == 10) | (window == 13) | (window == 0) | (window == ord(";"))
    length = stop.argmax(axis=1)
    return length, window[np.arange(len(window)), length] == after


def _match_number(window: Bytes, kind: int) -> tuple[IntArray, IntArray, Array, BoolArray]:
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
    keep = ~going & (digits >= 1) & (digits <= _MOST_DIGITS[kind])
    number = value / _POWERS[np.minimum(decimals, len(_POWERS) - 1)]  # both exact, so rounded once
    return blanks, length, np.where(below, -number, number) if kind != STARS else np.full(rows, np.nan), keep


def _decimal_mark(character: Bytes, kind: int, begun: BoolArray, dotted: BoolArray) -> BoolArray:
    """A point, the first; a sign, in front."""
    none = np.zeros(len(character), dtype=bool)
    dot = (character == _DOT) & ~dotted if kind in (DECIMAL, NUMBER) else none
    sign = ((character == _MINUS) | (character == _PLUS)) & ~begun if kind == NUMBER else none
    return np.asarray(dot | sign)


def decode_texts(data: Bytes, span: IntArray) -> list[str]:
    """The text at each place (N, 2); equal texts are one object. They hold no zero byte and no end of line."""
    if len(span) == 0:
        return []
    start, end = span.T
    parts: list[str] = []
    for first in range(0, len(span), _ROWS):
        rows = slice(first, first + _ROWS)
        width = int((end[rows] - start[rows]).max()) + 1
        window = byte_windows(data, start[rows], width).copy()
        column = np.arange(width)
        length = (end[rows] - start[rows])[:, None]
        window[column > length] = 0
        window[column == length] = 10
        kinds, which = unique_rows(window)
        flat = window[kinds].ravel()
        kind_texts = flat[flat != 0].tobytes().decode("latin-1").split("\n")
        parts += [kind_texts[k] for k in which.tolist()]
    return parts


def byte_windows(data: bytes | Bytes, at: IntArray, width: int) -> Bytes:
    """The bytes from places on, (N, width); a view when the places are evenly spaced.

    Near the end of the data the row of a text that ends before is wrong.
    """
    last = len(data) - width
    if last < 0:
        return np.zeros((len(at), width), dtype=np.uint8)
    all_windows = np.ndarray((last + 1, width), np.uint8, data, 0, (1, 1))
    step = int(at[1] - at[0]) if len(at) > 1 else 0
    if step > 0 and at[-1] <= last and (at[1:] - at[:-1] == step).all():
        return all_windows[at[0] : at[-1] + 1 : step]
    return np.asarray(all_windows[np.minimum(at, last)])
