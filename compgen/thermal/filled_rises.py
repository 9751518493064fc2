r"""Rises of all nodes at given times from a temperature log: measured where there is a sensor, else modelled.

The log is explained by the heat that would have caused it (``state_from_log``), which gives every node a course
h(t). A node with a sensor is where its readings are, and follows the course across gaps and beyond its last reading,

    rise(t) = h(t) + interpolation of (reading - h) between readings

so that noise-free readings are kept as they are; a reading far from its neighbours is left out. A node without a sensor
is a first-order state: its course h follows from the others' heat in the robot file's proportions, and is known to a
factor and to its time constant,

    rise(t) = (1 + y) (h(t) + x dh/dlog tau),    y ~ N(0, HEIGHT^2),  x ~ N(0, LAG^2)

to first order in x. Source: the lag of a first-order state, tau dh/dt = A u - h.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter

from compgen.core.arrays import Array, BoolArray, interpolated, owns
from compgen.thermal.model import ArmHeat
from compgen.thermal.state_from_log import TemperatureLog, fit_log

HEIGHT = 0.5  # of the rise of a node without a sensor: how far it is from the file's proportions
LAG = 0.5  # of the logarithm of its time constant
STEP = 0.1  # of that logarithm, for the difference quotient
LOOSE = 3.0  # [K] from the median of five readings: a loose contact


@dataclass(frozen=True, eq=False, slots=True)
@owns(rise=("M", "K"), lag=("M", "K"), modelled=("K",))
class FilledRises:
    """Rises of K nodes at M times."""

    rise: Array  # (M, K) [K]
    lag: Array  # (M, K) [K] dh/dlog tau of nodes without a sensor, else 0
    modelled: BoolArray  # (K,) nodes without a sensor
    loose: int  # readings that were left out

    @property
    def sigma(self) -> Array:
        """Standard deviation of the modelled rises, (M, K) [K]; 0 where there is a sensor."""
        return np.asarray(np.hypot(HEIGHT * self.rise, LAG * self.lag) * self.modelled)


def fill_rises(log: TemperatureLog, heat: ArmHeat, time: Array, *, cold: bool) -> FilledRises:
    """Rises of all nodes of a model at times of a log.

    Args:
        log: Readings of any of the nodes.
        heat: The model; its start is not used.
        time: (M,) [s] on the log's clock.
        cold: Whether the log begins with the cold arm: then no node has a rise there.

    Raises:
        InputError: Too few readings.
    """
    readings = {name: _without_loose_contacts(values) for name, values in log.readings.items()}
    loose = sum(int(np.isnan(readings[n]).sum() - np.isnan(v).sum()) for n, v in log.readings.items())
    log = replace(log, readings=readings)
    modelled = np.array([name not in readings for name in heat.names])
    rise = _course(log, heat, time).copy()
    at_readings = _course(log, heat, log.time)
    for name, values in readings.items():
        k = heat.names.index(name)
        valid = ~np.isnan(values)
        rise[:, k] += np.interp(time, log.time[valid], (values - at_readings[:, k])[valid])
    if cold:
        rise -= modelled * at_readings[0]
    lag = np.zeros_like(rise)
    if (law := heat.law) is not None and modelled.any():
        slower, faster = (
            _course(log, replace(law, tau=law.tau * np.exp(sign * STEP * modelled)), time) for sign in (1, -1)
        )
        lag = (slower - faster) / (2 * STEP) * modelled
    return FilledRises(rise, lag, modelled, loose)


def _course(log: TemperatureLog, heat: ArmHeat, time: Array) -> Array:
    """Rises of all nodes by the model that explains the log, (M, K) [K]."""
    fitted = fit_log(log, heat)
    return interpolated(time, fitted.time, fitted.rise)


def _without_loose_contacts(values: Array) -> Array:
    """Readings with those far from their neighbours left out, (M,)."""
    valid = np.flatnonzero(~np.isnan(values))
    if len(valid) < 5:
        return values
    kept = values.copy()
    kept[valid[np.abs(values[valid] - median_filter(values[valid], size=5, mode="nearest")) > LOOSE]] = np.nan
    return kept
