"""The band of a planned program: its job's quantities as columns at waypoints along it, folded in ``verification``."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, column_extremes, row_norms
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.error_model.knowledge import build_slopes
from compgen.error_model.model import ErrorModel
from compgen.error_model.quantities import Quantity
from compgen.pipelines.job import Job
from compgen.pipelines.start_window import late_rise
from compgen.pipelines.uncertainty import JobUncertainty, quantities_of
from compgen.planning.toolpath import ToolPath
from compgen.thermal.uncertainty import missed_rise, rise_by_air, rise_by_feed
from compgen.verification.band import Band, Columns, band_of

ROWS = 8192  # waypoints at which a band is evaluated; of more, so many along the program
TURN = 0.1  # of a joint's direction, after which a reversal gets another one
WIDTH_STEP = 1e-3  # relative, over which the effect of a width is differenced


@dataclass(frozen=True, eq=False, slots=True)
class DrivenProgram:
    """A program of N waypoints as it is driven."""

    job: Job
    model: ErrorModel
    path: ToolPath
    theta: Array  # (N, 6) [rad] commanded
    time: Array  # (N,) [s]
    rise: Array  # (N, K) [K]
    motion: DirectionState  # of the sources


def band_along(program: DrivenProgram, window: float = 0.0) -> Band:
    """What a job's files leave open along its program.

    Args:
        program: As it is driven.
        window: How late it may start [s].
    """
    rows = rows_of_band(program)
    columns = columns_along(program, uncertainty_of(program, window), rows)
    return band_of(columns, rows, _part_lengths(program.path, rows))


def uncertainty_of(program: DrivenProgram, window: float = 0.0) -> JobUncertainty:
    """What a program's job does not know, with the middle of its path for the middle of the part."""
    path = program.path
    places = path.target.position[path.contact] if path.contact.any() else path.target.position
    low, high = column_extremes(places)
    return quantities_of(program.job, window, (low + high) / 2)


def rows_of_band(program: DrivenProgram) -> IntArray:
    """Waypoints that show the band: evenly many, where the tool touches and leaves, and through each reversal."""
    N, path = len(program.time), program.path
    if N <= ROWS:
        return np.arange(N)
    touches = np.flatnonzero(path.contact[1:] != path.contact[:-1])
    rows = [np.linspace(0, N - 1, ROWS).astype(np.int64), touches, touches + 1]
    if len(program.motion.direction) == N:
        turned = np.cumsum(np.abs(np.diff(program.motion.direction, axis=0)).max(axis=1)) // TURN
        turns = np.flatnonzero(np.diff(turned, prepend=0.0))
        rows += [turns, turns + 1]
    return np.unique(np.concatenate(rows))


def columns_along(program: DrivenProgram, uncertainty: JobUncertainty, rows: IntArray) -> Columns:
    """What one unit of each quantity does to the position error at some waypoints.

    Args:
        program: As it is driven.
        uncertainty: Of its job.
        rows: Waypoints, rising, (M,).
    """
    job, parameters = program.job, uncertainty.parameters
    quantities = _by_source(uncertainty)
    changes = np.array([q.cause.parameters for q in quantities]).reshape(len(quantities), -1)  # (Q, P)
    which = np.flatnonzero(changes.any(axis=0)).tolist()
    slopes = build_slopes(job.robot, parameters, which, len(job.heat.names), job.tool.pose)
    theta, rise, motion = program.theta[rows], program.rise[rows], program.motion.at(rows)
    A, B, D = slopes(theta, rise, motion)
    column = A @ changes[:, which].T
    time = program.time[rows]
    for q, warmer in zip(*_rises(job, quantities, time)):
        column[:, :, q] += np.einsum("mik,mk->mi", B, warmer)
    if any(q.cause.width.any() for q in quantities):
        turned = _turned(program, rows)
        for i, quantity in enumerate(quantities):
            column[:, :, i] += np.einsum("mij,mj->mi", D, turned * quantity.cause.width)
    warm = row_norms(_position(program.model, theta, rise, motion) - _position(program.model, theta, 0 * rise, motion))
    return Columns(
        column, np.array([q.mean for q in quantities]), np.array([q.deviation for q in quantities]),
        tuple(q.source or "" for q in quantities), {"thermal physics missing": job.cell.warmth.missing * warm},
    )  # fmt: skip


def _by_source(uncertainty: JobUncertainty) -> list[Quantity]:
    """The quantities, with a name in the budget for each: that of the source whose parameters it changes."""
    budgets = uncertainty.parameters.budgets()
    named = []
    for q in uncertainty.quantities:
        source = q.source or budgets[int(np.flatnonzero(q.cause.parameters)[0])]
        named.append(Quantity(q.name, source, q.cause, q.limits))
    return named


def _rises(job: Job, quantities: list[Quantity], time: Array) -> tuple[list[int], list[Array]]:
    """Which quantities change the warmth, and by how much at some times, (M, K) [K] each."""
    which, rises = [], []
    of_air = rise_by_air(job.heat, job.history, time)
    of_feed = rise_by_feed(job.heat, job.history, job.feed, time)
    for k, quantity in enumerate(quantities):
        heat, delay = quantity.cause.heat, quantity.cause.delay
        if not (heat.rise.any() or heat.start.any() or heat.air or heat.feed or delay):
            continue
        rise = missed_rise(job.cell.warmth, job.heat, job.history, heat, time) + heat.air * of_air + heat.feed * of_feed
        if delay and quantity.limits is not None:
            # the middle of a window stands for its slope: what standing does fades, the first minute does most
            end = quantity.limits[1]
            rise += delay / end * late_rise(job, end, time, job.state(), job.history.clock)
        which.append(k)
        rises.append(rise)
    return which, rises


def _turned(program: DrivenProgram, rows: IntArray) -> Array:
    """How the direction of each joint changes with its own width, (M, 6), per relative change."""
    widths = reversal_widths(program.job.sources)
    if widths is None:
        return np.zeros((len(rows), 6))

    def directions(factor: float) -> Array:
        sources = [s.with_widths(np.full(6, factor)) for s in program.job.sources if hasattr(s, "with_widths")]
        states = direction_states(reversal_widths(sources), program.theta, program.path.target.position)
        return states.at(rows).direction

    return np.asarray((directions(1 + WIDTH_STEP) - directions(1 - WIDTH_STEP)) / (2 * WIDTH_STEP))


def _position(model: ErrorModel, theta: Array, rise: Array, motion: DirectionState) -> Array:
    return np.asarray(model.actual_pose(theta, rise, motion).position)


def _part_lengths(path: ToolPath, rows: IntArray) -> Array:
    """Length of part that each of some waypoints stands for, (M,) [m]; zero off the part."""
    edges = np.concatenate([path.arc[rows[:1]], (path.arc[rows[1:]] + path.arc[rows[:-1]]) / 2, path.arc[rows[-1:]]])
    return np.asarray(np.where(path.contact[rows], np.maximum(np.diff(edges), 0.0), 0.0))
