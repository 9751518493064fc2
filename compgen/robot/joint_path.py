"""The joint path of a program: one branch kept throughout, whole turns continuous, limits and singularities refused."""

import numpy as np

from compgen.core.arrays import Array, column_extremes, first_true
from compgen.core.evaluation import map_rows
from compgen.core.exceptions import InterferenceError, JointLimitError, SingularityError, UnreachableError
from compgen.core.pose import Pose
from compgen.core.units import DEG, MM
from compgen.robot.inverse_kinematics import Posture, solve_flange
from compgen.robot.robot import Robot

LIMIT_TOLERANCE = 1e-12  # rad


def follow_branch(robot: Robot, flange: Pose, posture: Posture) -> Array:
    """Joint angles of a continuous program on one branch.

    Args:
        robot: Arm of the class that ``check_arm_class`` accepts.
        flange: N poses in World.
        posture: The branch kept throughout.

    Returns:
        theta (N, 6) [rad], continuous: no step of a joint is longer than half a turn.

    Raises:
        UnreachableError: A waypoint is out of reach.
        SingularityError: A waypoint, or the straight way to it, comes too near a singularity.
        JointLimitError: A waypoint needs an angle beyond a limit.
        InterferenceError: J2 and J3 together are where the arm hits itself, at a waypoint or on the way to it.
    """
    theta, margin = solve_flange(robot, flange, posture)
    _check_reach(flange.position, margin)
    _check_shoulder(robot, flange)
    _check_elbow(robot, margin)
    near = robot.pendant_zero.copy()
    near[2] = theta[0, 2]  # the closed form tells it
    theta = _unwrap(theta, legal_turns(robot, nearest_turns(theta[0], near)))
    check_joint_limits(robot, theta)
    check_interference(robot, theta)
    _check_wrist(robot, theta)
    return theta


def legal_turns(robot: Robot, theta: Array) -> Array:
    """Joint angles (..., 6) [rad], those beyond a limit turned once round where that is inside the limits.

    A range of more than half a turn to one side (J2 + J3 from -160 to 280 deg) has legal angles beyond 180 deg.
    """
    for turn in (2 * np.pi, -2 * np.pi):
        is_legal = (theta >= robot.lower) & (theta <= robot.upper)
        if is_legal.all():
            break
        turned = theta + turn
        theta = np.where(~is_legal & (turned >= robot.lower) & (turned <= robot.upper), turned, theta)
    return theta


def _unwrap(theta: Array, start: Array) -> Array:
    """theta (N, 6) [rad] with whole turns added so that no joint jumps by more than half of one, from start (6,) on."""
    unwrapped = theta
    for joint in range(theta.shape[1]):
        step = np.diff(theta[:, joint], prepend=start[joint])
        jumps = np.flatnonzero(np.abs(step) > np.pi)
        if len(jumps):
            unwrapped = theta.copy() if unwrapped is theta else unwrapped
            turns = np.zeros(len(theta))
            turns[jumps] = np.ceil((step[jumps] - np.pi) / (2 * np.pi))
            unwrapped[:, joint] -= 2 * np.pi * np.cumsum(turns)
    return unwrapped


def arm_spread(robot: Robot, theta: Array) -> Array:
    """How much load the arm holds off the J1 axis: squares of the elbow's and the wrist's distance from it, (N,) [m2].

    The elbow is where the forearm's axis begins. By this the means of FANUC's motion code grow (docs/motion.md).
    """
    wrist = wrist_centre(robot, theta)[:, 0]
    elbow = wrist + robot.d[3] * np.cos(theta[:, 2] - theta[:, 1] - np.pi / 2)
    return np.asarray(wrist**2 + elbow**2)


def wrist_centre(robot: Robot, theta: Array) -> Array:
    """Wrist centres in the plane of the arm, (N, 2) [m]: in front of the J1 axis, negative behind it, and above J2."""
    upper, forearm = -theta[:, 1], theta[:, 2] - theta[:, 1] - np.pi / 2  # elevations
    out = robot.a[0] + robot.a[1] * np.cos(upper) - robot.d[3] * np.cos(forearm) - robot.a[2] * np.sin(forearm)
    above = robot.a[1] * np.sin(upper) - robot.d[3] * np.sin(forearm) + robot.a[2] * np.cos(forearm)
    return np.column_stack([out, above])


def elbow_margins(robot: Robot, theta: Array) -> Array:
    """How far the wrist centre is from where the arm is stretched or folded, (N,) [m]."""
    forearm = float(np.hypot(robot.a[2], robot.d[3]))
    reach = np.linalg.norm(wrist_centre(robot, theta) - [robot.a[0], 0.0], axis=1)
    return np.asarray(np.minimum(robot.a[1] + forearm - reach, reach - abs(robot.a[1] - forearm)))


def nearest_turns(theta: Array, reference: Array) -> Array:
    """Joint angles with the whole turns that bring each nearest to a reference, (N, 6) [rad]."""
    return map_rows(lambda q, near: q + 2 * np.pi * np.round((near - q) / (2 * np.pi)), theta, reference)


def check_joint_limits(robot: Robot, theta: Array) -> None:
    """Raises JointLimitError at the first of the joint angles (N, 6) [rad] beyond a limit.

    The exception names the waypoint and its joint that is farthest over.
    """
    lowest, highest = column_extremes(theta)
    if np.all(lowest >= robot.lower - LIMIT_TOLERANCE) and np.all(highest <= robot.upper + LIMIT_TOLERANCE):
        return
    excess = np.maximum(robot.lower - theta, theta - robot.upper)
    n = first_true(np.asarray((excess > LIMIT_TOLERANCE).any(axis=1)))
    if n is not None:
        i = int(np.argmax(excess[n]))
        lower, upper = robot.quoted_limits[:, i].tolist()
        raise JointLimitError(n + 1, robot.joint_names[i], float(robot.as_quoted(theta[n])[i]), lower, upper)


def check_interference(robot: Robot, theta: Array) -> None:
    """Raises InterferenceError at the first of the joints (N, 6) [rad] outside the polygon, or past it on the way."""
    area = robot.interference
    if area is None:
        return
    clearance = area.clearance(theta)
    outside = clearance < -LIMIT_TOLERANCE
    outside[1:] |= area.crossed(theta)
    n = first_true(outside)
    if n is not None:
        j2, j3 = area.plane(theta[n : n + 1])[0]
        raise InterferenceError(n + 1, float(j2), float(j3), float(-clearance[n]))


def _check_reach(position: Array, margin: Array) -> None:
    """Raises UnreachableError where the margin (N,) [m] of ``solve_flange`` is negative."""
    n = first_true(margin < 0)
    if n is not None:
        x, y, z = (float(v) for v in position[n])
        raise UnreachableError(n + 1, (x, y, z), float(-margin[n]), "beyond the stretch or fold")


def _check_shoulder(robot: Robot, flange: Pose) -> None:
    """Raises SingularityError where the wrist centre nears the J1 axis, at and between waypoints."""
    back = np.cos(robot.alpha[5]) * robot.d[5]
    x, y = (flange.position[:, i] - back * flange.rotation[:, i, 2] for i in (0, 1))
    dx, dy = np.diff(x), np.diff(y)
    step_squared = dx * dx + dy * dy
    if np.sqrt((x * x + y * y).min()) - np.sqrt(step_squared.max(initial=0.0)) > robot.shoulder_margin:
        return  # no step leads near enough
    u = np.clip(-(x[:-1] * dx + y[:-1] * dy) / np.where(step_squared > 0, step_squared, 1.0), 0, 1)
    distance = np.concatenate([np.hypot(x[:1], y[:1]), np.hypot(x[:-1] + u * dx, y[:-1] + u * dy)])
    waypoints = np.flatnonzero(distance < robot.shoulder_margin)
    if len(waypoints):
        n = int(waypoints[np.argmin(distance[waypoints])])
        raise SingularityError(
            n + 1, "J1", "shoulder", f"{distance[n] / MM:.1f} mm from the J1 axis", f"{robot.shoulder_margin / MM:g} mm"
        )


def _check_elbow(robot: Robot, margin: Array) -> None:
    """Raises SingularityError where the arm is nearly stretched or folded, by the margin (N,) [m]."""
    n = first_true(margin < robot.elbow_margin)
    if n is not None:
        distance = f"{margin[n] / MM:.2f} mm from full stretch or fold"
        raise SingularityError(n + 1, "J3", "elbow", distance, f"{robot.elbow_margin / MM:g} mm")


def _check_wrist(robot: Robot, theta: Array) -> None:
    """Raises SingularityError where J5 nears zero; on one branch J5 keeps its sign, so it cannot cross zero unseen."""
    q5 = np.abs(theta[:, 4])
    near = q5 < robot.wrist_margin
    near[1:] |= np.abs(np.diff(theta[:, 3])) > np.pi / 2  # a wrist that swings round in between has passed zero
    n = first_true(near)
    if n is not None:
        raise SingularityError(
            n + 1, "J5", "wrist", f"J5 = {q5[n] / DEG:.3f} deg from zero", f"{robot.wrist_margin / DEG:g} deg"
        )
