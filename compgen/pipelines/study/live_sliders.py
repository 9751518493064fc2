"""What can be moved on a living page: the sliders of a path's day, and which are missing there and why."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import CompgenError
from compgen.core.toml import check
from compgen.core.units import HOUR, MINUTE, MM
from compgen.job.day_before import Programs, plan_history
from compgen.job.job import Job
from compgen.pipelines.files.path_file import programs_of, read_job_files
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.study.live_day import Day, Slider, Stage, Stops
from compgen.thermal import Duty
from compgen.thermal.schedule import Step
from compgen.thermal.tables import shifts_of, steps_of

FEEDS = (10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 125.0, 150.0, 175.0, 200.0, 250.0, 300.0)  # [mm/s] of a table
MOST_FEED = 300.0  # [mm/s]
LONGEST_DELAY, MOST_DELAY = 120.0, 960.0  # [min] unless the path's is longer, and that a path file takes
AROUND = 10.0  # [K] that the air can be moved to either side
MOST_RUNS = 200  # that a slider stops at
IN_CYCLE = "Hours and runs of the warm-up: [[cycle]] keeps to the hours of [[shift]], at which it would begin later."
CTE = "thermal.cte_um_m_K"

Sliders = tuple[list[Slider], list[str]]  # and sentences of those that are missing


def day_of(path_file: str, robot: str | None, overrides: Sequence[str], job: Job) -> Day:
    """The stages before a job, and its sliders.

    Args:
        path_file: That the job was read from.
        robot: Robot name or file; None for what the path file says.
        overrides: Of the job.
        job: As planned, but for the start, which is the first run's, at once.
    """
    files, programs = read_job_files(path_file, robot, overrides), programs_of(job.plan, job.cell)
    path = check(PathFile, files.path_data, path_file)
    stages = list(_stages(path, programs, job))
    shifts = shifts_of(path.shift, (*path.before, *path.cycle, *path.after), path_file)
    parts = (_before(path, stages), _air(path, job), _start(path, job), _cte(files.robot_text.tables))
    if path.state is None:  # what the cycle begins with before its first run
        steps, clock = [stage.step for stage in stages], path.ambient.clock_h * HOUR
        day = plan_history(programs, job.history.air, (steps, (), ()), shifts, clock)
        stages += _fixed(job.history.before[len(day.before) :], job)
    return Day(
        stages=tuple(stages),
        sliders=tuple(slider for sliders, _ in parts for slider in sliders),
        missing=tuple(dict.fromkeys(words for _, missing in parts for words in missing)),
        shifts=shifts,
        clock=path.ambient.clock_h * HOUR,
        cell=job.cell,
        history=job.history,
        programs=programs,
    )


def _stages(path: PathFile, programs: Programs, job: Job) -> Iterator[Stage]:
    """The entries of [[before]]; what an anchored state stands for, which no slider moves."""
    has_law = job.heat.law is not None
    if path.state is not None:
        yield from _fixed(job.history.before, job)
        return
    for step in steps_of(path.before, "before", job.source, job.feed):
        if step.state != "moving":
            yield Stage(step, goal=None if has_law else _goal(step, programs, job))
            continue
        own = replace(step, feed=step.feed or programs.plan(step.program).process.feed)
        repeats = own.repeat is not None
        run_time = float(programs.motion(own.program, own.feed).time[-1]) if repeats else 0.0
        stops = _stops(own, programs, job) if repeats or not has_law else None
        yield Stage(own, run_time=run_time, stops=stops)


def _fixed(duties: Sequence[Duty], job: Job) -> Iterator[Stage]:
    """Stretches that no slider moves."""
    for duty in duties:
        step = Step(key="", state=duty.state, feed=duty.feed, duration=duty.duration, share=duty.share)
        yield Stage(step, goal=None if job.heat.law is not None else job.heat.steady_state(duty))


def _goal(step: Step, programs: Programs, job: Job) -> Array:
    """Steady state of a step, (S,)."""
    alone = replace(step, repeat=None, duration=1.0, shifts=False)
    (duty,) = plan_history(programs, job.history.air, ([alone], (), ()), (), 0.0).before
    return job.heat.steady_state(duty)


def _stops(step: Step, programs: Programs, job: Job) -> Stops:
    """What a moving step's program is at other feeds."""
    feeds, times, goals = [], [], []
    planned = _mm_s(step.feed)
    for typed in sorted({*FEEDS, planned}):
        at_feed = replace(step, feed=step.feed if typed == planned else typed * MM)
        try:
            motion = programs.motion(step.program, at_feed.feed)
        except CompgenError:
            if typed == planned:
                raise
            continue  # the robot cannot drive it so fast: the slider has no such stop
        feeds.append(typed * MM)
        times.append(float(motion.time[-1]))
        if job.heat.law is None:
            goals.append([_goal(replace(at_feed, share=share), programs, job) for share in (1.0, 0.0)])
    moving, held = np.moveaxis(np.array(goals), 1, 0) if goals else np.zeros((2, len(feeds), 0))
    return Stops(np.array(feeds), np.array(times), moving, held)


def _mm_s(feed: float) -> float:
    """A feed as it is typed."""
    return round(feed / MM, 9)


def _before(path: PathFile, stages: Sequence[Stage]) -> Sliders:
    if path.state is not None:
        return [], ["Warm-up: the day begins with an anchored state, which stands in place of [[before]]."]
    if not path.before:
        given = "begins as the temperature log left it" if path.log is not None else "starts cold"
        return [], [f"Warm-up hours, feed and duty: the path has no [[before]], so that the robot {given}."]
    sliders = [slider for n, stage in enumerate(stages) for slider in _of_stage(n, stage, alone=len(stages) == 1)]
    if not any(row.shifts for row in path.cycle):
        return sliders, []
    timed = ("duration", "repeat")  # what comes after their stage begins at another time
    kept = [s for s in sliders if s.kind not in timed and not (s.kind == "feed" and stages[s.stage].run_time)]
    return kept, [IN_CYCLE]


def _of_stage(n: int, stage: Stage, *, alone: bool) -> list[Slider]:
    """The sliders of one stretch."""
    step = stage.step
    what = {"moving": "warm-up", "idle": "standing, servo on", "off": "servo off"}[step.state]
    name = what.capitalize() if alone else f"Stretch {n + 1}, {what}"

    def slider(kind: str, word: str, key: str, **numbers: Any) -> Slider:
        return Slider(kind=kind, key=f"before.{n}.{key}", label=f"{name}: {word}", stage=n, **numbers)

    if step.repeat is not None:
        most = float(max(2 * step.repeat, 20))
        sliders = [slider("repeat", "runs", "repeat", unit="", low=1, high=most, step=1, value=step.repeat)]
    else:
        hours = round((step.duration or 0.0) / HOUR, 9)
        most = max(8.0, 2 * hours)
        sliders = [slider("duration", "hours", "duration_h", unit="h", low=0, high=most, step=0.05, value=hours)]
    if step.state != "moving":
        return sliders
    feed, stops = _mm_s(step.feed), () if stage.stops is None else tuple(map(_mm_s, stage.stops.feed.tolist()))
    low, high = (min(stops), max(stops)) if stops else (5.0, max(MOST_FEED, feed))
    span = {"low": min(low, feed), "high": high, "step": 1, "value": feed, "stops": stops}
    sliders.append(slider("feed", "feed", "feed_mm_s", unit="mm/s", **span))
    if step.repeat is None:  # runs whose share is less have no time in their stretch
        sliders.append(slider("duty", "duty", "duty", unit="of time", low=0, high=1, step=0.01, value=step.share))
    return sliders


def _air(path: PathFile, job: Job) -> Sliders:
    names: dict[str, list[tuple[str, str, tuple[float, ...]]]] = {
        "wave": [("value_degC", "Ambient, mean of the wave", (1.0,))],
        "ramp": [("from_degC", "Ambient, first", (1.0, 0.0)), ("to_degC", "Ambient, last", (0.0, 1.0))],
    }
    table, air = path.ambient, job.history.air
    if table.kind == "csv":
        return [], ["Ambient: the air comes from a file of temperatures (ambient.kind = 'csv')."]
    sliders = []
    for k, (key, label, knots) in enumerate(names.get(table.kind, [("value_degC", "Ambient", (1.0,))])):
        value = round(table.reference_degC + float(air.rise[k]), 9)
        low, high = max(-20.0, np.floor(value) - AROUND), min(60.0, np.ceil(value) + AROUND)
        of_air = partial(Slider, kind="air", key=f"ambient.{key}", label=label, unit="degC", step=0.1)
        sliders.append(of_air(low=low, high=high, value=value, knots=knots))
    return sliders, []


def _start(path: PathFile, job: Job) -> Sliders:
    """Of the start that is meant: as the path file says it, or the first of those that its file serves."""
    run, delay = (1, 0.0) if path.start is None else (path.start.run, path.start.delay_min)
    if job.ensemble is not None:
        run, delay = run + job.ensemble.runs[0], delay + job.ensemble.delay[0] / MINUTE
    most, runs = min(max(LONGEST_DELAY, 2 * delay), MOST_DELAY), len(job.history.runs)
    of_delay = partial(Slider, kind="delay", key="start.delay_min", label="Start delay, servo on", unit="min")
    sliders = [of_delay(low=0, high=most, step=0.5, value=delay)]
    if runs == 1:
        return sliders, ["Run of the schedule: the path has no [[cycle]], so that the program runs once."]
    numbers = sorted({*np.linspace(1, runs, min(runs, MOST_RUNS)).round().astype(int).tolist(), run})
    of_run = partial(Slider, kind="run", key="start.run", label=f"Run of the schedule, of {runs}", unit="")
    stops = tuple(map(float, numbers))
    return [*sliders, of_run(low=1, high=runs, step=1, value=float(run), stops=stops)], []


def _cte(robot_data: dict[str, Any]) -> Sliders:
    value = robot_data.get("thermal", {}).get("cte_um_m_K")
    if not isinstance(value, (int, float)):
        reason = "a value for each length" if isinstance(value, dict) else "none"
        return [], [f"Coefficient of expansion: the robot file gives {reason} ({CTE})."]
    if not value:
        return [], [f"Coefficient of expansion: it is 0 in the robot file ({CTE})."]
    low, high = sorted((0.6 * value, 1.6 * value))
    of_cte = partial(Slider, kind="cte", key=f"robot.{CTE}", label="Coefficient of expansion", unit="um/(m K)")
    return [of_cte(low=round(low, 2), high=round(high, 2), step=0.05, value=float(value))], []
