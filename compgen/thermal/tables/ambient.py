"""From the tables of air and log in a path file, and their CSV files, to rises."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array
from compgen.core.csv_table import CsvTable, read_csv
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import HOUR, MINUTE
from compgen.thermal import Ambient, still_air
from compgen.thermal.log_fit import TemperatureLog
from compgen.thermal.tables import schema as sh

COLDEST, HOTTEST = -20.0, 60.0  # degC that a robot's air may have
HOTTEST_PART = 120.0  # degC


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
        _, readings = read_temperatures(source)
        return Ambient(readings["time_s"], readings["ambient_degC"] - zero)
    return Ambient(np.zeros(1), np.array([level])) if level else still_air()


def read_temperatures(source: Path) -> tuple[CsvTable, dict[str, Array]]:
    """A CSV file of temperatures over time: ``time_s``, ``ambient_degC`` and any sensors.

    Empty cells and ``nan`` are gaps.

    Returns:
        The file, for messages, and its columns; gaps of the ambient are interpolated.

    Raises:
        InputError: Not readable, a column missing, a cell that is no number, time running backwards, air of no cell.
    """
    table = read_csv(source, ("time_s", "ambient_degC"))
    readings = {name: table.numbers(name, gaps=name != "time_s") for name in table.header}
    time, air = readings["time_s"], readings["ambient_degC"]
    if time[0] < 0:
        raise InputError(f"{table.location(0, 'time_s')}: {time[0]:g} is negative; begin at 0")
    if len(time) > 1 and np.diff(time).min() <= 0:
        n = int(np.argmin(np.diff(time) > 0)) + 1
        raise InputError(
            f"{table.location(n, 'time_s')}: {time[n]:g} after {time[n - 1]:g}: time must rise; sort the log"
        )
    if np.nanmax(air, initial=0) > HOTTEST or np.nanmin(air, initial=0) < COLDEST:
        n = int(np.argmax(np.where(np.isnan(air), 0, np.abs(air - 20))))
        raise InputError(
            f"{table.location(n)}: ambient_degC = {air[n]:g} lies outside {COLDEST:g} to {HOTTEST:g}; mend the sensor"
        )
    for name, values in readings.items():
        if np.isnan(values).all():
            raise InputError(
                f"{source}: {table.label(name)}: has no number at all; remove the column or mend the sensor"
            )
    gaps = np.isnan(air)
    readings["ambient_degC"] = np.interp(time, time[~gaps], air[~gaps])
    return table, readings


def log_of(table: sh.LogTable, sensors: Mapping[str, str], zero: float, where: str) -> TemperatureLog:
    """A thermocouple log as rises.

    Args:
        table: Its file, beside the path file, and what its rises count from.
        sensors: part_<n> to the name of a rise.
        zero: Reference temperature [degC] unless the table says otherwise.
        where: The path file.

    Raises:
        InputError: A bad file, an unknown sensor, readings that no robot has.
    """
    source = Path(where).parent / table.file
    file, columns = read_temperatures(source)
    sensor_names = [f"{part}_degC" for part in sensors]
    readings: dict[str, Array] = {}
    reference = table.reference if table.reference is not None else zero
    time, air = columns["time_s"], columns["ambient_degC"]
    early = time <= time[0] + table.window_min * MINUTE
    for name, values in columns.items():
        if name in ("time_s", "ambient_degC"):
            continue
        if name not in sensor_names:
            raise InputError(
                f"{source}: {file.label(name)}: sensor is unknown; the robot file's thermal.sensors knows "
                f"{', '.join(sensor_names)}{suggest(name, sensor_names, listed=True)}"
            )
        if np.nanmax(values) > HOTTEST_PART or np.nanmin(values) < COLDEST:
            n = int(np.nanargmax(np.abs(values - 20)))
            raise InputError(
                f"{file.location(n)}: {name} = {values[n]:g} lies outside {COLDEST:g} to {HOTTEST_PART:g}; "
                "mend the sensor, or leave the cell empty"
            )
        if reference == "start":
            if np.isnan(values[early]).all():
                raise InputError(f"{source}: '{name}' has no reading in its first {table.window_min:g} min")
            base: Array | float = float(np.nanmedian(values[early]))
        else:
            base = air if reference == "ambient" else float(reference)
        readings[sensors[name.removesuffix("_degC")]] = values - base
    if not readings:
        raise InputError(f"{source}: line 1: no sensor; known: {', '.join(sensor_names)}")
    if len(time) < 2:
        raise InputError(f"{source}: one row only; a log needs two at least")
    level = {"start": float(np.median(air[early])), "ambient": None}.get(str(reference), reference)
    return TemperatureLog(time, np.zeros(len(air)) if level is None else air - float(str(level)), readings)
