"""Direction of motion along an existing program: that of joints and TCP at its stations, and midway between them."""

from collections.abc import Sequence

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.error_model.direction_memory import NO_DIRECTION, DirectionState, direction_states, reversal_widths
from compgen.error_model.source import Source
from compgen.program.driven import DrivenProgram
from compgen.program.ways import chains, commanded_joints, interpolate_poses, path_samples
from compgen.robot.robot import Robot

SUBDIVISIONS = 16  # of each straight way; even, so that its middle is a sample


def station_directions(
    robot: Robot, sources: Sequence[Source], driven: DrivenProgram
) -> tuple[DirectionState, DirectionState]:
    """Direction of motion at each station, and midway on the way to it; ``NO_DIRECTION`` for an arm without memory.

    Straight ways are followed in steps; a joint motion turns each joint in one direction. Where it is not sure from
    which station the robot comes, nothing is known of the direction, as at the program's start.
    """
    memory = reversal_widths(sources)
    if memory is None:
        return NO_DIRECTION, NO_DIRECTION
    station, fraction = path_samples(driven, np.arange(1, SUBDIVISIONS) / SUBDIVISIONS)
    tcp = interpolate_poses(driven, station, fraction)
    theta = commanded_joints(robot, driven, station, fraction, tcp)
    states = [direction_states(memory, theta[some], tcp.position[some]) for some in chains(driven, station)]
    if not states:
        return NO_DIRECTION, NO_DIRECTION
    along = DirectionState(
        np.concatenate([state.direction for state in states]), np.concatenate([state.travel for state in states])
    )
    at, half = fraction == 1, fraction == 0.5
    return _at_stations(along, station, at, len(driven.pose)), _at_stations(along, station, half, len(driven.pose))


def _at_stations(along: DirectionState, station: IntArray, rows: BoolArray, count: int) -> DirectionState:
    direction, travel = np.zeros((count, 6)), np.zeros((count, 3))
    direction[station[rows]], travel[station[rows]] = along.direction[rows], along.travel[rows]
    return DirectionState(direction, travel)
