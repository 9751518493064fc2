r"""When the robot is where: jerk-limited motion along the path, exactly on it.

One degree of freedom, the arc length s. With q(s) the joint motion,

    qd = q' sd        qdd = q'' sd^2 + q' sdd        qddd = q''' sd^3 + 3 q'' sd sdd + q' sddd

The way between two stops is cut into blocks. Each block gets a speed V (the feed, or less where the joints or the
controller's interpolation period demand it) and from what V leaves of each joint's limits an acceleration and a jerk.
Speeds at the block edges are found by one pass forwards and one back; ``ramps`` then joins them, state to state.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen import motion, ramps
from compgen.arrays import Array, BoolArray, IntArray, own
from compgen.exceptions import ImpossibleError
from compgen.motion import JointCurve
from compgen.ramps import Blocks
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
    joints = motion.curve(arc, theta, stop)
    ends = np.flatnonzero(stop)
    cut = _cut(arc, ends)
    progress(0.1)
    blocks = _allowed(robot, joints, cut, _followable(arc, followable, cut), feed, arc)
    progress(0.5)
    table = ramps.phases(blocks)
    start = np.concatenate([[0.0], np.cumsum(table[0])])
    phases = Phases(start[:-1], *table)
    progress(0.7)
    use = _use(robot, joints, cut, phases)
    time = phases.time_at(arc)
    time[0], time[-1] = 0.0, start[-1]
    # away from the stops' own ramps the program says what is driven, so that its time is the planned one
    owner = np.clip(np.searchsorted(cut.begin, (arc[:-1] + arc[1:]) / 2, side="right") - 1, 0, len(cut.begin) - 1)
    speed = blocks.v[owner]
    real = np.minimum(speed, length / np.diff(time))
    real = np.where(real > speed * (1 - 1e-3), speed, real)
    speed = np.where(_stop_ramps(blocks, cut)[owner], speed, real)
    cruise = (phases.j == 0) & (phases.a0 == 0) & (phases.v0 >= feed * (1 - 1e-9))
    at_feed = float((phases.v0 * phases.duration)[cruise].sum() / (arc[-1] - arc[0]))
    progress(1.0)
    return Trajectory(time, speed, driven_speed(time, length, speed, stop), phases, use, at_feed)


@dataclass(frozen=True, eq=False, slots=True)
class _Cut:
    """The way cut into B blocks, none across a stop."""

    begin: Array  # (B,) [m]
    end: Array  # (B,) [m]
    run: IntArray  # (B,) which way between two stops
    first: IntArray  # (R,) first block of each


def _cut(arc: Array, ends: IntArray) -> _Cut:
    begin, end = arc[ends[:-1]], arc[ends[1:]]
    count = np.maximum(1, ((end - begin) / BLOCK).astype(np.int64))
    run = np.repeat(np.arange(len(count)), count)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    k = np.arange(len(run)) - first[run]
    step = ((end - begin) / count)[run]
    right = np.where(k + 1 == count[run], end[run], begin[run] + (k + 1) * step)
    return _Cut(begin[run] + k * step, right, run, first)


def _allowed(robot: Robot, joints: JointCurve, cut: _Cut, short: Array, feed: float, arc: Array) -> Blocks:
    """Speed, acceleration and jerk along the arc that each block allows, and its speeds at both ends.

    Raises:
        ImpossibleError: A joint cannot follow the path at any speed that a program can say.
    """
    most = _shares(robot, joints, cut) / MARGIN + 1e-30
    with np.errstate(divide="ignore"):
        drivable = np.minimum(
            np.minimum(1 / most[:, 0], np.sqrt(CRUISE_ACCELERATION / most[:, 1])), np.cbrt(CRUISE_JERK / most[:, 2])
        )
        if drivable.min() < SLOWEST:
            _refuse_crawl(robot, joints, cut, int(np.argmin(drivable)), arc)
        V = np.minimum(np.minimum(short, feed), drivable)
        V = np.where((feed > V) & (V > SPEED_STEP), np.floor(V / SPEED_STEP + 1e-9) * SPEED_STEP, V)
        left_a = 1 - most[:, 1] * V**2
        left_j = 1 - most[:, 2] * V**3
        A = np.minimum(left_a / most[:, 3], CHANGE_JERK * left_j / (3 * most[:, 5] * V))
        J = (1 - CHANGE_JERK) * left_j / most[:, 4]
    # a joint that does not move asks for nothing: cap what is left by a hand's measure
    A, J = np.minimum(A, 50.0), np.minimum(J, 2000.0)
    length = cut.end - cut.begin
    v0, v1 = _edge_speeds(cut, length, V, A, J)
    return Blocks(cut.begin, length, v0, v1, V, A, J)


def _shares(robot: Robot, joints: JointCurve, cut: _Cut) -> Array:
    """What ``JointCurve.shares`` says at its largest in each block, (B, 6): at knots, between them, at the edges."""
    size = joints.last - joints.first
    knot = np.arange(len(joints.arc) - 1)  # the interval that begins at each knot
    run = np.repeat(np.arange(len(size)), size)
    last = np.append(cut.first[1:], len(cut.begin)) - 1
    found = np.zeros((len(cut.begin), 6))
    for at in range(0, len(knot), motion.CHUNK):
        rows = slice(at, at + motion.CHUNK)
        left, right = joints.arc[:-1][rows], joints.arc[1:][rows]
        for s in (left, (left + right) / 2):
            share = joints.shares(robot, s, knot[rows], run[rows])
            owner = np.searchsorted(cut.begin, s, side="right") - 1
            owner = np.clip(owner, cut.first[run[rows]], last[run[rows]])
            begun = np.flatnonzero(np.concatenate([[True], owner[1:] != owner[:-1]]))
            top = np.maximum.reduceat(share, begun, axis=0)
            found[owner[begun]] = np.maximum(found[owner[begun]], top)
    for s in (cut.begin, cut.end):
        found = np.maximum(found, joints.shares(robot, s, joints.interval(s, cut.run), cut.run))
    return found


def _refuse_crawl(robot: Robot, joints: JointCurve, cut: _Cut, block: int, arc: Array) -> None:
    """Names the waypoint and the joint that cannot follow the path at any speed a program can say."""
    inside = joints.arc[(joints.arc >= cut.begin[block]) & (joints.arc <= cut.end[block])]
    s = np.unique(np.concatenate([np.linspace(cut.begin[block], cut.end[block], 50), inside]))
    run = np.full(len(s), cut.run[block])
    between = joints.interval(s, run)
    # at unit speed a joint's shares of its three limits: the slowest is where its own root is largest
    worst = [
        joints.use(robot, s[k : k + 1], between[k : k + 1], run[:1], np.array([[1.0, 0.0, 0.0]])) for k in range(len(s))
    ]
    roots = np.array([np.maximum.reduce([w[0], np.sqrt(w[1]), np.cbrt(w[2])]) for w in worst])
    row, joint = np.unravel_index(int(np.argmax(roots)), roots.shape)
    n = int(np.searchsorted(arc, s[row])) + 1
    raise ImpossibleError(
        f"waypoint {n}: joint {robot.joint_names[int(joint)]} cannot follow the path even at {SLOWEST / 1e-3:g} mm/s; "
        "make the path larger, its curves wider or its waypoints fewer (process.chord_um)"
    )


def _stop_ramps(blocks: Blocks, cut: _Cut) -> BoolArray:
    """Blocks in which the robot leaves or nears a stop: up to the first that holds its speed, from the last, (B,)."""
    B = len(blocks.v)
    number = np.arange(B)
    last = np.append(cut.first[1:], B) - 1
    holds = (blocks.v1 <= blocks.v0) | (blocks.v1 >= blocks.v * (1 - 1e-9))
    brakes = (blocks.v0 <= blocks.v1) | (blocks.v0 >= blocks.v * (1 - 1e-9))
    until = np.minimum(np.minimum.reduceat(np.where(holds, number, B), cut.first), last)
    since = np.maximum(np.maximum.reduceat(np.where(brakes, number, -1), cut.first), cut.first)
    return np.asarray((number <= until[cut.run]) | (number >= since[cut.run]))


def _followable(arc: Array, values: Array, cut: _Cut) -> Array:
    """Smallest value of the segments that reach into each block, (B,)."""
    first = np.clip(np.searchsorted(arc, cut.begin, side="right") - 1, 0, len(values) - 1)
    inner = np.minimum.reduceat(values, first)
    last = np.clip(np.searchsorted(arc, cut.end, side="left") - 1, 0, len(values) - 1)
    return np.asarray(np.minimum(inner, values[last]))


def _edge_speeds(cut: _Cut, length: Array, V: Array, A: Array, J: Array) -> tuple[Array, Array]:
    """Speeds at both ends of each block, (B,): zero at the stops, and every change possible within its block.

    A block's end follows from its start, so the blocks after one that changed are looked at again, all at once.
    """
    B = len(V)
    begins, closes = np.zeros(B, dtype=bool), np.zeros(B, dtype=bool)
    begins[cut.first] = True
    closes[np.append(cut.first[1:], B) - 1] = True
    v = np.concatenate([[0.0], np.minimum(V[:-1], V[1:]), [0.0]])  # v[b] at the start of block b
    v[cut.first] = 0.0
    for step, bound in ((1, closes), (-1, begins)):
        goal = v.copy()
        todo = np.arange(B)
        while len(todo):
            near, far = (todo, todo + 1) if step > 0 else (todo + 1, todo)
            rises = goal[far] > v[near]
            new = goal[far].copy()
            some = todo[rises]
            new[rises] = np.minimum(new[rises], ramps.reach(v[near[rises]], length[some], A[some], J[some]))
            changed = new != v[far]
            v[far[changed]] = new[changed]
            todo = todo[changed & ~bound[todo]] + step
    return v[:-1], v[1:]


def _use(robot: Robot, joints: JointCurve, cut: _Cut, phases: Phases) -> Array:
    """Largest share of each joint limit after mapping to joints, on a dense grid, (3, 6)."""
    begin = cut.begin[cut.first]
    use = np.zeros((3, 6))

    def look(s: Array, k: IntArray, t: Array, run: IntArray) -> None:
        nonlocal use
        v0, a0, j = phases.v0[k], phases.a0[k], phases.j[k]
        rates = np.column_stack([v0 + t * (a0 + t * j / 2), a0 + t * j, j])
        use = np.maximum(use, joints.use(robot, s, joints.interval(s, run), run, rates))

    # both ends and three inner points of each phase
    owner = np.clip(np.searchsorted(begin, phases.s0 + 1e-12, side="right") - 1, 0, len(begin) - 1)
    everything = np.arange(len(phases.s0))
    last = joints.arc[joints.last]
    for share in np.linspace(0, 1, 5):
        t = share * phases.duration
        s = phases.s0 + t * (phases.v0 + t * (phases.a0 / 2 + t * phases.j / 6))
        look(np.clip(s, begin[owner], last[owner]), everything, t, owner)
    # every knot that is no stop
    between = np.setdiff1d(np.arange(len(joints.arc)), np.append(joints.first, joints.last[-1]))
    for at in range(0, len(between), motion.CHUNK):
        s = joints.arc[between[at : at + motion.CHUNK]]
        time = phases.time_at(s)
        k = np.clip(np.searchsorted(phases.start, time, side="right") - 1, 0, len(phases.start) - 1)
        run = np.clip(np.searchsorted(begin, s, side="right") - 1, 0, len(begin) - 1)
        look(s, k, time - phases.start[k], run)
    return use
