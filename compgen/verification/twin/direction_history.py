r"""The direction of motion that the twin keeps of what it has executed, sample by sample.

Joint i that turns by d theta takes its side u_i towards the side it moves to (Dahl 1968), over the width w_i; the TCP's
direction of travel t follows the unit vector e along its path over a width W:

    du_i = (sign(d theta_i) - u_i) |d theta_i| / w_i,      dt = (e - t) ds / W

Over a step each is x_{m+1} = k_m x_m + (1 - k_m) goal_m with k_m = exp(-|step| / width). Nothing is known before the
first sample: both begin at zero.
"""

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


def joint_side(theta: Array, width: Array, start: Array) -> Array:
    """u of each joint at samples, from ``start`` (6,) at the first of them, (M, 6) [-1, 1]."""
    step = np.diff(theta, axis=0)
    keep = np.exp(-np.abs(step) / width)
    return _recurrence(keep, (1 - keep) * np.sign(step), start)


def travel_direction(position: Array, width: float, start: Array) -> Array:
    """t at samples of the TCP (M, 3) [m], from ``start`` (3,) at the first of them, (M, 3) [-1, 1]."""
    step = np.diff(position, axis=0)
    length = np.sqrt((step**2).sum(axis=1, keepdims=True))
    keep = np.exp(-length / width)
    return _recurrence(keep, (1 - keep) * step / np.maximum(length, 1e-30), start)


def _recurrence(keep: Array, gain: Array, start: Array) -> Array:
    """x_{m+1} = keep_m x_m + gain_m from x_0 = start, for all m at once, (M - 1, k) to (M, k).

    The steps are parted into about as many stretches as a stretch has steps. All are walked side by side, each from
    zero; then each gets what it begins with, faded by the product of its ``keep``.
    """
    steps, width = gain.shape
    size = max(1, int(np.sqrt(steps)))
    count = -(-steps // size)
    factor, offset = np.ones((count * size, width)), np.zeros((count * size, width))
    factor[:steps], offset[:steps] = keep, gain
    factor, offset = factor.reshape(count, size, width), offset.reshape(count, size, width)
    for n in range(1, size):
        offset[:, n] += factor[:, n] * offset[:, n - 1]
        factor[:, n] *= factor[:, n - 1]
    states = np.empty((count, size, width))
    begin = start
    for k in range(count):
        states[k] = factor[k] * begin + offset[k]
        begin = states[k, -1]
    return np.vstack([start, states.reshape(-1, width)[:steps]])
