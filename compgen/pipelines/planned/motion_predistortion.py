"""A job's correction with what is commanded against the controller's motion."""

from dataclasses import replace

import numpy as np

from compgen.compensation.predistortion import Commanded, predistortion
from compgen.compensation.problem import Problem, Solution
from compgen.core.arcs import segment_lengths, statement_starts
from compgen.core.arrays import frozen, row_norms
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.pipelines.findings.motion_findings import lead_findings, motion_findings, touching_segments
from compgen.pipelines.planned.job_results import Planned
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


def predistorted(problem: Problem, planned: Planned) -> Problem:
    """The problem with targets off which the controller leads the tool onto those of the path.

    The problem itself where the robot file has no accepted motion, or does not enable it.
    """
    robot, path, trajectory = planned.job.robot, planned.path, planned.trajectory
    if robot.motion is None or not robot.motion.may_predistort:
        return problem
    process = planned.job.plan.process
    by_lines = not process.arcs and process.thin is None
    beside = ~path.contact if path.contact.any() else None
    places = path.target.position
    commanded = Commanded(
        position=places,
        theta=planned.theta,
        arc=path.arc,
        speed=trajectory.speed,
        stop=path.stop,
        by_lines=by_lines,
        beside=beside,
    )
    robot = robot.at_acceleration(planned.job.plan.process.acc)
    shift = predistortion(robot, planned.job.tool.pose, commanded, planned.job.settings.clamp_position)
    return replace(problem, target=Pose(frozen(problem.target.position + shift), problem.target.rotation))


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


def findings(
    planned: Planned, prepared: PreparedProgram, written: WrittenMotion, deviation: Deviation
) -> list[Finding]:
    """What the controller's motion does to a written program; of one made against it, what half the override leaves."""
    job, path = planned.job, planned.path
    motion, at_half = job.robot.motion, None
    if motion is not None and motion.may_predistort and job.ensemble is None:
        at_half = error_at_half_override(prepared, deviation.error, touching_segments(path))
    error = None
    if motion is not None and motion.may_predistort:
        error = np.maximum.reduceat(row_norms(deviation.error), prepared.first_samples()[:-1])
    effect = planned.effect(written)
    return [*motion_findings(effect, job.bounds, at_half), *lead_findings(effect, path, job, error)]
