"""A log of a run that never was: a program as the twin's controller drives it, written down as a logger would.

For trying ``cgen executed`` and ``cgen identify-motion`` before there is a log, and for tests. What the real controller
does is what is not known: a simulated log says nothing of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, interpolated
from compgen.core.exceptions import InputError
from compgen.core.pose import JOINT_KEYS, POSE_KEYS, Pose
from compgen.core.rotations import rotation_matrix, rotation_vector, to_wpr
from compgen.core.units import DEG, MM
from compgen.pipelines.executed.executed import Situation
from compgen.pipelines.files.program_course import canonical_program
from compgen.robot.configuration import apply_turns
from compgen.robot.inverse_kinematics import flange_from_tool, solve_flange, solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.twin.circular_motion import sweeps
from compgen.verification.twin.controller.command import CommandedMotion, WrittenPath, sample_command
from compgen.verification.twin.controller.smoothing import smooth
from compgen.verification.twin.timing import time_program

PARTS = 4  # samples of the motion in each interpolation period: between two it is straight


@dataclass(frozen=True, slots=True, kw_only=True)
class Logger:
    """How a run is written down."""

    step: float = 0.008  # [s] between rows
    noise: float = 1e-6  # [m] standard deviation of each coordinate, and of joints at 1 m
    digits: int = 3  # behind the point, of mm and degrees
    jitter: float = 0.0  # [s] largest of each row's time
    dropped: float = 0.0  # share of rows that are missing
    offset: float = 0.0  # [s] of the clock
    rate: float = 0.0  # [s/s] that the clock is fast
    before: float = 1.0  # [s] of standing before the program, or of its beginning that is missed where negative
    after: float = 1.0  # [s] behind it, or of its end that is missed
    joints: bool = False  # whether joints are logged
    seed: int = 0


def simulated_log(
    content: bytes,
    situation: Situation,
    motion: ControllerMotion | None = None,
    override: float = 1.0,
    logger: Logger = Logger(),
) -> bytes:
    """The CSV that a logger would write while a program of compgen's form runs.

    Args:
        content: The program, or a main program whose pages the situation finds.
        situation: Robot and frames.
        motion: How the controller smooths; default as it commands.
        override: Share of the written speeds.
        logger: How it is written down.

    Raises:
        InputError: Not a program of compgen's form.
    """
    program = canonical_program(content, situation.find_program)
    if program is None:
        raise InputError("program: not of the form that compgen writes; only such a run can be simulated")
    frame, tool = situation.frames.uframe[program.uframe], situation.frames.utool[program.utool]
    robot = replace(situation.robot, motion=motion)
    pose = frame @ Pose(program.position, program.rotation)
    program = replace(program, position=pose.position, rotation=pose.rotation)
    theta = apply_turns(robot, solve_tool(robot, pose, tool, program.posture).theta, program.turns)
    clock = time_program(robot, program, program.lengths(), theta)
    path = WrittenPath(program, sweeps(program), clock.unrounded, theta)
    command = sample_command(robot, path, override, PARTS)
    there = _driven(robot, tool, path, command, motion)
    if logger.joints:
        flange = flange_from_tool(there, tool)
        joints = nearest_turns(solve_flange(robot, flange, program.posture).theta, _commanded(path, command))
        numbers = robot.to_pendant(joints) / DEG
    else:
        seen = frame.inverse() @ there
        numbers = np.column_stack([seen.position / MM, *(angle / DEG for angle in to_wpr(seen.rotation))])
        numbers[:, 3:] = np.unwrap(numbers[:, 3:], period=360.0, axis=0)
    return _written(command.time, numbers, logger)


def _driven(
    robot: Robot, tool: Pose, path: WrittenPath, command: CommandedMotion, motion: ControllerMotion | None
) -> Pose:
    """Where the TCP is at the samples of a command, by the controller's own model of the arm."""
    period = command.step
    if motion is None:
        return Pose(command.position, path.rotations(command.segment, command.fraction))
    if motion.space == "joint":
        joints = path.joints(robot, tool, command.segment, command.fraction)
        return flange_pose(robot, smooth(joints, period, motion)) @ tool
    rotation = path.rotations(command.segment, command.fraction)
    steps = rotation_vector(rotation[0].T @ rotation)
    turned = rotation[0] @ rotation_matrix(smooth(np.asarray(steps), period, motion))
    return Pose(smooth(command.position, period, motion), turned)


def _commanded(path: WrittenPath, command: CommandedMotion) -> Array:
    """Commanded joints at the samples, straight between positions: they name the turns, (M, 6) [rad]."""
    k, share = command.segment, command.fraction[:, None]
    return np.asarray(path.theta[k] + share * (path.theta[k + 1] - path.theta[k]))


def _written(time: Array, numbers: Array, logger: Logger) -> bytes:
    """Rows of a log between samples of a run, (M,) [s] and (M, 6) [mm and deg]."""
    rng = np.random.default_rng(logger.seed)
    at = np.arange(time[0] - logger.before, time[-1] + logger.after, logger.step)
    at = at[rng.random(len(at)) >= logger.dropped]
    late = at + logger.jitter * rng.uniform(-1, 1, len(at))
    shown = np.maximum.accumulate(np.round((1 + logger.rate) * late + logger.offset, 6))
    rows = interpolated(at, time, numbers)
    degrees = logger.noise / DEG  # of a joint: as much at a metre
    scale = np.full(6, degrees) if logger.joints else np.array([logger.noise / MM] * 3 + [degrees] * 3)
    rows = np.round(rows + scale * rng.normal(size=rows.shape), logger.digits) + 0.0
    head = ",".join(("time_s", *(JOINT_KEYS if logger.joints else POSE_KEYS)))
    form = ",".join(["%.6f", *[f"%.{logger.digits}f"] * 6])
    lines = [form % (t, *row) for t, row in zip(shown.tolist(), rows.tolist(), strict=True)]
    return "\n".join([head, *lines, ""]).encode("ascii")
