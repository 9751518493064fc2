r"""How well the warmth is known: what one unit of each cause adds to the rises, and the model that it leaves.

A law that was fitted to a few states misses others, and sensors shift them all. What node k misses builds up as the
rise itself does, with the node's lag, to g_k after the reference duty from cold:

    dx_k/dt = (w g_k / (1 - exp(-h / lag_k)) - x_k) / lag_k,    w = share of motion; idle fraction standing; 0 off

Air that is da warmer than said moves a robot in balance with it by da; a feed that is df faster moves the steady rises.
All of it is linear in the modes but the feed and the time constants, which are taken to first order here and exactly
in ``DisturbedHeat``.
Sizes are standard deviations of the robot file's table ``thermal.uncertainty``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from compgen.core.arrays import Array, covariance_root, owns
from compgen.thermal.duty import Duty, JointMotion, MeanLosses
from compgen.thermal.integration import state_after
from compgen.thermal.model import ArmHeat, ThermalModel, advance
from compgen.thermal.node_model import NodeModel
from compgen.thermal.schedule import History

FORGOTTEN = 20.0  # time constants
STEP = 1e-3  # relative, over which the effects of feed, rises and time constants are differenced

#: lowest and highest that a factor less one may be, anything between as likely
Interval = tuple[float, float]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(lag=("K",))
class ThermalUncertainty:
    """What a robot file says of how well it knows its warmth."""

    law: float  # [K] of a node's rise where the law was not measured
    sensors: float  # [K] common to all nodes
    air: float  # [K]
    feed: float  # of the feed, relative
    missing: float  # kappa: of the thermal error, what the physics of the model leaves out
    lag: Array  # (K,) [s] with which a wrong rise builds up
    reference_time: float  # [s]
    idle: float  # of the build-up while standing with the servo on
    expansion: Interval | None = None  # true over the file's coefficient, less one; None: the sources' priors
    growth: Mapping[str, Interval] = field(default_factory=dict)  # of a length by another profile, less one
    own: Array | None = None  # (K,) [K] in place of ``law``, of nodes fitted to a warm-up; nan: of the others
    is_assumed: bool = False  # the file says nothing
    start: Array | None = None  # (K, K) [K] F, covariance F F^T of the rises that a log ends with; None: no log
    hidden: Array | None = None  # (L, K) [K] by which a sensor may shift those rises and not be contradicted

    def of_nodes(self, others: Array | float) -> Array:
        """How well each node's rise is known by the law, (K,) [K]: its own, else as others are."""
        rest = np.full(len(self.lag), others)
        return rest if self.own is None else np.where(np.isnan(self.own), rest, self.own)

    def begun(self, covariance: Array, hidden: Array) -> "ThermalUncertainty":
        """With what a log leaves open of the rises that it ends with, (K, K) [K^2], and what it hides, (L, K) [K]."""
        return replace(self, start=covariance_root(covariance), hidden=hidden)


@dataclass(frozen=True, eq=False, slots=True)
class Past:
    """How a robot became as warm as its heat begins with: what is not known of its warmth has grown since."""

    heat: ArmHeat  # that it began with
    history: History  # since
    feed: float  # of the program [m/s]
    passed: float = 0.0  # [s] of the program, which have run then

    def then(self, *duties: Duty) -> "Past":
        """With more that it did."""
        return replace(self, history=replace(self.history, before=(*self.history.before, *duties)))


def nothing_warms(heat: ThermalModel) -> ThermalUncertainty:
    """Of an arm that is taken as cold: what its warmth does is not known, and in no band."""
    return ThermalUncertainty(
        law=0.0, sensors=0.0, air=0.0, feed=0.0, missing=0.0, lag=np.ones(len(heat.names)), reference_time=1.0, idle=0.0
    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(rise=("K",), start=("K",), scale=("K",), lag=("K",))
class HeatChange:
    """How warmth differs from what the files say."""

    rise: Array  # (K,) [K] that the law misses after the reference duty
    start: Array  # (K,) [K] that a log's end misses
    scale: Array  # (K,) of the file's rises, relative
    lag: Array  # (K,) change of the logarithm of the file's time constants
    air: float = 0.0  # [K]
    feed: float = 0.0  # relative

    @classmethod
    def none(cls, nodes: int) -> "HeatChange":
        """Everything as the files say."""
        zero = np.zeros(nodes)
        return cls(rise=zero, start=zero, scale=zero, lag=zero)

    @property
    def changes_model(self) -> bool:
        """Whether feed, rises or time constants of the model are others."""
        return bool(self.feed or self.scale.any() or self.lag.any())

    def times(self, factor: float) -> "HeatChange":
        """So many times the change."""
        rise, start, scale, lag = (factor * a for a in (self.rise, self.start, self.scale, self.lag))
        return HeatChange(rise=rise, start=start, scale=scale, lag=lag, air=factor * self.air, feed=factor * self.feed)


@dataclass(frozen=True, eq=False, slots=True)
class DisturbedHeat:
    """A thermal model with a change: K more modes, and another feed; fulfils ``ThermalModel``."""

    base: ThermalModel
    uncertainty: ThermalUncertainty
    change: HeatChange

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the K rises."""
        return self.base.names

    @property
    def changed(self) -> ThermalModel:
        """The model with its own numbers changed; the network's stay."""
        nodes, change = self.base.law, self.change
        if nodes is None:
            return self.base
        rise, tau = nodes.reference_rise * (1 + change.scale), nodes.tau * np.exp(change.lag)
        return replace(nodes, reference_rise=rise, tau=tau)

    @property
    def rate(self) -> Array:
        """Of the model's modes and of what is missed, (S + K,) [1/s]."""
        return np.concatenate([self.changed.rate, 1 / self.uncertainty.lag])

    @property
    def outputs(self) -> Array:
        """Rises of a state, (K, S + K)."""
        return np.hstack([self.base.outputs, np.eye(len(self.names))])

    @property
    def ambient(self) -> Array:
        """State in air one kelvin above the reference, (S + K,)."""
        return np.append(self.base.ambient, np.zeros(len(self.names)))

    @property
    def reference_rise(self) -> Array:
        """Rises that fix the shapes of profiles, (K,) [K]: the file's."""
        return self.base.reference_rise

    @property
    def start(self) -> Array | None:
        """State that a log ends with, (S + K,)."""
        return None if self.base.start is None else np.append(self.base.start, self.change.start)

    @property
    def law(self) -> NodeModel | None:
        """None: what is missed are modes beside the rises."""
        return None

    def steady_state(self, duty: Duty) -> Array:
        """State that a duty would reach in the end, (S + K,)."""
        at_feed = replace(duty, feed=duty.feed * (1 + self.change.feed))
        return np.append(self.changed.steady_state(at_feed), share_of(duty, self.uncertainty) * self._goal)

    def steady_states(self, motion: JointMotion) -> Array:
        """State that each segment of a program would reach in the end, (N - 1, S + K)."""
        states = self.changed.steady_states(replace(motion, driven=motion.driven * (1 + self.change.feed)))
        return np.hstack([states, np.broadcast_to(self._goal, (len(states), len(self.names)))])

    def mean_losses(self, motion: Callable[[], JointMotion]) -> MeanLosses:
        """Heat of the drives over a program."""
        return self.base.mean_losses(motion)

    @property
    def _goal(self) -> Array:
        return steady_miss(self.uncertainty, self.change.rise)


def steady_miss(uncertainty: ThermalUncertainty, rise: Array) -> Array:
    """What endless motion would come to, where the reference duty misses a rise, (..., K) [K]."""
    return np.asarray(rise / -np.expm1(-uncertainty.reference_time / uncertainty.lag))


def share_of(duty: Duty, uncertainty: ThermalUncertainty) -> float:
    """Of the build-up in motion."""
    if duty.state == "off":
        return 0.0
    return uncertainty.idle + (1 - uncertainty.idle) * (duty.share if duty.state == "moving" else 0.0)


def missed_rise(
    uncertainty: ThermalUncertainty, heat: ThermalModel, history: History, change: HeatChange, time: Array
) -> Array:
    """What the law and the log's end miss while the program runs, (M,) [s] to (M, K) [K]."""
    goal, rate = steady_miss(uncertainty, change.rise), 1 / uncertainty.lag
    x = change.start if heat.start is not None else np.zeros(len(goal))
    for duty in history.before:
        x = advance(rate, x, goal * share_of(duty, uncertainty), duty.duration)
    return advance(rate, x, goal, time)


def rise_by_air(heat: ThermalModel, history: History, time: Array) -> Array:
    """What air adds that is one kelvin warmer all day and before, (M,) [s] to (M, K) [K]."""
    if heat.start is None:  # in balance with it from the beginning
        states = np.broadcast_to(heat.ambient, (len(time), len(heat.rate)))
    else:
        states = heat.ambient * -np.expm1(-(history.clock + time)[:, None] * heat.rate)
    return np.asarray(states @ heat.outputs.T)


def rise_by_model(
    uncertainty: ThermalUncertainty, heat: ThermalModel, history: History, feed: float, change: HeatChange, time: Array
) -> Array:
    """What another feed, other rises and other time constants add, to first order, (M,) [s] to (M, K) [K].

    Zero for the network, whose losses are summed over a program's joints and not given by a feed.
    """
    if heat.law is None:
        return np.zeros((len(time), len(heat.names)))
    size = max(abs(change.feed), np.abs(change.scale).max(), np.abs(change.lag).max())
    factor = STEP / size
    of_model = replace(change, rise=0 * change.rise, start=0 * change.start)

    def rises(sign: float) -> Array:
        other = DisturbedHeat(heat, uncertainty, of_model.times(sign * factor))
        state = state_after(other, history.before, air=history.air)
        goal = other.steady_state(Duty("moving", feed, 0.0))
        of_air = other.ambient * history.air.response(other.rate, history.clock, history.clock + time)
        return np.asarray((advance(other.rate, state, goal, time) + of_air) @ other.outputs.T)

    return np.asarray((rises(1.0) - rises(-1.0)) / (2 * factor))


def added_rise(uncertainty: ThermalUncertainty, past: Past, change: HeatChange, time: Array) -> Array:
    """All that a change adds, so long after what is past, (M,) [s] to (M, K) [K]."""
    heat, history = past.heat, past.history
    rise = missed_rise(uncertainty, heat, history, change, time)
    if change.air:
        rise = rise + change.air * rise_by_air(heat, history, time)
    if change.changes_model:
        rise = rise + rise_by_model(uncertainty, heat, history, past.feed, change, time)
    return rise


def carried(uncertainty: ThermalUncertainty, past: Past, heat: ArmHeat, change: HeatChange) -> HeatChange:
    """A change for a flight that begins with the program, so that when ``past`` ends it has added what the past has."""
    missing = replace(change, start=0 * change.start)
    own = added_rise(uncertainty, Past(heat, History(), past.feed), missing, np.array([past.passed]))
    left = added_rise(uncertainty, past, change, np.zeros(1)) - own
    return replace(change, start=grown_back(left[0], past.passed / uncertainty.lag))


def grown_back(change: Array, passed: Array) -> Array:
    """What a change of each mode was so many of its time constants ago, (S,); none of one that has died away."""
    remembered = passed < FORGOTTEN
    return np.where(remembered, change * np.exp(np.where(remembered, passed, 0.0)), 0.0)
