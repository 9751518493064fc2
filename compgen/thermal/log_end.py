r"""How warm a robot is when its temperature log ends, and what the log leaves open.

A rise that a sensor has just shown is that of the fit (``state_from_log``). What no sensor shows is, of the first
thermal model, the likeliest given all readings (``log_prior``): with x ~ N(m, C) given them, the covariance of what is
taken is

    E[(taken - x) (taken - x)^T] = C + (taken - m) (taken - m)^T

What a sensor may be off before anything contradicts it (``log_doubt``) is no part of that, and told beside it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, owns
from compgen.core.units import MINUTE
from compgen.thermal.duty import JointMotion
from compgen.thermal.log_doubt import hidden_lies
from compgen.thermal.log_prior import LogPrior, prior_from_log
from compgen.thermal.model import ArmHeat
from compgen.thermal.state_from_log import TemperatureLog, fit_log
from compgen.thermal.uncertainty import ThermalUncertainty

LAST = 20 * MINUTE  # before the log's end, within which a sensor must have a reading to tell its rise


@dataclass(frozen=True, eq=False, slots=True)
@owns(state=("S",))
class LogEnd:
    """The robot when its log ends."""

    heat: ArmHeat  # which begins with that state
    warmth: ThermalUncertainty  # with what the log leaves open
    state: Array  # (S,)


def end_of(
    log: TemperatureLog, heat: ArmHeat, warmth: ThermalUncertainty, working: Callable[[], JointMotion] | None = None
) -> LogEnd:
    """How warm a robot is when its log ends.

    Args:
        log: At least two readings.
        heat: The model that goes on from there; its own start is not used.
        warmth: How well it is known.
        working: The program as it runs, whose losses have the proportions of what no sensor sees; None: not known.

    Raises:
        InputError: Too few readings.
    """
    fitted = fit_log(log, heat.starting(None), () if working is None else heat.mean_losses(working).moving)
    state, taken = fitted.state, heat.outputs @ fitted.state
    if not heat.reference_rise.any() or not any(np.isfinite(v).any() for v in log.readings.values()):
        return LogEnd(heat.starting(state), warmth, state)
    prior = prior_from_log(log, heat, warmth)
    likeliest, covariance = prior.rises_at_end()
    if heat.law is not None:
        state = taken = np.where(_shown(log, heat), taken, likeliest)
    covariance = covariance + np.outer(taken - likeliest, taken - likeliest)
    return LogEnd(heat.starting(state), warmth.begun(covariance, hidden_at_end(prior, log, heat)), state)


def hidden_at_end(prior: LogPrior, log: TemperatureLog, heat: ArmHeat) -> Array:
    """By how much one sensor's error shifts the rises at a log's end before anything contradicts it, (L, K) [K]."""
    nodes, size, off = hidden_lies(prior, [heat.names.index(n) for n in log.readings])
    return np.where(_shown(log, heat), size[:, None] * np.eye(len(heat.names))[nodes], off)


def _shown(log: TemperatureLog, heat: ArmHeat) -> BoolArray:
    """Which rises a sensor has just shown, (K,)."""
    late = log.time >= log.time[-1] - LAST
    sensed = {n for n, values in log.readings.items() if np.isfinite(values[late]).any()}
    return np.array([n in sensed for n in heat.names])
