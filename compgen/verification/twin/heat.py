r"""The twin's own heat: each first-order mode through the segments of a program, by its own equation.

    state_{n+1} = goal_n + (state_n - goal_n) k_n,      k_n = exp(-rate (t_{n+1} - t_n))

That is a sum, once divided by the product of all k so far; a stretch as long as that product stays a number is summed
in one go.
"""

from collections.abc import Iterable

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import BLOCK
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
    states = np.empty((len(time), len(state)))
    states[0] = state
    decay = np.max(rate) * (time - time[0])
    first = 0
    while first < len(goals):
        reach = int(np.searchsorted(decay, decay[first] + MAX_DECAY, side="right")) - 1
        last = min(max(first + 1, reach), first + BLOCK)  # what is at hand stays in cache
        exponent = np.diff(time[first : last + 1])[:, None] * rate
        gained = -np.expm1(-exponent) * goals[first:last]
        kept = np.exp(-np.cumsum(exponent, axis=0))
        # the end of a long single segment may keep nothing: then only its own goal counts
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            summed = (states[first] + np.cumsum(gained / kept, axis=0)) * kept
        states[first + 1 : last + 1] = np.where(np.isfinite(summed), summed, goals[first:last])
        first = last
    return states
