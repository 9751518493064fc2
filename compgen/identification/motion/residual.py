"""How far logged rows are from the curve that a controller's motion makes of the command."""

from collections.abc import Sequence

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.identification.motion.windows import Window
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.course import arc_lengths_of, tangents_of
from compgen.verification.executed.tracking import nearest
from compgen.verification.twin.controller.smoothing import moments, smooth


def residuals(windows: Sequence[Window], robot: Robot, tool: Pose, motion: ControllerMotion) -> Array:
    """From the smoothed curve's nearest point to each row, (R, 3) [m], window after window.

    Args:
        windows: Of a run.
        robot: Its period, and its arm where joints are smoothed.
        tool: TCP in the flange.
        motion: What the controller does; its lag is of no consequence.
    """
    if not motion.is_smooth:
        return np.concatenate([window.off for window in windows])
    period, parts = robot.controller.period, []
    delay = moments(motion, period).delay / period
    for window in windows:
        curve = _smoothed(window, robot, tool, motion)
        arc = arc_lengths_of(curve)
        # where on the smoothed curve a row is expected: where the command was a delay before
        late = np.interp(np.arange(len(curve)) - delay, np.arange(len(curve)), window.arc)
        expected = np.interp(window.row_arc, late, arc)
        parts.append(nearest(curve, arc, tangents_of(curve), window.place, expected)[2])
    return np.concatenate(parts)


def _smoothed(window: Window, robot: Robot, tool: Pose, motion: ControllerMotion) -> Array:
    if motion.space == "joint" and window.theta is not None:
        theta = smooth(window.theta, robot.controller.period, motion)
        return (flange_pose(robot, theta) @ tool).position
    return smooth(window.position, robot.controller.period, motion)
