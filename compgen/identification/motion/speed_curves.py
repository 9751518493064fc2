"""Speed over time at the sharpest corner and at a stop of a log, beside what the controller's motion makes of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, lengths_along, owns, row_norms
from compgen.core.pose import Pose
from compgen.identification.motion.windows import BEFORE_STOP, Window, fitted, smoothed
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse

AROUND = 0.8  # [s] of a corner on both sides
BEFORE = 1.2  # [s] of a stop
LEAST = 12  # rows


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("R",), logged=("R",), modelled=("R",))
class SpeedStretch:
    """R rows of a log about one place."""

    what: str  # corner, stop
    at: str  # the position, ``P[n]``
    off: float  # [m] from the programmed path, at most
    time: Array  # (R,) [s] from the place on
    logged: Array  # (R,) [m/s]
    modelled: Array  # (R,) [m/s]


def shown_speeds(
    course: ProgramCourse, windows: Sequence[Window], robot: Robot, tool: Pose, motion: ControllerMotion
) -> tuple[SpeedStretch, ...]:
    """The place where the log is farthest off the programmed path, and the last stop that it shows.

    Args:
        course: Of the program.
        windows: Of the run.
        robot: Its period, and its arm where joints are smoothed.
        tool: TCP in the flange.
        motion: What the controller does.
    """
    corner = max(windows, key=lambda window: float(row_norms(window.off).max()))
    row = int(np.argmax(row_norms(corner.off)))
    places = [("corner", corner, row, AROUND, AROUND)]
    stopping = [w for w in windows if (w.ramp == BEFORE_STOP).sum() >= LEAST]
    if stopping:
        places.append(("stop", stopping[-1], len(stopping[-1].shown) - 1, BEFORE, 0.0))
    stretches = []
    for what, window, at, before, after in places:
        since = window.shown - window.shown[at]
        rows = np.flatnonzero((since >= -before) & (since <= after))
        if len(rows) < LEAST:
            continue
        logged, modelled = _speeds(window, robot, tool, motion)
        stretches.append(
            SpeedStretch(
                what=what,
                at=course.point_name(float(window.row_arc[at])),
                off=float(row_norms(window.off[rows]).max()),
                time=since[rows],
                logged=logged[rows],
                modelled=modelled[rows],
            )
        )
    return tuple(stretches)


def _speeds(window: Window, robot: Robot, tool: Pose, motion: ControllerMotion) -> tuple[Array, Array]:
    """Of a window's rows, logged and as the motion has them when it passes there, (R,) [m/s] each."""
    ticks = np.flatnonzero(np.append(True, np.diff(window.shown) > 0))  # coarse clocks show a time twice
    speed = np.gradient(lengths_along(window.place)[ticks], window.shown[ticks])
    logged = np.interp(window.shown, window.shown[ticks], speed)
    time, curve, _ = smoothed(window, robot, tool, motion)
    arc = lengths_along(curve)
    late = window.shown - fitted(window, robot, tool, motion)[1]
    return logged, np.interp(window.shown - np.median(late), time, np.gradient(arc, time))
