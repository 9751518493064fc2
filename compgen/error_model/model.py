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

from compgen.core.arrays import Array, frozen
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector_expr
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.source import Source, State
from compgen.robot.kinematics import Frame, nominal_chain
from compgen.robot.robot import Robot


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class ErrorModel:
    """CasADi functions to position (3) and rotation (9 column-major) of the TCP."""

    nominal: Any  # theta
    actual: Any  # theta, rise, direction, travel
    error_function: (
        Any  # theta, rise, direction, travel, a reference's position (3) and rotation (9, row by row) -> e (6)
    )

    def nominal_pose(self, theta: Array) -> Pose:
        """Where the controller believes the TCP to be, N poses."""
        return _pose(evaluate(self.nominal, theta))

    def actual_pose(self, theta: Array, rise: Array, directions: DirectionState = NO_DIRECTION) -> Pose:
        """Where the TCP really is, N poses."""
        return _pose(evaluate(self.actual, theta, rise, directions.direction, directions.travel))

    def error(self, theta: Array, rise: Array, reference: Pose, directions: DirectionState = NO_DIRECTION) -> Array:
        """Actual against a reference pose, (N, 6): e_p [m] in base axes, e_w [rad] in tool axes."""
        inputs = (theta, rise, directions.direction, directions.travel)
        return evaluate(self.error_function, *inputs, reference.position, reference.rotation_rows)[0]


def build_error_model(robot: Robot, sources: Sequence[Source], nodes: int, tool: Pose) -> ErrorModel:
    """Fold the sources over the nominal chain with a TCP in its flange, once while the arm lives."""
    return _build(robot, tuple(sources), nodes, tool)


@kept_with("robot")
def _build(robot: Robot, sources: tuple[Source, ...], nodes: int, tool: Pose) -> ErrorModel:
    theta, rise = ca.SX.sym("theta", 6), ca.SX.sym("rise", max(nodes, 1))
    direction, travel = ca.SX.sym("direction", 6), ca.SX.sym("travel", 3)
    nominal = nominal_chain(robot, theta, tool)
    state = State(nominal, rise, direction, travel)
    chain = nominal
    for source in sources:
        chain = source.distort(chain, state)
    believed, actual = nominal.tcp_expr(), Frame(*ca.cse(list(chain.tcp_expr())))
    inputs = [theta, rise, direction, travel]
    p, rows = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    e = ca.vertcat(actual.position - p, rotation_vector_expr(ca.reshape(rows, 3, 3) @ actual.rotation))
    return ErrorModel(
        ca.Function("nominal", [theta], [believed.position, ca.densify(believed.rotation)]),
        ca.Function("actual", inputs, [actual.position, ca.densify(actual.rotation)]),
        ca.Function("against", [*inputs, p, rows], [e]),
    )


def _pose(outputs: tuple[Array, ...]) -> Pose:
    position, rotation = outputs
    return Pose(frozen(position), frozen(np.swapaxes(rotation.reshape(-1, 3, 3), 1, 2)))
