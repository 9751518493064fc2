"""One row a waypoint, row n for P[n]."""

from collections.abc import Iterator

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.decimals import Column, consecutive, join_columns, short_columns, text_column
from compgen.core.evaluation import BLOCK, map_blocks
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report.job_summary import band_of

#: half-widths of the band, k = 2: along World, and along the way
BAND = tuple(f"band_{axis}_um" for axis in ("x", "y", "z", "feed", "cross", "normal"))
_ONE_DIGIT = [b",%d" % digit for digit in range(10)]


def column_names(planned: Planned) -> list[str]:
    """Of the table of waypoints, in their order."""
    names = ["n", "time_s", "x_mm", "y_mm", "z_mm", *(f"{side}_d{a}_um" for side in ("before", "after") for a in "xyz")]
    names += [*(f"rise_{n}_K" for n in planned.job.heat.names), "contact", *(f"j{i}_deg" for i in range(1, 7))]
    return [*names, *BAND]


def waypoint_columns(planned: Planned, corrected: Corrected | None) -> dict[str, Array | IntArray]:
    """The table of waypoints with all digits, (N,) each; NaN where there is no correction."""
    path, job = planned.path, planned.job
    time, theta = _time_and_joints(planned, corrected)
    N = len(time)
    tables = [
        np.arange(1, N + 1)[:, None],
        time[:, None],
        path.target.position / MM,
        planned.error()[:, :3] / UM,
        at_waypoints(corrected, slice(None)) / UM if corrected else np.full((N, 3), np.nan),
        planned.rise,
        path.contact[:, None].astype(np.int64),
        job.robot.to_pendant(theta) / DEG,
        band_of(planned, corrected).half_widths(path) / UM,
    ]
    return dict(zip(column_names(planned), (column for table in tables for column in table.T), strict=True))


def _time_and_joints(planned: Planned, corrected: Corrected | None) -> tuple[Array, Array]:
    """By the clock of the written text, (N,) [s], and as commanded, (N, 6) [rad]."""
    if corrected is None:
        return planned.written().time, planned.theta
    return corrected.written.time, corrected.solution.theta


def waypoints_blocks(planned: Planned, corrected: Corrected | None) -> Iterator[bytes]:
    """Target, error before and after, rises, contact, commanded pendant angles, and the band.

    ``before`` is the prediction at the planned joints; ``after`` is what the twin did with the written text. Without a
    correction the ``after`` columns are empty and the joints are the planned ones.
    """
    path, job = planned.path, planned.job
    time, theta = _time_and_joints(planned, corrected)
    band = band_of(planned, corrected)

    def block(first: int, last: int) -> bytes:
        rows = slice(first, last)
        tables = [
            (time[rows, None], 6),
            (path.target.position[rows] / MM, 6),
            (planned.error_at(rows)[:, :3] / UM, 4),
            (at_waypoints(corrected, rows) / UM if corrected else None, 4),
            (planned.rise[rows], 5),
            (path.contact[rows, None].astype(np.int64), 0),
            (job.robot.to_pendant(theta[rows]) / DEG, 6),
            (band.half_widths(path, rows) / UM, 2),
        ]
        return bytes(csv_lines(first + 1, last + 1, tables))

    yield ",".join(column_names(planned)).encode("ascii")
    yield from map_blocks(len(path.arc), block, BLOCK)
    yield b"\n"


def csv_lines(first: int, last: int, tables: list[tuple[Array | IntArray | None, int]]) -> bytes | memoryview:
    """Rows first to before last: the number, then each table's columns with so many decimals; three blanks for none."""
    parts: list[bytes | Column] = [b"\n", consecutive(first, last)]
    for table, decimals in tables:
        if table is None:
            parts.append(b",,,")
        elif decimals == 0:
            parts.append(text_column(_ONE_DIGIT, table[:, 0].astype(np.int64, copy=False)))
        else:
            columns = short_columns(table, decimals, before=b",")
            if columns is None:
                return long_csv_lines(first, last, tables)
            parts += columns
    return join_columns(last - first, parts)


def long_csv_lines(first: int, last: int, tables: list[tuple[Array | IntArray | None, int]]) -> bytes:
    """Rows whose numbers have more digits than there is room for in columns of words."""
    number = np.arange(first, last)
    columns: list[tuple[str, Array | IntArray]] = [("%d", number)]
    for table, decimals in tables:
        if table is None:
            columns += [("%.0s", number)] * 3
        elif decimals == 0:
            columns += [("%d", column) for column in table.T]
        else:  # rounding first, so that nothing prints as a negative zero
            columns += [(f"%.{decimals}f", np.round(column, decimals) + 0.0) for column in table.T]
    form = "\n" + ",".join(form for form, _ in columns)
    return "".join(map(form.__mod__, zip(*(column.tolist() for _, column in columns), strict=True))).encode("ascii")


def at_waypoints(corrected: Corrected, rows: slice) -> Array:
    """The twin's error at some of the positions, (M, 3) [m]."""
    return np.asarray(corrected.deviation.error[corrected.samples[rows]])
