"""What a job does not know, as quantities: its sources, its warmth, its frames and its start; and a job with a draw."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, covariance_root
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.error_model.parameter_slopes import SourceParameters, parameters_of
from compgen.error_model.posterior import LAW
from compgen.error_model.source import DirectionDependent, Expanding, Source, Visibility
from compgen.error_model.uncertain_sources import DrawnCause, Quantity
from compgen.job.anchored_start import drifting_rows, state_columns
from compgen.job.job import Cell, Job
from compgen.job.part_frame import PartFrame
from compgen.job.taught_frame import TakenUp, frame_rows, is_own_teaching, is_probe, open_of_frame, taken_up
from compgen.planning.tables import TaughtTable
from compgen.thermal.uncertainty import HeatChange, carried

WIDTH_SPREAD = 0.7  # standard deviation of the logarithm of a width that nobody measured
IDENTIFIED = "identified parameters"  # in the budget
DIGITS = 1e-6  # of the largest eigenvalue: below it are the digits of a posterior's file


@dataclass(frozen=True, eq=False, slots=True)
class JobUncertainty:
    """All that a job does not know."""

    parameters: SourceParameters
    quantities: tuple[Quantity, ...]
    taken: TakenUp | None = None  # by the part's frame; None: it was not taught by this robot


def quantities_of(job: Job, window: float = 0.0, middle: Array | None = None) -> JobUncertainty:
    """What a job does not know.

    Args:
        job: Any.
        window: How late its program may start [s]; it starts at any time within.
        middle: Of the part, World, (3,) [m], about which its frame may be turned; None: the frame's origin.
    """
    frame, tool, cell = job.frame, job.tool.pose, job.cell
    taught = None if frame is None else frame.taught
    about = middle if middle is not None or frame is None else frame.place.position
    in_frame = quantities_in_frame(cell, taught, tool, about)
    nothing, quantities = _no_cause(cell, in_frame.parameters), list(in_frame.quantities)
    if not is_taught_with(tool, frame, cell):
        quantities += _of_tool(job, in_frame.parameters, nothing)
    if window > 0:
        quantities.append(Quantity("start delay", "start delay", replace(nothing, delay=1.0), (0.0, window)))
    return replace(in_frame, quantities=tuple(quantities))


def is_taught_with(tool: Pose, frame: PartFrame | None, cell: Cell) -> bool:
    """Whether this robot taught the part's frame with the tool: the touches know both."""
    taught = None if frame is None else frame.taught
    return taught is not None and is_own_teaching(cell, taught) and is_probe(tool, taught)


def quantities_in_frame(
    cell: Cell, taught: TaughtTable | None, tool: Pose, middle: Array | None = None
) -> JobUncertainty:
    """What a cell does not know on a part, less what the part's frame has taken up of it.

    Args:
        cell: The robot.
        taught: How the part's frame was taught; None: nobody says.
        tool: TCP in the flange.
        middle: Of the part, World, (3,) [m], about which a frame that does not say its touches may be turned.
    """
    of_cell = quantities_of_cell(cell)
    parameters, nothing = of_cell.parameters, _no_cause(cell, of_cell.parameters)
    if taught is None:
        return of_cell
    if not is_own_teaching(cell, taught):
        rows = frame_rows(parameters, with_tool=False)
        more = open_of_frame(taught, rows, np.zeros(3) if middle is None else middle, nothing)
        return replace(of_cell, quantities=(*of_cell.quantities, *more))
    rows = frame_rows(parameters, with_tool=is_probe(tool, taught))
    quantities, taken = taken_up(cell, taught, parameters, of_cell.quantities, rows, nothing)
    return replace(of_cell, quantities=tuple(quantities), taken=taken)


def quantities_of_cell(cell: Cell) -> JobUncertainty:
    """What a cell does not know of its warmth and its sources, whatever it runs."""
    parameters = parameters_of(cell.sources)
    nothing = _no_cause(cell, parameters)
    of_state = _of_state(cell, parameters, nothing)
    of_file = (
        *_of_warmth(cell, nothing),
        *_of_expansion(cell, parameters, nothing),
        *_of_posterior(cell, parameters, nothing),
        *_of_sources(cell, parameters, nothing),
        *_of_widths(cell, nothing),
    )
    drifting = set(drifting_rows(cell, parameters))
    kept = [
        q for q in of_file if not (q.cause.parameters.any() and set(np.flatnonzero(q.cause.parameters)) <= drifting)
    ]
    return JobUncertainty(parameters, (*kept, *of_state))


def _no_cause(cell: Cell, parameters: SourceParameters) -> DrawnCause:
    return DrawnCause(np.zeros(len(parameters.entries)), HeatChange.none(len(cell.heat.names)), np.zeros(6))


def is_identified(cell: Cell) -> bool:
    """Whether somebody measured this robot's errors."""
    return any(known.sigma for known in cell.known)


def refuse_without_uncertainty(job: Job) -> None:
    """Raises InputError for a bound with a probability on a robot whose file does not say how well it is known."""
    if job.bounds.guaranteed is not None:
        refuse_silent_file(job.cell, quantities_of(job), f"{job.source}: bounds.guaranteed")


def refuse_silent_file(cell: Cell, uncertainty: JobUncertainty, where: str) -> None:
    """Raises InputError where a robot file does not say how well its robot is known."""
    is_silent = cell.warmth.is_assumed and not is_identified(cell)
    is_open = cell.warmth.missing or any(q.deviation or q.mean for q in uncertainty.quantities)
    if is_silent or not is_open:
        raise InputError(
            f"{where}: {cell.robot_file} does not say how well it knows its robot; give it "
            "[thermal.uncertainty] (law_K, sensors_K, air_K, cte_um_m_K), or identify the robot"
        )


def changed_job(job: Job, parameters: SourceParameters, cause: DrawnCause) -> Job:
    """A job in a world that differs from what its files say: what a draw of the quantities is, for the twin to fly.

    Args:
        job: As its files say.
        parameters: Of its sources, as ``quantities_of`` has them.
        cause: How the world differs.
    """
    history = job.history
    air = replace(history.air, rise=history.air.rise + cause.heat.air)
    late = (replace(history.standing, duration=cause.delay),) if cause.delay > 0 else ()
    cell = changed_cell(job.cell, parameters, cause)
    return replace(job, cell=cell, history=replace(history, before=(*history.before, *late), air=air))


def changed_cell(cell: Cell, parameters: SourceParameters, cause: DrawnCause) -> Cell:
    """A cell whose sources and heat differ from what its file says; the air around it is no part of it."""
    sources = parameters.moved(cause.parameters)
    if cause.width.any():
        sources = tuple(s.with_widths(np.exp(cause.width)) if isinstance(s, DirectionDependent) else s for s in sources)
    heat = cause.heat if cell.past is None else carried(cell.warmth, cell.past, cell.heat, cause.heat)
    return replace(cell, sources=sources, heat_change=heat)


class OpenLogEnd(NamedTuple):
    """What a log leaves open of the K rises that it ends with."""

    columns: Array  # (C, K) [K] of their covariance
    hidden: Array  # (L, K) [K] by which one sensor may shift them and not be contradicted


def open_log_end(cell: Cell) -> OpenLogEnd:
    """What a log leaves open: nothing without a log."""
    start, hidden, none = cell.warmth.start, cell.warmth.hidden, np.zeros((0, len(cell.heat.names)))
    if start is None or hidden is None:
        return OpenLogEnd(none, none)
    return OpenLogEnd(start.T, hidden)


def _of_warmth(cell: Cell, nothing: DrawnCause) -> Iterator[Quantity]:
    """Law, sensors, air and feed."""
    warmth, zero, log_end = cell.warmth, nothing.heat, open_log_end(cell)

    def quantity(name: str, budget: str, **heat: Any) -> Quantity:
        return Quantity(name, budget, replace(nothing, heat=replace(zero, **heat)))

    if (law := warmth.of_nodes(warmth.law)).any():
        for name, rise in zip(cell.heat.names, np.diag(law), strict=True):
            yield quantity(f"law of {name}", "temperature law", rise=rise)
    if warmth.sensors:
        shift = np.full(len(cell.heat.names), warmth.sensors)
        # what an anchored state or a log begins with is known as its own covariance says
        is_found = cell.state is not None or len(log_end.columns) > 0
        yield quantity("thermocouples", "thermocouples", rise=shift, start=zero.start if is_found else shift)
    for k, start in enumerate(log_end.columns):
        yield quantity(f"log's end {k + 1}", "temperature log", start=start)
    if warmth.air:
        yield quantity("air", "air", air=warmth.air)
    if warmth.feed:
        yield quantity("feed", "feed", feed=warmth.feed)


def _of_state(cell: Cell, parameters: SourceParameters, nothing: DrawnCause) -> list[Quantity]:
    """What the touches left open: the columns of an anchored state's covariance, whose rises fade with their lag."""
    return [
        Quantity(
            f"state {k + 1}", "anchored state",
            replace(nothing, parameters=values, heat=replace(nothing.heat, start=rise)),
        )
        for k, (values, rise) in enumerate(zip(*state_columns(cell, parameters), strict=True))
    ]  # fmt: skip


def _of_expansion(cell: Cell, parameters: SourceParameters, nothing: DrawnCause) -> Iterator[Quantity]:
    r"""The coefficient of expansion and the profiles, where the file gives intervals and nobody measured them.

    A warm-up that was measured is foretold with the file's own coefficient and profiles. What these are off by, f of
    the thermal error e, is in every forecast, and in the share kappa that forecasts miss, alike along any direction:

        |f e|^2 / 3 = kappa^2 |e|^2        so |f e| = sqrt(3) kappa |e|, within the half-width 2 kappa |e|

    No pose tells an expansion from other physics that is missing. It counts there, and not here once more.
    """
    warmth = cell.warmth
    for k, source in enumerate(parameters.sources):
        if not isinstance(source, Expanding) or _is_warm_measured(cell, source) or warmth.expansion is None:
            continue
        rows = {n: parameters.at(k, e.field, e.index) for n, e in source.expansions().items()}
        units = np.eye(len(parameters.entries))
        together = replace(nothing, parameters=units[list(rows.values())].sum(axis=0))
        yield Quantity("cte", "cte", together, warmth.expansion)
        for length, limits in warmth.growth.items():
            cause = replace(nothing, parameters=units[rows[length]])
            yield Quantity(f"profile of {length}", "profile shape", cause, limits)


def _of_sources(cell: Cell, parameters: SourceParameters, nothing: DrawnCause) -> list[Quantity]:
    """Each number of a source by its sigma; where it was never identified by its prior, as far as a pose shows it."""
    deviation = np.zeros(len(parameters.entries))
    together = set() if cell.posterior is None else {p.table for p in cell.posterior.parameters}
    everything = Visibility(cell.robot, tuple(range(6)), warm_up=True, temperatures=True)
    for k, source in enumerate(parameters.sources):
        known = next((known for known in cell.known if known.source is source), None)
        if known is None or (known.sigma and source.NAME in together):
            continue
        is_interval = cell.warmth.expansion is not None or cell.fit.missing is not None
        if not known.sigma and isinstance(source, Expanding) and is_interval:
            continue
        shown = {(entry.field, entry.index) for entry in source.entries_to_fit(everything)}
        for i, entry in enumerate(parameters.entries):
            place = entry.field, entry.index
            if entry.source != k or (not known.sigma and place not in shown):
                continue
            deviations = known.sigma or known.prior
            if entry.field in deviations:
                deviation[i] = deviations[entry.field][entry.index]
    return [
        Quantity(_name(parameters, i), None, replace(nothing, parameters=deviation[i] * unit))
        for i, unit in enumerate(np.eye(len(deviation)))
        if deviation[i] > 0
    ]


def _of_posterior(cell: Cell, parameters: SourceParameters, nothing: DrawnCause) -> list[Quantity]:
    r"""The identified numbers together: the columns of F, C = F F^T, each a quantity.

    Of play p, which runs through each reversal measure, what the rest r does not tell stands by itself:

        C = F_r F_r^T + F_p F_p^T,    F_r = (I, G) C_rr^1/2,    F_p = (0, (C_pp - G C_rp)^1/2),    G = C_pr C_rr^+
    """
    posterior = cell.posterior
    if posterior is None:
        return []
    size = np.where(posterior.sigma > 0, posterior.sigma, 1.0)
    budgets = {s.NAME: s.BUDGET for s in parameters.sources if isinstance(s, DirectionDependent)}
    play = np.array([p.table in budgets for p in posterior.parameters])
    rows = sorted((budgets.get(p.table, IDENTIFIED) for p in posterior.parameters), key=IDENTIFIED.__ne__)
    F = size[:, None] * _factor(posterior.covariance / np.outer(size, size), play)
    names = [source.NAME for source in parameters.sources]
    places = {(e.source, e.field, e.index): n for n, e in enumerate(parameters.entries)}
    R, K = len(F), len(cell.heat.names)
    changes, width, scale, lag = (np.zeros((R, n)) for n in (len(places), 6, K, K))
    for parameter, value, row in zip(posterior.parameters, posterior.value.tolist(), F, strict=True):
        if parameter.table == LAW:
            (scale if parameter.key == "rise_K" else lag)[:, parameter.index[0]] = row / value
            continue
        source = names.index(parameter.table)
        if any(p.field == parameter.field for p in parameters.sources[source].PARAMETERS):
            changes[:, places[source, parameter.field, parameter.index]] = row
        else:
            width[:, parameter.index[0]] = row / value
    return [
        Quantity(
            f"identified {k + 1}", rows[k],
            DrawnCause(changes[k], replace(nothing.heat, scale=scale[k], lag=lag[k]), width[k]),
        )
        for k in range(R)
    ]  # fmt: skip


def _factor(C: Array, last: BoolArray) -> Array:
    """F of C = F F^T, (R, R), whose last columns are not zero in the last rows alone, (R,)."""
    a, b, F = np.flatnonzero(~last), np.flatnonzero(last), np.zeros_like(C)
    root = covariance_root(C[np.ix_(a, a)])
    G = C[np.ix_(b, a)] @ np.linalg.pinv(C[np.ix_(a, a)], rcond=DIGITS, hermitian=True)
    F[a, : len(a)], F[b, : len(a)] = root, G @ root
    F[b, len(a) :] = covariance_root(C[np.ix_(b, b)] - G @ C[np.ix_(a, b)])
    return F


def _of_widths(cell: Cell, nothing: DrawnCause) -> Iterator[Quantity]:
    """How far each joint turns to forget a reversal, where reversals were not measured: to a factor."""
    measured = () if cell.posterior is None else cell.posterior.parameters
    for source in cell.sources:
        if not isinstance(source, DirectionDependent):
            continue
        shown = {p.index for p in measured if p.table == source.NAME and p.field == "width"}
        for i in np.flatnonzero(np.isfinite(source.reversal_widths().joint)).tolist():
            if (i,) not in shown:
                cause = replace(nothing, width=WIDTH_SPREAD * np.eye(6)[i])
                yield Quantity(f"{source.NAME}.width[{i + 1}]", source.BUDGET, cause)


def _of_tool(job: Job, parameters: SourceParameters, nothing: DrawnCause) -> list[Quantity]:
    """Where the TCP is in the flange."""
    units = np.eye(len(parameters.entries))
    return [
        Quantity(f"tool {axis}", "tool", replace(nothing, parameters=sigma * units[row]))
        for axis, row, sigma in zip("xyz", parameters.tool(), job.tool.sigma, strict=True)
        if sigma
    ]


def _is_warm_measured(cell: Cell, source: Source) -> bool:
    """Whether a source was identified, or what it is off by is in what the forecasts of a warm-up missed."""
    return cell.fit.missing is not None or any(bool(known.sigma) for known in cell.known if known.source is source)


def _name(parameters: SourceParameters, i: int) -> str:
    entry = parameters.entries[i]
    return f"{parameters.sources[entry.source].NAME}.{entry.field}[{','.join(str(n + 1) for n in entry.index)}]"


def amounts(quantities: Sequence[Quantity], z: Array) -> list[float]:
    """The amounts of standard normal numbers (Q,)."""
    return [q.amount(value) for q, value in zip(quantities, z.tolist(), strict=True)]
