r"""Joint motion over arc length between stops: a polynomial through the six nearest waypoints, everywhere at once.

Waypoints closer than the motion bends are more than it needs: of them, those are kept as knots between which no joint
leaves the straight line by more than ``FINE``. Derivatives are those of Newton's polynomial through the knots around,
never across a stop; a run of fewer knots has a lower, odd degree, because even ones ring.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array, BoolArray, IntArray
from compgen.evaluation import Picked, evaluate
from compgen.robot import Robot

FINE = 1e-6  # rad a joint may leave the line between two knots by: about a micrometre of the tool
WIDEST = 10e-3  # m between two knots, where waypoints allow it
CHUNK = 65536  # points at a time
DEGREES = (5, 3, 1)


@dataclass(frozen=True, eq=False, slots=True)
class JointCurve:
    """P knots in R runs between stops; the knots at stops are shared by both runs."""

    arc: Array  # (P,) [m]
    knots: Array  # (P, 7) arc [m] and theta [rad]
    first: IntArray  # (R,) knot at which a run begins
    last: IntArray  # (R,)

    def interval(self, s: Array, run: IntArray) -> IntArray:
        """The knot before each place of a run, (M,)."""
        found = np.searchsorted(self.arc, s, side="right") - 1
        return np.clip(found, self.first[run], self.last[run] - 1)

    def shares(self, robot: Robot, s: Array, interval: IntArray, run: IntArray) -> Array:
        """Largest over the joints of |q'|, |q''|, |q'''| over speed, acceleration, jerk, and three more, (M, 6).

        The others are |q'| over acceleration, |q'| over jerk and |q''| over jerk.
        """
        limits = np.concatenate([robot.speed, robot.acceleration, robot.jerk])[None]
        return self._ask("shares", s, interval, run, limits)

    def use(self, robot: Robot, s: Array, interval: IntArray, run: IntArray, rates: Array) -> Array:
        """Largest share of each joint's limits at places driven with (speed, acceleration, jerk) (M, 3), (3, 6)."""
        limits = np.concatenate([robot.speed, robot.acceleration, robot.jerk])[None]
        found = np.zeros(18)
        for at in range(0, len(s), CHUNK):
            rows = slice(at, at + CHUNK)
            found = np.maximum(
                found, self._ask("use", s[rows], interval[rows], run[rows], limits, rates[rows]).max(axis=0, initial=0)
            )
        return found.reshape(3, 6)

    def _ask(self, name: str, s: Array, interval: IntArray, run: IntArray, *rows: Array) -> Array:
        size = (self.last - self.first)[run]
        out = np.empty((len(s), 6 if name == "shares" else 18))
        above = None
        for degree in DEGREES:
            here = size >= degree if above is None else (size >= degree) & (size < above)
            above = degree
            at = np.flatnonzero(here)
            if not len(at):
                continue
            begin = np.clip(interval[at] - degree // 2, self.first[run[at]], self.last[run[at]] - degree)
            nodes = [Picked(self.knots, begin + k) for k in range(degree + 1)]
            more = [r if len(r) == 1 else r[at] for r in rows]
            out[at] = evaluate(build_derivatives(degree)[name], s[at, None], *nodes, *more)[0]
        return out


def curve(arc: Array, theta: Array, stop: BoolArray) -> JointCurve:
    """The knots of joint angles theta (N, 6) [rad] at rising arc lengths (N,) [m], with stops (N,) at both ends."""
    keep = _knots(arc, theta, stop)
    knots = np.column_stack([arc[keep], theta[keep]])
    ends = np.flatnonzero(stop[keep])
    return JointCurve(np.ascontiguousarray(knots[:, 0]), knots, ends[:-1], ends[1:])


def _knots(arc: Array, theta: Array, stop: BoolArray) -> IntArray:
    """Waypoints to keep: as dense as the bend of the joints asks, at least every ``WIDEST``, and both ends' own."""
    h = np.diff(arc)
    if len(arc) < 8:
        return np.arange(len(arc))
    slope = np.diff(theta, axis=0) / h[:, None]
    bend = np.abs(np.diff(slope, axis=0)).max(axis=1) / ((h[1:] + h[:-1]) / 2)
    # a stop's corner is no bend, and single waypoints' noise is not one either: look at the mean of a few
    bend[stop[1:-1]] = 0.0
    bend = np.concatenate([[0.0], bend, [0.0]])
    around = np.concatenate([[0.0], np.cumsum(bend)])
    low, high = np.maximum(np.arange(len(bend)) - 2, 0), np.minimum(np.arange(len(bend)) + 3, len(bend))
    bend = (around[high] - around[low]) / (high - low)
    density = np.maximum(np.sqrt(np.maximum(bend[1:], bend[:-1]) / (8 * FINE)), 1 / WIDEST)
    run = np.cumsum(stop)[:-1]
    count = np.concatenate([[0.0], np.cumsum(density * h)])
    begun = count[np.flatnonzero(stop)][run - 1]  # every run counts from its own start
    done = np.floor(count[1:] - begun)
    step = np.concatenate([[True], (done[1:] > done[:-1]) | (run[1:] != run[:-1])])
    keep = np.append(step, False) | stop
    # within three of a stop everything is kept, so that short runs stay curves
    near = np.flatnonzero(stop)
    for k in (-5, -4, -3, -2, -1, 1, 2, 3, 4, 5):
        keep[np.clip(near + k, 0, len(keep) - 1)] = True
    return np.flatnonzero(keep)


@lru_cache(maxsize=4)
def build_derivatives(degree: int) -> dict[str, Any]:
    """Of the polynomial through degree + 1 knots (7 each) at s: what ``shares`` and ``use`` say."""
    s, limits, rates = ca.SX.sym("s"), ca.SX.sym("limits", 18), ca.SX.sym("rates", 3)
    nodes = [ca.SX.sym(f"node{k}", 7) for k in range(degree + 1)]
    place = [n[0] for n in nodes]
    table = [n[1:] for n in nodes]
    for order in range(1, degree + 1):  # Newton's divided differences, in place
        for k in range(degree, order - 1, -1):
            table[k] = (table[k] - table[k - 1]) / (place[k] - place[k - order])
    q, q1, q2, q3 = table[degree], ca.SX.zeros(6), ca.SX.zeros(6), ca.SX.zeros(6)
    for k in range(degree - 1, -1, -1):
        t = s - place[k]
        q3 = q3 * t + 3 * q2
        q2 = q2 * t + 2 * q1
        q1 = q1 * t + q
        q = q * t + table[k]
    speed, acceleration, jerk = limits[:6], limits[6:12], limits[12:]

    def largest(values: Any) -> Any:
        found = ca.fabs(values[0])
        for k in range(1, 6):
            found = ca.fmax(found, ca.fabs(values[k]))
        return found

    parts = ((q1, speed), (q2, acceleration), (q3, jerk), (q1, acceleration), (q1, jerk), (q2, jerk))
    v, a, j = (rates[k] for k in range(3))
    driven = [
        ca.fabs(q1 * v) / speed,
        ca.fabs(q2 * v**2 + q1 * a) / acceleration,
        ca.fabs(q3 * v**3 + 3 * q2 * v * a + q1 * j) / jerk,
    ]
    return {
        "shares": ca.Function("shares", [s, *nodes, limits], [ca.vertcat(*(largest(x / m) for x, m in parts))]),
        "use": ca.Function("use", [s, *nodes, limits, rates], [ca.vertcat(*driven)]),
    }
