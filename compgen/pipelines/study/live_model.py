r"""What a living page carries: a job's day, its heat, and the places of its two texts; and the page's own formula.

The planned program is what "before" flies; "after" flies the one corrected program, made for the planned state, in
whatever state the sliders stand at. With the day's state z_0 by its stages (``live_day``), tau_n when run n begins and
w what a robot that stands still tends to,

    z = w + (e^{-rate tau_n} z_0 + C_n - w) e^{-rate d}         run n, d late
    d(p) = B(p) (O (e^{-rate t_p} z + a u(T_0 + tau_n + d + t_p)) + F(p)),    e = e0 + d between the places

with C_n what the cycle adds until run n, T_0 how long the day before is, and a u what air does to modes since its first
stretch. ``at`` is that formula; ``report/live/live.js`` computes it in the page, with the same letters.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, rms
from compgen.core.units import HOUR, MINUTE, MM
from compgen.pipelines.study.live_day import NodeLaw, Stage, after_stages, cut
from compgen.pipelines.study.live_places import Places
from compgen.pipelines.study.live_sliders import Day, Slider
from compgen.thermal import Ambient, ThermalModel
from compgen.thermal.modes import advance
from compgen.verification.deviation import percentile99

STARTS = ("delay", "run")  # kinds of sliders that say which start is meant
ONE_START = "compensation.average_over={override_percent=[100]}"  # of a file that serves several: this one alone
Setting = tuple[float, ...]  # a value of each slider, in its unit


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Heat:
    """The modes of a job's heat, and what the cycle adds to them."""

    model: ThermalModel
    law: NodeLaw | None  # of the nodes
    air: Ambient  # as planned
    standing: Array  # (S,) w
    run: Array  # (R,) [s] tau_n, of those that a slider stops at
    cycle: Array  # (R, S) C_n
    cycle_stages: tuple[tuple[Stage, ...], ...]  # (R,) what the cycle does until then


@dataclass(frozen=True, eq=False, slots=True)
class Live:
    """All that the formula needs."""

    day: Day
    heat: Heat
    before: Places
    after: Places
    cte: float  # as planned; 1 where no slider moves it


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class State:
    """The robot as its program starts."""

    z: Array  # (S,)
    elapsed: float  # [s] since the first stretch
    delay: float  # [s] of it standing before the program
    air: Ambient
    stages: tuple[Stage, ...]
    run: int  # of those that the slider stops at


@dataclass(frozen=True, eq=False, slots=True)
class Shown:
    """What the page shows of one text [m]."""

    size: Array  # (M,) of the samples
    rise: Array  # (P, K) [K]
    largest: float
    p99: float
    rms: float


def planned_setting(day: Day) -> Setting:
    """All sliders as planned."""
    return tuple(slider.value for slider in day.sliders)


def state_of(live: Live, setting: Setting) -> State:
    """The state in which the program starts."""
    heat, values = live.heat, dict(zip(live.day.sliders, setting, strict=True))
    moved, air = list(live.day.stages), live.heat.air
    delay, run = 0.0, 0
    for slider, value in values.items():
        if slider.kind == "air":
            air = replace(air, rise=air.rise + (value - slider.value) * np.array(slider.knots))
        elif slider.kind == "delay":
            delay = value * MINUTE
        elif slider.kind == "run":
            run = slider.stops.index(value)
        elif slider.stage >= 0:
            moved[slider.stage] = moved_stage(moved[slider.stage], slider, value)
    rate = heat.model.rate
    begin = np.zeros(len(rate)) if heat.model.start is None else heat.model.start
    stages = cut(moved, live.day.shifts, live.day.clock)
    z = after_stages(heat.law, rate, stages, begin)
    z = advance(rate, z, 0.0, heat.run[run]) + heat.cycle[run]
    z = advance(rate, z, heat.standing, delay)
    elapsed = sum(stage.total for stage in stages) + float(heat.run[run]) + delay
    return State(z=z, elapsed=elapsed, delay=delay, air=air, stages=stages, run=run)


def moved_stage(stage: Stage, slider: Slider, value: float) -> Stage:
    """A stage with one slider at a value."""
    if slider.kind == "duration":
        return replace(stage, duration=value * HOUR)
    if slider.kind == "repeat":
        return replace(stage, count=int(value))
    if slider.kind == "duty":
        return replace(stage, share=value)
    feed = value * MM
    if stage.stops is None or not stage.repeated:
        return replace(stage, feed=feed)
    return replace(stage, feed=feed, duration=float(stage.stops.run_time[slider.stops.index(value)]))


def rises_at(live: Live, state: State, places: Places) -> Array:
    """r at the places of a text, (P, K) [K]."""
    model = live.heat.model
    air = model.ambient * air_since(model, state.air, state.elapsed + places.time)
    z = advance(model.rate, state.z, 0.0, places.time) + air
    return np.asarray(z @ model.outputs.T + places.program)


def air_since(model: ThermalModel, air: Ambient, time: Array) -> Array:
    """u: what air does to the modes from the first stretch on, (M,) [s] to (M, S) [K]."""
    response = air.response(model.rate, 0.0, time)
    if model.start is not None:
        return response
    return response + advance(model.rate, air.settled(model.rate), 0.0, time)


def at(live: Live, setting: Setting, places: Places) -> Shown:
    """The error of one text with the sliders at a setting."""
    rise = rises_at(live, state_of(live, setting), places)
    factor = expansion_factor(live, setting)
    moved = np.einsum("pik,pk->pi", places.slope + factor * places.growth, rise)
    j, x = places.place, places.share[:, None]
    size = np.linalg.norm(places.own + (1 - x) * moved[j] + x * moved[np.minimum(j + 1, len(moved) - 1)], axis=1)
    even = places.length > 0
    weights = places.length[even]
    return Shown(size, rise, float(size.max()), percentile99(size[even], weights), rms(size[even], weights))


def expansion_factor(live: Live, setting: Setting) -> float:
    """cte / cte_0."""
    return next((v / live.cte for s, v in zip(live.day.sliders, setting, strict=True) if s.kind == "cte"), 1.0)


def overrides_of(day: Day, setting: Setting, averaged: bool = False) -> list[str]:
    """What ``--set`` says of a setting: the sliders that are not as planned.

    Args:
        day: Its sliders.
        setting: Where they stand.
        averaged: Whether the path's own file serves several starts: then the one that is meant is said as planned too.
    """
    starts = [slider for slider in day.sliders if slider.kind in STARTS]
    overrides = [ONE_START] if averaged else []
    for slider, value in zip(day.sliders, setting, strict=True):
        if value != slider.value or (averaged and slider in starts):
            text = str(int(value)) if slider.kind in ("repeat", "run") else repr(round(value, 9))
            overrides.append(f"{slider.key}={text}")
    return overrides
