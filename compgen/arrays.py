"""Arrays that own their data: copied, checked for shape, read-only."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]
Owned = TypeVar("Owned", Array, BoolArray, IntArray)


def own(owner: Any, **shapes: tuple[int | str, ...]) -> None:
    """Make the named fields of a frozen dataclass read-only copies of the stated shape.

    A letter stands for a length that must agree wherever it occurs in one call.

    Raises:
        ValueError: A field has another shape.
    """
    lengths: dict[str, int] = {}
    for name, shape in shapes.items():
        given = getattr(owner, name)
        done = isinstance(given, np.ndarray) and given.flags.owndata and not given.flags.writeable
        value = given if done else np.array(given)
        if value.dtype.kind not in "bi":
            value = value.astype(float, copy=False)
        want = tuple(lengths.setdefault(s, n) if isinstance(s, str) else s for s, n in zip(shape, value.shape))
        if len(shape) != value.ndim or want != value.shape:
            raise ValueError(f"{type(owner).__name__}.{name}: shape {value.shape}, expected {shape}")
        value.flags.writeable = False
        object.__setattr__(owner, name, value)


def frozen(a: Owned) -> Owned:
    """The same array made read-only, for handing it over to an owner without a copy."""
    whole = a if a.flags.owndata else a.copy()
    whole.flags.writeable = False
    return whole


def dot(a: Array, b: Array) -> Array:
    """Row by row inner product, (N, k) with (N, k) to (N,)."""
    return np.asarray(np.einsum("...i,...i->...", a, b))


def norm(a: Array) -> Array:
    """Length of each row, (N, k) to (N,)."""
    return np.asarray(np.sqrt(np.einsum("...i,...i->...", a, a)))


def unit(a: Array) -> Array:
    """Rows scaled to length one."""
    return np.asarray(a / np.linalg.norm(a, axis=-1, keepdims=True))
