r"""Places of a program on which a living page computes: what stays, what each kelvin adds, and when the tool is there.

The planned program is what "before" flies; "after" flies the one corrected program, made for the planned state, in
whatever state the sliders stand at (``at``). Rises are ``thermal``'s own; ``report/live/live.js`` has them in closed
form, with the same letters.

The error is linear in the rises r, which are what the start left and what the program itself adds:

    e(n) = e0(n) + (1 - x) d(j) + x d(j + 1)         at sample n, the share x of the way from place j to j + 1
    d(p) = B(p) r(p),    B = B_c + (cte / cte_0) B_g
    r(p) = O (e^{-rate t_p} z + a u(T + t_p)) + F(p)

e0 is the twin's flight of the text less d of the state it was flown in, O the model's outputs, z its modes as the
program starts, a u what the air does until then, F what the program's own motion adds. What heat does is smooth: places
lie evenly along the part, and at both ends of each stretch of it. Chord and rounding are not: samples are many, evenly,
each with the length that it stands for, and beside them those at which e0 lies farthest in some direction, without a
length, and those that are among the largest in some state: so the largest error is met.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, rms
from compgen.error_model.parameter_slopes import build_slopes, parameters_of
from compgen.job.job import Job
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.study.geometry import DIRECTIONS, Geometry, execute_with, model_of, turns_at
from compgen.pipelines.study.live_day import Cycle, Day, Setting, history_at
from compgen.thermal import Duty, ThermalModel, rise_history, still_air
from compgen.thermal.history import History
from compgen.verification.deviation import deviation_from_path, percentile99, sample_lengths

LEAST, MOST = 1000, 8000  # places along the part
OF_PIECE = 16  # of them on each stretch of it between two ways through the air
BETWEEN = 0.025  # [m] of two: a straight line between what heat does there leaves a turn of 0.65 m by 0.1 mm
SAMPLES = 30_000  # evenly along the part
GOLDEN = (5**0.5 - 1) / 2
SHORT, NEAR = 0.02, 0.97  # [m] stretches whose largest are kept, from this share of the largest of all on
AROUND = 10.0  # [K] about the planned air
NEARBY = 12  # drawn changes about the planned rises
STRETCHES = 400  # in which the farthest in each of some directions are kept


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Flown:
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
    slope: Array  # (P, 3, K) [m/K] B_c, what does not go with the coefficient of expansion
    growth: Array  # (P, 3, K) [m/K] B_g as planned
    program: Array  # (P, K) [K] F
    own: Array  # (M, 3) [m] e0
    place: IntArray  # (M,) j, of the place before each sample
    share: Array  # (M,) x, of the way to the next
    length: Array  # (M,) [m] of part that each stands for; 0 of those that only the largest error asks for


def places_of(job: Job, flown: Flown, dearer: Job | None) -> LivePlaces:
    """The places of a text that was executed.

    Args:
        job: As planned.
        flown: The text then.
        dearer: The job with twice the coefficient of expansion; None: no slider moves that.
    """
    geometry, on_part, arc = flown.geometry, flown.on_part, flown.arc
    rows = _places_along(arc, on_part)
    both = _slopes(job, geometry, rows)
    growth = np.zeros_like(both) if dearer is None else _slopes(dearer, geometry, rows) - both
    moved = np.einsum("pik,pk->pi", both, flown.rise[rows])
    every = np.flatnonzero(on_part)
    place = (np.searchsorted(rows, every, side="right") - 1).clip(0, max(len(rows) - 2, 0))
    ahead = np.minimum(place + 1, len(rows) - 1)
    span = arc[rows[ahead]] - arc[rows[place]]
    share = np.divide(arc[every] - arc[rows[place]], span, out=np.zeros(len(every)), where=span > 0)
    own = flown.error[every] - (moved[place] + share[:, None] * (moved[ahead] - moved[place]))
    largest = np.zeros(len(every), dtype=bool)
    for rise in _states(flown.rise[rows]):
        d = np.einsum("pik,pk->pi", both, rise)
        size = np.linalg.norm(own + d[place] + share[:, None] * (d[ahead] - d[place]), axis=1)
        largest[_largest(size, arc[every])] = True
    chosen, length = _chosen(own, sample_lengths(arc)[every], np.searchsorted(every, rows), largest)
    position = model_of(job).nominal_pose(geometry.theta[rows]).position
    off = np.concatenate([[0], np.cumsum(~on_part)])
    gap = np.append(np.diff(off[rows]) > 0, True)
    carried = (
        single(x)
        for x in (position, both - growth, growth, own_heat(job, geometry)[rows], own[chosen], share[chosen], length)
    )
    position, slope, growth, program, own, share, length = carried
    return LivePlaces(
        arc=arc[rows],
        position=position,
        time=geometry.now[rows],
        gap=gap,
        slope=slope,
        growth=growth,
        program=program,
        own=own,
        place=place[chosen],
        share=share,
        length=length,
    )


def single(values: Array) -> Array:
    """Numbers as a page carries them, of single precision: 1e-7 of each."""
    return np.asarray(values).astype("<f4").astype(float)


def fly_planned(job: Job, geometry: Geometry, rise: Array) -> Flown:
    """A text flown as planned, at rises (M, K) [K]."""
    execution = execute_with(job, geometry, rise)
    deviation = deviation_from_path(geometry.path, [execution], len(rise))
    return Flown(
        geometry=geometry,
        on_part=samples_on_part(geometry),
        arc=deviation.arc,
        rise=rise,
        position=execution.actual.position,
        error=deviation.error,
    )


def samples_on_part(geometry: Geometry) -> BoolArray:
    """Samples where the tool touches; all of a path that never does."""
    path = geometry.path
    touching = (path.contact[:-1] | path.contact[1:]) & path.exact.curve.working[path.piece]
    touched = touching[geometry.segment]
    return touched if touched.any() else np.ones_like(touched)


def _places_along(arc: Array, on_part: BoolArray) -> IntArray:
    """Samples that are places, (P,): evenly along the part, and both ends of each stretch of it."""
    rows = np.flatnonzero(on_part)
    leaves = np.flatnonzero(np.diff(rows) > 1)
    ends = np.concatenate([rows[:1], rows[leaves], rows[leaves + 1], rows[-1:]])
    passed = np.cumsum(sample_lengths(arc)[rows])
    count = int(np.clip(max(OF_PIECE * (len(leaves) + 1), passed[-1] / BETWEEN), LEAST, MOST))
    even = rows[np.searchsorted(passed, np.linspace(0, passed[-1], count)).clip(max=len(rows) - 1)]
    return np.unique(np.concatenate([ends, even]))


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


def _chosen(own: Array, weight: Array, places: IntArray, largest: BoolArray) -> tuple[IntArray, Array]:
    """Of samples on the part those that are kept, and the length that each stands for [m].

    Args:
        own: e0, (M, 3) [m].
        weight: Length of part at each [m].
        places: Which of them are places.
        largest: Where the error is among the largest in some state.
    """
    parts = np.array_split(np.arange(len(own)), min(SAMPLES, len(own)))
    length = np.zeros(len(own))
    for n, part in enumerate(parts):  # not always the first: waypoints may lie as evenly as the parts do
        length[part[int(n * GOLDEN % 1 * len(part))]] = weight[part].sum()
    kept = (length > 0) | largest
    kept[places] = True
    towards = own @ (DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1)[:, None]).T
    for part in np.array_split(np.arange(len(own)), min(STRETCHES, len(own))):
        kept[part[np.argmax(towards[part], axis=0)]] = True
    chosen = np.flatnonzero(kept)
    return chosen, length[chosen]


def _slopes(job: Job, geometry: Geometry, rows: IntArray) -> Array:
    """B of a job's sources, (P, 3, K) [m/K]."""
    slopes = build_slopes(job.robot, parameters_of(job.sources), (0,), len(job.heat.names), job.tool.pose)
    none = np.zeros((len(rows), len(job.heat.names)))
    return slopes(geometry.theta[rows], none, turns_at(job, geometry, rows))[1]


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


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """What the page shows of one text [m]."""

    largest: float
    p99: float
    rms: float


def at(live: Live, setting: Setting, places: LivePlaces) -> Shown:
    """The error of one text with the sliders at a setting."""
    rise = rises_left(live.day.cell.heat, history_at(live.day, setting), places.time) + places.program
    slope = places.slope + expansion_factor(live, setting) * places.growth
    moved = np.einsum("pik,pk->pi", slope, rise)
    j, x = places.place, places.share[:, None]
    size = np.linalg.norm(places.own + (1 - x) * moved[j] + x * moved[np.minimum(j + 1, len(moved) - 1)], axis=1)
    even = places.length > 0
    weights = places.length[even]
    return Shown(float(size.max()), percentile99(size[even], weights), rms(size[even], weights))


def rises_left(heat: ThermalModel, history: History, time: Array) -> Array:
    """What a day leaves at times after it if the arm gave off nothing more, (P,) [s] to (P, K) [K]."""
    duties = [*history.before, Duty("off", 0.0, 0.0)]
    return rise_history(heat, duties, history.clock + time, air=history.air)


def expansion_factor(live: Live, setting: Setting) -> float:
    """cte / cte_0."""
    return next((v / live.cte for s, v in zip(live.day.sliders, setting, strict=True) if s.kind == "cte"), 1.0)
