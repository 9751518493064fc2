r"""Stretches of a run with what was commanded in them, and the rows of the log to compare.

A window lies in one run between stops, at one override. In it the command moves along the course, statement after
statement, each at its written speed from the very beginning to the very end of its time (rounded up to whole periods
where the log shows that), for smoothing alone makes the ramps at stops; behind CNT n < 100 it waits. It is sampled at
a part of the interpolation period from MEMORY before the window on, so that what a filter remembers is there.

A row counts by its distance from the smoothed curve, wherever on it: no clock is compared. Near a stop it counts along
the curve too, as far as neither a shift of the log's clock nor another speed explains it: with A(t) the smoothed way,

    s_k = k (A(t_k - t_0) - A_stop) + A_stop + e_k,       k and t_0 free at each stop.

So a run to and fro on one line tells what its ramps are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, dot, interpolated, lengths_along, norm, owns
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.robot.configuration import posture_indices
from compgen.robot.inverse_kinematics import ALL_POSTURES, solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse, tangents_of
from compgen.verification.executed.followed_log import row_noise
from compgen.verification.executed.judgement import ExecutedRun
from compgen.verification.executed.tracking import nearest
from compgen.verification.twin.controller.command import corner_wait
from compgen.verification.twin.controller.smoothing import smooth

MEMORY = 1.5  # [s] of command before a window
BEYOND = 1.5  # [s] of command behind it: smoothed motion comes late
LONGEST = 10.0  # [s] of a window
SHORTEST = 0.3  # s
RAMP = 1.2  # [s] from a stop, in which rows count along the curve
WINDOWS = 40  # of a log: the rest of a long one is not needed
SEEN = 200  # places of a window by which its bends are counted
ROWS = 20_000  # of all windows
FAR = 50e-6  # [m] off the curve, from which on
BOTH_SIDES = (-0.02, -0.01, -0.005, 0.005, 0.01, 0.02)  # [m] it is looked for from other places beside
STEPS = 10  # to a row on the curve: a corner that is cut short is 20 mm and more away
PARTS = 4  # samples in each interpolation period: rows count from chords between them
BLOCK = 0.75  # [s] of rows that are held out, or fitted, together
BLOCKS = 18  # of a short log: then they are shorter
SHORTEST_BLOCK = 0.1  # s
NEAR_RATE = 0.01  # of a rate that is whole percent but for the log's clock and for corners
ALONG = 0.2  # of what is across: bends are what is commanded against, ramps tell where there are none
LEAST_NOISE = 0.5e-6  # [m] that rows scatter by at least
ROUNDS = 3  # of finding k and t_0
AT_REST = 2e-6  # [m] from a stop, while the robot stands there
AFTER_STOP, BEFORE_STOP = 1, 2
LEAST_RAMP = 8  # rows
SURE_SHIFT = 0.5  # periods, from which a statement is believed to have taken another number of them
SLOW = 0.1  # of the smoothing's length, by which a clock falls behind where a motion is slowed down


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    position=("K", 3), arc=("K",), time=("K",), spread=("K",), corner=("P",), kept=("P",), before=("P",),
    shown=("R",), place=("R", 3), row_arc=("R",), off=("R", 3), block=("R",), ramp=("R",),
)  # fmt: skip
class Window:
    """K samples of the command and R rows of the log."""

    position: Array  # (K, 3) [m] commanded TCP in World, as if nothing waited
    theta: Array | None  # (K, 6) [rad] commanded joints; None where they are not known
    arc: Array  # (K,) [m] along the course
    time: Array  # (K,) [s] since the run began
    corner: Array  # (P,) [s] since the run began, where it may wait
    kept: Array  # (P,) n / 100 of the CNT n there
    before: Array  # (P,) [m2] how far the arm is spread on the motion that ends there
    spread: Array  # (K,) [m2] the same on the motion that leads to each sample
    shown: Array  # (R,) [s] log's clock
    place: Array  # (R, 3) [m] logged TCP in World
    row_arc: Array  # (R,) [m]
    off: Array  # (R, 3) [m] from the programmed path
    block: IntArray  # (R,) rows of one number are held out, or fitted, together
    ramp: IntArray  # (R,) AFTER_STOP, BEFORE_STOP, their sum between two, 0 elsewhere
    weight: float  # of what is along the curve, against what is across it
    run: tuple[int, int]  # nodes of the stops that it lies between
    rate: float  # of the written speeds
    is_whole: bool  # from stop to stop
    first: float  # [s] how long the statement lasts that its run begins with


def windows_of(run: ExecutedRun, robot: Robot) -> list[Window]:
    """The windows of a run.

    Raises:
        InputError: The log has no motion long enough at one override.
    """
    course, deviation = run.course, run.deviation
    spans = _spans(run)
    if not spans:
        raise InputError(
            f"{run.followed.log.table.source}: no run between two stops is logged for {SHORTEST:g} s, at one "
            "override and without being held; log a longer run that nobody holds, its override left alone"
        )
    spans = _telling(course, run.clock.clock, spans)
    total = sum(int(((deviation.arc >= s.low) & (deviation.arc <= s.high)).sum()) for s in spans)
    every = max(1, total // ROWS)
    lasts = sum(s.last - s.first for s in spans)
    length = float(np.clip(lasts / BLOCKS, SHORTEST_BLOCK, BLOCK))
    posture, weight, spread = _posture(course, robot), _weight_along(run), np.nan_to_num(course.spreads(robot))
    windows, block = list[Window](), 0
    for span in spans:
        window = _window(run, robot, span, every, posture, weight, spread)
        if window is not None:
            since = np.floor((window.shown - window.shown[0]) / length).astype(np.int64)
            windows.append(replace(window, block=block + since))
            block += int(since.max()) + 1
    return windows


def _weight_along(run: ExecutedRun) -> float:
    """How much less surely a row's place along its way is known than across it: the log's clock jitters."""
    steady = np.isfinite(run.clock.late)
    across = max(run.deviation.noise, LEAST_NOISE)
    if not steady.any():
        return ALONG
    along = row_noise(run.clock.late[steady][:, None]) * float(np.median(run.deviation.speed[steady]))
    return ALONG * across / max(along, across)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Span:
    """Part of a run between two stops."""

    stops: tuple[int, int]  # nodes
    rate: float
    first: float  # [s] since the run began, as driven
    last: float
    low: float  # [m] arc lengths of these
    high: float


def _spans(run: ExecutedRun) -> list[_Span]:
    course, clock, spans = run.course, run.clock.clock, list[_Span]()
    stops = np.flatnonzero(course.stop)
    first, last = run.covered
    held = [stand.arc for stand in run.held]
    arcs, index = np.unique(run.deviation.arc, return_index=True)
    times = run.deviation.time[index]
    for a, b in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        if not course.judged[a:b].all() or course.arc[b] <= first or course.arc[a] >= last:
            continue
        if course.kept[[a, b]].any():  # the robot goes on, or comes, by a way that nobody knows: it bends there
            continue
        begin, end = (float(np.interp(course.arc[k], arcs, times)) for k in (a, b))  # on the log's clock
        inside = [s for s in run.clock.stretches if s.begin < end and s.end > begin] or list(run.clock.stretches[:1])
        if len(inside) != 1 or any(course.arc[a] < arc < course.arc[b] for arc in held):
            continue
        rate, override = inside[0].rate, inside[0].override
        rate = override if abs(rate / override - 1) < NEAR_RATE else rate
        duration = float(clock[b] - clock[a]) / rate
        if duration < SHORTEST:
            continue
        parts = np.linspace(0.0, duration, int(np.ceil(duration / LONGEST)) + 1)
        for t, u in zip(parts[:-1].tolist(), parts[1:].tolist(), strict=True):
            low, high = np.interp(clock[a] + rate * np.array([t, u]), clock, course.arc).tolist()
            if high > first and low < last:
                spans.append(_Span(stops=(a, b), rate=rate, first=t, last=u, low=low, high=high))
    return spans


def _telling(course: ProgramCourse, clock: Array, spans: list[_Span]) -> list[_Span]:
    """As many spans as are looked at: half of them those where smoothing shows most, the others evenly spread."""
    if len(spans) <= WINDOWS:
        return spans
    bends = []
    for span in spans:
        first, last = np.interp([span.low, span.high], course.arc, clock)
        place = course.place(np.interp(np.linspace(first, last, SEEN), clock, course.arc))
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
    run: ExecutedRun, robot: Robot, span: _Span, every: int, posture: int | None, weight: float, spread: Array
) -> Window | None:
    course, deviation, clock = run.course, run.deviation, run.clock.clock
    a, b = span.stops
    duration = float(clock[b] - clock[a]) / span.rate
    time = np.arange(max(span.first - MEMORY, 0.0), span.last + BEYOND, robot.controller.period / PARTS)
    arc = np.interp(clock[a] + span.rate * np.clip(time, 0.0, duration), clock, course.arc)
    rest = max(AT_REST, 3 * deviation.noise)
    low, high = max(span.low, course.arc[a] + rest), min(span.high, course.arc[b] - rest)
    rows = np.flatnonzero((deviation.arc > low) & (deviation.arc < high) & deviation.judged)[::every]
    if len(rows) < LEAST_RAMP:
        return None
    within = np.flatnonzero((course.kept[a:b] < 1) & ~course.stop[a:b]) + a
    at = deviation.row[rows]
    reach = RAMP if duration < RAMP else min(RAMP, duration / 2)  # a short run is one ramp
    since = np.interp(deviation.arc[rows], course.arc, clock) / span.rate - clock[a] / span.rate
    return Window(
        position=course.place(arc),
        theta=None if posture is None else _joints(course, robot, arc, posture),
        arc=arc,
        time=time,
        corner=(clock[within] - clock[a]) / span.rate,
        kept=course.kept[within],
        before=spread[within - 1],
        spread=spread[course.way(arc - np.diff(arc, prepend=arc[0]) / 2)],
        shown=deviation.time[rows],
        place=run.followed.position[at],
        row_arc=deviation.arc[rows],
        off=run.followed.projection.off[at],
        block=np.zeros(len(rows), dtype=np.int64),
        ramp=AFTER_STOP * (since < reach) + BEFORE_STOP * (since > duration - reach),
        weight=weight,
        run=span.stops,
        rate=span.rate,
        first=float(np.diff(clock)[course.statement == course.statement[a]].sum()) / span.rate,
        is_whole=span.first == 0 and span.last == duration,
    )


def _joints(course: ProgramCourse, robot: Robot, arc: Array, posture: int) -> Array:
    """Commanded joints at arc lengths, (K, 6) [rad]."""
    k, share = course.on_way(arc)
    joints, _ = solve_tool(robot, Pose(course.place(arc), course.rotation_at(arc)), course.tool, ALL_POSTURES[posture])
    return nearest_turns(joints, course.theta[k] + share[:, None] * (course.theta[k + 1] - course.theta[k]))


def residuals(windows: Sequence[Window], robot: Robot, tool: Pose, motion: ControllerMotion) -> Array:
    """From the smoothed curve's nearest point to each row, and along the curve near stops, (R, 4) [m].

    Args:
        windows: Of a run.
        robot: Its period, and its arm where joints are smoothed.
        tool: TCP in the flange.
        motion: What the controller does; its lag is of no consequence.
    """
    return np.concatenate([fitted(window, robot, tool, motion)[0] for window in windows])


def keeps_law(windows: Sequence[Window], robot: Robot, tool: Pose, motion: ControllerMotion) -> BoolArray:
    """Rows that a controller's motion passes at its own speed, (R,): the others were slowed down."""
    own = [(window, motion.in_run(window.first)) for window in windows]
    return np.concatenate([_in_time(window, fitted(window, robot, tool, each)[1], each) for window, each in own])


def retimed(
    run: ExecutedRun, windows: Sequence[Window], robot: Robot, tool: Pose, motion: ControllerMotion
) -> ExecutedRun:
    """A run whose statements took as long as a log says: whole periods more, or less, than their words.

    A controller slows down where its joints would be too fast, and a speed that was read from a log is a little off.
    What passes late by a delay after a position was commanded, was commanded late.
    """
    clock, period = run.clock.clock.copy(), robot.controller.period
    for window in (w for w in windows if w.is_whole and not len(w.corner)):
        (a, b), own = window.run, motion.in_run(window.first)
        delay = sum(own.moving_averages) / 2 + sum(own.first_orders)
        passed = fitted(window, robot, tool, own)[1]
        steady = _steady(window, passed, own, delay)  # half of the last ramp tells how long the last one took
        if steady.sum() < LEAST_RAMP:
            continue
        commanded = (run.clock.clock[a + 1 : b + 1] - run.clock.clock[a]) / window.rate
        late = np.interp(commanded + delay, passed[steady], (window.shown - passed)[steady])
        shift, shifts = 0.0, np.empty(len(late))
        for k, each in enumerate((late - (window.shown - passed)[steady][0]).tolist()):
            shift = shift if abs(each - shift) < SURE_SHIFT * period else period * round(each / period)
            shifts[k] = shift
        clock[a + 1 : b + 1] += window.rate * shifts
        clock[b + 1 :] += window.rate * shift
    return replace(run, clock=replace(run.clock, clock=np.maximum.accumulate(clock)))


def _steady(window: Window, passed: Array, motion: ControllerMotion, later: float = 0.0) -> BoolArray:
    """Rows (R,) that a motion passes at speed: after its run has come up, before it goes down or ``later`` [s]."""
    settling = sum(motion.moving_averages) + sum(motion.first_orders)
    ends = window.time[np.searchsorted(window.arc, window.arc[-1])]
    return np.asarray((passed > settling) & (passed < ends + later))


def _in_time(window: Window, passed: Array, motion: ControllerMotion) -> BoolArray:
    """Rows (R,) of one window about which its clock keeps the law's: (R,) [s] is when the law's motion is there.

    Over twice the smoothing's length a clock may fall behind by a tenth of it, as where two motions differ in their
    means. A ramp counts as a whole, for one speed is fitted to it.
    """
    settling = sum(motion.moving_averages) + sum(motion.first_orders)
    steady = _steady(window, passed, motion)
    if steady.sum() < LEAST_RAMP:
        return np.ones(len(passed), dtype=bool)
    shown = window.shown
    at, late = shown[steady], (shown - passed)[steady]
    before, after = (np.interp(shown + side, at, late) for side in (-settling, settling))
    kept = np.abs(after - before) <= SLOW * settling
    for side in (AFTER_STOP, BEFORE_STOP):
        ramp = window.ramp == side
        kept[ramp] &= kept[ramp & steady].all()
    return np.asarray(kept)


def fitted(window: Window, robot: Robot, tool: Pose, motion: ControllerMotion) -> tuple[Array, Array]:
    """Residuals of a window's rows (R, 4) [m], and when its motion passes them, (R,) [s] since the run began."""
    time, curve, way = smoothed(window, robot, tool, motion)
    arc = lengths_along(curve)
    at, off = _nearest_about(curve, arc, window.place, np.interp(window.row_arc, way, arc))
    passed, along = np.interp(at, arc, time), np.zeros(len(at))
    moved = (time, arc, np.gradient(arc, time))
    for side, stop in ((AFTER_STOP, 0.0), (BEFORE_STOP, float(arc[-1])), (AFTER_STOP + BEFORE_STOP, None)):
        rows = window.ramp == side
        if rows.sum() >= LEAST_RAMP:
            along[rows] = _unexplained(moved, at[rows], window.shown[rows], passed[rows], stop)
    return np.column_stack([off, window.weight * along]), passed


def _nearest_about(curve: Array, arc: Array, places: Array, expected: Array) -> tuple[Array, Array]:
    """Where a curve passes places (R, 3) nearest, about expected arc lengths: (R,) [m], and from there, (R, 3) [m].

    Where it turns by more than a right angle a search from one side ends there: far rows are looked for from both.
    """
    tangents = tangents_of(curve)
    at, _, off = nearest(curve, arc, tangents, places, expected, STEPS)
    far = np.flatnonzero(norm(off) > FAR)
    beside = (expected[far] + side for side in (BOTH_SIDES[0], BOTH_SIDES[-1]))
    far = far[dot(*(interpolated(place, arc[:-1], tangents) for place in beside)) < 0]
    for shift in BOTH_SIDES if len(far) else ():
        other_at, _, other = nearest(curve, arc, tangents, places[far], expected[far] + shift, STEPS)
        nearer = norm(other) < norm(off[far]) / 2
        at[far[nearer]], off[far[nearer]] = other_at[nearer], other[nearer]
    return at, off


def _unexplained(
    moved: tuple[Array, Array, Array], at: Array, shown: Array, passed: Array, stop: float | None
) -> Array:
    """What neither a shift of the clock nor another speed explains of places along a curve near a stop, (R,) [m].

    Args:
        moved: Time [s], way [m] and speed [m/s] of the smoothed motion, (K,) each.
        at: Where rows are, (R,) [m].
        shown: Log's clock, (R,) [s].
        passed: When the motion is there, (R,) [s].
        stop: Where it stops [m]; None between two stops, where no other speed is possible.
    """
    shift, factor, left = float(np.median(shown - passed)), 1.0, at
    for _ in range(ROUNDS):
        way, speed = (np.interp(shown - shift, moved[0], column) for column in moved[1:])
        origin = 0.0 if stop is None else stop
        left = at - (origin + factor * (way - origin))
        slopes = np.column_stack([-factor * speed, way - origin])[:, : 1 if stop is None else 2]
        change, *_ = np.linalg.lstsq(slopes, left, rcond=None)
        left, shift = left - slopes @ change, shift + float(change[0])
        factor += float(change[1]) if stop is not None else 0.0
    return left


def _with_waits(window: Window, robot: Robot) -> tuple[Array, Array]:
    """Times (K',) [s], and what the command without waits shows there (K',) [s]; the robot's motion tells its waits."""
    wait, step = corner_wait(robot, window.kept, window.before), robot.controller.period / PARTS
    time = window.time[0] + step * np.arange(len(window.time) + round(wait.sum() / step), dtype=float)
    commanded, before = time.copy(), 0.0
    for corner, each in zip(window.corner.tolist(), wait.tolist(), strict=True):
        commanded -= np.clip(time - corner - before, 0.0, each)
        before += each
    return time, commanded


def smoothed(window: Window, robot: Robot, tool: Pose, motion: ControllerMotion) -> tuple[Array, Array, Array]:
    """Times since a window's run began (K',) [s], and then the smoothed TCP (K', 3) and the way on the course [m]."""
    motion = motion.in_run(window.first)
    time, commanded = _with_waits(window, replace(robot, motion=motion))
    theta = window.theta if motion.space == "joint" else None
    rows = np.column_stack([window.position if theta is None else theta, window.arc])
    if len(window.corner):
        rows = interpolated(commanded, window.time, rows)
    if motion.is_smooth:
        rows = smooth(rows, robot.controller.period / PARTS, motion, _spread(window, motion, commanded))
    moved, way = rows[:, :-1], rows[:, -1]
    return time, moved if theta is None else (flange_pose(robot, moved) @ tool).position, way


def _spread(window: Window, motion: ControllerMotion, commanded: Array) -> Array | None:
    """How far the arm is spread on the motion that leads to each time of a command, (K',) [m2]; None: no mean asks."""
    if not motion.reach:
        return None
    between = commanded - np.diff(commanded, prepend=commanded[0]) / 2
    return np.asarray(window.spread[np.searchsorted(window.time, between).clip(max=len(window.time) - 1)])
