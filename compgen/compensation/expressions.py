r"""The way from a correction to its joints and to the error it leaves, as CasADi functions of one waypoint.

    commanded = target (+) c,      theta = inverse kinematics of commanded,      e(c) = actual(theta) (-) target

Because de/dc = I + O(1e-3), the correction that leaves no error, e(c) = 0, is a fixed point of c <- c - e(c), which
shrinks e about a thousandfold a step: ``FIXED_POINT_STEPS`` of them are one expression as well.
"""

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.evaluation import kept_with
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix_expr, rotation_vector_expr
from compgen.error_model.model import ErrorModel
from compgen.robot.inverse_kinematics import Posture, branch_expr
from compgen.robot.robot import Robot

FIXED_POINT_STEPS = 3


@lru_cache(maxsize=1)
def build_commanded_pose() -> Any:
    """(target's position (3) and rotation (9, row by row), c (6)) -> position, rotation that the program names."""
    p, rows, c = (ca.SX.sym(name, size) for name, size in (("p", 3), ("r", 9), ("c", 6)))
    rotation = ca.reshape(rows, 3, 3).T @ rotation_matrix_expr(c[3:])
    return ca.Function("commanded", [p, rows, c], [p + c[:3], ca.vec(rotation.T)])


class CorrectionFunctions:
    """CasADi functions of the target's position (3) and rotation (9, row by row), and of the planned joints (6) there.

    Each is built when it is first used. The residual is a function of its own that the others call, because CasADi
    then copies its expression in C++ and not in Python.
    """

    def __init__(self, robot: Robot, model: ErrorModel, posture: Posture, tool: Pose) -> None:
        p, rows, planned, c = (ca.SX.sym(name, size) for name, size in (("p", 3), ("r", 9), ("planned", 6), ("c", 6)))
        state = [ca.SX.sym(name, model.actual.size1_in(k)) for k, name in enumerate(("rise", "direction", "travel"), 1)]
        rotation = ca.reshape(rows, 3, 3).T
        flange = rotation @ rotation_matrix_expr(c[3:]) @ ca.DM(tool.rotation.T)
        theta, cosine, sine, margin = branch_expr(robot, posture, p + c[:3] - flange @ ca.DM(tool.position), flange)
        theta = theta + 2 * np.pi * ca.floor((planned - theta) / (2 * np.pi) + 0.5)

        def error_expr(pose: Sequence[Any]) -> Any:
            """Of an actual pose against the target."""
            return ca.vertcat(pose[0] - p, rotation_vector_expr(rotation.T @ pose[1]))

        self._target, self._c, self._state = [p, rows, planned], c, state
        self._joints, self._uncorrected = (theta, margin), error_expr(model.actual(planned, *state))
        e = error_expr(substitute_cosines(model.actual, theta, cosine, sine, *state))
        self._e = ca.Function("e", [p, rows, planned, c, *state], [e])

    def _residual(self, c: Any) -> Any:
        return self._e(*self._target, c, *self._state)

    @cached_property
    def joints(self) -> Any:
        """(target, c (6)) -> theta (6), reach margin."""
        return ca.Function("joints", [*self._target, self._c], [*self._joints])

    @cached_property
    def residual(self) -> Any:
        """(target, c (6), rise, direction, travel) -> e (6), theta (6), reach margin."""
        outputs = ca.cse([self._residual(self._c), *self._joints])
        return ca.Function("residual", [*self._target, self._c, *self._state], outputs)

    @cached_property
    def pointwise(self) -> Any:
        """(target, rise, direction, travel) -> the correction (6) that leaves no error."""
        # without a correction the joints are the planned ones, so the first step needs no inverse kinematics
        c = -self._uncorrected
        for _ in range(FIXED_POINT_STEPS - 1):
            c = c - self._residual(c)
        return ca.Function("pointwise", [*self._target, *self._state], ca.cse([c]))

    @cached_property
    def linearised(self) -> Any:
        """(target, c (6), rise, direction, travel) -> e (6), de/dc (36, column-major), theta (6), dtheta/dc (36)."""
        c, e, theta = self._c, self._residual(self._c), self._joints[0]
        E, G = ca.jacobian(e, c), ca.jacobian(theta, c)
        outputs = ca.cse([e, ca.densify(E), theta, ca.densify(G)])
        return ca.Function("linearised", [*self._target, c, *self._state], outputs)


@kept_with("robot")
def build_correction_functions(robot: Robot, model: ErrorModel, posture: Posture, tool: Pose) -> CorrectionFunctions:
    """The functions of one robot, error model and tool; problems that share them build them once."""
    return CorrectionFunctions(robot, model, posture, tool)


def substitute_cosines(function: Any, theta: Any, cosine: Any, sine: Any, *others: Any) -> list[Any]:
    """The expressions of ``function(theta, *others)`` with each cos and sin of a joint angle given, not computed.

    The inverse kinematics knows the cosines and sines of its angles already.

    Args:
        function: A CasADi SX function.
        theta: Joint angles, (6) [rad].
        cosine: Of them, (6).
        sine: Of them, (6).
        others: The function's further inputs.
    """
    inputs = [theta, *others]
    work: list[Any] = [None] * function.sz_w()
    joint: list[int | None] = [None] * function.sz_w()  # which joint's angle a work vector's entry holds
    outputs = [ca.SX.zeros(*function.size_out(k)) for k in range(function.n_out())]
    for k in range(function.n_instructions()):
        code, i, o = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            outputs[o[0]][o[1]] = work[i[0]]
            continue
        angle = None
        if code == ca.OP_INPUT:
            expression, angle = inputs[i[0]][i[1]], i[1] if i[0] == 0 else None
        elif code == ca.OP_CONST:
            expression = ca.SX(function.instruction_constant(k))
        elif code in (ca.OP_SIN, ca.OP_COS) and joint[i[0]] is not None:
            expression = (sine if code == ca.OP_SIN else cosine)[joint[i[0]]]
        else:
            operands = [work[n] for n in i]
            expression = ca.SX.binary(code, *operands) if len(operands) == 2 else ca.SX.unary(code, *operands)
        work[o[0]], joint[o[0]] = expression, angle
    return outputs
