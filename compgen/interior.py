r"""Stretches where a limit binds, all at once: a primal-dual interior point on a band of half-width 12.

    minimise   1/2 sum ds [ |W e|^2 + l1 |W c'|^2 + l2 |W c''|^2 ]
    subject to g_i(c) + s_i = 0, s_i >= 0:     theta inside its limits, |c| <= clamp, |c_{n+1} - c_n| <= rate ds

Newton's step on the conditions of the optimum, with the multipliers l_i s_i = mu,

    (H + sum l_i g_i'' + A^T (l / s) A) dc = - f' - A^T ((mu + l r) / s),       A = g',  r = g + s

couples a waypoint's six components with each other, with the position of its neighbours (rate) and with its own
components two waypoints on (smoothness). H is Gauss-Newton's; e, theta and their derivatives in c are CasADi's, taken
anew at every step. Lengths are counted in micrometres, angles in microradians, so that nothing needs scaling. Waypoints
that are not loose stay as they are, so stretches apart from each other are one system.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.linalg import LinAlgError

from compgen.arrays import Array, BoolArray
from compgen.problem import Problem, Settings, bands, measure, weights
from compgen.units import UM

BAND = 12
STEPS = 80
NEAR = 5e-3  # rad from a limit within which a joint is looked after
DONE = 1e-6  # um, of the last step
SLACK = 1e-7  # um^2 of mu at the end: smaller only adds noise
BACK = 0.995  # of the way to where a slack or a multiplier would vanish


@dataclass(frozen=True, eq=False, slots=True)
class _Local:
    """Everything about a correction x (N, 6), in um, that Newton's step needs."""

    force: Array  # (N, 6) gradient of the cost
    block: Array  # (N, 6, 6) its Gauss-Newton Hessian without smoothness
    joint: Array  # (N, 6) [urad] theta - theta at the start of the urad scale
    turn: Array  # (N, 6, 6) d theta / d x


def solve(
    problem: Problem,
    settings: Settings,
    start: Array,
    loose: BoolArray,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Array, bool]:
    """Best legal correction of the loose waypoints (N,), the others as they are (N, 6); and whether it converged."""
    N = len(loose)
    robot = problem.robot
    unit = np.array([UM, UM, UM, *3 * [UM / settings.lever]])
    h, ds = np.maximum(np.diff(problem.arc), 1e-12), measure(problem.arc)
    share = 1 / float(ds[loose].mean())
    smooth = bands(problem.arc, problem.stop, settings, 0.0) * share
    weight = (weights(settings) / UM) ** 2

    from scipy.linalg import solveh_banded  # here: where no limit binds a job starts without scipy

    def look(x: Array) -> _Local:
        e, E, theta, G = problem.linear(x * unit)
        E, G = E * unit, G * unit / UM
        pull = weight * (share * ds)[:, None] * e
        block = np.matmul(np.swapaxes(E, 1, 2), (weight * (share * ds)[:, None])[:, :, None] * E)
        force = np.matmul(np.swapaxes(E, 1, 2), pull[:, :, None])[:, :, 0] + _banded(smooth, x)
        return _Local(force, block, theta / UM, G)

    x = start / unit
    local = look(x)
    low, high = robot.lower / UM, robot.upper / UM
    guarded = loose[:, None] & np.stack([local.joint > high - NEAR / UM, local.joint < low + NEAR / UM])  # (2, N, 6)
    size = np.array([settings.clamp_position, settings.clamp_rotation * settings.lever]) / UM
    reach = settings.rate * h / UM
    moving = loose[1:] | loose[:-1]

    def limits(x: Array, joint: Array) -> tuple[Array, Array, Array]:
        """g of joints (2, N, 6), clamps (N, 2) and rate (N - 1,) [um]."""
        p, w = x[:, :3], x[:, 3:]
        over = np.column_stack([(p * p).sum(axis=1), (w * w).sum(axis=1)])
        d = np.diff(p, axis=0)
        return (
            np.stack([joint - high, low - joint]),
            (over - size**2) / (2 * size),
            ((d * d).sum(axis=1) - reach**2) / (2 * reach),
        )

    used = (guarded, np.repeat(loose[:, None], 2, axis=1), moving)
    g = limits(x, local.joint)
    s = tuple(np.where(u, np.maximum(-v, 1.0), 1.0) for u, v in zip(used, g))
    lam = tuple(np.where(u, 1.0 / v, 0.0) for u, v in zip(used, s))
    count = max(1, sum(int(u.sum()) for u in used))
    fixed = np.repeat(~loose, 6)
    moved = np.inf
    for step in range(STEPS):
        gap = sum(float((a * b).sum()) for a, b in zip(s, lam)) / count
        mu = max(0.1 * gap, SLACK) if step else gap
        r = tuple(np.where(u, v + t, 0.0) for u, v, t in zip(used, g, s))
        push = tuple(np.where(u, (mu + k * q) / t, 0.0) for u, k, q, t in zip(used, lam, r, s))
        stiff = tuple(k / t for k, t in zip(lam, s))
        p, w, d = x[:, :3] / size[0], x[:, 3:] / size[1], np.diff(x[:, :3], axis=0) / reach[:, None]

        A = local.turn
        block = local.block + np.matmul(np.swapaxes(A, 1, 2), (stiff[0].sum(axis=0))[:, :, None] * A)
        ball = np.einsum("n,ni,nj->nij", stiff[1][:, 0], p, p), np.einsum("n,ni,nj->nij", stiff[1][:, 1], w, w)
        eye = np.eye(3)
        block[:, :3, :3] += ball[0] + (lam[1][:, 0] / size[0])[:, None, None] * eye
        block[:, 3:, 3:] += ball[1] + (lam[1][:, 1] / size[1])[:, None, None] * eye
        pair = np.einsum("n,ni,nj->nij", stiff[2], d, d) + (lam[2] / reach)[:, None, None] * eye
        block[:-1, :3, :3] += pair
        block[1:, :3, :3] += pair

        force = local.force + np.matmul(np.swapaxes(A, 1, 2), (push[0][0] - push[0][1])[:, :, None])[:, :, 0]
        force[:, :3] += push[1][:, :1] * p
        force[:, 3:] += push[1][:, 1:] * w
        force[1:, :3] += push[2][:, None] * d
        force[:-1, :3] -= push[2][:, None] * d
        try:
            found = solveh_banded(_assembled(smooth, block, -pair, fixed), np.where(fixed, 0.0, -force.ravel()))
        except (LinAlgError, ValueError):  # multipliers without bound: the limits leave no way
            return start, False
        dx = found.reshape(N, 6)

        turned = np.matmul(A, dx[:, :, None])[:, :, 0]
        slope = (
            np.stack([turned, -turned]),
            np.column_stack([(p * dx[:, :3]).sum(axis=1), (w * dx[:, 3:]).sum(axis=1)]),
            (d * np.diff(dx[:, :3], axis=0)).sum(axis=1),
        )
        ds_ = tuple(np.where(u, -q - a, 0.0) for u, q, a in zip(used, r, slope))
        dl = tuple(np.where(u, mu / t - k - k * a / t, 0.0) for u, k, t, a in zip(used, lam, s, ds_))
        along, across = _room(s, ds_), _room(lam, dl)
        x = x + along * dx
        s = tuple(a + along * b for a, b in zip(s, ds_))
        lam = tuple(a + across * b for a, b in zip(lam, dl))
        local = look(x)
        g = limits(x, local.joint)
        moved = float(np.abs(dx).max())
        off = max(float(np.abs(np.where(u, v + t, 0.0)).max(initial=0.0)) for u, v, t in zip(used, g, s))
        progress(min(0.99, (step + 1) / 30))
        if moved < DONE and off < DONE and gap < 2 * SLACK:
            break
        if not np.isfinite(moved):
            break
    return np.where(loose[:, None], x * unit, start), bool(moved < 10 * DONE)


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
