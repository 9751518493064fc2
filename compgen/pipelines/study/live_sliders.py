"""What can be moved on a living page: the sliders of a path's day, and which are missing there and why."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import CompgenError
from compgen.core.toml import check, override, read_toml, read_toml_text
from compgen.core.units import HOUR, MINUTE, MM
from compgen.job.day_plan import Programs
from compgen.job.job import Job
from compgen.pipelines.files.path_file import programs_of
from compgen.pipelines.files.robot_file import find_robot
from compgen.pipelines.files.schema import PathFile
from compgen.pipelines.study.live_day import Stage, Stops, fixed_stages
from compgen.thermal import Duty
from compgen.thermal.schedule import Shift
from compgen.thermal.tables import shifts_of
from compgen.thermal.tables.schema import StepTable

FEEDS = (10.0, 20.0, 30.0, 50.0, 75.0, 100.0, 125.0, 150.0, 175.0, 200.0, 250.0, 300.0)  # [mm/s] of a table
MOST_FEED = 300.0  # [mm/s]
LONGEST_DELAY = 120.0  # [min]
AROUND = 10.0  # [K] that the air can be moved to either side
MOST_RUNS = 200  # that a slider stops at


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Slider:
    """One number of the day that can be moved."""

    kind: str  # duration, repeat, feed, duty, air, delay, run or cte
    key: str  # of the path or robot file
    label: str
    unit: str
    low: float
    high: float
    step: float
    value: float  # as planned, in its unit
    stops: tuple[float, ...] = ()  # the only values that it takes; any where there are none
    stage: int = -1  # that it moves
    knots: tuple[float, ...] = ()  # what a unit of it adds to the air at each knot [K]


@dataclass(frozen=True, eq=False, slots=True)
class Day:
    """The day before a program, and the sliders that move it."""

    stages: tuple[Stage, ...]
    sliders: tuple[Slider, ...]
    missing: tuple[str, ...]  # sentences: which sliders there are not, and why
    shifts: tuple[Shift, ...]  # of every day, for stages that keep to them
    clock: float  # [s] of the day at which the first stage begins


def day_of(path_file: str, robot: str | None, overrides: Sequence[str], job: Job) -> Day:
    """The stages before a job, and its sliders.

    Args:
        path_file: That the job was read from.
        robot: Robot name or file; None for what the path file says.
        overrides: Of the job.
        job: As planned, but for the start, which is the first run's, at once.
    """
    data, robot_data = _tables(path_file, robot, overrides)
    path = check(PathFile, data, path_file)
    stages, sliders, missing = _before(path, job)
    of_air, no_air = _air(path, job)
    of_start, no_start = _start(path, job)
    cte, no_cte = _cte(robot_data, job)
    return Day(
        tuple(stages),
        (*sliders, *of_air, *of_start, *cte),
        tuple(dict.fromkeys([*missing, *no_air, *no_start, *no_cte])),
        shifts_of(path.shift, path_file),
        path.ambient.clock_h * HOUR,
    )


def _tables(path_file: str, robot: str | None, overrides: Sequence[str]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Both files' tables with the overrides put in."""
    source, of_robot = Path(path_file), [o for o in overrides if o.startswith("robot.")]
    data = read_toml(source, "paths")
    for item in overrides:
        if item not in of_robot:
            override(data, item, item)
    tables = read_toml_text(find_robot(robot or data.get("robot", "m710ic50"), source), "robots").tables
    for item in of_robot:
        override(tables, item.removeprefix("robot."), item)
    return data, tables


def _before(path: PathFile, job: Job) -> tuple[list[Stage], list[Slider], list[str]]:
    duties, heat = job.history.before, job.heat
    goals = None if heat.law is not None else {duty: heat.steady_state(duty) for duty in set(duties)}
    if path.state is not None:
        words = "Warm-up: the day begins with an anchored state, which stands in place of [[before]]."
        return fixed_stages(duties, goals), [], [words]
    if not path.before:
        given = "begins as the temperature log left it" if path.log is not None else "starts cold"
        return [], [], [f"Warm-up hours, feed and duty: the path has no [[before]], so that the robot {given}."]
    stages: list[Stage] = []
    sliders: list[Slider] = []
    programs, rest = programs_of(job), list(duties)
    for n, row in enumerate(path.before):
        if row.shifts:
            stage = _stage_in_shifts(row, programs)
            rest = rest[_count_until(rest, stage.total) :]
        else:
            length = 2 * row.repeat if row.repeat is not None and row.dwell_s else 1
            own, rest = rest[:length], rest[length:]
            stage = _stage(own, row.repeat, goals)
        if row.state == "moving":
            stage = _with_stops(stage, row.program or "", job)
        sliders += _sliders_of_stage(n, _name(n, path), stage)
        stages.append(stage)
    if any(row.shifts for row in path.cycle):
        words = (
            "Hours and runs of the warm-up: [[cycle]] keeps to the hours of [[shift]], at which it would begin later."
        )
        return stages, [slider for slider in sliders if not _moves_the_clock(slider, stages)], [words]
    return stages, sliders, []


def _stage_in_shifts(row: StepTable, programs: Programs) -> Stage:
    """The stage of a stretch that is cut by the hours of the shifts, whole."""
    program, share = row.program or "", 1.0 if row.duty is None else row.duty
    feed = programs.plan(program).process.feed if row.feed_mm_s is None else row.feed_mm_s * MM
    if row.repeat is None:
        return Stage(
            state="moving", duration=(row.duration_h or 0.0) * HOUR, feed=feed, share=share, keeps_to_shifts=True
        )
    run_time = float(programs.motion(program, feed).time[-1])
    return Stage(
        state="moving",
        duration=run_time,
        feed=feed,
        share=share,
        count=row.repeat,
        dwell=row.dwell_s or 0.0,
        rest=row.dwell or "idle",
        repeated=True,
        keeps_to_shifts=True,
    )


def _count_until(duties: Sequence[Duty], time: float) -> int:
    """How many of the first duties a time [s] is made of."""
    return int(np.searchsorted(np.cumsum([0.0, *(d.duration for d in duties)]), time - 1e-6))


def _moves_the_clock(slider: Slider, stages: Sequence[Stage]) -> bool:
    """Whether what comes after its stage begins at another time."""
    return slider.kind in ("duration", "repeat") or (slider.kind == "feed" and stages[slider.stage].repeated)


def _name(n: int, path: PathFile) -> str:
    """What a stretch is called beside its sliders."""
    row, alone = path.before[n], len(path.before) == 1
    what = {"moving": "warm-up", "idle": "standing, servo on", "off": "servo off"}[row.state]
    return what.capitalize() if alone else f"Stretch {n + 1}, {what}"


def _stage(duties: Sequence[Duty], repeat: int | None, goals: dict[Duty, Array] | None) -> Stage:
    """The stage of a stretch's duties, which are one, or runs and dwells in turn."""
    first = duties[0]
    goal = None if goals is None else goals[first]
    if repeat is None:
        return Stage(state=first.state, duration=first.duration, feed=first.feed, share=first.share, goal=goal)
    if len(duties) == 1:
        return Stage(
            state=first.state,
            duration=first.duration / repeat,
            feed=first.feed,
            share=first.share,
            count=repeat,
            repeated=True,
            goal=goal,
        )
    dwell = duties[1]
    return Stage(
        state=first.state,
        duration=first.duration,
        feed=first.feed,
        share=first.share,
        count=repeat,
        dwell=dwell.duration,
        rest=dwell.state,
        repeated=True,
        goal=goal,
    )


def _mm_s(feed: float) -> float:
    """A feed as it is typed."""
    return round(feed / MM, 9)


def _with_stops(stage: Stage, program: str, job: Job) -> Stage:
    """A moving stage with what its program is at other feeds, where the model or its time asks for it."""
    heat = job.cell.heat
    if heat.law is not None and not stage.repeated:
        return stage
    programs = programs_of(job)
    feeds, times, moving, held = [], [], [], []
    planned = _mm_s(stage.feed)
    for feed in sorted({*FEEDS, planned}):
        driven = partial(programs.motion, program, stage.feed if feed == planned else feed * MM)
        try:
            motion = driven()
        except CompgenError:
            if feed == planned:
                raise
            continue  # the robot cannot drive it so fast: the slider has no such stop
        feeds.append(feed * MM)
        times.append(float(motion.time[-1]))
        if heat.law is None:
            m, h = (heat.steady_state(Duty("moving", 0.0, 0.0, loss=loss)) for loss in heat.mean_losses(driven))
            moving.append(m)
            held.append(h)
    shape = len(feeds), len(heat.rate) if moving else 0
    stops = Stops(np.array(feeds), np.array(times), np.reshape(moving, shape), np.reshape(held, shape))
    return replace(stage, stops=stops, goal=None)


def _sliders_of_stage(n: int, name: str, stage: Stage) -> list[Slider]:
    key, sliders = f"before.{n}", []
    if stage.repeated:
        most = float(max(2 * stage.count, 20))
        sliders.append(
            Slider(
                kind="repeat",
                key=f"{key}.repeat",
                label=f"{name}: runs",
                unit="",
                low=1,
                high=most,
                step=1,
                value=stage.count,
                stage=n,
            )
        )
    else:
        hours = round(stage.duration / HOUR, 9)
        most = max(8.0, 2 * hours)
        label = f"{name}: hours"
        sliders.append(
            Slider(
                kind="duration",
                key=f"{key}.duration_h",
                label=label,
                unit="h",
                low=0,
                high=most,
                step=0.05,
                value=hours,
                stage=n,
            )
        )
    if stage.state != "moving":
        return sliders
    feed, stops = _mm_s(stage.feed), () if stage.stops is None else tuple(map(_mm_s, stage.stops.feed.tolist()))
    low, high = (min(stops), max(stops)) if stops else (5.0, max(MOST_FEED, feed))
    label = f"{name}: feed"
    sliders.append(
        Slider(
            kind="feed",
            key=f"{key}.feed_mm_s",
            label=label,
            unit="mm/s",
            low=min(low, feed),
            high=high,
            step=1,
            value=feed,
            stops=stops,
            stage=n,
        )
    )
    sliders.append(
        Slider(
            kind="duty",
            key=f"{key}.duty",
            label=f"{name}: duty",
            unit="of time",
            low=0,
            high=1,
            step=0.01,
            value=stage.share,
            stage=n,
        )
    )
    return sliders


def _air(path: PathFile, job: Job) -> tuple[list[Slider], list[str]]:
    table, air = path.ambient, job.history.air
    reference = table.reference_degC
    if table.kind == "csv":
        return [], ["Ambient: the air comes from a file of temperatures (ambient.kind = 'csv')."]
    names: list[tuple[str, str, tuple[float, ...]]] = [("value_degC", "Ambient", (1.0,))]
    if table.kind == "wave":
        names = [("value_degC", "Ambient, mean of the wave", (1.0,))]
    if table.kind == "ramp":
        names = [("from_degC", "Ambient, first", (1.0, 0.0)), ("to_degC", "Ambient, last", (0.0, 1.0))]
    sliders = []
    for k, (key, label, knots) in enumerate(names):
        value = round(reference + float(air.rise[k]), 9)
        low, high = max(-20.0, np.floor(value) - AROUND), min(60.0, np.ceil(value) + AROUND)
        sliders.append(
            Slider(
                kind="air",
                key=f"ambient.{key}",
                label=label,
                unit="degC",
                low=low,
                high=high,
                step=0.1,
                value=value,
                knots=knots,
            )
        )
    return sliders, []


def _start(path: PathFile, job: Job) -> tuple[list[Slider], list[str]]:
    """Of the start that is meant: as the path file says it, or the first of those that its file serves."""
    run, delay = (1, 0.0) if path.start is None else (path.start.run, path.start.delay_min)
    if job.ensemble is not None:
        run, delay = run + job.ensemble.runs[0], delay + job.ensemble.delay[0] / MINUTE
    most, runs = max(LONGEST_DELAY, 2 * delay), len(job.history.runs)
    sliders = [
        Slider(
            kind="delay",
            key="start.delay_min",
            label="Start delay, servo on",
            unit="min",
            low=0,
            high=most,
            step=0.5,
            value=delay,
        )
    ]
    if runs == 1:
        return sliders, ["Run of the schedule: the path has no [[cycle]], so that the program runs once."]
    stops = sorted({*np.linspace(1, runs, min(runs, MOST_RUNS)).round().astype(int).tolist(), run})
    label = f"Run of the schedule, of {runs}"
    return [
        *sliders,
        Slider(
            kind="run",
            key="start.run",
            label=label,
            unit="",
            low=1,
            high=runs,
            step=1,
            value=float(run),
            stops=tuple(map(float, stops)),
        ),
    ], []


def _cte(robot_data: dict[str, Any], job: Job) -> tuple[list[Slider], list[str]]:
    value = robot_data.get("thermal", {}).get("cte_um_m_K")
    if not isinstance(value, (int, float)):
        reason = "a value for each length" if isinstance(value, dict) else "none"
        return [], [f"Coefficient of expansion: the robot file gives {reason} (thermal.cte_um_m_K)."]
    if not value:
        return [], ["Coefficient of expansion: it is 0 in the robot file (thermal.cte_um_m_K)."]
    low, high = sorted((0.6 * value, 1.6 * value))
    key, label = "robot.thermal.cte_um_m_K", "Coefficient of expansion"
    return [
        Slider(
            kind="cte",
            key=key,
            label=label,
            unit="um/(m K)",
            low=round(low, 2),
            high=round(high, 2),
            step=0.05,
            value=float(value),
        )
    ], []
