r"""The structured solver: a fixed point around one banded factor, and where a limit binds an interior point on a band.

Because the real arm differs from the nominal one by parts in 10^4, de/dc = I + O(1e-4). So with z_n = c_n - e_n(c) the
problem of ``optimise`` is linear least squares, pentadiagonal and separate for each of the six components: solving it
and refreshing z shrinks the step about a thousandfold each time. Smoothing enlarges hardly anything, so z that no
longer moves says, without another solve, that the correction would not move either. Where a constraint binds,
``limits`` takes over.
"""

from collections.abc import Callable

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded

from compgen.compensation.limits import MAX_WINDOW, WINDOW, enforce_limits, find_violations
from compgen.compensation.problem import ActiveLimits, Joints, Problem, Residual, Settings, Solution, Status
from compgen.compensation.smoothness import component_weights, smoothing_matrix, waypoint_lengths
from compgen.core.arrays import Array, frozen

STEP_TOLERANCE = 1e-11  # m, and rad times lever; what is left is a thousandth of it
MAX_ITERATIONS = 20


def optimise(
    problem: Problem,
    settings: Settings,
    progress: Callable[[float], None] = lambda share: None,
    step_tolerance: float = STEP_TOLERANCE,
    window: int = WINDOW,
    max_window: int = MAX_WINDOW,
) -> Solution:
    """Best legal correction of a program.

    Args:
        problem: Targets, joints and temperatures.
        settings: Smoothness and limits.
        progress: Called with the share done.
        step_tolerance: Step [m], and [rad] times lever, that is taken for none.
        window: Waypoints solved together where a limit binds.
        max_window: Where they cannot be parted without a limit binding across.

    Returns:
        The correction. Where a limit binds, ``status`` is LIMITED and ``active_limits`` names waypoints and limits.
    """
    correction, (residual, theta, margin), step, iterations = _unlimited(problem, settings, progress, step_tolerance)
    active_limits: ActiveLimits = ()
    status = Status.CONVERGED if step <= step_tolerance else Status.UNSETTLED
    violating = find_violations(problem, settings, correction, Joints(theta, margin))
    if violating.any():
        unlimited = correction
        correction, active_limits, limited = enforce_limits(
            problem, settings, unlimited, violating, progress, window, max_window
        )
        status = limited if status is Status.CONVERGED else status
        changed = np.flatnonzero((unlimited != correction).any(axis=1))
        residual[changed], theta[changed], _ = problem.window(changed).evaluate_residual(correction[changed])
    progress(1.0)
    return Solution(
        correction=frozen(correction),
        theta=frozen(theta),
        residual=frozen(residual),
        status=status,
        iterations=iterations,
        last_step=step,
        active_limits=active_limits,
    )


def _unlimited(
    problem: Problem, settings: Settings, progress: Callable[[float], None], step_tolerance: float
) -> tuple[Array, Residual, float, int]:
    """The smooth correction that leaves no error, by the fixed point z <- smooth(z) - e(smooth(z)).

    Returns:
        The correction without limits (N, 6), its residual, the last step [m], and how many there were.
    """
    smooth = _build_smoother(problem, settings)
    z = problem.pointwise_correction()
    for iterations in range(1, MAX_ITERATIONS + 1):
        correction = smooth(z)
        residual = problem.evaluate_residual(correction)
        progress(min(0.9, iterations / 5))
        before, z = z, correction - residual.e
        step = _largest_component(z - before, settings.lever)
        if step <= step_tolerance or not np.isfinite(step):
            break
    return correction, residual, step, iterations


def _largest_component(change: Array, lever: float) -> float:
    """The largest component of a correction (N, 6), angles as far as they move a point one lever away [m]."""
    size = [float(max(-change[:, i].min(), change[:, i].max())) for i in range(6)]
    return float(np.max(size * np.array([1.0, 1.0, 1.0, *3 * [lever]])))


def _build_smoother(problem: Problem, settings: Settings) -> Callable[[Array], Array]:
    """The function from z (N, 6) to the correction (N, 6) that is smooth and near it; its matrix is factored once."""
    ds = waypoint_lengths(problem.arc)
    spin = (float(component_weights(settings)[5]) / settings.lever) ** 2
    # components with one matrix in common, and their fidelity; a free spin has less of it
    groups = [(slice(0, 5), 1.0), (slice(5, 6), spin)] if settings.free_spin else [(slice(0, 6), 1.0)]
    factored = []
    for columns, fidelity in groups:
        band = smoothing_matrix(problem.arc, problem.stop, settings, fidelity)
        factored.append((columns, fidelity * ds[:, None], cholesky_banded(band, overwrite_ab=True, check_finite=False)))

    def smooth(z: Array) -> Array:
        correction = np.empty_like(z)
        for columns, weight, factor in factored:
            weighted = np.multiply(weight, z[:, columns], order="F")
            correction[:, columns] = cho_solve_banded((factor, False), weighted, overwrite_b=True, check_finite=False)
        return correction

    return smooth
