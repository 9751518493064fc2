r"""The twin's own heat: each first-order mode through the segments of a program, by its own equation.

    state_{n+1} = goal_n + (state_n - goal_n) k_n,      k_n = exp(-rate (t_{n+1} - t_n))

While the goal stays the same the segments are one exponential. From goal to goal it is a sum, once divided by the
product of all k so far; a stretch as long as that product stays a number is summed in one go.
"""

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import BLOCK, parallel_for

FADED = 200.0  # time constants over which a mode is summed in one go


def warmed(rate: Array, state: Array, time: Array, goals: Array) -> Array:
    """States of modes at the positions of a program.

    Args:
        rate: Of each mode, (S,) [1/s].
        state: At the first position, (S,).
        time: (N,) [s].
        goals: What the modes tend to on each segment, (N - 1, S).

    Returns:
        (N, S).
    """
    begins = np.flatnonzero(np.concatenate([[True], (goals[1:] != goals[:-1]).any(axis=1)]))
    edge = np.append(begins, len(goals))
    corner = _stepped(rate, state, time[edge], goals[begins])
    if len(edge) == len(time):
        return corner
    run = np.repeat(np.arange(len(begins)), np.diff(edge))
    out = np.empty((len(time), len(state)))
    out[-1] = corner[-1]

    def fade(first: int, last: int) -> None:
        for at in range(first, last, BLOCK):
            end = min(last, at + BLOCK)
            k, goal = run[at:end], goals[at:end]
            past = (time[at:end] - time[edge[k]])[:, None]
            out[at:end] = goal + (corner[k] - goal) * np.exp(-past * rate)

    parallel_for(len(goals), fade)
    return out


def _stepped(rate: Array, state: Array, time: Array, goals: Array) -> Array:
    """The same from goal to goal."""
    drop = np.diff(time)[:, None] * rate
    out = np.empty((len(time), len(state)))
    out[0] = state
    first = 0
    passed = np.concatenate([[0.0], np.cumsum(drop.max(axis=1))])
    while first < len(goals):
        last = max(first + 1, int(np.searchsorted(passed, passed[first] + FADED, side="right")) - 1)
        kept = np.exp(-np.cumsum(drop[first:last], axis=0))
        gain = goals[first:last] * -np.expm1(-drop[first:last])
        # the end of a long single segment may keep nothing: then only its own goal counts
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            summed = kept * (out[first] + np.cumsum(gain / kept, axis=0))
        out[first + 1 : last + 1] = np.where(np.isfinite(summed), summed, goals[first:last])
        first = last
    return out
