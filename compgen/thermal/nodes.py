r"""First thermal model: each node answers to feed with a first-order lag.

    tau d(rise)/dt = A - rise

    A = 0                                              servo off
    A = A_ref i                                        idle, servo on, i the idle fraction
    A = A_ref (i + (1 - i) (feed / feed_ref)^p)        moving

A_ref makes the reference duty (feed_ref for h_ref from cold) end exactly at the measured rise:
A_ref = rise_ref / (1 - exp(-h_ref / tau)). Between changes of duty the solution is exact, rise(t) = A + (rise_0 - A)
exp(-t / tau), so any number of output times costs the same. Source: the reference study, sections 5.3 and 4.4, with
its errata. Valid inside ``box``; outside, ``strays`` says by how much.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.arrays import Array, own
from compgen.thermal.duty import Duty
from compgen.units import HOUR, MM

LONG = 300.0  # time constants


@dataclass(frozen=True, eq=False, slots=True)
class NodeModel:
    """K nodes."""

    names: tuple[str, ...]
    reference_rise: Array  # (K,) [K] after the reference duty
    exponent: Array  # (K,) p
    tau: Array  # (K,) [s]
    idle: float  # i
    reference_feed: float  # [m/s]
    reference_time: float  # [s]
    box_feed: Array  # (2,) [m/s] where the parameters hold
    box_time: float  # [s]
    box_rise: float  # [K]

    def __post_init__(self) -> None:
        own(self, reference_rise=("K",), exponent=("K",), tau=("K",), box_feed=(2,))

    def steady(self, state: str, feed: Array) -> Array:
        """A, the rise that a duty would reach in the end, (M,) feeds [m/s] to (M, K) [K]."""
        full = self.reference_rise / -np.expm1(-self.reference_time / self.tau)
        if state == "off":
            return np.zeros((len(feed), len(full)))
        moving = (np.asarray(feed)[:, None] / self.reference_feed) ** self.exponent if state == "moving" else 0.0
        return np.asarray(full * (self.idle + (1 - self.idle) * moving) * np.ones((len(feed), 1)))

    def after(self, duties: Sequence[Duty], start: Array | None = None) -> Array:
        """Rise after duties in turn, from cold unless a start (K,) is given, (K,) [K]."""
        rise = np.zeros(len(self.tau)) if start is None else np.asarray(start)
        for duty in duties:
            target = self.steady(duty.state, np.array([duty.feed]))[0]
            rise = target + (rise - target) * np.exp(-duty.duration / self.tau)
        return np.asarray(rise)

    def during(self, start: Array, time: Array, feed: Array) -> Array:
        r"""Rise while a program runs.

        rise_n = exp(-t_n / tau) (rise_0 + sum_k A_k (exp(t_{k+1} / tau) - exp(t_k / tau)))

        Args:
            start: Rise when it starts, (K,) [K].
            time: Waypoint times, (N,) [s], from 0.
            feed: Speed of each segment, (N - 1,) [m/s].

        Returns:
            Rise at each waypoint, (N, K) [K].
        """
        if time[-1] > LONG * self.tau.min():
            return self._step_by_step(start, time, feed)
        x = time[:, None] / self.tau
        gain = self.steady("moving", feed) * np.exp(x[:-1]) * np.expm1(np.diff(x, axis=0))
        heat = np.vstack([np.zeros(len(self.tau)), np.cumsum(gain, axis=0)])
        return np.asarray(np.exp(-x) * (start + heat))

    def _step_by_step(self, start: Array, time: Array, feed: Array) -> Array:
        """The same where a program is so long against a time constant that the sum would overflow."""
        rise, out = np.asarray(start), [start]
        goals = self.steady("moving", feed)
        for goal, keep in zip(goals, np.exp(-np.diff(time)[:, None] / self.tau)):
            rise = goal + (rise - goal) * keep
            out.append(rise)
        return np.array(out)

    def strays(self, duties: Sequence[Duty], feed: float, duration: float, rise: Array) -> list[str]:
        """In words, where a job leaves the box in which the parameters were measured."""
        found = []
        low, high = self.box_feed
        feeds = [("process", feed), *((f"before.{i}", d.feed) for i, d in enumerate(duties) if d.state == "moving")]
        for where, value in feeds:
            if not low <= value <= high:
                found.append(
                    f"{where} feed {value / MM:g} mm/s lies outside {low / MM:g} to {high / MM:g} mm/s, "
                    "where the thermal parameters were measured"
                )
        hours = sum(d.duration for d in duties if d.state == "moving") + duration
        if hours > self.box_time:
            found.append(
                f"{hours / HOUR:.2f} h of motion by the program's end exceed the {self.box_time / HOUR:g} h "
                "the thermal parameters were measured over"
            )
        peak = max(rise.max(), *(self.after(duties[: i + 1]).max() for i in range(len(duties))), 0.0)
        if peak > self.box_rise:
            found.append(f"a rise of {peak:.1f} K is above the {self.box_rise:g} K measured")
        return found
