"""Rises of the arm at each pose: from a log of temperatures, or unknown from the start of a warm-up."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compgen.core.csv_table import read_csv
from compgen.core.exceptions import InputError
from compgen.identification.measurements import Measurements


def with_temperatures(data: Measurements, source: str, nodes: Sequence[str]) -> Measurements:
    """Rises at the poses' times, interpolated in a log.

    Columns: ``time_s`` on the clock of the poses and ``<node>_degC`` for each node of the robot file's heat model; the
    first row is the cold arm.

    Raises:
        InputError: A column is missing, times do not rise, or poses lie outside the log.
    """
    if not nodes:
        raise InputError(f"{source}: the robot file has no thermal table, so temperatures have no use; leave them out")
    columns = [f"{n}_degC" for n in nodes]
    table = read_csv(source, ("time_s", *columns), ("time_s", *columns))
    time = table.numbers("time_s")
    falling = np.flatnonzero(np.diff(time) <= 0)
    if len(falling):
        raise InputError(
            f"{table.location(int(falling[0]) + 1, 'time_s')}: {time[falling[0] + 1]:g} does not rise; sort the rows"
        )
    outside = np.flatnonzero((data.time < time[0] - 1e-9) | (data.time > time[-1] + 1e-9))
    if len(outside):
        row = int(np.flatnonzero(data.pose == outside[0])[0])
        raise InputError(
            f"{data.label[row]}, column time_s: {data.time[outside[0]]:g} is outside the log {source} ({time[0]:g} to "
            f"{time[-1]:g} s); both need one clock"
        )
    log = np.column_stack([table.numbers(c) for c in columns])
    rise = np.column_stack([np.interp(data.time, time, log[:, k] - log[0, k]) for k in range(len(nodes))])
    return replace(data, rise=rise, warm=np.maximum(rise.max(axis=1) > 0.5, 0.0) * (data.time - time[0]))


def as_warm_up(data: Measurements) -> Measurements:
    """The poses as those of a warm-up that begins cold with the first of them."""
    return replace(data, warm=data.time - data.time.min())
