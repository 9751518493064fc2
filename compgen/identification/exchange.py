r"""The choice of measurements by exchange: greedy first, then each against every candidate until no exchange helps.

Measurement i reads y_i = H_i x + e, e ~ N(0, R_i), and takes a covariance S of x to

    S - (H S)' (H S H' + R)^-1 H S

What is gained by one more is the caller's: of the whole determinant (D-optimal) or of the variance of what x does
elsewhere (I-optimal). Exchange ends at the best near where it begins. V. V. Fedorov, Theory of Optimal Experiments
(1972); R. K. Meyer and C. J. Nachtsheim, Technometrics 37 (1995) 60.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array

#: of candidates after a covariance (Q, Q), by their H (K, r, Q) and R (K, r, r): what each gains, (K,)
Gains = Callable[[Array, Array, Array], Array]


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
