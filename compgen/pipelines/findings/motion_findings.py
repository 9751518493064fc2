"""What a job says of the controller's motion: how far it leads the tool off the path, and what is commanded for it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import BoolArray
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MM, MS, PERCENT, UM
from compgen.error_model.unknown import NOT_LOOKED_AT, Unknown
from compgen.job.bounds import Bounds
from compgen.planning.toolpath import ToolPath
from compgen.robot.motion import ControllerMotion
from compgen.verification.motion_effect import HALF, MotionEffect

WHAT = "the controller's motion"  # as a robot file's [[unknown]] calls it
LEAST = 0.05 * UM  # below, the words say nothing
QUARTER = HALF**2  # of the pull is left at half the override


def touching_segments(path: ToolPath) -> BoolArray:
    """Segments on the part, (N - 1,)."""
    return np.asarray((path.contact[:-1] | path.contact[1:]) & path.exact.curve.working[path.piece])


def motion_findings(effect: MotionEffect | None, bounds: Bounds, at_half: float | None = None) -> list[Finding]:
    """One finding of what the controller's motion does, or could do.

    Args:
        effect: On the written text.
        bounds: Of the path; beyond the smallest the finding is a warning.
        at_half: Largest error on the part at half the override of a program that is commanded for the motion [m].
    """
    if effect is None:
        return []
    given = [b for b in (bounds.max, bounds.p99, bounds.rms) if b is not None]
    size = _um(effect.largest)
    place = f"{effect.where:.3f} m along, at {effect.speed / MM:.4g} mm/s"
    beyond = bool(given) and effect.largest > min(given)
    level = Level.WARNING if beyond else Level.NOTE
    if not effect.known:
        if effect.largest < LEAST:
            message = f"{WHAT} is not known; on the part this path has no bend that it could matter at"
            return [Finding(Level.NOTE, Code.MOTION_UNKNOWN, message)]
        message = (
            f"{WHAT} is not known, nothing is corrected for it: {motion_words(effect.motion)}, as may be, would lead "
            f"the tool {size} um off this path ({place}), a quarter of it at {HALF / PERCENT:.0f} % override; log a "
            "run for cgen identify-motion, or lower process.feed_mm_s"
        )
        return [Finding(level, Code.MOTION_UNKNOWN, message)]
    words = motion_words(effect.motion)
    along = f", and up to {_um(effect.along)} um along it" if effect.along > effect.largest and beyond else ""
    if effect.motion.may_predistort:
        left = "" if at_half is None else f": there {_um(at_half)} um are left on the part"
        message = (
            f"the program is made for 100 % override: it is commanded up to {size} um off its path against {WHAT} "
            f"({words}), of which {100 * (1 - QUARTER):.0f} % are wrong at {HALF / PERCENT:.0f} % override{left}"
        )
        return [Finding(Level.WARNING if beyond else Level.NOTE, Code.MOTION_PREDISTORTED, message)]
    if effect.motion.enabled and effect.motion.evidence is not None:
        why = "its [motion.identified] was rejected: log another run for cgen identify-motion"
    elif effect.motion.evidence is None:
        why = "its numbers are not from a log: run cgen identify-motion, then set motion.enabled = true"
    elif not effect.motion.evidence.accepted:
        why = "its [motion.identified] was rejected: log another run for cgen identify-motion"
    else:
        why = "motion.enabled is false"
    message = (
        f"{WHAT} as [motion] has it ({words}) leads the tool up to {size} um off the written path ({place}){along}; it "
        f"is part of the errors, and not commanded against: {why}"
    )
    return [Finding(level, Code.MOTION_KNOWN, message)]


def motion_of_a_listing(motion: ControllerMotion | None) -> Finding:
    """That the motion through a program that exists is neither predicted nor commanded against."""
    if motion is None:
        example = "128 um on a radius of 650 mm at 200 mm/s with moving means of 200 and 100 ms"
        message = f"{WHAT} is not known, and not looked at here: it pulls bends inwards, {example}"
        return Finding(Level.NOTE, Code.MOTION_UNKNOWN, message)
    message = f"{WHAT} as [motion] has it ({motion_words(motion)}) is not looked at here: cgen generate predicts it"
    return Finding(Level.NOTE, Code.MOTION_KNOWN, message)


def with_motion(unknown: Sequence[Unknown], effect: MotionEffect | None) -> tuple[Unknown, ...]:
    """What is not known, with the controller's motion as large as it could be on this path.

    It is no longer there once a log of this robot has been accepted. Without an effect it is said to be not looked at.
    """
    if effect is None:
        return tuple(replace(row, size=None, origin=NOT_LOOKED_AT) if row.what == WHAT else row for row in unknown)
    evidence = effect.motion.evidence
    if effect.known and evidence is not None and evidence.accepted:
        return tuple(row for row in unknown if row.what != WHAT)
    origin = f"computed for this path: {motion_words(effect.motion)}, " + (
        "as [motion] has it" if effect.known else "assumed"
    )
    return tuple(
        replace(row, size=(0.0, effect.largest), origin=origin) if row.what == WHAT else row for row in unknown
    )


def motion_words(motion: ControllerMotion) -> str:
    """Its smoothing: ``moving means of 200 and 100 ms``."""
    parts = []
    for what, times in (("moving mean", motion.moving_averages), ("first-order lag", motion.first_orders)):
        times = tuple(t for t in times if t > 0)
        if times:
            parts.append(f"{what}{'s' if len(times) > 1 else ''} of {' and '.join(f'{t / MS:g}' for t in times)} ms")
    where = " in joints" if motion.space == "joint" else ""
    return (" and ".join(parts) or "no smoothing") + where


def _um(value: float) -> str:
    return f"{value / UM:.0f}" if value >= 9.95 * UM else f"{value / UM:.1f}"
