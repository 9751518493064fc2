r"""The state of a thermal model from a thermocouple log.

Sensors see some rises, with noise and gaps. The log is explained by the heat that would have caused it: sources a_m
(the drives' housings of the network, the goals of the nodes) constant within each of B blocks of time; two of them lie
before the log, one for ever and one of the last hours,

    y(t) = outputs [ sum_b sum_m a_bm phi_bm(t) + air(t) ]

with phi the exact response of the modes. The amplitudes are one least-squares problem: the readings (an outlier counts
less the farther it lies, Huber), their change from block to block, and, for what no sensor sees, the proportions of a
working robot. What it ends with is the state of all modes: the profile through the sensors, smooth as conduction makes
it, from which the nodes or the network go on.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from compgen.core.arrays import Array, BoolArray, owns
from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE
from compgen.thermal.ambient import Ambient
from compgen.thermal.model import ArmHeat, advance

BLOCKS = 24  # within the log
EARLIER = 4 * HOUR  # length of the block just before it
SAMPLES = 2000  # readings of a sensor that are used, means of what lies between
SCATTER = 0.3  # [K] up to which a reading counts in full
LEAST_OF_AIR = 3  # readings that the air a log ends in is taken from, of which one may be wrong,
LAST_AIR = (10 * MINUTE, 30 * MINUTE)  # those of so long at least, and at most
SETTLED = 1e-6  # of a reading's weight: less than a microkelvin of any rise
UNSEEN = 1e-13  # of the normal equations' diagonal
CHANGE_WEIGHT = 0.1  # weight of the change from block to block
PATTERN_WEIGHT = 0.1  # weight of a working robot's proportions


@dataclass(frozen=True, eq=False, slots=True)
@owns(time=("M",), air=("M",))
class TemperatureLog:
    """Readings as rises above the reference; nan where there is none."""

    time: Array  # (M,) [s] rising
    air: Array  # (M,) [K]
    readings: Mapping[str, Array]  # name of a rise to (M,) [K]
    air_read: BoolArray | None = None  # (M,) rows in which the air was measured; None: in all of them
    notes: tuple[str, ...] = ()  # how its file was understood

    @property
    def has_air(self) -> bool:
        """Whether the air was measured."""
        return self.air_read is None or bool(self.air_read.any())

    @property
    def last_air(self) -> float:
        """How warm the air is when the log ends [K]: the median of its last readings, of few in that time the last."""
        read = slice(None) if self.air_read is None or not self.has_air else self.air_read
        time, end = self.time[read], self.time[-1]
        late = self.air[read][time >= np.clip(time[-LEAST_OF_AIR:][0], end - LAST_AIR[1], end - LAST_AIR[0])]
        return float(np.median(late) if len(late) >= LEAST_OF_AIR else self.air[-1])

    def rows(self, some: BoolArray) -> "TemperatureLog":
        """The log of some of its rows."""
        readings = {name: values[some] for name, values in self.readings.items()}
        air_read = None if self.air_read is None else self.air_read[some]
        return replace(self, time=self.time[some], air=self.air[some], readings=readings, air_read=air_read)


@dataclass(frozen=True, eq=False, slots=True)
class LogFit:
    """What explains a log."""

    state: Array  # (S,) of the model at the log's end
    time: Array  # (T,) [s] of the samples used
    rise: Array  # (T, K) [K] all named rises over the log


def fit_log(log: TemperatureLog, heat: ArmHeat, loss: tuple[float, ...] = ()) -> LogFit:
    """The state of a model at the log's end, and its way there.

    Args:
        log: At least two readings.
        heat: The model.
        loss: Of each drive while the robot works [W]: the proportions for what no sensor sees; network only.

    Raises:
        InputError: Too few readings.
    """
    for name in log.readings:
        if name not in heat.names:
            raise InputError(f"log: sensor of '{name}': this thermal model has no such rise; mend thermal.sensors")
    time = log.time - log.time[0]
    if time[-1] <= 0 or not log.readings:
        raise InputError("log: it needs two readings of one sensor at least")
    grid = time if len(time) <= SAMPLES else np.linspace(0.0, time[-1], SAMPLES)
    goals, pattern = heat.heat_sources(loss)
    count = max(1, min(BLOCKS, len(grid) // 8))
    states = block_responses(heat.rate, goals, time[-1], count, grid)  # (T, S, B, m)
    count += 2
    air = Ambient(time, log.air)
    from_air = advance(heat.rate, heat.ambient * log.air[0], 0.0, grid)
    from_air += heat.ambient * air.response(heat.rate, 0.0, grid)  # (T, S)
    rows, values = [], []
    for name, readings in log.readings.items():
        valid = ~np.isnan(readings)
        row = heat.outputs[heat.names.index(name)]
        bins = np.searchsorted((grid[1:] + grid[:-1]) / 2, time[valid])  # the nearest sample
        hits = np.bincount(bins, minlength=len(grid))
        mean = np.bincount(bins, weights=readings[valid], minlength=len(grid))[hits > 0] / hits[hits > 0]
        rows.append(np.einsum("s,tsbm->tbm", row, states[hits > 0]).reshape(len(mean), -1))
        values.append(mean - from_air[hits > 0] @ row)
    A, y = np.vstack(rows), np.concatenate(values)
    penalty = _regularization(count, goals, heat, pattern) * np.sqrt(len(y) / (count * len(pattern)))
    normal, weight = A.T @ A + penalty.T @ penalty, np.ones(len(y))
    normal.flat[:: len(normal) + 1] *= 1 + UNSEEN  # what no reading tells stays at nought
    solution = np.zeros(len(normal))
    for _ in range(20):
        lost = A[weight < 1] * np.sqrt(1 - weight[weight < 1, None] ** 2)
        slope = A.T @ (weight**2 * (y - A @ solution)) - penalty.T @ (penalty @ solution)
        solution += cho_solve(cho_factor(normal - lost.T @ lost), slope)
        before, weight = weight, np.sqrt(np.minimum(1.0, SCATTER / np.maximum(np.abs(y - A @ solution), 1e-9)))
        if np.abs(weight - before).max() < SETTLED:
            break
    trajectory = np.einsum("tsbm,bm->ts", states, solution.reshape(count, len(pattern))) + from_air
    return LogFit(trajectory[-1], log.time[0] + grid, trajectory @ heat.outputs.T)


def block_responses(rate: Array, goals: Array, length: float, count: int, grid: Array) -> Array:
    """What one unit of each source in each block does to the modes, (T, S, B, m).

    Args:
        rate: Of the modes, (S,) [1/s].
        goals: Of the sources, (m, S).
        length: Of the log [s].
        count: Blocks within it; two more are all that was before, and the hours just before it.
        grid: Times from its beginning, (T,) [s].
    """
    edges = np.concatenate([[-np.inf, -EARLIER], np.linspace(0.0, length, count + 1)])
    out = np.empty((len(grid), len(rate), len(edges) - 1, len(goals)))
    for b, (begin, end) in enumerate(zip(edges[:-1], edges[1:], strict=True)):
        since, until = np.maximum(grid - begin, 0.0), np.maximum(grid - end, 0.0)
        share = np.exp(-until[:, None] * rate) - np.exp(-since[:, None] * rate)
        out[:, :, b, :] = share[:, :, None] * goals.T[None]
    return out


def _regularization(count: int, goals: Array, heat: ArmHeat, pattern: Array) -> Array:
    """Rows that ask for little change from block to block and for a working robot's proportions."""
    m = len(pattern)
    size = np.diag(np.abs(heat.outputs @ goals.T).max(axis=0))  # [K] of one unit
    change = np.kron(np.diff(np.eye(count), axis=0), size) * CHANGE_WEIGHT * SCATTER
    change[: 2 * m] *= 0.1  # nothing is known of how the log's beginning came to be
    across = size @ (np.eye(m) - np.outer(pattern, pattern))
    return np.vstack([change, np.kron(np.eye(count), across) * PATTERN_WEIGHT * SCATTER])
