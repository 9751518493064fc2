r"""The symbolic chain of the arm, and the nominal flange pose of joint angles.

A chain is six DH rows with symbols in them, the tool behind them, and what errors put between them; an error source
takes a chain and gives a chain. The pose of its TCP in World is

    F_0  prod_i [ Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i)  F_i ]  tool,    then moved by ``shift``

F_i is a frame that errors insert behind row i (F_0: before the first), beta the Hayati angle that a small misalignment
of parallel axes needs; both are none and zero in a nominal chain. What is exactly zero adds nothing to the graph.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.pose import Pose
from compgen.robot.robot import Robot


class Frame(NamedTuple):
    """A pose of numbers or CasADi expressions."""

    position: Any  # (3, 1) [m]
    rotation: Any  # (3, 3)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Chain:
    """DH rows as CasADi expressions; ``theta`` holds the joint variables."""

    theta: tuple[Any, ...]  # 6 [rad]
    d: tuple[Any, ...]  # 6 [m]
    a: tuple[Any, ...]  # 6 [m]
    alpha: tuple[Any, ...]  # 6 [rad]
    beta: tuple[Any, ...] = 6 * (0.0,)  # 6 [rad] about y, behind alpha
    frames: tuple[Frame | None, ...] = 7 * (None,)  # F_0 ... F_6
    tool: Frame | None = None  # TCP in the flange
    shift: Any = None  # (3, 1) [m] in World

    def inserted(self, row: int, position: Any, rotation: Any) -> "Chain":
        """The chain with one more frame behind row ``row`` (0: before the first), after those already inserted."""
        frame, present = Frame(_matrix(position), _matrix(rotation)), self.frames[row]
        if present is not None:
            frame = _compose(present, frame)
        return replace(self, frames=(*self.frames[:row], frame, *self.frames[row + 1 :]))

    def moved(self, shift: Any) -> "Chain":
        """The chain with its TCP moved by a further shift, (3, 1) [m] in World."""
        return replace(self, shift=shift if self.shift is None else self.shift + shift)

    def joint_frames(self) -> list[Frame]:
        """Position and rotation in World of the frame behind each row, F_i with it; the first is the World's own F_0.

        The axis of joint i + 1 is the z of frame i; frame 6 is the flange.
        """
        frames = [_compose(Frame(ca.SX.zeros(3), ca.SX.eye(3)), self.frames[0])]
        rows = zip(self.theta, self.d, self.a, self.alpha, self.beta, self.frames[1:], strict=True)
        for theta, d, a, alpha, beta, frame in rows:
            position, rotation = frames[-1]
            c, s, ca_, sa = ca.cos(theta), ca.sin(theta), _cos(alpha), _sin(alpha)
            position = position + rotation @ ca.vertcat(a * c, a * s, d)
            rotation = rotation @ ca.vertcat(
                ca.horzcat(c, -s * ca_, s * sa), ca.horzcat(s, c * ca_, -c * sa), ca.horzcat(0, sa, ca_)
            )
            if not is_zero(beta):
                cb, sb = _cos(beta), _sin(beta)
                rotation = rotation @ ca.vertcat(ca.horzcat(cb, 0, sb), ca.horzcat(0, 1, 0), ca.horzcat(-sb, 0, cb))
            frames.append(_compose(Frame(position, rotation), frame))
        return frames

    def pose_expr(self) -> Frame:
        """Flange position (3, 1) and rotation (3, 3), without tool and shift."""
        return self.joint_frames()[-1]

    def tcp_expr(self) -> Frame:
        """TCP position (3, 1) and rotation (3, 3)."""
        position, rotation = _compose(self.pose_expr(), self.tool)
        return Frame(position if self.shift is None else position + self.shift, rotation)


def nominal_chain(robot: Robot, theta: Any, tool: Pose | None = None) -> Chain:
    """The chain the controller believes in; ``tool`` is the TCP in the flange."""
    six = range(6)
    return Chain(
        theta=tuple(theta[i] for i in six),
        d=tuple(float(robot.d[i]) for i in six),
        a=tuple(float(robot.a[i]) for i in six),
        alpha=tuple(float(robot.alpha[i]) for i in six),
        tool=None if tool is None else Frame(tool.position, tool.rotation),
    )


def flange_pose(robot: Robot, theta: Array) -> Pose:
    """Nominal flange poses of DH joint angles, the inverse of ``inverse_kinematics.solve_flange``.

    Args:
        robot: The arm.
        theta: (N, 6) [rad].

    Returns:
        N poses in World; a row's numbers do not depend on how many rows there are.
    """
    return Pose.from_rows(*evaluate(_build_flange_pose(robot), theta, exact=True))


@kept_with("robot")
def _build_flange_pose(robot: Robot) -> Any:
    """theta (6) -> flange position (3), rotation (9, row by row)."""
    theta = ca.SX.sym("theta", 6)
    position, rotation = nominal_chain(robot, theta).pose_expr()
    return ca.Function("flange_pose", [theta], [position, ca.densify(ca.vec(rotation.T))])


def frames_at_zero(robot: Robot) -> Pose:
    """The frames behind the DH rows at pendant zero, 7 poses in World; the first is World's own."""
    frames = nominal_chain(robot, ca.DM(robot.pendant_zero)).joint_frames()
    numbers = [[np.asarray(ca.evalf(part)) for part in frame] for frame in frames]
    return Pose.stack([Pose(position.ravel(), rotation) for position, rotation in numbers])


def joint_places(robot: Robot, theta: Array) -> Array:
    """Origins in World of the frames behind the DH rows, (N, 7, 3) [m], of joint angles (N, 6) [rad]."""
    return np.asarray(evaluate(_build_joint_places(robot), theta)[0].reshape(-1, 7, 3))


@kept_with("robot")
def _build_joint_places(robot: Robot) -> Any:
    """theta (6) -> origins of the seven frames, one after the other (21)."""
    theta = ca.SX.sym("theta", 6)
    places = [ca.densify(frame.position) for frame in nominal_chain(robot, theta).joint_frames()]
    return ca.Function("joint_places", [theta], [ca.vertcat(*places)])


def _compose(pose: Frame, frame: Frame | None) -> Frame:
    """The pose of a frame that is given in another pose; without a frame the pose itself."""
    if frame is None:
        return pose
    return Frame(pose.position + pose.rotation @ _matrix(frame.position), pose.rotation @ _matrix(frame.rotation))


def _matrix(value: Any) -> Any:
    return value if isinstance(value, ca.SX) else ca.DM(value)


def is_zero(value: Any) -> bool:
    """Whether a number or expression is exactly zero, so that it may be left out of the graph."""
    return bool(value.is_zero()) if isinstance(value, (ca.SX, ca.DM)) else not np.any(value)


def _cos(angle: Any) -> Any:
    return _exact(np.cos(angle)) if isinstance(angle, float) else ca.cos(angle)


def _sin(angle: Any) -> Any:
    return _exact(np.sin(angle)) if isinstance(angle, float) else ca.sin(angle)


def _exact(value: float) -> float:
    """Right angles give 0 and 1 exactly, so their products vanish from the graph."""
    return float(round(value)) if abs(value - round(value)) < 1e-15 else float(value)
