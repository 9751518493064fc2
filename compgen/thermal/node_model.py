r"""First thermal model: each node answers to feed with a first-order lag.

    tau d(rise)/dt = A - rise

    A = 0                                              servo off
    A = A_ref i                                        idle, servo on, i the idle fraction
    A = A_ref (i + (1 - i) s (feed / feed_ref)^p)      moving for the share s of the time

A_ref makes the reference duty (feed_ref for h_ref from cold) end exactly at the measured rise:
A_ref = rise_ref / (1 - exp(-h_ref / tau)). Source: the reference study, sections 5.3 and 4.4, with
its errata. Valid inside the box; outside, ``extrapolations`` says by how much.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.units import HOUR, MM
from compgen.thermal.duty import Duty, JointMotion
from compgen.thermal.integration import initial_state, state_after
from compgen.thermal.profiles import Profile, profile_rise


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
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
    profiles: tuple[Profile, ...] = ()
    start: Array | None = None  # (K,) [K] what a log ends with; None: cold

    def __post_init__(self) -> None:
        own(self, reference_rise=("K",), exponent=("K",), tau=("K",), box_feed=(2,))

    @property
    def rate(self) -> Array:
        """Of each node, (K,) [1/s]."""
        return np.asarray(1 / self.tau)

    @property
    def outputs(self) -> Array:
        """A node's state is its rise, (K, K)."""
        return np.eye(len(self.tau))

    @property
    def ambient(self) -> Array:
        """Every node follows the air with its own lag, (K,)."""
        return np.ones(len(self.tau))

    def steady_rise(self, state: str, feed: Array, share: float = 1.0) -> Array:
        """A, the rise that a duty would reach in the end, (M,) feeds [m/s] to (M, K) [K]."""
        amplitude = self.reference_rise / -np.expm1(-self.reference_time / self.tau)
        if state == "off":
            return np.zeros((len(feed), len(amplitude)))
        feeds = np.unique(np.asarray(feed))  # a power for each speed, not for each segment
        motion = (feeds[:, None] / self.reference_feed) ** self.exponent
        moving = share * motion if state == "moving" else np.zeros_like(motion)
        rises = amplitude * (self.idle + (1 - self.idle) * moving)
        return np.asarray(rises.take(np.searchsorted(feeds, feed), axis=0))

    def steady_state(self, duty: Duty) -> Array:
        """A of a duty, (K,) [K]."""
        return np.asarray(self.steady_rise(duty.state, np.array([duty.feed]), duty.share)[0])

    def steady_states(self, motion: JointMotion) -> Array:
        """A of each segment of a program, (N - 1, K) [K]."""
        return self.steady_rise("moving", motion.driven)

    def rise_after(self, duties: Sequence[Duty], start: Array | None = None) -> Array:
        """Rise after duties in turn in still air, (K,) [K]."""
        return state_after(self, duties, start)

    def rise_along(self, length: str, state: Array, x: Array) -> Array:
        """Rise along a link by its profile, (M,) [m] to (M,) [K]; zero where the link has none."""
        rise = np.zeros(len(x))
        reference = dict(zip(self.names, self.reference_rise.tolist(), strict=True))
        for profile in self.profiles:
            if profile.length == length:
                rise = profile_rise(
                    profile, reference, dict(zip(self.names, np.asarray(state).tolist(), strict=True)), x
                )
        return rise

    def extrapolations(self, duties: Sequence[Duty], feed: float, duration: float, rise: Array) -> list[str]:
        """In words, where a job leaves the box in which the parameters were measured."""
        messages = []
        low, high = self.box_feed
        feeds = [("process", feed), *((f"before.{i}", d.feed) for i, d in enumerate(duties) if d.state == "moving")]
        reported: set[float] = set()
        for where, value in feeds:
            if value in reported:
                continue
            reported.add(value)
            if not low <= value <= high:
                messages.append(
                    f"{where} feed {value / MM:g} mm/s lies outside {low / MM:g} to {high / MM:g} mm/s, "
                    "where the thermal parameters were measured"
                )
        hours = sum(d.duration * d.share for d in duties if d.state == "moving") + duration
        if hours > self.box_time:
            messages.append(
                f"{hours / HOUR:.2f} h of motion by the program's end exceed the {self.box_time / HOUR:g} h "
                "the thermal parameters were measured over"
            )
        peak, state = max(rise.max(), 0.0), initial_state(self)
        for duty in duties:
            state = state_after(self, [duty], state)
            peak = max(peak, state.max())
        if peak > self.box_rise:
            messages.append(f"a rise of {peak:.1f} K is above the {self.box_rise:g} K measured")
        if rise.min(initial=0.0) < -self.box_rise:
            messages.append(
                f"a rise of {rise.min():.1f} K lies further below zero than the {self.box_rise:g} K measured above it"
            )
        return messages


def cold_arm() -> NodeModel:
    """Of an arm whose warmth nobody has measured: one node, which never rises."""
    still, ever = np.zeros(1), np.array([0.0, np.inf])
    return NodeModel(
        names=("arm",),
        reference_rise=still,
        exponent=np.ones(1),
        tau=np.full(1, HOUR),
        idle=0.0,
        reference_feed=1.0,
        reference_time=HOUR,
        box_feed=ever,
        box_time=np.inf,
        box_rise=np.inf,
    )
