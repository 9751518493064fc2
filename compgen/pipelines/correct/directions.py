"""Where joints and TCP come from along a program that exists: the direction of motion at its stations, and midway."""

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState, direction_states, reversal_widths
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.stations import commanded, on_the_way, samples
from compgen.fanuc.analysis.traversal import Drive
from compgen.pipelines.job import Cell

PARTS = 16  # of each straight way, half of them before its middle


def course(cell: Cell, poses: Poses, drive: Drive) -> tuple[DirectionState, DirectionState]:
    """Direction of motion at each station, and halfway on the way to it; ``NO_DIRECTION`` for an arm without memory.

    Straight ways are followed in steps, joint motions turn each joint one way. An unknown station moves nothing, and
    jumps, calls and loops are not followed.
    """
    memory = reversal_widths(cell.sources)
    if memory is None:
        return NO_DIRECTION, NO_DIRECTION
    station, fraction = samples(poses, drive, np.arange(1, PARTS) / PARTS)
    position, rotation = on_the_way(poses, drive, station, fraction)
    theta, _ = commanded(cell.robot, poses, drive, station, fraction, position, rotation)
    along = direction_states(memory, theta, position)
    at, half = fraction == 1, fraction == 0.5
    return _picked(along, station, at, len(drive.pose)), _picked(along, station, half, len(drive.pose))


def _picked(along: DirectionState, station: IntArray, rows: BoolArray, count: int) -> DirectionState:
    direction, travel = np.zeros((count, 6)), np.zeros((count, 3))
    direction[station[rows]], travel[station[rows]] = along.direction[rows], along.travel[rows]
    return DirectionState(direction, travel)
