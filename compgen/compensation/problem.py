r"""What the optimiser is asked: targets, joints and warmth of a program, and what a correction may look like.

From a correction c to its joints and to what stays is one expression: commanded pose, closed-form inverse kinematics,
real arm. Because de/dc = I + O(1e-3), the correction that leaves nothing, e(c) = 0, is a fixed point of c <- c - e(c),
which shrinks what is left about a thousandfold a step: ``STEPS`` of them are one expression as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.evaluation import evaluate
from compgen.core.rotations import rotation_matrix_expr, rotation_vector_expr
from compgen.error_model.model import ErrorModel
from compgen.error_model.sources import NO_DIRECTION, DirectionState
from compgen.robot.inverse_kinematics import Posture, branch_expr
from compgen.robot.robot import Robot

SHORTEST = 1e-6  # m: shorter segments are as stiff as this one, else their stiffness drowns everything else
STEPS = 3


@dataclass(frozen=True, slots=True)
class Settings:
    """What a correction may look like."""

    clamp_position: float = 3e-3  # [m]
    clamp_rotation: float = 8.726646259971648e-3  # [rad] 0.5 deg
    rate: float = 0.01  # [m/m] change of the correction along the path
    rate_period: float = 1e-3  # [m] L1
    curvature_period: float = 10e-3  # [m] L2
    lever: float = 0.25  # [m]
    free_spin: bool = False


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Everything known before the correction is chosen."""

    robot: Robot
    model: ErrorModel
    posture: Posture
    tool_position: Array  # (3,) [m] TCP in the flange
    tool_rotation: Array  # (3, 3)
    position: Array  # (N, 3) [m] targets
    rotation: Array  # (N, 3, 3)
    theta: Array  # (N, 6) [rad] joints at the targets
    rise: Array  # (N, K) [K]
    arc: Array  # (N,) [m]
    stop: BoolArray  # (N,)
    motion: DirectionState = NO_DIRECTION  # where the planned joints and the TCP come from

    def commanded(self, correction: Array) -> tuple[Array, Array]:
        """Poses that the program names, (N, 3) [m] and (N, 3, 3)."""
        position, rotation = evaluate(build_commanded(), self.position, self.rotation.reshape(-1, 9), correction)
        return position, rotation.reshape(-1, 3, 3)

    def joints(self, correction: Array) -> tuple[Array, Array]:
        """Joints of the commanded poses on the program's branch (N, 6) [rad], and the reach margin (N,) [m]."""
        theta, margin = evaluate(self._functions().joints, *self._targets(), correction)
        return theta, margin[:, 0]

    def error(self, correction: Array) -> Array:
        """e_n, (N, 6)."""
        return self.looked_at(correction)[0]

    def looked_at(self, correction: Array) -> tuple[Array, Array, Array]:
        """e_n (N, 6), the joints (N, 6) [rad] and the reach margin (N,) [m]."""
        e, theta, margin = evaluate(self._functions().error, *self._targets(), correction, *self._moments())
        return e, theta, margin[:, 0]

    def linear(self, correction: Array) -> tuple[Array, Array, Array, Array]:
        """e (N, 6), de/dc (N, 6, 6), theta (N, 6) and dtheta/dc (N, 6, 6)."""
        e, E, theta, G = evaluate(self._functions().linear, *self._targets(), correction, *self._moments())
        return e, np.swapaxes(E.reshape(-1, 6, 6), 1, 2), theta, np.swapaxes(G.reshape(-1, 6, 6), 1, 2)

    def pointwise(self) -> Array:
        """The correction that leaves nothing, each waypoint for itself, (N, 6)."""
        return evaluate(self._functions().pointwise, *self._targets(), *self._moments())[0]

    def _functions(self) -> "Functions":
        tool = (self.tool_position.tobytes(), self.tool_rotation.tobytes())
        return build_functions(self.robot, self.model, self.posture, *tool)

    def _targets(self) -> tuple[Array, Array, Array]:
        return self.position, self.rotation.reshape(-1, 9), self.theta

    def _moments(self) -> tuple[Array, Array, Array]:
        return self.rise, self.motion.direction, self.motion.travel

    def window(self, rows: slice | IntArray) -> "Problem":
        """The same problem on some of its waypoints."""
        return replace(
            self,
            motion=self.motion.at(rows),
            **{f: getattr(self, f)[rows] for f in ("position", "rotation", "theta", "rise", "arc", "stop")},
        )


@lru_cache(maxsize=1)
def build_commanded() -> Any:
    """(target's position (3) and rotation (9, row by row), c (6)) -> position, rotation that the program names."""
    p, rows, c = (ca.SX.sym(name, size) for name, size in (("p", 3), ("r", 9), ("c", 6)))
    rotation = ca.reshape(rows, 3, 3).T @ rotation_matrix_expr(c[3:])
    return ca.Function("commanded", [p, rows, c], [p + c[:3], ca.vec(rotation.T)])


class Functions:
    """CasADi functions of the target's position (3) and rotation (9, row by row), and of joints (6) near its own.

    Each is built when it is asked. The way from a correction to its joints and to its error are functions of their own,
    called for every step: SX is put together in C++ then, not in Python.
    """

    def __init__(
        self, robot: Robot, model: ErrorModel, posture: Posture, tool_position: bytes, tool_rotation: bytes
    ) -> None:
        p, rows, near, c = (ca.SX.sym(name, size) for name, size in (("p", 3), ("r", 9), ("near", 6), ("c", 6)))
        moment = [
            ca.SX.sym(name, model.actual.size1_in(k)) for k, name in enumerate(("rise", "direction", "travel"), 1)
        ]
        rotation = ca.reshape(rows, 3, 3).T
        place, turn = (ca.DM(np.frombuffer(t).reshape(-1, 3)) for t in (tool_position, tool_rotation))
        flange = rotation @ rotation_matrix_expr(c[3:]) @ turn.T
        theta, cosine, sine, margin = branch_expr(robot, posture, p + c[:3] - flange @ place.T, flange)
        theta = theta + 2 * np.pi * ca.floor((near - theta) / (2 * np.pi) + 0.5)

        def against(pose: Sequence[Any]) -> Any:
            return ca.vertcat(pose[0] - p, rotation_vector_expr(rotation.T @ pose[1]))

        self._target, self._c, self._moment = [p, rows, near], c, moment
        self._joints, self._planned = (theta, margin), against(model.actual(near, *moment))
        e = against(with_pairs(model.actual, theta, cosine, sine, *moment))
        self._e = ca.Function("e", [p, rows, near, c, *moment], [e])

    def _error(self, c: Any) -> Any:
        return self._e(*self._target, c, *self._moment)

    @cached_property
    def joints(self) -> Any:
        """And c (6) -> theta (6), margin."""
        return ca.Function("joints", [*self._target, self._c], [*self._joints])

    @cached_property
    def error(self) -> Any:
        """And c (6), rise, direction, travel -> e (6), theta (6), margin."""
        outputs = ca.cse([self._error(self._c), *self._joints])
        return ca.Function("error", [*self._target, self._c, *self._moment], outputs)

    @cached_property
    def pointwise(self) -> Any:
        """And rise, direction, travel -> c (6)."""
        # without a correction the joints are the planned ones, so the first step needs no inverse
        found = -self._planned
        for _ in range(STEPS - 1):
            found = found - self._error(found)
        return ca.Function("pointwise", [*self._target, *self._moment], ca.cse([found]))

    @cached_property
    def linear(self) -> Any:
        """And c (6) and the same -> e (6), de/dc (36, column-major), theta (6), dtheta/dc (36)."""
        c, e, theta = self._c, self._error(self._c), self._joints[0]
        E, G = ca.jacobian(e, c), ca.jacobian(theta, c)
        outputs = ca.cse([e, ca.densify(E), theta, ca.densify(G)])
        return ca.Function("linear", [*self._target, c, *self._moment], outputs)


@lru_cache(maxsize=16)
def build_functions(
    robot: Robot, model: ErrorModel, posture: Posture, tool_position: bytes, tool_rotation: bytes
) -> Functions:
    """The way from a correction to its joints and to what stays."""
    return Functions(robot, model, posture, tool_position, tool_rotation)


def with_pairs(function: Any, theta: Any, cosine: Any, sine: Any, *others: Any) -> list[Any]:
    """A function of theta and others as an expression, each cos and sin of a joint angle given instead of computed."""
    given = [theta, *others]
    work: list[Any] = [None] * function.sz_w()
    joint: list[int | None] = [None] * function.sz_w()  # which joint's angle a work place holds
    out = [ca.SX.zeros(*function.size_out(k)) for k in range(function.n_out())]
    for k in range(function.n_instructions()):
        code, i, o = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
        if code == ca.OP_OUTPUT:
            out[o[0]][o[1]] = work[i[0]]
            continue
        held = None
        if code == ca.OP_INPUT:
            value, held = given[i[0]][i[1]], i[1] if i[0] == 0 else None
        elif code == ca.OP_CONST:
            value = ca.SX(function.instruction_constant(k))
        elif code in (ca.OP_SIN, ca.OP_COS) and joint[i[0]] is not None:
            value = (sine if code == ca.OP_SIN else cosine)[joint[i[0]]]
        else:
            parts = [work[n] for n in i]
            value = ca.SX.binary(code, *parts) if len(parts) == 2 else ca.SX.unary(code, *parts)
        work[o[0]], joint[o[0]] = value, held
    return out


def weights(settings: Settings) -> Array:
    """W, (6,) [-] for position and [m/rad] for rotation; a free spin keeps a trace, so that it stays determined."""
    w = np.array([1.0, 1.0, 1.0, *3 * [settings.lever]])
    w[5] *= 1e-4 if settings.free_spin else 1.0
    return w


def measure(arc: Array) -> Array:
    """ds_n: the length of path that a waypoint stands for, (N,) [m]."""
    h = np.maximum(np.diff(arc), 1e-12)
    return np.asarray(np.concatenate([[h[0] / 2], (h[:-1] + h[1:]) / 2, [h[-1] / 2]]))


def bands(arc: Array, stop: BoolArray, settings: Settings, fidelity: float = 1.0) -> Array:
    """diag(ds) fidelity + l1 D1'D1 + l2 D2'D2 in upper banded form, (3, N)."""
    h = np.maximum(np.diff(arc), SHORTEST)
    N = len(arc)
    diagonal, first, second = measure(arc) * fidelity, np.zeros(N), np.zeros(N)
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
