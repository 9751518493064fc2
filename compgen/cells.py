"""Robot files to cells: TOML with overrides, checked against ``schema``, turned into SI."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compgen import __version__
from compgen import schema as sc
from compgen.exceptions import InputError
from compgen.faults import read_box, read_sources
from compgen.ik import check_arm_class
from compgen.reading import check, find_robot, override, read_toml
from compgen.robot import Controller, Robot
from compgen.sources import Known, ThermalGrowth
from compgen.units import DEG, KB, MM, MS

if TYPE_CHECKING:
    from compgen.job import Cell
    from compgen.thermal import NodeModel, Profile
    from compgen.thermal.network import Network


def load_robot(name: str) -> Robot:
    """A robot's nominal facts, by name or file.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    robot = load_any_robot(name)
    check_arm_class(robot)
    return robot


def load_any_robot(name: str) -> Robot:
    """A robot's nominal facts, also of an arm that has no closed-form inverse kinematics here.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    source = find_robot(name, Path("."))
    return robot_of(check(sc.RobotFile, read_toml(source, "robots"), str(source)), str(source))


@dataclass(frozen=True, eq=False, slots=True)
class Arm:
    """A robot file of any serial arm, as far as measuring needs it."""

    source: str
    text: str
    robot: Robot
    nodes: tuple[str, ...]  # of the heat model; none without one
    known: tuple[Known, ...]
    identified: sc.IdentifiedTable | None


def load_arm(name: str) -> Arm:
    """A robot of any arm class, with its error sources.

    Raises:
        InputError: Unknown, or anything wrong in its file.
    """
    source = find_robot(name, Path("."))
    facts = check(sc.RobotFile, read_toml(source, "robots"), str(source))
    where = str(source)
    robot = robot_of(facts, where)
    nodes: tuple[str, ...] = ()
    growth = ThermalGrowth(np.zeros((6, 1)), np.zeros((6, 1)))
    if facts.thermal is not None:
        heat, _, growth = _warmth(facts, robot, where)
        nodes = heat.names
    known = read_sources(facts.sources, growth, robot, nodes, where)
    return Arm(where, source.read_text(encoding="utf-8"), robot, nodes, known, facts.identified)


def load_cell(name: str, overrides: Sequence[str] = ()) -> "Cell":
    """A robot with its warmth and its errors, by name or file.

    Args:
        name: Name or file of a robot.
        overrides: ``key=value``, dotted, into the robot file; a leading ``robot.`` may stand before the key.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    if name == "":
        raise InputError("--robot: an empty name; give a robot's name or file")
    refuse_unprintable(overrides)
    source = find_robot(name, Path("."))
    data = read_toml(source, "robots")
    for item in overrides:
        override(data, item.removeprefix("robot."), item)
    return cell_of(data, str(source), overrides)


def cell_of(data: dict[str, Any], where: str, overrides: Sequence[str]) -> "Cell":
    """The cell that a robot file's tables describe.

    Raises:
        InputError: Anything wrong, naming file and key.
    """
    from compgen.job import Cell  # here, so that a robot's nominal facts are read without the libraries of a job

    facts = check(sc.RobotFile, data, where)
    _refuse_double(facts, where)
    robot = robot_of(facts, where)
    check_arm_class(robot)
    heat, profiles, growth = _warmth(facts, robot, where)
    known = read_sources(facts.sources, growth, robot, heat.names, where)
    inputs = json.dumps([__version__, data], sort_keys=True, default=str)
    return Cell(
        robot=robot,
        heat=heat,
        profiles=profiles,
        known=known,
        sources=tuple(k.source for k in known),
        joint_box=read_box(facts.sources, where),
        sensors=facts.thermal.sensors if facts.thermal else {},
        overrides=tuple(overrides),
        inputs_hash=sha256(inputs.encode()).hexdigest(),
    )


def refuse_unprintable(overrides: Sequence[str]) -> None:
    """Raises InputError for an override that would garble a message."""
    for item in overrides:
        if not item.isprintable():
            raise InputError(f"--set {item!r}: it holds what is not printable text; mend it")


def _refuse_double(facts: sc.RobotFile, where: str) -> None:
    """Raises InputError when the controller may correct what the file's parameters correct as well."""
    controller = facts.controller
    if controller.compensation == "unknown":
        raise InputError(
            f"{where}: controller.compensation: 'unknown' is refused, a correction could be applied twice; "
            "find out whether the controller corrects its own geometry and set 'none' or 'signature'"
        )
    active = controller.signature if controller.compensation == "signature" else ""
    if controller.compensation == "signature" and not active:
        raise InputError(
            f"{where}: controller.signature: missing; compensation = 'signature' needs the name of the calibration "
            "that is active on the controller"
        )
    if active != controller.identified_with:
        have = f"'{controller.identified_with}'" if controller.identified_with else "no calibration"
        now = f"'{active}'" if active else "none"
        raise InputError(
            f"{where}: controller.identified_with: the errors of this file were identified with {have} active, now "
            f"{now} is: corrections would be applied twice or wrongly; identify again, or mend the entry"
        )


def robot_of(facts: sc.RobotFile, where: str) -> Robot:
    """A robot's nominal facts."""
    limits = facts.limits
    coupled = limits.j2_plus_j3_deg is not None
    third = limits.j2_plus_j3_deg if limits.j2_plus_j3_deg is not None else limits.j3_deg
    if third is None or (coupled and limits.j3_deg is not None):
        told = "missing" if third is None else "conflicts with limits.j3_deg"
        raise InputError(f"{where}: limits.j2_plus_j3_deg: {told}; give it, or j3_deg where the pendant is not coupled")
    ranges = [limits.j1_deg, limits.j2_deg, third, limits.j4_deg, limits.j5_deg, limits.j6_deg]
    names = ["j1_deg", "j2_deg", "j2_plus_j3_deg" if coupled else "j3_deg", "j4_deg", "j5_deg", "j6_deg"]
    for name, pair in zip(names, ranges):
        if pair[0] >= pair[1]:
            raise InputError(f"{where}: limits.{name}: {pair} must rise; give the lower limit first")
    bounds = np.array(ranges) * DEG
    zero = np.array(facts.pendant.offset_deg) * DEG
    matrix = np.array(facts.pendant.matrix)
    if abs(np.linalg.det(matrix)) < 1e-9:
        raise InputError(f"{where}: pendant.matrix: it cannot be inverted; each joint needs its row")
    controller = facts.controller
    if len(set(controller.turn_joints)) != 3:
        raise InputError(f"{where}: controller.turn_joints: {controller.turn_joints} names a joint twice; name three")
    robot = Robot(
        name=facts.name,
        d=np.array(facts.dh.d_mm) * MM,
        a=np.array(facts.dh.a_mm) * MM,
        alpha=np.array(facts.dh.alpha_deg) * DEG,
        pendant_map=matrix,
        pendant_zero=zero,
        lower=bounds[:, 0] + zero,
        upper=bounds[:, 1] + zero,
        joint_names=("J1", "J2", "J2+J3" if coupled else "J3", "J4", "J5", "J6"),
        speed=np.array(limits.speed_deg_s) * DEG,
        acceleration=np.array(limits.acceleration_deg_s2) * DEG,
        jerk=np.array(limits.jerk_deg_s3) * DEG,
        shoulder_margin=facts.singularity.shoulder_mm * MM,
        elbow_margin=facts.singularity.elbow_mm * MM,
        wrist_margin=facts.singularity.wrist_deg * DEG,
        controller=Controller(
            compensation="signature" if controller.compensation == "signature" else "none",
            signature=controller.signature,
            period=controller.interpolation_ms * MS,
            max_lines=controller.max_lines,
            max_positions=controller.max_positions,
            memory=controller.memory_kB * KB,
            name_length=controller.name_length,
            decimals=controller.decimals,
            turn_joints=(controller.turn_joints[0], controller.turn_joints[1], controller.turn_joints[2]),
        ),
    )
    return robot


def _warmth(
    facts: sc.RobotFile, robot: Robot, where: str
) -> "tuple[NodeModel | Network, tuple[Profile, ...], ThermalGrowth]":
    """The heat model, the profiles along its links, and how they grow."""
    from compgen import heating  # here, for the same reason as ``Cell``

    if facts.thermal is None:
        raise InputError(f"{where}: thermal: missing; add the table, a program is corrected for its warmth")
    profiles = heating.profiles(facts.thermal, robot, where)
    nodes = heating.node_model(facts.thermal, profiles, where)
    heat: NodeModel | Network = nodes
    if facts.thermal.model == "network":
        heat, profiles = heating.network(facts.thermal, robot, nodes, where)
    return heat, profiles, ThermalGrowth(*heating.growth(robot, heat.names, heat.reference_rise, profiles))
