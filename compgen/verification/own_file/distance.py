r"""How far the flown tool leaves a user's own lines, and how far it misses the places that the file names, in order.

Both ways are walked together: the file's corners are taken in groups some way apart; the flown place nearest to a
group's end, about as far behind the last one's as in the file, ends the flown places that belong to it. Of these the
distance to the lines of their group and its neighbours counts,

    off = max_m min_e |p_m - e|,        missed = max_v min_m |c_v - (p_m p_{m+1})|

so that a pass beside another, or a way there and back, is compared with itself.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, lengths_along, row_norms
from compgen.core.units import MM
from compgen.job.bounds import OwnFile

GROUPS = 5000  # of a file at most
GROUP = 10 * MM  # of its way at least
SLACK = 3 * MM  # of the flown way beyond its group
DRIFT = 0.1  # share of a difference in length that counts as a distance
LEAST, MOST = 0.5, 1.5  # times the length of a group in the file that the flown way to its end is
CELLS = 4_000_000  # distances at a time


class FileDistance(NamedTuple):
    """The largest distances, and at which line of the file."""

    off: float  # [m] of the tool from the lines; of a curve, not looked at: 0
    off_line: int
    missed: float  # [m] of the tool from the places that the file names
    missed_line: int


def distance_from_file(file: OwnFile, place: Array) -> FileDistance:
    """The largest distances of a flown path from a file.

    Args:
        file: As the judge reads it.
        place: Of the tool, without approach and retract, (M, 3) [m] in the frame of the part.
    """
    worst = FileDistance(0.0, int(file.line[0]), 0.0, int(file.line[0]))
    for group in _groups(file.corner, place):
        if file.joined:
            off = _to_lines(place[group.flown], file.corner[group.lines])
            row = int(np.argmax(off))
            if off[row] > worst.off:
                nearest = group.lines.start + _nearest(file.corner[group.lines], place[group.flown][row])
                worst = worst._replace(off=float(off[row]), off_line=int(file.line[nearest]))
        named = group.corners.start + np.flatnonzero(file.given[group.corners])
        missed = _to_lines(file.corner[named], place[group.around])
        if missed.max(initial=0.0) > worst.missed:
            row = int(np.argmax(missed))
            worst = worst._replace(missed=float(missed[row]), missed_line=int(file.line[named[row]]))
    return worst


class _Group(NamedTuple):
    """Rows of corners, and of the flown places that belong to them, and both with what lies next to them."""

    corners: slice
    lines: slice
    flown: slice
    around: slice


def _groups(corner: Array, place: Array) -> Iterator[_Group]:
    way, flown = (lengths_along(p) for p in (corner, place))
    size = max(GROUP, way[-1] / GROUPS)
    first = begin = 0
    while first < len(corner) - 1:
        last = min(max(int(np.searchsorted(way, way[first] + size)), first + 1), len(corner) - 1)
        length = way[last] - way[first]
        since, upto = np.searchsorted(flown, flown[begin] + [LEAST * length, MOST * length + SLACK]).tolist()
        since = min(since, len(place) - 1)
        if last == len(corner) - 1:
            end = len(place) - 1
        else:  # of laps of a small circle, which all are as near, the one that has come as far
            drift = np.abs(flown[since : upto + 1] - flown[begin] - length)
            end = since + int(np.argmin(row_norms(place[since : upto + 1] - corner[last]) + DRIFT * drift))
        yield _Group(
            slice(first, last + 1),
            _with_neighbours(way, first, last),
            slice(begin, end + 1),
            _with_neighbours(flown, begin, end),
        )
        first, begin = last, end


def _with_neighbours(way: Array, first: int, last: int) -> slice:
    """Rows from first to last of places along a way (N,) [m], and those within the slack of them, one more at least."""
    low, high = np.searchsorted(way, [way[first] - SLACK, way[last] + SLACK])
    return slice(max(int(low) - 1, 0), int(high) + 1)


def _nearest(places: Array, point: Array) -> int:
    return int(np.argmin(row_norms(places - point)))


def _to_lines(points: Array, corner: Array) -> Array:
    """Distance of points (P, 3) from the lines from corner to corner (C, 3), (P,) [m]."""
    start, line = corner[:-1], np.diff(corner, axis=0)
    if not len(line):
        return row_norms(points - corner[0])
    size = np.maximum(np.einsum("ci,ci->c", line, line), 1e-30)
    nearest = np.empty(len(points))
    step = max(CELLS // len(line), 1)
    for rows in (slice(k, k + step) for k in range(0, len(points), step)):
        gap = points[rows, None] - start
        share = np.clip(np.einsum("pci,ci->pc", gap, line) / size, 0, 1)
        gap -= share[..., None] * line
        nearest[rows] = np.sqrt(np.einsum("pci,pci->pc", gap, gap).min(axis=1))
    return nearest
