r"""Places of a program on which a living page computes: what stays, what each kelvin adds, and when the tool is there.

The planned program is what "before" flies; "after" flies the one corrected program, made for the planned state, in
whatever state the sliders stand at (``at``). Rises are ``thermal``'s own; ``report/live/live.js`` has them in closed
form, with the same letters.

The error is linear in the rises r, which are what the start left and what the program itself adds:

    e(n) = e0(n) + d(n),    d(n) = sum_m u_m(n) B_m r(n),    B_m = B_c,m + (cte / cte_0) B_g,m
    r(n) = (1 - x) r(j) + x r(j + 1)                 at sample n, the share x of the time from place j to j + 1
    r(p) = O (e^{-rate t_p} z + a u(T + t_p)) + F(p)

e0 is the twin's flight of the text less d of the state it was flown in, O the model's outputs, z its modes as the
program starts, a u what the air does until then, F what the program's own motion adds. Rises are smooth in time: few
places are enough. The error model's slopes are not smooth along every path, but all of a path are sums of some shapes
u_m, seven where the tool keeps its axis: their singular values. Chord and rounding are not smooth at all: samples are
many, closer where the error is among the largest of some state, each with the length that it stands for; beside them
those at which e0 lies farthest in some direction, without a length, and those that are the largest in some state.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, rms
from compgen.error_model.parameter_slopes import build_slopes, parameters_of
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.study.geometry import DIRECTIONS, Geometry, execute_with
from compgen.pipelines.study.live_day import Cycle, Day, SliderValues, history_at
from compgen.thermal import Duty, ThermalModel, rise_history, still_air
from compgen.thermal.schedule import History
from compgen.verification.deviation import Sizes, deviation_from_path, percentile99, sample_lengths
from compgen.verification.twin import owning_segments

PLACES = 600  # along the part
SAMPLES = 5000  # along the part
OFTEN = 10.0  # times as close where the error is among the largest of every state
TAIL = 0.97  # share of the samples that are not
LEAST_SHAPE = 1e-11  # [m/K] below it a shape does not count
STEPS = 32767  # in which a shape is told, to either side
GOLDEN = (5**0.5 - 1) / 2
SHORT, NEAR = 0.05, 0.98  # [m] stretches whose largest are kept, from this share of the largest of all on
AROUND = 10.0  # [K] about the planned air
NEARBY = 12  # drawn changes about the planned rises
STRETCHES = 50  # in which the farthest in each of some directions are kept


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class FlownText:
    """A text as the twin flies it in the planned state, at M samples."""

    geometry: Geometry
    on_part: BoolArray  # (M,)
    arc: Array  # (M,) [m]
    rise: Array  # (M, K) [K]
    position: Array  # (M, 3) [m] of the tool
    error: Array  # (M, 3) [m]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LivePlaces:
    """P places of one text and M samples between them, in the order of the path."""

    arc: Array  # (P,) [m]
    position: Array  # (P, 3) [m] World
    time: Array  # (P,) [s] since the program's start
    gap: BoolArray  # (P,) whether the tool is off the part between a place and the next
    program: Array  # (P, K) [K] F
    slope: Array  # (R, 3, K) [m/K] B_c of each shape, what does not go with the coefficient of expansion
    growth: Array  # (R, 3, K) [m/K] B_g as planned
    shape: IntArray  # (M, R) u
    own: Array  # (M, 3) [m] e0
    at: Array  # (M,) j + x
    length: Array  # (M,) [m] of part that each stands for; 0 of those that only the largest error asks for


def places_of(job: Job, flown: FlownText, dearer: Job | None) -> LivePlaces:
    """The places of a text that was executed.

    Args:
        job: As planned.
        flown: The text then.
        dearer: The job with twice the coefficient of expansion; None: no slider moves that.
    """
    geometry, arc = flown.geometry, flown.arc
    rows, every = _places_along(arc, flown.on_part), np.flatnonzero(flown.on_part)
    both = _slopes(job, geometry, every)
    own = flown.error[every] - np.einsum("nik,nk->ni", both, flown.rise[every])
    chosen, length = _chosen(own, both, flown.rise[every], arc[every], sample_lengths(arc)[every])
    some = every[chosen]
    growth = np.zeros_like(both[chosen]) if dearer is None else _slopes(dearer, geometry, some) - both[chosen]
    shape, slope, growth = _shapes(both[chosen] - growth, growth)
    at = single(np.interp(geometry.now[some], geometry.now[rows], np.arange(len(rows))))
    displaced = _displaced(shape, at, slope + growth, flown.rise[rows])
    off = np.concatenate([[0], np.cumsum(~flown.on_part)])
    return LivePlaces(
        arc=arc[rows],
        position=single(job.cell.error_model(job.tool.pose).nominal_pose(geometry.theta[rows]).position),
        time=geometry.now[rows],
        gap=np.append(np.diff(off[rows]) > 0, True),
        program=single(own_heat(job, geometry)[rows]),
        slope=slope,
        growth=growth,
        shape=shape,
        own=single(flown.error[some] - displaced),
        at=at,
        length=single(length),
    )


def _shapes(slope: Array, growth: Array) -> tuple[IntArray, Array, Array]:
    """Slopes at samples, (M, 3, K) [m/K] each, as sums of shapes: u (M, R), and what each is, (R, 3, K) [m/K] twice."""
    every = np.concatenate([slope, growth], axis=1)
    u, size, parts = np.linalg.svd(every.reshape(len(every), -1), full_matrices=False)
    largest = np.abs(u * size).max(axis=0)
    counts = largest > LEAST_SHAPE
    step = largest[counts] / STEPS
    each = (step[:, None] * parts[counts]).reshape(-1, *every.shape[1:])
    return np.rint((u * size)[:, counts] / step).astype(int), each[:, :3], each[:, 3:]


def _displaced(shape: IntArray, at: Array, slope: Array, rise: Array) -> Array:
    """d at the samples, (M, 3) [m], of slopes (R, 3, K) [m/K] and rises at the places (P, K) [K]."""
    before = np.minimum(at.astype(int), max(len(rise) - 2, 0))
    share = (at - before)[:, None]
    then = (1 - share) * rise[before] + share * rise[np.minimum(before + 1, len(rise) - 1)]
    return np.asarray(np.einsum("nm,mik,nk->ni", shape, slope, then, optimize=True))


def single(values: Array) -> Array:
    """Numbers as a page carries them, of single precision: 1e-7 of each."""
    return np.asarray(values).astype("<f4").astype(float)


def fly_planned(job: Job, geometry: Geometry, rise: Array) -> FlownText:
    """A text flown as planned, at rises (M, K) [K]."""
    execution = execute_with(job, geometry, rise)
    deviation = deviation_from_path(geometry.path, [execution], len(rise))
    on_part = geometry.path.segments_on_part()
    return FlownText(
        geometry=geometry,
        on_part=on_part[owning_segments(on_part, geometry.segment, np.flatnonzero(geometry.fraction == 0))],
        arc=deviation.arc,
        rise=rise,
        position=execution.actual.position,
        error=deviation.error,
    )


def _places_along(arc: Array, on_part: BoolArray) -> IntArray:
    """Samples that are places, (P,): evenly along the part, and both ends of each stretch of it."""
    rows = np.flatnonzero(on_part)
    leaves = np.flatnonzero(np.diff(rows) > 1)
    leaves = leaves[:: len(leaves) * 4 // PLACES + 1]  # of many stretches some
    ends = np.concatenate([rows[:1], rows[leaves], rows[leaves + 1], rows[-1:]])
    passed = np.cumsum(sample_lengths(arc)[rows])
    even = np.searchsorted(passed, np.linspace(0, passed[-1], PLACES - len(ends))).clip(max=len(rows) - 1)
    return np.unique(np.concatenate([ends, rows[even]]))


def _states(rise: Array) -> list[Array]:
    """Rises about the planned ones, (P, K) [K] each, in which the largest errors are looked for.

    The day cooler and in other air, and small changes of each node by itself, drawn with a seed: a corrected text errs
    where they happen to add up.
    """
    days = [share * rise + air for share in (0.0, 0.4, 1.0) for air in (-AROUND, -AROUND / 4, 0.0, AROUND / 4, AROUND)]
    changes = np.random.default_rng(0).standard_normal((NEARBY, rise.shape[1]))
    return [*days, *(rise + size * change for change in changes for size in (1.0, AROUND))]


def _largest(size: Array, arc: Array) -> IntArray:
    """The largest of each short stretch, where it is among the largest of all."""
    stretch = np.flatnonzero(np.diff(np.floor(arc / SHORT), prepend=-1.0))
    top = np.maximum.reduceat(size, stretch)
    rows = [
        a + int(np.argmax(size[a:b])) for a, b in zip(stretch.tolist(), [*stretch[1:].tolist(), len(size)], strict=True)
    ]
    return np.asarray(np.array(rows)[top >= NEAR * size.max()])


def _chosen(own: Array, slope: Array, rise: Array, arc: Array, weight: Array) -> tuple[IntArray, Array]:
    """Of samples on the part those that are kept, and the length that each stands for [m].

    Args:
        own: e0, (M, 3) [m].
        slope: B, (M, 3, K) [m/K].
        rise: As planned, (M, K) [K].
        arc: (M,) [m].
        weight: Length of part at each [m].
    """
    states, kept, often = _states(rise), np.zeros(len(own), dtype=bool), np.zeros(len(own))
    for state in states:
        size = np.linalg.norm(own + np.einsum("nik,nk->ni", slope, state), axis=1)
        kept[_largest(size, arc)] = True
        often += size >= np.quantile(size, TAIL)
    dense = np.cumsum(weight * (1 + OFTEN / len(states) * often))
    part = (dense * min(SAMPLES, len(own)) / dense[-1]).astype(int)
    first = np.flatnonzero(np.diff(part, prepend=-1))
    count = np.diff(first, append=len(own))
    # not always the first: waypoints may lie as evenly as the parts do
    evenly = first + (np.arange(len(first)) * GOLDEN % 1 * count).astype(int)
    kept[evenly] = True
    length = np.zeros(len(own))
    length[evenly] = np.add.reduceat(weight, first)
    towards = own @ (DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1)[:, None]).T
    for stretch in np.array_split(np.arange(len(own)), min(STRETCHES, len(own))):
        kept[stretch[np.argmax(towards[stretch], axis=0)]] = True
    chosen = np.flatnonzero(kept)
    return chosen, length[chosen]


def _slopes(job: Job, geometry: Geometry, rows: IntArray) -> Array:
    """B of a job's sources, (P, 3, K) [m/K]."""
    slopes = build_slopes(job.robot, parameters_of(job.sources), (0,), len(job.heat.names), job.tool.pose)
    none = np.zeros((len(rows), len(job.heat.names)))
    return slopes(geometry.theta[rows], none, geometry.turns.at(rows))[1]


def own_heat(job: Job, geometry: Geometry) -> Array:
    """What the program's own motion adds to the rises at the samples, (M, K) [K]: it starts cold, in still air."""
    heat = job.cell.heat
    cold = replace(twin_of(job), heat=heat.starting(None))
    return geometry.rises_of(geometry.prepared.reheated(cold, (), still_air()))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Live:
    """A job's day, and the places of its two texts."""

    day: Day
    cycle: Cycle
    before: LivePlaces  # of the planned text
    after: LivePlaces  # of the corrected one
    cte: float  # as planned; 1 where no slider moves it


def at(live: Live, setting: SliderValues, places: LivePlaces) -> Sizes:
    """The error of one text with the sliders at a setting."""
    rise = rises_left(live.day.cell.heat, history_at(live.day, setting), places.time) + places.program
    slope = places.slope + expansion_factor(live, setting) * places.growth
    size = np.linalg.norm(places.own + _displaced(places.shape, places.at, slope, rise), axis=1)
    even = places.length > 0
    weights = places.length[even]
    return Sizes(float(size.max()), percentile99(size[even], weights), rms(size[even], weights))


def rises_left(heat: ThermalModel, history: History, time: Array) -> Array:
    """What a day leaves at times after it if the arm gave off nothing more, (P,) [s] to (P, K) [K]."""
    duties = [*history.before, Duty("off", 0.0, 0.0)]
    return rise_history(heat, duties, history.clock + time, air=history.air)


def expansion_factor(live: Live, setting: SliderValues) -> float:
    """cte / cte_0."""
    return next((v / live.cte for s, v in zip(live.day.sliders, setting, strict=True) if s.kind == "cte"), 1.0)
