"""One row a waypoint, row n for P[n]."""

from collections.abc import Iterator

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.decimals import Column, consecutive, join_columns, short_columns, text_column
from compgen.core.evaluation import BLOCK, map_blocks
from compgen.core.pose import JOINT_KEYS, POSE_KEYS
from compgen.core.units import DEG, MM, UM
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report.job_summary import job_band
from compgen.verification.band import Band

#: half-widths of the band, k = 2: along World, and along the way
BAND = tuple(f"band_{axis}_um" for axis in ("x", "y", "z", "feed", "cross", "normal"))
_ONE_DIGIT = [b",%d" % digit for digit in range(10)]


def column_names(planned: Planned) -> list[str]:
    """Of the table of waypoints, in their order."""
    return [
        "n",
        "time_s",
        *POSE_KEYS[:3],
        *(f"{side}_d{axis}_um" for side in ("before", "after") for axis in "xyz"),
        *(f"rise_{name}_K" for name in planned.job.heat.names),
        "contact",
        *JOINT_KEYS,
        *BAND,
    ]


def waypoint_columns(planned: Planned, corrected: Corrected | None) -> dict[str, Array | IntArray]:
    """The table of waypoints with all digits, (N,) each; NaN where there is no correction."""
    number = np.arange(1, len(planned.path.arc) + 1)
    none = np.full((len(number), 3), np.nan)
    tables = _tables(planned, corrected, job_band(planned, corrected), slice(None))
    columns = (number, *(column for table, _ in tables for column in (none if table is None else table).T))
    return dict(zip(column_names(planned), columns, strict=True))


def _tables(
    planned: Planned, corrected: Corrected | None, band: Band, rows: slice
) -> list[tuple[Array | IntArray | None, int]]:
    """What stands behind the number in some rows of the table, and with how many decimals; None: no correction.

    Times are by the clock of the written text, joints those of its positions.
    """
    path, written = planned.path, planned.written() if corrected is None else corrected.written
    return [
        (written.time[rows, None], 6),
        (path.target.position[rows] / MM, 6),
        (planned.error_at(rows)[:, :3] / UM, 4),
        (at_waypoints(corrected, rows) / UM if corrected else None, 4),
        (planned.rise[rows], 5),
        (path.contact[rows, None].astype(np.int64), 0),
        (planned.job.robot.to_pendant(written.theta[rows]) / DEG, 6),
        (band.half_widths(path, rows) / UM, 2),
    ]


def waypoints_blocks(planned: Planned, corrected: Corrected | None) -> Iterator[bytes]:
    """Target, error before and after, rises, contact, commanded pendant angles, and the band.

    ``before`` is the prediction at the planned joints; ``after`` is what the twin did with the written text. Without a
    correction the ``after`` columns are empty, and the joints are those of the text that is not corrected.
    """
    band = job_band(planned, corrected)

    def block(first: int, last: int) -> bytes:
        return bytes(csv_lines(first + 1, last + 1, _tables(planned, corrected, band, slice(first, last))))

    yield ",".join(column_names(planned)).encode("ascii")
    yield from map_blocks(len(planned.path.arc), block, BLOCK)
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
