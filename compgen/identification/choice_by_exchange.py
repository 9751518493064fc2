r"""The choice of measurements by exchange: greedy first, then each against every candidate until no exchange helps.

Measurement i reads y_i = H_i x + e, e ~ N(0, R_i), and takes a covariance S of x to

    S - (H S)' (H S H' + R)^-1 H S

What is gained by one more is the caller's: of the whole determinant (D-optimal) or of the variance of what x does
elsewhere (I-optimal). Exchange ends at the best near where it begins. V. V. Fedorov, Theory of Optimal Experiments
(1972); R. K. Meyer and C. J. Nachtsheim, Technometrics 37 (1995) 60.

Touches that shrink the variance of a path most are an I-optimal choice. What drifts is x, known beforehand to a
covariance P. Touch i measures y_i = H_i x + e, e ~ N(0, R_i), and the path's position error at waypoint m moves by C_m
x. After some touches

    S = (P^-1 + sum_i H_i^T R_i^-1 H_i)^-1,      V = sum_m w_m tr(C_m S C_m^T) = tr(W S),   W = sum_m w_m C_m^T C_m

V is the mean variance of the path, w_m the share of its length. One more touch lowers it by

    g_i = tr((H_i S H_i^T + R_i)^-1 H_i S W S H_i^T)

Touches are taken one by one by g, then each is exchanged for a better one until none is: from there, and from some
choices at random, since exchange ends at the best near its start.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, owns

#: of candidates after a covariance (Q, Q), by their H (K, r, Q) and R (K, r, r): what each gains, (K,)
Gains = Callable[[Array, Array, Array], Array]
EXCHANGES = 20  # rounds at most
STARTS = 96  # touches in all random starts: twelve of eight
GAIN = 1e-9  # of V: an exchange that gains less is none


@dataclass(frozen=True, eq=False, slots=True)
class Choice:
    """K candidates, and what is gained by them."""

    prior: Array  # (Q, Q) covariance before any, whole or of rank less
    rows: Array  # (K, r, Q) H
    noise: Array  # (K, r, r) R
    gains: Gains

    def after(self, chosen: Sequence[int]) -> Array:
        """The covariance after some candidates, (Q, Q)."""
        S = self.prior
        for k in chosen:
            S = with_one_more(S, self.rows[k], self.noise[k])
        return S

    def gains_of(self, S: Array, candidates: Sequence[int] | slice = slice(None)) -> Array:
        """What each of some candidates gains after a covariance."""
        return self.gains(S, self.rows[candidates], self.noise[candidates])

    def best(self, S: Array, taken: Sequence[int]) -> int:
        """The candidate that gains most, of those that are not taken."""
        gains = self.gains_of(S)
        gains[list(taken)] = -np.inf
        return int(np.argmax(gains))

    def greedy(self, count: int) -> list[int]:
        """Candidates taken one by one, each the one that gains most after those before it."""
        chosen, S = list[int](), self.prior
        for _ in range(count):
            chosen.append(self.best(S, chosen))
            S = with_one_more(S, self.rows[chosen[-1]], self.noise[chosen[-1]])
        return chosen

    def exchanged(self, start: Sequence[int], rounds: int, least: float) -> list[int]:
        """A choice after some rounds of exchange at most; an exchange that gains ``least`` or less is none."""
        chosen = list(start)
        for _ in range(rounds):
            before, S = list(chosen), self.after(chosen)
            for k, old in enumerate(before):
                without = with_one_more(S, self.rows[old], -self.noise[old])
                best = self.best(without, chosen[:k] + chosen[k + 1 :])
                gain, old_gain = self.gains_of(without, [best, old])
                if best != old and gain - old_gain > least:
                    chosen[k], S = best, with_one_more(without, self.rows[best], self.noise[best])
            if chosen == before:
                break
        return chosen


def with_one_more(S: Array, H: Array, R: Array) -> Array:
    """S after one more measurement (Joseph's form would differ by rounding alone); with -R: without it."""
    after = S - (H @ S).T @ np.linalg.solve(H @ S @ H.T + R, H @ S)
    return np.asarray((after + after.T) / 2)


@dataclass(frozen=True, eq=False, slots=True)
@owns(prior=("Q", "Q"), weight=("Q", "Q"))
class PathDrift:
    """What drifts, Q numbers of it, and what it does to a path."""

    prior: Array  # (Q, Q) covariance P, whole or of rank less
    weight: Array  # (Q, Q) W [m^2]

    def variance(self, S: Array) -> float:
        """V after touches that leave the covariance S [m^2]."""
        return float(np.trace(self.weight @ S))

    def gains(self, S: Array, rows: Array, noise: Array) -> Array:
        """By how much each of K touches lowers V, (K,) [m^2]."""
        HS = rows @ S
        innovation = HS @ np.swapaxes(rows, 1, 2) + noise
        lowered = HS @ self.weight @ np.swapaxes(HS, 1, 2)
        return np.asarray(np.trace(np.linalg.solve(innovation, lowered), axis1=1, axis2=2))


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
    choice = Choice(drift.prior, rows, noise, drift.gains)
    starts = [choice.greedy(count)]
    starts += [rng.choice(len(rows), count, replace=False).tolist() for _ in range(STARTS // count)]
    choices = [choice.exchanged(start, EXCHANGES, GAIN * drift.variance(drift.prior)) for start in starts]
    left = [drift.variance(choice.after(chosen)) for chosen in choices]
    return _in_order(drift, choice, choices[int(np.argmin(left))])


def _in_order(drift: PathDrift, choice: Choice, chosen: list[int]) -> TouchPlan:
    """The chosen touches, each the one that gains most after those before it."""
    left, order = sorted(chosen), list[int]()
    variance = [drift.variance(drift.prior)]
    while left:
        order.append(left.pop(int(np.argmax(choice.gains_of(choice.after(order), left)))))
        variance.append(drift.variance(choice.after(order)))
    S = choice.after(order)
    gains = choice.gains_of(S)
    gains[order] = 0.0
    return TouchPlan(np.array(order, dtype=int), np.array(variance), variance[-1] - float(gains.max(initial=0.0)), S)
