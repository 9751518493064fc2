r"""A smooth curve through given points: cubic splines of place and tilt over the way between them.

Between two stops, with u the length along the points' chords and v(u) = (x, y, h, g) place, height and tilt,

    through = "points"       v is the cubic spline (not a knot at the ends) through every point
    through = "tolerance"    v minimises sum_m |v(u_m) - v_m|^2 over cubic splines with few knots; a knot is put into
                             the middle of every stretch that leaves a point by more than the tolerance, until none does

so that place and tilt, their slopes and their curvature run on. The robot stops where the file says so and where the
points turn more sharply than ``corner``. A span over four times as long as its neighbours is drawn as a straight line:
points are put onto it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline, CubicHermiteSpline, CubicSpline
from scipy.linalg import solveh_banded

from compgen.core.arrays import Array, BoolArray, IntArray, row_norms
from compgen.planning.curves import CUBIC, DEGREE, SEGMENTS, PiecewiseCurve, join

FIRST_KNOTS = 32  # points from knot to knot, to begin with
ROUNDS = 40  # of knots that are put in
STIFFNESS = 1e-9  # share of the second differences, so that stretches without points of their own are straight
LONG = 4.0  # times its neighbours, from where a span is a straight line
WINDOW = 10.0  # tolerances over which the direction of points is taken: below it is noise


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How near the curve comes to the points; ``exact`` goes through every one."""

    place: float  # [m]
    tilt: float  # [rad]
    corner: float  # [rad] from where a turn between points is a corner
    exact: bool


@dataclass(frozen=True, eq=False, slots=True)
class LocalPoints:
    """M points in the local frame of a surface."""

    place: Array  # (M, 3) [m] x, y along the surface and the height above it
    tilt: Array  # (M, 3) Gibbs vector of the tool in its own axes
    contact: BoolArray  # (M,) on the way to each
    stop: BoolArray  # (M,)
    pace: Array  # (M,) share of the feed on the way to each

    def at(self, rows: IntArray | slice) -> "LocalPoints":
        """Some of the points."""
        return LocalPoints(*(getattr(self, name)[rows] for name in LocalPoints.__slots__))


@dataclass(frozen=True, eq=False, slots=True)
class SpaceCurve:
    """A curve along points, and what it made of them."""

    curve: PiecewiseCurve
    corners: int  # where the points turn sharply and the robot stops, beside the stops that were asked for
    bulge: float  # [m] by which it leaves the lines between points at most, in their middles


def space_curve(points: LocalPoints, tolerance: Tolerance) -> SpaceCurve:
    """The curve along points, in their order; its pieces end at stops and where contact or pace change, at least."""
    sharp = corners(points.place, tolerance)
    stop = points.stop | sharp
    stop[[0, -1]] = True
    ends = np.flatnonzero(stop)
    runs = [_run(points.at(slice(a, b + 1)), tolerance) for a, b in zip(ends.tolist(), ends[1:].tolist())]
    return SpaceCurve(
        join(*(piece for piece, _ in runs)), int((sharp & ~points.stop).sum()), max(bulge for _, bulge in runs)
    )


def corners(place: Array, tolerance: Tolerance) -> BoolArray:
    """Where the way turns more sharply than a corner, (M,): between the chords to points outside the noise."""
    u = _way(place)
    M, reach = len(u), 0.0 if tolerance.exact else WINDOW * tolerance.place
    inner = np.arange(1, M - 1)
    before = np.minimum(np.searchsorted(u, u[inner] - reach, side="right") - 1, inner - 1)
    after = np.maximum(np.searchsorted(u, u[inner] + reach), inner + 1)
    inwards = place[inner] - place[np.maximum(before, 0)]
    outwards = place[np.minimum(after, M - 1)] - place[inner]
    cosine = np.einsum("ij,ij->i", inwards, outwards) / (row_norms(inwards) * row_norms(outwards))
    sharp = np.zeros(M, dtype=bool)
    angle = np.zeros(M)
    angle[1:-1] = np.arccos(np.clip(cosine, -1, 1))
    # of neighbours that see the same corner, the sharpest
    peak = (angle[1:-1] >= angle[:-2]) & (angle[1:-1] >= angle[2:])
    sharp[1:-1] = (angle[1:-1] > tolerance.corner) & (peak if reach > 0 else True)
    return sharp


def _way(place: Array) -> Array:
    """Length along the chords, (M,) [m]."""
    return np.concatenate([[0.0], np.cumsum(row_norms(np.diff(place, axis=0)))])


def _run(points: LocalPoints, tolerance: Tolerance) -> tuple[PiecewiseCurve, float]:
    """The pieces between two stops, and their bulge [m]."""
    points = _with_straights(points)
    u = _way(points.place)
    values = np.column_stack([points.place, points.tilt])
    # on the way to a point: what changes after point m changes at it
    edge = np.flatnonzero((np.diff(points.contact[1:]) != 0) | (np.diff(points.pace[1:]) != 0)) + 1
    if len(u) <= CUBIC or tolerance.exact:
        knots, v, slope = u, values, _interpolated_slopes(u, values)
    else:
        knots, v, slope = _fitted(u, values, np.union1d(edge, [0, len(u) - 1]), tolerance)
    owner = np.searchsorted(u, knots[1:]) if len(knots) < len(u) else np.arange(1, len(u))
    middle = CubicHermiteSpline(knots, v[:, :3], slope[:, :3])((u[:-1] + u[1:]) / 2)
    bulge = float(row_norms(middle - (points.place[:-1] + points.place[1:]) / 2).max())
    return _pieces(knots, v, slope, points.contact[owner], points.pace[owner]), bulge


def _with_straights(points: LocalPoints) -> LocalPoints:
    """The points with others on long spans, at distances that double from both ends on."""
    step = row_norms(np.diff(points.place, axis=0))
    if len(step) < 2:
        return points
    before, after = np.append(np.inf, step[:-1]), np.append(step[1:], np.inf)
    longer = np.flatnonzero(step > LONG * np.minimum(before, after))
    if not len(longer):
        return points
    where, row = [np.arange(len(step) + 1, dtype=float)], [np.arange(len(step) + 1)]
    for s in longer.tolist():
        shares = np.union1d(_doubling(before[s] / step[s]), 1 - _doubling(after[s] / step[s]))
        where.append(s + shares)
        row.append(np.full(len(shares), s + 1))
    position = np.concatenate(where)
    order = np.argsort(position, kind="stable")
    position, to = position[order], np.concatenate(row)[order]
    index = np.arange(len(step) + 1)

    def drawn(values: Array) -> Array:
        return np.column_stack([np.interp(position, index, column) for column in values.T])

    added = position != np.round(position)
    stop = points.stop[to] & ~added
    return LocalPoints(drawn(points.place), drawn(points.tilt), points.contact[to], stop, points.pace[to])


def _doubling(first: float) -> Array:
    """Shares of a span: first, then twice as far each, below a half."""
    if not np.isfinite(first):
        return np.zeros(0)
    return np.asarray(first * 2.0 ** np.arange(max(0, int(np.ceil(np.log2(0.5 / first))))))


def _interpolated_slopes(u: Array, values: Array) -> Array:
    """dv/du of the cubic spline through all values."""
    return np.asarray(CubicSpline(u, values)(u, 1))


def _fitted(u: Array, values: Array, fixed: IntArray, tolerance: Tolerance) -> tuple[Array, Array, Array]:
    """Knots, and values and slopes there, of a spline with few knots that keeps to the tolerance.

    Args:
        u: (M,) [m].
        values: (M, 6).
        fixed: Rows that are knots, both ends among them.
        tolerance: Of place and tilt.
    """
    M = len(u)
    rows = np.union1d(fixed, np.arange(0, M, FIRST_KNOTS))
    for _ in range(ROUNDS):
        v, slope, error = _least_squares(u, values, rows)
        beyond = np.maximum(row_norms(error[:, :3]) / tolerance.place, 2 * row_norms(error[:, 3:]) / tolerance.tilt) > 1
        if not beyond.any():
            return u[rows], v, slope
        stretch = np.clip(np.searchsorted(rows, np.flatnonzero(beyond), side="right") - 1, 0, len(rows) - 2)
        bad = np.unique(np.concatenate([stretch, stretch[beyond[rows[stretch]]] - 1]))  # at a knot: both its sides
        bad = bad[(bad >= 0) & (rows[np.minimum(bad + 1, len(rows) - 1)] - rows[np.maximum(bad, 0)] > 1)]
        if not len(bad):
            break
        rows = np.union1d(rows, (rows[bad] + rows[bad + 1]) // 2)
    return u, values, _interpolated_slopes(u, values)


def _least_squares(u: Array, values: Array, rows: IntArray) -> tuple[Array, Array, Array]:
    """Values and slopes at knots u[rows], and the error at all points, of the spline nearest to them.

    It is turned and shifted, evenly along the way, so that its ends are the points' own.
    """
    knots = u[rows]
    t = np.concatenate([np.repeat(knots[0], CUBIC), knots, np.repeat(knots[-1], CUBIC)])
    basis = BSpline.design_matrix(u, t, CUBIC)
    n = basis.shape[1]
    normal = (basis.T @ basis).todia()
    band = np.zeros((CUBIC + 1, n))
    for k in range(CUBIC + 1):
        band[k, : n - k] = normal.diagonal(-k)
    difference = np.array([1.0, -2.0, 1.0])
    for first, second in ((a, b) for a in range(3) for b in range(a + 1)):
        band[first - second, second : second + n - 2] += STIFFNESS * difference[first] * difference[second]
    spline = BSpline(t, solveh_banded(band, basis.T @ values, lower=True), CUBIC)
    error = spline(u) - values
    start, end = error[0], error[-1]
    share = ((u - u[0]) / (u[-1] - u[0]))[:, None]
    shift = start + share * (end - start)
    slope = spline(knots, 1) - (end - start) / (u[-1] - u[0])
    return spline(knots) - shift[rows], slope, error - shift


def _pieces(knots: Array, v: Array, slope: Array, contact: BoolArray, pace: Array) -> PiecewiseCurve:
    """Pieces from values and slopes at K + 1 knots: the cubic of each, with t from 0 to 1."""
    h = np.diff(knots)[:, None]
    p0, p1, m0, m1 = v[:-1], v[1:], h * slope[:-1], h * slope[1:]
    cubic = np.stack([p0, m0, 3 * (p1 - p0) - 2 * m0 - m1, 2 * (p0 - p1) + m0 + m1], axis=1)
    K = len(cubic)
    poly = np.zeros((K, DEGREE + 1, 2))
    poly[:, : CUBIC + 1] = cubic[:, :, :2]
    stop = np.zeros(K, dtype=bool)
    stop[-1] = True
    least = np.full(K, -(-SEGMENTS // K))
    return PiecewiseCurve(poly, np.zeros((K, 4)), cubic[:, :, 2], stop, contact, cubic[:, :, 3:], pace, least)
