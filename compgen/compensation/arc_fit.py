r"""Circular motions for a corrected path: the fewest arcs and lines that stay within a tolerance of it.

An arc leads through three poses of the dense corrected path. Along its length s from the via, with h half of it, a
curve of curvature kappa(s) = kappa_0 + kappa' s leaves the circle through its three places by

    d(s) = kappa' s (s^2 - h^2) / 6,      |d| <= kappa' h^3 / (9 sqrt(3)) = kappa' L^3 / (72 sqrt(3)),    L = 2 h

in its plane, and by the same with kappa tau for kappa' out of it (torsion tau); a correction c(s) adds its third
derivative c''' to it in the same way. Against a line's kappa L^2 / 8 that is of third order: on a spiral of pitch p
arcs of (72 sqrt(3) chord r^3 / (p / 2 pi))^(1/3) do, of one angle everywhere.

What decides is not this estimate but the deviation itself, sampled between the three places as the twin will: at the
same share of each half's length, once with the places as they are and once as the text rounds them. Rounding moves a
place by at most r = sqrt(3) / 2 digits, and an arc between its places by up to 5/4 r (the Lebesgue constant of three
even places): the first must stay within the chord, the second within the chord and r, which is what lines keep to. Off
the surface, along the tool's axis, half of the chord is allowed. Orientation is taken to turn evenly from the start to
the via and on to the end, and stays within an angle of its own.

How far an arc and a line reach from every few rows is found by bisection, all rows at once; one over the reach is the
density of statements, and each run between two breaks is cut into equal shares of it. What fails the check all the
same gets a higher density.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from compgen.core.arcs import arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, bisected, cumulated, dot, norm, numbered
from compgen.core.pose import Pose
from compgen.core.units import DEG, MM

MAX_ANGLE = 90 * DEG  # of an arc; a controller takes up to 180
MAX_LENGTH = 200 * MM  # of an arc and of a line: what is told by waypoint stays dense enough to be read
MIN_SAGITTA = 10  # last digits by which an arc must bulge from its chord: flatter ones are lines
SAFETY = 0.95  # of the tolerance, for what lies between the samples
NORMAL_SHARE = 0.5  # of the tolerance, for what leads off the surface
SAMPLES = 11  # of the deviation along an arc or a line
TOO_WIDE = 8.0  # in place of the tolerances by which an arc of too large an angle misses
STRIDE = (12, 32)  # rows between two from which the reach is found: of a short path, and of one of a million
LEAST_ROWS = 4  # dense segments of an arc: with fewer the largest deviation lies between its rows, unseen
ROUNDS = 12  # of cutting
BLOCK = 2048  # arcs at a time: they stay in cache
SAME_AXES = 1e-12  # entries of rotations that differ by less are the same


class FittedMoves(NamedTuple):
    """The positions that a program names."""

    rows: IntArray  # (M,) rising, of the dense waypoints
    via: BoolArray  # (M,) the middle of an arc


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class DensePath:
    """N corrected waypoints, as they are and as a text rounds them."""

    arc: Array  # (N,) [m] along the wanted path
    commanded: Pose  # N in World
    printed: Pose  # N in World
    digit: float  # [m] of the text
    chord: float  # [m] largest deviation of an arc or a line
    angle: float  # [rad] largest deviation of its orientation
    turns: bool = field(init=False)  # whether its orientation changes

    def __post_init__(self) -> None:
        axes = self.commanded.rotation
        object.__setattr__(self, "turns", bool(np.abs(axes - axes[:1]).max() > SAME_AXES))

    def misses(self, start: IntArray, via: IntArray, end: IntArray) -> Array:
        """By how much of its tolerance each arc through three rows deviates, (M,); over 1 is too far.

        A start that is its own via stands for the straight line to the end; infinite for an arc that is too flat.
        """
        worst = np.empty(len(start))
        straight = via == start
        for of_kind, miss in ((straight, self._lines_miss), (~straight, self._arcs_miss)):
            rows = np.flatnonzero(of_kind)
            for k in range(0, len(rows), BLOCK):
                some = rows[k : k + BLOCK]
                worst[some] = miss(start[some], via[some], end[some])
        return worst

    def _lines_miss(self, start: IntArray, _: IntArray, end: IntArray) -> Array:
        """The same of lines."""
        row = _between(start, end)
        fraction = (self.arc[row] - self.arc[start, None]) / (self.arc[end] - self.arc[start])[:, None]

        def places(pose: Pose) -> tuple[Array, Array]:
            a, b = pose.position[start], pose.position[end]
            return a[:, None] + fraction[..., None] * (b - a)[:, None], np.zeros(len(start))

        return self._worst(row, places, self._turns(start[:, None], row, end[:, None], fraction))

    def _arcs_miss(self, start: IntArray, via: IntArray, end: IntArray) -> Array:
        """The same of arcs."""
        row = _between(start, end)
        second = row >= via[:, None]
        first, last = np.where(second, via[:, None], start[:, None]), np.where(second, end[:, None], via[:, None])
        fraction = (self.arc[row] - self.arc[first]) / (self.arc[last] - self.arc[first])

        def places(pose: Pose) -> tuple[Array, Array]:
            arcs = arcs_through(*(pose.position[rows] for rows in (start, via, end)))
            half = np.diff(arcs.angle, prepend=0.0, axis=1)
            swept = np.where(second, arcs.angle[:, :1] + fraction * half[:, 1:], fraction * half[:, :1])
            flat = ~(arcs.sagitta >= MIN_SAGITTA * self.digit)
            return arcs.at(swept), np.where(flat, np.inf, np.where(arcs.angle[:, 1] > MAX_ANGLE, TOO_WIDE, 0.0))

        return self._worst(row, places, self._turns(first, row, last, fraction))

    def _worst(self, row: IntArray, places: Callable[[Pose], tuple[Array, Array]], turned: Array) -> Array:
        """Of deviations at rows (M, K), of the places as they are and as printed, against what each may, (M,)."""
        chord, height = SAFETY * self.chord, SAFETY * NORMAL_SHARE * self.chord
        rooms = (chord, height), (chord + np.sqrt(3) / 2 * self.digit, height + self.digit / 2)
        wanted, axis = self.commanded.position[row], self.commanded.rotation[row, :, 2]
        worst = turned / self.angle
        for pose, (room, height_room) in zip((self.commanded, self.printed), rooms, strict=True):
            with np.errstate(invalid="ignore"):
                at, least = places(pose)
                off = at - wanted
                largest = np.maximum(norm(off).max(axis=1) / room, np.abs(dot(off, axis)).max(axis=1) / height_room)
                worst = np.maximum(worst, np.maximum(np.where(np.isnan(largest), np.inf, largest), least))
        return np.asarray(worst)

    def _turns(self, first: IntArray, row: IntArray, last: IntArray, fraction: Array) -> Array:
        """Largest angle of the orientation at rows (M, K) from an even turn between first and last, (M,) [rad]."""
        axes = self.commanded.rotation
        if not self.turns:
            return np.zeros(len(row))
        so_far, whole = (_small_turns(axes[first], axes[to]) for to in (row, last))
        return np.asarray(norm(so_far - fraction[..., None] * whole).max(axis=1))


def _between(start: IntArray, end: IntArray) -> IntArray:
    """Rows evenly between two, (M,) each, to (M, K)."""
    return np.rint(start[:, None] + (end - start)[:, None] * np.linspace(0, 1, SAMPLES + 2)[1:-1]).astype(np.int64)


def _small_turns(start: Array, end: Array) -> Array:
    """Rotation vectors from start to end, (..., 3, 3) each, to the fifth power of their angle, (..., 3) [rad]."""
    turn = np.swapaxes(start, -1, -2) @ end
    axial = 0.5 * np.stack(
        [turn[..., 2, 1] - turn[..., 1, 2], turn[..., 0, 2] - turn[..., 2, 0], turn[..., 1, 0] - turn[..., 0, 1]], -1
    )
    square = np.sum(axial * axial, axis=-1, keepdims=True)
    return np.asarray(axial * (1 + square / 6 + 3 * square**2 / 40))


def fit_moves(path: DensePath, ends: BoolArray) -> FittedMoves:
    """The arcs and lines of a dense corrected path.

    Args:
        path: Of N waypoints.
        ends: Where a statement must end, (N,): ends of pieces, stops, edges of the part; true at both ends.

    Returns:
        Rows with every end among them; each run between two ends is all arcs or all lines.
    """
    edge = np.flatnonzero(ends)
    begin, last = edge[:-1], edge[1:]
    samples = _sample_rows(begin, last, int(np.clip(len(path.arc) // 30_000, *STRIDE)))
    run = np.searchsorted(begin, samples, side="right") - 1
    N = len(path.arc)
    reaches = (_reach(path, samples, last[run], arcs=arcs) for arcs in (True, False))
    densities = np.array([_density(path, samples, *reach, run, edge) for reach in reaches])
    count = np.add.reduceat(densities * np.diff(path.arc), begin, axis=1)  # statements that each run needs
    arcs = (2 * np.ceil(count[0]) < np.ceil(count[1])) & (last - begin >= LEAST_ROWS)
    density = np.where(arcs[np.repeat(np.arange(len(begin)), last - begin)], *densities)
    for _ in range(ROUNDS):
        start, end = _cut(path, density, begin, last, np.where(arcs, LEAST_ROWS, 1))
        via = np.where(arcs[np.searchsorted(begin, start, side="right") - 1], _middle(path, start, end), start)
        misses = path.misses(start, via, end)
        bad = np.flatnonzero((misses > 1) & np.isfinite(misses) & (end - start > 1))
        if not len(bad):
            break
        for k, factor in zip(bad.tolist(), np.clip(np.cbrt(misses[bad]), 1.02, 2.0).tolist(), strict=True):
            density[start[k] : end[k]] *= factor
    is_arc = (via > start) & (misses <= 1) & (end - start >= LEAST_ROWS)
    keep, middle = np.zeros(N, dtype=bool), np.zeros(N, dtype=bool)
    keep[start], keep[edge] = True, True
    keep[via[is_arc]] = middle[via[is_arc]] = True
    # what is no arc after all: a line where it does, else as many lines as reach, else lines over each dense waypoint
    long = np.flatnonzero(~is_arc & (end - start > 1))
    bent = np.zeros(len(start), dtype=bool)
    bent[long] = path.misses(start[long], start[long], end[long]) > 1
    of_lines = np.where(np.repeat(bent, end - start), densities[1], 0.0)
    start, end = _cut(path, of_lines, start, end, np.ones(len(start), dtype=np.int64))
    keep[start] = True
    long = np.flatnonzero((end - start > 1) & (of_lines[start] > 0))
    for k in long[path.misses(start[long], start[long], end[long]) > 1].tolist():
        keep[start[k] : end[k] + 1] = True
    rows = np.flatnonzero(keep)
    return FittedMoves(rows, middle[rows])


def _sample_rows(begin: IntArray, last: IntArray, stride: int) -> IntArray:
    """Rows from which the reach is found: the first of each run, and every few rows on."""
    run, step = numbered(np.maximum(1, -(-(last - begin) // stride)))
    return np.asarray(begin[run] + stride * step)


def _middle(path: DensePath, start: IntArray, end: IntArray) -> IntArray:
    """The row nearest to half way, strictly between where there is one."""
    half = (path.arc[start] + path.arc[end]) / 2
    after = np.clip(np.searchsorted(path.arc, half), start + 1, end)
    nearer = np.where(half - path.arc[after - 1] < path.arc[after] - half, after - 1, after)
    return np.asarray(np.where(end - start > 1, np.clip(nearer, start + 1, end - 1), start))


def _reach(path: DensePath, start: IntArray, last: IntArray, *, arcs: bool) -> tuple[IntArray, BoolArray]:
    """The farthest row that an arc, or a line, from each of some rows leads to within its tolerance; and if it does."""
    least = start + (LEAST_ROWS if arcs else 1)
    low = np.minimum(least, last)
    high = np.minimum(last, np.searchsorted(path.arc, path.arc[start] + MAX_LENGTH, side="right") - 1)
    high = np.maximum(high, low)

    def within(rows: IntArray, end: IntArray) -> BoolArray:
        via = _middle(path, start[rows], end) if arcs else start[rows]
        return path.misses(start[rows], via, end) <= 1

    # doubling steps until one is too far, then bisection
    rows, step = np.flatnonzero(low < high), 4
    while len(rows):
        candidate = np.minimum(start[rows] + step, high[rows])
        candidate = np.maximum(candidate, low[rows])
        good = within(rows, candidate)
        # near its start an arc may be too flat although a longer one is not
        low[rows[good]] = candidate[good]
        done = candidate >= high[rows]
        high[rows[~good & ~done]] = np.where(
            low[rows[~good & ~done]] > least[rows[~good & ~done]], candidate[~good & ~done], high[rows[~good & ~done]]
        )
        rows = rows[~done & (good | (low[rows] <= least[rows]))]
        step *= 2
    low = bisected(low, high, within)
    reaches = low > least
    rows = np.flatnonzero(~reaches)
    reaches[rows] = within(rows, low[rows])
    return low, reaches


def _density(
    path: DensePath, start: IntArray, end: IntArray, reaches: BoolArray, run: IntArray, edge: IntArray
) -> Array:
    """Statements a metre on each dense segment, (N - 1,), from how far they reach.

    A reach counts in the middle of its statement; one that the end of its run cuts short, or that is none, says
    nothing, unless no other of the run does. Every run stands for itself.

    Args:
        path: The dense waypoints.
        start: Rows from which the reach is known, (M,).
        end: How far it goes, (M,).
        reaches: Whether a statement leads there within its tolerance, (M,).
        run: In which run each is, (M,) rising; every run has one.
        edge: Rows at which the runs begin, and the end of the last, (R + 1,).
    """
    length = path.arc[end] - path.arc[start]
    worth = np.where(reaches, 1 + (end < edge[run + 1]), 0)
    first = np.flatnonzero(np.append(True, run[1:] != run[:-1]))
    use = worth == np.maximum.reduceat(worth, first)[run]
    at, rate, run = path.arc[start[use]] + length[use] / 2, 1 / np.maximum(length[use], 1e-12), run[use]
    order = np.lexsort((at, run))
    at, rate = at[order], rate[order]
    first = np.flatnonzero(np.append(True, run[1:] != run[:-1]))
    last = np.append(first[1:], len(run)) - 1
    at = np.concatenate([at, path.arc[edge[:-1]], path.arc[edge[1:]]])
    rate, knots = np.concatenate([rate, rate[first], rate[last]]), np.concatenate([run, *2 * [np.arange(len(first))]])
    order = np.lexsort((at, knots))
    return np.asarray(np.interp((path.arc[:-1] + path.arc[1:]) / 2, at[order], rate[order]))


def _cut(
    path: DensePath, density: Array, begin: IntArray, last: IntArray, least: IntArray
) -> tuple[IntArray, IntArray]:
    """First and last row of each statement: equal shares of the density over each run.

    Args:
        path: The dense waypoints.
        density: Statements a metre, (N - 1,).
        begin: First row of each run, (R,).
        last: Last row of each, (R,).
        least: Dense segments that a statement has at least, (R,).
    """
    total = cumulated(density * np.diff(path.arc))
    amount = total[last] - total[begin]
    count = np.clip(np.ceil(amount - 1e-6), 1, np.maximum((last - begin) // least, 1)).astype(np.int64)
    run, step = numbered(count)
    goal = total[begin[run]] + amount[run] * step / count[run]
    row = np.searchsorted(total, goal)
    nearer = (row > 0) & (goal - total[row - 1] < total[np.minimum(row, len(total) - 1)] - goal)
    start = np.where(step == 0, begin[run], row - nearer)
    start = np.unique(np.clip(start, begin[run], last[run] - 1))
    return start, np.append(start[1:], last[-1])
