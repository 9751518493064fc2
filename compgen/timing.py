r"""When the robot is where: jerk-limited motion along the path, exactly on it.

One degree of freedom, the arc length s. With q(s) the joint motion,

    qd = q' sd        qdd = q'' sd^2 + q' sdd        qddd = q''' sd^3 + 3 q'' sd sdd + q' sddd

The way between two stops is cut into blocks. Each block gets a speed V (the feed, or less where the joints or the
controller's interpolation period demand it) and from what V leaves of each joint's limits an acceleration and a jerk.
Speeds at the block edges are found by one pass forwards and one back; ruckig then joins them, state to state.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

import numpy as np
from ruckig import InputParameter, Result, Ruckig
from ruckig import Trajectory as RuckigTrajectory
from scipy.interpolate import BSpline, make_interp_spline

from compgen.arrays import Array, BoolArray, IntArray, own
from compgen.exceptions import ImpossibleError
from compgen.robot import Robot

BLOCK = 20e-3  # m
MARGIN = 0.98  # of each limit, for what the samples between waypoints do not see
CRUISE_ACCELERATION = 0.8  # share of a joint's acceleration that constant speed may use
CRUISE_JERK = 0.6
CHANGE_JERK = 0.5  # share of the remaining jerk for 3 q'' sd sdd; the rest is for q' sddd
SPEED_STEP = 1e-3  # m/s, a reduced speed is a whole number of mm/s where it can be
SLOWEST = 0.05e-3  # m/s, about the slowest speed that a program can say


@dataclass(frozen=True, eq=False, slots=True)
class Phases:
    """Stretches of constant jerk along the arc, in order: s = s0 + v0 t + a0 t^2/2 + j t^3/6."""

    start: Array  # (P,) [s]
    duration: Array  # (P,) [s]
    s0: Array  # (P,) [m]
    v0: Array  # (P,) [m/s]
    a0: Array  # (P,) [m/s2]
    j: Array  # (P,) [m/s3]

    def __post_init__(self) -> None:
        own(self, **{name: ("P",) for name in Phases.__slots__})

    def at(self, time: Array) -> tuple[Array, Array, Array, Array]:
        """s, sd, sdd, sddd at times, (M,) each; outside the motion the nearest end."""
        k = np.clip(np.searchsorted(self.start, time, side="right") - 1, 0, len(self.start) - 1)
        t = np.clip(time - self.start[k], 0, self.duration[k])
        v0, a0, j = self.v0[k], self.a0[k], self.j[k]
        return (
            self.s0[k] + t * (v0 + t * (a0 / 2 + t * j / 6)),
            v0 + t * (a0 + t * j / 2),
            a0 + t * j,
            j,
        )

    def time_at(self, s: Array) -> Array:
        """When arc lengths are passed, (M,) [s]; s rises along the path."""
        k = np.clip(np.searchsorted(self.s0, s, side="right") - 1, 0, len(self.s0) - 1)
        v0, a0, j, gap = self.v0[k], self.a0[k], self.j[k], s - self.s0[k]
        cruise = (a0 == 0) & (j == 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(cruise, gap / v0, 0.0)
        t = np.where(np.isfinite(t), t, 0.0)
        rest = np.flatnonzero(~cruise)
        v0, a0, j, gap = v0[rest], a0[rest], j[rest], gap[rest]
        low, high = np.zeros(len(rest)), self.duration[k[rest]].copy()
        for _ in range(52):  # bisection: speed may be zero at either end
            middle = (low + high) / 2
            short = middle * (v0 + middle * (a0 / 2 + middle * j / 6)) < gap
            low, high = np.where(short, middle, low), np.where(short, high, middle)
        t[rest] = (low + high) / 2
        return np.asarray(self.start[k] + t)


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """Joint motion along a path, with the speeds its program must name."""

    time: Array  # (N,) [s] at each waypoint, 0 at the first
    speed: Array  # (N - 1,) [m/s] programmed for each segment
    driven: Array  # (N - 1,) [m/s] the same slowed by what the stops at both ends of its run cost: what warms the robot
    phases: Phases
    use: Array  # (3, 6) largest share of each joint's speed, acceleration and jerk limit
    at_feed: float  # share of the path length driven at feed

    def __post_init__(self) -> None:
        own(self, time=("N",), speed=("S",), driven=("S",), use=(3, 6))


def driven_speed(time: Array, length: Array, speed: Array, stop: BoolArray) -> Array:
    """Programmed speeds slowed so that each run between two stops takes its time, (N - 1,) [m/s].

    Heat answers to how fast the robot really goes; near a stop the program's speed says little of that.
    """
    ends = np.flatnonzero(stop)
    said = np.add.reduceat(length / speed, ends[:-1])
    return np.asarray(speed * np.repeat(said / np.diff(time[ends]), np.diff(ends)))


@dataclass(frozen=True, eq=False, slots=True)
class _Run:
    """Joint motion over arc length between two stops."""

    first: int
    last: int
    spline: BSpline

    def derivatives(self, s: Array) -> tuple[Array, Array, Array]:
        """|q'|, |q''|, |q'''|, (M, 6) each."""
        k = self.spline.k
        return tuple(  # type: ignore[return-value]
            np.abs(self.spline(s, n)) if n <= k else np.zeros((len(s), self.spline.c.shape[1])) for n in (1, 2, 3)
        )


def retime(
    robot: Robot,
    arc: Array,
    theta: Array,
    stop: BoolArray,
    feed: float,
    progress: Callable[[float], None] = lambda share: None,
) -> Trajectory:
    """Fastest constant-feed motion within the joint limits, stopping only where the path demands.

    Args:
        robot: Limits on speed, acceleration and jerk of theta; the interpolation period.
        arc: Arc length at the waypoints, (N,) [m], rising.
        theta: Joint angles there, (N, 6) [rad], smooth between stops.
        stop: Where the robot stops, (N,); true at both ends.
        feed: Wanted speed along the path [m/s].
        progress: Called with the share done.

    Returns:
        The motion. Segments shorter than feed x period run at length / period.

    Raises:
        ImpossibleError: No motion exists within the limits (a limit of zero, or a path of coincident waypoints).
    """
    length = np.diff(arc)
    if not np.all(length > 0):
        n = int(np.argmin(length)) + 1
        raise ImpossibleError(f"waypoints {n} and {n + 1} coincide; thin the path")
    if not min(robot.speed.min(), robot.acceleration.min(), robot.jerk.min()) > 0:
        raise ImpossibleError("timing: a joint limit on speed, acceleration or jerk is zero; mend the robot file")
    followable = np.minimum(feed, length / robot.controller.period)
    runs = [_run(arc, theta, i, j) for i, j in _between(stop)]
    rows: list[tuple[float, ...]] = []
    ramps: list[BoolArray] = []
    speed = np.empty(len(length))
    use = np.zeros((3, 6))
    for count, run in enumerate(runs):
        edges, V, A, J = _blocks(robot, arc, run, followable, feed)
        v = _edge_speeds(np.diff(edges), V, A, J)
        for b in range(len(V)):
            rows += _join(edges[b], edges[b + 1] - edges[b], v[b], v[b + 1], V[b], A[b], J[b])
        middle = (arc[run.first : run.last] + arc[run.first + 1 : run.last + 1]) / 2
        owner = np.clip(np.searchsorted(edges, middle, side="right") - 1, 0, len(V) - 1)
        speed[run.first : run.last] = V[owner]
        ramps.append(_stop_ramps(v, V)[owner])
        progress((count + 1) / len(runs))
    table = np.array(rows)
    start = np.concatenate([[0.0], np.cumsum(table[:, 0])])
    phases = Phases(start[:-1], *table.T)
    for run in runs:
        use = np.maximum(use, _use(robot, arc, run, phases))
    time = phases.time_at(arc)
    time[0], time[-1] = 0.0, start[-1]
    # away from the stops' own ramps the program says what is driven, so that its time is the planned one
    real = np.minimum(speed, length / np.diff(time))
    real = np.where(real > speed * (1 - 1e-3), speed, real)
    speed = np.where(np.concatenate(ramps), speed, real)
    cruise = (phases.j == 0) & (phases.a0 == 0) & (phases.v0 >= feed * (1 - 1e-9))
    at_feed = float((phases.v0 * phases.duration)[cruise].sum() / (arc[-1] - arc[0]))
    return Trajectory(time, speed, driven_speed(time, length, speed, stop), phases, use, at_feed)


def _between(stop: BoolArray) -> list[tuple[int, int]]:
    where = np.flatnonzero(stop)
    return list(zip(where[:-1].tolist(), where[1:].tolist()))


def _run(arc: Array, theta: Array, first: int, last: int) -> _Run:
    degree = min(5, last - first)
    degree -= 1 - degree % 2  # odd degrees only: even ones ring
    return _Run(first, last, make_interp_spline(arc[first : last + 1], theta[first : last + 1], k=degree))


def _blocks(robot: Robot, arc: Array, run: _Run, followable: Array, feed: float) -> tuple[Array, Array, Array, Array]:
    """Block edges (B + 1,) and the speed, acceleration and jerk along the arc that each block allows, (B,)."""
    begin, end = arc[run.first], arc[run.last]
    count = max(1, int((end - begin) / BLOCK))
    edges = np.linspace(begin, end, count + 1)
    points = arc[run.first : run.last + 1]
    s = np.unique(np.concatenate([points, (points[1:] + points[:-1]) / 2, edges]))
    q1, q2, q3 = run.derivatives(s)
    d1, d2, d3 = (q / (MARGIN * m) for q, m in zip((q1, q2, q3), (robot.speed, robot.acceleration, robot.jerk)))
    d1a, d1j, d2j = q1 / (MARGIN * robot.acceleration), q1 / (MARGIN * robot.jerk), q2 / (MARGIN * robot.jerk)
    at = np.searchsorted(s, edges[:-1])
    blocks = [_block_max(d.max(axis=1), at) for d in (d1, d2, d3)]
    with np.errstate(divide="ignore"):
        drivable = np.minimum(
            np.minimum(1 / blocks[0], np.sqrt(CRUISE_ACCELERATION / blocks[1])), np.cbrt(CRUISE_JERK / blocks[2])
        )
        if drivable.min() < SLOWEST:
            _refuse_crawl(robot, arc, edges[[(b := int(np.argmin(drivable))), b + 1]], (d1, d2, d3), s)
        short = _block_min(arc[run.first : run.last + 1], followable[run.first : run.last], edges)
        V = np.minimum(np.minimum(short, feed), drivable)
        V = np.where((feed > V) & (V > SPEED_STEP), np.floor(V / SPEED_STEP + 1e-9) * SPEED_STEP, V)
        left_a = 1 - blocks[1] * V**2
        left_j = 1 - blocks[2] * V**3
        A = np.minimum(
            left_a / _block_max(d1a.max(axis=1), at),
            CHANGE_JERK * left_j / (3 * _block_max(d2j.max(axis=1), at) * V),
        )
        J = (1 - CHANGE_JERK) * left_j / _block_max(d1j.max(axis=1), at)
    # a joint that does not move asks for nothing: cap what is left by a hand's measure
    return edges, V, np.minimum(A, 50.0), np.minimum(J, 2000.0)


def _refuse_crawl(robot: Robot, arc: Array, block: Array, shares: tuple[Array, ...], s: Array) -> None:
    """Names the waypoint and the joint that cannot follow the path at any speed a program can say."""
    inside = (s >= block[0]) & (s <= block[1])
    worst = np.maximum.reduce([d[inside] ** (1 / n) for n, d in enumerate(shares, 1)])
    row, joint = np.unravel_index(int(np.argmax(worst)), worst.shape)
    n = int(np.searchsorted(arc, s[inside][row])) + 1
    raise ImpossibleError(
        f"waypoint {n}: joint {robot.joint_names[int(joint)]} cannot follow the path even at {SLOWEST / 1e-3:g} mm/s; "
        "make the path larger, its curves wider or its waypoints fewer (process.chord_um)"
    )


def _stop_ramps(v: Array, V: Array) -> BoolArray:
    """Blocks in which the robot leaves or nears a stop: up to the first that holds its speed, from the last, (B,)."""
    holds = np.flatnonzero((v[1:] <= v[:-1]) | (v[1:] >= V * (1 - 1e-9)))
    brakes = np.flatnonzero((v[:-1] <= v[1:]) | (v[:-1] >= V * (1 - 1e-9)))
    ramp = np.zeros(len(V), dtype=bool)
    ramp[: holds[0] + 1 if len(holds) else len(V)] = True
    ramp[brakes[-1] if len(brakes) else 0 :] = True
    return ramp


def _block_max(values: Array, at: IntArray) -> Array:
    """Largest value in each block, both edges included."""
    inner = np.maximum.reduceat(values, at)
    return np.asarray(np.maximum(inner, values[np.append(at[1:], len(values) - 1)]) + 1e-30)


def _block_min(points: Array, values: Array, edges: Array) -> Array:
    """Smallest value of the segments that reach into each block."""
    first = np.clip(np.searchsorted(points, edges[:-1], side="right") - 1, 0, len(values) - 1)
    inner = np.minimum.reduceat(values, first)
    last = np.clip(np.searchsorted(points, edges[1:], side="left") - 1, 0, len(values) - 1)
    return np.asarray(np.minimum(inner, values[last]))


def _edge_speeds(length: Array, V: Array, A: Array, J: Array) -> Array:
    """Speeds at the block edges: zero at the stops, and every change possible within its block."""
    v = np.concatenate([[0.0], np.minimum(V[:-1], V[1:]), [0.0]])
    for b in range(len(V)):
        if v[b + 1] > v[b]:
            v[b + 1] = min(v[b + 1], _reach(v[b], length[b], A[b], J[b]))
    for b in range(len(V) - 1, -1, -1):
        if v[b] > v[b + 1]:
            v[b] = min(v[b], _reach(v[b + 1], length[b], A[b], J[b]))
    return v


def _reach(v0: float, length: float, a: float, j: float) -> float:
    """Highest speed at the end of a length, from v0, with zero acceleration at both ends.

    The change dv takes T = 2 sqrt(dv / j), or dv / a + a / j once a is reached; (v0 + dv / 2) T = length.
    """
    dv = a * a / j
    if (v0 + dv / 2) * 2 * a / j < length:
        p = 2 * v0 + a * a / j
        dv = (-p + sqrt(p * p - 4 * (2 * v0 * a * a / j - 2 * length * a))) / 2
    else:  # j x^3 + 2 v0 x = length with x = sqrt(dv / j): Newton from above
        x = a / j
        for _ in range(60):
            step = (j * x**3 + 2 * v0 * x - length) / (3 * j * x * x + 2 * v0)
            x -= step
            if abs(step) <= 1e-15 * x:
                break
        dv = j * x * x
    return float((v0 + dv) * (1 - 1e-9))


_OTG = Ruckig(1)
_INPUT, _TRAJECTORY = InputParameter(1), RuckigTrajectory(1)


def _join(s: float, length: float, v0: float, v1: float, v: float, a: float, j: float) -> list[tuple[float, ...]]:
    """Rows of ``Phases`` (without start) for one block."""
    if v0 == v1 == v:
        return [(length / v, s, v, 0.0, 0.0)]
    _INPUT.current_position, _INPUT.target_position = [0.0], [float(length)]
    _INPUT.current_velocity, _INPUT.target_velocity = [float(v0)], [float(v1)]
    _INPUT.current_acceleration = _INPUT.target_acceleration = [0.0]
    _INPUT.max_velocity, _INPUT.max_acceleration, _INPUT.max_jerk = [float(v)], [float(a)], [float(j)]
    try:
        _OTG.validate_input(_INPUT, True, True)
        result = _OTG.calculate(_INPUT, _TRAJECTORY)
    except Exception as failure:  # ruckig raises its own untyped errors
        raise ImpossibleError(
            f"timing: no motion at {s:.4f} m along the path within the joint limits: {failure}; lower process.feed_mm_s"
        ) from failure
    if result not in (Result.Working, Result.Finished):
        raise ImpossibleError(
            f"timing: no motion at {s:.4f} m along the path within the joint limits ({result.name}); "
            "lower process.feed_mm_s"
        )
    p = _TRAJECTORY.profiles[0][0]
    return [(t, s + p.p[i], p.v[i], p.a[i], p.j[i]) for i, t in enumerate(p.t) if t > 0]


def _use(robot: Robot, arc: Array, run: _Run, phases: Phases) -> Array:
    """Largest share of each joint limit after mapping to joints, on a dense grid, (3, 6)."""
    begin, end = arc[run.first], arc[run.last]
    k0, k1 = np.searchsorted(phases.s0, [begin - 1e-12, end - 1e-12])
    # both ends and three inner points of each phase, and every waypoint
    share = np.linspace(0, 1, 5)
    k = np.repeat(np.arange(k0, k1), 5)
    t = phases.duration[k] * np.tile(share, k1 - k0)
    way = phases.time_at(arc[run.first + 1 : run.last])
    kw = np.clip(np.searchsorted(phases.start, way, side="right") - 1, 0, len(phases.start) - 1)
    k, t = np.concatenate([k, kw]), np.concatenate([t, way - phases.start[kw]])
    v0, a0, j = phases.v0[k], phases.a0[k], phases.j[k]
    s = np.clip(phases.s0[k] + t * (v0 + t * (a0 / 2 + t * j / 6)), begin, end)
    v, a = (v0 + t * (a0 + t * j / 2))[:, None], (a0 + t * j)[:, None]
    q1, q2, q3 = (run.spline(s, n) if n <= run.spline.k else np.zeros((len(s), 6)) for n in (1, 2, 3))
    rates = (q1 * v, q2 * v**2 + q1 * a, q3 * v**3 + 3 * q2 * v * a + q1 * j[:, None])
    limits = (robot.speed, robot.acceleration, robot.jerk)
    return np.array([np.abs(r).max(axis=0) / limit for r, limit in zip(rates, limits)])
