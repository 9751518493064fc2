r"""The day before a program as stages that sliders move: what each does to the modes of a heat model, in closed form.

A stage repeats n times a stretch of motion of length T, which heats towards m, and a rest of length D towards h:

    z -> e^{-rate (T + D)} z + c        once,     c = (m (1 - e^{-rate T}) - h) e^{-rate D} + h
    z -> q^n z + c (1 - q^n) / (1 - q)  n times,  q = e^{-rate (T + D)}

With f the feed and s the share of the time in motion, the nodes' goals are their own law, and the network's lie between
moving and held, which are known at the feeds of a table (each is a program planned anew):

    m = A (i + (1 - i) s (f / f_ref)^p)        h = A i            (nodes)
    m = s M(f) + (1 - s) H(f)                  h = H(f)           (network)

Servo off, goals are zero. ``report/live/live.js`` has the same formulas with the same letters.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from compgen.core.arrays import Array
from compgen.thermal import Duty, NodeModel
from compgen.thermal.schedule import Shift, cut_at_shifts


@dataclass(frozen=True, eq=False, slots=True)
class Stops:
    """Feeds that a stage was computed at, where its heat or its time comes from a program that is planned anew."""

    feed: Array  # (F,) [m/s] rising
    run_time: Array  # (F,) [s] of one run
    moving: Array  # (F, S) M; without columns for the nodes
    held: Array  # (F, S) H


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Stage:
    """An entry of [[before]], or a part of one."""

    state: Literal["moving", "idle", "off"]
    duration: float  # [s] T; of repeats one run
    feed: float = 0.0  # [m/s]
    share: float = 1.0
    count: int = 1  # n
    dwell: float = 0.0  # [s] D
    rest: Literal["moving", "idle", "off"] = "idle"  # during the dwell
    repeated: bool = False  # runs of a program, whose time the feed decides
    stops: Stops | None = None  # None: the law of the nodes says its heat
    goal: Array | None = None  # (S,) of a stage whose heat no slider moves; None: by law or stops
    keeps_to_shifts: bool = False  # moves in the working hours only: idle in their breaks, off between them

    @property
    def total(self) -> float:
        """How long it takes in all [s]."""
        return self.count * (self.duration + self.dwell)


@dataclass(frozen=True, eq=False, slots=True)
class NodeLaw:
    """The law of S nodes."""

    rate: Array  # (S,) [1/s]
    amplitude: Array  # (S,) [K] A
    exponent: Array  # (S,) p
    idle: float  # i
    reference_feed: float  # [m/s] f_ref

    @classmethod
    def of(cls, heat: NodeModel) -> "NodeLaw":
        """Of the robot file's nodes."""
        amplitude = heat.reference_rise / -np.expm1(-heat.reference_time / heat.tau)
        return cls(1 / heat.tau, amplitude, heat.exponent, heat.idle, heat.reference_feed)

    def moving(self, feed: float, share: float) -> Array:
        """m, (S,)."""
        motion = (feed / self.reference_feed) ** self.exponent
        return np.asarray(self.amplitude * (self.idle + (1 - self.idle) * share * motion))

    def held(self) -> Array:
        """h, (S,)."""
        return self.amplitude * self.idle

    def changed(self, feed: float, scale: Array, lag: Array, reference_time: float) -> "NodeLaw":
        """With relative changes of the feed and of the rises, and changes of the logarithms of the time constants."""
        old, new = self.rate, self.rate * np.exp(-lag)
        steady = np.expm1(-reference_time * old) / np.expm1(-reference_time * new)
        return replace(
            self,
            rate=new,
            amplitude=self.amplitude * (1 + scale) * steady,
            reference_feed=self.reference_feed / (1 + feed),
        )


@dataclass(frozen=True, eq=False, slots=True)
class BuildUp:
    """How what a law misses builds up: towards one while in motion."""

    rate: Array  # (K,) [1/s]
    idle: float

    def moving(self, feed: float, share: float) -> Array:
        """m, (K,)."""
        return np.full(len(self.rate), self.idle + (1 - self.idle) * share)

    def held(self) -> Array:
        """h, (K,)."""
        return np.full(len(self.rate), self.idle)


def after_stages(law: NodeLaw | BuildUp | None, rate: Array, stages: Sequence[Stage], state: Array) -> Array:
    """State after the stages in still air, (S,).

    Args:
        law: Of the goals; None: every stage that heats has stops or a goal of its own.
        rate: Of the modes, (S,) [1/s].
        stages: In order.
        state: Where they begin, (S,).
    """
    z = np.array(state, dtype=float)
    for stage in stages:
        m, h = goals_of(law, stage, len(rate))
        one = (m * -np.expm1(-rate * stage.duration) - h) * np.exp(-rate * stage.dwell) + h
        q = rate * (stage.duration + stage.dwell)
        # q^n without a power, and its sum without a difference where nothing decays
        sum_of_powers = np.where(q > 0, np.expm1(-stage.count * q) / np.where(q > 0, np.expm1(-q), 1.0), stage.count)
        z = z * np.exp(-stage.count * q) + one * sum_of_powers
    return z


def cut(stages: Sequence[Stage], shifts: Sequence[Shift], clock: float) -> tuple[Stage, ...]:
    """Stages with those that keep to the shifts cut at their edges; ``clock`` is when they begin, [s] of the day."""
    pieces: list[Stage] = []
    for stage in stages:
        now, parts = clock, [Duty(stage.state, stage.feed, stage.duration * stage.count)]
        if not stage.keeps_to_shifts:
            parts = []
            pieces.append(stage)
        elif stage.dwell:
            parts = [Duty(stage.state, stage.feed, stage.duration), Duty(stage.rest, 0.0, stage.dwell)] * stage.count
        for part in parts:
            pieces += [_piece(stage, duty) for duty in cut_at_shifts(part, shifts, now)]
            now += part.duration
        clock += stage.total
    return tuple(pieces)


def _piece(stage: Stage, duty: Duty) -> Stage:
    """What a stage does in one stretch of its time."""
    return replace(stage, state=duty.state, duration=duty.duration, count=1, dwell=0.0, keeps_to_shifts=False)


def goals_of(law: NodeLaw | BuildUp | None, stage: Stage, modes: int) -> tuple[Array, Array]:
    """m and h of a stage, (S,) each."""
    zero = np.zeros(modes)
    if law is None:
        if stage.goal is not None:
            return stage.goal, zero
        if stage.stops is None:
            return zero, zero
        k = int(np.argmin(np.abs(stage.stops.feed - stage.feed)))
        moving, held = stage.stops.moving[k], stage.stops.held[k]
        m = stage.share * moving + (1 - stage.share) * held
    else:
        m, held = law.moving(stage.feed, stage.share), law.held()
    first = {"moving": m, "idle": held, "off": zero}[stage.state]
    return first, held if stage.rest == "idle" else zero


def fixed_stages(duties: Sequence[Duty], goal: "dict[Duty, Array] | None" = None) -> list[Stage]:
    """Stretches as stages that no slider moves; ``goal`` of each for a model that is no law."""
    return [
        Stage(state=d.state, duration=d.duration, feed=d.feed, share=d.share, goal=None if goal is None else goal[d])
        for d in duties
    ]
