r"""Joint motion over arc length between stops: a polynomial through the six nearest waypoints, everywhere at once.

Waypoints closer than the motion bends are more than it needs: of them, those are kept as knots between which no joint
leaves the straight line by more than ``MAX_CHORD``. Derivatives are those of Newton's polynomial through the knots
around, never across a stop; a run of fewer knots has a lower, odd degree, because even ones ring. So has an interval
around which the knots' spacing changes by more than ``UNEVEN`` times: through microns and centimetres polynomials ring.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.robot.robot import Robot

MAX_CHORD = 1e-6  # rad a joint may leave the line between two knots by: about a micrometre of the tool
MAX_KNOT_SPACING = 10e-3  # m, where waypoints allow it
CHUNK = 16384  # points at a time
DEGREES = (5, 3, 1)
AVERAGED = 2  # waypoints to either side over which the bend is averaged
UNEVEN = 20.0  # times the smallest spacing of a polynomial's knots that the largest is at most
KEPT_AT_STOPS = 5  # waypoints to either side of a stop that stay


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class JointCurve:
    """P knots in R runs between stops; the knots at stops are shared by both runs."""

    arc: Array  # (P,) [m]
    knots: Array  # (P, 7) arc [m] and theta [rad]
    rows: IntArray  # (P,) which waypoint each is
    first: IntArray  # (R,) knot at which a run begins
    last: IntArray  # (R,)
    begin: IntArray  # (P - 1,) first knot of the polynomial of each interval
    degree: IntArray  # (P - 1,)

    def interval(self, s: Array, run: IntArray) -> IntArray:
        """The knot before each of rising arc lengths s (M,) [m], each in its run (M,)."""
        return np.asarray(np.clip(last_before(self.arc, s), self.first[run], self.last[run] - 1))

    def interval_before(self, s: Array, run: IntArray) -> IntArray:
        """The same, of two intervals with other degrees that meet there the first."""
        after = self.interval(s, run)
        other = self.degree[np.maximum(after - 1, self.first[run])] != self.degree[after]
        return np.asarray(after - (other & (self.arc[after] >= s)))

    def limit_ratios(self, robot: Robot, s: Array, interval: IntArray) -> Array:
        """Largest over the joints of |q'|, |q''|, |q'''| over speed, acceleration, jerk, and three more, (M, 6).

        The others are |q'| over acceleration, |q'| over jerk and |q''| over jerk.

        Args:
            robot: For the limits.
            s: Arc lengths, (M,) [m].
            interval: The knot before each, (M,).
        """
        ratios = np.empty((len(s), 6))
        for rows in chunks(len(s)):
            ratios[rows] = self._evaluate("limit_ratios", robot, s[rows], interval[rows])
        return ratios

    def utilisation(self, robot: Robot, s: Array, interval: IntArray, rates: Array) -> Array:
        """Shares of the joints' speed, acceleration and jerk limits that a motion uses, (M, 18).

        Args:
            robot: For the limits.
            s: Arc lengths, (M,) [m].
            interval: The knot before each, (M,).
            rates: Speed, acceleration and jerk along the arc there, (M, 3) [m/s, m/s2, m/s3].
        """
        return self._evaluate("utilisation", robot, s, interval, rates)

    def _evaluate(self, name: str, robot: Robot, s: Array, interval: IntArray, *rows: Array) -> Array:
        per_limit = 1 / np.concatenate([robot.speed, robot.acceleration, robot.jerk])[None]
        begin, degree = self.begin[interval], self.degree[interval]

        def of_degree(d: int, points: IntArray | slice) -> Array:
            windows = np.lib.stride_tricks.sliding_window_view(self.knots.ravel(), 7 * (d + 1))[::7]
            nodes = IndexedRows(windows, np.minimum(begin[points], len(windows) - 1))
            return evaluate(build_derivatives(d)[name], s[points, None], nodes, per_limit, *(r[points] for r in rows))[
                0
            ]

        highest = int(degree.max())
        values = of_degree(highest, slice(None))  # all in order; those of lower degree, few as a rule, once more
        for d in [d for d in DEGREES if d < highest]:
            points = np.flatnonzero(degree == d)
            if len(points):
                values[points] = of_degree(d, points)
        return values


def chunks(count: int) -> Iterator[slice]:
    """Slices of a count of rows, each so long that what is computed of it stays in cache."""
    return (slice(start, start + CHUNK) for start in range(0, count, CHUNK))


def last_before(edges: Array, values: Array) -> IntArray:
    """Index of the last of rising edges that each of rising values (M,) has reached, (M,); -1 where none."""
    if len(values) < len(edges):
        return np.searchsorted(edges, values, side="right") - 1
    return np.repeat(np.arange(-1, len(edges)), np.diff(np.searchsorted(values, edges), prepend=0, append=len(values)))


def fit_joint_curve(arc: Array, theta: Array, stop: BoolArray) -> JointCurve:
    """The curve through joint angles theta (N, 6) [rad] at rising arc lengths (N,) [m]; stops (N,) at both ends."""
    rows = _select_knots(arc, theta, stop)
    knots = np.column_stack([arc[rows], theta[rows]])
    ends = np.flatnonzero(stop[rows])
    begin, degree = _windows(np.diff(knots[:, 0]), ends)
    return JointCurve(
        arc=np.ascontiguousarray(knots[:, 0]),
        knots=knots,
        rows=rows,
        first=ends[:-1],
        last=ends[1:],
        begin=begin,
        degree=degree,
    )


def _windows(spacing: Array, ends: IntArray) -> tuple[IntArray, IntArray]:
    """First knot and degree of the polynomial of each interval, (P - 1,), of knots with stops at some of them."""
    run = np.repeat(np.arange(len(ends) - 1), np.diff(ends))
    first, last, interval = ends[:-1][run], ends[1:][run], np.arange(len(spacing))
    begin, degree = interval.copy(), np.ones_like(interval)
    for d in sorted(DEGREES[:-1]):
        start = np.clip(interval - d // 2, first, np.maximum(last - d, first))
        padded = np.append(spacing, np.full(d - 1, spacing[-1]))
        windows = [padded[k : k + len(spacing)] for k in range(d)]
        even = np.maximum.reduce(windows) <= UNEVEN * np.minimum.reduce(windows)
        fits = (last - first >= d) & even[start]
        begin, degree = np.where(fits, start, begin), np.where(fits, d, degree)
    return begin, degree


def _select_knots(arc: Array, theta: Array, stop: BoolArray) -> IntArray:
    """Waypoints to keep: as dense as the bend of the joints asks, every ``MAX_KNOT_SPACING`` at least, and stops."""
    N = len(arc)
    if N < 8:
        return np.arange(N)
    ends = np.flatnonzero(stop)
    density = np.maximum(np.sqrt(joint_bend(arc, theta, ends) / (8 * MAX_CHORD)), 1 / MAX_KNOT_SPACING)
    count = cumulated(density * np.diff(arc))
    knots_passed = np.floor(count[1:] - np.repeat(count[ends[:-1]], np.diff(ends)))  # each run from its own start
    keep = stop.copy()
    keep[1:-1] |= knots_passed[1:] > knots_passed[:-1]
    # near a stop every waypoint is kept, so that short runs stay curves
    for k in range(-KEPT_AT_STOPS, KEPT_AT_STOPS + 1):
        keep[np.clip(ends + k, 0, N - 1)] = True
    return np.flatnonzero(keep)


def joint_bend(arc: Array, theta: Array, ends: IntArray) -> Array:
    """Second derivative of the joints over the arc in each segment, (N - 1,) [rad/m2]: the larger of its two ends'."""
    N = len(arc)
    bend = np.zeros(N)
    triple = [x[k : N - 2 + k] for x in (arc[:, None], theta) for k in range(3)]
    bend[1:-1] = evaluate(_build_bend(), *triple)[0][:, 0]
    # a stop's corner is no bend, and single waypoints' noise is not one either: take the mean of a few
    bend[ends] = 0.0
    total = cumulated(bend)
    width = 2 * AVERAGED + 1
    bend[AVERAGED:-AVERAGED] = (total[width:] - total[:-width]) / width
    for k in range(AVERAGED):
        bend[k] = total[k + AVERAGED + 1] / (k + AVERAGED + 1)
        bend[-1 - k] = (total[-1] - total[-2 - k - AVERAGED]) / (k + AVERAGED + 1)
    return np.maximum(bend[1:], bend[:-1])


@lru_cache(maxsize=1)
def _build_bend() -> Any:
    """(three arc lengths, three times theta (6)) -> largest change of a joint's slope over the arc length."""
    s, q = [ca.SX.sym(f"s{k}") for k in range(3)], [ca.SX.sym(f"q{k}", 6) for k in range(3)]
    slope_change = (q[2] - q[1]) / (s[2] - s[1]) - (q[1] - q[0]) / (s[1] - s[0])
    return ca.Function("bend", [*s, *q], [_largest(slope_change) / ((s[2] - s[0]) / 2)])


@lru_cache(maxsize=4)
def build_derivatives(degree: int) -> dict[str, Any]:
    """``limit_ratios`` and ``utilisation`` at s of the polynomial through degree + 1 knots (7 each)."""
    s, per_limit, rates = ca.SX.sym("s"), ca.SX.sym("per_limit", 18), ca.SX.sym("rates", 3)
    nodes = ca.SX.sym("nodes", 7 * (degree + 1))
    arc = [nodes[7 * k] for k in range(degree + 1)]
    table = [nodes[7 * k + 1 : 7 * k + 7] for k in range(degree + 1)]
    for order in range(1, degree + 1):  # Newton's divided differences, in place
        for k in range(degree, order - 1, -1):
            table[k] = (table[k] - table[k - 1]) * (1 / (arc[k] - arc[k - order]))
    q, q1, q2, q3 = table[degree], ca.SX.zeros(6), ca.SX.zeros(6), ca.SX.zeros(6)
    for k in range(degree - 1, -1, -1):
        t = s - arc[k]
        q3 = q3 * t + 3 * q2
        q2 = q2 * t + 2 * q1
        q1 = q1 * t + q
        q = q * t + table[k]
    speed, acceleration, jerk = per_limit[:6], per_limit[6:12], per_limit[12:]
    ratios = ((q1, speed), (q2, acceleration), (q3, jerk), (q1, acceleration), (q1, jerk), (q2, jerk))
    v, a, j = (rates[k] for k in range(3))
    used = [
        ca.fabs(q1 * v) * speed,
        ca.fabs(q2 * v**2 + q1 * a) * acceleration,
        ca.fabs(q3 * v**3 + 3 * q2 * v * a + q1 * j) * jerk,
    ]
    largest = ca.vertcat(*(_largest(derivative * limit) for derivative, limit in ratios))
    return {
        "limit_ratios": ca.Function("limit_ratios", [s, nodes, per_limit], [largest]),
        "utilisation": ca.Function("utilisation", [s, nodes, per_limit, rates], [ca.vertcat(*used)]),
    }


def _largest(values: Any) -> Any:
    """Largest of the absolute values (6, 1)."""
    largest = ca.fabs(values[0])
    for k in range(1, 6):
        largest = ca.fmax(largest, ca.fabs(values[k]))
    return largest
