r"""What smoothness costs: weights, lengths and the pentadiagonal matrix of the correction's quadratic cost.

    sum_n ds_n [ |W e_n|^2 + l1 |W c'_n|^2 + l2 |W c''_n|^2 ],      l1 = (L1 / 2 pi)^2,      l2 = (L2 / 2 pi)^4

' = d/ds by divided differences D1 and D2 between waypoints; c'' is not taken across a stop. l1 and l2 halve what has a
period of L1 or L2 along the path and leave what is longer. W makes an angle count as the distance it moves a point one
lever away.
"""

import numpy as np

from compgen.compensation.problem import Settings
from compgen.core.arrays import Array, BoolArray

MIN_SEGMENT = 1e-6  # m: shorter segments are as stiff as this one, else their stiffness drowns everything else


def component_weights(settings: Settings) -> Array:
    """W, (6,) [-] for position and [m/rad] for rotation; a free spin keeps a trace, so that it stays determined."""
    w = np.array([1.0, 1.0, 1.0, *3 * [settings.lever]])
    w[5] *= 1e-4 if settings.free_spin else 1.0
    return w


def waypoint_lengths(arc: Array) -> Array:
    """ds_n: the length of path that a waypoint stands for, (N,) [m]."""
    h = np.maximum(np.diff(arc), 1e-12)
    return np.asarray(np.concatenate([[h[0] / 2], (h[:-1] + h[1:]) / 2, [h[-1] / 2]]))


def smoothing_matrix(arc: Array, stop: BoolArray, settings: Settings, fidelity: float = 1.0) -> Array:
    """diag(ds) fidelity + l1 D1'D1 + l2 D2'D2 in upper banded form, (3, N)."""
    h = np.maximum(np.diff(arc), MIN_SEGMENT)
    N = len(arc)
    diagonal, first, second = waypoint_lengths(arc) * fidelity, np.zeros(N), np.zeros(N)
    k = (settings.rate_period / (2 * np.pi)) ** 2 / h
    diagonal[:-1] += k
    diagonal[1:] += k
    first[1:] -= k
    if N > 2:
        h0, h1 = h[:-1], h[1:]
        a, b, c = 2 / (h0 * (h0 + h1)), -2 / (h0 * h1), 2 / (h1 * (h0 + h1))
        k = (settings.curvature_period / (2 * np.pi)) ** 4 * (h0 + h1) / 2 * ~stop[1:-1]
        diagonal[:-2] += k * a * a
        diagonal[1:-1] += k * b * b
        diagonal[2:] += k * c * c
        first[1:-1] += k * a * b
        first[2:] += k * b * c
        second[2:] += k * a * c
    return np.array([second, first, diagonal])
