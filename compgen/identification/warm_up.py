"""Rises of the arm at each pose: from a log of temperatures, or unknown from the start of a warm-up."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.recorded.table import read_findings
from compgen.core.units import DAY, MINUTE
from compgen.identification.measurements import Measurements
from compgen.thermal.filled_rises import fill_rises
from compgen.thermal.law_fit import falling_part
from compgen.thermal.log_doubt import distance_from_cold, lukewarm, refuse_warm_start
from compgen.thermal.model import ArmHeat
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.temperature_log import COLD_START, Reference, Temperatures, check_sensors, read_temperature_log

SHORTEST = 10 * MINUTE  # of a warm-up: no arm warms in less
LONGEST = 30 * DAY
RISE = 3.0  # [K] that no arm warms within SHORTEST
SWAPPED = 2.0  # times: rises in the opposite proportion to the file's
AIR = 4.0  # [K] that the air of a cell hardly changes by within a log
COLD = 0.5  # [K] below which no pose is one of a warm arm
USED = 2.0  # [K] from which a proportion of rises says something
#: by which the clock of a log may be off, beside the poses' [s]
CLOCK_SHIFTS = np.array([-180, -120, -60, -30, 30, 60, 120, 180]) * MINUTE
SHARE = 0.02  # of a log: poses in another unit that take less of it are there by chance
ENDED = 5.0  # times as long as a log: poses of another unit take longer, where the first is inside
CLOCKS = ((3600.0, "hours"), (60.0, "minutes"), (1e-3, "milliseconds"))


def read_log(source: str, heat: ArmHeat | None, sensors: Mapping[str, str]) -> tuple[Temperatures, ArmHeat]:
    """A log of any of an arm's nodes, and the heat model that it is for.

    Args:
        source: The log (``thermal/temperature_log.py``).
        heat: The robot file's heat model.
        sensors: ``part_<n>`` to the name of a rise.

    Raises:
        InputError: A bad log, or one of an arm without a heat model.
    """
    if heat is None:
        raise InputError(f"{source}: the robot file has no thermal table, so temperatures have no use; leave them out")
    log = read_temperature_log(source, heat.names, sensors)
    check_sensors(log, [f"{name}_degC" for name in (*heat.names, *sensors)])
    return log, heat


def with_temperatures(
    data: Measurements, log: Temperatures, heat: ArmHeat, reference: Reference
) -> tuple[Measurements, list[Finding]]:
    """Rises of all nodes at the poses' times, from a log of any of them.

    Args:
        data: Poses with times.
        log: On the clock of the poses.
        heat: The heat model.
        reference: What rises count from; "start": the log begins with the cold arm.

    Returns:
        The poses with their rises, and what the user must know of the log.

    Raises:
        InputError: A log of another clock or that begins warm, or poses outside it.
    """
    source = log.table.source
    _check_covered(data, log)
    rises = log.rises(reference, COLD_START)
    if reference == "start":
        _check_cold(log, rises)
    _check_clock(log, rises)
    filled = fill_rises(rises, heat, data.time, cold=reference == "start")
    moved = fill_rises(rises, heat, np.add.outer(CLOCK_SHIFTS, data.time).ravel(), cold=reference == "start").rise
    shifted = moved.reshape(len(CLOCK_SHIFTS), *filled.rise.shape)
    warm = (filled.rise.max(axis=1) > COLD) * (data.time - log.time[0])
    modelled = tuple(np.flatnonzero(filled.modelled).tolist())
    findings = [
        *read_findings(log.notes),
        *_lukewarm(log, reference),
        *swapped_sensors(log, rises, heat),
        *_gaps(log, data.time),
        *jumps(log),
    ]
    if filled.loose:
        findings.append(
            Finding(Level.NOTE, Code.LOG_LOOSE, f"{source}: {filled.loose} readings far from neighbours are left out")
        )
    if modelled:
        names = ", ".join(heat.names[k] for k in modelled)
        message = f"{source}: no sensor on {names}: their rises are modelled from the others, in the file's proportions"
        findings.append(Finding.of(Code.LOG_MODELLED, message))
    return replace(data, rise=filled.rise, lag=filled.lag, shifted=shifted, modelled=modelled, warm=warm), findings


def check_warms(parts: Sequence[Measurements], log: Temperatures) -> None:
    """Raises InputError where by a log the arm is cold at all poses of a warm-up."""
    if parts and not any(part.warm.any() for part in parts):
        in_minutes = max(float(part.time.max()) for part in parts) * MINUTE <= log.time[-1]
        mend = "are their times minutes? multiply them by 60" if in_minutes else "give poses of a cold arm by --poses"
        raise InputError(
            f"{parts[0].file()}: column time_s: by the log {log.table.source} the arm is less than {COLD:g} K warm at "
            f"all poses of the warm-up; {mend}"
        )


def as_warm_up(data: Measurements) -> Measurements:
    """The poses as those of a warm-up that begins cold with the first of them.

    Raises:
        InputError: Its times cannot be seconds.
    """
    name, span = data.label[0].split(": line")[0], float(np.ptp(data.time))
    steps = np.diff(np.unique(data.time))
    if len(steps) and (steps == 1).all():
        raise InputError(
            f"{name}: column time_s: rises by 1 from pose to pose, as row numbers do; give the seconds at which each "
            "pose was measured"
        )
    if not SHORTEST <= span <= LONGEST:
        raise InputError(
            f"{name}: column time_s: {span:g} s from first to last pose, where an arm needs {SHORTEST:g} s or more to "
            f"warm{_likely_clock(span)}"
        )
    return replace(data, warm=data.time - data.time.min())


def _likely_clock(span: float) -> str:
    """The unit in which a span is one of a warm-up, as the end of a message."""
    for factor, unit in CLOCKS:
        if SHORTEST <= span * factor <= 2 * DAY:
            return f"; are the times {unit}? multiply them by {factor:g}"
    return "; give the times in seconds"


def _check_covered(data: Measurements, log: Temperatures) -> None:
    """Raises InputError where poses lie outside the log; says which unit would put them inside."""
    low, high = float(log.time[0]), float(log.time[-1])
    outside = np.flatnonzero((data.time < low - 1e-9) | (data.time > high + 1e-9))
    if not len(outside):
        return
    row = data.row_of(int(outside[0]))
    pose, first, last = float(data.time[outside[0]]), float(data.time.min()), float(data.time.max())
    span, taken, mend = last - first, high - low, "both need one clock"
    if low <= first <= high and span < ENDED * taken:
        mend = f"it ends too early, or {mend}"
    else:
        of_poses = [(span * f / taken, "poses'", u, f) for f, u in CLOCKS if low <= first * f and last * f <= high]
        of_log = [(span / taken / f, "log's", u, f) for f, u in CLOCKS if low * f <= first and last <= high * f]
        share, whose, unit, factor = max([*of_poses, *of_log], default=(0.0, "", "", 0.0))
        if share > SHARE:
            mend = f"are the {whose} times {unit}? multiply them by {factor:g}"
    raise InputError(
        f"{data.label[row]}, column time_s: {pose:.10g} is outside the log {log.table.source} ({low:.10g} to "
        f"{high:.10g} s); {mend}"
    )


def _check_clock(log: Temperatures, rises: TemperatureLog) -> None:
    """Raises InputError where the log takes longer than any may, or the arm would warm faster than any does."""
    span = float(np.ptp(log.time))
    if span > LONGEST:
        raise InputError(
            f"{log.table.source}: column time_s: the log takes {span / DAY:.0f} days, {LONGEST / DAY:.0f} at most: are "
            "its times milliseconds? give seconds, or cut it to the days of the poses"
        )
    highest = max(float(np.nanmax(values) - np.nanmin(values)) for values in rises.readings.values())
    if span < SHORTEST and highest > RISE:
        raise InputError(
            f"{log.table.source}: column time_s: a rise of {highest:.1f} K within {span:g} s: no arm warms so fast"
            f"{_likely_clock(span)}"
        )


def _check_cold(log: Temperatures, rises: TemperatureLog) -> None:
    distance, words = distance_from_cold(log, COLD_START)
    if falling := falling_part(rises):
        distance, words = falling[1], f"{log.column[falling[0]]} falls by {falling[1]:.1f} K from there"
    refuse_warm_start(log, distance, words, "--reference ambient, or degC")


def _lukewarm(log: Temperatures, reference: Reference) -> Iterator[Finding]:
    if reference == "start" and (words := lukewarm(log, COLD_START)):
        yield Finding.of(Code.LOG_WARM, f"{words}; --reference says what else they may count from")


def swapped_sensors(log: Temperatures, rises: TemperatureLog, heat: ArmHeat) -> Iterator[Finding]:
    """Pairs of sensors whose rises stand in the opposite proportion to the robot file's; air warmer than the arm."""
    highest = {n: float(np.nanquantile(v, 0.95)) for n, v in rises.readings.items()}
    expected = {n: float(heat.reference_rise[heat.names.index(n)]) for n in highest}
    for a, b in permutations(highest, 2):
        opposite = expected[a] >= SWAPPED * expected[b] and highest[b] >= SWAPPED * highest[a]
        if opposite and highest[b] > USED:
            yield Finding.of(
                Code.LOG_SWAPPED,
                f"{log.table.source}: are {log.column[a]} and {log.column[b]} swapped? they rise by "
                f"{highest[a]:.1f} and {highest[b]:.1f} K, where the robot file expects {expected[a]:g} to "
                f"{expected[b]:g}",
            )
    if log.ambient is None or (air := float(np.nanmax(log.ambient) - np.nanmin(log.ambient))) <= AIR:
        return
    hottest = max(expected.values()) / SWAPPED
    suspects = [a for a in highest if expected[a] >= hottest and air >= SWAPPED * highest[a]]
    if len(suspects) == 1:  # more than one never is: the hall warms, and the arm stands
        (a,) = suspects
        yield Finding.of(
            Code.LOG_SWAPPED,
            f"{log.table.source}: are {log.column[a]} and ambient_degC swapped? they change by {highest[a]:.1f} "
            f"and {air:.1f} K",
        )


def jumps(log: Temperatures) -> Iterator[Finding]:
    """Sensors that go on from one reading to the next at another level than any part warms or cools to."""
    for name, values in log.readings.items():
        seen = np.isfinite(values)
        if seen.sum() < 6:
            continue
        time, value = log.time[seen], values[seen]
        # steps beside the medians of the three readings before and of the three behind each
        level = np.median(np.lib.stride_tricks.sliding_window_view(value, 3), axis=1)
        step, of_level = np.diff(value)[2:-2], level[3:] - level[:-3]
        is_jump = (np.minimum(np.abs(step), np.abs(of_level)) > RISE) & (np.diff(time)[2:-2] <= SHORTEST)
        if is_jump.any():
            n = int(np.argmax(np.where(is_jump, np.abs(of_level), 0.0)))
            yield Finding(
                Level.WARNING,
                Code.LOG_LOOSE,
                f"{log.table.source}: {log.column[name]} jumps by {of_level[n]:+.1f} K at {time[n + 3]:.10g} s, as no "
                "part does: did its contact or its logger change? mend it, or empty its cells on one side"
                + (f" ({int(is_jump.sum())} jumps)" if is_jump.sum() > 1 else ""),
            )


def _gaps(log: Temperatures, time: Array) -> Iterator[Finding]:
    """Sensors without a reading for half an hour or more around poses."""
    for name, values in log.readings.items():
        at = log.time[np.isfinite(values)]
        after = np.searchsorted(at, time).clip(1, len(at) - 1)  # 0 of a single reading
        between = at[after] - at[after - 1]
        between[np.isin(time, at)] = 0.0
        beyond = np.maximum(at[0] - time, time - at[-1])
        lost = int(((between > 30 * MINUTE) & (beyond <= 0) | (beyond > 30 * MINUTE)).sum())
        if lost:
            yield Finding.of(
                Code.LOG_GAP,
                f"{log.table.source}: {log.column[name]} has no reading for 30 min or more around {lost} poses; its "
                "rise is modelled there",
            )
