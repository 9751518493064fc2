"""The kinds of rows of a long table, by hashes: quicker than sorting where there are few kinds.

And values by their keys, for a few of Python's own.
"""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from compgen.core.arrays import IntArray

K = TypeVar("K")
V = TypeVar("V")
_MULTIPLIER, _SHIFT = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)  # the golden ratio's bits
_FEW_KINDS = 16  # kinds of rows that are picked out one after the other


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """The values of each key, keys and values in the order in which they come."""
    groups: dict[K, list[V]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


def unique_rows(rows: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Indices of the first of each kind of row, and the kind of each row.

    Rows are compared by a hash of their bytes, eight at a time; that it had no collision is checked.
    """
    if not len(rows):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    flat = np.ascontiguousarray(rows).reshape(len(rows), -1).view(np.uint8)
    padded = np.zeros((len(rows), -(-flat.shape[1] // 8) * 8), dtype=np.uint8)
    padded[:, : flat.shape[1]] = flat
    words = padded.view(np.uint64)
    first, which = unique_keys(hash_rows(words.T))
    if not np.array_equal(words, words[first][which]):
        _, first, which = np.unique(words, axis=0, return_index=True, return_inverse=True)
    return first, which.ravel()


def hash_rows(columns: Iterable[NDArray[np.uint64]]) -> NDArray[np.uint64]:
    """A hash of the words of each row, (N,)."""
    total = np.zeros(1, dtype=np.uint64)
    for column in columns:
        total = (total ^ column) * _MULTIPLIER
        total ^= total >> _SHIFT  # the last characters too come to bear on every bit
    return total


def unique_keys(key: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Indices of the first of each kind of key, and the kind of each key.

    Mostly there are few kinds, or one: they are picked out one by one, and only the remaining keys are sorted.
    """
    which = np.zeros(len(key), dtype=np.int64)
    if len(key) and (key == key[0]).all():
        return which[:1].copy(), which
    remaining, first = np.arange(len(key)), list[int]()
    while len(remaining) and len(first) < _FEW_KINDS:
        equal = key == key[len(key) // 2]
        which[remaining[equal]] = len(first)
        first.append(int(remaining[equal.argmax()]))
        remaining, key = remaining[~equal], key[~equal]
    _, other_rows, other_kinds = np.unique(key, return_index=True, return_inverse=True)
    which[remaining] = other_kinds + len(first)
    return np.concatenate([np.array(first, dtype=np.int64), remaining[other_rows]]), which
