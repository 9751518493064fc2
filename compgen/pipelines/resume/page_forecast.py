"""What the pages of a running job will leave on the part, with the state that the robot will have."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, rms, row_norms
from compgen.core.pose import Pose
from compgen.core.units import UM
from compgen.error_model.anchored_state import AnchoredState, state_text
from compgen.error_model.model import build_error_model
from compgen.fanuc import Program
from compgen.job.anchored_start import cell_with_state
from compgen.job.job import Job
from compgen.pipelines.resume.beginning import Beginning, Known, begin_at, known_state, unmoved
from compgen.pipelines.resume.driven_course import Course, motion_from, page_motion
from compgen.pipelines.resume.page_times import PageTimes
from compgen.pipelines.resume.resume import segments_on_part
from compgen.pipelines.resume.whole import Whole
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.robot import inverse_kinematics, joint_path
from compgen.thermal import JointMotion, states_at
from compgen.thermal.model import state_with_rises
from compgen.thermal.rise_filter import Miss, filter_of

SAMPLES = 400  # waypoints of a page that its forecast looks at


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a page will leave on the part, or the rest of the one that runs."""

    page: int
    start: float  # [s] on the log's clock
    max: float  # [m]
    rms: float  # [m]
    rise: tuple[float, ...]  # [K] when it starts, or now


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Forecaster:
    """Pages of a job with a state."""

    written: WrittenJob
    whole: Whole
    times: PageTimes
    course: Course
    miss: Miss
    now: float
    programs: Sequence[Program]
    anchored: AnchoredState | None

    def of_running(self, page: int, elapsed: float) -> Forecast:
        """What the rest of the page that runs leaves."""
        motion, first = page_motion(self.whole, page, self.times)
        row = int(np.clip(np.searchsorted(motion.time, elapsed) - 1, 0, len(motion.time) - 2))
        rises = self._rises(self.course.states[-1], motion_from(motion, row), self.now)
        return self._forecast(page, self.now, first + row, *rises)

    def of_page(self, page: int) -> Forecast:
        """What a page leaves that has not begun."""
        state, start = self.state_at_start(page)
        motion, first = page_motion(self.whole, page, self.times)
        return self._forecast(page, start, first, *self._rises(state, motion, start))

    def state_at_start(self, page: int) -> tuple[Array, float]:
        """State by the model when a page starts if nobody waits from now on, and when that is [s]."""
        running, elapsed = self.times.running(self.now)
        z, time = self.course.states[-1], self.now
        heat = self.whole.job.heat
        for n in range(running or self.times.last(self.now) + 1, page):
            motion, _ = page_motion(self.whole, n, self.times)
            row = (
                int(np.clip(np.searchsorted(motion.time, elapsed) - 1, 0, len(motion.time) - 2)) if n == running else 0
            )
            run = motion_from(motion, row)
            z = states_at(heat, z, run, np.array([len(run.time) - 1]), self.course.air, time)[0]
            time += float(run.time[-1])
        return z, time

    def beginning(self, page: int, source: str, forecast: Forecast, hidden: Array) -> Beginning:
        """How the robot begins a page, for its correction, and what its log hides, (L, K) [K]."""
        job, (state, start) = self.whole.job, self.state_at_start(page)
        missed = RiseAhead(self.miss, job).miss_at(start - self.now)
        heat, K = job.cell.heat, len(job.heat.names)
        rise = job.heat.outputs @ state + missed.rise
        whole_state = state_with_rises(heat, np.arange(len(heat.names)), rise, state)
        cause: dict[str, Any] = {
            "log": Path(source).name,
            "log_end_s": self.now,
            "start_on_log_s": start,
            "forecast_um": round(forecast.max / UM, 3),
        }
        why = f"log {cause['log']} at {self.now:.0f} s: it would leave {cause['forecast_um']:.1f} um"
        clock = job.clock + start - self.times.planned
        known = self.known(page)
        warmth = known.cell.warmth.begun(missed.covariance[:K, :K], hidden)
        known = replace(known, cell=replace(known.cell, warmth=warmth))
        if self.anchored is not None and known.cell.state is not None and known.cell.state is self.anchored:
            cause |= {"state_time_s": self.anchored.time, "state_toml": state_text(self.anchored)}
        air = None if self.course.air is job.history.air else float(self.course.air.at(np.array([start]))[0])
        return begin_at(self.whole, replace(known, clock=clock), whole_state, air, why, cause)

    def known(self, page: int) -> Known:
        """The robot by the plan, with its base and what has drifted as the latest state has it."""
        known = known_state(self.whole, self.written.resumed, page, self.written.pages[page - 1].first)
        latest = max((float(e["state_time_s"]) for e in known.earlier if "state_time_s" in e), default=-np.inf)
        if self.anchored is None or self.anchored.time <= latest:
            return known
        return replace(known, cell=cell_with_state(unmoved(self.whole.job), self.anchored, "--state"))

    def _rises(self, state: Array, motion: JointMotion, begin: float) -> tuple[IntArray, Array]:
        """Waypoints of a motion that its forecast looks at, (P,), and rises there by the model, (P, K) [K]."""
        rows = np.unique(np.linspace(0, len(motion.time) - 1, SAMPLES).astype(int))
        heat = self.whole.job.heat
        return rows, states_at(heat, state, motion, rows, self.course.air, begin) @ heat.outputs.T

    def _forecast(self, page: int, start: float, first: int, rows: IntArray, rise: Array) -> Forecast:
        whole, at = self.whole, first + rows
        later = start - self.now + whole.time[at] - whole.time[at[0]]
        rise = rise + RiseAhead(self.miss, whole.job).at_each(later)
        text, begin = self.programs[page - 1], self.written.pages[page - 1].first
        job = whole.job
        pose = Pose(text.position[at - begin], text.rotation[at - begin])
        in_world = pose if job.frame is None else job.frame.register @ pose
        joints = inverse_kinematics.solve_tool(job.robot, in_world, job.tool.pose, job.posture).theta
        theta = joint_path.nearest_turns(joints, whole.theta[at])
        cell = self.known(page).cell
        model = whole.model
        if cell is not job.cell:
            model = build_error_model(job.robot, cell.sources, len(job.heat.names), job.tool.pose)
        actual = model.actual_pose(theta, rise, whole.motion.at(at)).position
        error = row_norms(actual - whole.path.target.position[at])
        touching = on_part_rows(whole)[at]
        error = error[touching] if touching.any() else error[:0]
        largest = float(error.max()) if len(error) else 0.0
        mean = rms(error) if len(error) else 0.0
        return Forecast(page, start, largest, mean, tuple(rise[0].tolist()))


@dataclass(frozen=True, eq=False, slots=True)
class RiseAhead:
    """What is missed later: m tends to b, and b to nothing."""

    miss: Miss
    job: Job

    def miss_at(self, time: float) -> Miss:
        """So much later [s]."""
        return filter_of(self.job.cell.warmth, 0.0, 0.0).ahead(self.miss, max(time, 0.0))

    def at_each(self, time: Array) -> Array:
        """(P, K) [K] at rising times (P,) [s]."""
        knots = np.linspace(time[0], max(time[-1], time[0] + 1.0), 9)
        course = np.array([self.miss_at(float(t)).rise for t in knots])
        return np.array([np.interp(time, knots, column) for column in course.T]).T


def on_part_rows(whole: Whole) -> BoolArray:
    """Waypoints where the tool touches, (N,)."""
    on_part = segments_on_part(whole.path)
    return np.asarray(np.append(on_part, on_part[-1]) & np.append(on_part[0], on_part))
