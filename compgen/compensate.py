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
shrinks the step about a thousandfold each time. Where a constraint binds, ``limits`` takes over for that stretch.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np

from compgen.arrays import Array, frozen, own
from compgen.banded import cho_solve_banded, cholesky_banded
from compgen.limits import hold, violated
from compgen.problem import Problem, Settings, bands, measure, weights

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
    step: float  # [m] last change of the correction
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
    ds = measure(problem.arc)[:, None]
    stiff = bands(problem.arc, problem.stop, settings)
    w = weights(settings)
    lever = w.copy()
    lever[5] = settings.lever
    correction = problem.pointwise()
    wanted = correction  # nothing is left of it
    fixed = [i for i in range(6) if w[i] == lever[i]]
    factor = cholesky_banded(stiff, overwrite_ab=True, check_finite=False)
    loose = None
    if len(fixed) < 6:
        trust = (w[5] / lever[5]) ** 2
        loose = cholesky_banded(bands(problem.arc, problem.stop, settings, trust)), trust
    step = np.inf
    iterations = 0
    while True:
        new = np.empty(correction.shape, order="F")
        new[:, fixed] = cho_solve_banded((factor, False), ds * wanted[:, fixed], check_finite=False)
        if loose:
            new[:, 5] = cho_solve_banded((loose[0], False), loose[1] * ds[:, 0] * wanted[:, 5])
        step = max(float(np.abs(new[:, i] - correction[:, i]).max()) * float(lever[i]) for i in range(6))
        correction = np.ascontiguousarray(new)
        iterations += 1
        residual, theta, margin = problem.looked_at(correction)
        progress(min(0.9, iterations / 5))
        if step <= STEP_TOLERANCE or iterations == MAX_ITERATIONS or not np.isfinite(step):
            break
        wanted = correction - residual
    active: tuple[tuple[int, str], ...] = ()
    status = Status.CONVERGED if step <= STEP_TOLERANCE else Status.FAILED
    rows = violated(problem, settings, correction, (theta, margin))
    if rows.any():
        correction, active, legal = hold(problem, settings, correction, rows, progress)
        status = Status.LIMITED if legal and status is Status.CONVERGED else Status.FAILED
        residual, theta, _ = problem.looked_at(correction)
    progress(1.0)
    return Solution(frozen(correction), frozen(theta), frozen(residual), status, iterations, step, active)
