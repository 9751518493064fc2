r"""The twin's own heat: each first-order mode through the segments of a program, by its own equation.

    state_{n+1} = goal_n + (state_n - goal_n) k_n,      k_n = exp(-rate (t_{n+1} - t_n))

While the goal stays the same the segments are one exponential. From goal to goal it is a sum, once divided by the
product of all k so far; a stretch as long as that product stays a number is summed in one go.
"""

from collections.abc import Iterable

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import BLOCK, parallel_for
from compgen.thermal import Duty, ThermalModel

MAX_DECAY = 200.0  # time constants over which a mode is summed in one go


def state_after_duties(heat: ThermalModel, duties: Iterable[Duty], state: Array, warmer: Array | float = 0.0) -> Array:
    """States of modes after duties, in air that keeps them ``warmer`` by so much, (S,)."""
    for duty in duties:
        goal = heat.steady_state(duty) + warmer
        state = goal - (goal - state) * np.exp(-duty.duration * heat.rate)
    return state


def mode_states(rate: Array, state: Array, time: Array, goals: Array) -> Array:
    """States of modes at the positions of a program.

    Args:
        rate: Of each mode, (S,) [1/s].
        state: At the first position, (S,).
        time: (N,) [s].
        goals: What the modes tend to on each segment, (N - 1, S).

    Returns:
        (N, S).
    """
    if not len(goals):
        return state[None]
    begins = np.flatnonzero(np.concatenate([[True], (goals[1:] != goals[:-1]).any(axis=1)]))
    edges = np.append(begins, len(goals))
    changes = goals if len(begins) == len(goals) else goals[begins]
    edge_states = _states_at_goal_changes(rate, state, time[edges], changes)
    if len(edges) == len(time):
        return edge_states
    run = np.repeat(np.arange(len(begins)), np.diff(edges))
    states = np.empty((len(time), len(state)))
    states[-1] = edge_states[-1]

    def fill(first: int, last: int) -> None:
        for begin in range(first, last, BLOCK):
            end = min(last, begin + BLOCK)
            k, goal = run[begin:end], goals[begin:end]
            since = (time[begin:end] - time[edges[k]])[:, None]
            states[begin:end] = goal + (edge_states[k] - goal) * np.exp(-since * rate)

    parallel_for(len(goals), fill)
    return states


def _states_at_goal_changes(rate: Array, state: Array, time: Array, goals: Array) -> Array:
    """States where the goal changes, (E,) [s] to (E, S)."""
    exponent = np.diff(time)[:, None] * rate
    states = np.empty((len(time), len(state)))
    states[0] = state
    first = 0
    decay = np.max(rate) * (time - time[0])
    while first < len(goals):
        last = max(first + 1, int(np.searchsorted(decay, decay[first] + MAX_DECAY, side="right")) - 1)
        summed = np.negative(exponent[first:last])
        np.negative(np.expm1(summed, out=summed), out=summed)
        summed *= goals[first:last]  # what each segment gains; in place, for a program is long
        kept = np.cumsum(exponent[first:last], axis=0, out=exponent[first:last])
        np.exp(np.negative(kept, out=kept), out=kept)
        # the end of a long single segment may keep nothing: then only its own goal counts
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            summed /= kept
            np.cumsum(summed, axis=0, out=summed)
            summed += states[first]
            summed *= kept
        np.copyto(summed, goals[first:last], where=~np.isfinite(summed))
        states[first + 1 : last + 1] = summed
        first = last
    return states
