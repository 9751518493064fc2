"""ruckig as a second opinion: some changes of speed solved again, state to state; the only place that calls it."""

from typing import NamedTuple

import numpy as np
from ruckig import InputParameter, Result, Ruckig, Trajectory

from compgen.core.arrays import Array

BLOCKS = 200  # that ruckig solves again, at most
TIME_TOLERANCE = 1e-6  # relative difference of ruckig's time


class Mismatch(NamedTuple):
    """A block that ruckig does not drive as planned."""

    block: int
    reason: str


def first_mismatch(
    length: Array, v0: Array, v1: Array, v: Array, peak: Array, a: Array, j: Array, time: Array
) -> Mismatch | None:
    """The first of some blocks that ruckig refuses, or that takes it another time.

    Args:
        length: Of each block, (B,) [m].
        v0: Speed at its start, (B,) [m/s]; the acceleration is zero at both ends.
        v1: Speed at its end, (B,) [m/s].
        v: Highest speed allowed, (B,) [m/s].
        peak: Highest speed reached, (B,) [m/s]; blocks without a change of speed are passed over.
        a: Highest acceleration, (B,) [m/s2].
        j: Highest jerk, (B,) [m/s3].
        time: Planned, (B,) [s].
    """
    changing = np.flatnonzero((v0 != peak) | (v1 != peak))
    sample = changing[np.unique(np.linspace(0, len(changing) - 1, min(BLOCKS, len(changing))).astype(int))]
    solver, request, solution = Ruckig(1), InputParameter(1), Trajectory(1)
    for n in sample.tolist():
        request.current_position, request.target_position = [0.0], [float(length[n])]
        request.current_velocity, request.target_velocity = [float(v0[n])], [float(v1[n])]
        request.current_acceleration = request.target_acceleration = [0.0]
        request.max_velocity, request.max_acceleration, request.max_jerk = [float(v[n])], [float(a[n])], [float(j[n])]
        try:
            solver.validate_input(request, True, True)
            outcome = solver.calculate(request, solution)
        except Exception as exception:  # ruckig raises its own untyped errors
            return Mismatch(n, str(exception))
        if outcome not in (Result.Working, Result.Finished):
            return Mismatch(n, outcome.name)
        if abs(solution.duration - time[n]) > TIME_TOLERANCE * time[n] + 1e-9:
            return Mismatch(n, f"ruckig needs {solution.duration:.9g} s and not {time[n]:.9g} s")
    return None
