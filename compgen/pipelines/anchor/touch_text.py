"""The program of planned touches, and the proof from its text: every pose in reach, in its posture, as planned."""

import numpy as np

from compgen.core.exceptions import ImpossibleError
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import DEG
from compgen.fanuc.analysis.poses import read_poses
from compgen.fanuc.canonical.writer import resolution
from compgen.fanuc.frames import Frames
from compgen.fanuc.listing.listing import loads
from compgen.fanuc.measuring_programs import Signal, TouchPositions, touch_program
from compgen.pipelines.anchor.touch_plan import PlannedTouches
from compgen.robot.inverse_kinematics import ALL_POSTURES
from compgen.robot.turns import turn_digits

SAME = 0.02 * DEG  # by which the digits of a position may turn a joint
DRIVEN = (0, 1, 3)  # of the stages of a way: lifted, approach, beyond
STOPPED = (0, 1, 2)  # and where the program stops at the touch


def positions_of(planned: PlannedTouches, utool: int, stops: bool) -> TouchPositions:
    """The positions of the program, in its user frame."""
    job, ways = planned.job, planned.ways
    stages = list(STOPPED if stops else DRIVEN)
    rotation = np.repeat(ways.rotation, 3, axis=0)
    in_world = Pose(ways.position[:, stages].reshape(-1, 3), rotation)
    theta = ways.theta[:, stages].reshape(-1, 6)
    return TouchPositions(
        name=tuple(planned.targets.name[s] for s in ways.target.tolist()),
        pose=planned.frame.inverse() @ in_world,
        posture=job.posture,
        turns=turn_digits(job.robot, theta),
        uframe=planned.uframe,
        utool=utool,
        decimals=job.robot.controller.decimals,
    )


def write_touches(planned: PlannedTouches, name: str, date: str, utool: int, signal: Signal | None) -> bytes:
    """The program's text, proven.

    Args:
        planned: The touches.
        name: As the controller takes it.
        date: "YY-MM-DD".
        utool: Number of the probe's tool.
        signal: That ends a search; None: the program pauses at each touch.

    Raises:
        ImpossibleError: The text, read back, is not what was planned; names the position.
    """
    stops = signal is None
    text = touch_program(name, date, positions_of(planned, utool, stops), signal)
    prove_touches(planned, text, utool, list(STOPPED if stops else DRIVEN))
    return text


def prove_touches(planned: PlannedTouches, text: bytes, utool: int, stages: list[int]) -> None:
    """Raises ImpossibleError where a text, read back, is not what was planned; names the position."""
    robot, ways = planned.job.robot, planned.ways
    probe = Pose(planned.artefact.probe, np.eye(3))
    frames = Frames({0: IDENTITY, planned.uframe: planned.frame}, {0: IDENTITY, utool: probe})
    poses = read_poses(loads(text), robot, frames)
    theta, position = ways.theta[:, stages].reshape(-1, 6), ways.position[:, stages].reshape(-1, 3)
    step, _ = resolution(robot.controller.decimals)
    same = np.linalg.norm(poses.tcp.position - position, axis=1) <= 2 * step
    same &= (np.abs(poses.theta - theta) <= SAME).all(axis=1) & (poses.margin > robot.elbow_margin)
    same &= (poses.theta >= robot.lower).all(axis=1) & (poses.theta <= robot.upper).all(axis=1)
    same &= poses.posture == ALL_POSTURES.index(planned.job.posture)
    if not same.all():
        n = int(np.argmin(same))
        raise ImpossibleError(
            f"the text's P[{n + 1}] is not the planned pose of touch {n // 3 + 1}; this is a fault of compgen"
        )
