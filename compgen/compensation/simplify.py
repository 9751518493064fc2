"""The fewest waypoints that a controller needs: of those planned, each as far from the last as the tolerance lets it.

A line between two kept waypoints may leave the true path by no more than the tolerance, what the correction between
them differs from a straight change included. Ends of pieces and stops stay. Where the end of a piece would be nearer
than the controller can follow at feed, the waypoint before moves back half way. All pieces are walked at once.
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, norm
from compgen.planning.toolpath import ToolPath


def kept(path: ToolPath, correction: Array, tolerance: float, shortest: float) -> IntArray:
    """Rows of the waypoints that stay.

    Args:
        path: With N waypoints.
        correction: Of each waypoint's position, (N, 3) [m].
        tolerance: Largest distance of the real TCP from the true path between two waypoints [m].
        shortest: Feed times the interpolation period [m].

    Returns:
        Rising row numbers, with both ends of every piece among them.
    """
    S = len(path.piece)
    ends = np.flatnonzero(np.append(path.piece[1:] != path.piece[:-1], True) | path.stop[1:]) + 1
    begins = np.concatenate([[0], ends[:-1]])
    last = np.repeat(ends, ends - begins)  # of the piece that begins or runs on at each row
    reach = _farthest(path, correction, tolerance, last)

    chosen = [begins]
    at, rows = begins.copy(), np.arange(len(begins))
    before = begins.copy()
    while len(rows):
        before[rows] = at[rows]
        at[rows] = reach[at[rows]]
        chosen.append(at[rows].copy())
        rows = rows[at[rows] < ends[rows]]
    keep = np.zeros(S + 1, dtype=bool)
    keep[np.concatenate(chosen)] = True
    # the last line of a piece: give it half of the one before
    short = np.flatnonzero((path.arc[ends] - path.arc[before] < shortest) & (before > begins))
    if len(short):
        keep[before[short]] = False
        previous = _previous(keep, before[short])
        keep[before[short]] = True
        middle = (path.arc[previous] + path.arc[ends[short]]) / 2
        moved = np.clip(np.searchsorted(path.arc, middle), previous + 1, before[short])
        keep[before[short]] = False
        keep[moved] = True
    return np.flatnonzero(keep)


def _previous(keep: BoolArray, rows: IntArray) -> IntArray:
    """The kept row before each."""
    marked = np.flatnonzero(keep)
    return np.asarray(marked[np.searchsorted(marked, rows) - 1])


def _farthest(path: ToolPath, correction: Array, tolerance: float, last: IntArray) -> IntArray:
    """For each of the S rows that begin a segment, the farthest row of its piece that a line may lead to."""
    S = len(last)
    first = np.arange(S)
    low, high = first + 1, last.copy()  # low is always good: a planned segment
    step = np.ones(S, dtype=np.int64)
    # doubling steps until one is too far, then halving: what is asked stays near the answer
    rows = np.flatnonzero(low < high)
    while len(rows):
        tried = np.minimum(first[rows] + 2 * step[rows], last[rows])
        good = _within(path, correction, first[rows], tried, tolerance)
        low[rows[good]] = tried[good]
        high[rows[~good]] = tried[~good] - 1
        step[rows] *= 2
        rows = rows[good & (tried < last[rows])]
    rows = np.flatnonzero(low < high)
    while len(rows):
        middle = (low[rows] + high[rows] + 1) // 2
        good = _within(path, correction, first[rows], middle, tolerance)
        low[rows[good]] = middle[good]
        high[rows[~good]] = middle[~good] - 1
        rows = rows[low[rows] < high[rows]]
    return low


def _within(path: ToolPath, correction: Array, first: IntArray, last: IntArray, tolerance: float) -> BoolArray:
    """Whether lines between rows of one piece stay within the tolerance, (M,)."""
    span = np.column_stack([path.span[first, 0], path.span[last - 1, 1]])
    chord = path.geometry.chord(path.piece[first], span)
    middle = (first + last) // 2
    share = ((path.arc[middle] - path.arc[first]) / (path.arc[last] - path.arc[first]))[:, None]
    bent = norm(correction[middle] - (1 - share) * correction[first] - share * correction[last])
    return np.asarray(chord + bent <= tolerance)
