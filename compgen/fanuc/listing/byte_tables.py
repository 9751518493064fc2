"""Tables of bytes: windows onto a text, words of its columns, and which rows are the same."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.core.arrays import IntArray
from compgen.core.decimals import Bytes

_SPREAD, _HALF = np.uint64(0x9E3779B97F4A7C15), np.uint64(29)  # the golden ratio's bits
_TRIES = 16  # kinds of rows that are picked out one after the other


def windows(data: bytes | Bytes, at: IntArray, width: int) -> Bytes:
    """The bytes from places on, (N, width); a view when the places are evenly spaced."""
    every = np.ndarray((len(data) - width + 1, width), np.uint8, data, 0, (1, 1))
    step = int(at[1] - at[0]) if len(at) > 1 else 1
    if step > 0 and (at[1:] - at[:-1] == step).all():
        return every[at[0] : at[-1] + 1 : step]
    return np.asarray(every[at])


def different(rows: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Numbers of rows that stand for all, and which of them each row equals.

    Rows are told apart by a number made of their bytes, eight at a time; that this sufficed is checked.
    """
    if not len(rows):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    flat = np.ascontiguousarray(rows).reshape(len(rows), -1).view(np.uint8)
    padded = np.zeros((len(rows), -(-flat.shape[1] // 8) * 8), dtype=np.uint8)
    padded[:, : flat.shape[1]] = flat
    words = padded.view(np.uint64)
    first, which = told_apart(mixed(words.T))
    if not np.array_equal(words, words[first][which]):
        _, first, which = np.unique(words, axis=0, return_index=True, return_inverse=True)
    return first, which.ravel()


def mixed(columns: Iterable[NDArray[np.uint64]]) -> NDArray[np.uint64]:
    """One number a row that hardly ever is the same for different words, (N,)."""
    total = np.zeros(1, dtype=np.uint64)
    for column in columns:
        total = (total ^ column) * _SPREAD
        total ^= total >> _HALF  # the last characters too come to bear on every bit
    return total


def told_apart(key: NDArray[Any]) -> tuple[IntArray, IntArray]:
    """Numbers of rows that stand for all, and which of them each row equals, by one number a row.

    Mostly there are few kinds, or one: they are picked out one by one, and only what is left is sorted.
    """
    which = np.zeros(len(key), dtype=np.int64)
    if len(key) and (key == key[0]).all():
        return which[:1].copy(), which
    left, first = np.arange(len(key)), list[int]()
    while len(left) and len(first) < _TRIES:
        alike = key == key[len(key) // 2]
        which[left[alike]] = len(first)
        first.append(int(left[alike.argmax()]))
        left, key = left[~alike], key[~alike]
    _, rest, others = np.unique(key, return_index=True, return_inverse=True)
    which[left] = others + len(first)
    return np.concatenate([np.array(first, dtype=np.int64), left[rest]]), which
