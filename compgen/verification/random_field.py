r"""An error of which only its size is known: a smooth random field over the cell, for draws of whole paths.

What no quantity explains (fit noise, what the thermal physics misses) has a size at each waypoint and no direction. Two
waypoints side by side share it, two at either end of a part do not. Component i of a draw is

    z_i(p) = sqrt(2 / F) sum_f cos(w_if . p + b_if),     w_if ~ N(0, I / L^2),  b_if ~ U(0, 2 pi)

F random waves of a field of unit variance with E[z(p) z(q)] = exp(-|p - q|^2 / (2 L^2)) (Rahimi and Recht 2007).
L is assumed: half a metre, over which the cold error maps of arms of this size turn.
"""

import numpy as np

from compgen.core.arrays import Array

LENGTH = 0.5  # m, over which the field changes
WAVES = 64


def field_correlation(one: Array, other: Array) -> Array:
    """E[z(p) z(q)] between places (M, 3) and (T, 3) [m], (M, T)."""
    square = ((one[:, None] - other[None]) ** 2).sum(axis=2)
    return np.asarray(np.exp(-square / (2 * LENGTH**2)))


def random_field(rng: np.random.Generator, position: Array) -> Array:
    """One draw of the field at places (M, 3) [m], (M, 3) of unit variance."""
    frequency = rng.standard_normal((3, WAVES, 3)) / LENGTH
    phase = rng.uniform(0, 2 * np.pi, (3, WAVES))
    sums = [np.cos(position @ w.T + b).sum(axis=1) for w, b in zip(frequency, phase, strict=True)]
    return np.asarray(np.column_stack(sums) * np.sqrt(2 / WAVES))
