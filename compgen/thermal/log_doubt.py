r"""Whether the readings of a temperature log contradict each other, the heat model, or what the robot has done.

The readings y (medians over stretches of the log) are what the law expects, plus what may honestly differ from it:

    y = mean + Phi a + noise,    a ~ N(0, 1),    S = Phi Phi^T + R

with a column of Phi for each of

- the work: by its history, a part of the rise that it has caused (``SCALE``); without one, heat between standing and
  full duty, nearly in the proportions that the law has from slow to fast, before the log, all along it and in each
  block of it;
- the air: a robot that was in balance with other air (``NIGHT``, and half of the way from the air of the plan to that
  of the log), air at the arm other than at its sensor (``DRAUGHT``);
- the law: each node by itself, ``thermal.uncertainty.law_K`` and ``LAW`` of its rise, in proportion to the warmth;
- the sensors: the offset ``sensors_K`` that all share, and half of it each;

and in R the scatter of the readings, what their last digit hides, and ``MISFIT`` of the law from stretch to stretch. A
lie is a known course h of unknown size d: a sensor that is off from some moment on, or runs away from it, or all of
them. By generalised least squares (Aitken 1935)

    d = h^T S^-1 y / h^T S^-1 h,    z = d / sqrt(1 / h^T S^-1 h + FLOOR^2)

and from |z| = ``SIGMAS`` on the log is not believed. Which other reading of the columns would be believed (two of them
exchanged, degrees Fahrenheit, another clock) is only told. A smaller lie is not seen: some 4 K of one sensor on a warm
arm, and of all together what a cold night does. Sizes without a source are [assumed].
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from compgen.core.arrays import Array, own
from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR, MINUTE
from compgen.thermal.ambient import Ambient
from compgen.thermal.log_fit import EARLIER, TemperatureLog, block_responses, heat_sources
from compgen.thermal.network import NetworkModel
from compgen.thermal.node_model import NodeModel
from compgen.thermal.temperature_log import Temperatures
from compgen.thermal.uncertainty import ThermalUncertainty

SIGMAS = 3.3
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
HALL = 20.0  # [K] from the reference that the air of a hall is within
MISFIT = 0.15  # [K]
ROUNDING = 12**-0.5  # of the last digit
FLOOR = 0.4  # [K] of any lie: below what the band covers, a law is never known so well
EACH = 0.5  # of the sensors' offset that each has by itself
LONGEST = 30 * DAY  # that a log may take
PROPORTION = 0.5  # of a housing's heat, by the joints that move
FULL = 20.0  # [K] largest rise of a robot at work, where its model has no feed


@dataclass(frozen=True, eq=False, slots=True)
class Expected:
    """Rises that a history foretells."""

    time: Array  # (T,) [s] on the log's clock
    rise: Array  # (T, K) [K] with the air of the log
    air: float  # [K] by which the log's first air is above that of the plan


@dataclass(frozen=True, eq=False, slots=True)
class _Medians:
    """Medians of n stretches, of all sensors."""

    which: Array  # (n,) number of the sensor
    time: Array  # (n,) [s]
    value: Array  # (n,) [K]
    sigma: Array  # (n,) [K]

    def __post_init__(self) -> None:
        own(self, which=("N",), time=("N",), value=("N",), sigma=("N",))


@dataclass(frozen=True, eq=False, slots=True)
class _Lie:
    """The likeliest lie of a log."""

    z: float
    size: float  # [K]
    sensor: int  # -1: all
    at: float  # [s] of the reading that shows it


def doubt_of(
    log: TemperatureLog,
    heat: NodeModel | NetworkModel,
    warmth: ThermalUncertainty,
    columns: Mapping[str, str],
    zero: float,
    has_air: bool,
    expected: Expected | None = None,
) -> str:
    """What contradicts a log, in words; empty where it may be true.

    Args:
        log: Rises.
        heat: The law; its start is not used.
        warmth: How well it is known.
        columns: Name of a rise to its column.
        zero: What the rises count from [degC], for the words.
        has_air: Whether the air was measured.
        expected: By the history of the robot; None: it is not known.
    """
    span = float(np.ptp(log.time))
    if span > LONGEST:
        days = f"column time_s: the log takes {span / DAY:.0f} days, {LONGEST / DAY:.0f} at most"
        return f"{days}; are its times milliseconds? give seconds"
    if not heat.reference_rise.any() or not any(np.isfinite(v).any() for v in log.readings.values()):
        return ""
    if has_air and abs(odd := float(np.median(log.air))) > HALL:
        words = f"column ambient_degC: {zero + odd:.1f} degC is more than {HALL:g} K from the reference, {zero:g}"
        return f"{words}; degrees Fahrenheit? mend the sensor, or remove the column"
    lie = _likeliest(log, heat, warmth, has_air, expected)
    if abs(lie.z) < SIGMAS:
        return ""
    names = list(log.readings)
    other = next(
        (
            words
            for changed, words in _other_readings(log, columns, zero, expected)
            if abs(_likeliest(changed, heat, warmth, has_air, expected).z) < SIGMAS
        ),
        "",
    )
    what = "all sensors" if lie.sensor < 0 else f"column {columns[names[lie.sensor]]}"
    k = max(lie.sensor, 0)
    value = zero + _value_at(log, names[k], lie.at)
    reads = f"reads {value:.1f} degC" if lie.sensor >= 0 else f"read {lie.size:+.1f} K"
    by = "the other sensors and the heat model" if expected is None else "the other sensors and what the robot has done"
    allows = f"{value - lie.size:.1f}" if lie.sensor >= 0 else "0"
    spread = abs(lie.size / lie.z)
    return (
        f"{what}: {reads} at {lie.at:.0f} s, where {by} allow {allows} +- {spread:.1f} ({abs(lie.z):.0f} sigma); "
        f"{other or 'mend the sensor, or empty its cells'}"
    )


def _likeliest(
    log: TemperatureLog,
    heat: NodeModel | NetworkModel,
    warmth: ThermalUncertainty,
    has_air: bool,
    expected: Expected | None,
) -> _Lie:
    """The lie with the largest z."""
    names = list(log.readings)
    edges = _edges(log.time)
    medians = _medians(log, edges)
    rows = np.array([heat.names.index(names[k]) for k in medians.which.astype(int)])
    time = medians.time - log.time[0]
    grid, place = np.unique(time, return_inverse=True)
    level = _level(medians, heat, rows, log)
    mean, Phi = _law(log, heat, warmth, grid, level, has_air, expected)
    each = EACH * warmth.sensors * np.eye(len(heat.names))
    known_to = warmth.law if isinstance(heat, NodeModel) else max(warmth.law, LEFT_OUT)
    own_law = np.hypot(known_to, LAW * np.abs(heat.reference_rise)) * level
    lag = warmth.lag
    n = len(medians.value)
    columns = [Phi[place, rows, :], np.full((n, 1), warmth.sensors), each[rows]]
    columns.append(np.eye(len(heat.names))[rows] * own_law)
    columns.append(np.eye(len(heat.names))[rows] * own_law * (-np.expm1(-time[:, None] / lag)))
    all_columns = np.hstack(columns)
    S = all_columns @ all_columns.T + np.diag(medians.sigma**2)
    y = medians.value - mean[place, rows]
    if len(names) == 1 and expected is None:  # nothing contradicts how it changes: only how warm it may be is judged
        z = y / np.sqrt(np.diag(S))
        k = int(np.argmax(np.abs(z)))
        return _Lie(float(z[k]), float(y[k]), 0, float(medians.time[k]))
    sensors, H, last = _courses(medians, len(names))
    weight = np.linalg.solve(S, H)
    power = np.sum(H * weight, axis=0)
    size = weight.T @ y / power
    z = size / np.hypot(FLOOR, power**-0.5)
    n = int(np.argmax(np.abs(z)))
    return _Lie(float(z[n]), float(size[n]), int(sensors[n]), float(last[n]))


def _courses(medians: _Medians, sensors: int) -> tuple[Array, Array, Array]:
    """Of C lies that are looked for: sensor (-1: all) (C,), course (n, C) that ends at 1, and when it ends [s] (C,)."""
    which, courses, last = [], [], []
    for sensor in range(-1, sensors):
        here = (medians.which == sensor) | (sensor < 0)
        times = np.unique(medians.time[here])
        for begin in times:
            jump = here * (medians.time >= begin)
            drift = here * np.maximum(medians.time - begin, 0.0) / max(times[-1] - begin, 1.0)
            for h in (jump, drift)[: 1 + (begin < times[-1])]:
                which.append(sensor)
                courses.append(h)
                last.append(times[-1])
    return np.array(which), np.array(courses, dtype=float).T, np.array(last)


def _law(
    log: TemperatureLog,
    heat: NodeModel | NetworkModel,
    warmth: ThermalUncertainty,
    grid: Array,
    level: float,
    has_air: bool,
    expected: Expected | None,
) -> tuple[Array, Array]:
    """Expected rises (T, K) [K] and what work and air may add (T, K, P) [K], so long after the log's first row [s]."""
    time, out = log.time - log.time[0], heat.outputs
    decay = np.exp(-grid[:, None] * heat.rate)
    balance = (heat.ambient * decay) @ out.T
    draught = (heat.ambient * (1 - decay)) @ out.T
    if expected is not None:
        rise = np.column_stack([np.interp(log.time[0] + grid, expected.time, c) for c in expected.rise.T])
        pattern = rise - np.interp(grid, time, log.air)[:, None]
        start = pattern[:1] * np.exp(-grid[:, None] / warmth.lag)
        mean = rise + 0.5 * expected.air * balance
        night = np.hypot(NIGHT * 2 / 3, 0.5 * expected.air)
        parts = [SCALE * pattern, SCALE * start, night * balance, DRAUGHT * draught]
        return mean, np.stack(parts, axis=2)
    air = Ambient(time, log.air)
    initial = heat.ambient * log.air[0] * decay
    mean = (initial + heat.ambient * air.response(heat.rate, 0.0, grid)) @ out.T
    edges = np.concatenate([[-np.inf, -EARLIER], np.linspace(0.0, max(time[-1], 1.0), BLOCKS + 1)])
    goals = _work(heat, level)
    responses = np.einsum("ks,tsbm->tkbm", out, block_responses(heat.rate, goals, edges, grid))
    mean = mean + responses[:, :, :, 0].sum(axis=2)
    night, draft = (NIGHT, DRAUGHT) if has_air else (UNMEASURED, UNMEASURED)
    parts = [night * balance, draft * draught, responses[..., 0].sum(axis=2)]
    return mean, np.concatenate([responses.reshape(*responses.shape[:2], -1), np.stack(parts, axis=2)], axis=2)


def _work(heat: NodeModel | NetworkModel, level: float) -> Array:
    """Steady states of half of full duty, and of what its proportions may differ by at a warmth, (M, S)."""
    if isinstance(heat, NodeModel):
        slow, fast = heat.steady_rise("moving", heat.box_feed)
        slow = slow * fast.sum() / slow.sum()
        return np.array([WORK * (slow + fast) / 2, WORK * level * (slow - fast) / 2])
    goals, pattern = heat_sources(heat, ())
    goals = goals * pattern[:, None]
    goals = goals * FULL / float(np.abs(heat.outputs @ goals.sum(axis=0)).max())
    return np.vstack([WORK * goals.sum(axis=0), PROPORTION * WORK * level * goals])


def _level(medians: _Medians, heat: NodeModel | NetworkModel, rows: Array, log: TemperatureLog) -> float:
    """How warm the arm is, of the reference: the median of its sensors."""
    air = np.interp(medians.time, log.time, log.air)
    ratio = (medians.value - air) / np.where(heat.reference_rise > 0, heat.reference_rise, 1.0)[rows]
    sensors = [float(np.max(ratio[medians.which == k])) for k in np.unique(medians.which)]
    return float(np.clip(np.median(sensors), 0.5, 1.5))


def _edges(time: Array) -> Array:
    """Ends of the stretches, rising [s]."""
    span = float(np.ptp(time))
    count = int(np.clip(span / MINUTE, *STRETCHES))
    recent = [time[-1] - r for r in RECENT if r < span]
    return np.unique(np.concatenate([np.linspace(time[0], time[-1], count + 1)[1:], recent]))


def _medians(log: TemperatureLog, edges: Array) -> _Medians:
    rows = []
    for k, values in enumerate(log.readings.values()):
        valid = np.isfinite(values)
        t, v = log.time[valid], values[valid]
        if not len(v):
            continue
        scatter = (
            float(np.median(np.abs(np.diff(v)))) * 1.05 if len(v) > 2 else 0.1
        )  # sqrt(2) * 0.6745, of normal noise
        digit = float(np.min(np.diff(np.unique(v)), initial=1.0))  # one that is rounded stands for hours
        bins = np.searchsorted(edges, t)
        for b in np.unique(bins):
            here = bins == b
            sigma = np.hypot(1.25 * scatter / np.sqrt(here.sum()), np.hypot(MISFIT, ROUNDING * digit))
            rows.append((k, float(np.median(t[here])), float(np.median(v[here])), sigma))
    return _Medians(*np.array(rows, dtype=float).T)


def _value_at(log: TemperatureLog, name: str, time: float) -> float:
    values = log.readings[name]
    valid = np.flatnonzero(np.isfinite(values))
    return float(values[valid[np.argmin(np.abs(log.time[valid] - time))]])


def _other_readings(
    log: TemperatureLog, columns: Mapping[str, str], zero: float, expected: Expected | None
) -> Iterator[tuple[TemperatureLog, str]]:
    """The log as it may have been meant, and in words."""
    celsius = {n: (v + zero - 32) / 1.8 - zero for n, v in log.readings.items()}
    air = (log.air + zero - 32) / 1.8 - zero
    for same in (air, log.air):
        yield replace(log, readings=celsius, air=same), "are its numbers degrees Fahrenheit? give degC"
    for a, b in combinations(log.readings, 2):
        swapped = {**log.readings, a: log.readings[b], b: log.readings[a]}
        yield replace(log, readings=swapped), f"are {columns[a]} and {columns[b]} swapped?"
    if expected is not None:
        moved = log.time - log.time[0] + expected.time[0]
        yield replace(log, time=moved), "does its clock begin elsewhere? give --planned on it"
        return
    for factor, unit in ((MINUTE, "minutes"), (HOUR, "hours"), (1e-3, "milliseconds")):
        yield replace(log, time=log.time * factor), f"are its times {unit}? give seconds"


def refuse_doubtful(
    log: Temperatures,
    heat: NodeModel | NetworkModel,
    warmth: ThermalUncertainty,
    zero: float,
) -> None:
    """Raises InputError for a log that contradicts itself or the heat model.

    Args:
        log: Readings as they stand in the file.
        heat: The law.
        warmth: How well it is known.
        zero: Temperature from which the robot's rises count [degC].
    """
    doubt = doubt_of(log.rises(zero, 0.0), heat, warmth, log.column, zero, log.ambient is not None)
    if doubt:
        raise InputError(f"{log.table.source}: {doubt}")
