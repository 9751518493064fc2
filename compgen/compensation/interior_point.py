r"""A primal-dual interior point for a smooth cost and constraints on a band of half-width 12.

    minimise   f(x) + 1/2 x' S x          subject to   g_i(x) + s_i = 0,   s_i >= 0

Newton's step on the KKT conditions, with slacks s, multipliers lam and the barrier parameter mu = lam_i s_i,

    (H + sum lam_i g_i'' + A^T (lam / s) A) dx = - f' - A^T ((mu + lam r) / s),       A = g',  r = g + s

couples a waypoint's six unknowns with each other, the first three with those of its neighbours, and each with itself
two waypoints on (S, smoothness). f and g are taken anew only when the steps have become small against the way gone
since: over some micrometres both are linear. Each iteration solves twice with one factor: the affine step (mu = 0)
tells which mu to aim for and how the complementarity bends off, the second step corrects for both (Mehrotra 1992).
The unknowns are of the order of micrometres, so that nothing needs scaling. Waypoints that are not free stay as they
are, so stretches apart from each other are one system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg import cho_solve_banded, cholesky_banded

from compgen.compensation.banded_matrix import assemble, smoothness_times, times
from compgen.compensation.constraints import Constraint, Derivative
from compgen.compensation.problem import Status
from compgen.core.arrays import Array, BoolArray

MAX_ITERATIONS = 80
TOLERANCE = 1e-6  # um, of the last step and of the primal residual
FINAL_MU = 1e-7  # um^2 of mu at the end: smaller only adds noise
LINEAR_RANGE = 0.03  # um within which cost and constraints are as good as linear
MAX_MULTIPLIER = 1e10  # um: a multiplier beyond this says that the limits leave no way
BOUNDARY_FRACTION = 0.995  # of the way to where a slack or a multiplier would vanish

ConstraintValues = tuple[Any, ...]  # numbers of each kind of constraint, in its shape


@dataclass(frozen=True, eq=False, slots=True)
class LocalProgram:
    """The cost without smoothness, quadratic about a point, and the constraints."""

    x: Array  # (N, 6) [um] where it was taken
    gradient: Array  # (N, 6)
    hessian: Array  # (N, 6, 6) Gauss-Newton's
    constraints: tuple[Constraint, ...]

    def residual(self, x: Array, s: ConstraintValues) -> ConstraintValues:
        """G + s at a point, zero where there is no constraint."""
        return tuple(np.where(c.included, c.value(x) + t, 0.0) for c, t in zip(self.constraints, s, strict=True))


@dataclass(frozen=True, eq=False, slots=True)
class _Iterate:
    x: Array  # (N, 6)
    s: ConstraintValues
    lam: ConstraintValues
    r: ConstraintValues  # g + s, the primal residual


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _KktSystem:
    """The KKT conditions about one iterate, factored."""

    at: _Iterate
    free: BoolArray  # (N,)
    included: ConstraintValues  # which constraints there are
    derivatives: tuple[Derivative, ...]
    cost_gradient: Array  # (N, 6)
    factor: Array  # (13, 6 N) Cholesky factor of the condensed matrix


@dataclass(frozen=True, eq=False, slots=True)
class _Step:
    dx: Array  # (N, 6)
    ds: ConstraintValues
    dlam: ConstraintValues


def solve(
    linearise: Callable[[Array], LocalProgram],
    smoothness: Array,
    start: Array,
    free: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, Status]:
    """The optimum of the free waypoints (N,), the others as they are.

    Args:
        linearise: Cost and constraints about a point (N, 6).
        smoothness: S of one unknown, banded (3, N).
        start: (N, 6) [um].
        free: (N,).
        progress: Called with the share done, a guess.

    Returns:
        Where the iteration ended, (N, 6) [um], and how.
    """
    local = linearise(start)
    at = _first_iterate(local)
    count = max(1, sum(int(c.included.sum()) for c in local.constraints))
    last_step = np.inf
    for iteration in range(MAX_ITERATIONS):
        try:
            system = _assemble_system(local, smoothness, free, at)
        except (LinAlgError, ValueError):
            return start, Status.FAILED
        mu = _inner_product(at.s, at.lam) / count
        step = _newton_step(system, _choose_target(system, mu, count))
        primal, dual = _step_length(at.s, step.ds), _step_length(at.lam, step.dlam)
        x, s, lam = at.x + primal * step.dx, _moved(at.s, primal, step.ds), _moved(at.lam, dual, step.dlam)
        last_step, way = float(np.abs(step.dx).max()), float(np.abs(x - local.x).max())
        relinearise = way > LINEAR_RANGE and last_step < way / 100
        if relinearise:
            local = linearise(x)
        at = _Iterate(x, s, lam, local.residual(x, s))
        primal_residual = max(float(np.abs(r).max(initial=0.0)) for r in at.r)
        progress(min(0.99, (iteration + 1) / 30))
        if max(float(k.max(initial=0.0)) for k in lam) > MAX_MULTIPLIER or not np.isfinite(last_step):
            return start, Status.FAILED
        if last_step < TOLERANCE and primal_residual < TOLERANCE and mu < 2 * FINAL_MU and not relinearise:
            break
    return at.x, Status.CONVERGED if last_step < 10 * TOLERANCE else Status.UNSETTLED


def _first_iterate(local: LocalProgram) -> _Iterate:
    """Slacks as large as the constraints are from their limits, a micrometre at least, and mu = 1."""
    constraints = local.constraints
    s = tuple(np.where(c.included, np.maximum(-c.value(local.x), 1.0), 1.0) for c in constraints)
    lam = tuple(np.where(c.included, 1.0 / t, 0.0) for c, t in zip(constraints, s, strict=True))
    return _Iterate(local.x, s, lam, local.residual(local.x, s))


def _assemble_system(local: LocalProgram, smoothness: Array, free: BoolArray, at: _Iterate) -> _KktSystem:
    """The condensed matrix about an iterate, factored.

    Raises:
        LinAlgError: It is not positive definite.
        ValueError: It is not finite.
    """
    derivatives = tuple(c.about(at.x) for c in local.constraints)
    block, coupling = local.hessian.copy(), np.zeros((len(free) - 1, 3, 3))
    for derivative, s, lam in zip(derivatives, at.s, at.lam, strict=True):
        derivative.add_hessian(lam / s, lam, block, coupling)
    matrix = assemble(smoothness, block, coupling, np.repeat(~free, 6))
    gradient = local.gradient + times(local.hessian, at.x - local.x) + smoothness_times(smoothness, at.x)
    included = tuple(c.included for c in local.constraints)
    return _KktSystem(
        at=at,
        free=free,
        included=included,
        derivatives=derivatives,
        cost_gradient=gradient,
        factor=cholesky_banded(matrix, overwrite_ab=True),
    )


def _choose_target(system: _KktSystem, mu: float, count: int) -> ConstraintValues:
    """What lam s of each constraint shall become: what the affine step leaves of mu says which mu to aim for."""
    at = system.at
    if mu <= 2 * FINAL_MU:
        return tuple(FINAL_MU for _ in at.s)
    affine = _newton_step(system, tuple(0.0 for _ in at.s))
    primal, dual = _step_length(at.s, affine.ds), _step_length(at.lam, affine.dlam)
    affine_mu = _inner_product(_moved(at.s, primal, affine.ds), _moved(at.lam, dual, affine.dlam)) / count
    target_mu = max(mu * min(1.0, affine_mu / mu) ** 3, FINAL_MU)
    return tuple(
        target_mu - a * b for a, b in zip(affine.ds, affine.dlam, strict=True)
    )  # its lam s bends off by dlam ds


def _newton_step(system: _KktSystem, target: ConstraintValues) -> _Step:
    """Newton's step to lam s = target."""
    included, s, lam, r = system.included, system.at.s, system.at.lam, system.at.r
    push = tuple(np.where(on, (m + k * q) / t, 0.0) for on, m, k, q, t in zip(included, target, lam, r, s, strict=True))
    gradient = system.cost_gradient.copy()
    for derivative, y in zip(system.derivatives, push, strict=True):
        derivative.add_transposed(y, gradient)
    gradient[~system.free] = 0.0
    dx = cho_solve_banded((system.factor, False), -gradient.ravel(), overwrite_b=True).reshape(-1, 6)
    dg = tuple(derivative.times(dx) for derivative in system.derivatives)
    ds = tuple(np.where(on, -q - a, 0.0) for on, q, a in zip(included, r, dg, strict=True))
    dlam = tuple(
        np.where(on, (m - k * a) / t - k, 0.0) for on, m, k, t, a in zip(included, target, lam, s, ds, strict=True)
    )
    return _Step(dx, ds, dlam)


def _moved(values: ConstraintValues, share: float, change: ConstraintValues) -> ConstraintValues:
    return tuple(a + share * b for a, b in zip(values, change, strict=True))


def _inner_product(a: ConstraintValues, b: ConstraintValues) -> float:
    return sum(float((v * w).sum()) for v, w in zip(a, b, strict=True))


def _step_length(values: ConstraintValues, change: ConstraintValues) -> float:
    """The share of a step that keeps values above zero, at most 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shrink = max(float((-b / a).max(initial=0.0, where=a > 0)) for a, b in zip(values, change, strict=True))
    return min(1.0, BOUNDARY_FRACTION / shrink) if shrink > 0 else 1.0
