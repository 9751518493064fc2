r"""Whether the readings of a temperature log contradict each other, the heat model, or what the robot has done.

What is honest has the covariance S of ``log_prior``. A lie is a known course h of unknown size d: a sensor that is off
from some moment on, or runs away from it, or all of them; or one that shows another part, whose course is that of its
law. By generalised least squares (Aitken 1935)

    d = h^T S^-1 y / h^T S^-1 h,    z = d / sqrt(1 / h^T S^-1 h + FLOOR^2)

and from |z| = ``SIGMAS`` on the log is not believed. Which other reading of the columns would be believed (two of them
exchanged, degrees Fahrenheit, another clock) is only told. A smaller lie is not seen: some 4 K of one sensor on a warm
arm, and of all together what a cold night does. Sizes without a source are [assumed].
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR, MINUTE
from compgen.thermal.log_prior import Expected, LogPrior, Medians, prior_from_log
from compgen.thermal.model import ArmHeat
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.temperature_log import Reference, Temperatures
from compgen.thermal.uncertainty import ThermalUncertainty

SIGMAS = 3.3
HALL = 20.0  # [K] from the reference that the air of a hall is within
FLOOR = 0.4  # [K] of any lie: below what the band covers, a law is never known so well
LONGEST = 30 * DAY  # that a log may take
WARM = 3.0  # [K] from the air, or of the sensors from each other, at which a log does not begin cold
LUKEWARM = 1.5  # [K] at which that is said


@dataclass(frozen=True, eq=False, slots=True)
class _Lie:
    """The likeliest lie of a log."""

    z: float
    size: float  # [K]
    sensor: int  # -1: all
    at: float  # [s] of the reading that shows it


def doubt_of(
    log: TemperatureLog,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    columns: Mapping[str, str],
    zero: float,
    expected: Expected | None = None,
    counted: Callable[[TemperatureLog], TemperatureLog] = lambda rises: rises,
) -> str:
    """What contradicts a log, in words; empty where it may be true.

    Args:
        log: Rises.
        heat: The law; its start is not used.
        warmth: How well it is known.
        columns: Name of a rise to its column.
        zero: What the rises count from [degC], for the words.
        expected: By the history of the robot; None: it is not known.
        counted: Rises as they are used, of those that count from ``zero``.
    """
    span = float(np.ptp(log.time))
    if span > LONGEST:
        days = f"column time_s: the log takes {span / DAY:.0f} days, {LONGEST / DAY:.0f} at most"
        return f"{days}; are its times milliseconds? give seconds"
    if not heat.reference_rise.any() or not any(np.isfinite(v).any() for v in log.readings.values()):
        return ""
    if impossible := _impossible(log, columns, zero):
        return impossible
    lie = _likeliest(counted(log), heat, warmth, expected)
    if abs(lie.z) < SIGMAS:
        return ""
    other = next(
        (
            f"; or {words}"
            for changed, words in _other_readings(log, columns, zero, expected)
            if abs(_likeliest(counted(changed), heat, warmth, expected).z) < SIGMAS
            and _colder_than_any_hall(changed) is None
        ),
        "; or cgen identify --temperatures",
    )
    by = "the others and the heat model" if expected is None else "the others and the robot's work"
    return _lie_words(lie, log, columns, zero, by) + other


def _lie_words(lie: _Lie, log: TemperatureLog, columns: Mapping[str, str], zero: float, by: str) -> str:
    """Which sensor lies, when and by how much, by what else it is seen, and what to mend."""
    if lie.sensor < 0:
        what, reads, allows = "all sensors", f"read {lie.size:+.1f} K", "0"
        mend = "mend the log" if log.has_air else "is the hall so warm? give its air as column ambient_degC"
    else:
        name = list(log.readings)[lie.sensor]
        value = zero + _value_at(log, name, lie.at)
        what, reads, allows = f"column {columns[name]}", f"reads {value:.1f} degC", f"{value - lie.size:.1f}"
        mend = "mend the sensor, or empty its cells"
    return (
        f"{what}: {reads} {lie.at - log.time[0]:.0f} s after the first row, {abs(lie.z):.0f} sigma off: {by} "
        f"allow {allows} +- {abs(lie.size / lie.z):.1f}; {mend}"
    )


def _impossible(log: TemperatureLog, columns: Mapping[str, str], zero: float) -> str:
    """What no log of an arm in a hall holds, in words; empty where there is nothing of it."""
    if log.has_air and abs(odd := float(np.median(log.air))) > HALL:
        words = f"column ambient_degC: {zero + odd:.1f} degC is more than {HALL:g} K from the reference, {zero:g}"
        hint = "degrees Fahrenheit? " if abs((zero + odd - 32) / 1.8 - zero) < HALL else ""
        return f"{words}; {hint}mend the sensor or its unit, remove the column, or count from that of its hall"
    if (cold := _colder_than_any_hall(log)) is not None:
        words = f"column {columns[cold]}: reads below {zero - HALL:g} degC, {HALL:g} K under the reference: no part is"
        return f"{words}; mend the sensor or its unit, or empty its cells"
    return ""


def _colder_than_any_hall(log: TemperatureLog) -> str | None:
    """The first rise of which a quarter of the readings is colder than the air of any hall; work only warms."""
    readings = ((name, rise[np.isfinite(rise)]) for name, rise in log.readings.items())
    return next((name for name, rise in readings if len(rise) and np.quantile(rise, 0.25) < -HALL), None)


def _likeliest(
    log: TemperatureLog,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    expected: Expected | None,
) -> _Lie:
    """The lie with the largest z; of sensors that are not believed the one that explains most, d^2 h^T S^-1 h.

    By z a warm sensor could be named for the one that fell off.
    """
    prior = prior_from_log(log, heat, warmth, expected)
    medians, y = prior.medians, prior.beyond
    if len(log.readings) == 1 and expected is None:  # nothing contradicts how it changes: only how warm it may be is
        z = y / np.sqrt(np.diag(prior.covariance))
        k = int(np.argmax(np.abs(z)))
        return _Lie(float(z[k]), float(y[k]), 0, float(medians.time[k]))
    sensors, H, last = _with_other_parts(prior, *_courses(medians, len(log.readings)))
    weight, deviation = _weighed(prior, H)
    size = weight.T @ y
    z = size / np.hypot(FLOOR, deviation)
    n = int(np.argmax(np.abs(z)))
    if sensors[n] >= 0 and abs(z[n]) >= SIGMAS:
        doubtful = (sensors >= 0) & (np.abs(z) >= SIGMAS)
        n = int(np.argmax(np.where(doubtful, np.abs(size) / deviation, 0.0)))
    return _Lie(float(z[n]), float(size[n]), int(sensors[n]), float(last[n]))


def _weighed(prior: LogPrior, H: Array) -> tuple[Array, Array]:
    """Of lies of courses H (n, C): weights (n, C) whose product with y is d, what d is off by, no floor (C,) [K]."""
    weight = np.linalg.solve(prior.covariance, H)
    power = np.sum(H * weight, axis=0)
    return weight / power, power**-0.5


def hidden_lies(prior: LogPrior, nodes: Sequence[int]) -> tuple[IntArray, Array, Array]:
    """The largest lies of one sensor that are believed ("external reliability", Baarda 1968).

    Args:
        prior: Of a log.
        nodes: Of each of its sensors.

    Returns:
        Node of the sensor that lies (L,), by how much at the log's end (L,) [K], and by how much the likeliest rises
        at the end are off (L, K) [K].
    """
    sensors, H, _ = _courses(prior.medians, len(nodes))
    of_one = sensors >= 0
    sensors, H = sensors[of_one], H[:, of_one]
    if len(nodes) == 1:
        size = np.full(len(sensors), SIGMAS * np.sqrt(np.diag(prior.covariance).max()))
    else:
        size = SIGMAS * np.hypot(FLOOR, _weighed(prior, H)[1])
    return np.array(nodes)[sensors], size, (prior.gain @ (H * size)).T


def _courses(medians: Medians, sensors: int) -> tuple[Array, Array, Array]:
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


def _with_other_parts(prior: LogPrior, sensors: Array, H: Array, last: Array) -> tuple[Array, Array, Array]:
    """Lies as ``_courses`` has them, and those of sensors that show another part: more of what the law may miss."""
    by_law = prior.spread[:, -2 * len(prior.mean_at_end) :]
    by_law = by_law[:, by_law.any(axis=0)]
    end = len(by_law) - 1 - np.argmax(by_law[::-1] != 0, axis=0)
    H = np.hstack([H, by_law / by_law[end, np.arange(len(end))]])
    return np.append(sensors, prior.medians.which[end]), H, np.append(last, prior.medians.time[end])


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
    clocks = ((MINUTE, "minutes"), (HOUR, "hours"), (1e-3, "milliseconds"))
    for factor, unit in clocks if log.time[0] < LONGEST else ():  # dates have no other unit
        yield replace(log, time=log.time * factor), f"are its times {unit}? give seconds"


def distance_from_cold(log: Temperatures, window: float) -> tuple[float, str]:
    """How far readings of a log's beginning [s] are from those of a cold arm [K], and in words."""
    early = log.time <= log.time[0] + window
    first = {n: float(np.nanmedian(v[early])) for n, v in log.readings.items() if np.isfinite(v[early]).any()}
    if not first:
        return 0.0, ""
    highest, lowest = max(first, key=lambda n: first[n]), min(first, key=lambda n: first[n])
    if log.ambient is not None and np.isfinite(log.ambient[early]).any():
        air = float(np.nanmedian(log.ambient[early]))
        name = max(first, key=lambda n: abs(first[n] - air))
        return abs(first[name] - air), f"{log.column[name]} = {first[name]:g}, the air {air:g}"
    words = f"{log.column[highest]} = {first[highest]:g}, {log.column[lowest]} = {first[lowest]:g}"
    return first[highest] - first[lowest], words


def lukewarm(log: Temperatures, window: float) -> str:
    """That a log may not begin cold, by its beginning [s], and rises count from there; empty where it may."""
    distance, words = distance_from_cold(log, window)
    if distance <= LUKEWARM:
        return ""
    return f"{log.table.source}: the log may not begin cold ({words}): rises count from its first readings"


def refuse_warm_start(log: Temperatures, distance: float, words: str, other: str) -> None:
    """Raises InputError for a log that begins so far from cold [K], where rises count from its beginning.

    Args:
        log: Readings.
        distance: As of ``distance_from_cold``.
        words: Which readings show it.
        other: What else rises may count from, as the user writes it.
    """
    if distance > WARM:
        raise InputError(
            f"{log.table.source}: line {log.table.line[0]}: the log does not begin cold ({words}), and rises count "
            f"from there; begin with the cold arm, or say what they count from: {other}"
        )


def refuse_doubtful(
    log: Temperatures,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    reference: Reference,
    window: float,
    zero: float,
) -> None:
    """Raises InputError for a log that contradicts itself or the heat model.

    Args:
        log: Readings as they stand in the file.
        heat: The law.
        warmth: How well it is known.
        reference: What the rises that are used count from; those count that are judged, from the air in the mean.
        window: How much of the log's beginning "start" takes the median of [s].
        zero: About which temperature [degC] the air of its hall lies.
    """
    zero = reference if isinstance(reference, float) else zero

    def counted(rises: TemperatureLog) -> TemperatureLog:
        read = replace(log, time=rises.time, ambient=rises.air if rises.has_air else None, readings=rises.readings)
        of_air = float(np.median(rises.air)) if reference == "ambient" else 0.0
        return read.rises("start" if reference == "start" else of_air, window)

    doubt = doubt_of(log.rises(zero, 0.0), heat, warmth, log.column, zero, counted=counted)
    if doubt:
        raise InputError(f"{log.table.source}: {doubt}")
