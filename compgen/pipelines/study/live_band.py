r"""The band of a living page: what the files leave open, in whatever state the sliders stand at.

As ``pipelines/uncertainty/band_columns`` has it, with the columns of the quantities parted by what the day moves:

    c_q(n) = A_q(n) + (cte / cte_0)^{g_q} A'_q(n) r(t_n) + B(n) h_q(t_n)
    h_q = G_q Y(t) + S_q e^{-(T_0 + tau + d + t) / lag} + air_q a(t) + (r_{m+} - r_{m-}) / (2 step)

A' is how a column grows with the rises (what heat lengthens is more when it is warmer), g_q whether it goes with the
coefficient of expansion, Y how what the law misses has built up through the day, a what air adds that is one kelvin
warmer, and r_{m+-} the rises of models whose feed, rises or time constants are a step off. Where a file gives an
interval of the coefficient of expansion, that is of the absolute one: cte_low / cte - 1 to cte_high / cte - 1. Here h
is ``thermal.uncertainty``'s own; ``report/live/live.js`` has it in closed form.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, rms
from compgen.error_model.parameter_slopes import build_slopes
from compgen.error_model.uncertain_sources import Quantity
from compgen.job.job import Job
from compgen.job.uncertainty import quantities_of
from compgen.pipelines.study.geometry import Geometry, part_weight, some_samples, uncertainty_along
from compgen.pipelines.study.live_day import SliderValues, history_at
from compgen.pipelines.study.live_places import Live, expansion_factor, own_heat, rises_left, single
from compgen.pipelines.uncertainty.band_columns import MISSING, by_source, scatter_along, taken_at
from compgen.thermal import NodeModel
from compgen.thermal.uncertainty import STEP, DisturbedHeat, HeatChange, Past, added_rise, steady_miss
from compgen.verification.band import Band, Columns, band_of

LEAST = 1e-9 / 15.0  # [m/K] below it a column does not grow with the rises


@dataclass(frozen=True, eq=False, slots=True)
class ModelStep:
    """A pair of models of the nodes a step to either side."""

    laws: tuple[NodeModel, NodeModel]  # +, -
    cycle: tuple[Array, Array]  # (R, S) what the cycle adds until each run
    step: float


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LiveQuantity:
    """One number that the files do not know."""

    quantity: Quantity
    column: Array  # (N, 3) A_q
    by_rise: Array | None  # (N, 3, K) A'_q
    expands: bool  # g_q
    absolute: tuple[float, float] | None  # limits of the coefficient itself, in the slider's unit
    missed: Array  # (K,) G_q
    model: int  # number of its pair of models; -1: none

    @property
    def has_heat(self) -> bool:
        """Whether it changes how warm the robot is."""
        heat = self.quantity.cause.heat
        return bool(heat.rise.any() or heat.start.any() or heat.air or self.model >= 0)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LiveBand:
    """What the formula needs at N samples."""

    time: Array  # (N,) [s]
    on_part: Array  # (N,)
    slope: Array  # (N, 3, K)
    growth: Array  # (N, 3, K)
    program: Array  # (N, K)
    quantities: tuple[LiveQuantity, ...]
    models: tuple[ModelStep, ...]
    build_up_cycle: Array  # (R, K) what the cycle adds to Y until each run
    undirected: tuple[tuple[str, float], ...]  # source and what it is everywhere [m]
    missing: float  # kappa
    taken: Array  # (N, 3) [m] of the thermal error, by a frame that was taught
    scale: float  # lambda
    feed: float  # [m/s] of the program


def band_places(job: Job, live: Live, geometry: Geometry, dearer: Job | None) -> LiveBand:
    """The band's samples of a job's planned text.

    Args:
        job: As planned.
        live: Its day.
        geometry: Of the planned text.
        dearer: The job with twice the coefficient of expansion; None: no slider moves that.
    """
    some, K = some_samples(geometry), len(job.heat.names)
    thin = geometry.at(some)
    uncertainty, at = uncertainty_along(job, geometry), job.cell.error_model(job.tool.pose).nominal_pose(thin.theta)
    scatter = scatter_along(job.cell, uncertainty, at, job.tool.pose)
    named, none = by_source(uncertainty), np.zeros((len(some), K))
    changes = np.array([q.cause.parameters for q in named]).reshape(len(named), len(uncertainty.parameters.entries))
    which = tuple(np.flatnonzero(changes.any(axis=0)).tolist()) or (0,)
    slopes = build_slopes(job.robot, uncertainty.parameters, which, K, job.tool.pose)
    both = slopes(thin.theta, none, thin.turns)[1]
    growth = np.zeros_like(both)
    if dearer is not None:
        of_dearer = build_slopes(job.robot, quantities_of(dearer).parameters, which, K, job.tool.pose)
        growth = of_dearer(thin.theta, none, thin.turns)[1] - both

    def columns(rise: Array) -> Array:
        return np.asarray(slopes(thin.theta, none + rise, thin.turns)[0] @ changes[:, which].T)

    cold = columns(np.zeros(K))
    by_rise = np.stack([columns(unit) - cold for unit in np.eye(K)], axis=2)  # (N, 3, K, Q)
    steps = [_model_step(job, live, q.cause.heat) for q in named]
    models = [step for step in steps if step is not None]
    numbers = [-1 if step is None else models.index(step) for step in steps]
    quantities = [
        LiveQuantity(
            quantity=q,
            column=single(cold[:, :, k]),
            by_rise=single(by_rise[..., k]) if np.abs(by_rise[..., k]).max(initial=0.0) > LEAST else None,
            expands=q.name == "cte" or q.name.startswith("profile of "),
            absolute=None if dearer is None else _absolute(q, live.cte),
            missed=steady_miss(job.cell.warmth, q.cause.heat.rise),
            model=numbers[k],
        )
        for k, q in enumerate(named)
    ]
    return LiveBand(
        time=thin.now,
        on_part=part_weight(geometry, thin),
        slope=single(both - growth),
        growth=single(growth),
        program=single(own_heat(job, geometry)[some]),
        quantities=tuple(quantities),
        models=tuple(models),
        build_up_cycle=_build_up(job, live),
        undirected=tuple((name, rms(size)) for name, size in scatter.items()),
        missing=job.cell.missing,
        taken=taken_at(uncertainty, at, job.tool.pose),
        scale=job.cell.fit.scale,
        feed=job.feed,
    )


def _absolute(q: Quantity, cte: float) -> tuple[float, float] | None:
    """Limits of the coefficient of expansion itself, where that is the quantity, in the slider's unit."""
    if q.name != "cte" or q.limits is None:
        return None
    return cte * (1 + q.limits[0]), cte * (1 + q.limits[1])


def _model_step(job: Job, live: Live, change: HeatChange) -> ModelStep | None:
    """The pair of models of a change of the law; None of one that leaves it alone."""
    law = job.cell.heat.law
    if law is None or not change.changes_model:
        return None
    step = STEP / max(abs(change.feed), np.abs(change.scale).max(), np.abs(change.lag).max())

    def other(factor: float) -> NodeModel:
        scale, lag = (1 + factor * change.scale), np.exp(factor * change.lag)
        feed = law.reference_feed / (1 + factor * change.feed)
        return replace(law, reference_rise=law.reference_rise * scale, tau=law.tau * lag, reference_feed=feed)

    plus, minus = other(step), other(-step)
    return ModelStep((plus, minus), (live.cycle.modes(plus), live.cycle.modes(minus)), step)


def _build_up(job: Job, live: Live) -> Array:
    """What the cycle does until each run to a miss that is one in endless motion, (R, K)."""
    heat, warmth, K = job.cell.heat, job.cell.warmth, len(job.heat.names)
    one = replace(HeatChange.none(K), rise=-np.expm1(-warmth.reference_time / warmth.lag))
    return live.cycle.modes(DisturbedHeat(heat, warmth, one))[:, -K:]


def band_at(live: Live, band: LiveBand, setting: SliderValues) -> Band:
    """The band with the sliders at a setting."""
    cell, history, factor = live.day.cell, history_at(live.day, setting), expansion_factor(live, setting)
    r, past = rises_left(cell.heat, history, band.time) + band.program, Past(cell.heat, history, band.feed)
    B, N, named = band.slope + factor * band.growth, len(band.time), []
    columns = np.zeros((N, 3, len(band.quantities)))
    for k, live_quantity in enumerate(band.quantities):
        q = live_quantity.quantity
        columns[:, :, k] = live_quantity.column
        if live_quantity.by_rise is not None:
            grown = factor if live_quantity.expands else 1.0
            columns[:, :, k] += grown * np.einsum("nik,nk->ni", live_quantity.by_rise, r)
        if live_quantity.has_heat:
            columns[:, :, k] += np.einsum("nik,nk->ni", B, added_rise(cell.warmth, past, q.cause.heat, band.time))
        if live_quantity.absolute is not None:
            low, high = (limit / (live.cte * factor) - 1 for limit in live_quantity.absolute)
            q = replace(q, limits=(low, high))
        named.append(q)
    warm = np.linalg.norm(np.einsum("nik,nk->ni", B, r) + band.taken, axis=1)
    of_samples = Columns(
        column=columns,
        mean=np.array([q.mean for q in named]),
        deviation=np.array([q.deviation for q in named]),
        source=tuple(q.source or "" for q in named),
        undirected={MISSING: band.missing * warm, **{name: np.full(N, size) for name, size in band.undirected}},
        hidden=np.zeros(N),
    )
    return band_of([of_samples], np.arange(N), band.on_part, band.scale)
