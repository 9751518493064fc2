"""A path's points from CSV: ``x_mm, y_mm, z_mm`` and how the tool stands, in the frame of the part."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, row_norms
from compgen.core.csv_table import CsvTable, read_csv
from compgen.core.exceptions import InputError
from compgen.core.recorded.cells import name_and_unit
from compgen.core.recorded.layout import PLAIN, DialectTable
from compgen.core.recorded.table import read_recorded
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.planning.own_points.given_points import FEEDS, GivenPoints

PLACE = ("x_mm", "y_mm", "z_mm")
NORMAL = ("i", "j", "k")
ANGLES = ("w_deg", "p_deg", "r_deg")
OTHERS = ("feed_mm_s", "contact", "stop")
KNOWN = (*PLACE, *NORMAL, *ANGLES, *OTHERS)
#: what others call columns of how a tool stands: angles, normals, quaternions
STANDS = re.compile(
    r"[abcwpruvijk]|roll|pitch|yaw|r[xyz]|n ?[xyz]|q[wxyz0-3]|"
    r"(?:.*[ .])?(?:q|norm\w*|vec\w*|vek\w*|dir\w*|quat\w*|axis)[ .:\[]*[wxyzijk0-3]\]?"
)
#: what others call a feed
FED = re.compile(r"f|(?:(?:path|tcp|tool) )?(?:feed ?rate|feed|speed|velocity|vel|vorschub|(?:bahn)?geschwindigkeit)")
UNIT = 0.01  # that a normal's length may differ from one
LARGEST = 1e4  # mm


def points_table(source: str | Path, dialect: DialectTable) -> CsvTable | None:
    """A path's points in a file of another writer's form; None for one of compgen's own."""
    return read_recorded(source, PLACE, KNOWN, dialect, "[path]")


def read_points(source: str | Path, dialect: DialectTable = PLAIN) -> GivenPoints:
    """Read a path's points.

    Args:
        source: CSV with ``x_mm, y_mm, z_mm``; either ``i, j, k`` (unit normal out of the surface), or ``w_deg, p_deg,
            r_deg`` of the tool, or neither; optional ``feed_mm_s`` on the way to a point (empty: the process's),
            ``contact`` on that way and ``stop`` at the point, 0 or 1. A row that repeats the one before is that point.

        dialect: What the path file says of the file in [path].

    Raises:
        InputError: What ``read_csv`` refuses; a column of one kind without the others, or of both; columns of another
            writer that say in another way how the tool stands, or may be the feed; a normal that is no
            unit vector; a feed that no program can say; a flag that is neither 0 nor 1.
    """
    table = points_table(source, dialect) or read_csv(source, PLACE, KNOWN)
    given = [kind for kind in (NORMAL, ANGLES) if any(table.has(c) for c in kind)]
    if len(given) == 2:
        raise InputError(f"{source}: i, j, k and w_deg, p_deg, r_deg both say how the tool stands; keep one of them")
    for column in given[0] if given else ():
        if not table.has(column):
            raise InputError(f"{source}: column {column}: missing; give {', '.join(given[0])} together, or none")
    _refuse_left_out(table, source, given)
    position = np.column_stack([table.numbers(c, largest=LARGEST) for c in PLACE]) * MM
    M = len(position)
    normal = _normals(table) if given == [NORMAL] else None
    rotation = from_wpr(*(table.numbers(c, largest=3600) * DEG for c in ANGLES)) if given == [ANGLES] else None
    feed = _feeds(table) if table.has("feed_mm_s") else np.full(M, np.nan)
    contact = _flags(table, "contact") if table.has("contact") else np.ones(M, dtype=bool)
    stop = _flags(table, "stop") if table.has("stop") else np.zeros(M, dtype=bool)
    rows = _moved(position, *(stands for stands in (normal, rotation) if stands is not None))
    return GivenPoints(
        source=str(source),
        line=np.array(table.line)[rows],
        position=position[rows],
        normal=None if normal is None else normal[rows],
        rotation=None if rotation is None else rotation[rows],
        feed=feed[rows],
        contact=contact[rows],
        stop=np.logical_or.reduceat(stop, rows),
        read_as=table.notes,
    )


def _moved(*columns: Array) -> IntArray:
    """Rows of which anything is not as in the row before: exports end a curve, and begin the next, at one point."""
    changes = [np.any(np.diff(values.reshape(len(values), -1), axis=0), axis=1) for values in columns]
    return np.flatnonzero(np.append(True, np.any(changes, axis=0)))


def _refuse_left_out(table: CsvTable, source: str | Path, given: Sequence[Sequence[str]]) -> None:
    """Raises InputError for columns of another writer that may be the feed, or else say how the tool stands."""
    left_out = table.recorded.left_out if table.recorded else ()
    fed = [name for name in left_out if FED.fullmatch(name_and_unit(name)[0]) and not table.has("feed_mm_s")]
    if fed:
        key = "feed" if name_and_unit(fed[0])[1] else "feed_mm_s"
        raise InputError(
            f'{source}: column {fed[0]} may be the feed, and is not read; say columns = {{ {key} = "{fed[0]}" }} in '
            f"[path]{', or feed_mm_min,' * (key != 'feed')} or take the column out"
        )
    stands = [name for name in left_out if not given and STANDS.fullmatch(name_and_unit(name)[0])]
    if len(stands) > 2:
        raise InputError(
            f"{source}: columns {', '.join(stands)} may say how the tool stands, and are not read; give i, j, k or "
            "w_deg, p_deg, r_deg (columns in [path] may name them so), or take these columns out"
        )


def _normals(table: CsvTable) -> Array:
    normal = np.column_stack([table.numbers(c, largest=1e3) for c in NORMAL])
    length = row_norms(normal)
    table.refuse_first(
        np.abs(length - 1) > UNIT,
        "",
        lambda row: f"the normal i, j, k has length {length[row]:.4g}, not 1; divide it by its length",
    )
    return np.asarray(normal / length[:, None])


def _feeds(table: CsvTable) -> Array:
    feed = table.numbers("feed_mm_s", gaps=True)
    low, high = FEEDS
    table.refuse_first(
        (feed < low) | (feed > high),
        "feed_mm_s",
        lambda row: f"{feed[row]:g} mm/s is outside {low:g} to {high:g}; mend it",
    )
    return feed * MM


def _flags(table: CsvTable, column: str) -> BoolArray:
    flag = table.numbers(column)
    table.refuse_first(
        (flag != 0) & (flag != 1), column, lambda row: f"{flag[row]:g} is neither 0 nor 1; give one of them"
    )
    return np.asarray(flag == 1)
