r"""Timing of a path: its joints become a curve over the arc length, blocks, speeds at their edges, and motion in time.

One degree of freedom, the arc length s. The way between two stops is cut into blocks with limits of their own
(``blocks``); speeds at the block edges are found by one pass forwards and one back (``edge_speeds``); ruckig then
drives each block from state to state (``state_to_state``).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, frozen, owns
from compgen.core.exceptions import ImpossibleError
from compgen.core.units import MM
from compgen.planning import joint_curve
from compgen.planning.joint_curve import JointCurve
from compgen.planning.retiming.blocks import (
    Blocks,
    Partition,
    cut_blocks,
    limit_blocks,
    smallest_in_blocks,
    stop_ramps,
    whole_steps,
)
from compgen.planning.retiming.phases import Passage, Phases
from compgen.planning.retiming.state_to_state import drive_blocks
from compgen.planning.whole_periods import STRETCH, WORD_STEP
from compgen.robot.robot import Controller, Robot

SAME_FEED = 0.005  # relative: a line of a period that is shorter by so much is written with the feed
SAMPLES = 5  # of a stretch of constant jerk


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("N",), speed=("S",), driven_speed=("S",), utilisation=(3, 6))
class Trajectory:
    """Joint motion along a path, with the speeds its program must name."""

    time: Array  # (N,) [s] at each waypoint, 0 at the first
    speed: Array  # (N - 1,) [m/s] programmed for each segment
    driven_speed: Array  # (N - 1,) [m/s] mean of each segment, its run's stops shared out: what warms the robot
    phases: Phases
    utilisation: Array  # (3, 6) largest share of each joint's speed, acceleration and jerk limit

    def at(self, rows: IntArray) -> "Trajectory":
        """Of the waypoints at rising rows, both ends of every run among them; the motion in between stays."""
        lines = rows[1:] - 1
        return replace(self, time=self.time[rows], speed=self.speed[lines], driven_speed=self.driven_speed[lines])


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
    feed: float | Array,
    progress: Callable[[float], None] = lambda share: None,
    *,
    lines: bool = False,
) -> Trajectory:
    """Fastest constant-feed motion within the joint limits, stopping only where the path demands.

    Args:
        robot: Limits on speed, acceleration and jerk of theta; the interpolation period.
        arc: Arc length at the waypoints, (N,) [m], rising.
        theta: Joint angles there, (N, 6) [rad], smooth between stops.
        stop: Where the robot stops, (N,); true at both ends.
        feed: Wanted speed along the path [m/s], of all segments or of each, (N - 1,).
        progress: Called with the share done.
        lines: Whether segments that are shorter than a period at feed name the speed at which they last one, where the
            joints do not hold their block back. A block has the speed of its shortest segment, and a controller that
            rounds up would take two periods for all others.

    Returns:
        The motion. Segments ``shorter_than_period`` run at length / period. Where the controller rounds up, the
        times at the waypoints are its; phases and the use of limits are those of the motion that is not rounded.

    Raises:
        ImpossibleError: No motion exists within the limits (a limit of zero, or a path of coincident waypoints).
    """
    length = np.diff(arc)
    _check_motion(robot, length)
    feeds = np.broadcast_to(feed, length.shape)
    short = shorter_than_period(length, feeds, robot.controller)
    followable = np.where(short, length / robot.controller.period, feeds)
    joints = joint_curve.fit_joint_curve(arc, theta, stop)
    partition = cut_blocks(arc, stop, followable)
    progress(0.1)
    wanted = smallest_in_blocks(arc, feeds, partition)
    blocks = limit_blocks(robot, joints, partition, followable, wanted, arc)
    progress(0.5)
    phases = drive_blocks(blocks, lambda share: progress(0.5 + 0.2 * share))
    passed = phases.locate(arc)
    utilisation = largest_shares(robot, joints, phases, partition, passed.at(joints.rows))
    time = phases.time(passed)
    time[0], time[-1] = 0.0, phases.end
    speed = _programmed_speeds(arc, time, blocks, partition)
    if lines:
        word = _in_one_period(speed, arc, feeds, blocks, partition, robot.controller)
        speed, time = word, cumulated(np.where(word > speed, length / word, np.diff(time)))  # the text's are by words
    if robot.controller.rounds_up_to_period:
        time = cumulated(robot.controller.line_time(np.diff(time)))
    progress(1.0)
    return Trajectory(
        time=frozen(time),
        speed=frozen(speed),
        driven_speed=frozen(driven_speed(time, length, speed, stop)),
        phases=phases,
        utilisation=utilisation,
    )


def _check_motion(robot: Robot, length: Array) -> None:
    """Raises ImpossibleError where no motion exists at all: segments (N - 1,) [m] without length, limits of zero."""
    if not np.all(length > 0):
        n = int(np.argmin(length)) + 1
        raise ImpossibleError(f"waypoints {n} and {n + 1} coincide; thin the path")
    if not min(robot.speed.min(), robot.acceleration.min(), robot.jerk.min()) > 0:
        raise ImpossibleError("timing: a joint limit on speed, acceleration or jerk is zero; mend the robot file")


def _programmed_speeds(arc: Array, time: Array, blocks: Blocks, partition: Partition) -> Array:
    """The speed that each segment's line names, (N - 1,) [m/s].

    Away from the stops' ramps it is the driven one, so that the program takes the planned time.
    """
    block = _block_of_segment(arc, partition)
    speed = blocks.v[block]
    mean = np.minimum(speed, np.diff(arc) / np.diff(time))
    mean = np.where(mean > speed * (1 - 1e-3), speed, mean)
    return np.where(stop_ramps(blocks, partition)[block], speed, mean)


def _one_period_speed(length: Array, controller: Controller) -> Array:
    r"""Speed at which lines of some lengths (S,) [m] last no longer than one period, whatever is written, (S,) [m/s].

        v = (l (1 + 2 e) + r) / T    with r what digits add to a length, e what a correction stretches it by

    ``whole_periods`` lays a line of one period shorter by that: at 20 mm/s by 1 %, at 2 mm/s by 11 %, for 3 decimals.
    """
    rounding = np.sqrt(3) * MM / 10**controller.decimals
    return np.asarray((length * (1 + 2 * STRETCH) + rounding) / controller.period)


def shorter_than_period(length: Array, feed: Array, controller: Controller) -> BoolArray:
    """Which lines of some lengths (S,) [m] are too short for the feed (S,) [m/s]; none that is laid for a period is."""
    return np.asarray(_one_period_speed(length, controller) < (1 - SAME_FEED) * feed)


def _in_one_period(
    speed: Array, arc: Array, feed: Array, blocks: Blocks, partition: Partition, controller: Controller
) -> Array:
    """Programmed speeds (N - 1,) [m/s] with which segments shorter than a period at feed last no longer than one."""
    length = np.diff(arc)
    short = length < (1 - SAME_FEED) * feed * controller.period
    if not short.any():
        return speed
    followable = np.where(short, length / controller.period, feed)
    free = blocks.v >= whole_steps(smallest_in_blocks(arc, followable, partition))  # not held back by joints
    one = _one_period_speed(length, controller) * (1 + WORD_STEP)
    raised = np.minimum(np.maximum(speed, one), feed)
    return np.where(short & free[_block_of_segment(arc, partition)], raised, speed)


def _block_of_segment(arc: Array, partition: Partition) -> IntArray:
    """The block in which the middle of each segment lies, (N - 1,)."""
    return np.maximum(joint_curve.last_before(partition.begin, (arc[:-1] + arc[1:]) / 2), 0)


def largest_shares(robot: Robot, joints: JointCurve, phases: Phases, partition: Partition, passed: Passage) -> Array:
    """Largest share of each joint's speed, acceleration and jerk limit, (3, 6).

    Args:
        robot: For the limits.
        joints: The curve.
        phases: How it is driven.
        partition: The blocks that the phases are of.
        passed: When each knot is passed, (K,).
    """
    run, ends = partition.run[phases.block], joints.interval_before(partition.end, partition.run)[phases.block]
    # every knot that is no stop, with both ends and three inner points of each phase
    inner = np.ones(len(joints.arc), dtype=bool)
    inner[joints.first] = inner[joints.last] = False
    knot = np.flatnonzero(inner)
    k, t = passed.at(knot)
    begin, end = joints.arc[joints.first], joints.arc[joints.last]
    largest, share = np.zeros(18), np.linspace(0, 1, SAMPLES)
    for phase in np.array_split(np.arange(len(run)), 1 + SAMPLES * len(run) // joint_curve.CHUNK):
        inside = slice(*np.searchsorted(k, [phase[0], phase[-1] + 1]))
        which = np.concatenate([k[inside], np.repeat(phase, SAMPLES)])
        since = np.concatenate([t[inside], np.multiply.outer(phases.duration[phase], share).ravel()])
        motion, runs = phases.motion(Passage(which, since)), run[which]
        rates = np.column_stack([motion.v, motion.a, motion.j])
        s = np.clip(motion.s, begin[runs], end[runs])
        n = len(k[inside])
        within = np.minimum(joints.interval(np.maximum.accumulate(s[n:]), runs[n:]), ends[which[n:]])
        interval = np.concatenate([knot[inside], within])
        largest = np.maximum(largest, joints.utilisation(robot, s, interval, rates).max(axis=0))
    return largest.reshape(3, 6)
