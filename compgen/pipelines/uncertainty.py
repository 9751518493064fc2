"""What a job does not know, as quantities: its sources, its warmth, its frames and its start; and a job with a draw."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import MDEG, UM
from compgen.error_model.knowledge import SourceParameters, parameters_of
from compgen.error_model.quantities import Cause, Quantity
from compgen.error_model.source import DirectionDependent, Expanding
from compgen.pipelines.job import Job
from compgen.thermal.uncertainty import HeatChange


@dataclass(frozen=True, eq=False, slots=True)
class JobUncertainty:
    """All that a job does not know."""

    parameters: SourceParameters
    quantities: tuple[Quantity, ...]


def quantities_of(job: Job, window: float = 0.0, middle: Array | None = None) -> JobUncertainty:
    """What a job does not know.

    Args:
        job: Any.
        window: How late its program may start [s]; it starts at any time within.
        middle: Of the part, World, (3,) [m], about which its frame may be turned; None: the frame's origin.
    """
    parameters = parameters_of(job.sources)
    nothing = Cause(np.zeros(len(parameters.entries)), HeatChange(*np.zeros((2, len(job.heat.names)))), np.zeros(6))
    quantities = [
        *_of_warmth(job, nothing),
        *_of_expansion(job, parameters, nothing),
        *_of_sources(job, parameters, nothing),
        *_of_frame(job, parameters, nothing, middle),
    ]
    if window > 0:
        quantities.append(Quantity("start delay", "start delay", replace(nothing, delay=1.0), (0.0, window)))
    return JobUncertainty(parameters, tuple(quantities))


def changed_job(job: Job, parameters: SourceParameters, cause: Cause) -> Job:
    """A job in a world that differs from what its files say: what a draw of the quantities is, for the twin to fly.

    Args:
        job: As its files say.
        parameters: Of its sources, as ``quantities_of`` has them.
        cause: How the world differs.
    """
    history = job.history
    air = replace(history.air, rise=history.air.rise + cause.heat.air)
    late = (replace(history.standing, duration=cause.delay),) if cause.delay > 0 else ()
    sources = parameters.moved(cause.parameters)
    if cause.width.any():
        sources = tuple(s.with_widths(1 + cause.width) if isinstance(s, DirectionDependent) else s for s in sources)
    return replace(
        job,
        cell=replace(job.cell, sources=sources),
        history=replace(history, before=(*history.before, *late), air=air),
        heat_change=cause.heat,
    )


def _of_warmth(job: Job, nothing: Cause) -> list[Quantity]:
    """Law, sensors, air and feed."""
    warmth, zero = job.cell.warmth, nothing.heat
    K = len(job.heat.names)
    quantities = []
    if warmth.law:
        for name, unit in zip(job.heat.names, np.eye(K)):
            heat = replace(zero, rise=warmth.law * unit)
            quantities.append(Quantity(f"law of {name}", "temperature law", replace(nothing, heat=heat)))
    if warmth.sensors:
        shift = np.full(K, warmth.sensors)
        heat = replace(zero, rise=shift, start=shift)
        quantities.append(Quantity("thermocouples", "thermocouples", replace(nothing, heat=heat)))
    if warmth.air:
        quantities.append(Quantity("air", "air", replace(nothing, heat=replace(zero, air=warmth.air))))
    if warmth.feed:
        quantities.append(Quantity("feed", "feed", replace(nothing, heat=replace(zero, feed=warmth.feed))))
    return quantities


def _of_expansion(job: Job, parameters: SourceParameters, nothing: Cause) -> list[Quantity]:
    """The coefficient of expansion and the profiles, where the file gives intervals and nobody identified them."""
    warmth, quantities = job.cell.warmth, []
    for k, source in enumerate(parameters.sources):
        if not isinstance(source, Expanding) or _sigma_of(job, k, parameters) or warmth.expansion is None:
            continue
        rows = {n: parameters.at(k, e.field, e.index) for n, e in source.expansions().items()}
        unit = np.zeros(len(parameters.entries))
        unit[list(rows.values())] = 1.0
        quantities.append(Quantity("cte", "cte", replace(nothing, parameters=unit), warmth.expansion))
        for length, limits in warmth.growth.items():
            unit = np.zeros(len(parameters.entries))
            unit[rows[length]] = 1.0
            cause = replace(nothing, parameters=unit)
            quantities.append(Quantity(f"profile of {length}", "profile shape", cause, limits))
    return quantities


def _of_sources(job: Job, parameters: SourceParameters, nothing: Cause) -> list[Quantity]:
    """Each number of a source by its sigma, or where it was never identified by its prior."""
    deviation = np.zeros(len(parameters.entries))
    for i, entry in enumerate(parameters.entries):
        source = parameters.sources[entry.source]
        known = next((known for known in job.cell.known if known.source is source), None)
        if known is None or (
            isinstance(source, Expanding) and job.cell.warmth.expansion is not None and not known.sigma
        ):
            continue
        # a source that no fit can tell has no prior of measurements: its values stand as the file has them
        deviations = known.sigma or ({} if source.FITTING is None else known.prior)
        if entry.field in deviations:
            deviation[i] = deviations[entry.field][entry.index]
    return [
        Quantity(_name(parameters, i), None, replace(nothing, parameters=deviation[i] * unit))
        for i, unit in enumerate(np.eye(len(deviation)))
        if deviation[i] > 0
    ]


def _of_frame(job: Job, parameters: SourceParameters, nothing: Cause, middle: Array | None) -> list[Quantity]:
    """Where the part stands: shifted by d and turned by w about its middle c, the base is off by w x c - d and -w."""
    taught = None if job.frame is None else job.frame.taught
    if job.frame is None or taught is None:
        return []
    position, rotation = parameters.base()
    middle = job.frame.place.position if middle is None else middle
    quantities = []
    for i, (shift, turn) in enumerate(zip(taught.sigma_um, taught.sigma_mdeg)):
        for what, d, w in (("place", shift * UM, 0.0), ("turn", 0.0, turn * MDEG)):
            unit, values = np.eye(3)[i], np.zeros(len(parameters.entries))
            values[position], values[rotation] = w * np.cross(unit, middle) - d * unit, -w * unit
            if values.any():
                cause = replace(nothing, parameters=values)
                quantities.append(Quantity(f"part's {what} {'xyz'[i]}", "part's frame", cause))
    return quantities


def _sigma_of(job: Job, k: int, parameters: SourceParameters) -> bool:
    """Whether a source was identified."""
    return any(bool(known.sigma) for known in job.cell.known if known.source is parameters.sources[k])


def _name(parameters: SourceParameters, i: int) -> str:
    entry = parameters.entries[i]
    return f"{parameters.sources[entry.source].NAME}.{entry.field}[{','.join(str(n + 1) for n in entry.index)}]"


def amounts(quantities: Sequence[Quantity], z: Array) -> list[float]:
    """The amounts of standard normal numbers (Q,)."""
    return [q.amount(value) for q, value in zip(quantities, z.tolist(), strict=True)]
