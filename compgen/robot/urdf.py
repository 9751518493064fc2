"""URDF files to the nominal arm of the class: six turning joints from a base to a flange."""

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from typing import NamedTuple
from xml.parsers.expat import errors

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import MOST_TABLE_BYTES, read_named
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix
from compgen.core.units import MM
from compgen.robot.arm_geometry import Axes, ClassArm, class_arm, spread_joints

MATCH = 1e-5  # m and rad over 1,000 poses
MOST_LENGTH = 10.0  # [m] of a link, along an axis of its joint
TIPS = ("flange", "tool0")  # names of an arm's end, the better one last
TURNS = ("revolute", "continuous")
UNBOUND = errors.codes[errors.XML_ERROR_UNBOUND_PREFIX]


class UrdfJoint(NamedTuple):
    """A joint of a file."""

    name: str
    kind: str
    parent: str
    child: str
    place: Pose  # in its parent
    axis: Array  # (3,) unit
    limits: tuple[float, float, float]  # [rad], [rad], [rad/s]; NaN: not given
    mimics: str | None  # the joint that it follows; None: it moves by itself


@dataclass(frozen=True, eq=False, slots=True)
@owns(limits=(6, 3))
class UrdfArm:
    """What a file says of an arm of the class."""

    arm: ClassArm  # from the file's zero
    joints: tuple[str, ...]
    limits: Array  # (6, 3) [rad], [rad], [rad/s] of the file's joints
    off: float  # [m] and [rad] largest difference from the file at 1,000 poses


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
    longest = max(float(np.abs(joint.place.position).max()) for joint in joints[joints.index(turning[0]) + 1 :])
    if longest > MOST_LENGTH:
        raise InputError(f"{source}: a link of {longest:g} m; a URDF file is in metres: is it in mm? export it anew")
    line, point = _lines(joints)
    with naming_file(source):
        arm = class_arm(Axes(line, point, _poses(joints, np.zeros((1, 6)))[0]))
    q = 2 * np.pi * spread_joints(1000)
    ours, its = arm.flange_pose(q), _poses(joints, q)
    off = float(np.abs(ours.position + arm.origin - its.position).max())
    off = max(off, float(np.abs(ours.rotation - its.rotation).max()))
    if off > MATCH:
        raise InputError(f"{source}: its axes are the class's to {off / MM:.2g} mm only; give more digits")
    return UrdfArm(arm, tuple(joint.name for joint in turning), np.array([joint.limits for joint in turning]), off)


def _joints(source: str) -> list[UrdfJoint]:
    mend = "give a URDF file"
    try:
        text = read_named(source, "give a URDF file", MOST_TABLE_BYTES).decode()
    except UnicodeDecodeError:
        raise InputError(f"{source}: cannot be read: it is not UTF-8 text; {mend}") from None
    macros = InputError(f"{source}: xacro macros; run xacro on it first, and give the URDF that it prints")
    if "<!DOCTYPE" in text:
        raise InputError(f"{source}: a document type of its own; {mend} without one")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as exception:
        if exception.code == UNBOUND and "xacro:" in re.sub("<!--.*?-->", "", text, flags=re.DOTALL):
            raise macros from None
        raise InputError(f"{source}: line {exception.position[0]}: not XML: {exception.msg}; {mend}") from None
    if any("xacro" in element.tag for element in root.iter()):  # not in comments, which xacro keeps
        raise macros
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
        inner = element.find(tag)
        return {} if inner is None else dict(inner.attrib)

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
        name=name,
        kind=element.get("type", ""),
        parent=parent,
        child=child,
        place=place,
        axis=axis / np.linalg.norm(axis),
        limits=(limits[0], limits[1], limits[2]),
        mimics=None if element.find("mimic") is None else part("mimic").get("joint", ""),
    )


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
    arms = list[str]()  # the sixth turning joint of each chain of six
    stack: list[list[UrdfJoint]] = [[j] for name in by_parent if name not in children for j in by_parent[name]]
    while stack:
        path = stack.pop()
        if rank(path) > rank(best):
            best = path
        if turning(path) == 6 and path[-1].kind != "fixed":
            arms.append(path[-1].name)
        if len(path) <= len(joints):
            stack += [[*path, joint] for joint in by_parent.get(path[-1].child, [])]
    _refuse_chain(source, best, by_parent, turning(best), arms)
    return best


def _refuse_chain(
    source: str, best: list[UrdfJoint], by_parent: dict[str, list[UrdfJoint]], turning: int, arms: list[str]
) -> None:
    """Refuse a longest chain that is no six-axis arm, or not surely the one that is meant."""
    if turning != 6:
        raise InputError(f"{source}: {turning} moving joints in a row, not six; give one six-axis arm's file")
    if len(arms) > 1:
        ends = ", ".join(name[:40] for name in arms[:3])
        raise InputError(f"{source}: {len(arms)} chains of six moving joints, ending in {ends}; give one arm's file")
    behind = [joint.child for joint in by_parent.get(best[-1].child, [])]
    if behind and best[-1].child not in TIPS:
        links = ", ".join(name[:40] for name in behind[:3])
        raise InputError(
            f"{source}: no link is named tool0 or flange, and behind '{best[-1].child[:40]}' come {links}: which is "
            "the flange? name it tool0"
        )
    other = next((j for j in best if j.kind not in (*TURNS, "fixed")), None)
    if other is not None:
        raise InputError(f"{source}: joint '{other.name[:40]}' is {other.kind[:20]}; the six joints of an arm turn")
    follower = next((j for j in best if j.mimics is not None), None)
    if follower is not None:
        raise InputError(
            f"{source}: joint '{follower.name[:40]}' mimics '{str(follower.mimics)[:40]}': it does not move by itself, "
            "as each of an arm's six joints does; give a file without <mimic>"
        )


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
