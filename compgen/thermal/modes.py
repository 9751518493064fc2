r"""First-order modes, one by one: dz/dt = rate (goal - z)."""

import numpy as np

from compgen.core.arrays import Array


def advance(rate: Array, state: Array, goal: Array | float, time: Array | float) -> Array:
    """goal + (z - goal) exp(-rate t): modes that go towards a goal which stands.

    Args:
        rate: (S,) [1/s].
        state: z, (S,) or a row for each time.
        goal: (S,) or a row for each time.
        time: t, (...,) [s].

    Returns:
        (..., S); of one time (S,).
    """
    return np.asarray(goal + (state - goal) * np.exp(-np.asarray(time)[..., None] * rate))
