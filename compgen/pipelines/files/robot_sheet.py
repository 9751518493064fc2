"""What a robot file says of an arm, for comparing with its data sheet and its pendant: reach, limits, poses at zero.

A robot file for other software: its arm, identified or not, cold or with its nodes at given rises.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.toml import suggest
from compgen.core.units import DEG, UM
from compgen.error_model.rigid_chain import POSES, RigidChain, rigid_chain
from compgen.pipelines.files.robot_file import Arm, load_arm
from compgen.program.digits import pose_numbers
from compgen.robot.configuration import config_letters, postures_of, turn_digits
from compgen.robot.inverse_kinematics import check_arm_class
from compgen.robot.kinematics import flange_pose, frames_at_zero, joint_places
from compgen.robot.robot import Robot

STEPS, ROUNDS = 61, 3  # of each joint's range, where reach is looked for, and how often closer
TURN = 30.0  # deg by which each joint is turned for the table
DOWN = -90.0  # deg of J5 that bring the tool of FANUC's layout to point down
MIXED = (20.0, -15.0, 10.0, 25.0, -70.0, 40.0)  # deg: a pose in which every joint shows
WRIST = 4  # its centre is the frame behind this row
RANGE = (-100.0, 200.0)  # K of a rise


@dataclass(frozen=True, eq=False, slots=True)
class WristReach:
    """How far the wrist centre comes, joints within their limits [m]."""

    outward: float  # from the axis of J1
    low: float  # above the height of World's origin
    high: float
    inward: float  # nearest to the axis of J1 with the wrist before it


@dataclass(frozen=True, slots=True)
class PendantPose:
    """Joints, and what the pendant's position screen shows for them: World, tool 0."""

    joints: tuple[float, ...]  # [deg]
    numbers: tuple[float, ...]  # X Y Z [mm], W P R [deg]
    config: str  # "" where the layout is another's than FANUC's


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class RobotSheet:
    """An arm as its file has it."""

    arm: Arm
    reach: WristReach
    zero: Pose  # the frames behind the rows at pendant zero, 7 in World
    limits: Array  # (6, 2) [deg] as the data sheet prints them; the third of J2 + J3 where the pendant couples them
    coupled: bool  # whether the pendant's J3 counts against the horizontal
    obstacle: str  # why no programs are generated for it; "" where they are
    poses: tuple[PendantPose, ...]
    findings: tuple[Finding, ...]


def robot_sheet(arm: Arm) -> RobotSheet:
    """What a robot file says, computed: nothing is read but the file."""
    robot = arm.robot
    obstacle = ""
    try:
        check_arm_class(robot, arm.source)
    except InputError as failure:
        obstacle = str(failure)
    findings = [*arm.input_findings]
    if not arm.nodes:
        message = "no [thermal]: taken as a cold arm; measure how it warms (docs/identify.md)"
        findings.append(Finding(Level.NOTE, Code.THERMAL_NONE, message))
    joints = [j for j in _table(other=bool(obstacle)) if _allowed(robot, j)]
    limits = robot.quoted_limits.T / DEG
    return RobotSheet(
        arm=arm,
        reach=_reach(robot),
        zero=frames_at_zero(robot),
        limits=limits,
        coupled=robot.joint_names[2] != "J3",
        obstacle=obstacle,
        poses=tuple(_pose(robot, j, known=not obstacle) for j in joints),
        findings=tuple(findings),
    )


def _table(*, other: bool) -> list[tuple[float, ...]]:
    """Pendant joints to compare [deg]: zero, each joint turned by itself, and all of them."""
    base = np.array([0, 0, 0, 0, 0.0 if other else DOWN, 0])
    turned = [base + TURN * np.eye(6)[k] for k in range(6)]
    return [(0.0,) * 6, *(tuple(float(v) for v in row) for row in (base, *turned)), MIXED][int(other) :]


def _allowed(robot: Robot, joints: tuple[float, ...]) -> bool:
    theta = robot.to_theta(np.array([joints]) * DEG)[0]
    return bool(((theta >= robot.lower) & (theta <= robot.upper)).all())


def _pose(robot: Robot, joints: tuple[float, ...], *, known: bool) -> PendantPose:
    theta = robot.to_theta(np.array([joints]) * DEG)
    flange = flange_pose(robot, theta)
    numbers = pose_numbers(flange.position, flange.rotation)[0]
    config = ""
    if known:
        turns = ", ".join(str(n) for n in turn_digits(robot, theta)[0].tolist())
        config = f"{config_letters(postures_of(robot, theta)[0])}, {turns}"
    return PendantPose(joints, tuple(numbers.tolist()), config)


def _reach(robot: Robot) -> WristReach:
    """Joint 1 at zero; the pendant's coupling is in the limits of theta."""

    def away(wrist: Array) -> Array:
        return np.hypot(wrist[:, 0], wrist[:, 1])

    inward = _most(robot, lambda wrist: np.where(wrist[:, 0] > 0, -away(wrist), -np.inf))
    return WristReach(
        outward=_most(robot, away),
        low=-_most(robot, lambda wrist: -wrist[:, 2]),
        high=_most(robot, lambda wrist: wrist[:, 2]),
        inward=-inward if np.isfinite(inward) else 0.0,
    )


def _most(robot: Robot, measure: Callable[[Array], Array]) -> float:
    """The most of a measure of wrist centres (M, 3), on grids of joints 2 and 3, each about the best of the last."""
    lower, upper = robot.lower[1:3], robot.upper[1:3]
    low, high = lower, upper
    for _ in range(ROUNDS):
        theta = np.tile(robot.pendant_zero, (STEPS**2, 1))
        theta[:, 1:3] = np.stack(np.meshgrid(*np.linspace(low, high, STEPS).T), axis=-1).reshape(-1, 2)
        value = measure(joint_places(robot, theta)[:, WRIST])
        best, step = theta[np.argmax(value), 1:3], (high - low) / (STEPS - 1)
        low, high = np.maximum(best - step, lower), np.minimum(best + step, upper)
    return float(value.max())


@dataclass(frozen=True, eq=False, slots=True)
class ExportedArm:
    """An arm as six lines."""

    arm: Arm
    rise_K: dict[str, float]
    chain: RigidChain

    def words(self) -> tuple[str, ...]:
        """What the file says of itself."""
        warm = ", ".join(f"{name} {rise:g} K" for name, rise in self.rise_K.items() if rise) or "cold"
        robot = self.arm.robot
        joint_3 = f"joint 3 is {robot.joint_names[2]} of the pendant"
        lines = [f"{robot.name} as its robot file knows it, {warm}; base is World; {joint_3}"]
        if self.chain.left_out:
            left = ", ".join(self.chain.left_out)
            most = f"up to {self.chain.off / UM:.3g} um of the flange at {POSES:,} poses"
            lines.append(f"left out, for they are no fixed lines: {left}; {most}")
        return tuple(lines)


def export_arm(name: str, rises: str | None = None) -> ExportedArm:
    """An arm by its robot's name or file.

    Args:
        name: Robot name or file.
        rises: Of its nodes, ``j2=11,j3=13`` [K]; those that are not named are cold.

    Raises:
        InputError: An unknown robot or node, or a rise that is no number or out of range.
    """
    arm = load_arm(name)
    given: dict[str, float] = {}
    for item in (rises or "").split(",") if rises is not None else ():
        node, sign, number = (word.strip() for word in item.partition("="))
        if node not in arm.nodes:
            known = f"known: {', '.join(arm.nodes)}" if arm.nodes else f"{name} has no nodes: leave it out"
            raise InputError(f"--rise-K: no node '{node:.40}'{suggest(node, arm.nodes)}; {known}")
        try:
            value = float(number)
        except ValueError:
            value = np.nan
        if not sign or not RANGE[0] <= value <= RANGE[1]:
            raise InputError(f"--rise-K: {node}: '{number:.40}' is no rise of {RANGE[0]:g} to {RANGE[1]:g} K; mend it")
        if given.setdefault(node, value) != value:
            raise InputError(f"--rise-K: {node}: stands twice, {given[node]:g} and {value:g} K; keep one")
    rise_K = {node: given.get(node, 0.0) for node in arm.nodes}
    sources = [known.source for known in arm.known]
    return ExportedArm(arm, rise_K, rigid_chain(arm.robot, sources, np.array(list(rise_K.values()))))
