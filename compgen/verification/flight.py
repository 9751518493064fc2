"""Where the twin takes the tool on a driven program: at its stations, and between them on ways that are sure."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, dot
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_vector
from compgen.program.driven import DrivenProgram
from compgen.program.ways import chains, commanded_joints, interpolate_poses, path_samples
from compgen.thermal import Duty, initial_state
from compgen.thermal.ensemble import Start, duties_before
from compgen.thermal.model import with_losses
from compgen.thermal.schedule import History
from compgen.verification.twin import Twin
from compgen.verification.twin.heat import mode_states, state_after_duties

#: starts, and how much each counts in the mean of the rises
Weighted = Sequence[tuple[float, Start]]
PLANNED: Weighted = ((1.0, Start()),)
SUBDIVISIONS = 4  # of each straight line, where it is judged
FINE_SUBDIVISIONS = 32  # for an arm whose errors depend on the direction of motion


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Flight:
    """Where the actual tool is, at M samples: each station with known joints, and places on each straight line."""

    station: IntArray  # (M,) the next one, or the one reached
    fraction: Array  # (M,) of the way to it; 1 is the station itself
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    actual: Pose  # M of the TCP
    commanded: Pose  # M of the TCP
    theta: Array  # (M, 6) [rad] that the controller commands


def fly(
    twin: Twin,
    driven: DrivenProgram,
    before: Sequence[Duty],
    progress: Callable[[float], None] = lambda share: None,
    starts: Weighted = PLANNED,
    air: float = 0.0,
    subdivisions: int | None = None,
) -> Flight:
    """A program as read from its text, executed on the twin.

    The twin steps its own heat through the program's times, commands the joints that CONFIG or the joint form name,
    and confirms each with pinocchio's nominal arm. Of several starts it has the times of the first and the weighted
    mean of their rises.

    Args:
        twin: The real arm, to its flange: each position has its own tool.
        driven: As read from the text.
        before: What the cell did.
        progress: Called with the share done.
        starts: Of the program, and how much each counts.
        air: How much warmer than the reference it is, all day and before [K].
        subdivisions: Of each straight line; default as ``subdivisions_for`` has it.

    Raises:
        TwinError: The controller's inverse and pinocchio disagree.
    """
    subdivisions = subdivisions or subdivisions_for(twin)
    station, fraction = path_samples(driven, np.arange(1, subdivisions) / subdivisions)
    history = History(before=tuple(before))
    heat = [
        _rise_at_samples(twin, driven.at_override(s.override), duties_before(history, s), station, fraction, air)
        for _, s in starts
    ]
    time, rise = heat[0][0], np.asarray(sum(weight * rise for (weight, _), (_, rise) in zip(starts, heat, strict=True)))
    tcp = interpolate_poses(driven, station, fraction)
    pose = driven.pose[station]
    theta = commanded_joints(twin.robot, driven, station, fraction, tcp)
    tools = driven.at.tools[driven.at.tool[pose]]
    flange = tcp @ driven.at.tools.inverse()[driven.at.tool[pose]]
    twin.confirm_inverse(theta, flange, driven.at.number[pose] - 1, lambda share: progress(share / 2))
    # an arm that remembers its direction knows it from where a chain of sure neighbours begins
    pieces = [slice(0, len(theta))] if not twin.remembers_direction else chains(driven, station)
    parts = [tcp[:0]]
    for some in pieces:
        its_tools = None if twin.faults is None else tools[some]
        parts.append(twin.actual_pose(theta[some], rise[some], lambda share: None, its_tools))
        progress(0.5 + some.stop / max(len(theta), 1) / 2)
    actual = Pose.concatenate(parts)
    actual = actual @ tools if twin.faults is None else actual
    return Flight(station=station, fraction=fraction, time=time, rise=rise, actual=actual, commanded=tcp, theta=theta)


def subdivisions_for(twin: Twin) -> int:
    """Into how many pieces a straight line is judged."""
    return SUBDIVISIONS if twin.faults is None else FINE_SUBDIVISIONS


class PoseErrors(NamedTuple):
    """How far the tool is from its target at M samples."""

    distance: Array  # (M,) [m]
    angle: Array  # (M,) [rad]


def pose_errors(execution: Flight, target: Pose) -> PoseErrors:
    """How far the actual tool is from its target at each sample."""
    error = execution.actual.position - target.position
    turn = rotation_vector((target.inverse() @ execution.actual).rotation)
    return PoseErrors(np.sqrt(dot(error, error)), np.sqrt(dot(turn, turn)))


def _rise_at_samples(
    twin: Twin, drive: DrivenProgram, before: Sequence[Duty], station: IntArray, fraction: Array, air: float
) -> tuple[Array, Array]:
    """Time (M,) [s] and rise (M, K) [K] of samples."""
    heat, motion = twin.heat, drive.joint_motion()
    warmer = heat.ambient * air
    goals = heat.steady_states(motion) + warmer
    # a robot of which nothing else is known begins in balance with the air
    state = initial_state(heat) + (warmer if heat.start is None else 0.0)
    state = state_after_duties(heat, with_losses(heat, before, motion), state, warmer)
    begin = drive.reached[station + 1] - 1  # of the way to each sample's station, behind the pause before it
    elapsed = fraction * drive.duration[station]
    goal, start = goals[begin], mode_states(heat.rate, state, motion.time, goals)[begin]
    states = goal + (start - goal) * np.exp(-elapsed[:, None] * heat.rate)
    return motion.time[begin] + elapsed, states @ heat.outputs.T
