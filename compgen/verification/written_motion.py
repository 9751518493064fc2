"""When a written program passes its positions and with which joints, how much runs at feed, what joints are asked.

It is read from the text by the twin's clock. On the line to position n, asked for v_n (the written speed, or what
its run between two stops reaches where that is too short), the joints turn with

    qd_n = (theta_n - theta_{n-1}) v_n / |line n|

and where one line goes over into the next without a stop they change over half of both lines; an arc counts as a row
of short ones:

    qdd_n = (qd_{n+1} - qd_n) / ((t_n + t_{n+1}) / 2),     t_n = |line n| / v_n
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, column_extremes, frozen, owns
from compgen.verification.motion_effect import MotionEffect, motion_effect
from compgen.verification.twin import PreparedProgram
from compgen.verification.twin.timing import SAME_POSITION

AT_FEED = 1e-9  # relative


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("N",), theta=("N", 6), joint_range=(2, 6), use=(2, 6))
class WrittenMotion:
    """The motion of a text of N positions."""

    time: Array  # (N,) [s] when each position is passed
    theta: Array  # (N, 6) [rad] of the positions as they are written
    joint_range: Array  # (2, 6) [rad] least and largest of each joint on the way, on arcs too
    at_feed: float  # share of the length that is driven at feed
    use: Array  # (2, 6) largest share of each joint's speed and acceleration limit
    as_written: float  # [s] duration of the lines as they are
    rounded_up: float  # [s] duration where every line takes whole interpolation periods
    hardest: int  # the position, from 1, where a joint's acceleration is nearest to its limit or farthest over
    effect: MotionEffect | None = None  # of the controller's motion; None: not looked at


def read_motion(
    prepared: PreparedProgram, length: Array, feed: float | Array, touching: BoolArray | None = None
) -> WrittenMotion:
    """What the twin's clock reads in a program.

    Args:
        prepared: The program.
        length: Of its lines, (N - 1,) [m].
        feed: Wanted [m/s], on all lines or on each, (N - 1,).
        touching: The lines on the part, (N - 1,), for what the controller's motion does there.
    """
    program, chords = prepared.program, prepared.chords
    robot = prepared.twin.robot.at_acceleration(program.acc)
    length = np.maximum(length, SAME_POSITION)
    stops = np.flatnonzero(program.fine)
    reached = np.repeat(np.maximum.reduceat(prepared.timing.highest, stops[:-1]), np.diff(stops))
    word = np.minimum(program.speed, reached)[chords.segment]
    whole = np.maximum(prepared.sweep.length, SAME_POSITION)[chords.segment]
    share = np.maximum(chords.length, SAME_POSITION) / whole
    duration = (share * length[chords.segment]) / word
    between = (duration[1:] + duration[:-1]) / 2
    between[chords.program.fine[1:-1]] = np.inf  # a stop is no change from one line to the next
    use, hardest = np.zeros((2, 6)), 1
    for joint in range(6):
        qd = np.diff(prepared.chord_theta[:, joint]) / duration
        qdd = np.abs(np.diff(qd)) / between
        use[0, joint] = np.abs(qd).max(initial=0.0) / robot.speed[joint]
        share = qdd.max(initial=0.0) / robot.acceleration[joint]
        if share > use[1].max():
            hardest = int(np.searchsorted(chords.rows, np.argmax(qdd) + 1, side="right"))
        use[1, joint] = share
    at_feed = float(prepared.timing.at_word[program.speed >= feed * (1 - AT_FEED)].sum()) / float(length.sum())
    as_written = float(prepared.timing.unrounded[-1])
    effect = None if touching is None else motion_effect(prepared, touching)
    return WrittenMotion(
        time=frozen(prepared.timing.time),
        theta=frozen(prepared.theta),
        joint_range=np.stack(column_extremes(prepared.chord_theta)),
        at_feed=at_feed,
        use=frozen(use),
        as_written=as_written,
        rounded_up=prepared.timing.rounded_up,
        hardest=hardest,
        effect=effect,
    )
