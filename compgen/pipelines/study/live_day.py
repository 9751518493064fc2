"""The day before a program as sliders move it: the steps of its path file, and the history that a setting leaves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import HOUR, MINUTE, MM
from compgen.job.day_before import Programs, plan_history
from compgen.job.job import Cell
from compgen.thermal import Duty, ThermalModel, state_after
from compgen.thermal.ensemble import Start, duties_before, started
from compgen.thermal.schedule import History, Shift, Step

STARTS = ("delay", "run")  # kinds of sliders that say which start is meant
ONE_START = "compensation.average_over={override_percent=[100]}"  # of a file that serves several: this one alone
SliderValues = tuple[float, ...]  # a value of each slider, in its unit


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
class Stops:
    """Feeds that a stage was computed at, where its heat or its time comes from a program that is planned anew."""

    feed: Array  # (F,) [m/s] rising
    run_time: Array  # (F,) [s] of one run
    moving: Array  # (F, S) steady states of endless motion; without columns where a law says them
    held: Array  # (F, S) and of standing


@dataclass(frozen=True, eq=False, slots=True)
class Stage:
    """An entry of [[before]], and what a page needs to move it."""

    step: Step
    run_time: float = 0.0  # [s] of one run as planned, where it repeats
    goal: Array | None = None  # (S,) steady state that no slider moves; None: by law or stops
    stops: Stops | None = None  # None: the law of the nodes says its heat


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Day:
    """The day of a job, and the sliders that move it."""

    stages: tuple[Stage, ...]
    sliders: tuple[Slider, ...]
    missing: tuple[str, ...]  # sentences: which sliders there are not, and why
    shifts: tuple[Shift, ...]  # of every day, for stages that keep to them
    clock: float  # [s] of the day at which the first stage begins
    cell: Cell
    history: History  # as planned, to the first run
    programs: Programs  # that its steps name


@dataclass(frozen=True, eq=False, slots=True)
class Cycle:
    """What the cycle does until each of R runs that a slider stops at."""

    run: Array  # (R,) [s] when it begins, from the first
    duties: tuple[tuple[Duty, ...], ...]  # (R,)

    def modes(self, heat: ThermalModel) -> Array:
        """Modes of a model that begin it at zero, in still air, (R, S)."""
        return np.array([state_after(heat, duties, np.zeros(len(heat.rate))) for duties in self.duties])


def cycle_of(day: Day) -> Cycle:
    """The cycle of a day, until the runs of its slider; until the first where there is none."""
    stops = next((slider.stops for slider in day.sliders if slider.kind == "run"), (1.0,))
    runs, alone = [int(number) - 1 for number in stops], replace(day.history, before=())
    duties = tuple(duties_before(alone, Start(run)) for run in runs)
    return Cycle(np.array(day.history.runs)[runs], duties)


def planned_setting(day: Day) -> SliderValues:
    """All sliders as planned."""
    return tuple(slider.value for slider in day.sliders)


def drawn_settings(sliders: Sequence[Slider], count: int = 20, seed: int = 19) -> tuple[SliderValues, ...]:
    """Settings anywhere in the ranges of the sliders, at their steps; the same for the same sliders."""
    generator = np.random.default_rng(seed)

    def draw(slider: Slider) -> float:
        if slider.stops:
            return slider.stops[int(generator.integers(len(slider.stops)))]
        steps = round((slider.high - slider.low) / slider.step)
        return float(round(slider.low + slider.step * int(generator.integers(steps + 1)), 9))

    return tuple(tuple(draw(slider) for slider in sliders) for _ in range(count))


def overrides_of(day: Day, setting: SliderValues, *, averaged: bool = False) -> list[str]:
    """What ``--set`` says of a setting: the sliders that are not as planned.

    Args:
        day: Its sliders.
        setting: Where they stand.
        averaged: Whether the path's own file serves several starts: then the one that is meant is said as planned too.
    """
    overrides = [ONE_START] if averaged else []
    for slider, value in zip(day.sliders, setting, strict=True):
        if value != slider.value or (averaged and slider.kind in STARTS):
            text = str(int(value)) if slider.kind in ("repeat", "run") else repr(round(value, 9))
            overrides.append(f"{slider.key}={text}")
    return overrides


def history_at(day: Day, setting: SliderValues) -> History:
    """What the cell did until the start that a setting means, with the moved numbers in the steps of its path file."""
    steps, air, start = [stage.step for stage in day.stages], day.history.air, Start()
    planned = list(steps)
    for slider, value in zip(day.sliders, setting, strict=True):
        if slider.kind == "air":
            air = replace(air, rise=air.rise + (value - slider.value) * np.array(slider.knots))
        elif slider.kind == "delay":
            start = replace(start, delay=value * MINUTE)
        elif slider.kind == "run":
            start = replace(start, run=int(value) - 1)
        elif slider.stage >= 0 and value != slider.value:
            steps[slider.stage] = _moved(steps[slider.stage], slider.kind, value)
    before = day.history.before
    if steps != planned:
        before = plan_history(day.programs, air, (steps, (), ()), day.shifts, day.clock, as_given=False).before
    return started(replace(day.history, before=before, air=air), start)


def _moved(step: Step, kind: str, value: float) -> Step:
    """A step with one slider at a value."""
    if kind == "duration":
        return replace(step, duration=value * HOUR)
    if kind == "repeat":
        return replace(step, repeat=int(value))
    return replace(step, share=value) if kind == "duty" else replace(step, feed=value * MM)
