"""Arrays that own their data: copied, checked for shape, read-only."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Some = TypeVar("Some", bound=NDArray[Any])


def own(owner: Any, **shapes: tuple[int | str, ...]) -> None:
    """Make the named fields of a frozen dataclass read-only copies of the stated shape.

    A letter stands for a length that must agree wherever it occurs in one call.

    Raises:
        ValueError: A field has another shape.
    """
    lengths: dict[str, int] = {}
    for name, shape in shapes.items():
        given = getattr(owner, name)
        done = isinstance(given, np.ndarray) and _settled(given)
        value = given if done else np.array(given)
        if value.dtype.kind not in "bi":
            value = value.astype(float, copy=False)
        want = tuple(lengths.setdefault(s, n) if isinstance(s, str) else s for s, n in zip(shape, value.shape))
        if len(shape) != value.ndim or want != value.shape:
            raise ValueError(f"{type(owner).__name__}.{name}: shape {value.shape}, expected {shape}")
        value.flags.writeable = False
        object.__setattr__(owner, name, value)


def frozen(a: Some) -> Some:
    """The same array made read-only, for handing it over to an owner without a copy."""
    owner = _owner(a)
    if owner is None:
        a = owner = a.copy()
    owner.flags.writeable = a.flags.writeable = False
    return a


def _owner(a: NDArray[Any]) -> NDArray[Any] | None:
    """The array whose data these are: itself, or what it is another shape of; None when it is a part of something."""
    whole = a if a.flags.owndata else a.base
    return whole if isinstance(whole, np.ndarray) and whole.flags.owndata and whole.size == a.size else None


def _settled(a: NDArray[Any]) -> bool:
    """Whether nobody writes to these data any more."""
    whole = _owner(a)
    return whole is not None and not a.flags.writeable and not whole.flags.writeable


def dot(a: Array, b: Array) -> Array:
    """Row by row inner product, (N, k) with (N, k) to (N,)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def norm(a: Array) -> Array:
    """Length of each row, (N, k) to (N,)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", a, a)))


def row_norms(a: Array, rows: int = 8192) -> Array:
    """``norm`` of many short rows, column by column over blocks that stay in cache, (N, k) to (N,)."""
    out = np.empty(len(a))
    for at in range(0, len(a), rows):
        block, size = a[at : at + rows], out[at : at + rows]
        np.multiply(block[:, 0], block[:, 0], out=size)
        for column in block.T[1:]:
            size += column * column
        np.sqrt(size, out=size)
    return out


def step_lengths(a: Array, rows: int = 8192) -> Array:
    """Distance of each row from the next, (N, k) to (N - 1,)."""
    parts = [row_norms(np.diff(a[at : at + rows + 1], axis=0)) for at in range(0, len(a) - 1, rows)]
    return np.concatenate([np.zeros(0), *parts])


def column_extremes(a: Array) -> tuple[Array, Array]:
    """Lowest and highest of each column, (N, k) to (k,) each; column by column is many times as fast as ``axis=0``."""
    return np.array([column.min() for column in a.T]), np.array([column.max() for column in a.T])


def unit(a: Array) -> Array:
    """Rows scaled to length one."""
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))
