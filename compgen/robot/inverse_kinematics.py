r"""Closed-form inverse kinematics of a six-axis arm with a spherical wrist, for many poses at once.

Arm class: alpha = (-90, 180, -90, 90, -90, 180 or 0) deg, d1 = d2 = d3 = d5 = 0, a4 = a5 = a6 = 0, a2 positive, d4 and
d6 negative: FANUC M-710iC and its relatives (``arm_geometry`` turns rows of other signs into these). With W the wrist
centre, r its distance from the J1 axis, R = +/- r - a1 and Z = W_z,

    joint 1     theta_1 = atan2(+/- W_y, +/- W_x)                                 front: +, back: -
    triangle    a2, L = hypot(a3, d4), side R^2 + Z^2                             elbow up: +, down: -
    joint 3     theta_3 = 90 deg - atan2(a3, -d4) - e with e the triangle's outer angle at the elbow, 0 when stretched
    wrist       Rz(theta_4) Rx(90) Rz(theta_5) Rx(-90) Rz(theta_6) = R_03^T R_06   no flip: J5 <= 0, flip: J5 > 0

A range of theta_3 of more than a turn (M-20iA: -185 to 273.1 deg) has two angles for some poses, and CONFIG no digit
for it: meant is the one that the arm reaches from elbow up through the stretch, not through the fold [assumed]. The cut
is then where the elbow is folded, which no line in one posture passes.

``joint_path`` follows one branch along a whole program; ``kinematics.flange_pose`` is the way back.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import DEG
from compgen.robot.robot import Robot

STRAIGHT = 1e-6  # [rad] of joint 5


@dataclass(frozen=True, slots=True)
class Posture:
    """One of the eight branches, as the letters of FANUC's CONFIG name them."""

    front: bool = True
    up: bool = True
    flip: bool = False


FOLDED = 45 * DEG  # from the middle of J5's range, within which the flange on the forearm is no limit but a wrong sign
ALL_POSTURES = tuple(Posture(f, u, w) for f in (True, False) for u in (True, False) for w in (False, True))


def is_class(robot: Robot) -> bool:
    """Whether its DH rows are those of the class."""
    twist = np.array([-90, 180, -90, 90, -90]) * DEG
    zero = np.concatenate([robot.d[[0, 1, 2, 4]], robot.a[3:]])
    is_covered = np.allclose(robot.alpha[:5], twist) and np.isclose(abs(np.cos(robot.alpha[5])), 1) and not zero.any()
    return bool(is_covered and robot.a[1] > 0 and robot.d[3] < 0 and robot.d[5] < 0)


def check_arm_class(robot: Robot, source: str) -> None:
    """Raises InputError, which names the robot's file, unless the closed form covers this arm."""
    if not is_class(robot):
        raise InputError(
            f"{source}: dh: no closed-form inverse kinematics for this arm; "
            "paths and programs need the layout of the M-710iC (parallel J2 and J3, spherical wrist)"
        )
    straight, folded = (np.floor((robot.upper[4] - at) / (2 * np.pi)) * 2 * np.pi + at for at in (0.0, np.pi))
    if robot.lower[4] > straight and abs(folded - (robot.lower[4] + robot.upper[4]) / 2) < FOLDED:
        raise InputError(
            f"{source}: dh: within J5's limits the flange never stands along the forearm, and folds back onto it; "
            "mend the sign of d4 or d6, or J5's pendant.offset_deg"
        )


def flange_from_tool(pose: Pose, tool: Pose) -> Pose:
    """Flange poses of TCP poses, ``pose @ tool.inverse()`` for many at once.

    Args:
        pose: TCP, N of them.
        tool: TCP in the flange.
    """
    return Pose.from_rows(*evaluate(_build_flange(), pose.position, pose.rotation_rows, _row(tool)))


def _row(tool: Pose) -> Array:
    """Position and rotation of one pose, row by row, (1, 12)."""
    return np.concatenate([tool.position, tool.rotation.ravel()])[None]


@lru_cache(maxsize=1)
def _build_flange() -> Any:
    """(tool position (3), rotation (9, row by row); TCP in the flange (12)) -> flange position (3), rotation (9)."""
    p, r, tool = ca.SX.sym("p", 3), ca.SX.sym("r", 9), ca.SX.sym("tool", 12)
    position, rotation = _flange_expr(p, r, tool)
    return ca.Function("flange", [p, r, tool], [position, ca.vec(rotation.T)])


def _flange_expr(position: Any, rows: Any, tool: Any) -> tuple[Any, Any]:
    """Flange position (3, 1) and rotation (3, 3) of a tool position, its rotation row by row (9), and the TCP (12)."""
    rotation = ca.reshape(rows, 3, 3).T @ ca.reshape(tool[3:], 3, 3)
    return position - rotation @ tool[:3], rotation


class BranchSolution(NamedTuple):
    """Joints that bring N poses about on one branch, and how well within reach they are."""

    theta: Array  # (N, 6) [rad] DH angles; out of reach those of the nearest stretched or folded arm
    margin: Array  # (N,) [m] by which the wrist centre lies inside the reach of joints 2 and 3; negative: out of reach


def solve_flange(robot: Robot, flange: Pose, posture: Posture) -> BranchSolution:
    """DH joint angles of flange poses on one branch.

    Args:
        robot: Arm of the class above.
        flange: N poses in World.
        posture: The branch.
    """
    theta, margin = evaluate(_build_solve_flange(robot, posture), flange.position, flange.rotation_rows)
    straight = np.flatnonzero((np.abs(theta[:, 4]) < STRAIGHT) & (margin[:, 0] >= 0))
    if len(straight):  # only rounding tells joint 4 from joint 6: joint 4 stays, joint 6 takes what is left
        theta = np.array(theta)
        theta[straight, 5] = _last_joint(theta[straight], flange.rotation[straight])
    return BranchSolution(theta, margin[:, 0])


def _last_joint(theta: Array, rotation: Array) -> Array:
    """Joint 6 of flanges, (N,) [rad], from the others: by the x axis of the flange in the frame that it turns in."""
    c1, s1, c4, s4, c5, s5 = (f(theta[:, i]) for i in (0, 3, 4) for f in (np.cos, np.sin))
    forearm = theta[:, 2] - theta[:, 1] - np.pi / 2  # elevation
    cf, sf = np.cos(forearm), np.sin(forearm)
    x3, z3 = np.column_stack([-c1 * sf, -s1 * sf, cf]), np.column_stack([-c1 * cf, -s1 * cf, -sf])
    y3, x = np.cross(z3, x3), rotation[:, :, 0]
    x_in_3, y_in_3, z_in_3 = ((axis * x).sum(axis=1) for axis in (x3, y3, z3))
    along = c5 * (c4 * x_in_3 + s4 * y_in_3) + s5 * z_in_3
    return np.asarray(np.arctan2(c4 * y_in_3 - s4 * x_in_3, along))


def solve_tool(robot: Robot, pose: Pose, tool: Pose, posture: Posture) -> BranchSolution:
    """DH joint angles of TCP poses on one branch.

    Args:
        robot: Arm of the class above.
        pose: TCP in World, N of them.
        tool: TCP in the flange.
        posture: The branch.

    Returns:
        theta (N, 6) [rad] and the margin (N,) [m], as ``solve_flange`` has them.
    """
    theta, margin = evaluate(_build_solve_tool(robot, posture), pose.position, pose.rotation_rows, _row(tool))
    return BranchSolution(theta, margin[:, 0])


def solve_tools(robot: Robot, tcp: Pose, tools: Pose, tool: IntArray, posture: IntArray) -> BranchSolution:
    """DH joint angles of N TCP poses, each of a tool of its own and on a branch of its own.

    Args:
        robot: Arm of the class above.
        tcp: In World, N of them.
        tools: TCP in the flange.
        tool: Rows of ``tools``, (N,).
        posture: The branches, as indices of ``ALL_POSTURES``, (N,).
    """
    theta, margin = np.empty((len(tool), 6)), np.empty(len(tool))
    kinds = np.column_stack([tool, posture])
    for t, p in np.unique(kinds, axis=0).tolist():
        rows = np.flatnonzero((kinds == [t, p]).all(axis=1))
        theta[rows], margin[rows] = solve_flange(robot, flange_from_tool(tcp[rows], tools[t]), ALL_POSTURES[p])
    return BranchSolution(theta, margin)


@kept_with("robot")
def _build_solve_flange(robot: Robot, posture: Posture) -> Any:
    """(flange position (3), rotation (9, row by row)) -> theta (6), margin."""
    position, rows = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    theta, margin = joints_expr(robot, posture, position, ca.reshape(rows, 3, 3).T)
    return ca.Function("joints", [position, rows], [theta, margin])


@kept_with("robot")
def _build_solve_tool(robot: Robot, posture: Posture) -> Any:
    """(tool position (3), rotation (9, row by row); TCP in the flange (12)) -> theta (6), margin."""
    p, rows, tool = ca.SX.sym("p", 3), ca.SX.sym("r", 9), ca.SX.sym("tool", 12)
    return ca.Function("joints", [p, rows, tool], [*joints_expr(robot, posture, *_flange_expr(p, rows, tool))])


def joints_expr(robot: Robot, posture: Posture, position: Any, rotation: Any) -> tuple[Any, Any]:
    """theta (6, 1) [rad] and the margin [m] of a flange at (3, 1) [m] and (3, 3)."""
    theta, _, _, margin = branch_expr(robot, posture, position, rotation)
    return theta, margin


def branch_expr(robot: Robot, posture: Posture, position: Any, rotation: Any) -> tuple[Any, Any, Any, Any]:
    """theta, cos theta and sin theta, (6, 1) each, and the margin [m]; cosines and sines without trigonometry."""
    a1, a2, a3 = (float(a) for a in robot.a[:3])
    d4, d6 = float(robot.d[3]), float(robot.d[5])
    sign6 = float(round(np.cos(robot.alpha[5])))  # the flange's z runs along sign6 times joint 6's axis
    front, up, flip = (1.0 if b else -1.0 for b in (posture.front, posture.up, posture.flip))
    W = position - sign6 * d6 * rotation[:, 2]
    theta1 = ca.atan2(front * W[1], front * W[0])
    r = ca.sqrt(W[0] * W[0] + W[1] * W[1])
    # on the J1 axis any angle of joint 1 will do: zero, as atan2 has it
    divisor = ca.if_else(r > 0, r, 1.0)
    c1, s1 = ca.if_else(r > 0, front * W[0] / divisor, 1.0), front * W[1] / divisor
    R, Z = front * r - a1, W[2]

    L = float(np.hypot(a3, d4))
    D2 = R * R + Z * Z
    D = ca.sqrt(D2)
    margin = ca.fmin(a2 + L - D, D - abs(a2 - L))
    ce = ca.fmax(-1.0, ca.fmin(1.0, (D2 - a2 * a2 - L * L) / (2 * a2 * L)))
    se = up * ca.sqrt((1 - ce) * (1 + ce))  # e: turn from the upper arm down to the line elbow - wrist
    upper_arm = ca.atan2(Z, R) + ca.atan2(L * se, a2 + L * ce)  # elevation
    shift = float(np.arctan2(a3, -d4))
    theta2, theta3 = _wrap(-upper_arm), np.pi / 2 - shift - ca.atan2(se, ce)
    # their cosines and sines: (R + i Z) (a2 + L exp(i e)), turned back by e + shift for the forearm
    x, y = R * (a2 + L * ce) - Z * L * se, R * L * se + Z * (a2 + L * ce)
    length = ca.sqrt(x * x + y * y)
    length = ca.if_else(length > 0, length, 1.0)
    cu, su = x / length, y / length
    cb, sb = ce * np.cos(shift) - se * np.sin(shift), se * np.cos(shift) + ce * np.sin(shift)
    cf, sf = cu * cb + su * sb, su * cb - cu * sb

    M = _forearm_expr(c1, s1, cf, sf).T @ rotation
    m13, m23, m33 = sign6 * M[0, 2], sign6 * M[1, 2], sign6 * M[2, 2]
    s5 = flip * ca.sqrt(m13 * m13 + m23 * m23)
    theta5 = ca.atan2(s5, m33)
    y4, x4, y6, x6 = -flip * m23, -flip * m13, -flip * sign6 * M[2, 1], flip * M[2, 0]
    theta = ca.vertcat(theta1, theta2, theta3, ca.atan2(y4, x4), theta5, ca.atan2(y6, x6))
    wrist = [_cosine_and_sine(x, y) for x, y in ((x4, y4), (m33, s5), (x6, y6))]
    cosines, sines = (ca.vertcat(*column) for column in zip((c1, s1), (cu, -su), (sb, cb), *wrist, strict=True))
    return theta, cosines, sines, margin


def _forearm_expr(c1: Any, s1: Any, cf: Any, sf: Any) -> Any:
    """R_03 by its columns: x3 up across the forearm, y3 against joint 3's axis, z3 back along the forearm."""
    x3 = ca.vertcat(-c1 * sf, -s1 * sf, cf)
    z3 = ca.vertcat(-c1 * cf, -s1 * cf, -sf)
    return ca.horzcat(x3, ca.cross(z3, x3), z3)


def _cosine_and_sine(x: Any, y: Any) -> tuple[Any, Any]:
    """Cosine and sine of atan2(y, x); 1 and 0 where both are zero."""
    length = ca.sqrt(x * x + y * y)
    is_defined = length > 0
    length = ca.if_else(is_defined, length, 1.0)
    return ca.if_else(is_defined, x / length, 1.0), y / length


def _wrap(angle: Any) -> Any:
    """An angle brought into (-pi, pi]."""
    return angle + 2 * np.pi * ca.floor((np.pi - angle) / (2 * np.pi))
