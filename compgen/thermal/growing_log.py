"""A temperature log that somebody else is still writing: what of it can be read, and what was left out.

A last line without an end is not whole yet. A row of another length, or without a time, is left out, and so is one
that was written before, with its time; a cell that is no temperature is a gap; a header that stands in the middle
belongs to a file that was begun anew. Where time falls, the logger's clock was set back: what follows is moved on, one
usual step behind the row before. A jump forward is a gap.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compgen.core.csv_table import CsvTable
from compgen.core.exceptions import InputError
from compgen.core.files import read_regular
from compgen.thermal.temperature_log import COLDEST, HOTTEST, HOTTEST_PART, Temperatures, temperatures_of

MOST = 500_000_000  # bytes
LEAST_STEP = 0.001  # [s] behind the row before, for one that was moved on


@dataclass(frozen=True, slots=True)
class GrowingLog:
    """A log so far."""

    readings: Temperatures | None  # None: no row yet
    left_out: int  # rows
    gaps: int  # cells that were no temperature
    set_back: float  # [s] by which the clock was set back in all


def read_growing_log(source: str | Path, nodes: Sequence[str], sensors: Mapping[str, str]) -> GrowingLog:
    """A log so far.

    Args:
        source: The CSV file.
        nodes: Names of the model's rises.
        sensors: ``part_<n>`` to the name of a rise.

    Raises:
        InputError: Not a readable file, or a column of no sensor.
    """
    try:
        data = read_regular(source, MOST)
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or "no file has such a name"
        raise InputError(f"{source}: cannot be read: {reason}; give the log's CSV file") from None
    return growing_log(data, str(source), nodes, sensors)


def growing_log(data: bytes, source: str, nodes: Sequence[str], sensors: Mapping[str, str]) -> GrowingLog:
    """``read_growing_log`` for bytes that are at hand."""
    whole = data[: data.rfind(b"\n") + 1].replace(b"\0", b"").decode("utf-8-sig", "replace")
    rows = [
        (n, [cell.strip() for cell in line.split(",")])
        for n, line in enumerate(whole.splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        return GrowingLog(None, 0, 0, 0.0)
    header = rows[0][1]
    if "time_s" not in header:
        raise InputError(f"{source}: line {rows[0][0]}: no column time_s; the header names time_s and the sensors")
    at, usual, shift, last = header.index("time_s"), 0.0, 0.0, -math.inf
    kept: list[tuple[int, list[str]]] = []
    seen: set[tuple[str, ...]] = set()
    left_out = gaps = 0
    for n, cells in rows[1:]:
        if cells == header:
            continue
        time = _number(cells[at]) if len(cells) == len(header) else math.nan
        if not math.isfinite(time) or time < 0:
            left_out += 1
            continue
        if time + shift <= last and tuple(cells) in seen:
            left_out += 1
            continue
        seen.add(tuple(cells))
        if time + shift <= last:
            shift = last + max(usual, LEAST_STEP) - time
        usual, last = (time + shift - last if math.isfinite(last) else 0.0), time + shift
        clean = [
            repr(last) if k == at else _temperature(name, cell)
            for k, (name, cell) in enumerate(zip(header, cells, strict=False))
        ]
        gaps += sum(bool(cell) and not new for cell, new in zip(cells, clean, strict=False))
        kept.append((n, clean))
    table = CsvTable(
        source, tuple(header), tuple(zip(*(cells for _, cells in kept), strict=False)), tuple(n for n, _ in kept)
    )
    if not kept:
        return GrowingLog(None, left_out, gaps, shift)
    read = _with_readings(table)
    return GrowingLog(None if read is None else temperatures_of(read, nodes, sensors), left_out, gaps, shift)


def _with_readings(table: CsvTable) -> CsvTable | None:
    """The table without columns that have no reading yet; None where no sensor has any."""
    keep = [k for k, column in enumerate(table.columns) if any(column)]
    names = tuple(table.header[k] for k in keep)
    if not set(names) - {"time_s", "ambient_degC"}:
        return None
    return CsvTable(table.source, names, tuple(table.columns[k] for k in keep), table.line)


def _number(cell: str) -> float:
    try:
        return float(cell) if cell.isascii() and "_" not in cell else math.nan
    except ValueError:
        return math.nan


def _temperature(column: str, cell: str) -> str:
    """The cell, or nothing where it is no temperature that a cell can have."""
    value = _number(cell) if cell else math.nan
    hottest = HOTTEST if column == "ambient_degC" else HOTTEST_PART
    return cell if COLDEST <= value <= hottest else ""


def readings_in_steps(values: np.ndarray, time: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Readings by steps of time: number of the step, their median, and how many there are.

    Args:
        values: (M,) with NaN for gaps.
        time: (M,) [s] rising.
        step: [s]; step j ends at j step.
    """
    valid = np.isfinite(values)
    number = np.ceil(time[valid] / step).astype(np.int64)
    steps, first, count = np.unique(number, return_index=True, return_counts=True)
    readings = values[valid]
    medians = np.array([np.median(readings[a : a + n]) for a, n in zip(first.tolist(), count.tolist(), strict=True)])
    return steps, medians, count
