"""How much of each joint's limits a motion uses, after mapping it to the joints on a dense grid."""

import numpy as np

from compgen.core.arrays import Array
from compgen.planning import joint_curve
from compgen.planning.joint_curve import JointCurve
from compgen.planning.retiming.blocks import Partition
from compgen.planning.retiming.phases import Passage, Phases
from compgen.robot.robot import Robot

SAMPLES = 5  # of a stretch of constant jerk


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
        used = joints.utilisation(robot, s, interval, rates)
        largest = np.maximum(largest, used.max(axis=0))
    return largest.reshape(3, 6)
