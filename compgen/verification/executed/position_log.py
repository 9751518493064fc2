"""Logs of positions during a run: ``time_s`` and ``x_mm`` to ``r_deg``, or ``j1_deg`` to ``j6_deg``.

One row every 2 to 100 ms, as a KAREL program or a controller's high-speed position output writes them. The clock is the
log's own: it may begin anywhere and run a little fast. Rows may be missing; a row without a position is a gap. Of two
equal rows behind a missing one the second has the right time, and the first is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.csv_table import CsvTable, read_csv
from compgen.core.exceptions import InputError
from compgen.core.pose import JOINT_KEYS, POSE_KEYS
from compgen.core.units import DEG, MM, MS

LEAST_ROWS = 10
MOST_ROWS = 10_000_000
LONGEST_STEP = 0.1  # s
SHORTEST_STEP = 0.5e-3  # s
CLOCKS = {"time_s": 1.0, "time_ms": MS}  # columns of a clock
REPEATED = 2  # rows that most positions have, in a log of steps
HELD_UP = 1.5  # usual steps, behind which a pair of equal rows stands
SLACK = 1.05  # of a step: clocks jitter


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PositionLog:
    """M rows of a log, as they were written: positions in some frame, or joints as the pendant has them."""

    table: CsvTable  # for messages
    row: IntArray  # (M,) of the table: gaps are left out
    time: Array  # (M,) [s] as the log's clock shows it, never falling
    columns: tuple[str, ...]  # that hold the positions
    numbers: Array  # (M, 6) pendant angles [rad], or X Y Z [m] and W P R [rad]
    gaps: int  # rows without a position

    @property
    def period(self) -> float:
        """The usual time between two rows [s]."""
        return float(np.median(np.diff(self.time)))

    @property
    def is_joints(self) -> bool:
        """Whether its numbers are joints."""
        return self.columns == JOINT_KEYS

    @property
    def place(self) -> Array:
        """X, Y, Z of a Cartesian log, (M, 3) [m]."""
        return self.numbers[:, :3]

    def location(self, m: int, column: str = "") -> str:
        """File, line and column of a row, for a message."""
        return self.table.location(int(self.row[m]), column)


def read_position_log(source: str | Path, *, third_on_link2: bool = False) -> PositionLog:
    """Read a log; other columns may stand beside those above.

    Args:
        source: The file.
        third_on_link2: Whether it counts the third joint against link 2, as DH angles do, not as the pendant does.

    Raises:
        InputError: Not readable, columns missing or without a number, a cell that is no number, fewer than ten rows,
            time that falls, rows more than 100 ms apart, or positions that never change.
    """
    table = read_csv(source, (), most_rows=MOST_ROWS)
    clock, columns = _clock(table), _columns(table)
    values = np.column_stack([table.numbers(name, gaps=True) for name in (clock, *columns)])
    values[:, 0] *= CLOCKS[clock]
    rows = _rows_with_position(table, (clock, *columns), values)
    gaps = len(values) - len(rows)
    _check_clock(table, clock, rows, values[rows, 0])
    rows = rows[~_held(values[rows, 0], values[rows, 1:])]
    time, kept = _once_each(values[rows, 0], values[rows, 1:])
    rows = rows[kept]
    numbers = values[rows, 1:]
    if np.ptp(numbers, axis=0).max() == 0:
        raise InputError(f"{source}: all {len(rows)} rows have the same position; log while the program runs")
    if third_on_link2:
        if columns != JOINT_KEYS:
            raise InputError(f"{source}: --j3 link2: it has no joints, but {columns[0]} to {columns[-1]}; leave it out")
        numbers = numbers - numbers[:, 1:2] * np.eye(6)[2]
    units = [DEG] * 6 if columns == JOINT_KEYS else [MM] * 3 + [DEG] * 3
    return PositionLog(
        table=table,
        row=rows,
        time=frozen(time),
        columns=columns,
        numbers=frozen(numbers * units),
        gaps=gaps,
    )


def _rows_with_position(table: CsvTable, names: Sequence[str], values: Array) -> IntArray:
    """Rows of clock and position (M, 1 + k) that have a position; the others have none of its numbers."""
    filled = ~np.isnan(values)
    for k, name in enumerate(names):
        if not filled[:, k].any():
            raise InputError(f"{table.source}: column {name}: has no number at all; log it, or leave the column out")
    is_gap = ~filled[:, 1:].any(axis=1)
    partial = ~filled.all(axis=1) & ~(is_gap & filled[:, 0])
    if partial.any():
        m = int(np.argmax(partial))
        location = table.location(m, names[int(np.argmin(filled[m]))])
        raise InputError(f"{location}: empty or nan; fill it in, or leave all of the row's positions empty")
    rows = np.flatnonzero(~is_gap)
    if len(rows) < LEAST_ROWS:
        few = f"{len(rows)} rows with a position; a run needs {LEAST_ROWS} at least"
        raise InputError(f"{table.source}: {few}: log one every 2 to 100 ms")
    return rows


def _held(time: Array, numbers: Array) -> BoolArray:
    """Rows that show the next one's position under too early a time, (M,): loggers that are held up write such pairs.

    The first of a pair stands behind a step of two; its time is that of a row that was never read.
    """
    step = np.diff(time)
    held = np.zeros(len(time), dtype=bool)
    held[1:-1] = (step[:-1] > HELD_UP * float(np.median(step))) & (numbers[1:-1] == numbers[2:]).all(axis=1)
    return held


def _once_each(time: Array, numbers: Array) -> tuple[Array, IntArray]:
    """Times [s] and rows of a log, those that repeat a position as one in their middle, if most positions are repeated.

    Loggers that ask more often than the controller answers write such steps, and so do few digits at a low speed.
    Where the position stays for longer the robot stands, and every row counts.
    """
    begins = np.flatnonzero(np.append(True, (numbers[1:] != numbers[:-1]).any(axis=1)))
    count = np.diff(np.append(begins, len(time)))
    brief = time[begins + count - 1] - time[begins] < LONGEST_STEP / 2
    if not brief.any() or np.median(count[brief]) < REPEATED:
        return time, np.arange(len(time))
    which = np.repeat(np.arange(len(begins)), count)
    kept = np.union1d(begins, np.flatnonzero(~brief[which]))
    middle = np.bincount(which, time - time[0]) / count + time[0]
    return np.where(brief[which], middle[which], time)[kept], kept


def _columns(table: CsvTable) -> tuple[str, ...]:
    """The columns of positions that a log has: Cartesian ones where both kinds are whole."""
    nearest = max((POSE_KEYS, JOINT_KEYS), key=lambda columns: sum(map(table.has, columns)))
    missing = next((name for name in nearest if not table.has(name)), None)
    if missing is None:
        return nearest
    raise InputError(
        f"{table.source}: column {missing}: missing; a log has time_s and {', '.join(POSE_KEYS)}, or "
        f"{JOINT_KEYS[0]} to {JOINT_KEYS[-1]}, in mm and degrees"
    )


def _clock(table: CsvTable) -> str:
    """The column of the clock, whose name says its unit."""
    clock = next((name for name in CLOCKS if table.has(name)), None)
    if clock is None:
        named = ", ".join(table.header)
        raise InputError(
            f"{table.source}: no column {' or '.join(CLOCKS)}: has {named:.120}; give seconds as time_s or "
            "milliseconds as time_ms: name the clock's column so, and turn other units or dates into one of them"
        )
    return clock


def _check_clock(table: CsvTable, clock: str, rows: IntArray, time: Array) -> None:
    """Raises InputError where a clock falls, or its rows are too far apart."""
    step = np.diff(time)
    falling = np.flatnonzero(step < 0)
    if len(falling):
        m = int(falling[0]) + 1
        raise InputError(
            f"{table.location(int(rows[m]), clock)}: {time[m]:.10g} s after {time[m - 1]:.10g}: the clock steps back "
            f"by {time[m - 1] - time[m]:.3g} s; log with a clock that runs on, or cut the log there"
        )
    usual = float(np.median(step))
    if usual > LONGEST_STEP * SLACK:
        hint = "; are the times milliseconds? divide them by 1000" if 2 <= usual <= 1000 else ""
        raise InputError(
            f"{table.source}: column {clock}: rows are {usual:.3g} s apart; at most {LONGEST_STEP:g} s shows what a "
            f"controller does between points: log every 2 to 100 ms{hint}"
        )
    if usual < SHORTEST_STEP:
        raise InputError(
            f"{table.source}: column {clock}: rows are {usual:.3g} s apart; no controller moves at such steps: give "
            "time_s in seconds"
        )
