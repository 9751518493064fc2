r"""Closed-form inverse kinematics of a six-axis arm with a spherical wrist, for many poses at once.

Arm class: alpha = (-90, 180, -90, 90, -90, 180 or 0) deg, d1 = d2 = d3 = d5 = 0, a4 = a5 = a6 = 0, d4 and d6 negative:
FANUC M-710iC and its relatives. With W the wrist centre, r its distance from the J1 axis, R = +/- r - a1 and Z = W_z,

    joint 1     theta_1 = atan2(+/- W_y, +/- W_x)                                 front: +, back: -
    triangle    a2, L = hypot(a3, d4), side R^2 + Z^2                             elbow up: +, down: -
    wrist       Rz(theta_4) Rx(90) Rz(theta_5) Rx(-90) Rz(theta_6) = R_03^T R_06   no flip: J5 <= 0, flip: J5 > 0

``follow`` picks one branch for a whole program, keeps the turns of joints 1, 4 and 6 continuous, and refuses, with the
waypoint and joint named, what cannot be driven.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, distinct, extent
from compgen.core.evaluation import by_rows, evaluate
from compgen.core.exceptions import InputError, JointLimitError, SingularityError, UnreachableError
from compgen.core.units import DEG, MM
from compgen.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class Posture:
    """One of the eight branches."""

    front: bool = True
    up: bool = True
    flip: bool = False


ALL_POSTURES = tuple(Posture(f, u, w) for f in (True, False) for u in (True, False) for w in (False, True))


def check_arm_class(robot: Robot) -> None:
    """Raises InputError unless the closed form covers this arm."""
    twist = np.array([-90, 180, -90, 90, -90]) * DEG
    zero = np.concatenate([robot.d[[0, 1, 2, 4]], robot.a[3:]])
    right = np.allclose(robot.alpha[:5], twist) and np.isclose(abs(np.cos(robot.alpha[5])), 1) and not zero.any()
    if not (right and robot.d[3] < 0 and robot.d[5] < 0):
        raise InputError(
            f"robots/{robot.name}.toml: dh: no closed-form inverse kinematics for this arm; "
            "generate needs the layout of the M-710iC (parallel J2 and J3, spherical wrist)"
        )


def flange_of(position: Array, rotation: Array, tool_position: Array, tool_rotation: Array) -> tuple[Array, Array]:
    """Where the flange is when the tool is at a pose, (N, 3) [m] and (N, 3, 3)."""
    tool = np.concatenate([tool_position, tool_rotation.ravel()])[None]
    place, flange = evaluate(_flange(), position, rotation.reshape(-1, 9), tool)
    return place, flange.reshape(-1, 3, 3)


@lru_cache(maxsize=1)
def _flange() -> Any:
    """(tool position (3), rotation (9, row by row); TCP in the flange (12)) -> the flange's."""
    p, r, tool = ca.SX.sym("p", 3), ca.SX.sym("r", 9), ca.SX.sym("tool", 12)
    flange = ca.reshape(r, 3, 3).T @ ca.reshape(tool[3:], 3, 3)
    return ca.Function("flange", [p, r, tool], [p - flange @ tool[:3], ca.vec(flange.T)])


def forward(robot: Robot, theta: Array) -> tuple[Array, Array]:
    """Nominal flange poses of DH joint angles (N, 6) [rad]: what ``solve`` inverts, (N, 3) [m] and (N, 3, 3)."""
    position, rotation = np.zeros((len(theta), 3)), np.tile(np.eye(3), (len(theta), 1, 1))
    for angle, d, a, alpha in zip(theta.T, robot.d, robot.a, robot.alpha):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        zero = np.zeros_like(c)
        link = np.array([[c, -s * ca, s * sa], [s, c * ca, -c * sa], [zero, zero + sa, zero + ca]])
        position = position + np.einsum("nij,nj->ni", rotation, np.column_stack([a * c, a * s, zero + d]))
        rotation = rotation @ np.moveaxis(link, -1, 0)
    return position, rotation


def solve(robot: Robot, position: Array, rotation: Array, posture: Posture) -> tuple[Array, Array]:
    """DH joint angles of flange poses on one branch.

    Args:
        robot: Arm of the class above.
        position: Flange, (N, 3) [m].
        rotation: Flange, (N, 3, 3).
        posture: The branch.

    Returns:
        theta (N, 6) [rad] in (-pi, pi], and the margin (N,) [m] by which the wrist centre lies inside the reach of
        joints 2 and 3 (negative: out of reach, and theta there is the nearest stretched or folded arm).
    """
    theta, margin = evaluate(build_solve(robot, posture), position, rotation.reshape(-1, 9))
    return theta, margin[:, 0]


def solve_tool(
    robot: Robot, position: Array, rotation: Array, tool_position: Array, tool_rotation: Array, posture: Posture
) -> tuple[Array, Array]:
    """``solve`` for poses of the tool, (N, 3) [m] and (N, 3, 3), whose place in the flange is given."""
    tool = np.concatenate([tool_position, tool_rotation.ravel()])[None]
    theta, margin = evaluate(_build_solve_tool(robot, posture), position, rotation.reshape(-1, 9), tool)
    return theta, margin[:, 0]


@lru_cache(maxsize=32)
def _build_solve_tool(robot: Robot, posture: Posture) -> Any:
    """(tool position (3), rotation (9, row by row); TCP in the flange (12)) -> theta (6), margin."""
    p, rows, tool = ca.SX.sym("p", 3), ca.SX.sym("r", 9), ca.SX.sym("tool", 12)
    flange = ca.reshape(rows, 3, 3).T @ ca.reshape(tool[3:], 3, 3)
    return ca.Function("joints", [p, rows, tool], [*joints_expr(robot, posture, p - flange @ tool[:3], flange)])


@lru_cache(maxsize=32)
def build_solve(robot: Robot, posture: Posture) -> Any:
    """(flange position (3), rotation (9, row by row)) -> theta (6), margin."""
    position, rows = ca.SX.sym("p", 3), ca.SX.sym("r", 9)
    theta, margin = joints_expr(robot, posture, position, ca.reshape(rows, 3, 3).T)
    return ca.Function("joints", [position, rows], [theta, margin])


def joints_expr(robot: Robot, posture: Posture, position: Any, rotation: Any) -> tuple[Any, Any]:
    """``solve`` as expressions: theta (6, 1) and the margin, of a flange at (3, 1) and (3, 3)."""
    theta, _, _, margin = branch_expr(robot, posture, position, rotation)
    return theta, margin


def branch_expr(robot: Robot, posture: Posture, position: Any, rotation: Any) -> tuple[Any, Any, Any, Any]:
    """theta, cos theta and sin theta (6, 1 each) and the margin; the pairs cost no trigonometry at all."""
    a1, a2, a3 = (float(a) for a in robot.a[:3])
    d4, d6 = float(robot.d[3]), float(robot.d[5])
    sign6 = float(round(np.cos(robot.alpha[5])))  # the flange's z runs along sign6 times joint 6's axis
    front, up, flip = (1.0 if b else -1.0 for b in (posture.front, posture.up, posture.flip))
    W = position - sign6 * d6 * rotation[:, 2]
    theta1 = ca.atan2(front * W[1], front * W[0])
    out = ca.sqrt(W[0] * W[0] + W[1] * W[1])
    # at the J1 axis itself any angle of joint 1 will do: zero, as atan2 has it
    safe = ca.if_else(out > 0, out, 1.0)
    c1, s1 = ca.if_else(out > 0, front * W[0] / safe, 1.0), front * W[1] / safe
    R, Z = front * out - a1, W[2]

    L = float(np.hypot(a3, d4))
    D2 = R * R + Z * Z
    D = ca.sqrt(D2)
    margin = ca.fmin(a2 + L - D, D - abs(a2 - L))
    ce = ca.fmax(-1.0, ca.fmin(1.0, (D2 - a2 * a2 - L * L) / (2 * a2 * L)))
    se = up * ca.sqrt((1 - ce) * (1 + ce))  # e: turn from the upper arm down to the line elbow - wrist
    upper_arm = ca.atan2(Z, R) + ca.atan2(L * se, a2 + L * ce)  # elevation
    shift = float(np.arctan2(a3, -d4))
    forearm = upper_arm - ca.atan2(se, ce) - shift  # elevation of the forearm's axis
    theta2, theta3 = _wrap(-upper_arm), _wrap(forearm - upper_arm + np.pi / 2)
    # the same as pairs: (R + i Z) (a2 + L exp(i e)), turned back by e + shift for the forearm
    x, y = R * (a2 + L * ce) - Z * L * se, R * L * se + Z * (a2 + L * ce)
    size = ca.sqrt(x * x + y * y)
    size = ca.if_else(size > 0, size, 1.0)
    cu, su = x / size, y / size
    cb, sb = ce * np.cos(shift) - se * np.sin(shift), se * np.cos(shift) + ce * np.sin(shift)
    cf, sf = cu * cb + su * sb, su * cb - cu * sb

    # columns of R_03: x3 (up across the forearm), y3 (-joint 3 axis), z3 (back along the forearm)
    x3 = ca.vertcat(-c1 * sf, -s1 * sf, cf)
    z3 = ca.vertcat(-c1 * cf, -s1 * cf, -sf)
    y3 = ca.cross(z3, x3)
    M = ca.horzcat(x3, y3, z3).T @ rotation
    m13, m23, m33 = sign6 * M[0, 2], sign6 * M[1, 2], sign6 * M[2, 2]
    s5 = flip * ca.sqrt(m13 * m13 + m23 * m23)
    theta5 = ca.atan2(s5, m33)
    y4, x4, y6, x6 = -flip * m23, -flip * m13, -flip * sign6 * M[2, 1], flip * M[2, 0]
    theta = ca.vertcat(theta1, theta2, theta3, ca.atan2(y4, x4), theta5, ca.atan2(y6, x6))
    pairs = [(c1, s1), (cu, -su), (sb, cb), _pair(x4, y4), _pair(m33, s5), _pair(x6, y6)]
    return theta, ca.vertcat(*(c for c, _ in pairs)), ca.vertcat(*(s for _, s in pairs)), margin


def _pair(x: Any, y: Any) -> tuple[Any, Any]:
    """Cosine and sine of atan2(y, x)."""
    size = ca.sqrt(x * x + y * y)
    there = size > 0
    size = ca.if_else(there, size, 1.0)
    return ca.if_else(there, x / size, 1.0), y / size


def solve_all(robot: Robot, position: Array, rotation: Array) -> Array:
    """All eight branches, (N, 8, 6) [rad], in the order of ``ALL_POSTURES``; NaN where out of reach."""
    branches = []
    for posture in ALL_POSTURES:
        theta, margin = solve(robot, position, rotation, posture)
        branches.append(np.where(margin[:, None] >= 0, theta, np.nan))
    return np.stack(branches, axis=1)


def nearest_turns(theta: Array, reference: Array) -> Array:
    """The same angles with the whole turns that bring each nearest to a reference, (N, 6)."""
    return by_rows(lambda q, near: q + 2 * np.pi * np.round((near - q) / (2 * np.pi)), theta, reference)


def _unwrapped(robot: Robot, theta: Array) -> Array:
    """Continuous turns along a program; it starts with the legal turns nearest to pendant zero."""
    start = nearest_turns(theta[0], robot.pendant_zero)
    for turn in (2 * np.pi, -2 * np.pi):
        legal = (start >= robot.lower) & (start <= robot.upper)
        other = start + turn
        start = np.where(~legal & (other >= robot.lower) & (other <= robot.upper), other, start)
    return _continuous(theta, start)


def _continuous(theta: Array, start: Array) -> Array:
    """The same angles with whole turns added so that none jumps by more than half of one, from a start (6,) on."""
    out = theta
    for joint in range(theta.shape[1]):
        step = np.diff(theta[:, joint], prepend=start[joint])
        turned = np.flatnonzero(np.abs(step) > np.pi)
        if len(turned):
            out = theta.copy() if out is theta else out
            whole = np.zeros(len(theta))
            whole[turned] = np.ceil((step[turned] - np.pi) / (2 * np.pi))
            out[:, joint] -= 2 * np.pi * np.cumsum(whole)
    return out


def follow(robot: Robot, position: Array, rotation: Array, posture: Posture) -> Array:
    """Joint angles of a continuous program on one branch.

    Args:
        robot: Arm of the class above.
        position: Flange, (N, 3) [m].
        rotation: Flange, (N, 3, 3).
        posture: The branch kept throughout.

    Returns:
        theta, (N, 6) [rad], continuous.

    Raises:
        UnreachableError: A waypoint is out of reach.
        SingularityError: A waypoint, or the straight way to it, comes too near a singularity.
        JointLimitError: A waypoint needs an angle beyond a limit.
    """
    theta, margin = solve(robot, position, rotation, posture)
    _refuse_out_of_reach(position, margin)
    _refuse_shoulder(robot, position, rotation)
    _refuse_stretched(robot, margin)
    theta = _unwrapped(robot, theta)
    refuse_limits(robot, theta)
    _refuse_wrist(robot, theta)
    return theta


def _refuse_out_of_reach(position: Array, margin: Array) -> None:
    out = np.flatnonzero(margin < 0)
    if len(out):
        n = int(out[0])
        x, y, z = (float(v) for v in position[n])
        raise UnreachableError(n + 1, (x, y, z), float(-margin[n]), "beyond the stretch or fold")


def _refuse_shoulder(robot: Robot, position: Array, rotation: Array) -> None:
    """The wrist centre's distance from the J1 axis, at and between waypoints."""
    back = np.cos(robot.alpha[5]) * robot.d[5]
    x, y = (position[:, i] - back * rotation[:, i, 2] for i in (0, 1))
    dx, dy = np.diff(x), np.diff(y)
    size = dx * dx + dy * dy
    if np.sqrt((x * x + y * y).min()) - np.sqrt(size.max(initial=0.0)) > robot.shoulder_margin:
        return  # no step leads near enough
    u = np.clip(-(x[:-1] * dx + y[:-1] * dy) / np.where(size > 0, size, 1.0), 0, 1)
    distance = np.concatenate([np.hypot(x[:1], y[:1]), np.hypot(x[:-1] + u * dx, y[:-1] + u * dy)])
    near = np.flatnonzero(distance < robot.shoulder_margin)
    if len(near):
        n = int(near[np.argmin(distance[near])])
        raise SingularityError(
            n + 1, "J1", "shoulder", f"{distance[n] / MM:.1f} mm from the J1 axis", f"{robot.shoulder_margin / MM:g} mm"
        )


def _refuse_stretched(robot: Robot, margin: Array) -> None:
    near = np.flatnonzero(margin < robot.elbow_margin)
    if len(near):
        n = int(near[0])
        raise SingularityError(
            n + 1,
            "J3",
            "elbow",
            f"{margin[n] / MM:.2f} mm from full stretch or fold",
            f"{robot.elbow_margin / MM:g} mm",
        )


def _refuse_wrist(robot: Robot, theta: Array) -> None:
    """|J5| at waypoints; on one branch J5 keeps its sign, so it cannot cross zero unseen between them."""
    q5 = np.abs(theta[:, 4] - robot.pendant_zero[4])
    near = np.flatnonzero(q5 < robot.wrist_margin)
    # a wrist that swings round between two waypoints has passed zero
    jump = np.flatnonzero(np.abs(np.diff(theta[:, 3])) > np.pi / 2) + 1
    found = distinct(np.append(near, jump))
    if len(found):
        n = int(found[0])
        raise SingularityError(
            n + 1, "J5", "wrist", f"J5 = {q5[n] / DEG:.3f} deg from zero", f"{robot.wrist_margin / DEG:g} deg"
        )


def refuse_limits(robot: Robot, theta: Array) -> None:
    """Raises JointLimitError at the first waypoint beyond a limit, naming the joint that is farthest over."""
    lowest, highest = extent(theta)
    if np.all(lowest >= robot.lower - 1e-12) and np.all(highest <= robot.upper + 1e-12):
        return
    over = np.maximum(robot.lower - theta, theta - robot.upper)
    bad = np.flatnonzero((over > 1e-12).any(axis=1))
    if len(bad):
        n = int(bad[0])
        i = int(np.argmax(over[n]))
        zero = robot.pendant_zero[i]
        raise JointLimitError(
            n + 1,
            robot.joint_names[i],
            float(theta[n, i] - zero),
            float(robot.lower[i] - zero),
            float(robot.upper[i] - zero),
        )


def _wrap(angle: Any) -> Any:
    """Into (-pi, pi]; theta_3 of a legal arm may be quoted a turn away, which ``nearest_turns`` mends."""
    return angle + 2 * np.pi * ca.floor((np.pi - angle) / (2 * np.pi))
