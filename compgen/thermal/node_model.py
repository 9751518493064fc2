r"""First thermal model: each node answers to feed with a first-order lag.

    tau d(rise)/dt = A - rise

    A = 0                                              servo off
    A = A_ref i                                        idle, servo on, i the idle fraction
    A = A_ref (i + (1 - i) s (feed / feed_ref)^p)      moving for the share s of the time

A_ref makes the reference duty (feed_ref for h_ref from cold) end exactly at the measured rise:
A_ref = rise_ref / (1 - exp(-h_ref / tau)). Source: the reference study, sections 5.3 and 4.4, with
its errata. Valid inside the box.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, Self

import numpy as np

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.units import HOUR
from compgen.thermal.duty import Duty, JointMotion, MeanLosses


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(feed=(2,))
class MeasuredBox:
    """Where the parameters of a model were measured."""

    feed: Array  # (2,) [m/s] least and most
    time: float  # [s] longest in motion
    rise: float  # [K] largest


class HeatSources(NamedTuple):
    """M places where heat may come from."""

    goal: Array  # (M, S) steady state of one unit of each
    share: Array  # (M,) of a working robot, of length one


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(reference_rise=("K",), exponent=("K",), tau=("K",))
class NodeModel:
    """K nodes; fulfil ``ArmHeat``."""

    names: tuple[str, ...]
    reference_rise: Array  # (K,) [K] after the reference duty
    exponent: Array  # (K,) p
    tau: Array  # (K,) [s]
    idle: float  # i
    reference_feed: float  # [m/s]
    reference_time: float  # [s]
    box: MeasuredBox
    start: Array | None = None  # (K,) [K] what a log ends with; None: cold

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
        rises = (np.asarray(feed)[:, None] / self.reference_feed) ** self.exponent
        rises *= share if state == "moving" else 0.0
        rises *= 1 - self.idle  # in place, for a program is long
        rises += self.idle
        rises *= amplitude
        return np.asarray(rises)

    def steady_state(self, duty: Duty) -> Array:
        """A of a duty, (K,) [K]."""
        return np.asarray(self.steady_rise(duty.state, np.array([duty.feed]), duty.share)[0])

    def steady_states(self, motion: JointMotion) -> Array:
        """A of each segment of a program, (N - 1, K) [K]."""
        return self.steady_rise("moving", motion.driven)

    @property
    def kind(self) -> Literal["nodes"]:
        """What a robot file calls them."""
        return "nodes"

    @property
    def law(self) -> "NodeModel | None":
        """These nodes."""
        return self

    def starting(self, state: Array | None) -> Self:
        """The nodes that begin with rises, (K,) [K]; None: cold."""
        return replace(self, start=state)

    def mean_losses(self, motion: Callable[[], JointMotion]) -> MeanLosses:
        """None: the feed says the heat."""
        return MeanLosses()

    def heat_sources(self, loss: tuple[float, ...] = ()) -> HeatSources:
        """Each node by itself, in the proportions of the reference."""
        return HeatSources(np.eye(len(self.tau)), self.reference_rise / np.linalg.norm(self.reference_rise))

    def state_gain(self, which: IntArray) -> Array:
        """A state is its rises, (K, P)."""
        return np.eye(len(self.tau))[:, which]


def cold_arm() -> NodeModel:
    """Of an arm whose warmth nobody has measured: one node, which never rises."""
    never, ever = np.zeros(1), np.array([0.0, np.inf])
    return NodeModel(
        names=("arm",),
        reference_rise=never,
        exponent=np.ones(1),
        tau=np.full(1, HOUR),
        idle=0.0,
        reference_feed=1.0,
        reference_time=HOUR,
        box=MeasuredBox(feed=ever, time=np.inf, rise=np.inf),
    )
