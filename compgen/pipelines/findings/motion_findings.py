r"""What a job says of the controller's motion: how far it leads the tool off the path, and what is commanded for it.

And where smoothing of a bend off the part reaches the part: the way between them is too short (``lead_findings``).
Smoothed motion at a place p of the path is a mean of commands around it. With the delay D of the weights and the time
S after which all has come to rest, none of them is farther at speed v than

    v D ahead of p,      v (S - D) behind it

so a bend after the part's edge wants v D of way to it, and one before the edge v (S - D) from it on. A stop holds all
of this back: the command waits there until all is at rest. A path that goes on past the edge as it bends on the part
has no bend there.

What a bend does is how much farther the tool is led off within that reach of the edge than in as much of the part
next to it. The edge is the last waypoint in contact.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, row_norms
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import MM, MS, PERCENT, UM, counted, span_words
from compgen.error_model.unmeasured import NOT_LOOKED_AT, Unknown
from compgen.job.bounds import Bounds
from compgen.job.job import Job
from compgen.planning.tables import MAX_LEAD
from compgen.planning.toolpath import ToolPath
from compgen.robot.motion import ControllerMotion, MotionVerdict, RunBeginning
from compgen.robot.robot import Robot
from compgen.verification.motion_effect import HALF, MotionEffect
from compgen.verification.twin.controller.smoothing import moments

WHAT = "the controller's motion"  # as a robot file's [[unknown]] calls it
#: whose word it is that a motion is expected
BASIS = {
    "simulated": "the maker's motion code for this class of arm",
    "other arms": "logs and motion code of other arms",
}
EXAMPLE_SPEED, EXAMPLE_RADIUS = 200 * MM, 650 * MM  # the study's circle: where no path is looked at
LEAST = 0.05 * UM  # below, the words say nothing
QUARTER = HALF**2  # of the pull is left at half the override
DIGIT = 1.0 * UM  # a digit of the text, which alone bends a straight line by as much
TURN = 3e-3  # [rad] of the direction of travel: a bend, and no ripple of a curve through points
SAME_BEND = 1.5  # times as sharp as on the part is no other bend
STRETCHES = 200  # of the part that are looked at: those where the tool is led off farthest


def motion_findings(effect: MotionEffect | None, bounds: Bounds, at_half: float | None = None) -> list[Finding]:
    """One finding of what the controller's motion does, or is expected to do.

    Args:
        effect: On the written text.
        bounds: Of the path; beyond the smallest the finding is a warning.
        at_half: Largest error on the part at half the override of a program that is commanded for the motion [m].
    """
    if effect is None:
        return []
    size = _um(effect.largest)
    place = _place(effect)
    beyond = effect.highest > bounds.least
    level = Level.WARNING if beyond else Level.NOTE
    if effect.expected is not None:
        if effect.highest < LEAST:
            message = f"{WHAT} is not known; on the part this path has no bend that it could matter at"
            return [Finding(Level.NOTE, Code.MOTION_UNKNOWN, message)]
        span = span_words(size, _um(effect.lowest), _um(effect.highest))
        message = (
            f"the controller is expected to lead the tool off this path by {size} um ({span}), {place}, by "
            f"{BASIS[effect.expected.evidence]}; not corrected for; at {HALF / PERCENT:.0f} % override a quarter "
            "of it is left, at corners half; log a run for cgen identify-motion, or drive slower"
        )
        return [Finding(level, Code.MOTION_UNKNOWN, message)]
    words = motion_words(effect.motion)
    along = f", and up to {_um(effect.along)} um along it" if effect.along > effect.largest and beyond else ""
    if effect.motion.may_predistort:
        left = "" if at_half is None else f": there {_um(at_half)} um are left on the part"
        message = (
            f"the program is made for 100 % override: it is commanded up to {size} um off its path against {WHAT} "
            f"({words}), of which {100 * (1 - QUARTER):.0f} % are wrong at {HALF / PERCENT:.0f} % override, at corners "
            f"{100 * (1 - HALF):.0f} %{left}"
        )
        return [Finding(Level.WARNING if beyond else Level.NOTE, Code.MOTION_PREDISTORTED, message)]
    message = (
        f"{WHAT} as [motion] has it ({words}) leads the tool up to {size} um off the written path ({place}){along}, "
        f"part of the errors and not commanded against: {_why_not(effect.motion)}"
    )
    level = Level.WARNING if effect.motion.unlogged and effect.motion.enabled else level
    return [Finding(level, Code.MOTION_RUNS if effect.motion.unlogged else Code.MOTION_KNOWN, message)]


def _why_not(motion: ControllerMotion) -> str:
    """Why nothing is commanded against a known motion, with the mend."""
    if motion.evidence is None:
        why = "its numbers are not from a log: run cgen identify-motion, then set motion.enabled = true"
    elif motion.unlogged and not motion.evidence.runs_began:
        why = "no runs_began in [motion.identified]: run cgen identify-motion again, best on cgen plan-motion-log"
    elif motion.unlogged:
        other = "long" if RunBeginning.SHORT in motion.evidence.runs_began else "short"
        why = f"its runs begin with a {other} line, and no logged one did: log the program of cgen plan-motion-log"
    elif motion.evidence.verdict is MotionVerdict.FORETELLS:
        why = "its [motion.identified] foretells and no more: log another run for cgen identify-motion"
    elif motion.evidence.verdict is MotionVerdict.REJECTED:
        why = "its [motion.identified] was rejected: log another run for cgen identify-motion"
    elif not motion.evidence.accepted:
        at = f"{motion.evidence.override / PERCENT:.0f} % override"
        why = f"its log was run at {at}, and the program is made for 100: log one at 100 % for cgen identify-motion"
    else:
        why = "motion.enabled is false"
    return why


def motion_of_a_listing(
    robot: Robot, effect: MotionEffect | None, bounds: Bounds, chained: Sequence[int] = ()
) -> list[Finding]:
    """What the controller's motion does to a program that exists: nothing is commanded against it.

    Args:
        robot: Its motion, or what is expected of it.
        effect: On the written text; None: not looked at.
        bounds: Beyond the smallest the finding is a warning.
        chained: Lines of A and S, on which the effect is not known: with a bound that is a warning.
    """
    level = Level.WARNING if chained and bounds.max is not None else Level.NOTE
    if effect is None:
        return [_not_looked_at(robot, "here", level)]
    findings = motion_findings(effect, bounds) if effect.expected is not None else _known_in_a_listing(effect, bounds)
    if not chained:
        return findings
    lines = counted(len(chained), "line", "lines")
    where = f"along {lines} with A or S (with C it is; the first: line {chained[0]})"
    return [_not_looked_at(robot, where, level), *(findings if effect.highest >= LEAST else [])]


def _known_in_a_listing(effect: MotionEffect, bounds: Bounds) -> list[Finding]:
    """What a motion of the robot file does to a program that exists."""
    beyond = bounds.max is not None and effect.largest > bounds.max
    message = (
        f"{WHAT} as [motion] has it ({motion_words(effect.motion)}) leads the tool up to {_um(effect.largest)} um off "
        f"the written path ({_place(effect)}), beside the error after correction; nothing is commanded against it"
    )
    level = Level.WARNING if beyond else Level.NOTE
    if effect.motion.unlogged:
        return [Finding(level, Code.MOTION_RUNS, f"{message}: {_why_not(effect.motion)}")]
    return [Finding(level, Code.MOTION_KNOWN, message)]


def _place(effect: MotionEffect) -> str:
    near = f" near {effect.near}" if effect.near else ""
    return f"{effect.where:.3f} m along{near}, at {effect.speed / MM:.4g} mm/s"


def _not_looked_at(robot: Robot, where: str, level: Level) -> Finding:
    """That the motion through a program is not predicted, with what it is expected to be on a well-known path."""
    seen = robot.expected_motion
    if robot.motion is None:
        lowest, expected, highest = (
            _um(EXAMPLE_SPEED**2 * motion.variance / (2 * EXAMPLE_RADIUS))
            for motion in (seen.lowest, seen.expected, seen.highest)
        )
        return Finding(
            level,
            Code.MOTION_UNKNOWN,
            f"{WHAT} is not known, and not looked at {where}: it pulls bends inwards, on a radius of "
            f"{EXAMPLE_RADIUS / MM:g} mm at {EXAMPLE_SPEED / MM:g} mm/s by an expected {expected} um "
            f"({span_words(expected, lowest, highest)}), by {BASIS[seen.evidence]}",
        )
    words = motion_words(robot.motion)
    message = f"{WHAT} as [motion] has it ({words}) is not looked at {where}: cgen generate predicts it"
    return Finding(level, Code.MOTION_KNOWN, message)


def with_motion(unknown: Sequence[Unknown], effect: MotionEffect | None, chained: int = 0) -> tuple[Unknown, ...]:
    """What is not known, with the controller's motion as large as is expected on this path.

    It is no longer there once a log of this robot has been accepted. Without an effect it is said to be not looked at,
    and so are lines of A and S.
    """
    if effect is None:
        return tuple(replace(row, size=None, origin=NOT_LOOKED_AT) if row.what == WHAT else row for row in unknown)
    evidence = effect.motion.evidence
    if effect.known and evidence is not None and evidence.accepted and not effect.motion.unlogged:
        return tuple(row for row in unknown if row.what != WHAT)
    if effect.expected is not None:
        origin, size = BASIS[effect.expected.evidence], (effect.lowest, effect.highest)
    else:
        by = "as [motion] has it"
        if effect.motion.unlogged:
            differs = evidence is not None and evidence.runs_began
            by = "by [motion] and how [expected_motion]'s differ" if differs else by
            by += " of runs that begin otherwise"
        origin = f"computed for this path: {motion_words(effect.motion)}, {by}"
        size = 0.0, effect.largest
    origin += f"; not looked at on lines with A or S ({chained})" if chained else ""
    expected = None if effect.known else effect.largest
    return tuple(
        replace(row, size=size, origin=origin, expected=expected) if row.what == WHAT else row for row in unknown
    )


def motion_words(motion: ControllerMotion) -> str:
    """Its smoothing: ``moving means of 200 and 100 ms``."""
    parts = []
    for what, times in (("moving mean", motion.moving_averages), ("first-order lag", motion.first_orders)):
        times = tuple(t for t in times if t > 0)
        if times:
            parts.append(f"{what}{'s' if len(times) > 1 else ''} of {' and '.join(f'{t / MS:g}' for t in times)} ms")
    where = " in joints" if motion.space == "joint" else ""
    long = f", after a long line {' and '.join(f'{t / MS:g}' for t in motion.after_long)}" if motion.after_long else ""
    return (" and ".join(parts) or "no smoothing") + where + long


def _um(value: float) -> str:
    return f"{value / UM:.0f}" if value >= 9.95 * UM else f"{value / UM:.1f}"


class SmoothingReach(NamedTuple):
    """How far from a place commands have a share in it, in time."""

    ahead: float  # [s]
    behind: float  # [s]


class ShortLead(NamedTuple):
    """A way between the part's edge and a bend, shorter than the smoothing reaches."""

    bend: float  # [m] arc length where it begins
    length: float  # [m] from there to the edge
    needed: float  # [m]
    speed: float  # [m/s]
    caused: float  # [m] off the path on the part


def reach_of(motion: ControllerMotion) -> SmoothingReach:
    """Of a controller's smoothing; a lag, which delays all alike, has none."""
    delay = moments(motion).delay - motion.lag
    return SmoothingReach(delay, motion.settling - motion.lag - delay)


def lead_findings(
    effect: MotionEffect | None, path: ToolPath, job: Job, error: Array | None = None
) -> Iterator[Finding]:
    """At most one finding: the way to a bend that is shortest of what it should be.

    Args:
        effect: Of the controller's motion on the written text.
        path: That it was made from, N waypoints.
        job: Its feed, controller and bounds; what breaks the smallest is a warning where the motion is known.
        error: On each segment, (N - 1,) [m], of a program commanded against its motion: its text is not its path.
    """
    if effect is None:
        return
    bounds, off = job.bounds, effect.off if error is None else error
    reach = reach_of(effect.motion)
    short = list(short_leads(path, off, job.feed * path.pace, reach))
    if not short:
        return
    worst = max(short, key=lambda lead: lead.needed - lead.length)
    caused = max(lead.caused for lead in short)
    beyond = effect.known and caused > bounds.least
    leads = f"{motion_words(effect.motion)} lead" if effect.known else "the controller is expected to lead"
    raised = worst.needed <= MAX_LEAD * MM
    yield Finding(
        Level.WARNING if beyond else Level.NOTE,
        Code.MOTION_LEAD,
        f"{leads} the tool off its path on the part by {_um(caused)} um for a bend {worst.bend:.3f} m along: "
        f"{worst.length / MM:.1f} mm lie between it and the edge, {np.ceil(worst.needed / MM - 1e-6):.0f} are "
        f"needed at {worst.speed / MM:.4g} mm/s (such places: {len(short)}); "
        f"{'raise path.lead_mm to that' if raised else 'lower process.feed_mm_s'}, or stop at the bend: "
        'path.turn = "square", or stop = 1 in points of your own',
    )


def short_leads(path: ToolPath, off: Array, speed: Array, reach: SmoothingReach) -> Iterator[ShortLead]:
    """Ways off the part that are too short, in no order.

    Args:
        path: N waypoints.
        off: How far the tool is led off each segment, (N - 1,) [m].
        speed: Wanted on each, (N - 1,) [m/s]: what binds below it may let go where the way is longer.
        reach: Of the smoothing.
    """
    on_part = path.contact[:-1] & path.contact[1:] & path.exact.curve.working[path.piece]
    change = np.diff(on_part.astype(np.int8), prepend=0, append=0)
    first, end = np.flatnonzero(change > 0), np.flatnonzero(change < 0)
    largest = np.array([off[a:b].max() for a, b in zip(first, end, strict=True)])
    likely = np.argsort(-largest, kind="stable")[:STRETCHES]
    stops = np.flatnonzero(path.stop)
    for k in likely[largest[likely] > DIGIT]:
        stretch = np.arange(first[k], end[k])
        for outwards, time in ((False, reach.behind), (True, reach.ahead)):
            edge = int(end[k] if outwards else first[k])
            run = np.clip(np.searchsorted(stops, edge), 1, len(stops) - 1)
            fastest = float(speed[stops[run - 1] : stops[run]].max())
            yield from _short_lead(path, off, stretch[::-1] if outwards else stretch, edge, (fastest, time))


def _short_lead(
    path: ToolPath, off: Array, stretch: IntArray, edge: int, reach: tuple[float, float]
) -> Iterator[ShortLead]:
    """The way out of the part at one end of a stretch of it, where it is too short.

    Args:
        path: N waypoints.
        off: (N - 1,) [m].
        stretch: Segments on the part, from the edge inwards.
        edge: The waypoint there.
        reach: The highest speed [m/s] and the time that the smoothing reaches over [s].
    """
    speed, time = reach
    needed = speed * time
    middle = np.abs((path.arc[stretch] + path.arc[stretch + 1]) / 2 - path.arc[edge])
    near, next_to_it = middle < needed, (middle >= needed) & (middle < 2 * needed)
    near[0] = True
    caused = float(off[stretch[near]].max() - off[stretch[next_to_it]].max(initial=0.0))
    if caused <= DIGIT:
        return
    bend = _bend(path, stretch[near], edge, needed)
    if bend is not None:
        yield ShortLead(bend, abs(bend - float(path.arc[edge])), needed, speed, caused)


def _bend(path: ToolPath, stretch: IntArray, edge: int, within: float) -> float | None:
    """Arc length where the path past an edge begins to bend, and not as it does on the part [m]; None before a stop.

    Args:
        path: N waypoints.
        stretch: Segments on the part, from the edge inwards: they tell how it bends there.
        edge: The waypoint.
        within: Length past the edge that is looked at [m].
    """
    place, ahead = float(path.arc[edge]), int(stretch[0] < edge)  # 1: the part is left there
    if ahead:
        outside = np.arange(edge, min(int(np.searchsorted(path.arc, place + within)), len(path.piece)))
    else:
        outside = np.arange(max(int(np.searchsorted(path.arc, place - within)) - 1, 0), edge)[::-1]
    begin, end = outside + 1 - ahead, outside + ahead  # waypoints, outwards
    passed = np.logical_or.accumulate(path.stop[begin])
    outside, begin, end = outside[~passed], begin[~passed], end[~passed]
    if not len(outside):
        return None

    def travel(segments: IntArray, fraction: int) -> Array:
        return path.at(segments, np.full(len(segments), float(fraction))).travel

    outer, inner = travel(stretch[:1], ahead), travel(stretch[-1:], 1 - ahead)
    depth = abs(float(path.arc[stretch[-1] + 1 - ahead]) - place)
    rate = SAME_BEND * float(row_norms(outer - inner)[0]) / depth

    def bends(at: IntArray, direction: Array) -> BoolArray:
        return np.asarray(row_norms(direction - outer) > TURN + rate * np.abs(path.arc[at] - place))

    bent = bends(begin, travel(outside, 1 - ahead)) | bends(end, travel(outside, ahead))
    return float(path.arc[begin[int(np.argmax(bent))]]) if bent.any() else None
