r"""URDF files to the nominal arm: six joint axes at zero become lengths, zeros and signs of the class.

The class has the DH rows of ``inverse_kinematics``; an arm of it is told by its axes in any one pose:

    axis 1 upright, axis 2 across it, axis 3 along axis 2, axis 4 across axis 3;
    4, 5 and 6 meet in the wrist centre, each across the next; it lies in the plane of axis 1 across axis 2

    a1, a2, a3    distances of axes 1-2, 2-3, 3-4 (a1 and a3 with a sign)
    d4, d6        from axis 3's foot on axis 4 to the wrist centre, from there along axis 6 to the tip

World stands on axis 1 at the height of axis 2. Which angles theta the file's zero is, and which way its joints count,
is found by trying the eight postures: where all six axes of our chain lie on the file's, they are it.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, read_regular
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix
from compgen.core.units import DEG, MM
from compgen.robot.inverse_kinematics import ALL_POSTURES, solve_flange
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Controller, Robot

#: steps of an even spread over a turn of each joint: roots of x^7 = x + 1
STEPS = 1.1127756842787055 ** -np.arange(1.0, 7.0)
SAME = 1e-6  # m and rad: digits that files of rounded numbers have
MATCH = 1e-5  # m and rad over 1,000 poses
TIPS = ("flange", "tool0")  # names of an arm's end, the better one last
RIGHT = 90 * DEG
TURNS = ("revolute", "continuous")
ALPHA = np.array([-90, 180, -90, 90, -90, 180]) * DEG


class UrdfJoint(NamedTuple):
    """A joint of a file."""

    name: str
    kind: str
    parent: str
    child: str
    place: Pose  # in its parent
    axis: Array  # (3,) unit
    limits: tuple[float, float, float]  # [rad], [rad], [rad/s]; NaN: not given


@dataclass(frozen=True, eq=False, slots=True)
class UrdfArm:
    """What a file says of an arm of the class."""

    name: str
    joints: tuple[str, ...]
    a: Array  # (6,) [m]
    d: Array  # (6,) [m]
    zero: Array  # (6,) [rad] theta at the file's zero
    sign: Array  # (6,) of theta over the file's joints
    limits: Array  # (6, 3) [rad], [rad], [rad/s] of the file's joints
    base_height: float  # [m] of World over the file's base
    off: float  # [m] and [rad] largest difference from the file at 1,000 poses

    def __post_init__(self) -> None:
        own(self, a=(6,), d=(6,), zero=(6,), sign=(6,), limits=(6, 3))


def read_urdf(source: str) -> UrdfArm:
    """The arm of a file.

    Args:
        source: A URDF file with one chain of six turning joints from its base to its tip.

    Raises:
        InputError: Not readable, no URDF, another number or kind of joints, or an arm that is not of the class; names
            the joint and what misses.
    """
    joints = _chain(source, _joints(source))
    turning = [joint for joint in joints if joint.kind != "fixed"]
    return _arm_of(source, joints, turning)


def _joints(source: str) -> list[UrdfJoint]:
    mend = "give a URDF file"
    try:
        text = read_regular(source, MOST_TABLE_BYTES).decode()
    except OSError as exception:
        raise InputError(f"{source}: cannot be read: {exception.strerror}; {mend}") from None
    except ValueError:
        raise InputError(f"{source!r}: cannot be read: not UTF-8 text, or no file has such a name; {mend}") from None
    if "xacro:" in text:
        raise InputError(f"{source}: xacro macros; run xacro on it first, and give the URDF that it prints")
    if "<!DOCTYPE" in text:
        raise InputError(f"{source}: a document type of its own; {mend} without one")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as exception:
        raise InputError(f"{source}: line {exception.position[0]}: not XML: {exception.msg}; {mend}") from None
    if root.tag != "robot":
        raise InputError(f"{source}: no <robot>; {mend}")
    return [_joint(source, element) for element in root.findall("joint")]


def _joint(source: str, element: ElementTree.Element) -> UrdfJoint:
    name = element.get("name", "")
    where = f"{source}: joint '{name[:40]}'"

    def numbers(text: str | None, default: str, what: str) -> Array:
        try:
            values = np.array([float(word) for word in (text or default).split()])
        except ValueError:
            values = np.zeros(0)
        if len(values) != len(default.split()) or not np.isfinite(values).all():
            raise InputError(f"{where}: {what}: '{str(text)[:40]}' is not {len(default.split())} numbers; mend it")
        return values

    def part(tag: str) -> dict[str, str]:
        found = element.find(tag)
        return {} if found is None else dict(found.attrib)

    origin, limit = part("origin"), part("limit")
    rpy = numbers(origin.get("rpy"), "0 0 0", "origin rpy")
    place = Pose(numbers(origin.get("xyz"), "0 0 0", "origin xyz"), from_wpr(*(np.array([v]) for v in rpy))[0])
    axis = numbers(part("axis").get("xyz"), "1 0 0", "axis xyz")
    if not np.linalg.norm(axis) > 0:
        raise InputError(f"{where}: axis xyz: it has no direction; mend it")
    limits = tuple(
        float(numbers(limit[key], "0", f"limit {key}")[0]) if key in limit else np.nan
        for key in ("lower", "upper", "velocity")
    )
    parent, child = part("parent").get("link", ""), part("child").get("link", "")
    return UrdfJoint(
        name, element.get("type", ""), parent, child, place, axis / np.linalg.norm(axis),
        (limits[0], limits[1], limits[2]),
    )  # fmt: skip


def _chain(source: str, joints: list[UrdfJoint]) -> list[UrdfJoint]:
    """The joints from the base over the sixth that turns, to the tip where the file names one."""
    by_parent: dict[str, list[UrdfJoint]] = {}
    for joint in joints:
        by_parent.setdefault(joint.parent, []).append(joint)
    children = {joint.child for joint in joints}

    def turning(path: list[UrdfJoint]) -> int:
        return sum(joint.kind != "fixed" for joint in path)

    def rank(path: list[UrdfJoint]) -> tuple[int, int]:
        return turning(path), TIPS.index(path[-1].child) if path and path[-1].child in TIPS else -1

    best: list[UrdfJoint] = []
    stack: list[list[UrdfJoint]] = [[j] for name in by_parent if name not in children for j in by_parent[name]]
    while stack:
        path = stack.pop()
        if rank(path) > rank(best):
            best = path
        if len(path) <= len(joints):
            stack += [[*path, joint] for joint in by_parent.get(path[-1].child, [])]
    if turning(best) != 6:
        raise InputError(f"{source}: {turning(best)} moving joints in a row, not six; give one six-axis arm's file")
    other = next((j for j in best if j.kind not in (*TURNS, "fixed")), None)
    if other is not None:
        raise InputError(f"{source}: joint '{other.name[:40]}' is {other.kind[:20]}; the six joints of an arm turn")
    return best


def _poses(joints: list[UrdfJoint], q: Array) -> Pose:
    """Poses of the tip in the base, (N, 6) joints of the file [rad]."""
    N = len(q)
    position, rotation, column = np.zeros((N, 3)), np.tile(np.eye(3), (N, 1, 1)), 0
    for joint in joints:
        position = position + rotation @ joint.place.position
        rotation = rotation @ joint.place.rotation
        if joint.kind != "fixed":
            rotation = rotation @ rotation_matrix(q[:, [column]] * joint.axis)
            column += 1
    return Pose(position, rotation)


def _lines(joints: list[UrdfJoint]) -> tuple[Array, Array]:
    """Directions and points of the six axes at zero in the base, (6, 3) each."""
    position, rotation, lines = np.zeros(3), np.eye(3), []
    for joint in joints:
        position, rotation = position + rotation @ joint.place.position, rotation @ joint.place.rotation
        if joint.kind != "fixed":
            lines.append((rotation @ joint.axis, position))
    return np.array([w for w, _ in lines]), np.array([p for _, p in lines])


def _arm_of(source: str, joints: list[UrdfJoint], turning: list[UrdfJoint]) -> UrdfArm:
    w, p = _lines(joints)

    def refuse(what: str) -> InputError:
        return InputError(f"{source}: {what}; the closed form serves parallel J2 and J3 and a spherical wrist")

    if abs(w[0, 2]) < 1 - SAME:
        raise refuse(f"axis 1 ('{turning[0].name[:40]}') is not upright")
    for i, k, parallel in ((0, 1, False), (1, 2, True), (2, 3, False), (3, 4, False), (4, 5, False)):
        angle = np.arccos(np.clip(abs(w[i] @ w[k]), 0, 1))
        if abs(angle - (0.0 if parallel else np.pi / 2)) > 1e-3:
            raise refuse(
                f"axes {i + 1} and {k + 1} are {angle / DEG:.1f} deg to each other, not {'0' if parallel else '90'}"
            )
    wrist = _meeting(p[3], w[3], p[4], w[4])
    gaps = [float(np.linalg.norm(np.cross(w[i], wrist - p[i]))) for i in (3, 4, 5)]
    if max(gaps) > SAME:
        raise refuse(f"axes 4, 5 and 6 do not meet: they pass {2 * max(gaps) / MM:.1f} mm from each other")
    across = float((wrist - p[0]) @ w[1])
    if abs(across) > SAME:
        raise refuse(f"the wrist stands {abs(across) / MM:.1f} mm beside the plane of axis 1")
    height = p[1] + w[1] * (w[1] @ (p[0] - p[1]))
    origin = np.array([p[0, 0], p[0, 1], height[2]])
    tip = _poses(joints, np.zeros((1, 6)))[0]
    off_axis = float(np.linalg.norm(np.cross(w[5], tip.position - p[5])))
    if off_axis > SAME:
        raise refuse(f"the tip '{joints[-1].child[:40]}' is {off_axis / MM:.1f} mm off axis 6: a tool, not the flange")
    elbow = p[3] + w[3] * (w[3] @ (_on_plane(p[2], w[2], wrist) - p[3]))
    lengths = (
        float(np.hypot(*(_on_plane(p[1], w[1], wrist) - origin)[:2])),
        _gap(p[1], w[1], p[2]),
        float(np.linalg.norm(_on_plane(p[2], w[2], wrist) - elbow)),
        float(np.linalg.norm(wrist - elbow)),
        float(np.linalg.norm(tip.position - wrist)),
    )
    if lengths[1] < SAME or lengths[3] < SAME or lengths[4] < SAME:
        raise refuse("an upper arm, a forearm or a flange without a length")
    out = (tip.position - wrist) / lengths[4]
    flange = Pose(wrist - origin + lengths[4] * out, _standing(out, tip.rotation))
    found = []
    for s1, s3 in product((1.0, -1.0), (1.0, -1.0)):
        robot = _trial(np.array([s1 * lengths[0], lengths[1], s3 * lengths[2], 0, 0, 0]), lengths[3], lengths[4])
        for posture, other in product(ALL_POSTURES, (False, True)):
            zero = solve_flange(robot, Pose(flange.position[None], flange.rotation[None]), posture).theta[0]
            if other:  # the wrist's other way to the same pose, which the closed form does not tell at J5 = 0
                zero = np.array([*zero[:3], zero[3] + np.pi, -zero[4], zero[5] + np.pi])
            zero = np.pi - np.mod(np.pi - zero, 2 * np.pi)
            right = np.round(zero / RIGHT) * RIGHT
            zero = np.where(np.abs(zero - right) < SAME, right, zero)
            sign = _signs(robot, zero, w, p - origin)
            if sign is None:
                continue
            off = _largest_difference(robot, zero, sign, joints, origin)
            if off < MATCH:
                found.append((int((sign < 0).sum()), float(np.abs(zero).sum()), robot, zero, sign, off))
    if not found:
        raise refuse("its joints are no chain of the class")
    _, _, robot, zero, sign, off = min(found, key=lambda f: f[:2])
    limits = np.array([joint.limits for joint in turning])
    names = tuple(joint.name for joint in turning)
    return UrdfArm(Path(source).stem, names, robot.a, robot.d, zero, sign, limits, float(origin[2]), off)


def _meeting(p: Array, w: Array, q: Array, v: Array) -> Array:
    """The middle of the shortest way between two lines."""
    s, t = np.linalg.lstsq(np.column_stack([w, -v]), q - p, rcond=None)[0]
    return np.asarray((p + s * w + q + t * v) / 2)


def _on_plane(p: Array, w: Array, through: Array) -> Array:
    """Where a line meets the plane across it through a point."""
    return np.asarray(p + w * (w @ (through - p)))


def _gap(p: Array, w: Array, q: Array) -> float:
    """Distance of a point from a line [m]."""
    return float(np.linalg.norm(np.cross(w, q - p)))


def _standing(z: Array, rotation: Array) -> Array:
    """Axes with this z whose x is the tip's, or its y where that is along z."""
    x = rotation[:, 0] if abs(rotation[:, 0] @ z) < 0.9 else rotation[:, 1]
    x = x - z * (z @ x)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _trial(a: Array, d4: float, d6: float) -> Robot:
    """A nominal arm of these lengths, without limits."""
    controller = Controller(
        compensation="none", signature="", period=0.008, rounds_up_to_period=False, max_lines=1, max_positions=1,
        memory=1.0, name_length=8, decimals=3, turn_joints=(1, 4, 6),
    )  # fmt: skip
    big = np.full(6, 1e3)
    return Robot(
        name="trial", d=np.array([0, 0, 0, -d4, 0, -d6]), a=a, alpha=ALPHA, pendant_map=np.eye(6),
        pendant_zero=np.zeros(6), lower=-big, upper=big, joint_names=("J1", "J2", "J3", "J4", "J5", "J6"), speed=big,
        acceleration=big, jerk=big, shoulder_margin=0.0, elbow_margin=0.0, wrist_margin=0.0, controller=controller,
    )  # fmt: skip


def _signs(robot: Robot, zero: Array, w: Array, p: Array) -> Array | None:
    """Which way each joint of a file counts, (6,), where the chain's axes lie on the file's; None where they do not."""
    base, step = flange_pose(robot, zero[None])[0], np.pi / 2
    sign = np.empty(6)
    for i in range(6):
        turned = flange_pose(robot, (zero + step * np.eye(6)[i])[None])[0]
        turn = turned.rotation @ base.rotation.T
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
        along = float(axis @ w[i])
        moved = turn @ (base.position - p[i]) + p[i]  # a turn about the file's line takes the flange there
        if abs(abs(along) - 1) > MATCH or np.linalg.norm(moved - turned.position) > MATCH:
            return None
        sign[i] = np.sign(along)
    return sign


def _largest_difference(robot: Robot, zero: Array, sign: Array, joints: list[UrdfJoint], origin: Array) -> float:
    """Between our chain and the file at 1,000 poses, the tip's fixed turn against our flange apart [m] and [rad]."""
    q = 2 * np.pi * np.mod(np.arange(1, 1001)[:, None] * STEPS, 1.0)
    ours, its = flange_pose(robot, zero + sign * q), _poses(joints, q)
    start, there = flange_pose(robot, zero[None])[0], _poses(joints, np.zeros((1, 6)))[0]
    fixed = start.rotation.T @ there.rotation
    off = np.abs(ours.position - (its.position - origin)).max()
    return float(max(off, np.abs(ours.rotation @ fixed - its.rotation).max()))
