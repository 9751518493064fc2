"""What the robot does over a stretch of time, as far as its temperature depends on it."""

from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np

from compgen.core.arrays import Array, owns


@dataclass(frozen=True, slots=True)
class Duty:
    """Moving at a feed, idle with the servo on, or off.

    A moving stretch may rest for part of its time: ``share`` is the duty ratio, motion over the whole. The cycle of
    motion and rest is short against every time constant, so that its mean counts (the models are linear).
    """

    state: Literal["moving", "idle", "off"]
    feed: float  # [m/s], 0 unless moving
    duration: float  # [s]
    share: float = 1.0  # of the time in motion, the rest idle
    loss: tuple[float, ...] = ()  # [W] mean heat of each joint's drive, for models that need it


class MeanLosses(NamedTuple):
    """Heat of each joint's drive over a program, six [W] each; empty for models that need none."""

    moving: tuple[float, ...] = ()
    held: tuple[float, ...] = ()  # standing still in its poses

    def warming(self, duty: Duty) -> Duty:
        """A duty of the program with its losses; off there are none."""
        if duty.state == "off" or not self.moving:
            return duty
        share = duty.share if duty.state == "moving" else 0.0
        loss = share * np.array(self.moving) + (1 - share) * np.array(self.held)
        return replace(duty, loss=tuple(loss.tolist()))


@dataclass(frozen=True, eq=False, slots=True)
@owns(time=("N",), theta=("N", 6), driven=("S",))
class JointMotion:
    """The motion of a program at N waypoints: all that its heat depends on."""

    time: Array  # (N,) [s]
    theta: Array  # (N, 6) [rad] DH angles
    driven: Array  # (N - 1,) [m/s] speed really driven on each segment

    @property
    def mean_feed(self) -> float:
        """Over its time [m/s]."""
        step = np.diff(self.time)
        return float(self.driven @ step / step.sum()) if step.sum() > 0 else 0.0

    def between(self, first: int, last: int | None = None) -> "JointMotion":
        """From one waypoint on, to another or to the end; its time begins there."""
        end = len(self.time) - 1 if last is None else last
        rows = slice(first, end + 1)
        return JointMotion(self.time[rows] - self.time[first], self.theta[rows], self.driven[first:end])

    def at_override(self, share: float) -> "JointMotion":
        """The same way at a share of the speed."""
        return JointMotion(self.time / share, self.theta, self.driven * share)
