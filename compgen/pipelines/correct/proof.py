"""The proof of a correction: where the twin goes with the written text, against the planned poses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, dot
from compgen.core.rotations import rotation_vector
from compgen.error_model.direction_memory import reversal_widths
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.stations import chains, commanded_joints, interpolate_poses, path_samples
from compgen.fanuc.analysis.traversal import Traversal
from compgen.pipelines.correct.station_corrections import heat_motion
from compgen.pipelines.job import Cell
from compgen.thermal import Duty, initial_state
from compgen.thermal.network import with_losses
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import Twin

SUBDIVISIONS = 4  # of each straight line, where it is judged
FINE_SUBDIVISIONS = 32  # for an arm whose errors depend on the direction of motion


@dataclass(frozen=True, eq=False, slots=True)
class ProgramRide:
    """Where the actual tool is, at M samples: each station with known joints, and places on each straight line."""

    station: IntArray  # (M,) the next one, or the one reached
    fraction: Array  # (M,) of the way to it; 1 is the station itself
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    position: Array  # (M, 3) [m] actual TCP
    rotation: Array  # (M, 3, 3)


def ride_program(
    cell: Cell,
    poses: Poses,
    drive: Traversal,
    before: Sequence[Duty],
    progress: Callable[[float], None] = lambda share: None,
) -> ProgramRide:
    """A program as read from its text, executed on the twin.

    The twin steps its own heat through the program's times, commands the joints that CONFIG or the joint form name,
    and confirms each with pinocchio's nominal arm.

    Raises:
        TwinError: The controller's inverse and pinocchio disagree.
    """
    faults = faults_of(cell.sources)
    subdivisions = SUBDIVISIONS if faults is None else FINE_SUBDIVISIONS
    station, fraction = path_samples(poses, drive, np.arange(1, subdivisions) / subdivisions)
    time, rise = _rise_at_samples(cell, poses, drive, before, station, fraction)
    position, rotation = interpolate_poses(poses, drive, station, fraction)
    pose = drive.pose[station]
    theta, flange = commanded_joints(cell.robot, poses, drive, station, fraction, position, rotation)
    twin = Twin(cell.robot, cell.heat, cell.profiles, np.zeros(3), np.eye(3), faults)
    twin.confirm_inverse(theta, *flange, poses.number[pose] - 1, lambda share: progress(share / 2))
    tcp = np.array([*(t[0] for t in poses.tools), np.zeros(3)])[poses.tool[pose]]
    turn = np.array([*(t[1] for t in poses.tools), np.eye(3)])[poses.tool[pose]]
    tool = None if faults is None else (turn, tcp)
    # an arm that remembers its direction knows it from where a chain of sure neighbours begins
    pieces = [slice(0, len(theta))] if reversal_widths(cell.sources) is None else chains(drive, station)
    real = np.empty_like(position), np.empty_like(rotation)
    for some in pieces:
        tools = None if tool is None else (tool[0][some], tool[1][some])
        real[0][some], real[1][some] = twin.actual_pose(theta[some], rise[some], lambda share: None, tools)
        progress(0.5 + some.stop / max(len(theta), 1) / 2)
    if tool is None:
        real = real[0] + np.einsum("nij,nj->ni", real[1], tcp), real[1] @ turn
    return ProgramRide(station, fraction, time, rise, *real)


def pose_errors(ride: ProgramRide, position: Array, rotation: Array) -> tuple[Array, Array]:
    """Size of the position error (M,) [m] and angle between actual and target tool (M,) [rad]."""
    error = ride.position - position
    turn = rotation_vector(np.swapaxes(rotation, 1, 2) @ ride.rotation)
    return np.sqrt(dot(error, error)), np.sqrt(dot(turn, turn))


def _rise_at_samples(
    cell: Cell, poses: Poses, drive: Traversal, before: Sequence[Duty], station: IntArray, fraction: Array
) -> tuple[Array, Array]:
    """Time (M,) [s] and rise (M, K) [K] of samples, stepping each mode through every pause and way."""
    rate, motion = cell.heat.rate, heat_motion(poses, drive)
    goals = cell.heat.steady_states(motion)
    pause_goals, way_goals = goals[0::2], goals[1::2]
    time, state = 0.0, initial_state(cell.heat)
    for duty in with_losses(cell.heat, before, motion):
        goal = cell.heat.steady_state(duty)
        state = goal - (goal - state) * np.exp(-duty.duration * rate)
    begin, start = np.empty(len(drive.pose)), np.empty((len(drive.pose), len(rate)))
    for s, (pause, way) in enumerate(zip(drive.pause.tolist(), drive.duration.tolist())):
        if pause:
            state = pause_goals[s] + (state - pause_goals[s]) * np.exp(-pause * rate)
        begin[s], start[s] = time + pause, state
        state = way_goals[s] + (state - way_goals[s]) * np.exp(-way * rate)
        time += pause + way
    elapsed = fraction * drive.duration[station]
    decay = np.exp(-elapsed[:, None] * rate)
    states = way_goals[station] + (start[station] - way_goals[station]) * decay
    return begin[station] + elapsed, states @ cell.heat.outputs.T
