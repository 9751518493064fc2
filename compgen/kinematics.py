r"""The symbolic chain, and the one bridge from CasADi to numpy.

A chain is six DH rows with symbols in them; an error source takes a chain and gives a chain. Its pose is

    T = base  prod_i  Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i)  tool

Numbers cross by ``evaluate`` of ``compgen.evaluation``: rows in, rows out.
"""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array
from compgen.evaluation import BLOCK, evaluate
from compgen.robot import Robot

__all__ = ["BLOCK", "Chain", "evaluate", "nominal_chain", "with_tool_expr"]


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


def _cos(angle: Any) -> Any:
    return _exact(np.cos(angle)) if isinstance(angle, float) else ca.cos(angle)


def _sin(angle: Any) -> Any:
    return _exact(np.sin(angle)) if isinstance(angle, float) else ca.sin(angle)


def _exact(value: float) -> float:
    """Right angles give 0 and 1 exactly, so their products vanish from the graph."""
    return float(round(value)) if abs(value - round(value)) < 1e-15 else float(value)
