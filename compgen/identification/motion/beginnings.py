"""Which controller a log shows where its runs begin in more than one way, by the evidence of each.

FANUC's motion code smooths a run, from a stop to the next, by how long its first statement lasts (docs/motion.md). So
a controller is known for runs that begin as those of the log whose bends it explains. Where one controller does not
explain all, each way to begin has its own, fitted and judged on runs that begin so.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import rms
from compgen.core.pose import Pose
from compgen.identification.motion.fit import NOTHING
from compgen.identification.motion.identify import (
    LEAST_BLOCKS,
    IdentifiedMotion,
    identify,
    limit_of,
)
from compgen.identification.motion.timed_windows import FIRST, RETIMED, FittedWindows, first_motion
from compgen.identification.motion.windows import Window, keeps_law, residuals
from compgen.robot.motion import ControllerMotion, MotionVerdict, RunBeginning
from compgen.robot.robot import Robot

SURELY_LONG = 1.4  # of a smoothing that may be that of short runs: of long ones it is up to 1.31 times as long


def identify_runs(
    timed: FittedWindows,
    robot: Robot,
    tool: Pose,
    noise: float,
    progress: Callable[[float], None] = lambda share: None,
) -> IdentifiedMotion:
    """Fit every kind of controller, to runs that begin alike where one controller does not explain all of them.

    Args:
        timed: Windows of a run, and the first motion that is fitted to them.
        robot: Its arm and interpolation period.
        tool: TCP in the flange.
        noise: Of the log's positions, of one coordinate [m].
        progress: Called with the share done.
    """
    windows = timed.windows
    whole = identify(windows, robot, tool, noise, progress, first=timed.motion)
    if not whole.chosen.kind.count:
        return whole
    tried = whole.verdict is MotionVerdict.FORETELLS or whole.misses_bends
    if tried and (other := _grown(whole, windows, robot, tool, noise)) is not None:
        return other
    first, long = np.array([w.first for w in windows]), whole.motion.long
    begins = {RunBeginning.SHORT: first <= long, RunBeginning.LONG: first > SURELY_LONG * long}
    begun = {each: [windows[int(k)] for k in np.flatnonzero(does)] for each, does in begins.items() if does.any()}
    explained = {beginning: explains(whole.motion, noise, some, robot, tool) for beginning, some in begun.items()}
    whole = replace(whole, runs_began=frozenset(beginning for beginning, is_so in explained.items() if is_so))
    if len(begun) < len(begins) or (whole.verdict is MotionVerdict.COMMANDABLE and False not in explained.values()):
        return whole
    known = list[IdentifiedMotion]()
    for beginning, some in begun.items():
        if len(np.unique(np.concatenate([w.block for w in some]))) >= LEAST_BLOCKS:
            fit = replace(identify(some, robot, tool, noise), runs_began=frozenset([beginning]))
            known += [fit] if fit.verdict is MotionVerdict.COMMANDABLE else []
    if len(known) < len(begins):
        return known[0] if known else whole
    both = _joined(*known)
    follows = (first > both.motion.long) == begins[RunBeginning.LONG]
    return both if follows[np.logical_or(*begins.values())].all() else whole


def _grown(
    alike: IdentifiedMotion, windows: Sequence[Window], robot: Robot, tool: Pose, noise: float
) -> IdentifiedMotion | None:
    """Two means that grow with the arm's spread, where they explain a log a lot better than alike ones."""
    spread = np.concatenate([w.spread for w in windows])
    if not np.ptp(spread):
        return None
    kind = replace(FIRST, reach_at=float(spread.max()))
    first = first_motion(windows, robot, tool, kind)
    left, before = (rms(residuals(windows, robot, tool, each)) for each in (first, alike.motion))
    if left >= RETIMED * before:
        return None
    grown = identify(windows, robot, tool, noise, kinds=(NOTHING, kind), first=first)
    return grown if grown.verdict is not MotionVerdict.REJECTED else None


def explains(
    controller: ControllerMotion, noise: float, windows: Sequence[Window], robot: Robot, tool: Pose
) -> bool | None:
    """Whether a controller explains the bends of windows well enough to be commanded against; None where none is."""
    kept = keeps_law(windows, robot, tool, controller)
    if not kept.any():
        return None
    plain, left = (
        rms(residuals(windows, robot, tool, motion)[kept, :3]) * float(np.sqrt(3 / 2))  # of one coordinate
        for motion in (ControllerMotion(), controller)
    )
    return left <= limit_of(plain, left, noise) if plain > limit_of(0.0, 0.0, noise) else None


def _joined(short: IdentifiedMotion, long: IdentifiedMotion) -> IdentifiedMotion:
    """One motion for both ways to begin, as well known as the worse of two; short's where they are of other kinds."""
    worse = short if short.held_out > long.held_out else long
    if not short.chosen.kind == long.chosen.kind == FIRST:
        return short
    return replace(
        worse,
        motion=replace(short.motion, after_long=long.motion.moving_averages),
        intervals=np.concatenate([short.intervals, long.intervals]),
        largest=max(short.largest, long.largest),
        slowed=max(short.slowed, long.slowed),
        runs_began=frozenset(RunBeginning),
    )
