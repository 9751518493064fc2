r"""Refinement: waypoints so close that straight lines between them carry the correction.

Between two waypoints the program is a line and so is its correction; by what the error bends away from a line in
between, the TCP stays off the path. That falls with the square of the segment's length L: there waypoints are to be no
farther apart than

    L / sqrt( bend / (share of the chord) )

and the path is laid out anew, in whole interpolation periods again. A measured map, a harmonic or the blend after a
reversal asks for more waypoints than the path's own chord does; thermal growth never. By how much the correction will
lengthen a line is told as well: it must not last a period more.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, dot, norm
from compgen.core.pose import Pose
from compgen.error_model.direction_memory import NO_DIRECTION, direction_states, reversal_widths
from compgen.error_model.model import ErrorModel
from compgen.error_model.source import Source
from compgen.error_model.sources.thermal_growth import ThermalGrowth
from compgen.planning import toolpath
from compgen.planning.toolpath import LayoutSettings, SegmentLimits, ToolPath
from compgen.planning.whole_periods import STRETCH
from compgen.robot import inverse_kinematics, joint_path
from compgen.robot.inverse_kinematics import Posture, flange_from_tool
from compgen.robot.robot import Robot

SAMPLES = 4  # of the error in a segment
MAX_ROUNDS = 4  # of cutting
CHUNK = 4096  # segments at a time
LITTLE = 1e-3  # of a segment's length: by so much it need not be shorter
CHORD_SHARE = 0.3  # of the chord: how far the error may bend away from a line within a segment


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ErringArm:
    """An arm that drives a path on one branch, and its error."""

    robot: Robot
    posture: Posture
    tool: Pose  # TCP in the flange
    sources: Sequence[Source]
    model: ErrorModel  # of the sources

    def solve(self, pose: Pose) -> Array:
        """Joints (N, 6) [rad] of N poses of the TCP, each for itself."""
        return inverse_kinematics.solve_flange(self.robot, flange_from_tool(pose, self.tool), self.posture).theta

    def follow(self, path: ToolPath) -> Array:
        """Joints at the waypoints, (N, 6) [rad].

        Raises:
            ImpossibleError: The robot cannot drive the path.
        """
        return joint_path.follow_branch(self.robot, flange_from_tool(path.target, self.tool), self.posture)


def refine(arm: ErringArm, path: ToolPath, feed: float, layout: LayoutSettings) -> tuple[ToolPath, Array]:
    """The path with waypoints close enough for its errors, and its joints (N, 6) [rad].

    A segment is to be shorter until its error bends away from a line by less than a share of the chord, or until it
    takes one interpolation period.

    Args:
        arm: That drives it.
        path: With waypoints as close as its chord asks for.
        feed: [m/s].
        layout: How its waypoints are laid.

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    theta = arm.follow(path)
    if all(isinstance(source, ThermalGrowth) for source in arm.sources):
        return path, theta
    limits: list[SegmentLimits] = []
    for _ in range(MAX_ROUNDS):
        length = np.diff(path.arc)
        bend, stretch = error_shape(arm, path, theta)
        needed = np.sqrt(bend / (CHORD_SHARE * layout.chord))
        shortest = np.minimum(length, feed * arm.robot.controller.period * path.pace)
        wanted = np.where(needed > 1, np.maximum(length / np.maximum(needed, 1), shortest), np.inf)
        if not (
            (wanted < length * (1 - LITTLE)).any() or (layout.periods and not limits and (stretch > STRETCH).any())
        ):
            break
        limits.append(SegmentLimits(path.arc, wanted, stretch))
        path = toolpath.relaid(path, limits, layout)
        theta = arm.follow(path)
    return path, theta


def error_shape(arm: ErringArm, path: ToolPath, theta: Array) -> tuple[Array, Array]:
    """How far each segment's error bends away from the line between its ends, (N - 1,) [m], and lengthens it, (N - 1,).

    What is corrected goes the other way: where the error shortens a line, its correction lengthens it.
    """
    S = len(path.arc) - 1
    widths, direction_state = reversal_widths(arm.sources), NO_DIRECTION
    bend, stretch = np.empty(S), np.empty(S)
    cold = np.zeros((1, arm.model.actual.size1_in(1)))  # what heat adds bends over metres of path
    fractions = np.arange(SAMPLES) / SAMPLES
    for begin in range(0, S, CHUNK):
        chunk = np.arange(begin, min(begin + CHUNK, S))
        segment = np.append(np.repeat(chunk, SAMPLES), chunk[-1])
        fraction = np.append(np.tile(fractions, len(chunk)), 1.0)
        target = path.at(segment, fraction).pose
        between = theta[segment] + fraction[:, None] * (theta[segment + 1] - theta[segment])
        joints = joint_path.nearest_turns(arm.solve(target), between)
        direction_state = direction_states(widths, joints, target.position, direction_state)
        error = arm.model.actual_pose(joints, cold, direction_state).position - target.position
        ends, way = error[::SAMPLES], np.diff(target.position[::SAMPLES], axis=0)
        line = ends[:-1, None] + fractions[:, None] * np.diff(ends, axis=0)[:, None]
        bend[chunk] = norm(error[:-1].reshape(-1, SAMPLES, 3) - line).max(axis=1)
        stretch[chunk] = np.maximum(-dot(np.diff(ends, axis=0), way) / dot(way, way), 0.0)
    return bend, stretch
