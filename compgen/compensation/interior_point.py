r"""Stretches where a limit binds, all at once: a primal-dual interior point on a band of half-width 12.

    minimise   1/2 sum ds [ |W e|^2 + l1 |W c'|^2 + l2 |W c''|^2 ]
    subject to g_i(c) + s_i = 0, s_i >= 0:     theta inside its limits, |c| <= clamp, |c_{n+1} - c_n| <= rate ds

Newton's step on the conditions of the optimum, with the multipliers l_i s_i = mu,

    (H + sum l_i g_i'' + A^T (l / s) A) dc = - f' - A^T ((mu + l r) / s),       A = g',  r = g + s

couples a waypoint's six components with each other, with the position of its neighbours (rate) and with its own
components two waypoints on (smoothness). H is Gauss-Newton's; e, theta and their derivatives in c are CasADi's, taken
anew only when the steps have become small against the way gone since: over some micrometres both are linear. Each step
aims as far and as much to the side as Newton's first look ahead says (Mehrotra's predictor and corrector, one factor).
Lengths are counted in micrometres, angles in microradians, so that nothing needs scaling. Waypoints
that are not loose stay as they are, so stretches apart from each other are one system.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg import cho_solve_banded, cholesky_banded

from compgen.compensation.problem import Problem, Settings, bands, measure, weights
from compgen.core.arrays import Array, BoolArray, IntArray, dot
from compgen.core.units import UM

BAND = 12
STEPS = 80
NEAR = 5e-3  # rad from a limit within which a joint is looked after
DONE = 1e-6  # um, of the last step
SLACK = 1e-7  # um^2 of mu at the end: smaller only adds noise
STRAIGHT = 0.03  # um within which error and joints are as good as linear
ENDLESS = 1e10  # um: a multiplier beyond this says that the limits leave no way
BACK = 0.995  # of the way to where a slack or a multiplier would vanish

Three = tuple[Any, ...]  # joints, clamps, rate


@dataclass(frozen=True, eq=False, slots=True)
class _Linear:
    """Error and joints about a correction (N, 6), in um: what they cost there, and how that and the joints change."""

    at: Array  # (N, 6)
    pull: Array  # (N, 6) gradient of the cost without smoothness
    block: Array  # (N, 6, 6) its Gauss-Newton Hessian
    joint: Array  # (N, 6) [urad] theta
    turn: Array  # (N, 6, 6) d theta / d x


@dataclass(frozen=True, eq=False, slots=True)
class _System:
    """The conditions of the optimum about one iterate, factored."""

    loose: BoolArray  # (N,)
    used: Three
    s: Three
    lam: Three
    r: Three  # g + s
    rows: IntArray  # (J,) which waypoints have a joint near its limit
    turn: Array  # (J, 6, 6) d theta / d x there
    p: Array  # (N, 3) gradients of the clamps: of position,
    w: Array  # (N, 3) of rotation,
    d: Array  # (N - 1, 3) and of the rate
    force: Array  # (N, 6) gradient of the cost
    factor: Array  # (13, 6 N)


def solve(
    problem: Problem,
    settings: Settings,
    start: Array,
    loose: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, bool]:
    """Best legal correction of the loose waypoints (N,), the others as they are (N, 6); and whether it converged."""
    robot = problem.robot
    unit = np.array([UM, UM, UM, *3 * [UM / settings.lever]])
    h, ds = np.maximum(np.diff(problem.arc), 1e-12), measure(problem.arc)
    share = 1 / float(ds[loose].mean())
    smooth = bands(problem.arc, problem.stop, settings, 0.0) * share
    weight = (weights(settings) / UM) ** 2 * (share * ds)[:, None]

    def linear(x: Array) -> _Linear:
        e, E, theta, G = problem.linear(x * unit)
        E, G = E * unit, G * unit / UM
        return _Linear(x, _down(E, weight * e), np.matmul(np.swapaxes(E, 1, 2), weight[:, :, None] * E), theta / UM, G)

    near = linear(start / unit)
    low, high = robot.lower / UM, robot.upper / UM
    guarded = loose[:, None] & np.stack([near.joint > high - NEAR / UM, near.joint < low + NEAR / UM])  # (2, N, 6)
    at_joint = np.flatnonzero(guarded.any(axis=(0, 2)))
    size = np.array([settings.clamp_position, settings.clamp_rotation * settings.lever]) / UM
    reach = settings.rate * h / UM

    def limits(x: Array, joint: Array) -> Three:
        """g of joints (2, N, 6), clamps (N, 2) and rate (N - 1,) [um]."""
        p, w, d = x[:, :3], x[:, 3:], np.diff(x[:, :3], axis=0)
        over = np.column_stack([dot(p, p), dot(w, w)])
        return (
            np.stack([joint - high, low - joint]),
            (over - size**2) / (2 * size),
            (dot(d, d) - reach**2) / (2 * reach),
        )

    used = (guarded, np.repeat(loose[:, None], 2, axis=1), loose[1:] | loose[:-1])
    x = near.at
    g = limits(x, near.joint)
    s: Three = tuple(np.where(u, np.maximum(-v, 1.0), 1.0) for u, v in zip(used, g))
    lam: Three = tuple(np.where(u, 1.0 / v, 0.0) for u, v in zip(used, s))
    count = max(1, sum(int(u.sum()) for u in used))
    fixed = np.repeat(~loose, 6)
    moved = np.inf
    for step in range(STEPS):
        r = tuple(np.where(u, v + t, 0.0) for u, v, t in zip(used, g, s))
        stiff = tuple(k / t for k, t in zip(lam, s))
        p, w, d = x[:, :3] / size[0], x[:, 3:] / size[1], np.diff(x[:, :3], axis=0) / reach[:, None]

        A = near.turn[at_joint]
        block = near.block.copy()
        block[at_joint] += np.matmul(np.swapaxes(A, 1, 2), stiff[0].sum(axis=0)[at_joint, :, None] * A)
        block[:, :3, :3] += _ball(stiff[1][:, 0], p, lam[1][:, 0] / size[0])
        block[:, 3:, 3:] += _ball(stiff[1][:, 1], w, lam[1][:, 1] / size[1])
        pair = _ball(stiff[2], d, lam[2] / reach)
        block[:-1, :3, :3] += pair
        block[1:, :3, :3] += pair
        try:
            factor = cholesky_banded(_assembled(smooth, block, -pair, fixed), overwrite_ab=True)
        except (LinAlgError, ValueError):
            return start, False
        force = near.pull + _across(near.block, x - near.at) + _banded(smooth, x)
        system = _System(loose, used, s, lam, r, at_joint, A, p, w, d, force, factor)

        gap = _inner(s, lam) / count
        goal: Three = (SLACK, SLACK, SLACK)
        if gap > 2 * SLACK:
            # how far straight ahead leads says how much of the gap to aim for, and how far the way bends off (Mehrotra)
            _, ds_, dl = _towards(system, (0.0, 0.0, 0.0))
            along, across = _room(s, ds_), _room(lam, dl)
            ahead = _inner(tuple(a + along * b for a, b in zip(s, ds_)), tuple(a + across * b for a, b in zip(lam, dl)))
            mu = max(gap * min(1.0, ahead / count / gap) ** 3, SLACK)
            goal = tuple(mu - a * b for a, b in zip(ds_, dl))
        dx, ds_, dl = _towards(system, goal)
        along, across = _room(s, ds_), _room(lam, dl)
        x = x + along * dx
        s = tuple(a + along * b for a, b in zip(s, ds_))
        lam = tuple(a + across * b for a, b in zip(lam, dl))
        moved, far = float(np.abs(dx).max()), float(np.abs(x - near.at).max())
        bent = far > STRAIGHT and moved < far / 100
        if bent:
            near = linear(x)
        g = limits(x, near.joint + _across(near.turn, x - near.at))
        off = max(float(np.abs(np.where(u, v + t, 0.0)).max(initial=0.0)) for u, v, t in zip(used, g, s))
        progress(min(0.99, (step + 1) / 30))
        if max(float(k.max(initial=0.0)) for k in lam) > ENDLESS or not np.isfinite(moved):
            return start, False
        if moved < DONE and off < DONE and gap < 2 * SLACK and not bent:
            break
    return np.where(loose[:, None], x * unit, start), bool(moved < 10 * DONE)


def _towards(system: _System, goal: Three) -> tuple[Array, Three, Three]:
    """Newton's step to lam s = goal: of x (N, 6), of s and of lam."""
    used, s, lam, rows = system.used, system.s, system.lam, system.rows
    push = tuple(np.where(u, (m + k * q) / t, 0.0) for u, m, k, q, t in zip(used, goal, lam, system.r, s))
    down = system.force.copy()
    down[rows] += _down(system.turn, (push[0][0] - push[0][1])[rows])
    down[:, :3] += push[1][:, :1] * system.p
    down[:, 3:] += push[1][:, 1:] * system.w
    down[1:, :3] += push[2][:, None] * system.d
    down[:-1, :3] -= push[2][:, None] * system.d
    down[~system.loose] = 0.0
    dx = cho_solve_banded((system.factor, False), -down.ravel(), overwrite_b=True).reshape(-1, 6)
    turned = np.zeros_like(dx)
    turned[rows] = _across(system.turn, dx[rows])
    slope = (
        np.stack([turned, -turned]),
        np.column_stack([dot(system.p, dx[:, :3]), dot(system.w, dx[:, 3:])]),
        dot(system.d, np.diff(dx[:, :3], axis=0)),
    )
    ds = tuple(np.where(u, -q - a, 0.0) for u, q, a in zip(used, system.r, slope))
    return dx, ds, tuple(np.where(u, (m - k * a) / t - k, 0.0) for u, m, k, t, a in zip(used, goal, lam, s, ds))


def _down(matrix: Array, rows: Array) -> Array:
    """The transpose of each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,ni->nj", matrix, rows))


def _across(matrix: Array, rows: Array) -> Array:
    """Each matrix (N, 6, 6) times its row (N, 6)."""
    return np.asarray(np.einsum("nij,nj->ni", matrix, rows))


def _ball(along: Array, rows: Array, about: Array) -> Array:
    """Hessian of a ball's limit: along (N,) times a row (N, 3) with itself, and about (N,) in every direction."""
    return np.asarray((along[:, None] * rows)[:, :, None] * rows[:, None, :] + about[:, None, None] * np.eye(3))


def _inner(a: Three, b: Three) -> float:
    return sum(float((v * w).sum()) for v, w in zip(a, b))


def _room(values: tuple[Array, ...], change: tuple[Array, ...]) -> float:
    """The share of a step that keeps values above zero, at most 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shrink = max(float((-b / a).max(initial=0.0, where=a > 0)) for a, b in zip(values, change))
    return min(1.0, BACK / shrink) if shrink > 0 else 1.0


def _banded(smooth: Array, x: Array) -> Array:
    """The smoothness matrix (3, N) times each component, (N, 6)."""
    second, first, diagonal = smooth
    out: Array = diagonal[:, None] * x
    out[1:] += first[1:, None] * x[:-1]
    out[:-1] += first[1:, None] * x[1:]
    out[2:] += second[2:, None] * x[:-2]
    out[:-2] += second[2:, None] * x[2:]
    return out


def _assembled(smooth: Array, block: Array, pair: Array, fixed: BoolArray) -> Array:
    """Upper band of the whole matrix, (13, 6 N); fixed entries stand alone."""
    N = len(block)
    ab = np.zeros((BAND + 1, N, 6))
    for i in range(6):
        for j in range(i, 6):
            ab[BAND - (j - i), :, j] += block[:, i, j]
    for i in range(3):
        for j in range(3):
            ab[BAND - (6 + j - i), 1:, j] += pair[:, i, j]
    ab[BAND] += smooth[2][:, None]
    ab[BAND - 6] += smooth[1][:, None]
    ab[BAND - 12] += smooth[0][:, None]
    band = ab.reshape(BAND + 1, 6 * N)
    for k in range(1, BAND + 1):
        band[BAND - k, k:][fixed[k:] | fixed[:-k]] = 0.0
        band[BAND - k, :k] = 0.0
    band[BAND, fixed] = 1.0
    return np.asarray(band)
