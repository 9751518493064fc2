"""When a written program passes its positions, how much of it runs at feed, and what it asks of the joints.

It is read from the text by the twin's clock. On the line to position n, driven at v_n (the written speed, or what
a run too short for it reaches), the joints turn with

    qd_n = (theta_n - theta_{n-1}) v_n / |line n|

and where one line goes over into the next without a stop they change over half of both lines:

    qdd_n = (qd_{n+1} - qd_n) / ((t_n + t_{n+1}) / 2),     t_n = |line n| / v_n
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, frozen, own
from compgen.verification.twin import PreparedProgram
from compgen.verification.twin.timing import SAME_POSITION, ramps_length

AT_FEED = 1e-9  # relative


@dataclass(frozen=True, eq=False, slots=True)
class WrittenMotion:
    """The motion of a text of N positions."""

    time: Array  # (N,) [s] when each position is passed
    at_feed: float  # share of the length that is driven at feed
    use: Array  # (2, 6) largest share of each joint's speed and acceleration limit
    hardest: int  # the position, from 1, where a joint's acceleration is nearest to its limit or farthest over

    def __post_init__(self) -> None:
        own(self, time=("N",), use=(2, 6))


def read_motion(prepared: PreparedProgram, length: Array, feed: float) -> WrittenMotion:
    """What the twin's clock reads in a program.

    Args:
        prepared: The program.
        length: Of its lines, (N - 1,) [m].
        feed: Wanted [m/s].
    """
    robot, program = prepared.twin.robot, prepared.program
    length = np.maximum(length, SAME_POSITION)
    duration = length / prepared.highest
    qd = np.diff(prepared.theta, axis=0) / duration[:, None]
    use = np.zeros((2, 6))
    use[0] = np.abs(qd).max(axis=0, initial=0.0) / robot.speed
    passed = np.flatnonzero(~program.fine[1:-1])  # line n and n + 1 meet at position n + 1 without a stop
    hardest = 1
    if len(passed):
        qdd = np.abs(qd[passed + 1] - qd[passed]) / ((duration[passed + 1] + duration[passed]) / 2)[:, None]
        share = qdd / robot.acceleration
        use[1] = share.max(axis=0)
        hardest = int(passed[int(np.argmax(share.max(axis=1)))]) + 2
    fast = program.speed >= feed * (1 - AT_FEED)
    ramps = ramps_length(robot, program, length, prepared.theta, fast)
    at_feed = max(0.0, float(length[fast].sum()) - ramps) / float(length.sum())
    return WrittenMotion(frozen(prepared.time), at_feed, frozen(use), hardest)
