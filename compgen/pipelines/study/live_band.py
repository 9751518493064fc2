r"""The band of a living page: what the files leave open, in whatever state the sliders stand at.

As ``pipelines/band`` has it, with the columns of the quantities parted by what the day moves:

    c_q(n) = A_q(n) + (cte / cte_0)^{g_q} A'_q(n) r(t_n) + B(n) h_q(t_n)
    h_q = G_q Y(t) + S_q e^{-(T_0 + tau + d + t) / lag} + air_q a(t) + (r_{m+} - r_{m-}) / (2 step)

A' is how a column grows with the rises (what heat lengthens is more when it is warmer), g_q whether it goes with the
coefficient of expansion, Y how what the law misses has built up through the day, a what air adds that is one kelvin
warmer, and r_{m+-} the rises of models whose feed, rises or time constants are a step off. Where a file gives an
interval of the coefficient of expansion, that is of the absolute one: cte_low / cte - 1 to cte_high / cte - 1.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.error_model.direction_memory import direction_states, reversal_widths
from compgen.error_model.parameter_slopes import build_slopes
from compgen.job.job import Job
from compgen.job.uncertainty import quantities_of
from compgen.pipelines.study.geometry import Geometry, model_of
from compgen.pipelines.study.live_day import BuildUp, NodeLaw, Stage, after_stages
from compgen.pipelines.study.live_model import Live, Setting, State, air_since, expansion_factor, state_of
from compgen.pipelines.study.live_places import own_heat, single
from compgen.pipelines.study.sample_band import part_weight, some_samples
from compgen.pipelines.uncertainty.band import MISSING, by_source, least_missing
from compgen.thermal.modes import advance
from compgen.thermal.uncertainty import STEP, steady_miss
from compgen.verification.band import ONE_SIDED, radius_of, squares

LEAST = 1e-9 / 15.0  # [m/K] below it a column does not grow with the rises


@dataclass(frozen=True, eq=False, slots=True)
class ModelStep:
    """A pair of models of the nodes a step to either side."""

    laws: tuple[NodeLaw, NodeLaw]  # +, -
    cycle: tuple[Array, Array]  # (R, S) what the cycle adds until each run
    step: float


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LiveQuantity:
    """One number that the files do not know."""

    source: str
    column: Array  # (N, 3) A_q
    by_rise: Array | None  # (N, 3, K) A'_q
    expands: bool  # g_q
    mean: float
    deviation: float
    absolute: tuple[float, float] | None  # limits of the coefficient itself, in the slider's unit
    missed: Array  # (K,) G_q
    start: Array  # (K,) S_q
    air: float
    model: int  # number of its pair of models; -1: none


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
    build_up: BuildUp
    build_up_cycle: Array  # (R, K)
    undirected: tuple[tuple[str, float], ...]  # source and what it is everywhere [m]
    missing: float  # kappa
    scale: float  # lambda
    feed: float  # [m/s] of the program


@dataclass(frozen=True, eq=False, slots=True)
class ShownBand:
    """What the page shows of it."""

    largest: float  # [m] radius of 95 % on the part
    budget: tuple[tuple[str, float], ...]  # source and its own largest, the largest first


def band_places(job: Job, live: Live, geometry: Geometry, dearer: Job | None) -> LiveBand:
    """The band's samples of a job's planned text.

    Args:
        job: As planned.
        live: Its day and heat.
        geometry: Of the planned text.
        dearer: The job with twice the coefficient of expansion; None: no slider moves that.
    """
    some = some_samples(geometry)
    thin = geometry.at(some)
    position = model_of(job).nominal_pose(geometry.theta).position
    motion = direction_states(reversal_widths(job.sources), geometry.theta, position).at(some)
    uncertainty = quantities_of(job, middle=(position.min(axis=0) + position.max(axis=0)) / 2)
    named, K = by_source(uncertainty), len(job.heat.names)
    changes = np.array([q.cause.parameters for q in named]).reshape(len(named), len(uncertainty.parameters.entries))
    which = tuple(np.flatnonzero(changes.any(axis=0)).tolist()) or (0,)
    slopes = build_slopes(job.robot, uncertainty.parameters, which, K, job.tool.pose)

    def columns(rise: Array) -> Array:
        return np.asarray(slopes(thin.theta, np.tile(rise, (len(some), 1)), motion)[0] @ changes[:, which].T)

    cold = columns(np.zeros(K))
    by_rise = np.stack([columns(unit) - cold for unit in np.eye(K)], axis=2)  # (N, 3, K, Q)
    both = slopes(thin.theta, np.zeros((len(some), K)), motion)[1]
    growth = np.zeros_like(both)
    if dearer is not None:
        of_dearer = quantities_of(dearer).parameters
        growth = build_slopes(job.robot, of_dearer, which, K, job.tool.pose)(
            thin.theta, np.zeros((len(some), K)), motion
        )[1] - both  # fmt: skip
    models: list[ModelStep] = []
    quantities = []
    for k, q in enumerate(named):
        heat, of_q = q.cause.heat, by_rise[..., k]
        number = -1
        if heat.changes_model and live.heat.law is not None:
            number = len(models)
            models.append(_model_step(job, live, heat.feed, heat.scale, heat.lag))
        is_expansion = q.name == "cte" or q.name.startswith("profile of ")
        absolute = None
        if q.name == "cte" and q.limits is not None and dearer is not None:
            absolute = (live.cte * (1 + q.limits[0]), live.cte * (1 + q.limits[1]))
        quantities.append(
            LiveQuantity(
                source=q.source or "",
                column=single(cold[:, :, k]),
                by_rise=single(of_q) if np.abs(of_q).max(initial=0.0) > LEAST else None,
                expands=is_expansion,
                mean=q.mean,
                deviation=q.deviation,
                absolute=absolute,
                missed=steady_miss(job.cell.warmth, heat.rise),
                start=heat.start,
                air=heat.air,
                model=number,
            )
        )
    build_up = BuildUp(1 / job.cell.warmth.lag, job.cell.warmth.idle)
    fit = job.cell.fit
    undirected = [("fit noise", fit.noise)]
    if fit.repeatability is not None:
        undirected.append(("repeatability", fit.repeatability))
    return LiveBand(
        time=thin.now,
        on_part=part_weight(geometry, thin),
        slope=single(both - growth),
        growth=single(growth),
        program=single(own_heat(job, geometry)[some]),
        quantities=tuple(quantities),
        models=tuple(models),
        build_up=build_up,
        build_up_cycle=_through_cycle(live, build_up),
        undirected=tuple(undirected),
        missing=least_missing(job.cell),
        scale=fit.scale,
        feed=job.feed,
    )


def _model_step(job: Job, live: Live, feed: float, scale: Array, lag: Array) -> ModelStep:
    size = max(abs(feed), np.abs(scale).max(), np.abs(lag).max())
    step, law, heat = STEP / size, live.heat.law, job.cell.heat
    if law is None:
        raise ValueError("only nodes have a law")
    reference = getattr(heat, "reference_time", 0.0)
    plus, minus = (law.changed(s * feed, s * scale, s * lag, reference) for s in (step, -step))
    return ModelStep((plus, minus), (_through_cycle(live, plus), _through_cycle(live, minus)), step)


def _through_cycle(live: Live, law: NodeLaw | BuildUp) -> Array:
    """What the cycle until each run does to modes that begin it at zero, (R, S)."""
    none = np.zeros(len(law.rate))
    return np.array([after_stages(law, law.rate, stages, none) for stages in live.heat.cycle_stages])


def band_at(live: Live, band: LiveBand, setting: Setting) -> ShownBand:
    """The band with the sliders at a setting."""
    state, factor = state_of(live, setting), expansion_factor(live, setting)
    model = live.heat.model
    air = model.ambient * air_since(model, state.air, state.elapsed + band.time)
    r = (advance(model.rate, state.z, 0.0, band.time) + air) @ model.outputs.T + band.program
    B = band.slope + factor * band.growth
    heats = _heats(live, band, state)
    columns = np.zeros((len(band.time), 3, len(band.quantities)))
    means, deviations = (np.zeros(len(band.quantities)) for _ in range(2))
    for k, (q, h) in enumerate(zip(band.quantities, heats, strict=True)):
        columns[:, :, k] = q.column
        if q.by_rise is not None:
            columns[:, :, k] += (factor if q.expands else 1.0) * np.einsum("nik,nk->ni", q.by_rise, r)
        if h is not None:
            columns[:, :, k] += np.einsum("nik,nk->ni", B, h)
        means[k], deviations[k] = q.mean, q.deviation
        if q.absolute is not None:
            low, high = (limit / (live.cte * factor) - 1 for limit in q.absolute)
            means[k], deviations[k] = (low + high) / 2, (high - low) / np.sqrt(12)
    warm = np.linalg.norm(np.einsum("nik,nk->ni", B, r), axis=1)
    moments = _moments(band, columns * deviations, columns @ means, warm)
    on_part = band.on_part > 0 if band.on_part.any() else np.ones(len(band.time), dtype=bool)
    shares = [(name, float(radius_of(S * band.scale**2)[on_part].max())) for name, S in moments.items() if S.any()]
    whole = sum(moments.values(), np.zeros((len(band.time), 6))) * band.scale**2
    return ShownBand(float(radius_of(whole)[on_part].max()), tuple(sorted(shares, key=lambda s: (-s[1], s[0]))))


def _heats(live: Live, band: LiveBand, state: State) -> list[Array | None]:
    """h of each quantity, (N, K); None: nothing."""
    model, t = live.heat.model, band.time[:, None]
    rate = band.build_up.rate
    y = _at_start(band.build_up, live, state, np.zeros(len(rate)), band.build_up_cycle)
    built_up = advance(rate, y, 1.0, band.time)
    since = state.elapsed + t
    fading = np.exp(-since * rate) if model.start is not None else np.zeros_like(built_up)
    share = np.ones_like(t * model.rate) if model.start is None else -np.expm1(-since * model.rate)
    of_air = (model.ambient * share) @ model.outputs.T
    of_models = [_by_step(live, band, state, pair) for pair in band.models]
    heats: list[Array | None] = []
    for q in band.quantities:
        if not (q.missed.any() or q.start.any() or q.air or q.model >= 0):
            heats.append(None)
            continue
        h = q.missed * built_up + q.start * fading + q.air * of_air
        heats.append(h if q.model < 0 else h + of_models[q.model])
    return heats


def _at_start(law: NodeLaw | BuildUp, live: Live, state: State, begin: Array, cycle: Array) -> Array:
    """Modes of a law as the program starts, in still air: the day, the cycle until its run, and standing."""
    z = after_stages(law, law.rate, state.stages, begin)
    z = advance(law.rate, z, 0.0, live.heat.run[state.run]) + cycle[state.run]
    return after_stages(law, law.rate, [Stage(state="idle", duration=state.delay)], z)


def _by_step(live: Live, band: LiveBand, state: State, pair: ModelStep) -> Array:
    """What a change of the model adds, by the difference of two, (N, K) [K]."""
    begin = np.zeros(len(live.heat.model.rate)) if live.heat.model.start is None else live.heat.model.start
    rises = []
    for law, cycle in zip(pair.laws, pair.cycle, strict=True):
        z = _at_start(law, live, state, begin, cycle) + _air_by(law, live, state, state.elapsed)
        goal = law.moving(band.feed, 1.0)
        rises.append(advance(law.rate, z, goal, band.time))
    return np.asarray((rises[0] - rises[1]) / (2 * pair.step))


def _air_by(law: NodeLaw, live: Live, state: State, passed: float) -> Array:
    """What the air has done to the nodes of another law, (S,) [K]."""
    response = np.asarray(state.air.response(law.rate, 0.0, np.array([passed]))[0])
    if live.heat.model.start is not None:
        return response
    return response + advance(law.rate, state.air.settled(law.rate), 0.0, passed)


def _moments(band: LiveBand, columns: Array, offset: Array, warm: Array) -> dict[str, Array]:
    """Second moment of each source, (N, 6) [m^2]."""
    undirected = {MISSING: band.missing * warm, **{name: np.full(len(warm), size) for name, size in band.undirected}}
    moments: dict[str, Array] = {}
    for source in dict.fromkeys([*(q.source for q in band.quantities), *undirected]):
        own = np.array([q.source == source for q in band.quantities], dtype=bool)
        moments[source] = squares(columns[:, :, own])
        if source in undirected:
            moments[source][:, [0, 3, 5]] += undirected[source][:, None] ** 2
    return {**moments, ONE_SIDED: squares(offset[:, :, None])}
