r"""The optimiser: what to command so that the real tool goes where it shall.

Decided is the correction c_n of the commanded pose at every waypoint, all in one problem: three of position in base
axes [m] and three of rotation in tool axes [rad],

    commanded_n = target_n (+) c_n,      e_n(c) = actual(theta(commanded_n), rise_n) (-) target_n

    minimise   sum_n ds_n [ |W e_n|^2 + l1 |W c'_n|^2 + l2 |W c''_n|^2 ]         ' = d/ds, not across a stop for c''

    subject to lower <= theta_n <= upper,   |c_n| <= clamp,   |c_{n+1} - c_n| <= rate ds

l1 = (L1 / 2 pi)^2 and l2 = (L2 / 2 pi)^4 halve what has a period of L1 or L2 along the path and leave what is longer.
W makes an angle count as the distance it moves a point one lever away; spin about the tool's own axis may be free.

Because the real arm differs from the nominal one by parts in 10^4, de/dc = I + O(1e-4). So with z_n = c_n - e_n(c) the
problem is linear least squares, pentadiagonal and separate for each of the six components: solving it and refreshing z
shrinks the step about a thousandfold each time. Smoothing enlarges hardly anything, so z that no longer moves says,
without another solve, that the correction would not move either. Where a constraint binds, ``limits`` takes over there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from compgen.compensation.limits import hold, violated
from compgen.compensation.problem import Problem, Settings, bands, measure, weights
from compgen.core.arrays import Array, frozen, own

STEP_TOLERANCE = 1e-11  # m, and rad times lever; what is left is a thousandth of it
MAX_ITERATIONS = 20


class Status(Enum):
    """How it ended, in the user's words."""

    CONVERGED = "every waypoint reaches its target within the smoothness asked for"
    LIMITED = "limits hold some waypoints off their targets; the best legal correction is taken there"
    FAILED = "the optimiser found no legal correction"


@dataclass(frozen=True, eq=False, slots=True)
class Solution:
    """The correction and how it was found."""

    correction: Array  # (N, 6)
    theta: Array  # (N, 6) [rad] joints of the commanded poses
    residual: Array  # (N, 6) predicted error that stays
    status: Status
    iterations: int
    step: float  # [m] what a further iteration would change, about
    active: tuple[tuple[int, str], ...]  # (waypoint from 1, limit) that bind

    def __post_init__(self) -> None:
        own(self, correction=("N", 6), theta=("N", 6), residual=("N", 6))


def optimise(problem: Problem, settings: Settings, progress: Callable[[float], None] = lambda share: None) -> Solution:
    """Best legal correction of a program.

    Args:
        problem: Targets, joints, warmth.
        settings: Smoothness and limits.
        progress: Called with the share done.

    Returns:
        The correction. Where a limit binds, ``status`` is LIMITED and ``active`` names waypoints and limits.
    """
    smooth = _smoother(problem, settings)
    wanted = problem.pointwise()  # nothing is left of it
    iterations = 0
    while True:
        correction = smooth(wanted)
        iterations += 1
        residual, theta, margin = problem.looked_at(correction)
        progress(min(0.9, iterations / 5))
        better = correction - residual
        step = _largest(better - wanted, settings.lever)
        if step <= STEP_TOLERANCE or iterations == MAX_ITERATIONS or not np.isfinite(step):
            break
        wanted = better
    active: tuple[tuple[int, str], ...] = ()
    status = Status.CONVERGED if step <= STEP_TOLERANCE else Status.FAILED
    rows = violated(problem, settings, correction, (theta, margin))
    if rows.any():
        free = correction
        correction, active, legal = hold(problem, settings, free, rows, progress)
        status = Status.LIMITED if legal and status is Status.CONVERGED else Status.FAILED
        moved = np.flatnonzero((free != correction).any(axis=1))
        residual[moved], theta[moved], _ = problem.window(moved).looked_at(correction[moved])
    progress(1.0)
    return Solution(frozen(correction), frozen(theta), frozen(residual), status, iterations, step, active)


def _largest(change: Array, lever: float) -> float:
    """The largest component of a correction (N, 6), angles as far as they move a point one lever away [m]."""
    size = [float(max(-change[:, i].min(), change[:, i].max())) for i in range(6)]
    return float(np.max(size * np.array([1.0, 1.0, 1.0, *3 * [lever]])))


def _smoother(problem: Problem, settings: Settings) -> Callable[[Array], Array]:
    """From the correction wanted (N, 6) to the smooth one nearest to it."""
    ds = measure(problem.arc)
    spin = (float(weights(settings)[5]) / settings.lever) ** 2
    tied, turn = (slice(0, 6), 1.0), (slice(5, 6), spin)
    parts = []
    for columns, trust in [(slice(0, 5), 1.0), turn] if settings.free_spin else [tied]:
        band = bands(problem.arc, problem.stop, settings, trust)
        parts.append((columns, trust * ds[:, None], cholesky_banded(band, overwrite_ab=True, check_finite=False)))

    def smooth(wanted: Array) -> Array:
        correction = np.empty_like(wanted)
        for columns, weight, factor in parts:
            pull = np.multiply(weight, wanted[:, columns], order="F")
            correction[:, columns] = cho_solve_banded((factor, False), pull, overwrite_b=True, check_finite=False)
        return correction

    return smooth
