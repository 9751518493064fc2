"""Temperature logs: one CSV format for a path file's log, its air, and the measurements of an arm.

Columns: ``time_s``, ``ambient_degC`` (the air), and for any of the model's rises ``<node>_degC``, or ``part_<n>_degC``
as the robot file's ``thermal.sensors`` names them. Empty cells are gaps.

Of a log that somebody else is still writing, a last line without an end is not read yet. A row of another length, or
without a time, is left out, and so is one that was written before, with its time; a cell that is no temperature is a
gap; a header that stands in the middle belongs to a file that was begun anew. Where time falls, the logger's clock was
set back: what follows is moved on, one usual step behind the row before. A jump forward is a gap.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from statistics import median
from typing import Literal

import numpy as np

from compgen.core.arrays import Array
from compgen.core.csv_table import CsvRow, CsvTable, ended_rows, float_of, read_csv, table_of_rows
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.recorded.cells import LONG, brief_name, name_and_unit
from compgen.core.recorded.layout import PLAIN, DialectTable
from compgen.core.recorded.table import dialect_beside, in_other_units, read_recorded
from compgen.core.toml import suggest
from compgen.core.units import HOUR, MINUTE
from compgen.thermal.state_from_log import TemperatureLog

COLDEST, HOTTEST = -20.0, 60.0  # degC that a robot's air may have
HOTTEST_PART = 120.0  # degC
COLD_START = 0.5 * MINUTE  # of a log that begins with a cold arm: the median of its readings there is cold
FIRST_READING = 20 * MINUTE  # within which each sensor must have one where rises count from the log's beginning
HANGING = HOUR  # for which a live sensor does not stand at one value,
FEWEST_SAME = 5  # readings in that time
STEEP = (8.0, 1.0)  # where it changed in as long before by so many of its usual steps, and kelvins [tau >= 0.5 h]
MOST = 500_000_000  # bytes
MOST_OF_SECOND = 11  # rows, and three times the usual, beyond which the clock hangs
LEAST_STEP = 0.001  # [s] behind the row before, for one that was moved on

#: what rises count from: a temperature [degC], the air at the same time, or each sensor's own first readings
Reference = float | Literal["ambient", "start"]


@dataclass(frozen=True, eq=False, slots=True)
class Temperatures:
    """Readings of a log as they stand in the file."""

    table: CsvTable  # for messages
    time: Array  # (M,) [s] rising
    ambient: Array | None  # (M,) [degC]; NaN where there is none; None: not measured
    readings: Mapping[str, Array]  # name of a rise to (M,) [degC]; NaN where there is none
    column: Mapping[str, str]  # name of a rise to its column

    @property
    def notes(self) -> tuple[str, ...]:
        """How the file was understood, and which parts nobody asks for."""
        other = [c for c in self.table.header if c not in (*self.column.values(), "time_s", "ambient_degC")]
        return self.table.notes or ((f"{self.table.source}: left out: {', '.join(other)}",) if other else ())

    def rises(self, reference: Reference, window: float) -> TemperatureLog:
        """Readings as rises above a reference.

        Args:
            reference: What they count from.
            window: How much of the log's beginning "start" takes the median of [s].

        Raises:
            InputError: The reference was not measured.
        """
        air, read = np.zeros(len(self.time)), np.zeros(len(self.time), dtype=bool)
        if self.ambient is not None:
            read = np.isfinite(self.ambient)
            air = np.interp(self.time, self.time[read], self.ambient[read])
        if reference == "ambient":
            if self.ambient is None:
                raise InputError(
                    f"{self.table.source}: column ambient_degC: missing; rises shall count from the air "
                    "(reference = 'ambient')"
                )
            return TemperatureLog(self.time, np.zeros(len(air)), {n: v - air for n, v in self.readings.items()})
        early = self.time <= self.time[0] + window
        if reference == "start":
            rises = {n: v - _first_reading(self, n, early) for n, v in self.readings.items()}
            return TemperatureLog(self.time, air - float(np.median(air[early])), rises, read)
        rises = {n: v - reference for n, v in self.readings.items()}
        return TemperatureLog(self.time, air if self.ambient is None else air - reference, rises, read)


def read_temperature_log(
    source: str | Path,
    nodes: Sequence[str],
    sensors: Mapping[str, str],
    dialect: DialectTable = PLAIN,
    *,
    air: bool = False,
) -> Temperatures:
    """Read a log.

    Args:
        source: The file.
        nodes: Names of the model's rises.
        sensors: ``part_<n>``, or another column, to the name of a rise.
        dialect: What the path file says of it in [log].
        air: Whether the air alone is needed: then it must be there, and columns of any name may stand beside it.

    Raises:
        InputError: Not readable, a column that is missing, unknown or of a rise that another one shows too, a cell that
            is no number, time that does not rise, a temperature that no cell has.
    """
    required = ("time_s", "ambient_degC") if air else ("time_s",)
    return temperatures_of(_table(source, required, nodes, sensors, dialect), nodes, sensors, air=air)


def _known(nodes: Sequence[str], sensors: Mapping[str, str]) -> tuple[str, ...]:
    """The columns of compgen's own form."""
    return ("time_s", "ambient_degC", *(f"{name}_degC" for name in (*nodes, *sensors)))


def _table(
    source: str | Path,
    required: Sequence[str],
    nodes: Sequence[str],
    sensors: Mapping[str, str],
    dialect: DialectTable,
    data: bytes | None = None,
) -> CsvTable:
    """The table of a log, of compgen's own form or a logger's."""
    known = _known(nodes, sensors)
    dialect, where = dialect_beside(source) if type(dialect) is DialectTable else (dialect, "[log]")
    table = read_recorded(source, required, known, dialect, where, data) or read_csv(source, required)
    if table.recorded and nodes and set(table.header) <= set(known[:2]):
        left = table.recorded.left_out
        like = {n: c for c in left for n in nodes if n in re.split(r"[\W_]+", c.casefold()) and len(c) <= LONG}
        mend = ", ".join(f'{n} = "{c}"' for n, c in (like or {nodes[0]: "TC 03"}).items())
        mend += " }" if any(name_and_unit(c)[1] for c in left) else ' }, unit = "degC"'
        raise InputError(
            f"{source}: line {table.line[0]}: no sensor; name it in {where} as columns = {{ {mend}, or in "
            "thermal.sensors of the robot file"
            + ("" if like else f"; there are: {', '.join(map(brief_name, left))[:100]}")
        )
    return table


def temperatures_of(
    table: CsvTable, nodes: Sequence[str], sensors: Mapping[str, str], *, air: bool = False
) -> Temperatures:
    """``read_temperature_log`` for a table that is at hand."""
    source = table.source
    rise_of = {f"{n}_degC": n for n in nodes} | {f"{part}_degC": n for part, n in sensors.items() if n in nodes}
    others = [c for c in table.header if c not in rise_of and c not in ("time_s", "ambient_degC")]
    unused = [c for c in others if re.fullmatch(r"part_\d+_degC", c) and rise_of.keys() & set(table.header)]
    unknown = next((c for c in others if c not in unused), None)
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
    ambient = _degrees(table, "ambient_degC", HOTTEST) if table.has("ambient_degC") else None
    readings = {rise: _degrees(table, name, HOTTEST_PART) for rise, name in column.items()}
    return Temperatures(table, time, ambient, readings, column)


def check_sensors(log: Temperatures, sensors: Sequence[str]) -> None:
    """Raises InputError for a log of one row, or without a sensor; ``sensors`` are columns it may have."""
    if not log.readings:
        raise InputError(f"{log.table.source}: line 1: no sensor; known: {', '.join(sensors)}")
    if len(log.time) < 2:
        raise InputError(f"{log.table.source}: one row only; a log needs two at least")


def check_live(log: Temperatures) -> None:
    """Raises InputError for a sensor that stands where a warming part could not, while another goes on."""
    known = {name: np.isfinite(values) for name, values in log.readings.items()}
    for name, values in log.readings.items():
        since = _hangs_since(log.time[known[name]], values[known[name]])
        others = [(log.time[known[o]], v[known[o]]) for o, v in log.readings.items() if o != name]
        if since is not None and any(_goes_on(*other, since) for other in others):
            raise InputError(
                f"{log.table.source}: {log.table.label(log.column[name])}: stands at one value for an hour and more "
                f"from {since:g} s on, right after it changed fast, and others go on: the sensor hangs; empty its "
                "cells from there, or remove the column"
            )


def _goes_on(time: Array, value: Array, since: float) -> bool:
    """Whether readings (M,) change by more than noise in the hour after a time [s]."""
    hour = value[(time >= since) & (time <= since + HANGING)]
    return bool(len(hour) > 1 and abs(hour[-1] - hour[0]) >= STEEP[1])


def _hangs_since(time: Array, value: Array) -> float | None:
    """Where a sensor begins to stand that a warming part could not have brought to rest, (M,) [s]; None: nowhere."""
    step = np.abs(np.diff(value))
    if not step.any():
        return None
    steep = max(STEEP[0] * float(np.median(step[step > 0])), STEEP[1])
    begins = np.append(0, np.flatnonzero(step) + 1)
    ends = np.append(begins[1:] - 1, len(value) - 1)
    for begin in begins[(time[ends] - time[begins] >= HANGING) & (ends - begins >= FEWEST_SAME)]:
        before = int(np.searchsorted(time, time[begin] - HANGING))
        if abs(value[begin] - value[before]) >= steep:
            return float(time[begin])
    return None


def _times(table: CsvTable) -> Array:
    time = table.numbers("time_s")
    table.refuse_first(time[:1] < 0, "time_s", lambda n: f"{time[n]:g} is negative; begin at 0")
    mends = {True: "write the times with their seconds", False: "sort the log"}
    table.refuse_first(
        np.diff(time, prepend=-1.0) <= 0,
        "time_s",
        lambda n: f"{time[n]:g} after {time[n - 1]:g}: time must rise; {mends[bool(time[n] == time[n - 1])]}",
    )
    return time


def _degrees(table: CsvTable, column: str, hottest: float) -> Array:
    """A column of temperatures with its gaps as NaN."""
    values = table.numbers(column, gaps=True)
    if np.isnan(values).all():
        raise InputError(
            f"{table.source}: {table.label(column)}: has no number at all; remove the column or mend the sensor"
        )
    outside = f"lies outside {COLDEST:g} to {hottest:g}; mend the sensor, or leave the cell empty"
    is_outside = (values > hottest) | (values < COLDEST)
    table.refuse_first(is_outside, "", lambda n: f"{column} = {values[n]:g} {outside}")
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


@dataclass(frozen=True, slots=True)
class GrowingLog:
    """A log so far."""

    readings: Temperatures | None  # None: no row yet
    left_out: int  # rows
    gaps: int  # cells that were no temperature
    set_back: float  # [s] by which the clock was set back in all
    rows: int = 0  # that were kept, with readings or without, where there is no reading yet

    @property
    def has_no_clock(self) -> bool:
        """Whether its many rows all have the time of the first: nobody knows how far apart they are."""
        time = self.readings.time if self.readings is not None else np.zeros(0)
        return len(time) > MOST_OF_SECOND and float(time[-1] - time[0]) < len(time) * LEAST_STEP

    @property
    def step(self) -> float:
        """Usual time from row to row, of rows that come two or three at a time from those to those; 0: not known."""
        steps = np.diff(self.readings.time) if self.readings is not None else np.zeros(0)
        steps = steps[steps > 2 * LEAST_STEP]
        return float(np.quantile(steps, 0.75, method="lower")) if len(steps) else 0.0


def read_growing_log(
    source: str | Path,
    nodes: Sequence[str],
    sensors: Mapping[str, str],
    dialect: DialectTable = PLAIN,
    data: bytes | None = None,
) -> GrowingLog:
    """A log so far.

    Args:
        source: The CSV file.
        nodes: Names of the model's rises.
        sensors: ``part_<n>``, or another column, to the name of a rise.
        dialect: What the path file says of it in [log].
        data: Its bytes, where they are at hand.

    Raises:
        InputError: Not a readable file, or a column of no sensor.
    """
    data = read_named(source, "give the log's CSV file", MOST) if data is None else data
    rows = ended_rows(data)
    header = rows[0][1] if rows else []
    known = _known(nodes, sensors)
    if rows and ("time_s" not in header or in_other_units({*header} - {*known}, known)):
        whole = data[: data.rfind(b"\n") + 1]
        begun = temperatures_of(_table(source, ("time_s",), nodes, sensors, dialect, whole), nodes, sensors)
        since = 0.0 if begun.table.recorded is None or "time_s" in begun.table.recorded.columns else begun.time[0]
        return GrowingLog(replace(begun, time=begun.time - since), 0, 0, 0.0)
    kept, left_out, shift = _in_order(rows)
    clean = [(n, [_temperature(*cell) for cell in zip(header, cells, strict=True)]) for n, cells in kept]
    gaps = sum(map(str.__ne__, (cell for _, row in kept for cell in row), (cell for _, row in clean for cell in row)))
    filled = [k for k, name in enumerate(header) if any(cells[k] for _, cells in clean)]
    names = [header[k] for k in filled]
    if not set(names) - {"time_s", "ambient_degC"}:  # no sensor has a reading yet
        return GrowingLog(None, left_out, gaps, shift, len(kept))
    table = table_of_rows(str(source), [(0, names), *((n, [cells[k] for k in filled]) for n, cells in clean)], ())
    return GrowingLog(temperatures_of(table, nodes, sensors), left_out, gaps, shift)


def _in_order(rows: Sequence[CsvRow]) -> tuple[list[CsvRow], int, float]:
    """Rows below a header by rising time, how many were left out, and by how much the clock was set back in all [s].

    Where far more rows than usual stand in a second the clock hung: each is a usual step behind the one before.
    """
    kept, seen, left_out, moved = list[CsvRow](), set[tuple[str, ...]](), 0, 0.0
    usual, shift, last, written, before = 0.0, 0.0, -math.inf, math.nan, ""
    of_second, often = _rows_of_seconds(rows)
    for n, cells in rows[1:]:
        if cells == rows[0][1]:
            continue
        at = rows[0][1].index("time_s")
        time = float_of(cells[at]) if len(cells) == len(rows[0][1]) else math.nan
        hangs = time >= 0 and cells[at] == before and of_second[cells[at]] > max(MOST_OF_SECOND, 3 * often)
        if not 0 <= time < math.inf or (time + shift <= last and tuple(cells) in seen and not hangs):
            left_out, before = left_out + 1, ""
            continue
        seen.add(tuple(cells))
        before = cells[at]
        if time + shift == written and hangs:
            last += max(usual / often, LEAST_STEP)
            moved = max(moved, last - time)
        elif time + shift == written:  # other readings of the same second
            last += LEAST_STEP
        else:
            if time + shift <= last:
                shift = last + max(usual, LEAST_STEP) - time
            usual, last = (time + shift - last if kept else 0.0), time + shift
            written = last
        kept.append((n, [*cells[:at], repr(last), *cells[at + 1 :]]))
    return kept, left_out, max(moved, shift)


def _rows_of_seconds(rows: Sequence[CsvRow]) -> tuple[Mapping[str, int], float]:
    """How many rows stand one behind the other with each time at most, and in a usual one."""
    at = rows[0][1].index("time_s") if rows else 0
    times = (cells[at] for _, cells in rows[1:] if len(cells) == len(rows[0][1]))
    runs = [(time, len(list(run))) for time, run in groupby(times)]
    most = {time: count for time, count in sorted(runs, key=itemgetter(1))}
    return most, median(count for _, count in runs) if len(runs) > 1 else 1.0


def _temperature(column: str, cell: str) -> str:
    """The cell, or nothing where it is no temperature that a cell can have."""
    hottest = {"time_s": math.inf, "ambient_degC": HOTTEST}.get(column, HOTTEST_PART)
    return cell if COLDEST <= float_of(cell) <= hottest else ""


def readings_in_steps(values: np.ndarray, time: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Readings by steps of time: number of the step, their median, and how many there are.

    Args:
        values: (M,) with NaN for gaps.
        time: (M,) [s] rising.
        step: [s]; step j ends at j step.
    """
    valid = np.isfinite(values)
    steps, first, count = np.unique(np.ceil(time[valid] / step).astype(np.int64), return_index=True, return_counts=True)
    readings = values[valid]
    medians = np.array([np.median(readings[a : a + n]) for a, n in zip(first.tolist(), count.tolist(), strict=True)])
    return steps, medians, count
