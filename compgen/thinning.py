r"""Fewer points on a curve, where they stand closer than the controller can follow.

The controller interpolates every period: a segment shorter than feed x period cannot be driven at feed. Points are left
out until no segment is shorter, as far as the line between the points that stay keeps within a tolerance of the curve.
The curve is the cubic spline through all points between two that must stay (stops and corners), so the bulge between
two points counts as well as the points that are gone:

    chord error = largest distance of the spline, at every point and at quarters between, from the line instead

Points go in rounds: each round proposes points that do not touch each other, tries them all at once, and takes those
that keep the tolerance; so the work is a few passes over the points, none of them in Python's own loop.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from compgen.arrays import Array, BoolArray, IntArray, dot, own
from compgen.exceptions import InputError
from compgen.units import UM

TOLERANCE = 1.5 * UM
QUARTERS = 4  # samples of the curve for each of its first segments
SLACK = 1e-9  # of a length, for what rounding makes of it


@dataclass(frozen=True, eq=False, slots=True)
class Thinned:
    """Which points stay, and what that does."""

    keep: BoolArray  # (N,)
    saved: int  # points left out
    short_before: int  # segments below the shortest that can be followed
    short_left: int  # those that stay so: the tolerance allows no more
    chord: float  # [m] largest distance of the curve from the lines, on stretches that lost points

    def __post_init__(self) -> None:
        own(self, keep=("N",))


def thin(arc: Array, position: Array, must_stay: BoolArray, shortest: float, tolerance: float = TOLERANCE) -> Thinned:
    """Leave points out until no segment is shorter than can be followed.

    Args:
        arc: Length along the curve, (N,) [m], rising.
        position: Points, (N, D) [m]: three coordinates, or more where an orientation shall be kept as well, each angle
            times the lever at which it counts.
        must_stay: Stops, corners, and whatever else may not go, (N,); both ends stay.
        shortest: Segments as long as this or longer are left alone [m]: feed x period; infinite leaves out all it can.
        tolerance: Largest chord error [m].

    Returns:
        The points that stay.

    Raises:
        InputError: Arc lengths do not rise, or a tolerance below zero.
    """
    N = len(arc)
    if N and not np.all(np.diff(arc) > 0):
        n = int(np.argmin(np.diff(arc))) + 1
        raise InputError(f"thinning: points {n} and {n + 1} do not rise along the path; remove one")
    if not tolerance >= 0:
        raise InputError(f"thinning: a tolerance of {tolerance:g} m; give zero or more")
    keep = np.ones(N, dtype=bool)
    fixed = np.array(must_stay, dtype=bool)
    if N < 3:
        return Thinned(keep, 0, _short(arc, keep, shortest), _short(arc, keep, shortest), 0.0)
    fixed[[0, -1]] = True
    before = _short(arc, keep, shortest)
    curve = _samples(arc, position, fixed)
    odd = 1
    while odd >= 0:
        gone = _proposed(arc, keep, fixed, shortest, odd)
        keep[gone[_chords(curve, *_around(keep, gone)) <= tolerance]] = False
        odd = 1 if not keep[gone].all() else odd - 1  # the even ones when no odd one can go any more
    stays = np.flatnonzero(keep)
    lost = np.flatnonzero(np.diff(stays) > 1)
    chord = float(_chords(curve, stays[lost], stays[lost + 1]).max(initial=0.0))
    return Thinned(keep, int(N - keep.sum()), before, _short(arc, keep, shortest), chord)


def _short(arc: Array, keep: BoolArray, shortest: float) -> int:
    """How many segments are too short."""
    return int((np.diff(arc[keep]) < shortest * (1 - SLACK)).sum())


def _samples(arc: Array, position: Array, fixed: BoolArray) -> Array:
    """The curve at every point and at the quarters between; point n is row 4 n."""
    N = len(arc)
    share = np.arange(QUARTERS) / QUARTERS
    where = np.append((arc[:-1, None] + np.diff(arc)[:, None] * share).ravel(), arc[-1])
    curve = np.empty((len(where), position.shape[1]))
    ends = np.flatnonzero(fixed)
    for a, b in zip(ends[:-1].tolist(), ends[1:].tolist()):
        rows = slice(QUARTERS * a, QUARTERS * b + 1)
        curve[rows] = CubicSpline(arc[a : b + 1], position[a : b + 1])(where[rows])
    curve[::QUARTERS][:N] = position
    return curve


def _proposed(arc: Array, keep: BoolArray, fixed: BoolArray, shortest: float, odd: int) -> IntArray:
    """Every other point beside a segment that is too short, counted from one that must stay; no two of them touch."""
    stays = np.flatnonzero(keep)
    short = np.diff(arc[stays]) < shortest * (1 - SLACK)
    beside = np.concatenate([[False], short]) | np.concatenate([short, [False]])
    rank = np.arange(len(stays))
    turn = (rank - np.maximum.accumulate(np.where(fixed[stays], rank, 0))) % 2 == odd
    return np.asarray(stays[beside & turn & ~fixed[stays]])


def _around(keep: BoolArray, gone: IntArray) -> tuple[IntArray, IntArray]:
    """The points before and behind each of some points."""
    stays = np.flatnonzero(keep)
    at = np.searchsorted(stays, gone)
    return stays[at - 1], stays[at + 1]


def _chords(curve: Array, start: IntArray, end: IntArray) -> Array:
    """Largest distance of the curve from the line between two points of it, for each pair, (K,) [m]."""
    if not len(start):
        return np.zeros(0)
    count = QUARTERS * (end - start) + 1
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    row = np.arange(int(count.sum())) - np.repeat(first - QUARTERS * start, count)
    a, along = curve[QUARTERS * start], curve[QUARTERS * end] - curve[QUARTERS * start]
    size = np.maximum(dot(along, along), np.finfo(float).tiny)
    off = curve[row] - np.repeat(a, count, axis=0)
    along_each = np.repeat(along, count, axis=0)
    share = np.clip(dot(off, along_each) / np.repeat(size, count), 0, 1)
    off = off - share[:, None] * along_each
    return np.asarray(np.sqrt(np.maximum.reduceat(dot(off, off), first)))
