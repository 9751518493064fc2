r"""What would go wrong: the error model, all sources folded into one chain.

At the joints theta that the controller commands, the TCP is believed at nominal(theta) and really at
actual(theta, rise). The model gives, position in base axes and orientation as a rotation vector in tool axes,

    e_p = p_actual - p_reference          e_w = log(R_reference^T R_actual)

against any reference pose: the nominal one for the error of an uncorrected program, the target for its residual.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array
from compgen.kinematics import evaluate, nominal_chain, with_tool_expr
from compgen.robot import Robot
from compgen.rotations import vector_of
from compgen.sources import Source


@dataclass(frozen=True, slots=True)
class ErrorModel:
    """CasADi functions (theta, rise) -> position (3), rotation (9 column-major) of the TCP."""

    nominal: Any
    actual: Any

    def nominal_pose(self, theta: Array) -> tuple[Array, Array]:
        """Where the controller believes the TCP to be, (N, 3) [m] and (N, 3, 3)."""
        return _pose(evaluate(self.nominal, theta))

    def actual_pose(self, theta: Array, rise: Array) -> tuple[Array, Array]:
        """Where the TCP really is, (N, 3) [m] and (N, 3, 3)."""
        return _pose(evaluate(self.actual, theta, rise))

    def error(self, theta: Array, rise: Array, position: Array, rotation: Array) -> Array:
        """Actual against a reference pose, (N, 6): e_p [m] in base axes, e_w [rad] in tool axes."""
        p, R = self.actual_pose(theta, rise)
        return np.hstack([p - position, vector_of(np.swapaxes(rotation, 1, 2) @ R)])


def build_error_model(
    robot: Robot, sources: Sequence[Source], nodes: int, tool_position: Array, tool_rotation: Array
) -> ErrorModel:
    """Fold the sources over the nominal chain."""
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", max(nodes, 1))
    chain = nominal_chain(robot, theta)
    nominal = with_tool_expr(chain.pose_expr(), tool_position, tool_rotation)
    for source in sources:
        chain = source.distort(chain, rise)
    actual = with_tool_expr(chain.pose_expr(), tool_position, tool_rotation)
    return ErrorModel(
        ca.Function("nominal", [theta], [nominal[0], ca.densify(nominal[1])]),
        ca.Function("actual", [theta, rise], [actual[0], ca.densify(actual[1])]),
    )


def _pose(outputs: tuple[Array, ...]) -> tuple[Array, Array]:
    position, rotation = outputs
    return position, np.swapaxes(rotation.reshape(-1, 3, 3), 1, 2)
