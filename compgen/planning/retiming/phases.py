r"""Motion along the arc as stretches of constant jerk, and the time at which an arc length is passed.

s = s0 + v0 t + a0 t^2/2 + j t^3/6,      v = v0 + a0 t + j t^2/2,      a = a0 + j t
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, owns
from compgen.planning import joint_curve

ROUNDS = 60  # of a root's search


class ArcMotion(NamedTuple):
    """Motion along the arc at M moments."""

    s: Array  # (M,) [m]
    v: Array  # (M,) [m/s]
    a: Array  # (M,) [m/s2]
    j: Array  # (M,) [m/s3]


class Passage(NamedTuple):
    """When M places of the path are passed."""

    phase: IntArray  # (M,) the phase in which it is
    since: Array  # (M,) [s] after the phase's start

    def at(self, rows: slice | IntArray) -> "Passage":
        """Of some of the places."""
        return Passage(self.phase[rows], self.since[rows])


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(**dict.fromkeys(("start", "duration", "s0", "v0", "a0", "j", "block"), ("P",)))
class Phases:
    """Stretches of constant jerk along the arc, in order."""

    start: Array  # (P,) [s]
    duration: Array  # (P,) [s]
    s0: Array  # (P,) [m]
    v0: Array  # (P,) [m/s]
    a0: Array  # (P,) [m/s2]
    j: Array  # (P,) [m/s3]
    block: IntArray  # (P,) which block of the path each is of

    @property
    def end(self) -> float:
        """When the last one is over [s]."""
        return float(self.start[-1] + self.duration[-1])

    def at(self, time: Array) -> ArcMotion:
        """The motion at times (M,) [s]; outside the motion that of the nearest end."""
        k = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, len(self.start) - 1)
        return self.motion(Passage(k, np.clip(time - self.start[k], 0, self.duration[k])))

    def motion(self, passage: Passage) -> ArcMotion:
        """The motion at some places."""
        k, t = passage
        v0, a0, j = self.v0[k], self.a0[k], self.j[k]
        return ArcMotion(self.s0[k] + t * (v0 + t * (a0 / 2 + t * j / 6)), v0 + t * (a0 + t * j / 2), a0 + t * j, j)

    def time(self, passage: Passage) -> Array:
        """When some places are passed, (M,) [s]."""
        return np.asarray(self.start[passage.phase] + passage.since)

    def locate(self, s: Array) -> Passage:
        """The phase in which rising arc lengths (M,) [m] are passed, and the time after its start."""
        k = np.maximum(joint_curve.last_before(np.maximum.accumulate(self.s0), s), 0)
        cruise = (self.a0 == 0) & (self.j == 0) & (self.v0 > 0)
        t = (s - self.s0[k]) / np.where(cruise, self.v0, 1.0)[k]
        rest = np.flatnonzero(~cruise[k])
        t[rest] = self._time_in_phase(k[rest], (s - self.s0[k])[rest])
        return Passage(k, t)

    def _time_in_phase(self, k: IntArray, distance: Array) -> Array:
        """Time after the start of phases k (M,) at which a distance from there is reached, (M,) [m] to (M,) [s]."""
        v0, a0, j, end = self.v0[k], self.a0[k], self.j[k], self.duration[k]
        whole = end * (v0 + end * (a0 / 2 + end * j / 6))
        share = np.clip(distance / whole, 0, 1)
        # from rest the cubic's own root is the guess, to rest the same counted from the end
        from_rest, to_rest = (v0 == 0) & (a0 == 0), np.abs(a0 + j * end) <= 1e-9 * np.abs(a0)
        guess = np.where(from_rest, np.cbrt(share), np.where(to_rest, 1 - np.cbrt(1 - share), share)) * end

        def excess(t: Array) -> tuple[Array, Array]:
            return t * (v0 + t * (a0 / 2 + t * j / 6)) - distance, v0 + t * (a0 + t * j / 2)

        t = rising_root(excess, np.zeros(len(k)), end, guess)
        return np.where(distance <= 0, 0.0, np.where(distance >= whole, end, t))


def rising_root(f: Callable[[Array], tuple[Array, Array]], low: Array, high: Array, guess: Array) -> Array:
    """Roots of rising functions between bounds, (K,): Newton's steps, halving the bounds where they lead outside.

    Args:
        f: Value and slope at (K,).
        low: Where no value is above zero, (K,).
        high: Where none is below, (K,).
        guess: Where to begin, (K,).
    """
    x = guess
    for _ in range(ROUNDS):
        value, slope = f(x)
        low, high = np.where(value < 0, x, low), np.where(value < 0, high, x)
        with np.errstate(divide="ignore", invalid="ignore"):
            new = x - value / slope
        new = np.where((new >= low) & (new <= high), new, (low + high) / 2)
        converged = np.abs(new - x) <= 1e-15 * high
        x = new
        if converged.all():
            break
    return x
