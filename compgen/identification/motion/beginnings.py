"""Which controller a log shows where its runs begin in more than one way, by the evidence of each.

FANUC's motion code smooths a run, from a stop to the next, by how long its first statement lasts (docs/motion.md). So
a controller is known for runs that begin as those of the log whose bends it explains. Where one controller does not
explain all, each way to begin has its own, fitted and judged on runs that begin so.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import rms
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.identification.motion.identify import (
    FIRST,
    LEAST_BLOCKS,
    IdentifiedMotion,
    by_beginning,
    identify,
    limit_of,
)
from compgen.identification.motion.windows import Window, keeps_law, residuals
from compgen.robot.motion import ControllerMotion, MotionVerdict, RunBeginning
from compgen.robot.robot import Robot

MORE = "the program of cgen plan-motion-log has runs of both"


def identify_runs(
    windows: Sequence[Window],
    robot: Robot,
    tool: Pose,
    noise: float,
    progress: Callable[[float], None] = lambda share: None,
) -> IdentifiedMotion:
    """Fit every kind of controller, to runs that begin alike where one controller does not explain all of them.

    Args:
        windows: Of a run.
        robot: Its arm and interpolation period.
        tool: TCP in the flange.
        noise: Of the log's positions, of one coordinate [m].
        progress: Called with the share done.
    """
    whole = identify(windows, robot, tool, noise, progress)
    explained = dict[RunBeginning, bool]()
    begun = by_beginning(windows, whole.motion) if whole.chosen.kind.count else {}
    for beginning, some in begun.items():
        kept = keeps_law(some, robot, tool, whole.motion)
        plain, left = (
            rms(residuals(some, robot, tool, motion)[kept, :3]) * float(np.sqrt(3 / 2))  # of one coordinate
            for motion in (ControllerMotion(), whole.motion)
        )
        if plain > limit_of(0.0, 0.0, noise):
            explained[beginning] = left <= limit_of(plain, left, noise)
    began = frozenset(beginning for beginning, is_so in explained.items() if is_so)
    serves_all = whole.verdict is MotionVerdict.COMMANDABLE and len(began) == len(explained)
    if len(begun) == len(RunBeginning) and not serves_all:
        enough = {beginning: some for beginning, some in begun.items() if _blocks(some) >= LEAST_BLOCKS}
        fits = {beginning: identify(some, robot, tool, noise) for beginning, some in enough.items()}
        known = [beginning for beginning, fit in fits.items() if fit.verdict is MotionVerdict.COMMANDABLE]
        if len(known) == len(begun) and (both := _joined(fits, begun)) is not None:
            return both
        if len(known) == 1:
            whole, began = fits[known[0]], frozenset(known)
    return replace(whole, runs_began=began, findings=(*whole.findings, *_findings(whole, began)))


def _blocks(windows: Sequence[Window]) -> int:
    return len(np.unique(np.concatenate([w.block for w in windows])))


def _joined(
    fits: dict[RunBeginning, IdentifiedMotion], begun: dict[RunBeginning, list[Window]]
) -> IdentifiedMotion | None:
    """One motion for both ways to begin, as well known as the worse of two; None where the rule is not theirs."""
    short, long = (fits[beginning] for beginning in RunBeginning)
    motion = replace(short.motion, after_long=long.motion.moving_averages)
    shortest, longest = min(w.first for w in begun[RunBeginning.LONG]), max(w.first for w in begun[RunBeginning.SHORT])
    if {short.chosen.kind, long.chosen.kind} != {FIRST} or not longest <= motion.long < shortest:
        return None
    return replace(
        max(fits.values(), key=_held_out),
        motion=motion,
        intervals=np.concatenate([short.intervals, long.intervals]),
        largest=max(short.largest, long.largest),
        slowed=max(short.slowed, long.slowed),
        findings=tuple(dict.fromkeys((*short.findings, *long.findings))),
        runs_began=frozenset(RunBeginning),
    )


def _held_out(fit: IdentifiedMotion) -> float:
    return fit.held_out


def _findings(identified: IdentifiedMotion, began: frozenset[RunBeginning]) -> list[Finding]:
    """That jobs whose runs begin otherwise will not be commanded against it."""
    if identified.verdict is not MotionVerdict.COMMANDABLE or len(began) == len(RunBeginning):
        return []
    if not began:
        message = f"it is not known how the runs with bends begin: it foretells, and is not commanded against; {MORE}"
        return [Finding(Level.WARNING, Code.MOTION_RUNS, message)]
    (only,) = began
    message = f"its runs with bends begin with a {only.value} line: only jobs whose runs do are commanded; {MORE}"
    return [Finding(Level.NOTE, Code.MOTION_RUNS, message)]
