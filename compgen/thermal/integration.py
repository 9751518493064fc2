r"""Time integration of any thermal model: exact, by modes, at any number of output times.

Between changes of duty each mode is one exponential, z(t) = goal + (z_0 - goal) exp(-rate (t - t_0)), to which the air
adds its own response. No step size, no tolerance: 12 h of a hundred volumes at every second is a few array operations.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, cumulated
from compgen.thermal.ambient import Ambient, still_air
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.model import ThermalModel, advance

MAX_SPAN = 300.0  # time constants that one block of a sum may span
ROWS = 1024  # output times at a time
DECAYED = 45.0  # time constants after which nothing of a mode is left, exp(-45) = 3e-20


class ProgramRises(NamedTuple):
    """Rises while a program of N waypoints runs."""

    rise: Array  # (N, K) [K] at each waypoint
    end: Array  # (S,) state at the end


def initial_state(heat: ThermalModel, air: Ambient | None = None) -> Array:
    """State before any duty: what a log ends with, else cold and in balance with the air so far, (S,)."""
    if heat.start is not None:
        return heat.start
    return np.asarray(heat.ambient * (air or still_air()).settled(heat.rate))


def state_after(
    heat: ThermalModel,
    duties: Sequence[Duty],
    state: Array | None = None,
    air: Ambient | None = None,
    clock: float = 0.0,
) -> Array:
    """State after duties in turn.

    Args:
        heat: The model.
        duties: In order.
        state: Where they begin, (S,); default ``initial_state``.
        air: Over time; default still at the reference.
        clock: When the first duty begins [s].

    Returns:
        (S,).
    """
    z = initial_state(heat, air) if state is None else np.asarray(state)
    total = sum(d.duration for d in duties)
    goals = {duty: heat.steady_state(duty) for duty in set(duties)}
    for duty in duties:
        z = advance(heat.rate, z, goals[duty], duty.duration)
    return np.asarray(z + heat.ambient * (air or still_air()).response(heat.rate, clock, np.array([clock + total]))[0])


def rises_during(
    heat: ThermalModel, start: Array, motion: JointMotion, air: Ambient | None = None, clock: float = 0.0
) -> ProgramRises:
    r"""Rises while a program runs.

        z_n = exp(-rate t_n) (z_0 + sum_k goal_k (exp(rate t_{k+1}) - exp(rate t_k)))

    summed in blocks short enough not to overflow.

    Args:
        heat: The model.
        start: State when the program starts, (S,).
        motion: Times from 0, N waypoints.
        air: Over time.
        clock: When the program starts [s].

    Returns:
        Rise at each waypoint (N, K) [K], and the state at the end (S,).
    """
    goals, rate, time = heat.steady_states(motion), heat.rate, motion.time
    rises = np.empty((len(time), len(heat.outputs)))
    rises[0], z, first = heat.outputs @ start, np.asarray(start), 0
    while first < len(time) - 1:
        reach = np.searchsorted(time, time[first] + MAX_SPAN / rate.max(), side="right") - 1
        last = int(min(max(reach, first + 1), first + ROWS, len(time) - 1))
        growth = np.exp(np.minimum((time[first : last + 1] - time[first])[:, None] * rate, 2 * MAX_SPAN))
        path = (z + np.cumsum(goals[first:last] * np.diff(growth, axis=0), axis=0)) / growth[1:]
        rises[first + 1 : last + 1], z, first = path @ heat.outputs.T, path[-1], last
    if air is not None:
        _add_air(rises, heat, air, clock, time)
        z = z + heat.ambient * air.response(rate, clock, clock + time[-1:])[0]
    return ProgramRises(rises, np.asarray(z))


def states_at(
    heat: ThermalModel,
    start: Array,
    motion: JointMotion,
    which: IntArray,
    air: Ambient | None = None,
    clock: float = 0.0,
) -> Array:
    """States at some waypoints of a program that runs.

    Args:
        heat: The model.
        start: State when the program starts, (S,).
        motion: Times from 0, N waypoints.
        which: Their numbers from 0, rising, (P,).
        air: Over time.
        clock: When the program starts [s].

    Returns:
        (P, S).
    """
    time, rate, last = motion.time, heat.rate, int(which[-1])
    goals = heat.steady_states(motion) if last else np.zeros((0, len(rate)))
    states = {0: np.asarray(start)}
    edges = np.unique(np.append(which, np.arange(0, last + 1, ROWS)))
    for a, b in zip(edges.tolist(), edges[1:].tolist(), strict=False):  # weights from the end of a stretch backwards
        decay = np.exp((time[a : b + 1] - time[b])[:, None] * rate)
        states[b] = states[a] * decay[0] + np.einsum("nv,nv->v", goals[a:b], np.diff(decay, axis=0))
    chosen = np.array([states[n] for n in which.tolist()])
    if air is not None:
        chosen += heat.ambient * air.response(rate, clock, clock + time[which])
    return chosen


def rise_history(
    heat: ThermalModel,
    duties: Sequence[Duty],
    time: Array,
    air: Ambient | None = None,
) -> Array:
    """Rises at any times from the beginning of the first duty on; after the last one it goes on.

    Args:
        heat: The model.
        duties: In order.
        time: Rising, (M,) [s] from the beginning of the first duty.
        air: Over time, from the beginning of the first duty.

    Returns:
        (M, K) [K].
    """
    z = initial_state(heat, air)
    duties = duties or [Duty("off", 0.0, 0.0)]
    outputs, rate = heat.outputs, heat.rate
    out = np.empty((len(time), len(outputs)))
    goals = {duty: heat.steady_state(duty) for duty in set(duties)}
    levels = {duty: outputs @ goal for duty, goal in goals.items()}
    step = (time[-1] - time[0]) / max(len(time) - 1, 1) if len(time) else 0.0
    equidistant = len(time) > 1 and bool(np.abs(np.diff(time) - step).max() <= 1e-12 * time[-1])
    begins = cumulated(np.array([duty.duration for duty in duties]))
    rows = np.append(np.searchsorted(time, begins[:-1]), len(time))
    longest = min(ROWS, int(np.diff(rows).max()))
    table = np.exp(-np.arange(longest)[:, None] * step * rate) if equidistant else None
    factors = _low_rank(table) if table is not None and len(time) > 64 * longest else None
    for duty, begin, low, high in zip(duties, begins, rows, rows[1:], strict=False):
        goal = goals[duty]
        for k in range(int(low), int(high), ROWS):
            elapsed = time[k : min(k + ROWS, int(high))] - begin
            active = rate * elapsed[0] < DECAYED  # fast modes have decayed after minutes
            decay = np.exp(-(elapsed - elapsed[0])[:, None] * rate) if table is None else table[: len(elapsed)]
            amplitude = (outputs * ((z - goal) * np.exp(-elapsed[0] * rate))).T
            if not active.all():
                decay, amplitude = decay[:, active], amplitude[active]
            elif factors is not None:
                decay, amplitude = factors[0][: len(elapsed)], factors[1] @ amplitude
            block = out[k : k + len(elapsed)]
            np.matmul(decay, amplitude, out=block)
            block += levels[duty]
        z = advance(rate, z, goal, duty.duration)
    if air is not None:
        _add_air(out, heat, air, 0.0, time)
    return out


def _add_air(rises: Array, heat: ThermalModel, air: Ambient, clock: float, time: Array) -> None:
    """Adds what the air does from the clock on to rises (M, K) at times (M,) [s] after it."""
    for k in range(0, len(time), ROWS):
        share = heat.ambient * air.response(heat.rate, clock, clock + time[k : k + ROWS])
        rises[k : k + ROWS] += share @ heat.outputs.T


def _low_rank(table: Array) -> tuple[Array, Array]:
    """Two factors of a table with as few columns as it takes: many exponentials in time are nearly dependent."""
    left, size, right = np.linalg.svd(table, full_matrices=False)
    count = int((size > 1e-15 * size[0]).sum())
    return left[:, :count].copy(), size[:count, None] * right[:count]
