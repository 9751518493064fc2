r"""The error model: all sources folded into one chain.

At commanded joints theta the controller believes the TCP at nominal(theta); it is at
actual(theta, rise, direction, travel). The model gives, position in base axes and orientation as a rotation vector in
tool axes,

    e_p = p_actual - p_reference          e_w = log(R_reference^T R_actual)

against any reference pose: the nominal one for the error of an uncorrected program, the target for its residual.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import evaluate
from compgen.core.rotations import rotation_vector_expr
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.source import Source, State
from compgen.robot.kinematics import nominal_chain
from compgen.robot.robot import Robot


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class ErrorModel:
    """CasADi functions to position (3) and rotation (9 column-major) of the TCP."""

    nominal: Any  # theta
    actual: Any  # theta, rise, direction, travel
    error_function: (
        Any  # theta, rise, direction, travel, a reference's position (3) and rotation (9, row by row) -> e (6)
    )

    def nominal_pose(self, theta: Array) -> tuple[Array, Array]:
        """Where the controller believes the TCP to be, (N, 3) [m] and (N, 3, 3)."""
        return _pose(evaluate(self.nominal, theta))

    def actual_pose(self, theta: Array, rise: Array, directions: DirectionState = NO_DIRECTION) -> tuple[Array, Array]:
        """Where the TCP really is, (N, 3) [m] and (N, 3, 3)."""
        return _pose(evaluate(self.actual, theta, rise, directions.direction, directions.travel))

    def error(
        self, theta: Array, rise: Array, position: Array, rotation: Array, directions: DirectionState = NO_DIRECTION
    ) -> Array:
        """Actual against a reference pose, (N, 6): e_p [m] in base axes, e_w [rad] in tool axes."""
        inputs = (theta, rise, directions.direction, directions.travel)
        return evaluate(self.error_function, *inputs, position, rotation.reshape(-1, 9))[0]


def build_error_model(
    robot: Robot, sources: Sequence[Source], nodes: int, tool_position: Array, tool_rotation: Array
) -> ErrorModel:
    """Fold the sources over the nominal chain."""
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", max(nodes, 1))
    direction, travel = ca.SX.sym("direction", 6), ca.SX.sym("travel", 3)
    nominal = nominal_chain(robot, theta, (tool_position, tool_rotation))
    state = State(nominal, rise, direction, travel)
    chain = nominal
    for source in sources:
        chain = source.distort(chain, state)
    believed, actual = nominal.tcp_expr(), ca.cse(list(chain.tcp_expr()))
    inputs = [theta, rise, direction, travel]
    p, rows = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    e = ca.vertcat(actual[0] - p, rotation_vector_expr(ca.reshape(rows, 3, 3) @ actual[1]))
    return ErrorModel(
        ca.Function("nominal", [theta], [believed[0], ca.densify(believed[1])]),
        ca.Function("actual", inputs, [actual[0], ca.densify(actual[1])]),
        ca.Function("against", [*inputs, p, rows], [e]),
    )


def _pose(outputs: tuple[Array, ...]) -> tuple[Array, Array]:
    position, rotation = outputs
    return position, np.swapaxes(rotation.reshape(-1, 3, 3), 1, 2)
