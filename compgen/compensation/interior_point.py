r"""A correction with its limits, all waypoints at once: a primal-dual interior point on a band of half-width 12.

    minimise   1/2 sum ds [ |W e|^2 + l1 |W c'|^2 + l2 |W c''|^2 ]
    subject to g_i(c) + s_i = 0, s_i >= 0:     theta inside its limits, |c| <= clamp, |c_{n+1} - c_n| <= rate ds

Newton's step on the KKT conditions, with slacks s, multipliers lam and the barrier parameter mu = lam_i s_i,

    (H + sum lam_i g_i'' + A^T (lam / s) A) dc = - f' - A^T ((mu + lam r) / s),       A = g',  r = g + s

couples a waypoint's six components with each other, with the position of its neighbours (rate) and with its own
components two waypoints on (smoothness). H is Gauss-Newton's; e, theta and their derivatives in c are CasADi's, taken
anew only when the steps have become small against the way gone since: over some micrometres both are linear. Each
iteration solves twice with one factor: the affine step (mu = 0) tells which mu to aim for and how the complementarity
bends off, the second step corrects for both (Mehrotra 1992). The unknowns x are c in micrometres and, for rotations,
micrometres at the lever; joints are in microradians, so that nothing needs scaling. Waypoints that are not free stay
as they are, so stretches apart from each other are one system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg import cho_solve_banded, cholesky_banded

from compgen.compensation.problem import Problem, Settings
from compgen.compensation.smoothness import component_weights, smoothing_matrix, waypoint_lengths
from compgen.core.arrays import Array, BoolArray, IntArray, dot
from compgen.core.units import UM

HALF_WIDTH = 12  # of the band
MAX_ITERATIONS = 80
NEAR_LIMIT = 5e-3  # rad from a limit within which a joint is constrained
TOLERANCE = 1e-6  # um, of the last step and of the primal residual
FINAL_MU = 1e-7  # um^2 of mu at the end: smaller only adds noise
LINEAR_RANGE = 0.03  # um within which error and joints are as good as linear
MAX_MULTIPLIER = 1e10  # um: a multiplier beyond this says that the limits leave no way
BOUNDARY_FRACTION = 0.995  # of the way to where a slack or a multiplier would vanish

Constraints = tuple[Any, ...]  # numbers of each constraint: of joints (2, N, 6), clamps (N, 2) and rate (N - 1,)


@dataclass(frozen=True, eq=False, slots=True)
class _Linearisation:
    """The cost without smoothness, and the joints, about a correction."""

    x: Array  # (N, 6) [um] the correction
    gradient: Array  # (N, 6) of the cost
    hessian: Array  # (N, 6, 6) of the cost, Gauss-Newton's
    theta: Array  # (N, 6) [urad]
    theta_jacobian: Array  # (N, 6, 6) dtheta/dx


@dataclass(frozen=True, eq=False, slots=True)
class _KktSystem:
    """The KKT conditions about one iterate, factored."""

    free: BoolArray  # (N,)
    included: Constraints  # which constraints there are
    s: Constraints
    lam: Constraints
    r: Constraints  # g + s, the primal residual
    joint_rows: IntArray  # (J,) which waypoints have a joint near its limit
    theta_jacobian: Array  # (J, 6, 6) dtheta/dx there
    position_gradient: Array  # (N, 3) of the position clamp
    rotation_gradient: Array  # (N, 3) of the rotation clamp
    rate_gradient: Array  # (N - 1, 3) of the rate limit
    cost_gradient: Array  # (N, 6)
    factor: Array  # (13, 6 N) Cholesky factor of the condensed matrix


def solve(
    problem: Problem,
    settings: Settings,
    start: Array,
    free: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, bool]:
    """Best legal correction of the free waypoints (N,), the others as they are (N, 6); and whether it converged."""
    robot = problem.robot
    unit = np.array([UM, UM, UM, *3 * [UM / settings.lever]])
    h, ds = np.maximum(np.diff(problem.arc), 1e-12), waypoint_lengths(problem.arc)
    scale = 1 / float(ds[free].mean())  # a waypoint counts about one
    smoothness = smoothing_matrix(problem.arc, problem.stop, settings, 0.0) * scale
    weight = (component_weights(settings) / UM) ** 2 * (scale * ds)[:, None]

    def linearise(x: Array) -> _Linearisation:
        e, E, theta, G = problem.linearise(x * unit)
        E, G = E * unit, G * unit / UM
        hessian = np.matmul(np.swapaxes(E, 1, 2), weight[:, :, None] * E)
        return _Linearisation(x, _transposed_times(E, weight * e), hessian, theta / UM, G)

    model = linearise(start / unit)
    lower, upper = robot.lower / UM, robot.upper / UM
    near = free[:, None] & np.stack([model.theta > upper - NEAR_LIMIT / UM, model.theta < lower + NEAR_LIMIT / UM])
    joint_rows = np.flatnonzero(near.any(axis=(0, 2)))
    clamp = np.array([settings.clamp_position, settings.clamp_rotation * settings.lever]) / UM
    max_change = settings.rate * h / UM

    def constraints(x: Array, theta: Array) -> Constraints:
        """g of joints (2, N, 6) [urad], clamps (N, 2) and rate (N - 1,) [um]."""
        p, w, d = x[:, :3], x[:, 3:], np.diff(x[:, :3], axis=0)
        squares = np.column_stack([dot(p, p), dot(w, w)])
        return (
            np.stack([theta - upper, lower - theta]),
            (squares - clamp**2) / (2 * clamp),
            (dot(d, d) - max_change**2) / (2 * max_change),
        )

    included = (near, np.repeat(free[:, None], 2, axis=1), free[1:] | free[:-1])
    x = model.x
    g = constraints(x, model.theta)
    s: Constraints = tuple(np.where(on, np.maximum(-v, 1.0), 1.0) for on, v in zip(included, g))
    lam: Constraints = tuple(np.where(on, 1.0 / v, 0.0) for on, v in zip(included, s))
    count = max(1, sum(int(on.sum()) for on in included))
    fixed = np.repeat(~free, 6)
    last_step = np.inf
    for iteration in range(MAX_ITERATIONS):
        r = tuple(np.where(on, v + t, 0.0) for on, v, t in zip(included, g, s))
        ratio = tuple(k / t for k, t in zip(lam, s))
        p, w = x[:, :3] / clamp[0], x[:, 3:] / clamp[1]
        d = np.diff(x[:, :3], axis=0) / max_change[:, None]

        A = model.theta_jacobian[joint_rows]
        block = model.hessian.copy()
        block[joint_rows] += np.matmul(np.swapaxes(A, 1, 2), ratio[0].sum(axis=0)[joint_rows, :, None] * A)
        block[:, :3, :3] += _ball_hessian(ratio[1][:, 0], p, lam[1][:, 0] / clamp[0])
        block[:, 3:, 3:] += _ball_hessian(ratio[1][:, 1], w, lam[1][:, 1] / clamp[1])
        coupling = _ball_hessian(ratio[2], d, lam[2] / max_change)
        block[:-1, :3, :3] += coupling
        block[1:, :3, :3] += coupling
        try:
            factor = cholesky_banded(_condensed_matrix(smoothness, block, -coupling, fixed), overwrite_ab=True)
        except (LinAlgError, ValueError):
            return start, False
        gradient = model.gradient + _times(model.hessian, x - model.x) + _smoothness_times(smoothness, x)
        system = _KktSystem(free, included, s, lam, r, joint_rows, A, p, w, d, gradient, factor)

        mu = _inner_product(s, lam) / count
        target: Constraints = (FINAL_MU, FINAL_MU, FINAL_MU)
        if mu > 2 * FINAL_MU:
            # what the affine step leaves of mu says which mu to aim for; its lam s bends off by dlam ds
            _, ds_, dlam = _newton_step(system, (0.0, 0.0, 0.0))
            primal, dual = _step_length(s, ds_), _step_length(lam, dlam)
            affine_s = tuple(a + primal * b for a, b in zip(s, ds_))
            affine_lam = tuple(a + dual * b for a, b in zip(lam, dlam))
            affine_mu = _inner_product(affine_s, affine_lam) / count
            target_mu = max(mu * min(1.0, affine_mu / mu) ** 3, FINAL_MU)
            target = tuple(target_mu - a * b for a, b in zip(ds_, dlam))
        dx, ds_, dlam = _newton_step(system, target)
        primal, dual = _step_length(s, ds_), _step_length(lam, dlam)
        x = x + primal * dx
        s = tuple(a + primal * b for a, b in zip(s, ds_))
        lam = tuple(a + dual * b for a, b in zip(lam, dlam))
        last_step, way = float(np.abs(dx).max()), float(np.abs(x - model.x).max())
        relinearise = way > LINEAR_RANGE and last_step < way / 100
        if relinearise:
            model = linearise(x)
        g = constraints(x, model.theta + _times(model.theta_jacobian, x - model.x))
        primal_residual = max(
            float(np.abs(np.where(on, v + t, 0.0)).max(initial=0.0)) for on, v, t in zip(included, g, s)
        )
        progress(min(0.99, (iteration + 1) / 30))
        if max(float(k.max(initial=0.0)) for k in lam) > MAX_MULTIPLIER or not np.isfinite(last_step):
            return start, False
        if last_step < TOLERANCE and primal_residual < TOLERANCE and mu < 2 * FINAL_MU and not relinearise:
            break
    return np.where(free[:, None], x * unit, start), bool(last_step < 10 * TOLERANCE)


def _newton_step(system: _KktSystem, target: Constraints) -> tuple[Array, Constraints, Constraints]:
    """Newton's step to lam s = target: of x (N, 6), of s and of lam."""
    included, s, lam, rows = system.included, system.s, system.lam, system.joint_rows
    push = tuple(np.where(on, (m + k * q) / t, 0.0) for on, m, k, q, t in zip(included, target, lam, system.r, s))
    gradient = system.cost_gradient.copy()
    gradient[rows] += _transposed_times(system.theta_jacobian, (push[0][0] - push[0][1])[rows])
    gradient[:, :3] += push[1][:, :1] * system.position_gradient
    gradient[:, 3:] += push[1][:, 1:] * system.rotation_gradient
    gradient[1:, :3] += push[2][:, None] * system.rate_gradient
    gradient[:-1, :3] -= push[2][:, None] * system.rate_gradient
    gradient[~system.free] = 0.0
    dx = cho_solve_banded((system.factor, False), -gradient.ravel(), overwrite_b=True).reshape(-1, 6)
    dtheta = np.zeros_like(dx)
    dtheta[rows] = _times(system.theta_jacobian, dx[rows])
    dg = (
        np.stack([dtheta, -dtheta]),
        np.column_stack([dot(system.position_gradient, dx[:, :3]), dot(system.rotation_gradient, dx[:, 3:])]),
        dot(system.rate_gradient, np.diff(dx[:, :3], axis=0)),
    )
    ds = tuple(np.where(on, -q - a, 0.0) for on, q, a in zip(included, system.r, dg))
    dlam = tuple(np.where(on, (m - k * a) / t - k, 0.0) for on, m, k, t, a in zip(included, target, lam, s, ds))
    return dx, ds, dlam


def _transposed_times(matrices: Array, rows: Array) -> Array:
    """The transpose of each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,ni->nj", matrices, rows))


def _times(matrices: Array, rows: Array) -> Array:
    """Each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,nj->ni", matrices, rows))


def _ball_hessian(along: Array, rows: Array, isotropic: Array) -> Array:
    """Hessian of a ball's limit: along (N,) times a row (N, 3) with itself, and isotropic (N,) times the identity."""
    return np.asarray((along[:, None] * rows)[:, :, None] * rows[:, None, :] + isotropic[:, None, None] * np.eye(3))


def _inner_product(a: Constraints, b: Constraints) -> float:
    return sum(float((v * w).sum()) for v, w in zip(a, b))


def _step_length(values: tuple[Array, ...], change: tuple[Array, ...]) -> float:
    """The share of a step that keeps values above zero, at most 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shrink = max(float((-b / a).max(initial=0.0, where=a > 0)) for a, b in zip(values, change))
    return min(1.0, BOUNDARY_FRACTION / shrink) if shrink > 0 else 1.0


def _smoothness_times(smoothness: Array, x: Array) -> Array:
    """The smoothness matrix, banded (3, N), times each component of x, (N, 6)."""
    second, first, diagonal = smoothness
    product: Array = diagonal[:, None] * x
    product[1:] += first[1:, None] * x[:-1]
    product[:-1] += first[1:, None] * x[1:]
    product[2:] += second[2:, None] * x[:-2]
    product[:-2] += second[2:, None] * x[2:]
    return product


def _condensed_matrix(smoothness: Array, block: Array, coupling: Array, fixed: BoolArray) -> Array:
    """Upper band of the whole matrix, (13, 6 N); fixed entries stand alone.

    Args:
        smoothness: Banded, (3, N).
        block: Of each waypoint, (N, 6, 6).
        coupling: Of the positions of neighbours, (N - 1, 3, 3).
        fixed: Entries that stay as they are, (6 N,).
    """
    N = len(block)
    ab = np.zeros((HALF_WIDTH + 1, N, 6))
    for i in range(6):
        for j in range(i, 6):
            ab[HALF_WIDTH - (j - i), :, j] += block[:, i, j]
    for i in range(3):
        for j in range(3):
            ab[HALF_WIDTH - (6 + j - i), 1:, j] += coupling[:, i, j]
    ab[HALF_WIDTH] += smoothness[2][:, None]
    ab[HALF_WIDTH - 6] += smoothness[1][:, None]
    ab[HALF_WIDTH - 12] += smoothness[0][:, None]
    band = ab.reshape(HALF_WIDTH + 1, 6 * N)
    for k in range(1, HALF_WIDTH + 1):
        band[HALF_WIDTH - k, k:][fixed[k:] | fixed[:-k]] = 0.0
        band[HALF_WIDTH - k, :k] = 0.0
    band[HALF_WIDTH, fixed] = 1.0
    return np.asarray(band)
