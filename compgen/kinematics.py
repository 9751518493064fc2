r"""The symbolic chain, and the one bridge from CasADi to numpy.

A chain is six DH rows with symbols in them; an error source takes a chain and gives a chain. Its pose is

    T = base  prod_i  Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)  tool

Numbers cross by ``evaluate`` of ``compgen.evaluation``: rows in, rows out.
"""

from dataclasses import dataclass
from math import factorial
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array
from compgen.evaluation import BLOCK, evaluate
from compgen.robot import Robot

__all__ = [
    "BLOCK",
    "Chain",
    "evaluate",
    "nominal_chain",
    "rotation_matrix_expr",
    "rotation_vector_expr",
    "with_tool_expr",
]


@dataclass(frozen=True, eq=False, slots=True)
class Chain:
    """DH rows as CasADi expressions; ``theta`` holds the joint variables."""

    theta: tuple[Any, ...]  # 6 [rad]
    d: tuple[Any, ...]  # 6 [m]
    a: tuple[Any, ...]  # 6 [m]
    alpha: tuple[Any, ...]  # 6 [rad]

    def pose_expr(self) -> tuple[Any, Any]:
        """Flange position (3, 1) and rotation (3, 3)."""
        position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
        for theta, d, a, alpha in zip(self.theta, self.d, self.a, self.alpha):
            c, s, ca_, sa = ca.cos(theta), ca.sin(theta), _cos(alpha), _sin(alpha)
            position = position + rotation @ ca.vertcat(a * c, a * s, d)
            rotation = rotation @ ca.vertcat(
                ca.horzcat(c, -s * ca_, s * sa), ca.horzcat(s, c * ca_, -c * sa), ca.horzcat(0, sa, ca_)
            )
        return position, rotation


def nominal_chain(robot: Robot, theta: Any) -> Chain:
    """The chain the controller believes in."""
    six = range(6)
    return Chain(
        tuple(theta[i] for i in six),
        tuple(float(robot.d[i]) for i in six),
        tuple(float(robot.a[i]) for i in six),
        tuple(float(robot.alpha[i]) for i in six),
    )


def with_tool_expr(pose: tuple[Any, Any], tool_position: Array, tool_rotation: Array) -> tuple[Any, Any]:
    """TCP position and rotation of a flange pose."""
    position, rotation = pose
    return position + rotation @ ca.DM(tool_position), rotation @ ca.DM(tool_rotation)


def rotation_matrix_expr(w: Any) -> Any:
    """Rotation matrix (3, 3) of a rotation vector (3, 1); by Taylor's series, exact to rounding up to 1 rad."""
    x = ca.dot(w, w)
    a = b = ca.SX(0)
    for k in range(8, -1, -1):  # sin(t) / t and (1 - cos(t)) / t^2
        a, b = 1 / factorial(2 * k + 1) - x * a, 1 / factorial(2 * k + 2) - x * b
    m = ca.skew(w)
    return ca.SX.eye(3) + a * m + b * (m @ m)


def rotation_vector_expr(rotation: Any) -> Any:
    """Rotation vector (3, 1) of a rotation matrix (3, 3) by less than half a turn."""
    axial = (
        ca.vertcat(rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1])
        / 2
    )
    s2 = ca.dot(axial, axial)
    small = s2 < 1e-6
    sine = ca.sqrt(ca.if_else(small, 1.0, s2))
    angle = ca.atan2(sine, (ca.trace(rotation) - 1) / 2)
    return axial * ca.if_else(small, 1 + s2 * (1 / 6 + s2 * (3 / 40 + s2 * 15 / 336)), angle / sine)


def _cos(angle: Any) -> Any:
    return _exact(np.cos(angle)) if isinstance(angle, float) else ca.cos(angle)


def _sin(angle: Any) -> Any:
    return _exact(np.sin(angle)) if isinstance(angle, float) else ca.sin(angle)


def _exact(value: float) -> float:
    """Right angles give 0 and 1 exactly, so their products vanish from the graph."""
    return float(round(value)) if abs(value - round(value)) < 1e-15 else float(value)
