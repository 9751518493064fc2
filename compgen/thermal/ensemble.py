r"""The starts that one file serves (how late, at which override, in which run): mean rises, and which stand for all.

A robot that stands for d before a run begins with z(d) = g + (z - g) exp(-rate d); at the share s of the written speed
it is at waypoint n after t_n / s. Runs count alike, overrides count alike, delays count evenly from a to b. Rises are
linear in the state, so their mean is exact without a quadrature:

    mean_d exp(-rate d) = (exp(-rate a) - exp(-rate b)) / (rate (b - a))

Air that moves adds its response R to the time x since the run could begin; from dR/dx = rate (u - R),

    mean_d R(d + t) = (int_{a+t}^{b+t} u dx - (R(b + t) - R(a + t)) / rate) / (b - a)
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TypeVar

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.thermal.ambient import Ambient
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.integration import ROWS, initial_state, rises_during, state_after, states_at
from compgen.thermal.model import ThermalModel, advance
from compgen.thermal.schedule import History

SHORT = 1.0  # [s] an interval of delays below it counts as its middle
DELAYS, DELAYS_OF_MANY = 33, 9  # evenly, alone or with runs or overrides
MOST_OF_A_KIND = 9  # runs, and overrides
NODES = 8  # of the quadrature over the delays
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Start:
    """One start of a program."""

    run: int = 0  # of the history's runs, from 0
    delay: float = 0.0  # [s] servo on, standing, before it
    override: float = 1.0  # share of the written speed


@dataclass(frozen=True, slots=True)
class Ensemble:
    """All starts that one file serves: each combination of run, delay and override."""

    delay: tuple[float, float] = (0.0, 0.0)  # [s] every one from first to last, evenly
    overrides: tuple[float, ...] = (1.0,)  # each as often
    runs: tuple[int, int] = (0, 0)  # every one from first to last, from 0

    @property
    def first(self) -> Start:
        """The start without what is not averaged: first run, no delay, full speed."""
        return Start(self.runs[0])

    @property
    def run_numbers(self) -> IntArray:
        """(R,) from 0."""
        return np.arange(self.runs[0], self.runs[1] + 1)


def duties_until(duties: Iterable[Duty], duration: float) -> Iterator[Duty]:
    """Duties until a time after their beginning [s]."""
    for duty in duties:
        if duration <= 0:
            return
        yield replace(duty, duration=min(duty.duration, duration))
        duration -= duty.duration


def duties_before(history: History, start: Start) -> tuple[Duty, ...]:
    """What a cell does until a start of its program: what was before, the cycle so far, and standing."""
    duties = [*history.before, *duties_until(history.cycle, history.runs[start.run])]
    if start.delay > 0:
        duties.append(replace(history.standing, duration=start.delay))
    return tuple(duties)


def started(history: History, start: Start) -> History:
    """The same day with a start of its program as the first: what was before it, and the runs that are left."""
    begin = history.runs[start.run]
    left, cycle = begin, []
    for duty in history.cycle:
        if duty.duration > left:
            cycle.append(replace(duty, duration=duty.duration - max(left, 0.0)))
        left -= duty.duration
    runs = tuple(time - begin for time in history.runs[start.run :])
    before, given = duties_before(history, start), len(history.before)
    return replace(history, before=before, given=given, cycle=tuple(cycle), runs=runs)


def states_at_runs(heat: ThermalModel, history: History, runs: IntArray) -> Array:
    """States as some runs begin without a delay, (R,) rising numbers from 0 to (R, S)."""
    times = np.array(history.runs)[runs]
    states = np.empty((len(times), len(heat.rate)))
    z = state_after(heat, history.before, initial_state(heat, history.air))
    goals = {duty: heat.steady_state(duty) for duty in set(history.cycle)}
    begin, done = 0.0, 0
    for duty in history.cycle:
        goal, last = goals[duty], int(np.searchsorted(times, begin + duty.duration))
        states[done:last] = advance(heat.rate, z, goal, times[done:last] - begin)
        z = advance(heat.rate, z, goal, duty.duration)
        begin, done = begin + duty.duration, last
    states[done:] = z
    return np.asarray(states + heat.ambient * history.air.response(heat.rate, 0.0, history.clock + times))


def mean_rises(heat: ThermalModel, history: History, ensemble: Ensemble, motion: JointMotion) -> Array:
    """Rises at a program's waypoints, averaged over all starts of an ensemble, (N, K) [K].

    Args:
        heat: The model.
        history: Of the cell.
        ensemble: The starts.
        motion: The program at the written speed, N waypoints.
    """
    low, high = ensemble.delay
    if high - low < SHORT:
        low = high = (low + high) / 2
    runs = ensemble.run_numbers
    standing = heat.steady_state(history.standing)
    state = states_at_runs(heat, history, runs).mean(axis=0)
    state = standing + (state - standing) * _mean_decay(heat.rate, low, high)
    clocks = history.clock + np.array(history.runs)[runs]
    longest = float(motion.time[-1]) / min(ensemble.overrides)
    air = history.air.seen_from(clocks, high + longest)
    total = np.zeros((len(motion.time), len(heat.outputs)))
    for share in ensemble.overrides:
        driven = motion.at_override(share)
        total += rises_during(heat, state, driven).rise
        for k in range(0, len(total) if not air.is_still else 0, ROWS):
            response = _mean_response(air, heat.rate, low, high, driven.time[k : k + ROWS])
            total[k : k + ROWS] += (heat.ambient * response) @ heat.outputs.T
    return np.asarray(total / len(ensemble.overrides))


def rises_of(heat: ThermalModel, history: History, start: Start, motion: JointMotion) -> Array:
    """Rises at a program's waypoints after one start, (N, K) [K]."""
    alone = Ensemble((start.delay, start.delay), (start.override,), (start.run, start.run))
    return mean_rises(heat, history, alone, motion)


def rises_at(
    heat: ThermalModel, history: History, starts: Sequence[Start], motion: JointMotion, which: IntArray
) -> Array:
    """Rises at some waypoints after each of many starts: (P,) rising numbers from 0 to (G, P, K) [K]."""
    rate, standing = heat.rate, heat.steady_state(history.standing)
    runs, row = np.unique([start.run for start in starts], return_inverse=True)
    states = states_at_runs(heat, history, runs)
    forced = {
        share: states_at(heat, np.zeros(len(rate)), motion.at_override(share), which)
        for share in {start.override for start in starts}
    }
    rises = np.empty((len(starts), len(which), len(heat.outputs)))
    for g, start in enumerate(starts):
        time = motion.time[which] / start.override
        begin = advance(rate, states[row[g]], standing, start.delay)
        state = advance(rate, begin, 0.0, time) + forced[start.override]
        clock = history.clock + history.runs[start.run]
        state += heat.ambient * history.air.response(rate, clock, clock + start.delay + time)
        rises[g] = state @ heat.outputs.T
    return rises


def _mean_decay(rate: Array, low: float, high: float) -> Array:
    """Mean of exp(-rate d) over delays d from low to high, (S,)."""
    x = rate * (high - low)
    return np.asarray(np.exp(-rate * low) * (-np.expm1(-x) / x if high > low else 1.0))


def _mean_response(air: Ambient, rate: Array, low: float, high: float, time: Array) -> Array:
    """Mean over delays d of what air does from 0 to d + time, (M,) [s] to (M, S) [K]."""
    late = air.response(rate, 0.0, high + time)
    if high == low:
        return late
    passed = (air.integral(high + time) - air.integral(low + time))[:, None]
    return np.asarray((passed - (late - air.response(rate, 0.0, low + time)) / rate) / (high - low))


def weighted_starts(ensemble: Ensemble) -> tuple[list[Start], Array]:
    """Starts evenly over an ensemble, both ends among them, and how much each counts in a mean, (G,); some nothing."""
    runs, of_run = _some(ensemble.run_numbers.tolist())
    overrides, of_override = _some(list(ensemble.overrides))
    low, high = ensemble.delay
    node, weight = np.polynomial.legendre.leggauss(NODES)
    delays, share = np.array([low]), np.ones(1)
    if high > low:
        even = np.linspace(low, high, DELAYS if len(runs) * len(overrides) == 1 else DELAYS_OF_MANY)
        delays = np.concatenate([even, low + (high - low) * (node + 1) / 2])
        share = np.concatenate([np.zeros(len(even)), weight / 2])
        order = np.argsort(delays, kind="stable")
        delays, share = delays[order], share[order]
    starts = [Start(*values) for values in product(runs, delays.tolist(), overrides)]
    weights = np.einsum("r,d,o->rdo", of_run, share, of_override).ravel()
    return starts, np.asarray(weights / weights.sum())


def starts_to_fly(ensemble: Ensemble, *foretold: Start) -> list[Start]:
    """Corners, middle and what is foretold to be the worst, each once."""
    runs, delays, overrides = ensemble.run_numbers.tolist(), ensemble.delay, ensemble.overrides
    corners = [Start(*values) for values in product(_ends(runs), _ends(list(delays)), _ends(list(overrides)))]
    middle = Start(runs[len(runs) // 2], sum(delays) / 2, overrides[len(overrides) // 2])
    return list(dict.fromkeys([*corners, middle, *foretold]))


def _ends(values: list[T]) -> list[T]:
    return list(dict.fromkeys([values[0], values[-1]]))


def _some(values: list[T]) -> tuple[list[T], Array]:
    """Values evenly over a list, both ends among them, and how many each of them stands for."""
    rows = np.linspace(0, len(values) - 1, min(len(values), MOST_OF_A_KIND)).round().astype(int)
    nearest = np.abs(np.arange(len(values))[:, None] - rows).argmin(axis=1)
    return [values[k] for k in rows.tolist()], np.bincount(nearest).astype(float)
