r"""The correction of each free station, on the posture, frame and tool that its position names.

At first each for itself: c <- c - e(c), which shrinks the error about a thousandfold a step. Where straight lines
follow each other closer than the smoothing period, the whole run is optimised as for a planned path, so that the
workpiece stays smooth. A correction beyond the clamp or a joint limit is not taken: the station is held.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.compensation import optimise
from compgen.compensation.problem import Problem, Settings
from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, norm
from compgen.core.units import DEG
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState
from compgen.error_model.model import ErrorModel
from compgen.job.job import Cell
from compgen.program.directions import station_directions
from compgen.program.driven import DrivenProgram, Positions
from compgen.robot.configuration import postures_of, turn_digits
from compgen.robot.inverse_kinematics import ALL_POSTURES
from compgen.robot.joint_path import nearest_turns
from compgen.thermal import Duty, rises_during, state_after, still_air
from compgen.thermal.ensemble import Ensemble, mean_rises
from compgen.thermal.model import with_losses
from compgen.thermal.schedule import STANDING, History

ITERATIONS = 6  # of c <- c - e(c)
SAME_PLACE = 1e-6  # [m]
SAME_ANGLE = 1e-6  # [rad] of joints
TURN_OF_MOVE = 100.0  # [rad/m], [rad/rad] of a joint: 1 / 20 mm of a shoulder, 1 / sin(1 deg) of a wrist, and more
LARGEST_TURN = 0.1  # [rad] of a joint, that a correction of any size explains


@dataclass(frozen=True, eq=False, slots=True)
class StationRises:
    """When S stations are reached, and how warm the arm is there."""

    time: Array  # (S,) [s]
    rise: Array  # (S, K) [K]
    start: Array  # (K,) [K] when the program starts


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class StationCorrections(StationRises):
    """Corrections of S stations; zero where one is held."""

    correction: Array  # (S, 6) [m] in World axes, [rad] in tool axes
    theta: Array  # (S, 6) [rad] of the commanded poses
    held: tuple[tuple[int, str], ...]  # station, why no correction was taken
    limited: tuple[tuple[int, str], ...]  # station, limit that keeps the correction from being the best
    midway: DirectionState  # halfway on the way to each station


def rise_at_stations(
    cell: Cell, drive: DrivenProgram, before: Sequence[Duty], ensemble: Ensemble | None, air: float
) -> StationRises:
    """Times and rises of all stations, these averaged over an ensemble of starts, in air so much warmer [K].

    During a pause the robot stands with its servo on.
    """
    motion, around = drive.joint_motion(), still_air(air)
    if ensemble is None:
        start = state_after(cell.heat, with_losses(cell.heat, before, motion), air=around)
        rise = rises_during(cell.heat, start, motion, around).rise
    else:
        *duties, standing = with_losses(cell.heat, [*before, STANDING], motion)
        history, delays = History(before=tuple(duties), standing=standing, air=around), Ensemble(ensemble.delay)
        motions = [drive.at_override(share).joint_motion() for share in ensemble.overrides]
        rise = np.mean([mean_rises(cell.heat, history, delays, slow) for slow in motions], axis=0)
    stations = drive.reached[1:]
    return StationRises(motion.time[stations], rise[stations], rise[0])


def correct_stations(
    cell: Cell,
    drive: DrivenProgram,
    free: BoolArray,
    reached: StationRises,
    settings: Settings,
    progress: Callable[[float], None],
) -> StationCorrections:
    """Corrections of all free stations, for the rises there."""
    S = len(free)
    if not free.any():
        return StationCorrections(
            correction=np.zeros((S, 6)),
            theta=np.full((S, 6), np.nan),
            rise=reached.rise,
            time=reached.time,
            held=(),
            limited=(),
            start=reached.start,
            midway=NO_DIRECTION,
        )
    motion, midway = station_directions(cell.robot, cell.sources, drive)
    correction, theta, limited = _correct_free(cell, drive, free, reached.rise, motion, settings, progress)
    illegal = list(_illegal_corrections(cell, drive.at, correction, theta, drive.pose, free, settings))
    for station, _ in illegal:
        correction[station] = 0.0
        theta[station] = drive.at.theta[drive.pose[station]]
    return StationCorrections(
        correction=correction,
        theta=theta,
        rise=reached.rise,
        time=reached.time,
        held=tuple(illegal),
        limited=limited,
        start=reached.start,
        midway=midway,
    )


class _FreeCorrections(NamedTuple):
    """Corrections of S stations before the illegal ones are held; NaN where none is legal."""

    correction: Array  # (S, 6)
    theta: Array  # (S, 6) [rad]
    limited: tuple[tuple[int, str], ...]  # station, limit that binds there


def _correct_free(
    cell: Cell,
    drive: DrivenProgram,
    free: BoolArray,
    rise: Array,
    motion: DirectionState,
    settings: Settings,
    progress: Callable[[float], None],
) -> _FreeCorrections:
    """Each free station by itself, then runs of short lines together."""
    S, rows = len(free), np.flatnonzero(free)
    correction, theta = np.zeros((S, 6)), np.full((S, 6), np.nan)
    limited: list[tuple[int, str]] = []
    models = error_models(cell, drive.at, drive.pose[rows])
    correction[rows], theta[rows] = cancel_errors(cell, models, drive.at, drive.pose[rows], rise[rows], motion.at(rows))
    runs = dense_runs(drive, free, settings.curvature_period)
    for i, (first, last) in enumerate(runs):
        rows = np.arange(first, last + 1)
        arc = cumulated(drive.length[first + 1 : last + 1])
        run = _build_problem(
            cell,
            models,
            drive.at,
            pose=drive.pose[rows],
            rise=rise[rows],
            motion=motion.at(rows),
            arc=arc,
            stop=drive.stop[rows],
        )
        solution = optimise.optimise(run, settings)
        correction[rows], theta[rows] = solution.correction, solution.theta
        if not solution.status.is_legal:
            correction[rows] = np.nan  # none is legal
        limited += [(first + n - 1, limit) for n, limit in solution.active_limits]
        progress((i + 1) / len(runs))
    return _FreeCorrections(correction, theta, tuple(limited))


def error_models(cell: Cell, poses: Positions, pose: IntArray) -> dict[int, ErrorModel]:
    """The error model of each tool that the positions in rows ``pose`` use, by the tool's row."""
    return {t: cell.error_model(poses.tools[t]) for t in np.unique(poses.tool[pose]).tolist()}


def cancel_errors(
    cell: Cell, models: dict[int, ErrorModel], poses: Positions, pose: IntArray, rise: Array, motion: DirectionState
) -> tuple[Array, Array]:
    """The correction that cancels each position's own error (n, 6), and the joints it leads to (n, 6) [rad]."""
    correction, theta = np.zeros((len(pose), 6)), np.empty((len(pose), 6))
    kinds = np.column_stack([poses.tool, poses.posture])[pose]
    for kind in np.unique(kinds, axis=0):
        rows = np.flatnonzero((kinds == kind).all(axis=1))
        zero = np.zeros(len(rows))
        problem = _build_problem(
            cell,
            models,
            poses,
            pose=pose[rows],
            rise=rise[rows],
            motion=motion.at(rows),
            arc=zero,
            stop=zero.astype(bool),
        )
        c = np.zeros((len(rows), 6))
        for _ in range(ITERATIONS):
            c = c - problem.residual(c)
        correction[rows], theta[rows] = c, problem.joints(c)[0]
    return correction, theta


def _build_problem(  # noqa: PLR0913  the fields of a problem, as far as stations have them
    cell: Cell,
    models: dict[int, ErrorModel],
    poses: Positions,
    pose: IntArray,
    rise: Array,
    motion: DirectionState,
    arc: Array,
    stop: BoolArray,
) -> Problem:
    """Positions of one tool and one posture as a problem for the optimiser."""
    tool = int(poses.tool[pose[0]])
    return Problem(
        robot=cell.robot,
        model=models[tool],
        posture=ALL_POSTURES[int(poses.posture[pose[0]])],
        tool=poses.tools[tool],
        target=poses.tcp[pose],
        theta=poses.theta[pose],
        rise=rise,
        arc=arc,
        stop=stop,
        direction_state=motion,
    )


def dense_runs(drive: DrivenProgram, free: BoolArray, period: float) -> list[tuple[int, int]]:
    """First and last station of runs of straight lines, three or more, some shorter than the smoothing period."""
    tool, posture = drive.at.tool[drive.pose], drive.at.posture[drive.pose]
    joined = drive.line[1:] & free[1:] & free[:-1] & (tool[1:] == tool[:-1]) & (posture[1:] == posture[:-1])
    joined &= (drive.origin[1:] == np.arange(len(free) - 1)) & (drive.beyond[1:] <= 0)
    with np.errstate(invalid="ignore"):
        joined &= drive.length[1:] > SAME_PLACE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], joined.astype(int), [0]])))
    return [
        (int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= 2 and drive.length[a + 1 : b + 1].min() < period
    ]


def _illegal_corrections(
    cell: Cell, poses: Positions, correction: Array, theta: Array, pose: IntArray, free: BoolArray, settings: Settings
) -> Iterator[tuple[int, str]]:
    """Stations whose correction is not legal, and why."""
    robot = cell.robot
    rows = np.flatnonzero(free)
    c, q, planned = correction[rows], theta[rows], poses.theta[pose[rows]]
    with np.errstate(invalid="ignore"):
        clamped = ~(norm(c[:, :3]) <= settings.clamp_position) | ~(norm(c[:, 3:]) <= settings.clamp_rotation)
        over = np.maximum(robot.lower - q, q - robot.upper)
        hits_itself = ~robot.is_clear(q)
        turn = np.abs(nearest_turns(q, planned) - planned)
        swing = turn.max(axis=1) > explained_turns(norm(c[:, :3]), norm(c[:, 3:]))
    letters = postures_of(robot, np.nan_to_num(q))
    several = np.bincount(poses.first, minlength=len(poses.first))[poses.first[pose[rows]]] > 1
    turned = several & (turn_digits(robot, np.nan_to_num(q)) != turn_digits(robot, planned)).any(axis=1)
    _, margin = solved_after(cell, poses, pose[rows], np.nan_to_num(c))
    for k, station in enumerate(rows.tolist()):
        if np.isnan(c[k]).any():
            yield station, "no legal correction was found for its run of lines"
        elif clamped[k]:
            yield station, "its correction is beyond the clamp: the error model cannot be trusted there"
        elif margin[k] < 0:
            yield station, "its correction would lead out of reach"
        elif (over[k] > 1e-9).any():
            i = int(np.argmax(over[k]))
            yield station, f"its correction would drive joint {robot.joint_names[i]} beyond its limit"
        elif hits_itself[k]:
            yield station, "its correction would drive J2 and J3 where the arm hits itself (interference)"
        elif swing[k]:
            i = int(np.argmax(turn[k]))
            words = f"joint {robot.joint_names[i]} by {turn[k, i] / DEG:.2f} deg, more than it explains"
            yield station, f"its correction would turn {words}: a singularity is near"
        elif letters[k] != ALL_POSTURES[int(poses.posture[pose[station]])]:
            yield station, "its correction would change the posture letters of CONFIG"
        elif turned[k]:
            words = "its correction would pass +-180 deg, and motions place its position in several ways"
            yield station, words


def explained_turns(moved: Array, turned: Array) -> Array:
    """How far a joint may turn for the tool to move [m] and to turn [rad] so far, outside singularities, (N,) [rad]."""
    return np.asarray(np.minimum(TURN_OF_MOVE * (moved + turned), LARGEST_TURN) + SAME_ANGLE)


def solved_after(cell: Cell, poses: Positions, pose: IntArray, correction: Array) -> tuple[Array, Array]:
    """Joints of corrected positions, (n,) rows of poses, in their postures (n, 6) [rad]; the reach left (n,) [m]."""
    return poses.solve(cell.robot, poses.tcp[pose].moved(correction), pose)
