"""A cell's day from the tables of a path file: its steps and shifts, its air, and its temperature log, in SI."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR, MINUTE, MM
from compgen.thermal import Ambient, still_air
from compgen.thermal.log_doubt import WARM, distance_from_cold, lukewarm, refuse_doubtful, refuse_warm_start
from compgen.thermal.model import ArmHeat
from compgen.thermal.schedule import History, Shift, Step, check_shifts
from compgen.thermal.state_from_log import TemperatureLog
from compgen.thermal.tables import schema as sh
from compgen.thermal.temperature_log import Temperatures, check_sensors, read_temperature_log
from compgen.thermal.uncertainty import ThermalUncertainty

ONE_ZERO = 0.5  # [K] by which what a log and the air of a day count from may differ, where no sensor says it


def steps_of(rows: Sequence[sh.StepTable], name: str, where: str, own_feed: float) -> tuple[Step, ...]:
    """Entries of [[before]], [[cycle]] or [[after]].

    Raises:
        InputError: Keys that miss or contradict each other.
    """
    steps = []
    for i, row in enumerate(rows):
        key = f"{where}: {name}.{i}"
        moving = row.state == "moving"
        if moving and row.feed_mm_s is None and row.program is None and name == "before":
            raise InputError(f"{key}.feed_mm_s: missing; state 'moving' needs it, or a program that has one")
        for optional in ("program", "repeat", "dwell_s", "dwell", "duty", "shifts"):
            if not moving and getattr(row, optional) not in (None, False):
                raise InputError(f"{key}.{optional}: state '{row.state}' has none; set state = 'moving' or remove it")
        if (row.duration_h is None) == (row.repeat is None):
            reason = "missing" if row.repeat is None else "conflicts with repeat"
            raise InputError(f"{key}.duration_h: {reason}; give a duration_h" + (" or a repeat, one of them" * moving))
        if row.repeat is None and (row.dwell_s is not None or row.dwell is not None):
            dwell = "dwell_s" if row.dwell is None else "dwell"
            raise InputError(f"{key}.{dwell}: only a repeat has a dwell; give repeat instead of duration_h, or a duty")
        steps.append(
            Step(
                key=key,
                state=row.state,
                feed=_feed(row, own_feed),
                program=row.program or "",
                duration=None if row.duration_h is None else row.duration_h * HOUR,
                repeat=row.repeat,
                dwell=row.dwell_s or 0.0,
                rest=row.dwell or "idle",
                share=1.0 if row.duty is None else row.duty,
                shifts=row.shifts,
            )
        )
    return tuple(steps)


def _feed(row: sh.StepTable, own_feed: float) -> float:
    """The row's; else the job's own, or 0 where another program's file says it."""
    if row.state != "moving":
        return 0.0
    if row.feed_mm_s is not None:
        return row.feed_mm_s * MM
    return 0.0 if row.program else own_feed


def shifts_of(rows: Sequence[sh.ShiftTable], stretches: Sequence[sh.StepTable], where: str) -> tuple[Shift, ...]:
    """The shifts of a day.

    Raises:
        InputError: They overlap, or no stretch says whether it keeps to them.
    """
    for i, row in enumerate(rows):
        if not row.from_h < row.to_h <= row.from_h + 24:
            raise InputError(
                f"{where}: shift.{i}.to_h: {row.to_h:g} must be above from_h = {row.from_h:g}, and at most 24 h later; "
                "a night shift from 22 ends at 30"
            )
    shifts = tuple(
        Shift(r.from_h * HOUR, r.to_h * HOUR, tuple((a * HOUR, b * HOUR) for a, b in r.breaks_h)) for r in rows
    )
    check_shifts(shifts, where)
    if rows and stretches and not any("shifts" in stretch.model_fields_set for stretch in stretches):
        raise InputError(f"{where}: shift: no stretch keeps to its hours; say shifts = true where the program moves")
    return shifts


def ambient_of(table: sh.AmbientTable, where: str) -> Ambient:
    """The air over time, from the first [[before]] on.

    Raises:
        InputError: Keys that miss or do not belong to its kind, or a bad CSV file.
    """
    needs = {
        "constant": (),
        "ramp": ("from_degC", "to_degC", "over_h"),
        "wave": ("amplitude_K",),
        "csv": ("file",),
    }
    may = {"constant": ("value_degC",), "ramp": (), "wave": ("value_degC", "period_h", "peak_h"), "csv": ()}
    kind, zero = table.kind, table.reference_degC
    for key in needs[kind]:
        if getattr(table, key) is None:
            raise InputError(f"{where}: ambient.{key}: missing; kind = '{kind}' needs it")
    for key in ("value_degC", "from_degC", "to_degC", "over_h", "amplitude_K", "period_h", "peak_h", "file"):
        if getattr(table, key) is not None and key not in needs[kind] + may[kind]:
            raise InputError(f"{where}: ambient.{key}: kind = '{kind}' has none; remove it or change ambient.kind")
    level = (table.value_degC if table.value_degC is not None else zero) - zero
    if kind == "ramp":
        ends = np.array([table.from_degC, table.to_degC], dtype=float) - zero
        return Ambient(np.array([0.0, (table.over_h or 0.0) * HOUR]), ends)
    if kind == "wave":
        peak = (table.peak_h if table.peak_h is not None else 15.0) - table.clock_h
        return Ambient(
            np.zeros(1), np.array([level]), table.amplitude_K or 0.0, (table.period_h or 24.0) * HOUR, peak * HOUR
        )
    if kind == "csv":
        source = Path(where).parent / str(table.file)
        log = read_temperature_log(source, (), {}, air=True)
        if log.ambient is None:
            raise InputError(f"{source}: it has no column ambient_degC; add it")
        begins = 0.0
        if log.table.recorded is not None and "time_s" not in log.table.recorded.columns:  # since its first midnight
            begins = log.time[0] // DAY * DAY + table.clock_h * HOUR
        read = np.isfinite(log.ambient)
        return Ambient(log.time[read] - begins, log.ambient[read] - zero)
    return still_air(level)


def notes_of_air(table: sh.AmbientTable, where: str) -> tuple[str, ...]:
    """How the file of the air was understood; nothing where there is none."""
    if table.file is None:
        return ()
    return read_temperature_log(Path(where).parent / table.file, (), {}, air=True).notes


def held_air(table: sh.AmbientTable, air: Ambient, history: History) -> tuple[str, ...]:
    """Notes that a CSV of the air does not reach over the day, and what is taken there.

    Raises:
        InputError: It is of another day.
    """
    if table.kind != "csv":
        return ()
    lasts = sum(duty.duration for part in (history.before, history.cycle, history.after) for duty in part)
    (first, last), (low, high) = air.time[[0, -1]], air.rise[[0, -1]] + table.reference_degC
    if last < 0 or first > lasts + DAY:  # which no program by itself takes
        raise InputError(
            f"{table.file}: its times, {first / HOUR:.3g} to {last / HOUR:.3g} h from the first [[before]] on, are "
            f"none of the day's {lasts / HOUR:.3g} h; write time_s from there, or clock times, and ambient.clock_h"
        )
    notes = []
    if first > MINUTE:
        begins = f"it begins {first / HOUR:.3g} h into the day"
        notes.append(f"{table.file}: {begins}: {low:.4g} degC until then")
    if last < lasts - MINUTE:
        ends = f"it ends at {last / HOUR:.3g} of {lasts / HOUR:.3g} h"
        notes.append(f"{table.file}: {ends}: {high:.4g} degC from then on")
    return tuple(notes)


def log_of(
    table: sh.LogTable,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    sensors: Mapping[str, str],
    ambient: sh.AmbientTable,
    where: str,
) -> TemperatureLog:
    """A thermocouple log as rises.

    Args:
        table: Its file, beside the path file, and what its rises count from.
        heat: The model, with the names of its rises.
        warmth: How well it is known.
        sensors: part_<n> to the name of a rise.
        ambient: With the reference temperature, unless the table says otherwise.
        where: The path file.

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has or that the rest contradicts, an air that
            counts from another temperature.
    """
    log = read_temperature_log(Path(where).parent / table.file, heat.names, sensors, table)
    check_sensors(log, [f"{name}_degC" for name in (*sensors, *heat.names)])
    return believed_rises(log, table, heat, warmth, ambient)


def _zero_of(log: Temperatures, rises: TemperatureLog) -> float:
    """What rises count from when their log ends [degC]: its air, or without one its parts, tell."""
    absolute = log.rises(0.0, 0.0)
    if log.ambient is not None:
        return absolute.last_air - rises.last_air
    return float(np.nanmedian([absolute.readings[name] - rise for name, rise in rises.readings.items()]))


def believed_rises(
    log: Temperatures,
    table: sh.LogTable,
    heat: ArmHeat,
    warmth: ThermalUncertainty,
    ambient: sh.AmbientTable,
) -> TemperatureLog:
    """Readings of a log as rises, refused where the rest contradicts them; arguments are as in ``log_of``."""
    zero = ambient.reference_degC
    reference, window = zero if table.reference is None else table.reference, table.window_min * MINUTE
    rises = log.rises(reference, window)
    begins, notes = _zero_of(log, rises), [*log.notes]
    counted = f"its rises count from {begins:.1f} degC, the air from {zero:g}"
    differs = abs(begins - zero) if ambient.is_given else 0.0
    if reference == "start":
        refuse_warm_start(log, *distance_from_cold(log, window), 'log.reference = "ambient", or degC')
        if warm := lukewarm(log, window):
            notes.append(warm)
    refuse_doubtful(log, heat, warmth, reference, window, zero)
    if differs > (WARM if isinstance(reference, str) else ONE_ZERO):
        raise InputError(
            f"{log.table.source}: {counted}; "
            f"give ambient.reference_degC = {begins:.1f}, or no more of [ambient]: the air stays as the log leaves it"
        )
    if differs > ONE_ZERO:
        notes.append(f"{log.table.source}: {counted}: taken for one, as sensors may be off alike")
    return replace(rises, notes=tuple(notes))
