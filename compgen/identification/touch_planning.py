r"""Which touches shrink the variance of a path most: an I-optimal choice by greedy steps and exchange.

What drifts is x, known beforehand to a covariance P. Touch i measures y_i = H_i x + e, e ~ N(0, R_i), and the path's
position error at waypoint m moves by C_m x. After some touches

    S = (P^-1 + sum_i H_i^T R_i^-1 H_i)^-1,      V = sum_m w_m tr(C_m S C_m^T) = tr(W S),   W = sum_m w_m C_m^T C_m

V is the mean variance of the path, w_m the share of its length. One more touch lowers it by

    g_i = tr((H_i S H_i^T + R_i)^-1 H_i S W S H_i^T)

Touches are taken one by one by g, then each is exchanged for a better one until none is: from there, and from some
choices at random, since exchange ends at the best near its start. V. V. Fedorov, Theory of Optimal Experiments (1972);
R. K. Meyer and C. J. Nachtsheim, Technometrics 37 (1995) 60.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, own

EXCHANGES = 20  # rounds at most
STARTS = 96  # touches in all random starts: twelve of eight
GAIN = 1e-9  # of V: an exchange that gains less is none


@dataclass(frozen=True, eq=False, slots=True)
class PathDrift:
    """What drifts, Q numbers of it, and what it does to a path."""

    prior: Array  # (Q, Q) covariance P, whole or of rank less
    weight: Array  # (Q, Q) W [m^2]

    def __post_init__(self) -> None:
        own(self, prior=("Q", "Q"), weight=("Q", "Q"))


@dataclass(frozen=True, eq=False, slots=True)
class TouchPlan:
    """n of K candidates, in the order in which they gain most."""

    chosen: IntArray  # (n,)
    variance: Array  # (n + 1,) [m^2] V before the first, and after each
    next_variance: float  # [m^2] V after one more
    covariance: Array  # (Q, Q) S after all


def path_weight(column: Array, length: Array) -> Array:
    """W of columns C (M, 3, Q) of waypoints that each stand for a length (M,)."""
    return np.asarray(np.einsum("m,miq,mir->qr", length / length.sum(), column, column))


def plan_touches(drift: PathDrift, rows: Array, noise: Array, count: int) -> TouchPlan:
    """The touches that leave least variance.

    Args:
        drift: What drifts.
        rows: H of each candidate, (K, r, Q).
        noise: R of each, (K, r, r) [m^2].
        count: How many touches, at most K.
    """
    rng = np.random.default_rng(1)  # the same plan at every run
    starts = [_greedy(drift, rows, noise, count)]
    starts += [rng.choice(len(rows), count, replace=False).tolist() for _ in range(STARTS // count)]
    choices = [_exchanged(drift, rows, noise, start) for start in starts]
    left = [float(np.trace(drift.weight @ covariance_after(drift.prior, rows[c], noise[c]))) for c in choices]
    return _in_order(drift, rows, noise, choices[int(np.argmin(left))])


def _greedy(drift: PathDrift, rows: Array, noise: Array, count: int) -> list[int]:
    """Touches taken one by one, each the one that gains most after those before it."""
    chosen: list[int] = []
    S = drift.prior
    for _ in range(count):
        best = _best(drift.weight, S, rows, noise, chosen)
        chosen.append(best)
        S = _updated(S, rows[best], noise[best])
    return chosen


def _exchanged(drift: PathDrift, rows: Array, noise: Array, start: list[int]) -> list[int]:
    """A choice in which no touch can be exchanged for a better one."""
    chosen, least = list(start), GAIN * np.trace(drift.weight @ drift.prior)
    for _ in range(EXCHANGES):
        changed = False
        for k in range(len(chosen)):
            others = chosen[:k] + chosen[k + 1 :]
            without = covariance_after(drift.prior, rows[others], noise[others])
            best = _best(drift.weight, without, rows, noise, others)
            gains = _gains(drift.weight, without, rows[[best, chosen[k]]], noise[[best, chosen[k]]])
            if gains[0] - gains[1] > least:
                chosen[k], changed = best, True
        if not changed:
            break
    return chosen


def covariance_after(prior: Array, rows: Array, noise: Array) -> Array:
    """S after touches with H (n, r, Q) and R (n, r, r)."""
    H = rows.reshape(-1, prior.shape[0])
    R = np.zeros((len(H), len(H)))
    r = rows.shape[1]
    for n, block in enumerate(noise):
        R[r * n : r * (n + 1), r * n : r * (n + 1)] = block
    return _updated(prior, H, R)


def _in_order(drift: PathDrift, rows: Array, noise: Array, chosen: list[int]) -> TouchPlan:
    """The chosen touches, each the one that gains most after those before it."""
    S, left, order = drift.prior, sorted(chosen), list[int]()
    variance = [float(np.trace(drift.weight @ S))]
    while left:
        k = left.pop(int(np.argmax(_gains(drift.weight, S, rows[left], noise[left]))))
        S = _updated(S, rows[k], noise[k])
        order.append(k)
        variance.append(float(np.trace(drift.weight @ S)))
    gains = _gains(drift.weight, S, rows, noise)
    gains[order] = 0.0
    return TouchPlan(np.array(order, dtype=int), np.array(variance), variance[-1] - float(gains.max(initial=0.0)), S)


def _best(weight: Array, S: Array, rows: Array, noise: Array, taken: list[int]) -> int:
    gains = _gains(weight, S, rows, noise)
    gains[taken] = -np.inf
    return int(np.argmax(gains))


def _gains(weight: Array, S: Array, rows: Array, noise: Array) -> Array:
    """By how much each candidate lowers V, (K,) [m^2]."""
    HS = rows @ S
    innovation = HS @ np.swapaxes(rows, 1, 2) + noise
    lowered = HS @ weight @ np.swapaxes(HS, 1, 2)
    return np.asarray(np.trace(np.linalg.solve(innovation, lowered), axis1=1, axis2=2))


def _updated(S: Array, H: Array, R: Array) -> Array:
    """S after one more touch (Joseph's form would differ by rounding alone)."""
    gain = np.linalg.solve(H @ S @ H.T + R, H @ S)
    after = S - (H @ S).T @ gain
    return np.asarray((after + after.T) / 2)
