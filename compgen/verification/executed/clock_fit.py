r"""At which override a program ran, when it began, where it stood, and whether it took the planned time.

With c the course's clock at its written speeds, a run between two stops is, beyond its ramps,

    c(s(t)) = f (t - t_0),       f the override times what the log's clock is off by,

and from stop to stop t_0 changes by what the stop costs: its ramps, its wait, and what the robot stood there beside.
One log cannot part a clock that is off by a share from a program that is slower by it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, norm, owns
from compgen.verification.executed.clock_rates import (
    SAME_RATE,
    Stand,
    Stretch,
    Windows,
    standing_rows,
    whole_rests,
    window_rates,
)
from compgen.verification.executed.course import NODE, STRAIGHT, PlannedRuns, ProgramCourse, planned_runs
from compgen.verification.executed.overrides import timed_log

RAMP_TIME = 0.7  # [s] at both ends of a run that are left out, if its ramps take no more
SETTLING = 0.3  # [s] beside a ramp, until a smoothed motion is steady
FEW = 0.3  # of the rows
RAMPS = 0.25  # of a run's time at its written speeds, that ramps may add where its rate is sure
BEYOND = 0.25  # [s] that a stop costs more than planned, from where the robot is taken to have stood
NEAR_STOP = 1e-3  # [m] from a stop, where the robot stands at it
AT_REST = 2e-5  # [m] from the first stop, while the robot still stands there
CORNER = 0.35  # [s] on each side of a corner, in which it is cut and the way looks slow


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(late=("M",), clock=("N",))
class ClockFit:
    """The log's clock against the course's."""

    stretches: tuple[Stretch, ...]  # none where the log has no steady motion
    stands: tuple[Stand, ...]
    start: float  # [s] log's clock when the program left its first position; NaN where the log does not tell
    late: Array  # (M,) [s] behind the fit of its run, NaN off the cruise
    took: float  # [s] from the first steady row to the last, less what stands and ways not judged took beyond the plan
    expected: float  # [s] for the same by the plan, at overrides in whole percent
    rounded: bool  # lines take whole interpolation periods: that clock fits better
    clock: Array  # (N,) [s] of the course's nodes, at full override, by which it is fitted

    @property
    def main(self) -> Stretch | None:
        """The longest stretch."""
        return max(self.stretches, key=lambda s: s.end - s.begin, default=None)


def fit_clock(course: ProgramCourse, time: Array, arc: Array, noise: float) -> ClockFit:
    """Fit the clock of a log's rows that are on the course.

    Args:
        course: Of the program.
        time: Log's clock, (M,) [s].
        arc: Where the rows are, (M,) [m].
        noise: Of the positions [m].
    """
    stands = standing_rows(course, time, arc, noise)
    stops = course.arc[course.rests]
    nearest = stops[nearest_rows(stops, np.array([arc[a] for a, _ in stands]))]
    holds = [stand for stand, stop in zip(stands, nearest, strict=True) if abs(arc[stand[0]] - stop) > NEAR_STOP]
    held = _apart(np.array([arc[a] for a, _ in holds]), 1e-5 + 20 * noise)
    edges = np.unique(np.concatenate([stops, held]))
    run = np.searchsorted(edges, np.maximum.accumulate(arc), side="left")
    runs = planned_runs(course, edges)
    shown = course.at(course.cruise, arc)
    blur = noise * float(np.ptp(shown)) / max(float(np.ptp(arc)), NODE)
    inside = _cruising(time, run, stands, runs, course.judged[course.way(arc)], shown, blur)
    way, chord = chords(course, arc)
    straight = inside & (chord >= STRAIGHT * way)
    inside = straight if straight.sum() > FEW * inside.sum() else inside
    which, rows, waits = run, inside, np.flatnonzero((course.kept < 1) & ~course.stop)  # CNT n: nobody knows how long
    if len(waits):
        line, clear = _between_waits(course, arc, straight, edges, waits)
        if len(window_rates(time, course.at(course.cruise, arc), line, clear).rate):
            which, rows, waits = line, clear, waits[:0]

    def rates(clock: Array) -> Windows:
        return window_rates(time, course.at(clock, arc), which, rows)

    def place(moment: Array) -> Array:
        return np.interp(moment, time, arc)

    log = timed_log(course, rates, place)
    clock, stretches, rounded = log.clock, log.stretches, log.clock is not course.cruise
    if not stretches:
        return _unknown(time, clock, rounded=rounded)
    if len(waits) and len(stretches) == 1 and stretches[0].rate < 1:  # slower by waits, by an override, or by both
        clock = course.counted_clock() if rounded else course.cruise
        stretches = (replace(stretches[0], rate=1.0, alike=(round(100 * stretches[0].rate), 100)),)
    steady = _Steady(
        course=course, clock=clock, time=time, arc=arc, shown=course.at(clock, arc), run=run, inside=inside
    )
    still = whole_rests(arc, stands, 8 * noise + 1e-6)
    return _assessed(steady, _pooled(steady, stretches), held, still, rounded=rounded)


def _unknown(time: Array, clock: Array, *, rounded: bool) -> ClockFit:
    """Of a log without steady motion."""
    return ClockFit(
        stretches=(),
        stands=(),
        start=np.nan,
        late=np.full(len(time), np.nan),
        took=0.0,
        expected=0.0,
        rounded=rounded,
        clock=clock,
    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Steady:
    """M rows of a log with those at steady speed."""

    course: ProgramCourse
    clock: Array  # (N,) [s] of the course's nodes
    time: Array  # (M,) [s] log's clock
    arc: Array  # (M,) [m]
    shown: Array  # (M,) [s] what the course's clock shows there
    run: IntArray  # (M,) from 1, 0 before the first
    inside: BoolArray  # (M,) at steady speed


def _between_waits(
    course: ProgramCourse, arc: Array, straight: BoolArray, edges: Array, waits: IntArray
) -> tuple[IntArray, BoolArray]:
    """Which way between stops and waits a row is on, (M,), and straight rows that are away from waits, (M,)."""
    line = np.searchsorted(np.union1d(edges, course.arc[waits]), np.maximum.accumulate(arc), side="left")
    at, wait = course.at(course.cruise, arc), course.cruise[waits]
    return line, straight & (np.abs(at - wait[nearest_rows(wait, at)]) > CORNER)


def chords(course: ProgramCourse, arc: Array) -> tuple[Array, Array]:
    """Way and chord about places (M,) [m], over so long on each side as corners are cut in, (M,) [m]."""
    clock = course.at(course.cruise, arc)
    low, high = (np.interp(clock + side, course.cruise, course.arc) for side in (-CORNER, CORNER))
    return high - low, norm(course.place(high) - course.place(low))


def _apart(values: Array, least: float) -> Array:
    """Rising values without those that follow another by less than ``least``."""
    kept: list[float] = []
    for value in np.sort(values).tolist():
        if not kept or value - kept[-1] > least:
            kept.append(value)
    return np.array(kept)


def nearest_rows(sorted_values: Array, values: Array) -> IntArray:
    """Rows of the nearest of rising values."""
    after = np.clip(np.searchsorted(sorted_values, values), 1, max(len(sorted_values) - 1, 1))
    after = np.minimum(after, len(sorted_values) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(values - sorted_values[before]) <= np.abs(values - sorted_values[after])
    return np.asarray(np.where(nearer, before, after))


def _cruising(
    time: Array,
    run: IntArray,
    stands: list[tuple[int, int]],
    runs: PlannedRuns,
    judged: BoolArray,
    shown: Array,
    blur: float,
) -> BoolArray:
    """Rows at steady speed, (M,): on judged ways, away from both ends of their run, and from stands.

    Rows of runs that ramps slow down a lot count only where there are few others, and of a short straight line those
    of its middle half, or quarter, only where half of that is driven no faster: else it is ramps.

    Args:
        time: Log's clock, (M,) [s].
        run: From 1, 0 before the first, (M,).
        stands: First and last row of each.
        runs: By the plan.
        judged: Rows on ways that are judged, (M,).
        shown: What the clock of written speeds shows, (M,) [s].
        blur: Noise of that [s].
    """
    begins = np.flatnonzero(np.append(True, np.diff(run) != 0))
    ends = np.append(begins[1:], len(run)) - 1
    first, last = time[begins].copy(), time[ends].copy()
    for a, b in stands:  # a run begins when the robot leaves, not when it has arrived
        before, after = np.searchsorted(begins, [a, b], side="right").tolist()
        for r in range(before - 1, after):
            if time[a] <= first[r] + RAMP_TIME and time[b] < last[r]:
                first[r] = max(first[r], time[b])
            elif time[b] >= last[r] - RAMP_TIME and time[a] > first[r]:
                last[r] = min(last[r], time[a])
    of = np.clip(run[begins] - 1, 0, len(runs.alone) - 1)
    alone, planned = runs.alone[of], runs.planned[of]
    ramps = np.maximum(planned - alone, 0.0)
    slower, quarter = (last - first) / np.maximum(planned, NODE), (last - first) / 4
    margin = np.maximum(RAMP_TIME, ramps * np.clip(slower, 1.0, 100.0) + SETTLING)
    places = (first + last) / 2 + quarter * np.array([1.0, 0.5, 0.25, -1.0, -0.5, -0.25])[:, None]
    span = np.interp(places[:3], time, shown) - np.interp(places[3:], time, shown)  # half, quarter and eighth
    is_flat = 2 * span[1:] - span[:-1] <= SAME_RATE * span[:-1] + 10 * blur
    is_wide = ~runs.is_line[of] | (margin <= quarter) | is_flat[0]
    is_steady, margin = is_wide | is_flat[1], np.where(is_wide, np.minimum(margin, quarter), 1.5 * quarter)
    index = np.repeat(np.arange(len(begins)), ends - begins + 1)
    inside = (
        (time >= (first + margin)[index]) & (time <= (last - margin)[index]) & (run > 0) & judged & is_steady[index]
    )
    for a, b in stands:
        inside[a : b + 1] = False
    sure, some = (inside & (ramps <= share * alone)[index] for share in (RAMPS, 1.0))
    return np.asarray(sure if sure.sum() > FEW * inside.sum() else some)


def _assessed(
    steady: _Steady, stretches: tuple[Stretch, ...], held: Array, still: list[tuple[int, int]], *, rounded: bool
) -> ClockFit:
    """Offsets of the runs, what stops cost, and the time that all of it took.

    Args:
        steady: The rows.
        stretches: At one override each.
        held: Where the robot was held, (H,) [m].
        still: First and last row of each time that it stands.
        rounded: Whether the clock is that of whole periods.
    """
    course, time, arc, c = steady.course, steady.time, steady.arc, steady.shown
    rows = np.flatnonzero(steady.inside)
    turns = _refined(time[rows], c[rows], stretches)
    rates, nominal = (np.array([getattr(s, name) for s in stretches]) for name in ("rate", "override"))
    knots = np.concatenate([[time[0]], turns, [time[-1]]])
    fitted = np.interp(time[rows], knots, cumulated(rates * np.diff(knots)))
    begins = np.flatnonzero(np.append(True, np.diff(steady.run[rows]) != 0))
    ends = np.append(begins[1:], len(rows)) - 1
    which = np.repeat(np.arange(len(begins)), ends - begins + 1)
    offset = np.bincount(which, c[rows] - fitted) / np.bincount(which)
    stretch = np.searchsorted(turns, time[rows], side="right")
    late = np.full(len(time), np.nan)
    late[rows] = -(c[rows] - fitted - offset[which]) / rates[stretch]

    # between the last steady row of a run and the first of the next
    before = stretch[ends[:-1]]
    a, b = rows[ends[:-1]], rows[begins[1:]]
    between = _Between(steady, a, b, held, nominal[before])
    beyond = -np.diff(offset) / rates[before] - between.ramps - between.waits
    rests = np.array([begin for begin, _ in still], dtype=np.int64)
    seen = np.searchsorted(rests, b) > np.searchsorted(rests, a)  # ramps take longer than planned without a rest
    stood = (between.is_hold | (beyond > BEYOND) & seen | (between.waits > 0)) & between.is_judged
    stands = [stand for k in np.flatnonzero(stood).tolist() for stand in between.stands(k, float(beyond[k]), still)]
    edges = [stretches[0].begin, *turns.tolist(), stretches[-1].end]
    first, last = int(rows[0]), int(rows[-1])
    marks = np.interp(np.concatenate([[time[first]], turns, [time[last]]]), time, c)
    planned = np.interp(c, marks, cumulated(np.diff(marks) / nominal))
    return ClockFit(
        stretches=tuple(replace(s, begin=x, end=y) for s, (x, y) in zip(stretches, pairwise(edges), strict=True)),
        stands=tuple(_other_stands(course, time, arc, still, stands, between.span[between.is_judged])),
        start=_begun(steady, first, float(rates[0])),
        late=late,
        took=float(time[last] - time[first] - beyond[stood].sum() - between.longer(planned)),
        expected=float((np.diff(marks) / nominal).sum() + between.ramps.sum() + between.waits.sum()),
        rounded=rounded,
        clock=steady.clock,
    )


class _Between:
    """What lies between the last steady rows a of runs and the first steady rows b of the next, (R - 1,)."""

    def __init__(self, steady: _Steady, a: IntArray, b: IntArray, held: Array, override: Array) -> None:
        course, arc = steady.course, steady.arc
        self.steady, self.a, self.b, self.held = steady, a, b, held
        self.first, self.last = np.searchsorted(course.arc, arc[a]), np.searchsorted(course.arc, arc[b])
        cost, wait = (cumulated(each) for each in (stop_costs(course), course.wait))
        stretched = 1.0 if course.settles else override
        self.ramps = (cost[self.last] - cost[self.first]) / stretched  # [s] by the plan
        self.waits = wait[self.last] - wait[self.first]  # [s] by the program
        unsure = np.append(0, np.cumsum(~course.judged))  # how long such ways take is assumed
        self.is_judged = unsure[course.way(arc[b])] == unsure[course.way(arc[a])]
        self.span = np.column_stack([steady.time[a], steady.time[b]])  # (R - 1, 2) [s]
        self.is_hold = np.searchsorted(held, arc[b]) - np.searchsorted(held, arc[a]) > 0

    def longer(self, planned: Array) -> float:
        """By how much ways that are not judged took longer than planned [s], of the plan's time at all rows (M,)."""
        longer = np.diff(self.span)[:, 0] - (planned[self.b] - planned[self.a]) - self.ramps - self.waits
        return float(longer[~self.is_judged].sum())

    def stands(self, k: int, beyond: float, still: list[tuple[int, int]]) -> Iterator[Stand]:
        """Where the robot stood in one of them: at stops that wait or cost time, and where it was held."""
        course, time, arc, a, b = self.steady.course, self.steady.time, self.steady.arc, self.a[k], self.b[k]
        nodes = self.first[k] + np.flatnonzero(course.rests[self.first[k] : self.last[k]])
        held = _apart(self.held[slice(*np.searchsorted(self.held, arc[[a, b]]))], NEAR_STOP)
        places, wait = np.append(course.arc[nodes], held), np.append(course.wait[nodes], np.zeros(len(held)))
        rests = [(begin, end) for begin, end in still if a < begin and end < b]
        of = np.abs(arc[[begin for begin, _ in rests], None] - places).argmin(axis=1)
        stood = np.bincount(of, [time[end] - time[begin] for begin, end in rests], len(places))
        excess, is_held = stood - wait, np.arange(len(places)) >= len(nodes)
        named = (wait > 0) | (excess > BEYOND) | is_held
        named[stood.argmax()] |= not named.any()
        ramped = is_held if is_held.any() else named  # no ramps of a hold are planned
        excess[ramped] += (beyond - excess[named].sum()) / ramped.sum()
        for n in np.flatnonzero(named):
            yield Stand(
                time=next((float(time[begin]) for (begin, _), m in zip(rests, of, strict=True) if m == n), time[a]),
                arc=float(places[n]),
                stood=float(stood[n]),
                beyond=float(excess[n]),
                planned=float(wait[n]),
                at_stop=not bool(is_held[n]),
            )


def _begun(steady: _Steady, first: int, rate: float) -> float:
    """When the program left its first position [s]; NaN where it is not steady before the next stop."""
    course, arc, time = steady.course, steady.arc, steady.time
    resting = np.flatnonzero(arc[:first] <= course.arc[0] + AT_REST)
    if len(resting):
        return float(time[resting[-1]])
    if (course.stop & (course.arc <= arc[first] + NODE))[1:].any():
        return np.nan
    ramp = stop_costs(course)[0] / 2 / (1.0 if course.settles else rate)
    return float(time[first] - (steady.shown[first] - steady.clock[0]) / rate - ramp)


def _pooled(steady: _Steady, stretches: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
    """Stretches with their rates fitted to all of their rows together, each run with its own offset."""
    refined = []
    for stretch in stretches:
        rows = np.flatnonzero(steady.inside & (steady.time >= stretch.begin) & (steady.time <= stretch.end))
        _, of = np.unique(steady.run[rows], return_inverse=True)
        count = np.maximum(np.bincount(of), 1)
        t, c = (x[rows] - (np.bincount(of, x[rows]) / count)[of] for x in (steady.time, steady.shown))
        rate = float((t * c).sum() / max(float((t * t).sum()), 1e-12))
        near = abs(rate - stretch.rate) <= max(SAME_RATE * stretch.rate, 5 * stretch.sigma)
        refined.append(replace(stretch, rate=rate) if near else stretch)
    return tuple(refined)


def _other_stands(
    course: ProgramCourse, time: Array, arc: Array, still: list[tuple[int, int]], stands: list[Stand], spans: Array
) -> list[Stand]:
    """Where the robot stood between the first and the last row that is on its way, and no steady runs tell of it."""
    on_way = np.flatnonzero((arc > course.arc[0] + AT_REST) & (arc < course.arc[-1] - AT_REST))
    others = []
    stops = np.flatnonzero(course.rests)
    for a, b in still:
        if a == 0 or b == len(time) - 1:
            continue  # before and behind the program
        if not len(on_way) or time[b] <= time[on_way[0]] or time[a] >= time[on_way[-1]]:
            continue
        covered = ((spans[:, 0] <= time[a]) & (spans[:, 1] >= time[b])).any()
        stop = stops[nearest_rows(course.arc[stops], arc[[a]])[0]]
        wait = float(course.wait[stop])
        if not covered and (time[b] - time[a] - wait > BEYOND or wait):
            at_stop = abs(float(course.arc[stop] - arc[a])) <= NEAR_STOP
            begin, stood = float(time[a]), float(time[b] - time[a])
            others.append(
                Stand(time=begin, arc=float(arc[a]), stood=stood, beyond=stood - wait, planned=wait, at_stop=at_stop)
            )
    return sorted([*stands, *others], key=lambda stand: stand.time)


def _refined(time: Array, clock: Array, stretches: tuple[Stretch, ...]) -> Array:
    """Times at which the rate changes: where the lines before and after meet, if that is between their windows."""
    refined = []
    for one, other in pairwise(stretches):
        before, after = np.searchsorted(time, [one.end, other.begin])
        before, after = max(before - 1, 0), min(after, len(time) - 1)
        # c_b + f_b (t - t_b) = c_a + f_a (t - t_a)
        gap = clock[before] - one.rate * time[before] - clock[after] + other.rate * time[after]
        meet = float(gap / (other.rate - one.rate))
        inside = time[before] - 1 <= meet <= time[after] + 1
        refined.append(meet if inside else (one.end + other.begin) / 2)
    return np.array(refined)


def stop_costs(course: ProgramCourse) -> Array:
    """What each stop's ramps cost beyond the clock at written speed, (N,) [s]; half of a run's at each of its ends."""
    stops = np.flatnonzero(course.stop)
    clock = course.counted_clock() if course.counted else course.cruise
    cost = np.zeros(len(course.arc))
    if len(stops) > 1:
        half = np.maximum(np.diff((course.planned - clock - cumulated(course.wait)[:-1])[stops]), 0.0) / 2
        cost[stops[:-1]] += half
        cost[stops[1:]] += half
    return cost
