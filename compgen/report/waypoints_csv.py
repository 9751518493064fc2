"""One row a waypoint, row n for P[n]."""

from collections.abc import Iterator

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation import BLOCK, map_blocks
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.generate import Corrected, Planned
from compgen.report import csv_columns


def waypoints_blocks(planned: Planned, corrected: Corrected | None) -> Iterator[bytes]:
    """Target, error before and after, rises, contact and commanded pendant angles.

    ``before`` is the prediction at the planned joints; ``after`` is what the twin did with the written text. Without a
    correction the ``after`` columns are empty and the joints are the planned ones.
    """
    path, job = planned.path, planned.job
    trajectory = corrected.trajectory if corrected else planned.trajectory
    theta = corrected.solution.theta if corrected else planned.theta
    head = ["n", "time_s", "x_mm", "y_mm", "z_mm", *(f"{side}_d{a}_um" for side in ("before", "after") for a in "xyz")]
    head += [*(f"rise_{n}_K" for n in job.heat.names), "contact", *(f"j{i}_deg" for i in range(1, 7))]

    def block(first: int, last: int) -> bytes:
        rows = slice(first, last)
        tables = [
            (trajectory.time[rows, None], 6),
            (path.position[rows] / MM, 6),
            (planned.error_at(rows)[:, :3] / UM, 4),
            (at_waypoints(corrected, rows) / UM if corrected else None, 4),
            (planned.rise[rows], 5),
            (path.contact[rows, None].astype(np.int64), 0),
            (job.robot.to_pendant(theta[rows]) / DEG, 6),
        ]
        return _lines(np.arange(first + 1, last + 1), tables)

    yield ",".join(head).encode("ascii")
    yield from map_blocks(len(path.arc), block, BLOCK)
    yield b"\n"


def _lines(number: IntArray, tables: list[tuple[Array | IntArray | None, int]]) -> bytes:
    """Rows of text: the number, then each table's columns with so many decimals; an absent one is three blanks."""
    column = csv_columns.counted(number)
    for table, places in tables:
        if table is None:
            column += 3 * csv_columns.blank(len(number))
        elif places == 0:
            column += csv_columns.digit(table[:, 0].astype(np.int64, copy=False))
        else:
            found = csv_columns.decimals(table, places)
            if found is None:
                return _any_size(number, tables)
            column += found
    return csv_columns.squeezed(column)


def _any_size(number: IntArray, tables: list[tuple[Array | IntArray | None, int]]) -> bytes:
    """The same for numbers that the tables have no room for."""
    parts: list[tuple[str, Array | IntArray]] = [("%d", number)]
    for table, decimals in tables:
        if table is None:
            parts += [("%.0s", number)] * 3
        elif decimals == 0:
            parts += [("%d", column) for column in table.T]
        else:  # rounding first, so that nothing prints as a negative zero
            parts += [(f"%.{decimals}f", np.round(column, decimals) + 0.0) for column in table.T]
    return csv_columns.plain(parts)


def at_waypoints(corrected: Corrected, rows: slice) -> Array:
    """The twin's error at some of the positions, (M, 3) [m]."""
    return np.asarray(corrected.deviation.error[corrected.samples[rows]])
