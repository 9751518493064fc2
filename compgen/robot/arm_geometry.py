r"""Six joint axes in any one pose to the nominal arm of the class: lengths, zero and signs.

The class has the DH rows of ``inverse_kinematics``; an arm of it is told by its axes:

    axis 1 upright, axis 2 across it, axis 3 along axis 2, axis 4 across axis 3;
    4, 5 and 6 meet in the wrist centre, each across the next; it lies in the plane of axis 1 across axis 2

    a1, a2, a3    distances of axes 1-2, 2-3, 3-4 (a1 forward, a3 with a sign)
    d4, d6        from axis 3's foot on axis 4 to the wrist centre, from there along axis 6 to the flange

World stands on axis 1 at the height of axis 2. Which angles theta the pose is, and which way its joints count, is found
by trying the eight postures: where all six axes of our chain lie on the given ones, theta = zero + sign q.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM
from compgen.robot.inverse_kinematics import ALL_POSTURES, is_class, solve_flange
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Capacity, Controller, Robot

SAME = 1e-6  # m and rad: digits that files of rounded numbers have
MATCH = 1e-5  # m and rad of an axis of ours from a given one
UPRIGHT = 1e-3  # rad that axes may be off a right angle
RIGHT = 90 * DEG
STRAIGHT, BEND = 0.99, 1.0  # |cosine| of axes 4 and 6 from where a wrist is straight; [rad]
ALPHA = np.array([-90, 180, -90, 90, -90]) * DEG


#: steps of an even spread over six dimensions: roots of x^7 = x + 1 (Roberts 2018)
STEPS = 1.1127756842787055 ** -np.arange(1.0, 7.0)


@dataclass(frozen=True, eq=False, slots=True)
@owns(line=(6, 3), point=(6, 3))
class Axes:
    """Six joint axes in one pose, and the flange there."""

    line: Array  # (6, 3) unit vectors, as the joints count
    point: Array  # (6, 3) [m]
    flange: Pose


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(a=(6,), d=(6,), alpha=(6,), zero=(6,), sign=(6,), origin=(3,), turned=(3, 3))
class ClassArm:
    """An arm of the class: theta = zero + sign q of joints q counted from the pose that it was read in."""

    a: Array  # (6,) [m]
    d: Array  # (6,) [m]
    alpha: Array  # (6,) [rad]
    zero: Array  # (6,) [rad]
    sign: Array  # (6,)
    origin: Array  # (3,) [m] World's in the axes' frame
    turned: Array  # (3, 3) the given flange in ours

    def flange_pose(self, q: Array) -> Pose:
        """The given flange in World, of joints (N, 6) [rad]."""
        ours = flange_pose(_trial(self.a, self.d, self.alpha), self.zero + self.sign * q)
        return Pose(ours.position, ours.rotation @ self.turned)


def spread_joints(count: int) -> Array:
    """Joints spread evenly over their ranges, 0 to 1, (N, 6); the same at every call."""
    return np.asarray(np.mod(0.5 + np.arange(1, count + 1)[:, None] * STEPS, 1.0))


def axes_of_poses(poses: Pose) -> Axes:
    """The axes of an arm from its flange in a pose, and after a quarter turn of each joint alone, 7 poses."""
    flange = poses[0]
    lines: list[Array] = []
    points: list[Array] = []
    for i in range(1, 7):
        turn = poses[i].rotation @ flange.rotation.T
        shift = poses[i].position - turn @ flange.position
        w = _axis(turn)
        w /= np.linalg.norm(w)
        # of all p with p = turn p + shift the one nearest to the line before; along w any p will do
        before = points[-1] if points else np.zeros(3)
        points.append(np.asarray(np.linalg.solve(np.eye(3) - turn + np.outer(w, w), shift + w * (w @ before))))
        lines.append(w)
    return Axes(np.array(lines), np.array(points), flange)


def in_class_rows(robot: Robot) -> Robot:
    """The robot with the DH rows of the class, where its own are another way to write such an arm; else itself.

    A data sheet may count axes and lengths the other way. With r the pendant's angles as limits are quoted, theta of
    the class is zero + sign r, the signs those of the pendant where that can be. World stays where it is.
    """
    if is_class(robot):
        return robot
    way = robot.pendant_way
    if not way.all():
        return robot
    steps = RIGHT * np.vstack([np.zeros(6), np.diag(way)])
    try:
        arm = class_arm(axes_of_poses(flange_pose(robot, robot.pendant_zero + steps)))
    except InputError:
        return robot
    if np.abs(arm.origin).max() > SAME or np.abs(arm.turned - np.eye(3)).max() > SAME:
        return robot
    turn = arm.sign * way  # of theta of the class over theta of its rows
    ends = arm.zero + turn * (np.array([robot.lower, robot.upper]) - robot.pendant_zero)
    return replace(
        robot,
        a=arm.a,
        d=arm.d,
        alpha=arm.alpha,
        pendant_map=turn[:, None] * robot.pendant_map,
        pendant_zero=arm.zero,
        lower=ends.min(axis=0),
        upper=ends.max(axis=0),
    )


def class_arm(axes: Axes) -> ClassArm:
    """The arm of the class that has these axes.

    Raises:
        InputError: It is none; the message says what misses, and begins with no file.
    """
    w, p, flange = axes.line, axes.point, axes.flange
    if abs(w[3] @ w[5]) > STRAIGHT and abs(w[3] @ w[4]) < STRAIGHT:
        # a straight wrist does not tell joint 4 from joint 6: bend it
        arm, bend = class_arm(_bent(axes)), BEND * np.eye(6)[4]
        return replace(arm, zero=_plain(arm.zero - arm.sign * bend))
    wrist = _wrist(axes)
    shoulder, elbow = (_on_plane(p[i], w[i], wrist) for i in (1, 2))
    foot = _on_plane(p[3], w[3], elbow)
    origin = np.array([p[0, 0], p[0, 1], shoulder[2]])
    a1, a2, a3 = (float(np.linalg.norm(v)) for v in (shoulder - origin, elbow - shoulder, elbow - foot))
    d4, d6 = float(np.linalg.norm(wrist - foot)), float(np.linalg.norm(flange.position - wrist))
    if min(a2, d4, d6) < SAME:
        raise _no_class("an upper arm, a forearm or a flange without a length")
    out = (flange.position - wrist) / d6
    along = float(flange.rotation[:, 2] @ out)
    own_axes = abs(abs(along) - 1) < SAME  # a flange whose z runs along axis 6 keeps its axes
    rotation = flange.rotation if own_axes else _standing(out, flange.rotation)
    alpha = np.append(ALPHA, np.pi if not own_axes or along > 0 else 0.0)
    pose = Pose((flange.position - origin)[None], rotation[None])
    arms: list[tuple[int, float, ClassArm]] = []
    for s3 in (1.0, -1.0):
        a, d = np.array([a1, a2, s3 * a3, 0, 0, 0]), np.array([0, 0, 0, -d4, 0, -d6])
        robot = _trial(a, d, alpha)
        for posture in ALL_POSTURES:
            zero = _plain(solve_flange(robot, pose, posture).theta[0])
            sign = _signs(robot, zero, w, p - origin)
            if sign is not None:
                arm = ClassArm(
                    a=a, d=d, alpha=alpha, zero=zero, sign=sign, origin=origin, turned=rotation.T @ flange.rotation
                )
                arms.append((int((sign < 0).sum()), float(np.abs(zero).sum()), arm))
    if not arms:
        raise _no_class("its joints are no chain of the class")
    return min(arms, key=lambda arm: arm[:2])[2]


def _wrist(axes: Axes) -> Array:
    """Where the last three axes meet, (3,) [m], of axes that stand to each other as the class's do.

    Raises:
        InputError: They do not.
    """
    w, p = axes.line, axes.point
    if abs(w[0, 2]) < np.cos(UPRIGHT):
        raise _no_class("axis 1 is not upright")
    for i, k, angle in ((0, 1, 90), (1, 2, 0), (2, 3, 90), (3, 4, 90), (4, 5, 90)):
        between = np.arccos(np.clip(abs(w[i] @ w[k]), 0, 1)) / DEG
        if abs(between - angle) * DEG > UPRIGHT:
            raise _no_class(f"axes {i + 1} and {k + 1} are {between:.6g} deg to each other, not {angle}")
    wrist = _meeting(p[3], w[3], p[4], w[4])
    gap = max(_distance(p[i], w[i], wrist) for i in (3, 4, 5))
    beside = abs(float((wrist - p[0]) @ w[1]))
    off = _distance(p[5], w[5], axes.flange.position)
    for misses, what in (
        (gap, f"axes 4, 5 and 6 do not meet: one passes {gap / MM:.3g} mm from where the wrist is"),
        (beside, f"the wrist stands {beside / MM:.3g} mm beside the plane of axis 1"),
        (off, f"the flange is {off / MM:.3g} mm off axis 6: a tool, not the flange"),
    ):
        if misses > SAME:
            raise _no_class(what)
    return wrist


def _no_class(what: str) -> InputError:
    return InputError(f"{what}; the closed form serves parallel J2 and J3 and a spherical wrist")


def _bent(axes: Axes) -> Axes:
    """The axes and the flange with joint 5 turned by ``BEND``."""
    turn, p = rotation_matrix(BEND * axes.line[4]), axes.point[4]
    line, point = axes.line.copy(), axes.point.copy()
    line[5], point[5] = turn @ line[5], p + turn @ (point[5] - p)
    return Axes(line, point, Pose(p + turn @ (axes.flange.position - p), turn @ axes.flange.rotation))


def _plain(zero: Array) -> Array:
    """Angles in (-pi, pi], right angles to the last bit."""
    zero = np.pi - np.mod(np.pi - zero, 2 * np.pi)
    right = np.round(zero / RIGHT) * RIGHT
    return np.where(np.abs(zero - right) < SAME, np.where(right <= -np.pi, np.pi, right), zero)


def _meeting(p: Array, w: Array, q: Array, v: Array) -> Array:
    """The middle of the shortest way between two lines."""
    s, t = np.linalg.lstsq(np.column_stack([w, -v]), q - p, rcond=None)[0]
    return np.asarray((p + s * w + q + t * v) / 2)


def _on_plane(p: Array, w: Array, through: Array) -> Array:
    """Where a line meets the plane across it through a point."""
    return np.asarray(p + w * (w @ (through - p)))


def _distance(p: Array, w: Array, q: Array) -> float:
    """Of a point from a line [m]."""
    return float(np.linalg.norm(np.cross(w, q - p)))


def _standing(z: Array, rotation: Array) -> Array:
    """Axes with this z whose x is near a given frame's x, or its y where that is along z."""
    x = rotation[:, 0] if abs(rotation[:, 0] @ z) < 0.9 else rotation[:, 1]
    x = x - z * (z @ x)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _signs(robot: Robot, zero: Array, w: Array, p: Array) -> Array | None:
    """Which way each given joint counts, (6,), where the chain's axes lie on the given ones; None where they do not."""
    poses = flange_pose(robot, zero + RIGHT * np.vstack([np.zeros(6), np.eye(6)]))
    sign = np.empty(6)
    for i in range(6):
        turn = poses.rotation[i + 1] @ poses.rotation[0].T
        along = float(_axis(turn) @ w[i])
        moved = turn @ (poses.position[0] - p[i]) + p[i]  # a turn about the given line takes the flange there
        if abs(abs(along) - 1) > MATCH or np.linalg.norm(moved - poses.position[i + 1]) > MATCH:
            return None
        sign[i] = np.sign(along)
    return sign


def _axis(turn: Array) -> Array:
    """The axis of a rotation times the sine of its angle, (3,)."""
    return np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2


def _trial(a: Array, d: Array, alpha: Array) -> Robot:
    """A nominal arm of these rows, without limits."""
    controller = Controller(
        compensation="none",
        signature="",
        period=0.008,
        rounds_up_to_period=False,
        capacity=Capacity(1, 1, 1.0, 8),
        decimals=3,
        turn_joints=(1, 4, 6),
    )
    big = np.full(6, 1e3)
    return Robot(
        name="trial",
        d=d,
        a=a,
        alpha=alpha,
        pendant_map=np.eye(6),
        pendant_zero=np.zeros(6),
        lower=-big,
        upper=big,
        joint_names=("J1", "J2", "J3", "J4", "J5", "J6"),
        speed=big,
        acceleration=big,
        jerk=big,
        shoulder_margin=0.0,
        elbow_margin=0.0,
        wrist_margin=0.0,
        controller=controller,
    )
