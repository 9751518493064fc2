"""What the pages of a running job will leave on the part, with the state that the robot will have.

The robot's warmth by its heat model alone, driven as the pages of a job have really run.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array, owns, rms
from compgen.core.units import UM
from compgen.error_model.anchored_state import AnchoredState, parse_state, state_text
from compgen.job.anchored_start import cell_with_log, cell_with_state
from compgen.job.job import Cell
from compgen.pipelines.resume.beginning import Begun
from compgen.pipelines.resume.page_times import PageTimes
from compgen.pipelines.resume.paged_run import PagedRun
from compgen.thermal import Ambient, JointMotion, state_after, states_at
from compgen.thermal.model import state_with_rises
from compgen.thermal.rise_filter import STEP, Miss, filter_of

SAMPLES = 400  # waypoints of a page that its forecast looks at


@dataclass(frozen=True, eq=False, slots=True)
@owns(states=("T", "S"))
class Course:
    """Thermal states by the model, driven as the pages ran: at the end of steps first to last."""

    first: int
    states: Array  # (T, S)
    air: Ambient  # on the log's clock


def model_course(run: PagedRun, times: PageTimes, air: Ambient, now: float) -> Course:
    """Thermal states by the model at the end of each step from the planned start to now."""
    heat, one_second = run.heat, run.history.standing
    first, last = int(np.ceil(times.planned / STEP)), max(int(np.ceil(now / STEP)), int(np.ceil(times.planned / STEP)))
    moments = np.arange(first, last + 1) * STEP
    z, states = run.start, np.empty((len(moments), len(heat.rate)))
    states[moments <= times.planned] = z
    for begin, end, page, into in times.stretches(moments[-1] + STEP):
        inside = (moments > begin) & (moments <= end)
        if page:
            motion = run.page_motion(page)
            at = np.append(moments[inside] - begin, end - begin) + into
            rows = np.searchsorted(motion.time, np.concatenate([[into], at]) + 1e-9, side="right") - 1
            rest = motion.between(int(rows[0]))
            course = states_at(heat, z, rest, np.asarray(rows - rows[0]))
            states[inside], z = course[1:-1], course[-1]
        else:
            standing = [replace(one_second, duration=float(t - begin)) for t in moments[inside]]
            states[inside] = np.array([state_after(heat, [s], z) for s in standing]).reshape(-1, len(z))
            z = state_after(heat, [replace(one_second, duration=end - begin)], z)
    response = air.response(heat.rate, times.planned, np.maximum(moments, times.planned))
    return Course(first, states + heat.ambient * response, air)


@dataclass(frozen=True, slots=True)
class PageForecast:
    """What a page will leave on the part, or the rest of the one that runs."""

    page: int
    start: float  # [s] on the log's clock
    max: float  # [m]
    rms: float  # [m]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Forecaster:
    """Pages of a job with a state."""

    run: PagedRun
    times: PageTimes
    course: Course
    miss: Miss
    now: float
    anchored: AnchoredState | None
    is_air_logged: bool

    def of_running(self, page: int, elapsed: float) -> PageForecast:
        """What the rest of the page that runs leaves."""
        return self._forecast(page, self.now, self.course.states[-1], elapsed)

    def of_page(self, page: int) -> PageForecast:
        """What a page leaves that has not begun."""
        state, start = self.state_at_start(page)
        return self._forecast(page, start, state, 0.0)

    def state_at_start(self, page: int) -> tuple[Array, float]:
        """State by the model when a page starts if nobody waits from now on, and when that is [s]."""
        running, elapsed = self.times.running(self.now)
        z, time = self.course.states[-1], self.now
        for n in range(running or self.times.last(self.now) + 1, page):
            motion = self.run.page_motion(n)
            rest = motion.between(row_at(motion, elapsed) if n == running else 0)
            z = states_at(self.run.heat, z, rest, np.array([len(rest.time) - 1]), self.course.air, time)[0]
            time += float(rest.time[-1])
        return z, time

    def beginning(self, page: int, source: str, forecast: PageForecast, hidden: Array) -> Begun:
        """How the robot begins a page, for its correction, and what its log hides, (L, K) [K]."""
        run, (state, start) = self.run, self.state_at_start(page)
        missed = RiseAhead(self.miss, run.cell).miss_at(start - self.now)
        heat, K = run.cell.heat, len(run.heat.names)
        rise = run.heat.outputs @ state + missed.rise
        whole_state = state_with_rises(heat, np.arange(len(heat.names)), rise, state)
        cause: dict[str, Any] = {
            "log": Path(source).name,
            "log_end_s": self.now,
            "start_on_log_s": start,
            "forecast_um": round(forecast.max / UM, 3),
        }
        why = f"log {cause['log']} at {self.now:.0f} s: it would leave {cause['forecast_um']:.1f} um"
        known = self.known_cell(page)
        cell = cell_with_log(known, known.warmth.begun(missed.covariance[:K, :K], hidden))
        if self.anchored is not None and known.state is self.anchored:
            cause |= {"state_time_s": self.anchored.time, "state_toml": state_text(self.anchored)}
            why += f"; state {self.anchored.digest[:8]} {self.anchored.origin()}"
        air = float(self.course.air.at(np.array([start]))[0]) if self.is_air_logged else None
        clock = run.clock + (start - self.times.planned)
        return Begun(cell=cell, state=whole_state, clock=clock, why=why, cause=cause, air=air)

    def known_cell(self, page: int) -> Cell:
        """The robot with its base and what has drifted as the latest state has it."""
        run = self.run
        earlier = [e for e in run.written.resumed if int(e["from_page"]) < page and e.get("state_toml")]
        latest = max((float(e.get("state_time_s", -np.inf)) for e in earlier), default=-np.inf)
        if self.anchored is not None and self.anchored.time > latest:
            return cell_with_state(run.plain, self.anchored, "--state")
        if not earlier:
            return run.cell
        where = f"{run.written.manifest_file}: resumed.state_toml"
        return cell_with_state(run.plain, parse_state(str(earlier[-1]["state_toml"]).encode(), where), where)

    def _forecast(self, page: int, start: float, state: Array, elapsed: float) -> PageForecast:
        """What a page leaves from some time of its motion on [s], with the state then."""
        run, motion = self.run, self.run.page_motion(page)
        row, first = row_at(motion, elapsed), run.edges[page - 1]
        low, high = np.searchsorted(run.places, [first + row, run.edges[page] + 1]).tolist()
        at = run.places[low + np.unique(np.linspace(0, high - low - 1, SAMPLES).astype(int))]
        rows, rest = at - first - row, motion.between(row)
        rise = states_at(run.heat, state, rest, rows, self.course.air, start) @ run.heat.outputs.T
        rise = rise + RiseAhead(self.miss, run.cell).at_each(start - self.now + rest.time[rows])
        error = run.errors(page, self.known_cell(page), at, rise)
        largest = float(error.max()) if len(error) else 0.0
        mean = rms(error) if len(error) else 0.0
        return PageForecast(page, start, largest, mean)


def row_at(motion: JointMotion, elapsed: float) -> int:
    """The row of a motion that it leaves so long after its beginning [s]."""
    return int(np.clip(np.searchsorted(motion.time, elapsed) - 1, 0, len(motion.time) - 2))


@dataclass(frozen=True, eq=False, slots=True)
class RiseAhead:
    """What is missed later: m tends to b, and b to nothing."""

    miss: Miss
    cell: Cell

    def miss_at(self, time: float) -> Miss:
        """So much later [s]."""
        return filter_of(self.cell.warmth, 0.0, 0.0).ahead(self.miss, max(time, 0.0))

    def at_each(self, time: Array) -> Array:
        """(P, K) [K] at rising times (P,) [s]."""
        knots = np.linspace(time[0], max(time[-1], time[0] + 1.0), 9)
        course = np.array([self.miss_at(float(t)).rise for t in knots])
        return np.array([np.interp(time, knots, column) for column in course.T]).T
