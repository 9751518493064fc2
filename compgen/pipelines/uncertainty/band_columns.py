"""The band of a planned program: its job's quantities as columns at waypoints along it, folded in ``verification``."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray, column_extremes, row_norms
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.units import PERCENT
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.error_model.model import ErrorModel
from compgen.error_model.parameter_slopes import build_slopes
from compgen.error_model.source import Source
from compgen.error_model.uncertain_sources import Quantity
from compgen.job.job import Cell, Job
from compgen.job.start_window import PromptMotion, late_rise
from compgen.job.uncertainty import JobUncertainty, is_identified, open_log_end, quantities_of
from compgen.planning.toolpath import ToolPath
from compgen.thermal.schedule import History
from compgen.thermal.uncertainty import HeatChange, Past, added_rise
from compgen.verification.band import Band, Columns, band_of, field_correlation, parted_by_teaching

ROWS = 8192  # waypoints at which a band is evaluated, at a time; all of a program of so many
SPACING = 0.01  # [m] of a longer one's path between two of them
MOST_ROWS = 65_536  # of the longest
TURN = 0.1  # of a joint's direction, after which a reversal gets another one
MISSING = "thermal physics missing"  # in the budget
FIT_NOISE = "fit noise"  # there as well: of cold places, what no source explains
MOTION = "the controller's motion"  # there as well
PARTED = 256  # waypoints by which it is parted into where the part stands and the rest


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class WaypointProgram(PromptMotion):
    """A program of N waypoints as it is driven."""

    job: Job
    model: ErrorModel
    path: ToolPath


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Places(PromptMotion):
    """M places on a program's way, with one tool."""

    tool: Pose  # TCP in the flange
    turned: Array | None = None  # (M, 6) how each joint's direction changes with the logarithm of its width


def band_along(program: WaypointProgram, window: float = 0.0) -> Band:
    """What a job's files leave open along its program.

    Args:
        program: As it is driven.
        window: How late it may start [s].
    """
    rows = rows_of_band(program)
    uncertainty = job_uncertainty(program, window)
    turned = _turned(program, uncertainty, rows)
    parts = [slice(k, k + ROWS) for k in range(0, len(rows), ROWS)]
    columns = (_columns(program, uncertainty, rows[part], turned[part]) for part in parts)
    weight, scale = _part_lengths(program.path, rows), program.job.cell.fit.scale
    band = band_of(columns, rows, weight, scale)
    if uncertainty.taken is not None or not is_identified(program.job.cell):
        return band
    on_part = np.flatnonzero(weight) if weight.any() else np.arange(len(rows))
    few = on_part[np.unique(np.linspace(0, len(on_part) - 1, PARTED).astype(int))]
    at_few = _columns(program, uncertainty, rows[few], turned[few])
    place = program.path.target.position[rows[few]]
    return replace(band, parted=parted_by_teaching(at_few, place, weight[few], scale))


def assumed_findings(cell: Cell) -> Iterator[Finding]:
    """Notes where the robot file leaves it to compgen how well it is known."""
    warmth = cell.warmth
    drifting = {name.partition(".")[0] for name in (() if cell.state is None else cell.state.drifting)}
    guessed = [
        k.source.NAME for k in cell.known if not k.sigma and _has_values(k.source) and k.source.NAME not in drifting
    ]
    if guessed:
        yield Finding.of(
            Code.SOURCES_SIGMA,
            f"sources.{', '.join(guessed)}: no sigma: in the band their values are known no better than before any "
            "measurement; identify the robot, or give sigma",
        )
    if warmth.is_assumed:
        yield Finding.of(
            Code.THERMAL_UNCERTAINTY,
            f"the robot file says nothing in [thermal.uncertainty]; the band assumes {warmth.law:g} K of law, "
            f"{warmth.sensors:g} K of sensors, {warmth.air:g} K of air, {warmth.feed / PERCENT:g} % of feed, "
            f"{warmth.missing / PERCENT:g} % of missing physics; give what is known",
        )


def _has_values(source: Source) -> bool:
    """Whether a source that measurements can tell has values that are not zero."""
    return source.FITTING is not None and any(np.any(getattr(source, p.field)) for p in source.PARAMETERS)


def job_uncertainty(program: WaypointProgram, window: float = 0.0) -> JobUncertainty:
    """What a program's job does not know, with the middle of its path for the middle of the part."""
    path = program.path
    places = path.target.position[path.rows_on_part()]
    low, high = column_extremes(places)
    return quantities_of(program.job, window, (low + high) / 2)


def rows_of_band(program: WaypointProgram) -> IntArray:
    """Waypoints that show the band: evenly along the path, where the tool touches and leaves, through each reversal."""
    N, path = len(program.time), program.path
    if N <= ROWS:
        return np.arange(N)
    touches = np.flatnonzero(path.contact[1:] != path.contact[:-1])
    count = int(np.clip(path.arc[-1] / SPACING, ROWS, MOST_ROWS))
    even = np.searchsorted(path.arc, np.linspace(0.0, path.arc[-1], count)).clip(max=N - 1)
    rows = [np.array([0, N - 1]), even, touches, touches + 1]
    if len(program.motion.direction) == N:
        turned = np.cumsum(np.abs(np.diff(program.motion.direction, axis=0)).max(axis=1)) // TURN
        turns = np.flatnonzero(np.diff(turned, prepend=0.0))
        rows += [turns, turns + 1]
    return np.unique(np.concatenate(rows))


def columns_along(program: WaypointProgram, uncertainty: JobUncertainty, rows: IntArray) -> Columns:
    """What one unit of each quantity does to the position error at some waypoints.

    Args:
        program: As it is driven.
        uncertainty: Of its job.
        rows: Waypoints, rising, (M,).
    """
    return _columns(program, uncertainty, rows, _turned(program, uncertainty, rows))


def _columns(program: WaypointProgram, uncertainty: JobUncertainty, rows: IntArray, turned: Array) -> Columns:
    """``columns_along`` with what the widths of reversals do to the directions there, (M, 6)."""
    job = program.job
    history = replace(job.history, before=job.duties_before())
    places = Places(
        theta=program.theta[rows],
        time=program.time[rows],
        rise=program.rise[rows],
        motion=program.motion.at(rows),
        tool=job.tool.pose,
        turned=turned,
    )
    late = [q.limits[1] for q in uncertainty.quantities if q.cause.delay and q.limits is not None]
    # what a whole window of standing does stands for each second of it
    by_delay = late_rise(job, late[0], places.time, job.state(), job.clock) / late[0] if late else None
    return columns_at(job.cell, history, job.feed, uncertainty, places, program.model, by_delay)


def columns_at(
    cell: Cell, history: History, feed: float, uncertainty: JobUncertainty, places: Places, model: ErrorModel,
    by_delay: Array | None = None,
) -> Columns:  # fmt: skip
    """What one unit of each quantity does to the position error at M places.

    Args:
        cell: The robot.
        history: What it did before.
        feed: Of the program [m/s].
        uncertainty: Of the cell.
        places: Where, when and how warm.
        model: The error, with the places' tool.
        by_delay: What each second of a late start adds to the rises, (M, K) [K/s].
    """
    quantities, parameters = by_source(uncertainty), uncertainty.parameters
    changes = np.array([q.cause.parameters for q in quantities]).reshape(len(quantities), len(parameters.entries))
    which = tuple(np.flatnonzero(changes.any(axis=0)).tolist())
    slopes = build_slopes(cell.robot, parameters, which, len(cell.heat.names), places.tool)
    A, B, D = slopes(places.theta, places.rise, places.motion)
    column = A @ changes[:, which].T
    past = cell.past or Past(cell.heat, history, feed)
    time = np.maximum(places.time - past.passed, 0.0)
    for k, quantity in enumerate(quantities):
        heat, delay, width = quantity.cause.heat, quantity.cause.delay, quantity.cause.width
        if heat.rise.any() or heat.start.any() or heat.air or heat.changes_model:
            column[:, :, k] += np.einsum("mik,mk->mi", B, added_rise(cell.warmth, past, heat, time))
        if delay and by_delay is not None:
            column[:, :, k] += np.einsum("mik,mk->mi", B, delay * by_delay)
        if width.any() and places.turned is not None:
            column[:, :, k] += np.einsum("mij,mj->mi", D, places.turned * width)
    at, cold = (model.actual_pose(places.theta, rise, places.motion) for rise in (places.rise, 0 * places.rise))
    warm = row_norms(at.position - cold.position + taken_at(uncertainty, at, places.tool))
    scatter = scatter_along(cell, uncertainty, at, places.tool)
    return Columns(
        column=column,
        mean=np.array([q.mean for q in quantities]),
        deviation=np.array([q.deviation for q in quantities]),
        source=tuple(q.source or "" for q in quantities),
        undirected={MISSING: cell.missing * warm, **scatter},
        hidden=_hidden(cell, past, time, B),
    )


def scatter_along(cell: Cell, uncertainty: JobUncertainty, at: Pose, tool: Pose) -> dict[str, Array]:
    """What has no direction at M poses of the tool, by its name in the budget, (M,) [m] of each coordinate.

    It is everywhere the same, but for the fit noise: a smooth field (``random_field``), of which a taught frame has
    taken up a part.
    """
    fit, motion, taken = cell.fit, cell.robot.motion, uncertainty.taken
    sizes = {FIT_NOISE: fit.noise}
    if fit.repeatability is not None:
        sizes["repeatability"] = fit.repeatability
    if motion is not None and motion.evidence is not None and motion.evidence.misfit:
        sizes[MOTION] = motion.evidence.misfit
    scatter = {source: np.full(len(at), size) for source, size in sizes.items()}
    if taken is not None:
        along, between = (field_correlation(place, taken.touched) for place in (at.position, taken.touched))
        flange = at.rotation @ tool.rotation.T if taken.with_tool else None
        left = taken.share.left_of_field(along, between, at.position, flange)
        scatter[FIT_NOISE] *= np.sqrt(np.maximum(left, 0.0))
    return scatter


def taken_at(uncertainty: JobUncertainty, at: Pose, tool: Pose) -> Array:
    """By how much a taught frame has taken up the thermal error at poses of the tool, (M, 3) [m]; added to it."""
    if uncertainty.taken is None:
        return np.zeros(at.position.shape)
    shift, turn, longer = np.split(uncertainty.taken.warm, 3)
    return np.asarray(shift + np.cross(turn, at.position) + at.rotation @ (tool.rotation.T @ longer))


def _hidden(cell: Cell, past: Past, time: Array, B: Array) -> Array:
    """Most that a temperature sensor may move the tool and not be contradicted, (M,) [m]."""
    most, none = np.zeros(len(time)), HeatChange.none(len(cell.heat.names))
    for start in open_log_end(cell).hidden:
        rise = added_rise(cell.warmth, past, replace(none, start=start), time)
        most = np.maximum(most, row_norms(np.einsum("mik,mk->mi", B, rise)))
    return most


def by_source(uncertainty: JobUncertainty) -> list[Quantity]:
    """The quantities, with a name in the budget for each: that of the source whose parameters it changes."""
    budgets = uncertainty.parameters.budgets()
    return [
        q if q.source else replace(q, source=budgets[int(np.flatnonzero(q.cause.parameters)[0])])
        for q in uncertainty.quantities
    ]


def _turned(program: WaypointProgram, uncertainty: JobUncertainty, rows: IntArray) -> Array:
    r"""By how much each joint's direction changes with the logarithm of its width w, (M, 6); zero if none is off.

    Over one standard deviation s to both sides, since a direction stays within [-1, 1]:

        (u(w exp s) - u(w exp -s)) / 2 s
    """
    s = np.sqrt(sum(((q.deviation * q.cause.width) ** 2 for q in uncertainty.quantities), np.zeros(6)))
    if not s.any():
        return np.zeros((len(rows), 6))

    def directions(factor: Array) -> Array:
        sources = [k.with_widths(factor) for k in program.job.sources if hasattr(k, "with_widths")]
        states = direction_states(reversal_widths(sources), program.theta, program.path.target.position)
        return states.at(rows).direction

    return np.asarray((directions(np.exp(s)) - directions(np.exp(-s))) / np.where(s > 0, 2 * s, 1.0))


def _part_lengths(path: ToolPath, rows: IntArray) -> Array:
    """Length of part that each of some waypoints stands for, (M,) [m]; zero off the part."""
    edges = np.concatenate([path.arc[rows[:1]], (path.arc[rows[1:]] + path.arc[rows[:-1]]) / 2, path.arc[rows[-1:]]])
    return np.asarray(np.where(path.contact[rows], np.maximum(np.diff(edges), 0.0), 0.0))
