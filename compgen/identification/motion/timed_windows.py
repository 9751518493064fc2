"""Rows of a run with the first motion that is fitted to them, and the times that its statements really took."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from compgen.core.arrays import rms
from compgen.core.pose import Pose
from compgen.identification.motion.fit import CLOSE, STARTS, Kind, fit_kind
from compgen.identification.motion.windows import BEFORE_STOP, Window, residuals, retimed, windows_of
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.judgement import ExecutedRun

FIRST = Kind("cartesian", "means", 2)  # by which it is seen where a motion is slowed down
RETIMINGS = 4  # rounds of taking statements to be as long as a log says
RETIMED = 0.7  # of what is left before: what must be left at most for that to be believed


@dataclass(frozen=True, eq=False, slots=True)
class FittedWindows:
    """Windows of a run, and what the first motion that is fitted leaves of them."""

    windows: list[Window]
    motion: ControllerMotion  # two Cartesian means (``first_motion``)
    left: float  # [m] rms
    timed: bool = False  # whether its statements are as long as the log says


def fitted_windows(run: ExecutedRun, robot: Robot) -> FittedWindows:
    """The windows of a run, as its clock has them.

    Raises:
        InputError: The log has no motion long enough at one override.
    """
    windows, tool = windows_of(run, robot), run.course.tool
    if not windows:
        return FittedWindows(windows, ControllerMotion(), 0.0)
    motion = first_motion(windows, robot, tool)
    return FittedWindows(windows, motion, rms(residuals(windows, robot, tool, motion)))


def timed_windows(run: ExecutedRun, robot: Robot, first: FittedWindows | None = None) -> FittedWindows:
    """The windows of a run, its statements as long as its log says where that explains the log a lot better.

    Args:
        run: Of a log.
        robot: Its arm and interpolation period.
        first: The windows as its clock has them, or timed already, where they are known.

    Raises:
        InputError: The log has no motion long enough at one override.
    """
    best = first or fitted_windows(run, robot)
    if best.timed:
        return best
    for _ in range(RETIMINGS if best.windows else 0):
        run = retimed(run, best.windows, robot, run.course.tool, best.motion)
        timed = fitted_windows(run, robot)
        if timed.left > RETIMED * best.left:
            break
        best = timed
    return replace(best, timed=True)


def first_motion(windows: Sequence[Window], robot: Robot, tool: Pose, kind: Kind = FIRST) -> ControllerMotion:
    """Two Cartesian means fitted to all rows but those before stops, whose statement may have taken another time."""
    block = np.concatenate([w.block for w in windows])
    clear = np.concatenate([w.ramp < BEFORE_STOP for w in windows])
    clear = clear if clear.any() else np.ones_like(clear)
    left, shares = partial(residuals, windows, robot, tool), shares_of(windows, kind)
    return fit_kind(kind, left, clear, block, shares=shares).motion


def shares_of(windows: Sequence[Window], kind: Kind) -> Sequence[float]:
    """From where the fit of a kind begins: close together of two means where CNT n waits by steps."""
    waits = kind == FIRST and any(len(window.corner) for window in windows)
    return CLOSE if waits or kind.reach_at is not None else STARTS
