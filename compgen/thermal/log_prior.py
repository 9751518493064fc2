r"""What a temperature log may honestly show: what the law expects of its readings, and what may differ from it.

The readings y (medians over stretches of the log) and the rises x with which it ends are what the law expects, plus
what may honestly differ from it, and of the readings alone what the sensors add:

    y = mean + (Phi + Psi) a + Omega b + noise,    x = mean_x + (Phi_x + Psi_x) a,    a, b ~ N(0, 1)
    S = (Phi + Psi) (Phi + Psi)^T + Omega Omega^T + R

with a column of Phi for each of

- the work: by its history, a part of the rise that it has caused (``SCALE``); without one, heat between standing and
  full duty, nearly in the proportions that the law has from slow to fast, before the log, all along it and in each
  block of it;
- the air: a robot that was in balance with other air (``NIGHT``, and half of the way from the air of the plan to that
  of the log), air at the arm other than at its sensor (``DRAUGHT``);

of Psi for the law: each node by itself, ``thermal.uncertainty.law_K`` and ``LAW`` of its rise, or its own ``law_K``
where a warm-up told it, in proportion to the warmth; of Omega for the sensors: the offset ``sensors_K`` that all share,
and half of it each; and in R the scatter of the readings, what their last digit hides, and ``MISFIT`` of the law from
stretch to stretch. Sizes without a source are [assumed].
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, interpolated, owns
from compgen.core.units import MINUTE
from compgen.thermal.ambient import Ambient
from compgen.thermal.model import ArmHeat
from compgen.thermal.state_from_log import TemperatureLog, block_responses
from compgen.thermal.uncertainty import ThermalUncertainty

STRETCHES = (6, 20)  # least and most of the log, of which the medians are judged
RECENT = (5 * MINUTE, 10 * MINUTE, 20 * MINUTE)  # before the log's end, where stretches end as well
BLOCKS = 6  # within the log, each with work of its own
WORK = 0.5  # of full duty: how far it may be from nothing known
SCALE = 0.15  # of the rises that the history has caused: breaks that nobody told of, and a law that is off
LAW = 0.1  # of a node's rise
LEFT_OUT = 2.0  # [K] rms by which the network misses a part that was left out of its fit (docs/heat.md)
NIGHT = 3.0  # [K] that a robot may be off the balance with the log's first air
UNMEASURED = 6.0  # [K] the same where the log has no air
DRAUGHT = 1.0  # [K]
MISFIT = 0.15  # [K]
ROUNDING = 12**-0.5  # of the last digit
EACH = 0.5  # of the sensors' offset that each has by itself
PROPORTION = 0.5  # of a housing's heat, by the joints that move
FULL = 20.0  # [K] largest rise of a robot at work, where its model has no feed


@dataclass(frozen=True, eq=False, slots=True)
class Expected:
    """Rises that a history foretells."""

    time: Array  # (T,) [s] on the log's clock
    rise: Array  # (T, K) [K] with the air of the log
    air: float  # [K] by which the log's first air is above that of the plan


@dataclass(frozen=True, eq=False, slots=True)
@owns(which=("N",), time=("N",), value=("N",), sigma=("N",))
class Medians:
    """Medians of n stretches, of all sensors."""

    which: Array  # (n,) number of the sensor
    time: Array  # (n,) [s]
    value: Array  # (n,) [K]
    sigma: Array  # (n,) [K]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(beyond=("N",), spread=("N", "A"), covariance=("N", "N"), mean_at_end=("K",), spread_at_end=("K", "A"))
class LogPrior:
    """Readings of a log beside what may honestly be: n medians, A amounts."""

    medians: Medians
    beyond: Array  # (n,) [K] y - mean
    spread: Array  # (n, A) [K] Phi + Psi
    covariance: Array  # (n, n) [K^2] S
    mean_at_end: Array  # (K,) [K]
    spread_at_end: Array  # (K, A) [K]

    def rises_at_end(self) -> tuple[Array, Array]:
        """The likeliest rises x at the log's end (K,) [K] and their covariance (K, K) [K^2], given its readings."""
        gain = self.gain
        covariance = self.spread_at_end @ self.spread_at_end.T - gain @ self.spread @ self.spread_at_end.T
        return self.mean_at_end + gain @ self.beyond, covariance

    @property
    def gain(self) -> Array:
        """What one kelvin of each reading does to x, (K, n)."""
        return np.asarray(np.linalg.solve(self.covariance, self.spread @ self.spread_at_end.T).T)


def prior_from_log(
    log: TemperatureLog,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    expected: Expected | None = None,
) -> LogPrior:
    """What a log may honestly show.

    Args:
        log: Rises, of one sensor at least.
        heat: The law; its start is not used.
        warmth: How well it is known.
        expected: By the history of the robot; None: it is not known.
    """
    names, K = list(log.readings), len(heat.names)
    medians = medians_of(log)
    n = len(medians.value)
    sensed = np.array([heat.names.index(names[k]) for k in medians.which.astype(int)])
    rows = np.append(sensed, np.arange(K))  # of the readings, then of all rises at the end
    time = np.append(medians.time, np.full(K, log.time[-1])) - log.time[0]
    grid, place = np.unique(time, return_inverse=True)
    level = _level(medians, heat, sensed, log)
    mean, Phi = _law(log, heat, warmth, grid, level, expected)
    known_to = warmth.law if heat.law is not None else max(warmth.law, LEFT_OUT)
    of_class = np.hypot(known_to, LAW * np.abs(heat.reference_rise))
    by_law = np.eye(K)[rows] * warmth.of_nodes(of_class) * level
    spread = np.hstack([Phi[place, rows], by_law, by_law * -np.expm1(-time[:, None] / warmth.lag)])
    sensors = np.hstack([np.full((n, 1), warmth.sensors), EACH * warmth.sensors * np.eye(K)[sensed]])
    covariance = spread[:n] @ spread[:n].T + sensors @ sensors.T + np.diag(medians.sigma**2)
    mean_of_rows = mean[place, rows]
    return LogPrior(
        medians=medians,
        beyond=medians.value - mean_of_rows[:n],
        spread=spread[:n],
        covariance=covariance,
        mean_at_end=mean_of_rows[n:],
        spread_at_end=spread[n:],
    )


def _law(
    log: TemperatureLog,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    grid: Array,
    level: float,
    expected: Expected | None,
) -> tuple[Array, Array]:
    """Expected rises (T, K) [K] and what work and air may add (T, K, P) [K], so long after the log's first row [s]."""
    time, out = log.time - log.time[0], heat.outputs
    decay = np.exp(-grid[:, None] * heat.rate)
    balance = (heat.ambient * decay) @ out.T
    draught = (heat.ambient * (1 - decay)) @ out.T
    if expected is not None:
        rise = interpolated(log.time[0] + grid, expected.time, expected.rise)
        pattern = rise - np.interp(grid, time, log.air)[:, None]
        start = pattern[:1] * np.exp(-grid[:, None] / warmth.lag)
        mean = rise + 0.5 * expected.air * balance
        night = np.hypot(NIGHT * 2 / 3, 0.5 * expected.air)
        parts = [SCALE * pattern, SCALE * start, night * balance, DRAUGHT * draught]
        return mean, np.stack(parts, axis=2)
    air = Ambient(time, log.air)
    initial = heat.ambient * log.air[0] * decay
    mean = (initial + heat.ambient * air.response(heat.rate, 0.0, grid)) @ out.T
    goals = _work(heat, level)
    of_blocks = block_responses(heat.rate, goals, max(time[-1], 1.0), BLOCKS, grid)
    responses = np.einsum("ks,tsbm->tkbm", out, of_blocks)
    mean = mean + responses[:, :, :, 0].sum(axis=2)
    night, draft = (NIGHT, DRAUGHT) if log.has_air else (UNMEASURED, UNMEASURED)
    parts = [night * balance, draft * draught, responses[..., 0].sum(axis=2)]
    return mean, np.concatenate([responses.reshape(*responses.shape[:2], -1), np.stack(parts, axis=2)], axis=2)


def _work(heat: ArmHeat, level: float) -> Array:
    """Steady states of half of full duty, and of what its proportions may differ by at a warmth, (M, S)."""
    if (law := heat.law) is not None:
        slow, fast = law.steady_rise("moving", law.box.feed)
        slow = slow * fast.sum() / slow.sum()
        return np.array([WORK * (slow + fast) / 2, WORK * level * (slow - fast) / 2])
    goals, share = heat.heat_sources()
    goals = goals * share[:, None]
    goals = goals * FULL / float(np.abs(heat.outputs @ goals.sum(axis=0)).max())
    return np.vstack([WORK * goals.sum(axis=0), PROPORTION * WORK * level * goals])


def _level(medians: Medians, heat: ArmHeat, rows: Array, log: TemperatureLog) -> float:
    """How warm the arm is, of the reference: the median of its sensors."""
    air = np.interp(medians.time, log.time, log.air)
    ratio = (medians.value - air) / np.where(heat.reference_rise > 0, heat.reference_rise, 1.0)[rows]
    sensors = [float(np.max(ratio[medians.which == k])) for k in np.unique(medians.which)]
    return float(np.clip(np.median(sensors), 0.5, 1.5))


def rounding_of(readings: Array) -> float:
    """Standard deviation of what the last digit of readings (M,) hides [K]; one that is rounded stands for hours."""
    return ROUNDING * float(np.min(np.diff(np.unique(readings)), initial=1.0))


def _edges(time: Array) -> Array:
    """Ends of the stretches, rising [s]."""
    span = float(np.ptp(time))
    count = int(np.clip(span / MINUTE, *STRETCHES))
    recent = [time[-1] - r for r in RECENT if r < span]
    return np.unique(np.concatenate([np.linspace(time[0], time[-1], count + 1)[1:], recent]))


def medians_of(log: TemperatureLog) -> Medians:
    """Medians of a log's stretches, with what their readings scatter by."""
    rows, edges = [], _edges(log.time)
    for k, values in enumerate(log.readings.values()):
        valid = np.isfinite(values)
        t, v = log.time[valid], values[valid]
        if not len(v):
            continue
        scatter = (
            float(np.median(np.abs(np.diff(v)))) * 1.05 if len(v) > 2 else 0.1
        )  # sqrt(2) * 0.6745, of normal noise
        rounded = rounding_of(v)
        bins = np.searchsorted(edges, t)
        for b in np.unique(bins):
            here = bins == b
            sigma = np.hypot(1.25 * scatter / np.sqrt(here.sum()), np.hypot(MISFIT, rounded))
            rows.append((k, float(np.median(t[here])), float(np.median(v[here])), sigma))
    return Medians(*np.array(rows, dtype=float).T)
