r"""The path cut into blocks, and what each allows along the arc: speed, acceleration and jerk.

With q(s) the joint motion, q' = dq/ds,

    qd = q' sd        qdd = q'' sd^2 + q' sdd        qddd = q''' sd^3 + 3 q'' sd sdd + q' sddd

A block gets a speed V (the feed, or less where the joints or the controller's interpolation period demand it), and from
what V leaves of each joint's limits an acceleration A and a jerk J.

Speeds at the edges of blocks: one pass forwards and one back over blocks with their own limits.

ruckig drives one block from state to state; which speeds it may have at its edges follows from all the others. With
zero acceleration at every edge, a change of speed by dv within acceleration a and jerk j takes

    T = 2 sqrt(dv / j) up to dv = a^2 / j,    else T = dv / a + a / j,        over (v0 + v1) / 2 T of path
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, numbered
from compgen.core.exceptions import ImpossibleError
from compgen.core.units import INCH, MINUTE, MM
from compgen.planning import joint_curve
from compgen.planning.joint_curve import JointCurve
from compgen.robot.robot import Robot

BLOCK_LENGTH = 20e-3  # m
CHANGE = 2.0  # times the speed that the controller can follow, from segment to segment
MARGIN = 0.98  # of each limit, for what the samples between waypoints do not see
CRUISE_ACCELERATION = 0.8  # share of a joint's acceleration that constant speed may use
CRUISE_JERK = 0.6
CHANGE_JERK = 0.5  # share of the remaining jerk for 3 q'' sd sdd; the rest is for q' sddd
SPEED_STEPS = (MM, 0.1 * INCH / MINUTE)  # m/s, what a program can say: a reduced speed is a whole number of them
SPEED_LOSS = 0.02  # of a speed, that a step may cost at most
MIN_SPEED = 0.05e-3  # m/s, about the slowest speed that a program can say
TINY = 1e-300  # keeps divisors from being zero
ROUNDS = 60  # of Newton's steps
FIT = 1 - 1e-9  # of the highest speed, so that a block holds its change of speed in spite of rounding


@dataclass(frozen=True, eq=False, slots=True)
class Partition:
    """The way cut into B blocks, none across a stop."""

    begin: Array  # (B,) [m]
    end: Array  # (B,) [m]
    run: IntArray  # (B,) which way between two stops
    first: IntArray  # (R,) first block of each


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Blocks:
    """B blocks with zero acceleration at their edges: where, how long, the speeds there, and the limits inside."""

    start: Array  # (B,) [m]
    length: Array  # (B,) [m]
    v0: Array  # (B,) [m/s] at the start
    v1: Array  # (B,) [m/s] at the end
    v: Array  # (B,) [m/s] at most
    a: Array  # (B,) [m/s2] at most
    j: Array  # (B,) [m/s3] at most

    def at(self, rows: IntArray) -> "Blocks":
        """Some of the blocks."""
        return Blocks(**{name: getattr(self, name)[rows] for name in Blocks.__slots__})


def cut_blocks(arc: Array, stop: BoolArray, followable: Array) -> Partition:
    """Blocks of about ``BLOCK_LENGTH`` between the stops (N,) of waypoints at rising arc lengths (N,) [m].

    A block ends, too, where the speed that the controller can follow (N - 1,) [m/s] changes by more than ``CHANGE``: a
    rounded corner shall not slow what lies before and behind it.
    """
    edge = stop.copy()
    edge[1:-1] |= np.maximum(followable[1:], followable[:-1]) > CHANGE * np.minimum(followable[1:], followable[:-1])
    ends = np.flatnonzero(edge)
    begin, end = arc[ends[:-1]], arc[ends[1:]]
    count = np.maximum(1, ((end - begin) / BLOCK_LENGTH).astype(np.int64))
    stretch, k = numbered(count)
    step = ((end - begin) / count)[stretch]
    right = np.where(k + 1 == count[stretch], end[stretch], begin[stretch] + (k + 1) * step)
    run = (np.cumsum(stop[ends]) - 1)[stretch]
    return Partition(begin[stretch] + k * step, right, run, np.flatnonzero(np.diff(run, prepend=-1)))


def limit_blocks(
    robot: Robot, joints: JointCurve, partition: Partition, followable: Array, feed: Array, arc: Array
) -> Blocks:
    """Speed, acceleration and jerk along the arc that each block allows, and its speeds at both ends.

    Args:
        robot: For the limits.
        joints: The curve.
        partition: The blocks.
        followable: Speed that the controller's interpolation period allows in each segment, (N - 1,) [m/s].
        feed: Wanted speed in each block, (B,) [m/s].
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
        V = np.minimum(np.minimum(smallest_in_blocks(arc, followable, partition), feed), drivable)
        V = np.where(feed > V, whole_steps(V), V)
        left_a = 1 - most[:, 1] * V**2
        left_j = 1 - most[:, 2] * V**3
        A = np.minimum(left_a / most[:, 3], CHANGE_JERK * left_j / (3 * most[:, 5] * V))
        J = (1 - CHANGE_JERK) * left_j / most[:, 4]
    # a joint that does not move limits nothing: cap by values no robot reaches
    A, J = np.minimum(A, 50.0), np.minimum(J, 2000.0)
    length = partition.end - partition.begin
    speed = edge_speeds(length, V, A, J, partition.first)
    return Blocks(start=partition.begin, length=length, v0=speed[:-1], v1=speed[1:], v=V, a=A, j=J)


def whole_steps(speed: Array) -> Array:
    """Speeds (B,) [m/s] rounded down to the coarsest step that costs at most ``SPEED_LOSS``, else as they are."""
    down = [np.floor(speed / step + 1e-9) * step for step in SPEED_STEPS]
    return np.asarray(np.select([rounded >= (1 - SPEED_LOSS) * speed for rounded in down], down, speed))


def _limit_ratios(robot: Robot, joints: JointCurve, partition: Partition) -> Array:
    """Largest ``JointCurve.limit_ratios`` in each block, (B, 6): at knots, between them, and at the block's edges."""
    knots = joints.last - joints.first
    R, B = len(knots), len(partition.begin)
    within = np.repeat(joints.arc[:-1], 2)  # knots, and the middles between them
    within[1::2] = (joints.arc[:-1] + joints.arc[1:]) / 2
    run = np.repeat(np.arange(R), 2 * knots)
    begin = joints.limit_ratios(robot, partition.begin, joints.interval(partition.begin, partition.run))
    end = joints.limit_ratios(robot, partition.end, joints.interval_before(partition.end, partition.run))
    most = np.maximum(begin, end)
    last = np.append(partition.first[1:], B) - 1
    owner = np.clip(joint_curve.last_before(partition.begin, within), partition.first[run], last[run])
    for rows in joint_curve.chunks(len(within)):
        inner = joints.limit_ratios(robot, within[rows], np.arange(rows.start, rows.start + len(owner[rows])) // 2)
        starts = np.flatnonzero(np.diff(owner[rows], prepend=-1))
        block = owner[rows][starts]
        most[block] = np.maximum(most[block], np.maximum.reduceat(inner, starts, axis=0))
    return most


def _raise_too_slow(robot: Robot, joints: JointCurve, partition: Partition, block: int, arc: Array) -> None:
    """Raises ImpossibleError naming the waypoint and the joint that is slowest in a block."""
    inside = joints.arc[(joints.arc >= partition.begin[block]) & (joints.arc <= partition.end[block])]
    s = np.unique(np.concatenate([np.linspace(partition.begin[block], partition.end[block], 50), inside]))
    interval = joints.interval(s, np.full(len(s), partition.run[block]))
    # at unit speed a joint's shares of its three limits: the slowest is where its own root is largest
    worst = joints.utilisation(robot, s, interval, np.tile([1.0, 0.0, 0.0], (len(s), 1))).reshape(-1, 3, 6)
    roots = np.maximum.reduce([worst[:, 0], np.sqrt(worst[:, 1]), np.cbrt(worst[:, 2])])
    row, joint = np.unravel_index(int(np.argmax(roots)), roots.shape)
    n = int(np.searchsorted(arc, s[row])) + 1
    raise ImpossibleError(
        f"waypoint {n}: joint {robot.joint_names[int(joint)]} cannot follow the path even at {MIN_SPEED / MM:g} mm/s"
        "; make the path larger, its curves wider or its waypoints fewer (process.chord_um)"
    )


def smallest_in_blocks(arc: Array, values: Array, partition: Partition) -> Array:
    """Smallest value of the segments that reach into each block, (B,)."""
    first = np.clip(np.searchsorted(arc, partition.begin, side="right") - 1, 0, len(values) - 1)
    inner = np.minimum.reduceat(values, first)
    last = np.clip(np.searchsorted(arc, partition.end, side="left") - 1, 0, len(values) - 1)
    return np.asarray(np.minimum(inner, values[last]))


def stop_ramps(blocks: Blocks, partition: Partition) -> BoolArray:
    """Blocks in which the robot leaves or nears a stop, (B,): to the first that holds its speed, from the last."""
    B = len(blocks.v)
    number = np.arange(B)
    last = np.append(partition.first[1:], B) - 1
    holds = (blocks.v1 <= blocks.v0) | (blocks.v1 >= blocks.v * (1 - 1e-9))
    brakes = (blocks.v0 <= blocks.v1) | (blocks.v0 >= blocks.v * (1 - 1e-9))
    until = np.minimum(np.minimum.reduceat(np.where(holds, number, B), partition.first), last)
    since = np.maximum(np.maximum.reduceat(np.where(brakes, number, -1), partition.first), partition.first)
    return np.asarray((number <= until[partition.run]) | (number >= since[partition.run]))


def change_duration(dv: Array, a: Array, j: Array) -> Array:
    """Time of a change of speed by dv >= 0 [m/s] within acceleration a and jerk j, (B,) [s]."""
    return np.where(dv > a * a / j, dv / a + a / j, 2 * np.sqrt(dv / j))


def reachable_speed(v0: Array, length: Array, a: Array, j: Array) -> Array:
    """Highest speed at the end of a length, from v0, with zero acceleration at both ends [m/s].

    (v0 + dv / 2) T = length: a square where a is reached, else j x^3 + 2 v0 x = length with x = sqrt(dv / j).
    """
    edge = a * a / j
    reaches_a = (v0 + edge / 2) * 2 * a / j < length
    p = 2 * v0 + edge
    root = np.maximum(p * p - 4 * (2 * v0 * a * a / j - 2 * length * a), 0.0)
    x = np.where(reaches_a, 0.0, a / j)
    for _ in range(ROUNDS):  # Newton from above
        step = np.where(reaches_a, 0.0, (j * x * x * x + 2 * v0 * x - length) / (3 * j * x * x + 2 * v0 + TINY))
        x = x - step
        if not np.any(np.abs(step) > 1e-15 * x):
            break
    return np.maximum(v0, (v0 + np.where(reaches_a, (-p + np.sqrt(root)) / 2, j * x * x)) * FIT)


def edge_speeds(length: Array, V: Array, A: Array, J: Array, first: IntArray) -> Array:
    """Speed at the start of each block, and zero at the end of the last, (B + 1,) [m/s].

    Zero at the stops, and every change possible within its block. A block's end follows from its start, so the blocks
    after one that changed are computed again, all at once.

    Args:
        length: Of the blocks, (B,) [m].
        V: Speed that each allows, (B,) [m/s].
        A: Acceleration, (B,) [m/s2].
        J: Jerk, (B,) [m/s3].
        first: The first block after each stop, (R,).
    """
    B = len(V)
    is_first, is_last = np.zeros(B, dtype=bool), np.zeros(B, dtype=bool)
    is_first[first] = True
    is_last[np.append(first[1:], B) - 1] = True
    v = np.concatenate([[0.0], np.minimum(V[:-1], V[1:]), [0.0]])  # v[b] at the start of block b
    v[first] = 0.0
    for step, bound in ((1, is_last), (-1, is_first)):
        goal = v.copy()
        todo = np.arange(B)
        while len(todo):
            near, far = (todo, todo + 1) if step > 0 else (todo + 1, todo)
            rises = goal[far] > v[near]
            new = goal[far].copy()
            rising = todo[rises]
            new[rises] = np.minimum(new[rises], reachable_speed(v[near[rises]], length[rising], A[rising], J[rising]))
            changed = new != v[far]
            v[far[changed]] = new[changed]
            todo = todo[changed & ~bound[todo]] + step
    return v
