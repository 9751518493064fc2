r"""How warm each node is.

    tau dr/dt = A - r,    A = A_ref (i + (1 - i) (v / v_ref)^p) moving at v, A_ref i idle, 0 off

A_ref is such that the reference ends at its rise. p and tau are fitted to what the study quotes (``study.QUOTED``) by
Gauss and Newton, with tau held weakly near that of the whole robot's cooling; the flange's face follows the wrist.
Through a program of speeds v_k from t_k to t_{k+1}

    r(t_n) = exp(-t_n / tau) (r_0 + sum_{k < n} A(v_k) (exp(t_{k+1} / tau) - exp(t_k / tau)))
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from audit import study

FITTED = study.NODES[:4]
ROUNDS = 30
STEP = 1e-6  # of the differences that slopes are made of


@dataclass(frozen=True)
class Heat:
    """The heat law of K nodes."""

    tau: np.ndarray  # (K,) [s]
    exponent: np.ndarray  # (K,)
    reference: tuple[float, ...] = tuple(study.REFERENCE_RISE_K[n] for n in study.NODES)  # (K,) [K] rises at its end

    def steady(self, state, feed_mm_s):
        """A, what feeds (M,) would end in, (M, K) [K]."""
        reference = np.array(self.reference) / (1 - np.exp(-study.REFERENCE_S / self.tau))
        moving = (np.asarray(feed_mm_s)[:, None] / study.REFERENCE_FEED_MM_S) ** self.exponent
        share = {"moving": study.IDLE + (1 - study.IDLE) * moving, "idle": study.IDLE + 0 * moving, "off": 0 * moving}
        return reference * share[state]

    def after(self, duties):
        """Rises after (state, feed [mm/s], share of the time in motion, [s]) in turn from cold, (K,) [K]."""
        rise = np.zeros(len(self.tau))
        for state, feed, share, seconds in duties:
            steady = self.steady(state, [feed])[0]
            if state == "moving":
                steady = share * steady + (1 - share) * self.steady("idle", [feed])[0]
            rise = steady + (rise - steady) * np.exp(-seconds / self.tau)
        return rise

    def along(self, rise, time, speed_mm_s):
        """Rises at N moments of a program that starts at rises (K,) and drives at N - 1 speeds, (N, K) [K]."""
        growing = np.exp(time[:, None] / self.tau)
        gained = np.cumsum(self.steady("moving", speed_mm_s) * np.diff(growing, axis=0), axis=0)
        return (rise + np.vstack([np.zeros(len(rise)), gained])) / growing


def rounded(law):
    """The heat law with what a robot file's digits may leave of its parameters: tau by 0.005 h, and p by 0.0005."""
    return Heat(law.tau + 0.005 * 3600, law.exponent), Heat(law.tau, law.exponent + 0.0005)


@cache
def fitted():
    """The heat law of what the study quotes."""
    x = np.concatenate([np.full(len(FITTED), np.log(study.COOLING_H)), np.full(len(FITTED), 0.5)])
    for _ in range(ROUNDS):
        miss = _misses(x)
        slope = np.column_stack(
            [(_misses(x + step) - _misses(x - step)) / (2 * STEP) for step in STEP * np.eye(len(x))]
        )
        x = x - np.linalg.lstsq(slope, miss, rcond=None)[0]
    return _heat(x)


def _heat(x):
    """Log of tau [h] and exponents of the fitted nodes as a heat law."""
    follows = [*range(len(FITTED)), FITTED.index("wrist")]
    return Heat(np.exp(x[follows]) * 3600, x[len(FITTED) :][follows])


def _misses(x):
    """Model less quoted [K], and how far tau is from the whole robot's as if it were a temperature."""
    heat, rows = _heat(x), []
    reference = ("moving", study.REFERENCE_FEED_MM_S, 1.0, study.REFERENCE_S)
    for node, feed, hours, rise in study.QUOTED:
        duties = [("moving", feed, 1.0, hours * 3600)] if feed else [reference, ("off", 0.0, 1.0, hours * 3600)]
        rows.append(heat.after(duties)[study.NODES.index(node)] - rise)
    prior = (x[: len(FITTED)] - np.log(study.COOLING_H)) / study.COOLING_WIDTH * study.SENSOR_K
    return np.concatenate([rows, prior])
