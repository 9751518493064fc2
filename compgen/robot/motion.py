"""How a controller moves through what a program commands: the numbers of ``[motion]`` in a robot file.

The commanded motion is smoothed by up to two moving means and up to two first-order lags, one after the other, in
Cartesian coordinates or in the joints, and then comes late by a lag. Only the numbers are here: the twin and the
correction each have arithmetic of their own for them.
"""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionEvidence:
    """Where the numbers of a controller's motion come from."""

    robot: str  # name of the robot whose log it was
    log_sha256: str  # of the executed log
    program: str  # that was executed
    override: float  # share of the written speeds it was executed at
    held_out: float | None  # [m] largest deviation left on stretches that the fit has not seen
    accepted: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerMotion:
    """What becomes of a commanded motion."""

    space: Literal["cartesian", "joint"] = "cartesian"  # in which it is smoothed
    moving_averages: tuple[float, ...] = ()  # [s] window of each moving mean
    first_orders: tuple[float, ...] = ()  # [s] time constant of each first-order lag
    lag: float = 0.0  # [s] by which all comes late
    enabled: bool = False  # whether programs are pre-distorted for it
    evidence: MotionEvidence | None = None  # None: the numbers were typed in

    @property
    def is_smooth(self) -> bool:
        """Whether anything is smoothed: a lag alone changes when, not where."""
        return any((*self.moving_averages, *self.first_orders))

    @property
    def may_predistort(self) -> bool:
        """Whether programs are commanded off their targets for it."""
        return self.enabled and self.is_smooth and self.evidence is not None and self.evidence.accepted
