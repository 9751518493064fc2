r"""The length of path that each sample of an execution stands for: by it a corrected program's errors are averaged.

From a sample to the next on the same way, or from the station that the robot surely comes from to the first sample of
a way, the tool travels a length d; where both are judged, half of it belongs to each:

    w_m = (d_before + d_after) / 2,    rms = sqrt(sum w e^2 / sum w)

d is the share of a straight line, the share of a circle's arc, and on a joint motion the length of the tool's own way
while all joints turn evenly, on the nominal arm. What the robot may drive between two stations whose order is not sure
counts for nothing; where nothing is left that counts, all judged samples count alike.
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.program.driven import NONE, DrivenProgram
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

JOINT_PIECES = 8  # chords of the tool's way on a joint motion: 0.2 % short for a quarter turn


def sample_lengths(robot: Robot, driven: DrivenProgram, station: IntArray, fraction: Array, judged: BoolArray) -> Array:
    """Length of path that each sample stands for, (M,) [m].

    Args:
        robot: The nominal arm.
        driven: The program.
        station: Of each sample, rising, (M,).
        fraction: Of the way to it, rising within a station, (M,).
        judged: Samples that are averaged, (M,); the others get 0.

    Returns:
        Lengths of which at least one is above 0, or 1 for every judged sample.
    """
    sample = np.full(len(driven.pose) + 1, NONE)  # of each station itself; the last belongs to NONE
    sample[station[fraction == 1]] = np.flatnonzero(fraction == 1)
    follows = np.concatenate([[False], station[1:] == station[:-1]])[: len(station)]
    before = np.where(follows, np.arange(len(station)) - 1, sample[driven.origin[station]])
    rows = np.flatnonzero(judged & (before != NONE))
    rows = rows[judged[before[rows]]]
    share = fraction[rows] - np.where(follows[rows], fraction[before[rows]], 0.0)
    ways, of_way = np.unique(station[rows], return_inverse=True)
    half = _way_lengths(robot, driven, ways)[of_way] * share / 2
    lengths = np.zeros(len(station))
    np.add.at(lengths, rows, half)
    np.add.at(lengths, before[rows], half)
    return lengths if lengths.any() else judged.astype(float)


def _way_lengths(robot: Robot, driven: DrivenProgram, ways: IntArray) -> Array:
    """Length of the tool's way to stations from their origins, (n,) [m]."""
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    lengths = np.asarray(np.linalg.norm(driven.at.tcp.position[end] - driven.at.tcp.position[start], axis=1))
    arcs = ~driven.line[ways] & ~driven.joint[ways] & (driven.origin[ways] == ways - 1)
    lengths[arcs] = driven.length[ways[arcs]]
    turned = np.flatnonzero(driven.joint[ways])
    if len(turned):
        at = np.linspace(0, 1, JOINT_PIECES + 1)[:, None]
        theta = driven.at.theta[start[turned], None] * (1 - at) + driven.at.theta[end[turned], None] * at
        tools = np.repeat(driven.at.tools.position[driven.at.tool[end[turned]]], len(at), axis=0)
        place = flange_pose(robot, theta.reshape(-1, 6)).act(tools)
        chords = np.diff(place.reshape(len(turned), len(at), 3), axis=1)
        lengths[turned] = np.linalg.norm(chords, axis=2).sum(axis=1)
    return np.asarray(np.nan_to_num(lengths, nan=0.0))
