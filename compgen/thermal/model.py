r"""The contract of a thermal model: first-order modes, and how their states become rises along the links.

    dz/dt = rate (goal + ambient u(t) - z)        rise = outputs z

with u the rise of the air and goal the steady state of the present duty. A state z (S,) says all of the robot's
temperature; between changes of duty the goal is constant and the solution exact (``integration``). Two models of an arm
fulfil it, ``node_model`` (the study's) and ``network`` (conduction); ``state_from_log`` starts either from a
thermocouple log. What only one of them knows it says itself, so that nobody asks which of the two it has.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, Protocol, Self

import numpy as np

from compgen.core.arrays import Array, IntArray, cumulated
from compgen.core.units import HOUR, MM
from compgen.thermal.duty import Duty, JointMotion, MeanLosses
from compgen.thermal.node_model import HeatSources, MeasuredBox, NodeModel


def advance(rate: Array, state: Array, goal: Array | float, time: Array | float) -> Array:
    """goal + (z - goal) exp(-rate t): modes that go towards a goal which stands.

    Args:
        rate: (S,) [1/s].
        state: z, (S,) or a row for each time.
        goal: (S,) or a row for each time.
        time: t, (...,) [s].

    Returns:
        (..., S); of one time (S,).
    """
    return np.asarray(goal + (state - goal) * np.exp(-np.asarray(time)[..., None] * rate))


class ThermalModel(Protocol):
    """A thermal model with S modes and K named rises."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the K rises."""

    @property
    def rate(self) -> Array:
        """Of each mode, (S,) [1/s]."""

    @property
    def outputs(self) -> Array:
        """Rises of a state, (K, S)."""

    @property
    def ambient(self) -> Array:
        """State that a robot reaches in air one kelvin above the reference, (S,)."""

    @property
    def reference_rise(self) -> Array:
        """Rises after the reference duty, (K,) [K]: they fix the shapes of profiles."""

    @property
    def start(self) -> Array | None:
        """State that a log ends with, (S,); None: the robot is cold, in balance with the air."""

    @property
    def law(self) -> NodeModel | None:
        """The nodes, where each rise is a mode that follows the feed by a law of its own; None: modes are no rises."""

    def steady_state(self, duty: Duty) -> Array:
        """State that a duty would reach in the end, in air at the reference, (S,)."""

    def steady_states(self, motion: JointMotion) -> Array:
        """State that each segment of a program would reach in the end, (N - 1, S)."""

    def mean_losses(self, motion: Callable[[], JointMotion]) -> MeanLosses:
        """Heat of the drives over a program, whose motion is asked for only where the model needs it."""


class ArmHeat(ThermalModel, Protocol):
    """The thermal model of a robot file, which may begin anywhere and explain a log."""

    @property
    def kind(self) -> Literal["nodes", "network"]:
        """What the robot file calls it."""

    @property
    def box(self) -> MeasuredBox:
        """Where its parameters were measured."""

    def starting(self, state: Array | None) -> Self:
        """The model that begins with a state, (S,); None: cold, in balance with the air."""

    def heat_sources(self, loss: tuple[float, ...] = ()) -> HeatSources:
        """Where heat comes from; ``loss`` of each drive while the robot works [W], default as the drives are rated."""

    def state_gain(self, which: IntArray) -> Array:
        """What one kelvin more at each of some rises, (P,) numbers, does to the likeliest state, (S, P)."""


def state_with_rises(heat: ArmHeat, which: IntArray, rise: Array, state: Array | None = None) -> Array:
    """A state that shows rises.

    Args:
        heat: The model.
        which: Numbers of the rises that are known, (P,).
        rise: (P,) [K].
        state: From which it differs by as little as is likely, (S,); None: cold.

    Returns:
        (S,).
    """
    state = np.zeros(len(heat.rate)) if state is None else state
    return np.asarray(state + heat.state_gain(which) @ (rise - heat.outputs[which] @ state))


def with_losses(heat: ThermalModel, duties: Sequence[Duty], motion: JointMotion) -> list[Duty]:
    """Duties with the losses of a program that ran at their feeds, where the model asks for them.

    Args:
        heat: The model.
        duties: In order.
        motion: The program as it is driven; at another feed its ways take their time in proportion.
    """
    stands = (motion.driven == 0) & (np.diff(motion.theta, axis=0) == 0).all(axis=1)
    step = np.where(stands, 0.0, np.diff(motion.time))  # a program that moves does not wait
    time = cumulated(step) if stands.any() else motion.time
    mean_speed = float(np.average(motion.driven, weights=step)) if step.sum() > 0 else 0.0

    def warmed(duty: Duty) -> Duty:
        if duty.feed <= 0 or mean_speed <= 0:
            return heat.mean_losses(lambda: motion).warming(duty)
        stretch = mean_speed / duty.feed
        paced = JointMotion(time * stretch, motion.theta, motion.driven / stretch)
        return heat.mean_losses(lambda: paced).warming(duty)

    return list(duties) if heat.law is not None else [warmed(duty) for duty in duties]


def extrapolations(
    heat: ArmHeat,
    duties: Sequence[Duty],
    feed: float,
    duration: float,
    rise: Array,
    steps: Mapping[float, str] | None = None,
    until: str = "the program's end",
) -> list[str]:
    """In words, where a job leaves the box in which a model's parameters were measured.

    Args:
        heat: The model.
        duties: Before the program; or of a whole day, of which ``duration`` is then none.
        feed: Of the program [m/s].
        duration: Of the program, as far as it moves [s].
        rise: While it runs, or of the day, (M, K) [K].
        steps: Feeds [m/s] to the keys of steps that move at them; default before.<n>, n the duty's number.
        until: What the hours of motion are counted to.
    """
    messages, box = [], heat.box
    low, high = box.feed
    feeds = {feed: "process"}
    for i, duty in enumerate(duties):
        if duty.state == "moving":
            feeds.setdefault(duty.feed, (steps or {}).get(duty.feed, f"before.{i}"))
    for value, where in feeds.items():
        if not low <= value <= high:
            messages.append(
                f"{where} feed {value / MM:g} mm/s lies outside {low / MM:g} to {high / MM:g} mm/s, "
                "where the thermal parameters were measured"
            )
    moving = sum(d.duration * d.share for d in duties if d.state == "moving") + duration
    if moving > box.time:
        messages.append(
            f"{moving / HOUR:.2f} h of motion by {until} exceed the {box.time / HOUR:g} h "
            "the thermal parameters were measured over"
        )
    peak = max(rise.max(), 0.0)
    if heat.law is not None:  # the network's duties may have no losses
        state = np.zeros(len(heat.rate)) if heat.start is None else heat.start
        for duty in duties:
            state = advance(heat.rate, state, heat.steady_state(duty), duty.duration)
            peak = max(peak, state.max())
    if peak > box.rise:
        messages.append(f"a rise of {peak:.1f} K is above the {box.rise:g} K measured")
    if rise.min(initial=0.0) < -box.rise:
        messages.append(
            f"a rise of {rise.min():.1f} K lies further below zero than the {box.rise:g} K measured above it"
        )
    return messages
