"""Circular motions of a job: the correction is found on the dense waypoints of its lines, then said in arcs and lines.

So what bounds, band, smoothness and mid-spatial content mean does not depend on how the program says its path.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from compgen.compensation.arc_fit import FittedMoves
from compgen.compensation.problem import Problem, Solution
from compgen.compensation.simplify import simplify
from compgen.core import stages
from compgen.core.arcs import statement_starts
from compgen.core.arrays import Array, frozen
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.stages import Progress
from compgen.core.units import UM, counted
from compgen.job.moves_in_arcs import fit_planned_moves, without_period
from compgen.pipelines.planned.job_results import DenseCorrection, Planned, solution_at
from compgen.pipelines.planned.motion_predistortion import as_smoothed
from compgen.pipelines.planned.program_text import printed_in_world
from compgen.planning import retiming
from compgen.planning.retiming import Trajectory, driven_speed


def fit_job_moves(planned: Planned, commanded: Pose, theta: Array) -> FittedMoves:
    """The arcs and lines through commanded poses of a plan's N waypoints, whose joints are theta (N, 6) [rad]."""
    job, path = planned.job, planned.path
    printed = printed_in_world(job, commanded)
    return fit_planned_moves(job.plan.process, job.robot, path, commanded, printed, theta, planned.trajectory.speed)


def at_program_positions(planned: Planned, progress: Progress) -> Planned:
    """An uncorrected plan at the positions that its program names, with their times; itself in lines through each."""
    process, path = planned.job.plan.process, planned.path
    if process.arcs:
        rows, via = fit_job_moves(planned, path.target, planned.theta)
        dense = DenseCorrection(path, planned.theta, np.zeros((len(path.arc), 6)))
        kept = replace(planned.at(rows, path.subset(rows, via)), dense=dense)
    elif process.thin is not None:
        unmoved, period = np.zeros_like(path.target.position), planned.job.robot.controller.period
        kept = planned.at(simplify(path, planned.theta, unmoved, process.thin, planned.feed * period))
    else:
        return planned
    return replace(kept, trajectory=time_corrected(kept, kept.theta, lambda stage, share: progress(stages.TIMING, 1.0)))


def with_arcs(
    planned: Planned, problem: Problem, solution: Solution, moves: FittedMoves
) -> tuple[Planned, Problem, Solution]:
    """Plan, problem and solution at the positions of arcs and lines."""
    rows, via = moves
    dense = DenseCorrection(planned.path, as_smoothed(solution, problem, planned).theta, solution.correction)
    arcs, process = int(via.sum()), planned.job.plan.process
    message = (
        f"{len(rows)} positions for {len(problem.arc)} waypoints: {counted(arcs, 'arc', 'arcs')} and "
        f"{counted(len(rows) - 1 - 2 * arcs, 'line', 'lines')}, within {(process.thin or process.chord) / UM:g} um of "
        "the corrected path"
    )
    kept = planned.at(rows, planned.path.subset(rows, via))
    findings = (*planned.findings, Finding.of(Code.PATH_ARCS, message))
    return replace(kept, dense=dense, findings=findings), problem.window(rows), solution_at(solution, rows)


CHANGE_LENGTH = 3e-3  # [m] of an arc, what a change of speed spreads over at most
CHANGE_SHARE = 0.8  # of a joint's acceleration that a change of speed between two statements uses


def time_corrected(planned: Planned, theta: Array, progress: Progress) -> Trajectory:
    """The final timing of a program that drives joints, (N, 6) [rad].

    An arc is one statement with one speed: it is timed on the dense waypoints, whose joints keep their limits all along
    it, and each statement gets the speed that takes as long as they do. Statements end where that speed changes by a
    tenth.
    """
    job, path = planned.job, planned.path
    robot = job.robot.at_acceleration(job.plan.process.acc)
    feed, tell = planned.feed * path.pace, partial(progress, stages.FINAL_TIMING)
    if planned.dense is None:
        return retiming.retime(robot, path.arc, theta, path.stop, feed, tell, lines=True)
    dense, rows = planned.dense, planned.rows
    starts = statement_starts(path.via)
    statement = np.cumsum(starts) - 1  # of each segment
    first = np.flatnonzero(starts)
    length = np.add.reduceat(np.diff(path.arc), first)
    limit = np.minimum(np.minimum.reduceat(feed, first), length / robot.controller.period)
    of_dense = statement[np.repeat(np.arange(len(statement)), np.diff(rows))]
    robot = without_period(robot)
    arc, stop = dense.path.arc, dense.path.stop
    trajectory = retiming.retime(robot, arc, dense.theta, stop, limit[of_dense], tell)
    spent = np.add.reduceat(np.diff(arc) / trajectory.speed, rows[:-1][first])
    border = rows[first[1:]]
    slope = np.abs((dense.theta[border + 1] - dense.theta[border - 1]) / (arc[border + 1] - arc[border - 1])[:, None])
    bearable = CHANGE_SHARE * (robot.acceleration / np.maximum(slope, 1e-12)).min(axis=1)
    bearable[stop[border]] = np.inf
    spread = np.where(path.via[1:][first], np.minimum(length / 2, CHANGE_LENGTH), length)
    speeds = _with_bearable_changes(np.minimum(limit, length / spent), spread, bearable)
    time, speed = trajectory.time[rows], speeds[statement]
    driven = driven_speed(time, np.diff(path.arc), speed, path.stop)
    return replace(trajectory, time=frozen(time), speed=frozen(speed), driven_speed=frozen(driven))


def _with_bearable_changes(speed: Array, length: Array, acceleration: Array) -> Array:
    """Speeds of statements, (S,) [m/s], lowered where one differs from the next by more than the joints bear.

    The change spreads over half of both, as the proof has it: |v' - v| <= a (L / v + L' / v') / 2.

    Args:
        speed: Wanted, (S,) [m/s].
        length: Of the statements, (S,) [m], of an arc what a change spreads over.
        acceleration: That the joints bear between two, (S - 1,) [m/s2].
    """
    speed = np.array(speed)
    for _ in range(len(speed)):
        spent = length / speed
        room = acceleration * (spent[1:] + spent[:-1]) / 2
        low = np.minimum(speed[1:], speed[:-1]) + room
        after, before = speed[1:] > low * (1 + 1e-9), speed[:-1] > low * (1 + 1e-9)
        if not (after | before).any():
            break
        speed[1:][after] = low[after]
        speed[:-1][before] = low[before]
    return speed
