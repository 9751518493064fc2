"""Temperature logs: one CSV format for a path file's log, its air, and the measurements of an arm.

Columns: ``time_s``, ``ambient_degC`` (the air), and for any of the model's rises ``<node>_degC``, or ``part_<n>_degC``
as the robot file's ``thermal.sensors`` names them. Empty cells are gaps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from compgen.core.arrays import Array
from compgen.core.csv_table import CsvTable, read_csv
from compgen.core.exceptions import InputError
from compgen.core.toml import suggest
from compgen.core.units import MINUTE
from compgen.thermal.log_fit import TemperatureLog

COLDEST, HOTTEST = -20.0, 60.0  # degC that a robot's air may have
HOTTEST_PART = 120.0  # degC
COLD_START = 0.5 * MINUTE  # of a log that begins with a cold arm: the median of its readings there is cold
FIRST_READING = 20 * MINUTE  # within which each sensor must have one where rises count from the log's beginning

#: what rises count from: a temperature [degC], the air at the same time, or each sensor's own first readings
Reference = float | Literal["ambient", "start"]


@dataclass(frozen=True, eq=False, slots=True)
class Temperatures:
    """Readings of a log as they stand in the file."""

    table: CsvTable  # for messages
    time: Array  # (M,) [s] rising
    ambient: Array | None  # (M,) [degC], gaps interpolated; None: not measured
    readings: Mapping[str, Array]  # name of a rise to (M,) [degC]; NaN where there is none
    column: Mapping[str, str]  # name of a rise to its column

    def rises(self, reference: Reference, window: float) -> TemperatureLog:
        """Readings as rises above a reference.

        Args:
            reference: What they count from.
            window: How much of the log's beginning "start" takes the median of [s].

        Raises:
            InputError: The reference was not measured.
        """
        still, has_air = np.zeros(len(self.time)), self.ambient is not None
        if reference == "ambient":
            if self.ambient is None:
                raise InputError(
                    f"{self.table.source}: column ambient_degC: missing; rises shall count from the air "
                    "(reference = 'ambient')"
                )
            return TemperatureLog(self.time, still, {n: v - self.ambient for n, v in self.readings.items()})
        early = self.time <= self.time[0] + window
        if reference == "start":
            air = still if self.ambient is None else self.ambient - float(np.median(self.ambient[early]))
            rises = {n: v - _first_reading(self, n, early) for n, v in self.readings.items()}
            return TemperatureLog(self.time, air, rises, has_air)
        air = still if self.ambient is None else self.ambient - reference
        return TemperatureLog(self.time, air, {n: v - reference for n, v in self.readings.items()}, has_air)


def read_temperature_log(
    source: str | Path, nodes: Sequence[str], sensors: Mapping[str, str], air: bool = False
) -> Temperatures:
    """Read a log.

    Args:
        source: The CSV file.
        nodes: Names of the model's rises.
        sensors: ``part_<n>`` to the name of a rise.
        air: Whether the air alone is needed: then it must be there, and columns of any name may stand beside it.

    Raises:
        InputError: Not readable, a column that is missing, unknown or of a rise that another one shows too, a cell that
            is no number, time that does not rise, a temperature that no cell has.
    """
    return temperatures_of(read_csv(source, ("time_s", "ambient_degC") if air else ("time_s",)), nodes, sensors, air)


def temperatures_of(
    table: CsvTable, nodes: Sequence[str], sensors: Mapping[str, str], air: bool = False
) -> Temperatures:
    """``read_temperature_log`` for a table that is at hand."""
    source = table.source
    rise_of = {f"{n}_degC": n for n in nodes} | {f"{part}_degC": n for part, n in sensors.items()}
    unknown = next((c for c in table.header if c not in rise_of and c not in ("time_s", "ambient_degC")), None)
    if unknown is not None and not air:
        names = [*rise_of, "ambient_degC", "time_s"]
        raise InputError(
            f"{source}: {table.label(unknown)}: unknown sensor{suggest(unknown, names, listed=True)}; remove it, or "
            f"name it as one of {', '.join(rise_of)}"
        )
    column: dict[str, str] = {}
    for name in (c for c in table.header if c in rise_of):
        other = column.setdefault(rise_of[name], name)
        if other != name:
            raise InputError(f"{source}: columns {other} and {name}: both show the rise of '{rise_of[name]}'; keep one")
    time = _times(table)
    ambient = None
    if table.has("ambient_degC"):
        values = _degrees(table, "ambient_degC", HOTTEST)
        measured = ~np.isnan(values)
        ambient = np.interp(time, time[measured], values[measured])
    readings = {rise: _degrees(table, name, HOTTEST_PART) for rise, name in column.items()}
    return Temperatures(table, time, ambient, readings, column)


def check_sensors(log: Temperatures, sensors: Sequence[str]) -> None:
    """Raises InputError for a log of one row, or without a sensor; ``sensors`` are columns it may have."""
    if not log.readings:
        raise InputError(f"{log.table.source}: line 1: no sensor; known: {', '.join(sensors)}")
    if len(log.time) < 2:
        raise InputError(f"{log.table.source}: one row only; a log needs two at least")


def _times(table: CsvTable) -> Array:
    time = table.numbers("time_s")
    if time[0] < 0:
        raise InputError(f"{table.location(0, 'time_s')}: {time[0]:g} is negative; begin at 0")
    falling = np.flatnonzero(np.diff(time) <= 0)
    if len(falling):
        n = int(falling[0]) + 1
        raise InputError(
            f"{table.location(n, 'time_s')}: {time[n]:g} after {time[n - 1]:g}: time must rise; sort the log"
        )
    return time


def _degrees(table: CsvTable, column: str, hottest: float) -> Array:
    """A column of temperatures with its gaps as NaN."""
    values = table.numbers(column, gaps=True)
    if np.isnan(values).all():
        raise InputError(
            f"{table.source}: {table.label(column)}: has no number at all; remove the column or mend the sensor"
        )
    wrong = np.flatnonzero((values > hottest) | (values < COLDEST))
    if len(wrong):
        n = int(wrong[0])
        raise InputError(
            f"{table.location(n)}: {column} = {values[n]:g} lies outside {COLDEST:g} to {hottest:g}; mend the sensor, "
            "or leave the cell empty"
        )
    return values


def _first_reading(log: Temperatures, name: str, early: Array) -> float:
    """Median of a sensor's readings at the log's beginning, or its first one soon after [degC]."""
    values = log.readings[name]
    if np.isfinite(values[early]).any():
        return float(np.nanmedian(values[early]))
    first = int(np.argmax(np.isfinite(values)))
    if log.time[first] - log.time[0] > FIRST_READING:
        raise InputError(
            f"{log.table.source}: column {log.column[name]}: no reading in the first {FIRST_READING / MINUTE:g} min, "
            "and rises count from there; begin the log with the cold robot"
        )
    return float(values[first])
