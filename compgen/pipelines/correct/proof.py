"""The proof of a correction: where the twin goes with the written text, against the planned poses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, dot, norm
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import rotation_vector
from compgen.error_model.direction_memory import reversal_widths
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.stations import chains, commanded_joints, interpolate_poses, path_samples
from compgen.fanuc.analysis.traversal import Traversal
from compgen.job.job import Cell
from compgen.pipelines.correct.starts import PLANNED, Weighted, duties_until, slowed
from compgen.pipelines.correct.station_corrections import LARGEST_TURN, explained_turns, heat_motion
from compgen.thermal import Duty, initial_state
from compgen.thermal.network import with_losses
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import Twin

SUBDIVISIONS = 4  # of each straight line, where it is judged
FINE_SUBDIVISIONS = 32  # for an arm whose errors depend on the direction of motion


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ProgramExecution:
    """Where the actual tool is, at M samples: each station with known joints, and places on each straight line."""

    station: IntArray  # (M,) the next one, or the one reached
    fraction: Array  # (M,) of the way to it; 1 is the station itself
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    actual: Pose  # M of the TCP
    commanded: Pose  # M of the TCP
    theta: Array  # (M, 6) [rad] that the controller commands


def execute_program(
    cell: Cell,
    poses: Poses,
    drive: Traversal,
    before: Sequence[Duty],
    progress: Callable[[float], None] = lambda share: None,
    starts: Weighted = PLANNED,
) -> ProgramExecution:
    """A program as read from its text, executed on the twin.

    The twin steps its own heat through the program's times, commands the joints that CONFIG or the joint form name,
    and confirms each with pinocchio's nominal arm. Of several starts it has the times of the first and the weighted
    mean of their rises.

    Raises:
        TwinError: The controller's inverse and pinocchio disagree.
    """
    faults = faults_of(cell.sources)
    subdivisions = SUBDIVISIONS if faults is None else FINE_SUBDIVISIONS
    station, fraction = path_samples(poses, drive, np.arange(1, subdivisions) / subdivisions)
    heat = [
        _rise_at_samples(cell, poses, slowed(drive, s.override), duties_until(before, s), station, fraction)
        for _, s in starts
    ]
    time, rise = heat[0][0], np.asarray(sum(weight * rise for (weight, _), (_, rise) in zip(starts, heat, strict=True)))
    tcp = interpolate_poses(poses, drive, station, fraction)
    pose = drive.pose[station]
    theta, flange = commanded_joints(cell.robot, poses, drive, station, fraction, tcp)
    twin = Twin(robot=cell.robot, heat=cell.heat, profiles=cell.profiles, tool=IDENTITY, faults=faults)
    twin.confirm_inverse(theta, flange, poses.number[pose] - 1, lambda share: progress(share / 2))
    tools = poses.tools[poses.tool[pose]]
    # an arm that remembers its direction knows it from where a chain of sure neighbours begins
    pieces = [slice(0, len(theta))] if reversal_widths(cell.sources) is None else chains(drive, station)
    parts = [tcp[:0]]
    for some in pieces:
        its_tools = None if faults is None else tools[some]
        parts.append(twin.actual_pose(theta[some], rise[some], lambda share: None, its_tools))
        progress(0.5 + some.stop / max(len(theta), 1) / 2)
    actual = Pose.concatenate(parts)
    actual = actual @ tools if faults is None else actual
    return ProgramExecution(
        station=station, fraction=fraction, time=time, rise=rise, actual=actual, commanded=tcp, theta=theta
    )


class PoseErrors(NamedTuple):
    """How far the tool is from its target at M samples."""

    distance: Array  # (M,) [m]
    angle: Array  # (M,) [rad]


def pose_errors(execution: ProgramExecution, target: Pose) -> PoseErrors:
    """How far the actual tool is from its target at each sample."""
    error = execution.actual.position - target.position
    turn = rotation_vector((target.inverse() @ execution.actual).rotation)
    return PoseErrors(np.sqrt(dot(error, error)), np.sqrt(dot(turn, turn)))


def unexplained_turns(planned: ProgramExecution, corrected: ProgramExecution) -> Array:
    """How far joints turn from the planned to the corrected text beyond what a correction explains, (M, 6) [rad].

    At stations that is what the tool's own move explains; on the way to one that lies near a singularity joints follow
    the correction of the other end, so there it is what any correction does.
    """
    moved = norm(corrected.commanded.position - planned.commanded.position)
    turned = norm(rotation_vector((planned.commanded.inverse() @ corrected.commanded).rotation))
    explained = np.where(corrected.fraction < 1, LARGEST_TURN, explained_turns(moved, turned))
    return np.asarray(np.abs(corrected.theta - planned.theta) - explained[:, None])


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
    for s, (pause, way) in enumerate(zip(drive.pause.tolist(), drive.duration.tolist(), strict=True)):
        if pause:
            state = pause_goals[s] + (state - pause_goals[s]) * np.exp(-pause * rate)
        begin[s], start[s] = time + pause, state
        state = way_goals[s] + (state - way_goals[s]) * np.exp(-way * rate)
        time += pause + way
    elapsed = fraction * drive.duration[station]
    decay = np.exp(-elapsed[:, None] * rate)
    states = way_goals[station] + (start[station] - way_goals[station]) * decay
    return begin[station] + elapsed, states @ cell.heat.outputs.T
