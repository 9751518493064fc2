"""Small expressions that several sources need; numbers or SX alike, and exact zeros leave no trace."""

from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.rotations import rotation_matrix
from compgen.robot.kinematics import is_zero

TERMS = 12  # of the sine series below: 1e-12 up to half a turn


def plus(value: Any, change: Any) -> Any:
    """value + change; ``value`` itself when the change is exactly zero."""
    return value if is_zero(change) else value + change


def entries(value: Any, count: int) -> list[Any]:
    """The entries of a vector, numbers as float."""
    return [value[i] if isinstance(value, ca.SX) else float(value[i]) for i in range(count)]


def column(value: Any) -> Any:
    """A vector as a CasADi column."""
    return value if isinstance(value, ca.SX) else ca.DM(np.asarray(value, dtype=float))


def rotation_expr(w: Any, terms: int = TERMS) -> Any:
    r"""The rotation of a rotation vector (3, 1) [rad], smooth through zero.

    R = I + a [w] + b [w]^2,  a = sum (-t)^k / (2k + 1)!,  b = sum (-t)^k / (2k + 2)!,  t = w . w; up to half a turn.
    """
    if not isinstance(w, ca.SX):
        return ca.DM(rotation_matrix(np.asarray(w, dtype=float).ravel()))
    t = ca.dot(w, w)
    a: Any = 1.0
    b: Any = 1.0
    for k in range(terms, 0, -1):
        a = 1 - t / ((2 * k) * (2 * k + 1)) * a
        b = 1 - t / ((2 * k + 1) * (2 * k + 2)) * b
    cross = ca.skew(w)
    return ca.SX.eye(3) + a * cross + b / 2 * (cross @ cross)


def cross(a: Any, b: Any) -> Any:
    """a x b of columns (3, 1)."""
    return ca.vertcat(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def weighted_sum(weights: Array, values: Any) -> Any:
    """sum weights_k values_k, (K,) numbers with (K, 1) expressions."""
    return ca.dot(ca.DM(weights), values)
