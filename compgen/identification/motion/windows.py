r"""Stretches of a run with what was commanded in them, and the rows of the log to compare.

A window lies in one run between stops, at one override. In it the command moves along the course with

    c(t) = c_0 + law(t),       law: ramps from and to the stops, the written speed times the override between

sampled at the interpolation period, from MEMORY before the window on, so that what a filter remembers is there. Rows
near stops are left out, for the ramps there are assumed. No clock is compared: a row counts by its distance from the
smoothed curve, wherever on it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray, own
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation
from compgen.robot.inverse_kinematics import ALL_POSTURES, solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.robot.turns import posture_indices
from compgen.verification.executed.course import ProgramCourse, arc_lengths_of, tangents_of
from compgen.verification.executed.judgement import ExecutedRun
from compgen.verification.executed.tracking import nearest
from compgen.verification.twin.controller.command import run_law
from compgen.verification.twin.controller.smoothing import moments, smooth

MEMORY = 1.5  # [s] of command before a window
BEYOND = 1.5  # [s] of command behind it: smoothed motion comes late
LONGEST = 10.0  # [s] of a window
SHORTEST = 0.5  # s
CLEAR = 0.3  # [s] beyond a ramp, until rows count
WINDOWS = 40  # of a log: the rest of a long one is not needed
SEEN = 200  # places of a window by which its bends are counted
ROWS = 20_000  # of all windows
BLOCK = 0.75  # [s] of rows that are held out, or fitted, together


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Window:
    """K samples of the command and R rows of the log."""

    position: Array  # (K, 3) [m] commanded TCP in World
    theta: Array | None  # (K, 6) [rad] commanded joints; None where they are not known
    arc: Array  # (K,) [m] along the course
    place: Array  # (R, 3) [m] logged TCP in World
    row_arc: Array  # (R,) [m]
    off: Array  # (R, 3) [m] from the programmed path
    block: IntArray  # (R,) rows of one number are held out, or fitted, together

    def __post_init__(self) -> None:
        own(self, position=("K", 3), arc=("K",), place=("R", 3), row_arc=("R",), off=("R", 3), block=("R",))


def windows_of(run: ExecutedRun, robot: Robot) -> list[Window]:
    """The windows of a run.

    Raises:
        InputError: The log has no steady motion long enough.
    """
    course, clock, deviation = run.course, run.clock, run.deviation
    written = course.periods if clock.rounded else course.cruise
    spans = _spans(run, written)
    if not spans:
        raise InputError(
            f"{run.followed.log.table.source}: no run between two stops is logged at one override for {SHORTEST:g} s; "
            "log a longer run, its override left alone"
        )
    spans = _telling(course, written, spans)
    total = sum(int(((deviation.arc >= s.low) & (deviation.arc <= s.high)).sum()) for s in spans)
    every = max(1, total // ROWS)
    posture = _posture(course, robot)
    windows, block = list[Window](), 0
    for span in spans:
        window = _window(run, robot, written, span, every, posture, block)
        if window is not None:
            windows.append(window)
            block = int(window.block.max()) + 1
    return windows


@dataclass(frozen=True, slots=True, kw_only=True)
class _Span:
    """Part of a run between two stops."""

    begin: float  # [s] clock at written speeds, of the run
    duration: float  # [s] of the run with its ramps, as driven
    at_speed: float  # [s] of the run's statements alone, as driven
    rate: float
    first: float  # [s] since the run began, where rows count
    last: float
    low: float  # [m] arc lengths of these
    high: float


def _spans(run: ExecutedRun, written: Array) -> list[_Span]:
    course, spans = run.course, list[_Span]()
    counted = course.periods if course.counted else course.cruise
    stops = np.flatnonzero(course.stop)
    first, last = run.covered
    held = [s.arc for s in run.clock.stands if not s.at_stop]
    arcs, index = np.unique(run.deviation.arc, return_index=True)
    times = run.deviation.time[index]
    for a, b in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        if not course.judged[a:b].all() or course.arc[b] <= first or course.arc[a] >= last:
            continue
        begin, end = (float(np.interp(course.arc[k], arcs, times)) for k in (a, b))  # on the log's clock
        inside = [s for s in run.clock.stretches if s.begin < end and s.end > begin]
        if len(inside) != 1 or any(course.arc[a] < arc < course.arc[b] for arc in held):
            continue
        rate = inside[0].rate
        at_speed = float(written[b] - written[a]) / rate
        ramps = max(float((course.planned - counted)[b] - (course.planned - counted)[a] - course.wait[a]), 0.0) / rate
        duration = at_speed + ramps
        low, high = ramps + CLEAR, duration - ramps - CLEAR
        if high - low < SHORTEST:
            continue
        parts = np.linspace(low, high, int(np.ceil((high - low) / LONGEST)) + 1)
        for t, u in zip(parts[:-1].tolist(), parts[1:].tolist(), strict=True):
            c = written[a] + rate * run_law(np.array([t, u]), np.full(2, duration), np.full(2, at_speed))
            s = np.interp(c, written, course.arc)
            if s[0] >= first and s[1] <= last:
                spans.append(
                    _Span(
                        begin=float(written[a]),
                        duration=duration,
                        at_speed=at_speed,
                        rate=rate,
                        first=t,
                        last=u,
                        low=float(s[0]),
                        high=float(s[1]),
                    )
                )
    return spans


def _telling(course: ProgramCourse, written: Array, spans: list[_Span]) -> list[_Span]:
    """As many spans as are looked at: half of them those where smoothing shows most, the others evenly spread."""
    if len(spans) <= WINDOWS:
        return spans
    bends = []
    for span in spans:
        first, last = np.interp([span.low, span.high], course.arc, written)
        place = course.place(np.interp(np.linspace(first, last, SEEN), written, course.arc))
        bends.append(float(np.abs(np.diff(place, n=2, axis=0)).sum()))
    most = np.argsort(bends)[::-1][: WINDOWS // 2]
    evenly = np.linspace(0, len(spans) - 1, WINDOWS - len(most)).astype(int)
    return [spans[k] for k in np.union1d(most, evenly).tolist()]


def _posture(course: ProgramCourse, robot: Robot) -> int | None:
    """The one posture of a course; None where there are several, or joints are not known."""
    if not np.isfinite(course.theta).all():
        return None
    postures = np.unique(posture_indices(robot, course.theta))
    return int(postures[0]) if len(postures) == 1 and postures[0] >= 0 else None


def _window(
    run: ExecutedRun, robot: Robot, written: Array, span: _Span, every: int, posture: int | None, block: int
) -> Window | None:
    course, deviation, period = run.course, run.deviation, robot.controller.period
    begin, end = max(span.first - MEMORY, 0.0), span.last + BEYOND
    time = np.arange(begin, end, period)
    whole, alone = np.full(len(time), span.duration), np.full(len(time), span.at_speed)
    done = run_law(np.minimum(time, whole), whole, alone)
    arc = np.interp(span.begin + span.rate * done, written, course.arc)
    rows = np.flatnonzero((deviation.arc >= span.low) & (deviation.arc <= span.high) & deviation.judged)[::every]
    if len(rows) < 5:
        return None
    position, theta = course.place(arc), None
    if posture is not None:
        k = course.way(arc)
        share = (arc - course.arc[k]) / np.maximum(np.diff(course.arc)[k], 1e-12)
        rotation = interpolate_rotation(course.rotation[k], course.rotation[k + 1], share)
        joints, _ = solve_tool(robot, Pose(position, rotation), course.tool, ALL_POSTURES[posture])
        near = course.theta[k] + share[:, None] * (course.theta[k + 1] - course.theta[k])
        theta = nearest_turns(joints, near)
    since = deviation.time[rows] - deviation.time[rows[0]]
    at = deviation.row[rows]
    return Window(
        position=position,
        theta=theta,
        arc=arc,
        place=run.followed.position[at],
        row_arc=deviation.arc[rows],
        off=run.followed.projection.off[at],
        block=block + np.floor(since / BLOCK).astype(np.int64),
    )


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
