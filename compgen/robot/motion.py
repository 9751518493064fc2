"""How a controller moves through what a program commands: the numbers of ``[motion]`` in a robot file.

The commanded motion is smoothed by up to two moving means and up to two first-order lags, one after the other, in
Cartesian coordinates or in the joints, and then comes late by a lag. Only the numbers are here: the twin and the
correction each have arithmetic of their own for them.

Where no log of the robot tells them, ``[expected_motion]`` says what controllers of its class of arm do. That is
predicted with a lowest and a highest, and nothing is ever commanded against it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

SAME_TIME = 1e-6  # [s]
SAME_OVERRIDE = 0.01  # of 1
SETTLED = 16.0  # time constants after which a first-order lag has come to rest: 0.1 um of a metre


class RunBeginning(StrEnum):
    """How a run from a stop to the next begins, in the words of a robot file: by its first statement."""

    SHORT = "short"  # shorter than the smoothing
    LONG = "long"  # that long or longer


class MotionVerdict(StrEnum):
    """What numbers from a log may be used for, in the words of a robot file."""

    COMMANDABLE = "may be commanded against"
    FORETELLS = "foretells"
    REJECTED = "rejected"


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionEvidence:
    """What the log speaks for that the numbers of a controller's motion come from."""

    override: float  # share of the written speeds it was executed at
    verdict: MotionVerdict
    misfit: float = 0.0  # [m] rms left on stretches that the fit has not seen, of one coordinate square to the path
    runs_began: frozenset[RunBeginning] = frozenset()  # of the log, as far as it shows their bends; none: not known

    @property
    def accepted(self) -> bool:
        """Whether programs may be commanded against the numbers: they are made for 100 % override."""
        return self.verdict is MotionVerdict.COMMANDABLE and abs(self.override - 1) <= SAME_OVERRIDE


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerMotion:
    """What becomes of a commanded motion."""

    space: Literal["cartesian", "joint"] = "cartesian"  # in which it is smoothed
    moving_averages: tuple[float, ...] = ()  # [s] window of each moving mean
    after_long: tuple[float, ...] = ()  # [s] the same in runs whose first statement lasts as long as they do; () alike
    reach: float = 0.0  # [1/m2] share by which means are longer on lines with more ``arm_spread``
    reach_at: float = 0.0  # [m2] spread at which they are ``moving_averages``
    first_orders: tuple[float, ...] = ()  # [s] time constant of each first-order lag
    lag: float = 0.0  # [s] by which all comes late
    enabled: bool = False  # whether programs are pre-distorted for it
    evidence: MotionEvidence | None = None  # None: the numbers were typed in
    unlogged: bool = False  # whether it is of runs that begin as none of the log did

    @property
    def is_smooth(self) -> bool:
        """Whether anything is smoothed: a lag alone changes when, not where."""
        return any((*self.moving_averages, *self.first_orders))

    @property
    def variance(self) -> float:
        """sigma^2 of the pull v^2 sigma^2 / (2 R) on a radius R at speed v [s2]: sum T^2 / 12 of means, T^2 of lags."""
        return sum(t**2 for t in self.moving_averages) / 12 + sum(t**2 for t in self.first_orders)

    @property
    def settling(self) -> float:
        """How long after the command the motion is still under way [s]."""
        return sum(self.moving_averages) + SETTLED * sum(self.first_orders) + self.lag

    @property
    def long(self) -> float:
        """From how long a first statement on a run is long [s]."""
        return sum(self.after_long or (*self.moving_averages, *self.first_orders)) - SAME_TIME

    def in_run(self, first: float) -> "ControllerMotion":
        """What it is from a stop to the next, in a run whose first statement lasts so long [s]."""
        windows = self.after_long if self.after_long and first > self.long else self.moving_averages
        return replace(self, moving_averages=windows, after_long=(), unlogged=self.unlogged or not self.covers([first]))

    def on_line(self, spread: float) -> "ControllerMotion":
        """What it is on a line on which the arm is spread so far [m2]."""
        longer = max(0.0, 1 + self.reach * (spread - self.reach_at))
        return replace(self, moving_averages=tuple(t * longer for t in self.moving_averages), reach=0.0)

    def covers(self, first: Iterable[float]) -> bool:
        """Whether runs whose first statements last so long [s] begin as some of the log did, if there was one.

        Longer than the one pair of means lasts and no longer than the other is either.
        """
        least, most = sorted((sum((*self.moving_averages, *self.first_orders)) - SAME_TIME, self.long))
        begin = {RunBeginning.LONG for time in first if time > least}
        begin |= {RunBeginning.SHORT for time in first if time <= most}
        return self.evidence is None or begin <= self.evidence.runs_began

    def with_other_beginnings(self, seen: "ControllerMotion") -> "ControllerMotion":
        """With means for runs that begin as none of the log did: the logged pair and what those seen differ by.

        That is for telling beforehand; ``covers`` keeps such runs from being commanded. Where the log tells no pair of
        one beginning alone, it stays as it is.

        Args:
            seen: Of the robot's class, in runs of both beginnings.
        """
        began = frozenset() if self.evidence is None else self.evidence.runs_began
        if len(began) != 1 or self.after_long or self.reach or self.space != "cartesian":
            return self
        if not len(self.moving_averages) == len(seen.moving_averages) == len(seen.after_long):
            return self
        more = 1 if RunBeginning.SHORT in began else -1
        pairs = zip(self.moving_averages, seen.moving_averages, seen.after_long, strict=True)
        other = tuple(max(0.0, own + more * (long - short)) for own, short, long in pairs)
        short, long = (self.moving_averages, other) if more > 0 else (other, self.moving_averages)
        return replace(self, moving_averages=short, after_long=long)

    @property
    def may_predistort(self) -> bool:
        """Whether programs are commanded off their targets for it."""
        known = self.evidence is not None and self.evidence.accepted and not self.unlogged
        return self.enabled and self.is_smooth and known and not self.reach


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedMotion:
    """What controllers of a class of arm do, by evidence from other arms than the one that is corrected."""

    expected: ControllerMotion
    lowest: ControllerMotion
    highest: ControllerMotion
    evidence: Literal["simulated", "other arms"]  # the maker's motion code of such an arm; logs and code of others
    source: str


#: where a robot file says nothing: a KAREL log of a real FANUC arm (Pecniks/lidar-robot-demo) has 104 + 104 ms, the
#: maker's motion code of an M-900iA/350 (hehonglu123/Motion-Primitive-Planning) up to 320 + 320 ms
ANY_ARM = ExpectedMotion(
    expected=ControllerMotion(moving_averages=(0.2, 0.2)),
    lowest=ControllerMotion(moving_averages=(0.104, 0.104)),
    highest=ControllerMotion(moving_averages=(0.32, 0.32)),
    evidence="other arms",
    source="a log of a real FANUC arm: 104 + 104 ms; the maker's motion code of an M-900iA/350: up to 320 + 320 ms",
)
