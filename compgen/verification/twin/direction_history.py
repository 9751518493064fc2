r"""The direction of motion that the twin keeps of what it has executed, sample by sample.

Joint i that turns by d theta takes its side u_i towards the side it moves to (Dahl 1968), over the width w_i; the TCP's
direction of travel t follows the unit vector e along its path over a width W:

    du_i = (sign(d theta_i) - u_i) |d theta_i| / w_i,      dt = (e - t) ds / W

or, by the law "play", u_i follows theta_i / w_i until it meets -1 or 1 and stays there. Over a step of the first kind
each is x_{m+1} = k_m x_m + (1 - k_m) goal_m with k_m = exp(-|step| / width). Nothing is known before the
first sample: both begin at zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from compgen.core.arrays import Array


@dataclass(frozen=True, eq=False, slots=True)
class DirectionHistory:
    """What a motion leaves for the samples after it."""

    theta: Array | None = None  # (6,) [rad] commanded last
    position: Array | None = None  # (3,) [m] last of the TCP where it was believed
    side: Array = field(default_factory=lambda: np.zeros(6))  # u
    travel: tuple[Array, ...] = ()  # t, (3,) for the width of each measured axis


def joint_side(theta: Array, width: Array, start: Array, law: str = "dahl") -> Array:
    """u of each joint at samples, from ``start`` (6,) at the first of them, (M, 6) [-1, 1]."""
    step = np.diff(theta, axis=0)
    if law == "play":
        return _between_stops(step / width, start)
    keep = np.exp(-np.abs(step) / width)
    return recurrence(keep, (1 - keep) * np.sign(step), start)


def travel_direction(position: Array, width: float, start: Array) -> Array:
    """t at samples of the TCP (M, 3) [m], from ``start`` (3,) at the first of them, (M, 3) [-1, 1]."""
    step = np.diff(position, axis=0)
    length = np.sqrt((step**2).sum(axis=1, keepdims=True))
    keep = np.exp(-length / width)
    return recurrence(keep, (1 - keep) * step / np.maximum(length, 1e-30), start)


def recurrence(keep: Array, gain: Array, start: Array) -> Array:
    """x_{m+1} = keep_m x_m + gain_m from x_0 = start, for all m at once, (M - 1, k) to (M, k).

    The steps are parted into about as many stretches as a stretch has steps. All are walked side by side, each from
    zero; then each gets what it begins with, faded by the product of its ``keep``.
    """
    factor, offset = _stretches(np.broadcast_to(keep, gain.shape), 1.0), _stretches(gain, 0.0)
    for n in range(1, factor.shape[1]):
        offset[:, n] += factor[:, n] * offset[:, n - 1]
        factor[:, n] *= factor[:, n - 1]
    return _one_after_the_other(lambda begin, k: factor[k] * begin + offset[k], start, factor.shape)[: len(gain) + 1]


def _between_stops(step: Array, start: Array) -> Array:
    """A pointer pushed by steps (M - 1, k) between stops at -1 and 1, from ``start`` (k,), (M, k).

    Stretches are walked side by side by two pointers, from either stop, and by one without stops; a pointer that begins
    in between is where the free one has taken it, unless that is beyond the two.
    """
    pushes = _stretches(step, 0.0)
    lower, upper, free = (np.empty_like(pushes) for _ in range(3))
    pointers = [np.full_like(pushes[:, 0], place) for place in (-1.0, 1.0, 0.0)]
    for n in range(pushes.shape[1]):
        pointers = [pointer + pushes[:, n] for pointer in pointers]
        pointers[:2] = [np.minimum(np.maximum(pointer, -1.0), 1.0) for pointer in pointers[:2]]
        lower[:, n], upper[:, n], free[:, n] = pointers

    def walked(begin: Array, k: int) -> Array:
        return np.asarray(np.minimum(np.maximum(begin + free[k], lower[k]), upper[k]))

    return _one_after_the_other(walked, start, pushes.shape)[: len(step) + 1]


def _stretches(rows: Array, fill: float) -> Array:
    """Rows (M, k) parted into about as many stretches as a stretch has rows, (stretch, row, k), the last filled up."""
    steps, width = rows.shape
    size = max(1, int(np.sqrt(steps)))
    count = -(-steps // size)
    filled = np.full((count * size, width), fill)
    filled[:steps] = rows
    return filled.reshape(count, size, width)


def _one_after_the_other(walked: Callable[[Array, int], Array], start: Array, shape: tuple[int, ...]) -> Array:
    """States of all stretches, each ``walked`` from where the one before has ended, behind ``start`` (k,)."""
    states, begin = np.empty(shape), start
    for k in range(len(states)):
        states[k] = walked(begin, k)
        begin = states[k, -1]
    return np.vstack([start, states.reshape(-1, shape[-1])])
