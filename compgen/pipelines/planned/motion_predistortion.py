"""A job's correction with what is commanded against the controller's motion."""

from dataclasses import replace

import numpy as np

from compgen.compensation.predistortion import Commanded, bent_runs, predistortion
from compgen.compensation.problem import Problem, Solution
from compgen.compensation.simplify import simplify
from compgen.core.arcs import segment_lengths, statement_starts
from compgen.core.arrays import Array, frozen, row_norms
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.job.moves_in_arcs import fit_planned_moves
from compgen.pipelines.findings.motion_findings import lead_findings, motion_findings
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import printed_in_world
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.planning.whole_periods import EXACTLY, WORD_STEP
from compgen.program.digits import resolution
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.verification.deviation import Deviation
from compgen.verification.motion_effect import error_at_half_override
from compgen.verification.twin import PreparedProgram
from compgen.verification.written_motion import WrittenMotion

ROUNDS = 3  # of taking runs to begin as what is commanded for that begins


def predistorted(problem: Problem, planned: Planned) -> Problem:
    """The problem with targets off which the controller leads the tool onto those of the path.

    The problem itself where the robot file has no accepted motion, or does not enable it.
    """
    motion = planned.job.robot.motion
    if motion is None or not motion.may_predistort:
        return problem
    shift = _shift(planned, _commanded(planned))
    return replace(problem, target=Pose(frozen(problem.target.position + shift), problem.target.rotation))


def as_logged(planned: Planned) -> Planned:
    """The plan, its robot's motion marked where runs with bends begin as none of the log did that told it."""
    job, motion = planned.job, planned.job.robot.motion
    if motion is None or motion.evidence is None or not motion.is_smooth:
        return planned
    commanded = _commanded(planned)
    if commanded.first is not None and motion.covers(commanded.first[bent_runs(motion, commanded)]):
        return planned
    robot = replace(job.robot, motion=replace(motion, unlogged=True))
    return replace(planned, job=replace(job, cell=replace(job.cell, robot=robot)))


def _commanded(planned: Planned) -> Commanded:
    """The plan as it shall be driven; without how its runs begin where no command begins as it is taken to."""
    path, process, motion = planned.path, planned.job.plan.process, planned.job.robot.motion
    by_lines = not process.arcs and process.thin is None
    first = _first_statements(planned, np.zeros_like(path.target.position))
    commanded = Commanded(
        position=path.target.position,
        theta=planned.theta,
        arc=path.arc,
        speed=planned.trajectory.speed,
        stop=path.stop,
        by_lines=by_lines,
        beside=~path.contact,
        first=first,
    )
    if by_lines or motion is None or not motion.may_predistort:
        return commanded
    for _ in range(ROUNDS):
        assumed, first = first, _first_statements(planned, _shift(planned, commanded))
        if np.array_equal(first > motion.long, assumed > motion.long):
            return commanded
        commanded = replace(commanded, first=first)
    return replace(commanded, first=None)


def _shift(planned: Planned, commanded: Commanded) -> Array:
    """How far off its targets a plan is commanded, (N, 3) [m]."""
    job = planned.job
    robot = job.robot.at_acceleration(job.plan.process.acc)
    return predistortion(robot, job.tool.pose, commanded, job.settings.clamp_position)


def _first_statements(planned: Planned, shift: Array) -> Array:
    """How long the statement lasts that each run begins with, of a plan that is commanded off (N, 3) [m], (R,) [s]."""
    job, path, speed, controller = planned.job, planned.path, planned.trajectory.speed, planned.job.robot.controller
    process, shortest = job.plan.process, planned.feed * controller.period
    rows = np.arange(len(path.arc))
    if process.thin is not None:
        rows = simplify(path, planned.theta, shift, process.thin, shortest)
    via = np.zeros(len(rows), dtype=bool)
    if process.arcs:
        pose = Pose(frozen(path.target.position + shift), path.target.rotation)
        rows, via = fit_planned_moves(process, job.robot, path, pose, printed_in_world(job, pose), planned.theta, speed)
    clock, ends = np.append(0.0, np.cumsum(np.diff(path.arc) / speed)), rows[~via]
    begins = np.flatnonzero(path.stop[ends])[:-1]
    return controller.line_time(clock[ends[begins + 1]] - clock[ends[begins]])


def from_targets(solution: Solution, problem: Problem, path: ToolPath) -> Solution:
    """The solution with its correction counted from the path's own targets, (N, 6)."""
    if problem.target is path.target:
        return solution
    correction = np.array(solution.correction)
    correction[:, :3] += problem.target.position - path.target.position
    return replace(solution, correction=frozen(correction))


def as_smoothed(solution: Solution, problem: Problem, planned: Planned) -> Solution:
    """The solution with the joints that are driven: what is commanded against the smoothing never reaches them."""
    if problem.target is planned.path.target:
        return solution
    shifted = solve_tool(problem.robot, problem.target, problem.tool, problem.posture).theta
    apart = nearest_turns(shifted, planned.theta) - planned.theta
    return replace(solution, theta=frozen(solution.theta - apart))


def at_planned_times(trajectory: Trajectory, planned: Planned, commanded: Pose) -> Trajectory:
    """The timing with words by which statements, as long as they are commanded, last what they were planned for.

    Beside the path by c on the outer side of a bend R a line is longer by c / R. At its path's word it would be late,
    and on a controller that rounds up by a whole period. Lines last the whole periods that they were laid out for; arcs
    end at the period nearest to their planned end, where the controller rounds up.
    """
    robot, path = planned.job.robot, planned.path
    controller, arcs = robot.controller, path.via.any()
    if robot.motion is None or not robot.motion.may_predistort or (arcs and not controller.rounds_up_to_period):
        return trajectory
    starts = statement_starts(path.via)
    statement, first = np.cumsum(starts) - 1, np.flatnonzero(starts)
    lasts = np.add.reduceat(np.diff(path.arc) / trajectory.speed, first)
    ends = np.cumsum(lasts / controller.period if arcs else controller.whole_periods(lasts))
    periods = np.maximum(np.diff(np.rint(ends), prepend=0.0), 1.0)[statement]
    written = segment_lengths(commanded.position + path.balance, path.via)
    length = (np.add.reduceat(written, first) + np.sqrt(3) * resolution(controller.decimals)[0])[statement]
    exact = np.isclose(trajectory.speed, planned.feed, rtol=EXACTLY)
    slowest = trajectory.speed * np.where(exact, 1.0, 1 - WORD_STEP)  # as it may be written
    fits = controller.whole_periods(length / slowest) == periods
    wanted = length / (periods * controller.period) * (1 + WORD_STEP)
    return replace(trajectory, speed=frozen(np.where(fits, trajectory.speed, wanted)))


def as_commanded(planned: Planned, written: WrittenMotion) -> WrittenMotion:
    """The motion of an uncorrected text, for a job whose runs, as they are commanded, may begin otherwise."""
    motion, effect = planned.job.robot.motion, written.effect
    if motion is None or effect is None:
        return written
    return replace(written, effect=replace(effect, motion=replace(effect.motion, unlogged=motion.unlogged)))


def findings(
    planned: Planned, prepared: PreparedProgram, written: WrittenMotion, deviation: Deviation
) -> list[Finding]:
    """What the controller's motion does to a written program; of one made against it, what half the override leaves."""
    job, path = planned.job, planned.path
    motion, at_half = job.robot.motion, None
    if motion is not None and motion.may_predistort and job.ensemble is None:
        at_half = error_at_half_override(prepared, deviation.error, path.touching_segments())
    error = None
    if motion is not None and motion.may_predistort:
        error = prepared.most_on_segments(row_norms(deviation.error))
    effect = planned.effect(written)
    return [*motion_findings(effect, job.bounds, at_half), *lead_findings(effect, path, job, error)]
