"""One look at a running job: how warm the robot is by now, what that makes of its pages, and whether one is due anew.

Nothing is remembered from look to look: the log, the times of the pages and the manifest say all. The heat model is
driven by what the pages have really done; ``thermal.rise_filter`` tells from the readings what it misses. A page is
forecast with the state that the model reaches when it starts, and what is missed then.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.units import DAY, MINUTE
from compgen.error_model.anchored_state import AnchoredState
from compgen.job.job import Cell
from compgen.pipelines.resume.beginning import MOST_LATE, Begun, state_warnings
from compgen.pipelines.resume.page_forecast import Course, Forecaster, PageForecast, model_course
from compgen.pipelines.resume.page_times import PageTimes
from compgen.pipelines.resume.paged_run import PagedRun
from compgen.thermal import Ambient
from compgen.thermal.log_doubt import doubt_of
from compgen.thermal.log_end import hidden_at_end
from compgen.thermal.log_prior import Expected, prior_from_log, rounding_of
from compgen.thermal.rise_filter import FLOOR, NOISE, STEP, Anchor, Miss, Readings, filter_of, misses, steadied
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.temperature_log import GrowingLog, Temperatures, readings_in_steps

FROM_START = 0.05  # [K] that sensors are off together where their rises count from the log's beginning
NIGHT = 3.0  # [K] the same of all rises together where the log has no air [assumed]
AIR = 3.0  # [K] that the air may be off the plan's then [assumed]
BELOW = 3.0  # [K] that no part is below all air and readings: nothing cools the arm [assumed]
RUNS_AWAY = 2.5  # standard deviations of that offset, from which on nothing is believed; honest days reach 1.9
GAP = 10 * MINUTE  # without a row, and three times the usual, from which on that is told
START = 1.0  # [K] that the rises at the planned start may be off, beside the law [assumed]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(rise=("K",), sigma=("K",), missed=("K",))
class Look:
    """A running job at the last reading."""

    time: float  # [s] on the log's clock
    running: int = 0  # page; 0: the robot stands
    share: float = 0.0  # of its motion that is done
    behind: int = 0  # the last page that began behind the log's end, by who wrote it down; 0: none
    rise: Array  # (K,) [K]
    sigma: Array  # (K,) [K]
    missed: Array  # (K,) [K] of that, beside the model's forecast
    forecasts: tuple[PageForecast, ...] = ()  # of the running page and the next, or of the next
    due: int = 0  # the page that leaves the bound and may be written anew; 0: none
    beginning: Begun | None = None  # of that page
    over: bool = False  # the last page has ended
    loaded: int  # the last page that the controller has
    notes: tuple[str, ...]
    doubt: str = ""  # what contradicts the log, so that no page is written


def look_at(  # noqa: PLR0913  what a user may say of a running job
    run: PagedRun,
    log: GrowingLog,
    source: str,
    times: PageTimes,
    within: float,
    loaded: int,
    lead: float,
    anchored: AnchoredState | None = None,
) -> Look | None:
    """A running job at its log's last reading; None before the first one since its planned start.

    Args:
        run: The job in its folder.
        log: So far.
        source: The log's file.
        times: Which page ran when.
        within: Largest error on the part that a page may have [m].
        loaded: The last page that the controller has, as far as it is known beside ``times``.
        lead: How long before its start a page is taken as loaded [s].
        anchored: What touches have said of the robot, at a time on the log's clock; it counts from then on.
    """
    if log.readings is None:
        return None
    rises = log.readings.rises(run.zero.reference, run.zero.window)
    now = float(rises.time[-1])
    if now < times.planned:
        return None
    if clock := _clock_doubt(log, times, now):
        none = np.zeros(len(run.heat.names))
        return Look(time=now, rise=none, sigma=none, missed=none, loaded=loaded, notes=_notes(log), doubt=clock)
    of_state = () if anchored is None else _state_notes(run, anchored, times.planned, now)
    if anchored is not None and not times.planned <= anchored.time <= now:
        anchored = None
    sensed = _sense(run, log.readings, rises, times, anchored)
    forecaster = Forecaster(
        run=run,
        times=times,
        course=sensed.course,
        miss=sensed.miss,
        now=now,
        anchored=anchored,
        is_air_logged=log.readings.ambient is not None,
    )
    page, elapsed = times.running(now)
    begun, count = times.last(now), len(run.written.pages)
    have = max(loaded, _loaded_by_now(run, times, now, lead))
    ahead = [forecaster.of_page(n) for n in dict.fromkeys((begun + 1, have + 1)) if n <= count and not sensed.doubt]
    forecasts = [forecaster.of_running(page, elapsed)] if page and not sensed.doubt else []
    due = next((one for one in ahead if one.max > within and one.page > have), None)
    return Look(
        time=now,
        running=page,
        share=elapsed / times.duration[page - 1] if page else 0.0,
        behind=times.begun_behind(now),
        rise=sensed.rise,
        sigma=sensed.miss.sigma,
        missed=sensed.miss.rise,
        forecasts=(*forecasts, *ahead),
        due=due.page if due else 0,
        beginning=forecaster.beginning(due.page, source, due, sensed.hidden(run.cell)) if due else None,
        over=begun == count and page == 0,
        loaded=have,
        notes=(*_notes(log), *of_state),
        doubt=sensed.doubt,
    )


def _loaded_by_now(run: PagedRun, times: PageTimes, now: float, lead: float) -> int:
    """The last page that the controller has by what the clock and the folder say, or takes in before ``lead`` ends."""
    have = max(times.loaded(now), run.written.loaded, run.written.done)
    page, elapsed = times.running(now)
    is_soon = bool(page) and page < len(run.written.pages) and times.duration[page - 1] - elapsed <= lead
    return max(have, page + 1) if is_soon else have


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Sensed:
    """What a log says of the robot at its last reading."""

    course: Course  # by the model alone
    miss: Miss  # beside it
    rise: Array  # (K,) [K]
    judged: TemperatureLog  # readings since the planned start
    expected: Expected | None  # of them, by the model
    doubt: str  # what contradicts the log

    def hidden(self, cell: Cell) -> Array:
        """What one sensor may be off unseen, (L, K) [K]."""
        return hidden_at_end(prior_from_log(self.judged, cell.heat, cell.warmth, self.expected), self.judged, cell.heat)


def _sense(
    run: PagedRun, log: Temperatures, rises: TemperatureLog, times: PageTimes, anchored: AnchoredState | None
) -> _Sensed:
    """The model driven as the pages ran, and what the readings say that it misses."""
    cell, names, zero = run.cell, run.heat.names, run.zero
    air = (
        Ambient(rises.time, rises.air) if log.ambient is not None else run.history.air.since(run.clock - times.planned)
    )
    course = model_course(run, times, air, float(rises.time[-1]))
    sensors = FROM_START if zero.reference == "start" else cell.warmth.sensors
    planned_air = float(run.history.air.at(np.array([run.clock]))[0])
    apart = float(air.at(np.array([times.planned]))[0]) - planned_air
    night, hall = (NIGHT, AIR) if log.ambient is None else (abs(apart), 0.0)
    rise_filter = filter_of(cell.warmth, START, sensors, night, hall)
    readings = steps_of_readings(names, rises.readings, rises.time, course.first)
    forecast = course.states @ run.heat.outputs.T
    expected = None
    if anchored is None:
        moments = np.array((course.first + np.arange(len(forecast))) * STEP, dtype=float)
        expected = Expected(moments, np.array(forecast, dtype=float), apart)
    degrees = zero.reference if isinstance(zero.reference, float) else zero.degC
    judged = rises.rows(rises.time >= times.planned)
    doubt = doubt_of(judged, cell.heat, cell.warmth, log.column, degrees, expected)
    anchors = [] if anchored is None else [_anchor(names, anchored)]
    miss = misses(rise_filter, steadied(readings), forecast, course.first, anchors)[-1]
    rise = forecast[-1] + miss.rise
    if not doubt:
        lowest = min(planned_air, *(float(np.nanmin(v)) for v in (rises.air, *rises.readings.values())))
        doubt = _miss_doubt(names, rise, miss.offset / sensors, lowest)
    return _Sensed(course=course, miss=miss, rise=rise, judged=judged, expected=expected, doubt=doubt)


def _miss_doubt(names: Sequence[str], rise: Array, offset: float, lowest: float) -> str:
    """What contradicts the rises that a log comes to; empty where nothing does.

    Args:
        names: Of the rises.
        rise: (K,) [K].
        offset: That the sensors share, in standard deviations.
        lowest: Of all air and readings [K].
    """
    if abs(offset) > RUNS_AWAY:
        return f"all sensors: off together by {abs(offset):.1f} times what is known of them; mend the log"
    k = int(np.argmin(rise))
    if rise[k] < lowest - BELOW:
        far = f"{names[k]} is then {lowest - rise[k]:.1f} K colder than all air and readings"
        return f"all sensors: after what the robot has done, {far}; give the log, and --planned, of this job"
    return ""


def _clock_doubt(log: GrowingLog, times: PageTimes, now: float) -> str:
    """What contradicts the clocks of the log and the pages; empty where nothing does."""
    if log.has_no_clock:
        return "the log's clock stands: all its rows have the time of the first one; mend the logger"
    longest = sum(times.duration) + MOST_LATE
    if now - times.planned > longest:
        late = f"the log's last time_s is {now:.0f} s, {(now - times.planned) / DAY:.1f} days after --planned"
        return f"{late}; {longest / DAY:.1f} at most: give --planned on the log's clock, in seconds"
    for start in times.starts[:1]:
        if not -DAY <= start.time - times.planned <= longest:
            apart = f"the first page starts at {start.time:.0f} s, --planned is {times.planned:.0f} s"
            return f"{apart}: give pages, log and --planned one clock"
    return ""


def _anchor(names: Sequence[str], anchored: AnchoredState) -> Anchor:
    """An anchored state as the filter takes it."""
    of_state = [k for k, name in enumerate(anchored.nodes) if name in names]
    which = np.array([names.index(anchored.nodes[k]) for k in of_state])
    return Anchor(
        int(np.ceil(anchored.time / STEP)), which, anchored.rise[of_state],
        anchored.covariance[np.ix_(of_state, of_state)],
    )  # fmt: skip


def _state_notes(run: PagedRun, anchored: AnchoredState, planned: float, now: float) -> tuple[str, ...]:
    """What a user must know of a state: that it does not count at its time, or what it found beside warmth."""
    name = f"state {anchored.digest[:8]} {anchored.origin()}"
    if anchored.time < planned:
        return (f"{name} is from before the job was planned to start (--planned {planned:.0f} s): it does not count",)
    if anchored.time > now:
        return (f"{name} is from behind the log's end: it does not count yet",)
    return tuple(f"{name}{words}" for words in state_warnings(anchored, run.plain))


def _notes(log: GrowingLog) -> tuple[str, ...]:
    notes = []
    if log.left_out:
        notes.append(f"{log.left_out} rows of the log cannot be read and are left out")
    if log.gaps:
        notes.append(f"{log.gaps} readings are no temperatures of a cell and are left out")
    if log.set_back:
        notes.append(f"the log's clock was set back, or hung: later rows are moved on by {log.set_back:.0f} s")
    time = log.readings.time if log.readings is not None else np.zeros(1)
    step = np.diff(time, prepend=time[0])
    if (gap := float(step.max())) > max(GAP, 3 * log.step):
        end = time[int(step.argmax())]
        notes.append(f"the log has no row for {gap:.0f} s before {end:.0f} s: a gap, or its clock was set forward")
    return tuple(notes)


def steps_of_readings(names: Sequence[str], readings: Mapping[str, Array], time: Array, first: int) -> list[Readings]:
    """Readings of all sensors by steps of time, none before a step."""
    by_step: dict[int, list[tuple[int, float, float]]] = {}
    for name, values in readings.items():
        steps, medians, count = readings_in_steps(values, time, STEP)
        sigma = np.hypot(NOISE / np.sqrt(count), np.hypot(FLOOR, rounding_of(values[np.isfinite(values)])))
        for step, value, s in zip(steps.tolist(), medians.tolist(), sigma.tolist(), strict=True):
            if step >= first:
                by_step.setdefault(step, []).append((names.index(name), value, s))
    return [
        Readings(
            step, np.array([k for k, *_ in rows]), np.array([v for _, v, _ in rows]), np.array([s for *_, s in rows])
        )
        for step, rows in sorted(by_step.items())
    ]
