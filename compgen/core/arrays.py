"""Arrays that own their data: copied, checked for shape, read-only."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from compgen.core.exceptions import ShapeError

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
AnyArray = TypeVar("AnyArray", bound=NDArray[Any])
Record = TypeVar("Record")


def own(owner: Any, **shapes: tuple[int | str, ...]) -> None:
    """Make the named fields of a frozen dataclass read-only copies of the stated shape.

    A letter stands for a length that must agree wherever it occurs in one call. Booleans and integers keep their kind,
    all else becomes float; an array that is ``frozen`` already is kept without a copy.

    Raises:
        ShapeError: A field has another shape, or is no array of numbers.
    """
    lengths: dict[str, int] = {}
    for name, shape in shapes.items():
        value = getattr(owner, name)
        try:
            array = value if isinstance(value, np.ndarray) and _is_frozen(value) else np.array(value)
            if array.dtype.kind not in "bi":
                array = array.astype(float, copy=False)
        except (ValueError, TypeError):
            raise ShapeError(f"{type(owner).__name__}.{name}: no array of numbers of shape {shape}; give one") from None
        fits = len(shape) == array.ndim
        for length, n in zip(shape, array.shape, strict=False):
            fits &= n == (lengths.setdefault(length, n) if isinstance(length, str) else length)
        if not fits:
            raise ShapeError(f"{type(owner).__name__}.{name}: shape {array.shape}, expected {shape}")
        array.flags.writeable = False
        object.__setattr__(owner, name, array)


def owns(**shapes: tuple[int | str, ...]) -> Callable[[type[Record]], type[Record]]:
    """Decorate a class, below ``@dataclass``, so that its records ``own`` the named fields."""

    def decorate(record: type[Record]) -> type[Record]:
        record.__post_init__ = lambda self: own(self, **shapes)  # type: ignore[attr-defined]
        return record

    return decorate


def frozen(a: AnyArray) -> AnyArray:
    """An array made read-only, for handing it over to an owner without a copy; a part of a larger array is copied."""
    owner = _owner(a)
    if owner is None:
        a = owner = a.copy()
    owner.flags.writeable = a.flags.writeable = False
    return a


def _owner(a: NDArray[Any]) -> NDArray[Any] | None:
    """The array that owns these data: itself, or the one it is another shape of; None for a part of a larger array."""
    owner = a if a.flags.owndata else a.base
    return owner if isinstance(owner, np.ndarray) and owner.flags.owndata and owner.size == a.size else None


def _is_frozen(a: NDArray[Any]) -> bool:
    """Whether nobody can write to these data any more."""
    owner = _owner(a)
    return owner is not None and not a.flags.writeable and not owner.flags.writeable


def dot(a: Array, b: Array) -> Array:
    """Inner product of each row, (..., k) with (..., k) to (...)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def norm(a: Array) -> Array:
    """Euclidean norm of each row, (..., k) to (...)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", a, a)))


def rms(values: Array, weight: Array | None = None) -> float:
    """Root of the mean square; with a weight, as the length that each value stands for, of the weighted mean."""
    if weight is None:
        return float(np.sqrt(np.mean(values**2)))
    square = values * values
    square *= weight
    return float(np.sqrt(np.sum(square) / np.sum(weight)))


def covariance_root(covariance: Array) -> Array:
    """Columns F of a covariance F F^T, by its eigenvectors, (K, K)."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def row_norms(a: Array, rows: int = 8192) -> Array:
    """Euclidean norm of many short rows, (N, k) to (N,): column by column over blocks that stay in cache.

    Its last digit may differ from that of ``norm``, which adds the squares in another order.
    """
    norms = np.empty(len(a))
    for start in range(0, len(a), rows):
        block, block_norms = a[start : start + rows], norms[start : start + rows]
        np.multiply(block[:, 0], block[:, 0], out=block_norms)
        for column in block.T[1:]:
            block_norms += column * column
        np.sqrt(block_norms, out=block_norms)
    return norms


def cumulated(steps: Array) -> Array:
    """What steps, row by row, have come to before the first and behind each, M in all to (M + 1,) from 0."""
    return np.concatenate([[0.0], np.cumsum(steps)])


def lengths_along(place: Array) -> Array:
    """Length of the way from the first place to each, along the chords between them, (M, k) to (M,)."""
    return cumulated(step_lengths(place))


def step_lengths(a: Array, rows: int = 8192) -> Array:
    """Distance of each row from the next, (N, k) to (N - 1,)."""
    parts = [row_norms(np.diff(a[start : start + rows + 1], axis=0)) for start in range(0, len(a) - 1, rows)]
    return np.concatenate([np.zeros(0), *parts])


def column_extremes(a: Array) -> tuple[Array, Array]:
    """Lowest and highest of each column, (N, k) to (k,) each; column by column is many times as fast as ``axis=0``."""
    return np.array([column.min() for column in a.T]), np.array([column.max() for column in a.T])


def interpolated(at: Array | IntArray, x: Array | IntArray, rows: Array) -> Array:
    """Rows (N, K) that stand at rising x (N,), at other places, (M, K): straight between, beyond the ends as there."""
    return np.column_stack([np.interp(at, x, column) for column in rows.T])


def numbered(counts: IntArray) -> tuple[IntArray, IntArray]:
    """The group of every member of K groups with so many each, (K,), and its number in it from 0, (M,) each."""
    group = np.repeat(np.arange(len(counts)), counts)
    return group, np.arange(len(group)) - np.repeat(np.cumsum(counts) - counts, counts)


def exchanged(count: int, a: int, b: int) -> IntArray:
    """The numbers below a count with two of them in each other's place, (count,)."""
    order = np.arange(count)
    order[[a, b]] = b, a
    return order


def thinned(rows: IntArray, most: int) -> IntArray:
    """Rows evenly left out until there are fewer than twice as many as asked for, (N,)."""
    return rows[:: max(1, len(rows) // most)]


def first_true(rows: BoolArray) -> int | None:
    """The first row that is true, (N,); None where none is."""
    return int(np.argmax(rows)) if rows.any() else None


def bisected(low: IntArray, high: IntArray, holds: Callable[[IntArray, IntArray], BoolArray]) -> IntArray:
    """The largest numbers up to ``high`` that hold, where ``low`` does, (N,), by bisection of all rows at once.

    Args:
        low: Changed in place to what is found.
        high: Changed as well.
        holds: Of some rows (M,) and a number for each of them: whether it holds.
    """
    rows = np.flatnonzero(low < high)
    while len(rows):
        middle = (low[rows] + high[rows] + 1) // 2
        good = holds(rows, middle)
        low[rows[good]] = middle[good]
        high[rows[~good]] = middle[~good] - 1
        rows = rows[low[rows] < high[rows]]
    return low


def nine_digits(value: float) -> float:
    """A number to the nine digits that a file of ours gives it."""
    return float(f"{value:.9g}")


def unit(a: Array) -> Array:
    """Rows scaled to length one, (..., k)."""
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))
