r"""When a smoothed motion passes what was commanded: from stop to stop, without a sample of it.

A run of statements that last C together is commanded from 0 to C and has settled at D = C + S, S the settling. With w
the smoothing's weights, the time of its statements that is done at t, and the speed as a share of the words, are

    c(t) = F(t) - F(t - C),   F(t) = int_0^t (t - u) w(u) du,      dc/dt = G(t) - G(t - C),   G = F'

so it goes at its words from S to C, and there comes late by the mean of w. That is of the way where its words are
alike, and nearly so where they change.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.robot.motion import ControllerMotion
from compgen.verification.twin.controller.smoothing import moments, smooth

PARTS = 4000  # of the settling, where F and G are known
HALVINGS = 50  # of the time in which a position is passed


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(way=("K",), rate=("K",))
class Settling:
    """F and G of a smoothing from 0 to the end of its settling."""

    time: float  # [s] S
    delay: float  # [s] mean of the weights
    way: Array  # (K,) [s] F
    rate: Array  # (K,) G

    def done(self, time: Array, commanded: Array) -> Array:
        """c (M,) [s] at times (M,) [s] since runs began whose statements last (M,) [s]."""
        return self._way(time) - self._way(time - commanded)

    def speed(self, time: Array, commanded: Array) -> Array:
        """dc/dt there, (M,)."""
        at = np.linspace(0.0, self.time, len(self.rate))
        return np.asarray(np.interp(time, at, self.rate) - np.interp(time - commanded, at, self.rate))

    def passed(self, share: Array, commanded: Array) -> Array:
        """When shares c (M,) [s] of runs' statements are done, (M,) [s] since each run began."""
        time = share + self.delay
        near = np.flatnonzero((time < self.time) | (time > commanded))
        c, whole = share[near], commanded[near]
        low, high = np.zeros(len(near)), whole + self.time
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            before = self.done(middle, whole) < c
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        time[near] = np.where(c >= whole, whole + self.time, high)
        return np.asarray(time)

    def _way(self, time: Array) -> Array:
        at = np.linspace(0.0, self.time, len(self.way))
        return np.interp(time, at, self.way) + np.maximum(time - self.time, 0.0)


def settling_of(motion: ControllerMotion) -> Settling:
    """Of a motion that smooths: what it makes of a ramp, and of a step."""
    end = motion.settling
    time = np.linspace(0.0, end, PARTS + 1)
    way = smooth(time[:, None], end / PARTS, motion)[:, 0]
    rate = np.gradient(way, time)
    rate[[0, -1]] = 0.0, 1.0
    return Settling(time=end, delay=moments(motion).delay, way=way, rate=rate)
