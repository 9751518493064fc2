"""Path simplification: the fewest waypoints that a controller needs, within a tolerance.

Greedy, as with an opening window: from each kept waypoint the line goes on to the farthest waypoint of its piece from
which it still leaves the true path by no more than the tolerance, what the correction between them differs from a
straight change included; by half of its sag where lines leave the path to both sides (``ToolPath.balance``); the tool,
which turns evenly along a line, no more than ``AXES`` from how it stands on the path; and no joint turns farther than
``SWING``. (Douglas and Peucker 1973 ask the same of lines between kept points, but divide from the ends.) Ends of
pieces and stops stay.
Lines of whole interpolation periods add up to such. Where the end of a piece would be nearer than the controller can
follow at feed, the waypoint before moves back half way. All pieces are walked at once.
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, bisected, norm
from compgen.core.units import DEG, MDEG
from compgen.planning.toolpath import SIDES, ToolPath

AXES = 10 * MDEG  # of the tool's x and z from an even turn between two waypoints
SWING = 85 * DEG  # of a joint within one line: the twin refuses over 90


def simplify(path: ToolPath, theta: Array, correction: Array, tolerance: float, shortest: float) -> IntArray:
    """Rows of the waypoints that stay.

    Args:
        path: With N waypoints.
        theta: Joints there, (N, 6) [rad].
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
    farthest = _farthest_rows(path, theta, correction, tolerance, last)

    # one walker a piece, all one line further at a time
    visited = [begins]
    current, previous = begins.copy(), begins.copy()
    walking = np.arange(len(begins))
    while len(walking):
        previous[walking] = current[walking]
        current[walking] = farthest[current[walking]]
        visited.append(current[walking].copy())
        walking = walking[current[walking] < ends[walking]]
    keep = np.zeros(S + 1, dtype=bool)
    keep[np.concatenate(visited)] = True
    # a last line that is too short gets half of the one before
    short = np.flatnonzero((path.arc[ends] - path.arc[previous] < shortest) & (previous > begins))
    if len(short):
        keep[previous[short]] = False
        kept = np.flatnonzero(keep)
        start = kept[np.searchsorted(kept, previous[short]) - 1]
        middle = (path.arc[start] + path.arc[ends[short]]) / 2
        keep[np.clip(np.searchsorted(path.arc, middle), start + 1, previous[short])] = True
    return np.flatnonzero(keep)


def _farthest_rows(path: ToolPath, theta: Array, correction: Array, tolerance: float, last: IntArray) -> IntArray:
    """For each of the S rows that begin a segment, the farthest row of its piece that a line may lead to."""
    S = len(last)
    first = np.arange(S)
    low, high = first + 1, last.copy()  # low is always within: a planned segment
    # doubling steps until one is too far, then bisection between it and the last that is not

    def within(rows: IntArray, end: IntArray) -> BoolArray:
        near = _is_within(path, correction, rows, end, tolerance)
        return np.asarray(near & (np.abs(theta[end] - theta[rows]).max(axis=1) <= SWING))

    rows, step = np.flatnonzero(low < high), 2
    while len(rows):
        candidate = np.minimum(first[rows] + step, last[rows])
        good = within(rows, candidate)
        low[rows[good]] = candidate[good]
        high[rows[~good]] = candidate[~good] - 1
        step *= 2
        rows = rows[good & (candidate < last[rows])]
    return bisected(low, high, within)


def _is_within(path: ToolPath, correction: Array, first: IntArray, last: IntArray, tolerance: float) -> BoolArray:
    """Whether lines between rows of one piece stay within the tolerance, (M,)."""
    span = np.column_stack([path.span[first, 0], path.span[last - 1, 1]])
    chord = path.exact.chord(path.piece[first], span)
    middle = (first + last) // 2
    fraction = _fraction(path, first, middle, last)
    bend = norm(correction[middle] - (1 - fraction) * correction[first] - fraction * correction[last])
    near = chord / (SIDES if path.balance.any() else 1.0) + bend <= tolerance
    for row in ((3 * first + last + 3) // 4, middle, (first + 3 * last) // 4):  # one that swings has none in the middle
        near &= _turned(path, first, row, last) <= AXES
    return np.asarray(near)


def _fraction(path: ToolPath, first: IntArray, row: IntArray, last: IntArray) -> Array:
    """Share of the way from first to last at which a row is, (M, 1)."""
    return np.asarray((path.arc[row] - path.arc[first]) / (path.arc[last] - path.arc[first]))[:, None]


def _turned(path: ToolPath, first: IntArray, row: IntArray, last: IntArray) -> Array:
    """Largest angle of the tool's x and z axes at a row from an even turn between first and last, (M,) [rad]."""
    axes, fraction = path.target.rotation[:, :, ::2], _fraction(path, first, row, last)[..., None]
    here = axes[row]
    gap = here - (1 - fraction) * axes[first] - fraction * axes[last]
    gap -= (gap * here).sum(axis=1, keepdims=True) * here  # along the axis a chord is shorter than its arc
    return np.asarray(np.sqrt((gap**2).sum(axis=1)).max(axis=1))
