"""A job's program: its poses, speeds and stops as FANUC text says them, with what the remarks tell of it."""

from collections.abc import Sequence

import numpy as np

from compgen.core.arcs import segment_lengths, statement_starts
from compgen.core.arrays import Array, BoolArray, frozen
from compgen.core.dates import DEFAULT_DATE
from compgen.core.pose import Pose
from compgen.core.version import __version__
from compgen.job.job import Job
from compgen.pipelines.findings.job_findings import nothing_to_correct
from compgen.pipelines.planned.dry_run import dry_run_words
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.program.digits import as_written, printed_poses
from compgen.program.program import DRY, REMARK_LENGTH, Program, program_name
from compgen.program.speeds import written_feeds
from compgen.robot import inverse_kinematics, joint_path
from compgen.robot.configuration import turn_digits

NOT_CORRECTED = "planned, not corrected"
FULL_SPEED = "_V100"  # behind the name of a program that is commanded for what a controller does at 100 % override
COMMON_REMARKS = 4  # that pages and their main program repeat: what it was made from, and the override to run it at


def planned_program(
    job: Job, path: ToolPath, theta: Array, trajectory: Trajectory, date: str = DEFAULT_DATE
) -> Program:
    """The uncorrected program as its text would be read."""
    program, printed = compose_program(job, path.target, theta, trajectory, path, date, None)
    return as_written(program, printed)


def compose_program(
    job: Job,
    commanded: Pose,
    theta: Array,
    trajectory: Trajectory,
    path: ToolPath,
    date: str,
    start_window: float | None,
) -> tuple[Program, Pose]:
    """The program that names poses in the job's user frame, and these poses there rounded to its digits.

    Args:
        job: For names, tool, posture, controller and the warmth that the remarks tell.
        commanded: To be named, N poses of the TCP in World.
        theta: Joints there, (N, 6) [rad]; whole turns are taken from them.
        trajectory: For the speeds.
        path: For the stops.
        date: In the header.
        start_window: How long after its warmth the program may start [s]; None for a program that is not corrected.
    """
    decimals = job.robot.controller.decimals
    commanded = Pose(frozen(commanded.position + path.balance), commanded.rotation)
    written = in_frame(job, commanded)
    printed = printed_poses(written, decimals)
    # the digits of CONFIG belong to the pose as printed
    joints = inverse_kinematics.solve_tool(job.robot, in_world(job, printed), job.tool.pose, job.posture).theta
    program = Program(
        name=program_name_of(job),
        comment=f"compgen {'DRY RUN' if job.plan.path.raised else job.inputs_hash[:8]}",
        date=date,
        remarks=_remarks(job, start_window),
        uframe=0 if job.frame is None else job.frame.number,
        utool=job.tool.number,
        position=written.position,
        rotation=written.rotation,
        posture=job.posture,
        turns=frozen(turn_digits(job.robot, joint_path.nearest_turns(joints, theta))),
        speed=frozen(written_speeds(trajectory.speed, written.position, path.via)),
        fine=path.stop,
        via=path.via,
        decimals=decimals,
        payload=job.tool.payload,
        acc=job.plan.process.acc,
    )
    return program, printed


def _remarks(job: Job, start_window: float | None) -> tuple[str, ...]:
    """What a program was made from and is right for, for the head of its text."""
    remarks = [f"compgen {__version__} {job.robot.name}"[:REMARK_LENGTH], f"inputs {job.inputs_hash[:24]}"]
    remarks += [f"robot file {job.cell.robot_file_hash[:16]}", override_remark(job)]
    if start_window is None:
        return (*remarks, NOT_CORRECTED)
    remarks += rise_remarks(job, job.start_rise())
    remarks += start_remarks(job, start_window)
    remarks += motion_remarks(job)
    if (state := job.cell.state) is not None:
        remarks.append(f"state {state.digest[:8]} holds {int(state.window)} s"[:REMARK_LENGTH])
    return tuple(remarks)


def rise_remarks(job: Job, rise: Array) -> list[str]:
    """How warm a job's robot is, (K,) [K], two nodes a line."""
    rises = [f"{name} {k:.1f}" for name, k in zip(job.heat.names, rise, strict=True)]
    return [f"rise K {' '.join(rises[i : i + 2])}"[:REMARK_LENGTH] for i in range(0, len(rises), 2)]


def override_remark(job: Job) -> str:
    """The override at which an operator must run the program, as its times and its warmth were computed for.

    A dry run has none; that it is one stands there instead.
    """
    if job.plan.path.raised:
        return dry_run_words(job.plan.path.raised)
    return running_override((1.0,) if job.ensemble is None else job.ensemble.overrides)


def motion_remarks(job: Job) -> list[str]:
    """That a program is commanded against the controller's motion, whose pull goes with the square of the override."""
    motion = job.robot.motion
    if motion is None or not motion.may_predistort:
        return []
    return ["pre-distorted for 100% override", "at 50% 3/4 of the pull is wrong"]


def running_override(overrides: Sequence[float]) -> str:
    """The remark of a program that is right at some overrides, in rising order."""
    slowest, fastest = (f"{100 * overrides[k]:.4g}" for k in (0, -1))
    return f"RUN AT {slowest}% OVERRIDE" if slowest == fastest else f"RUN AT {slowest} TO {fastest}% OVERRIDE"


def written_speeds(speed: Array, position: Array, via: BoolArray) -> Array:
    """Speeds that the statements can say, of each segment, (N - 1,) [m/s]: both halves of an arc have one."""
    starts = np.flatnonzero(statement_starts(via))
    lengths = np.add.reduceat(segment_lengths(position, via), starts)
    written = written_feeds(np.minimum.reduceat(speed, starts), lengths)
    return np.repeat(written, np.diff(starts, append=len(speed)))


def start_remarks(job: Job, window: float) -> list[str]:
    """From when to when the program may start, and in which runs where it serves several."""
    ensemble = job.ensemble
    if ensemble is None:
        return [NOT_CORRECTED if nothing_to_correct(job.cell) else f"start within {int(window)} s of that"]
    early, late = ensemble.delay
    start = f"start {early:.0f}-{late:.0f} s after that" if early > 0 else f"start within {int(window)} s of that"
    if ensemble.runs == (0, 0):
        return [start]
    first, last = (run + 1 for run in ensemble.runs)
    return [start, f"runs {first} to {last}"]


def printed_in_world(job: Job, pose: Pose) -> Pose:
    """Where the controller has poses of World that the text says in its digits."""
    return in_world(job, printed_poses(in_frame(job, pose), job.robot.controller.decimals))


def in_frame(job: Job, pose: Pose) -> Pose:
    """Poses of World as a job's program names them, in its user frame."""
    return pose if job.frame is None else job.frame.register.inverse() @ pose


def in_world(job: Job, pose: Pose) -> Pose:
    """Poses that a job's program names, in World."""
    return pose if job.frame is None else job.frame.register @ pose


def program_name_of(job: Job) -> str:
    """The name of the job's program on the controller."""
    length = job.robot.controller.capacity.name_length
    if not job.plan.path.raised:
        motion = job.robot.motion
        behind = "" if motion is None or not motion.may_predistort else FULL_SPEED
        return f"{program_name(job.name, length - len(behind))}{behind}"
    return f"{program_name(job.name.removesuffix('_dry'), length - len(DRY))}{DRY}"
