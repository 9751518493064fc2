r"""When the robot is where: jerk-limited motion along the path, exactly on it.

One degree of freedom, the arc length s. With q(s) the joint motion,

    qd = q' sd        qdd = q'' sd^2 + q' sdd        qddd = q''' sd^3 + 3 q'' sd sdd + q' sddd

The way between two stops is cut into blocks. Each block gets a speed V (the feed, or less where the joints or the
controller's interpolation period demand it) and from what V leaves of each joint's limits an acceleration and a jerk.
Speeds at the block edges are found by one pass forwards and one back; ``speed_profile`` then joins them, state to
state.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, own
from compgen.core.exceptions import ImpossibleError
from compgen.planning import joint_curve, speed_profile
from compgen.planning.joint_curve import JointCurve
from compgen.planning.speed_profile import Blocks
from compgen.robot.robot import Robot

BLOCK_LENGTH = 20e-3  # m
MARGIN = 0.98  # of each limit, for what the samples between waypoints do not see
CRUISE_ACCELERATION = 0.8  # share of a joint's acceleration that constant speed may use
CRUISE_JERK = 0.6
CHANGE_JERK = 0.5  # share of the remaining jerk for 3 q'' sd sdd; the rest is for q' sddd
SPEED_STEP = 1e-3  # m/s, a reduced speed is a whole number of mm/s where it can be
SAMPLES = 5  # of a stretch of constant jerk, at which the use of the limits is computed
MIN_SPEED = 0.05e-3  # m/s, about the slowest speed that a program can say


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
        """When rising arc lengths are passed, (M,) [s]."""
        k, t = self.locate(s)
        return np.asarray(self.start[k] + t)

    def locate(self, s: Array) -> tuple[IntArray, Array]:
        """The phase in which rising arc lengths are passed, (M,), and the time after its start, (M,) [s]."""
        k = np.maximum(joint_curve.last_before(np.maximum.accumulate(self.s0), s), 0)
        cruise = (self.a0 == 0) & (self.j == 0) & (self.v0 > 0)
        t = (s - self.s0[k]) / np.where(cruise, self.v0, 1.0)[k]
        rest = np.flatnonzero(~cruise[k])
        t[rest] = self._time_in_phase(k[rest], (s - self.s0[k])[rest])
        return k, t

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

        t = speed_profile.rising_root(excess, np.zeros(len(k)), end, guess)
        return np.where(distance <= 0, 0.0, np.where(distance >= whole, end, t))


@dataclass(frozen=True, eq=False, slots=True)
class Trajectory:
    """Joint motion along a path, with the speeds its program must name."""

    time: Array  # (N,) [s] at each waypoint, 0 at the first
    speed: Array  # (N - 1,) [m/s] programmed for each segment
    driven_speed: Array  # (N - 1,) [m/s] mean of each segment, its run's stops shared out: what warms the robot
    phases: Phases
    utilisation: Array  # (3, 6) largest share of each joint's speed, acceleration and jerk limit
    at_feed: float  # share of the path length driven at feed

    def __post_init__(self) -> None:
        own(self, time=("N",), speed=("S",), driven_speed=("S",), utilisation=(3, 6))


def driven_speed(time: Array, length: Array, speed: Array, stop: BoolArray) -> Array:
    """Programmed speeds slowed so that each run between two stops takes its time, (N - 1,) [m/s].

    Heat depends on how fast the robot really goes; near a stop that is far from the programmed speed.
    """
    ends = np.flatnonzero(stop)
    programmed_time = np.add.reduceat(length / speed, ends[:-1])
    return np.asarray(speed * np.repeat(programmed_time / np.diff(time[ends]), np.diff(ends)))


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
    joints = joint_curve.fit_joint_curve(arc, theta, stop)
    partition = _partition(arc, np.flatnonzero(stop))
    progress(0.1)
    blocks = _limit_blocks(robot, joints, partition, _smallest_in_blocks(arc, followable, partition), feed, arc)
    progress(0.5)
    *table, owner = speed_profile.constant_jerk_phases(blocks)
    start = np.concatenate([[0.0], np.cumsum(table[0])])
    phases = Phases(start[:-1], *table)
    progress(0.7)
    k, t = phases.locate(arc)
    utilisation = _utilisation(robot, joints, phases, partition.run[owner], (k[joints.rows], t[joints.rows]))
    time = phases.start[k] + t
    time[0], time[-1] = 0.0, start[-1]
    # away from the stops' ramps the programmed speed is the driven one, so that the program takes the planned time
    block = np.maximum(joint_curve.last_before(partition.begin, (arc[:-1] + arc[1:]) / 2), 0)
    speed = blocks.v[block]
    mean = np.minimum(speed, length / np.diff(time))
    mean = np.where(mean > speed * (1 - 1e-3), speed, mean)
    speed = np.where(_stop_ramps(blocks, partition)[block], speed, mean)
    cruise = (phases.j == 0) & (phases.a0 == 0) & (phases.v0 >= feed * (1 - 1e-9))
    at_feed = float((phases.v0 * phases.duration)[cruise].sum() / (arc[-1] - arc[0]))
    progress(1.0)
    driven = driven_speed(time, length, speed, stop)
    return Trajectory(frozen(time), frozen(speed), frozen(driven), phases, utilisation, at_feed)


@dataclass(frozen=True, eq=False, slots=True)
class _Partition:
    """The way cut into B blocks, none across a stop."""

    begin: Array  # (B,) [m]
    end: Array  # (B,) [m]
    run: IntArray  # (B,) which way between two stops
    first: IntArray  # (R,) first block of each


def _partition(arc: Array, ends: IntArray) -> _Partition:
    """Blocks of about ``BLOCK_LENGTH`` between the stops, of which ``ends`` are the waypoints."""
    begin, end = arc[ends[:-1]], arc[ends[1:]]
    count = np.maximum(1, ((end - begin) / BLOCK_LENGTH).astype(np.int64))
    run = np.repeat(np.arange(len(count)), count)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    k = np.arange(len(run)) - first[run]
    step = ((end - begin) / count)[run]
    right = np.where(k + 1 == count[run], end[run], begin[run] + (k + 1) * step)
    return _Partition(begin[run] + k * step, right, run, first)


def _limit_blocks(
    robot: Robot, joints: JointCurve, partition: _Partition, followable: Array, feed: float, arc: Array
) -> Blocks:
    """Speed, acceleration and jerk along the arc that each block allows, and its speeds at both ends.

    Args:
        robot: For the limits.
        joints: The curve.
        partition: The blocks.
        followable: Speed that the controller's interpolation period allows in each block, (B,) [m/s].
        feed: Wanted speed [m/s].
        arc: Of the waypoints, (N,) [m].

    Raises:
        ImpossibleError: A joint cannot follow the path at any speed that a program can say.
    """
    most = _limit_ratios(robot, joints, partition) / MARGIN + 1e-30
    with np.errstate(divide="ignore"):
        drivable = np.minimum(
            np.minimum(1 / most[:, 0], np.sqrt(CRUISE_ACCELERATION / most[:, 1])), np.cbrt(CRUISE_JERK / most[:, 2])
        )
        if drivable.min() < MIN_SPEED:
            _raise_too_slow(robot, joints, partition, int(np.argmin(drivable)), arc)
        V = np.minimum(np.minimum(followable, feed), drivable)
        V = np.where((feed > V) & (V > SPEED_STEP), np.floor(V / SPEED_STEP + 1e-9) * SPEED_STEP, V)
        left_a = 1 - most[:, 1] * V**2
        left_j = 1 - most[:, 2] * V**3
        A = np.minimum(left_a / most[:, 3], CHANGE_JERK * left_j / (3 * most[:, 5] * V))
        J = (1 - CHANGE_JERK) * left_j / most[:, 4]
    # a joint that does not move limits nothing: cap by values no robot reaches
    A, J = np.minimum(A, 50.0), np.minimum(J, 2000.0)
    length = partition.end - partition.begin
    v0, v1 = _edge_speeds(partition, length, V, A, J)
    return Blocks(partition.begin, length, v0, v1, V, A, J)


def _limit_ratios(robot: Robot, joints: JointCurve, partition: _Partition) -> Array:
    """Largest ``JointCurve.limit_ratios`` in each block, (B, 6): at knots, between them, and at the block's edges."""
    knots = joints.last - joints.first
    R, B = len(knots), len(partition.begin)
    within = np.repeat(joints.arc[:-1], 2)  # knots, and the middles between them
    within[1::2] = (joints.arc[:-1] + joints.arc[1:]) / 2
    run = np.repeat(np.arange(R), 2 * knots)
    # every edge is where a block begins or a run ends
    ratios = joints.limit_ratios(
        robot,
        np.concatenate([within, partition.begin, joints.arc[joints.last]]),
        np.concatenate([np.arange(len(within)) // 2, joints.interval(partition.begin, partition.run), joints.last - 1]),
        np.concatenate([run, partition.run, np.arange(R)]),
    )
    inner, begin, end = np.split(ratios, [len(within), len(within) + B])
    last = np.append(partition.first[1:], B) - 1
    following = np.roll(begin, -1, axis=0)
    following[last] = end
    most = np.maximum(begin, following)
    owner = np.clip(joint_curve.last_before(partition.begin, within), partition.first[run], last[run])
    starts = np.flatnonzero(np.concatenate([[True], owner[1:] != owner[:-1]]))
    most[owner[starts]] = np.maximum(most[owner[starts]], np.maximum.reduceat(inner, starts, axis=0))
    return most


def _raise_too_slow(robot: Robot, joints: JointCurve, partition: _Partition, block: int, arc: Array) -> None:
    """Raises ImpossibleError naming the waypoint and the joint that is slowest in a block."""
    inside = joints.arc[(joints.arc >= partition.begin[block]) & (joints.arc <= partition.end[block])]
    s = np.unique(np.concatenate([np.linspace(partition.begin[block], partition.end[block], 50), inside]))
    run = np.full(len(s), partition.run[block])
    interval = joints.interval(s, run)
    # at unit speed a joint's shares of its three limits: the slowest is where its own root is largest
    worst = joints.utilisation(robot, s, interval, run, np.tile([1.0, 0.0, 0.0], (len(s), 1))).reshape(-1, 3, 6)
    roots = np.maximum.reduce([worst[:, 0], np.sqrt(worst[:, 1]), np.cbrt(worst[:, 2])])
    row, joint = np.unravel_index(int(np.argmax(roots)), roots.shape)
    n = int(np.searchsorted(arc, s[row])) + 1
    raise ImpossibleError(
        f"waypoint {n}: joint {robot.joint_names[int(joint)]} cannot follow the path even at {MIN_SPEED / 1e-3:g} mm/s"
        "; make the path larger, its curves wider or its waypoints fewer (process.chord_um)"
    )


def _stop_ramps(blocks: Blocks, partition: _Partition) -> BoolArray:
    """Blocks in which the robot leaves or nears a stop, (B,): to the first that holds its speed, from the last."""
    B = len(blocks.v)
    number = np.arange(B)
    last = np.append(partition.first[1:], B) - 1
    holds = (blocks.v1 <= blocks.v0) | (blocks.v1 >= blocks.v * (1 - 1e-9))
    brakes = (blocks.v0 <= blocks.v1) | (blocks.v0 >= blocks.v * (1 - 1e-9))
    until = np.minimum(np.minimum.reduceat(np.where(holds, number, B), partition.first), last)
    since = np.maximum(np.maximum.reduceat(np.where(brakes, number, -1), partition.first), partition.first)
    return np.asarray((number <= until[partition.run]) | (number >= since[partition.run]))


def _smallest_in_blocks(arc: Array, values: Array, partition: _Partition) -> Array:
    """Smallest value of the segments that reach into each block, (B,)."""
    first = np.clip(np.searchsorted(arc, partition.begin, side="right") - 1, 0, len(values) - 1)
    inner = np.minimum.reduceat(values, first)
    last = np.clip(np.searchsorted(arc, partition.end, side="left") - 1, 0, len(values) - 1)
    return np.asarray(np.minimum(inner, values[last]))


def _edge_speeds(partition: _Partition, length: Array, V: Array, A: Array, J: Array) -> tuple[Array, Array]:
    """Speeds at both ends of each block, (B,): zero at the stops, and every change possible within its block.

    A block's end follows from its start, so the blocks after one that changed are computed again, all at once.
    """
    B = len(V)
    is_first, is_last = np.zeros(B, dtype=bool), np.zeros(B, dtype=bool)
    is_first[partition.first] = True
    is_last[np.append(partition.first[1:], B) - 1] = True
    v = np.concatenate([[0.0], np.minimum(V[:-1], V[1:]), [0.0]])  # v[b] at the start of block b
    v[partition.first] = 0.0
    for step, bound in ((1, is_last), (-1, is_first)):
        goal = v.copy()
        todo = np.arange(B)
        while len(todo):
            near, far = (todo, todo + 1) if step > 0 else (todo + 1, todo)
            rises = goal[far] > v[near]
            new = goal[far].copy()
            rising = todo[rises]
            reachable = speed_profile.reachable_speed(v[near[rises]], length[rising], A[rising], J[rising])
            new[rises] = np.minimum(new[rises], reachable)
            changed = new != v[far]
            v[far[changed]] = new[changed]
            todo = todo[changed & ~bound[todo]] + step
    return v[:-1], v[1:]


def _utilisation(
    robot: Robot, joints: JointCurve, phases: Phases, run: IntArray, passed: tuple[IntArray, Array]
) -> Array:
    """Largest share of each joint limit after mapping to joints, on a dense grid, (3, 6).

    Args:
        robot: For the limits.
        joints: The curve.
        phases: How it is driven.
        run: In which run each phase is, (P,).
        passed: The phase in which each knot is passed, (K,), and the time after the phase's start, (K,) [s].
    """
    # every knot that is no stop, with both ends and three inner points of each phase
    inner = np.ones(len(joints.arc), dtype=bool)
    inner[joints.first] = inner[joints.last] = False
    knot = np.flatnonzero(inner)
    k, t = (x[knot] for x in passed)
    begin, end = joints.arc[joints.first], joints.arc[joints.last]
    utilisation, share = np.zeros(18), np.linspace(0, 1, SAMPLES)
    for phase in np.array_split(np.arange(len(run)), 1 + SAMPLES * len(run) // joint_curve.CHUNK):
        inside = slice(*np.searchsorted(k, [phase[0], phase[-1] + 1]))
        which = np.concatenate([k[inside], np.repeat(phase, SAMPLES)])
        since = np.concatenate([t[inside], np.multiply.outer(phases.duration[phase], share).ravel()])
        v0, a0, j, runs = phases.v0[which], phases.a0[which], phases.j[which], run[which]
        rates = np.column_stack([v0 + since * (a0 + since * j / 2), a0 + since * j, j])
        s = phases.s0[which] + since * (v0 + since * (a0 / 2 + since * j / 6))
        s = np.clip(s, begin[runs], end[runs])
        n = len(k[inside])
        interval = np.concatenate([knot[inside], joints.interval(np.maximum.accumulate(s[n:]), runs[n:])])
        used = joints.utilisation(robot, s, interval, runs, rates)
        utilisation = np.maximum(utilisation, used.max(axis=0))
    return utilisation.reshape(3, 6)
