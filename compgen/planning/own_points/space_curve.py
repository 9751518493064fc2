r"""A smooth curve through given points: cubic splines of place and tilt over the way between them.

Between two stops, with u the length along the points' chords and v(u) = (x, y, h, g) place, height and tilt,

    through = "points"       v is the cubic spline (not a knot at the ends) through every point
    through = "tolerance"    v minimises sum_m |v(u_m) - v_m|^2 over cubic splines with few knots; knots are put
                             into every stretch that leaves a point by more than the tolerance, until none does

so that place and tilt, their slopes and their curvature run on. Rounding of points along the way is no distance from
the curve: after each fit u_m moves to the foot of the point, and what counts is across. The robot stops where the file
says so and where the points turn more sharply than ``corner``. A span over four times as long as its neighbours is
drawn as a straight line: points are put onto it.

How far the curve leaves the lines between points is measured, and held against what the points' own curvature says.
Where neighbouring points turn to the same side, k the larger of their turns per length but no more than twice the
smaller, their span L may bulge by

    1.05 L / 2 tan(k L / 4),

the rise of an arc over its chord, which a cubic through points 25 deg apart exceeds by 4 % at its ends. A turn that
stands alone, or between turns to other sides, explains nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

from compgen.core.arrays import Array, BoolArray, IntArray, interpolated, lengths_along, numbered, row_norms
from compgen.planning.curves import CUBIC, DEGREE, SEGMENTS, PiecewiseCurve, join

FIRST_KNOTS = 32  # points from knot to knot, to begin with
ROUNDS = 40  # of knots that are put in
MORE = 1.2  # times as many as the fourth root of what a stretch is beyond the tolerance
STIFFNESS = 1e-9  # share of the second differences, so that stretches without points of their own are straight
LONG = 4.0  # times its neighbours, from where a span is a straight line
COARSELY, FINELY = np.arange(1, 4) / 4, np.arange(1, 32) / 32  # shares of a span where its bulge is measured
UNEVEN, NO_ARC = 2.0, 1.05  # times the smaller turn of two neighbours; times an arc's rise
NEARLY = 0.8  # of the largest bulge: such spans are measured finely
CLOSEST = 0.2e-3  # [m] of waypoints that are put in for a turn of the tool: below it is noise
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


class Bulge(NamedTuple):
    """How far a curve leaves the lines between the points that it was laid through."""

    size: float  # [m] largest distance from them
    beyond: float  # [m] largest distance beyond what the points' own curvature explains
    row: int  # the point before that span
    lowest: float  # [m] height of the lowest place of the curve


NO_BULGE = Bulge(0.0, 0.0, 0, np.inf)


@dataclass(frozen=True, eq=False, slots=True)
class SpaceCurve:
    """A curve along points, and what it made of them."""

    curve: PiecewiseCurve
    corners: int  # where the points turn sharply and the robot stops, beside the stops that were asked for
    bulge: Bulge


def space_curve(points: LocalPoints, tolerance: Tolerance) -> SpaceCurve:
    """The curve along points, in their order; its pieces end at stops and where contact or pace change, at least."""
    sharp = corners(points.place, tolerance)
    stop = points.stop | sharp
    stop[[0, -1]] = True
    ends = np.flatnonzero(stop)
    runs = [
        _run(points.at(slice(a, b + 1)), tolerance) for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    ]
    bulges = [bulge._replace(row=bulge.row + first) for (_, bulge), first in zip(runs, ends.tolist(), strict=False)]
    worst = max(bulges, key=lambda bulge: bulge.beyond)
    whole = worst._replace(size=max(b.size for b in bulges), lowest=min(b.lowest for b in bulges))
    return SpaceCurve(join(*(piece for piece, _ in runs)), int((sharp & ~points.stop).sum()), whole)


def corners(place: Array, tolerance: Tolerance) -> BoolArray:
    """Where the way turns more sharply than a corner, (M,): between the chords to points outside the noise."""
    u = lengths_along(place)
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
    # of neighbours within the reach, which see the same corner, the sharpest
    same = np.diff(u) <= reach
    hidden = (same[:-1] & (angle[1:-1] < angle[:-2])) | (same[1:] & (angle[1:-1] < angle[2:]))
    sharp[1:-1] = (angle[1:-1] > tolerance.corner) & ~hidden
    return sharp


def _run(points: LocalPoints, tolerance: Tolerance) -> tuple[PiecewiseCurve, Bulge]:
    """The pieces between two stops, and their bulge."""
    from scipy.interpolate import CubicHermiteSpline  # loaded by runs that need it

    given = points.place
    points, straight = _with_straights(points)
    u = lengths_along(points.place)
    values = np.column_stack([points.place, points.tilt])
    # on the way to a point: what changes after point m changes at it
    edge = np.flatnonzero((np.diff(points.contact[1:]) != 0) | (np.diff(points.pace[1:]) != 0)) + 1
    if len(u) <= CUBIC or tolerance.exact:
        rows, v, slope = np.arange(len(u)), values, _interpolated_slopes(u, values)
    else:
        u, rows, v, slope = _fitted(u, values, np.concatenate([edge, straight, [0, len(u) - 1]]), tolerance)
    knots, owner = u[rows], rows[1:]
    curve = CubicHermiteSpline(knots, v[:, :3], slope[:, :3])
    given_row = np.cumsum(np.isin(np.arange(len(u)), straight, invert=True)) - 1  # the given point at or before each
    bulge = _bulge(curve, u, points.place, _explained(given), given_row[:-1])
    return _pieces(knots, v, slope, points.contact[owner], points.pace[owner], tolerance.tilt), bulge


def _bulge(curve: Callable[..., Array], u: Array, place: Array, explained: Array, given_row: IntArray) -> Bulge:
    """Of a curve over spans between parameters u (M,) of points (M, 3), which are parts of given spans (M - 1,)."""
    off, lowest = _off_lines(curve, u, place, np.arange(len(u) - 1), COARSELY)
    near = np.flatnonzero(off > NEARLY * off.max())
    off[near], low = _off_lines(curve, u, place, near, FINELY)
    beyond = off - explained[given_row]
    worst = int(np.argmax(beyond))
    return Bulge(float(off.max()), max(float(beyond[worst]), 0.0), int(given_row[worst]), min(lowest, low))


def _off_lines(
    curve: Callable[..., Array], u: Array, place: Array, spans: IntArray, shares: Array
) -> tuple[Array, float]:
    """Largest distance of some spans (S,) from their lines (S,) [m], and the lowest height on them [m]."""
    line = place[spans + 1] - place[spans]
    size = np.maximum(np.einsum("si,si->s", line, line), 1e-300)
    off, lowest = np.zeros(len(spans)), float(place[:, 2].min())
    for share in shares.tolist():
        at = curve(u[spans] + share * (u[spans + 1] - u[spans]))
        gap = at - place[spans]
        off = np.maximum(off, row_norms(gap - np.clip(np.einsum("si,si->s", gap, line) / size, 0, 1)[:, None] * line))
        lowest = min(lowest, float(at[:, 2].min(initial=np.inf)))
    return off, lowest


def _explained(place: Array) -> Array:
    """By how much each span may bulge by the curvature of the points themselves, (M - 1,) [m]."""
    length, M = row_norms(np.diff(place, axis=0)), len(place)
    if M < 4:
        return np.zeros(M - 1)
    change = np.diff(np.diff(place, axis=0) / length[:, None], axis=0)
    bend = 2 * np.arcsin(np.clip(row_norms(change) / 2, 0, 1)) / ((length[:-1] + length[1:]) / 2)
    alike = np.einsum("mi,mi->m", change[:-1], change[1:]) > 0
    less, more = np.minimum(bend[:-1], bend[1:]), np.maximum(bend[:-1], bend[1:])
    inner = np.where(alike, np.minimum(more, UNEVEN * less), 0.0)
    bend = np.concatenate([inner[:1], inner, inner[-1:]])
    return np.asarray(NO_ARC * length / 2 * np.tan(np.minimum(bend * length / 4, 1.0)))


def _with_straights(points: LocalPoints) -> tuple[LocalPoints, IntArray]:
    """The points with others on long spans, at distances that double from both ends on, and which rows these are."""
    step = row_norms(np.diff(points.place, axis=0))
    none = np.zeros(0, dtype=np.int64)
    if len(step) < 2:
        return points, none
    before, after = np.append(step[1], step[:-1]), np.append(step[1:], step[-2])  # of an end, its one neighbour
    longer = np.flatnonzero(step > LONG * np.minimum(before, after))
    if not len(longer):
        return points, none
    where, row = [np.arange(len(step) + 1, dtype=float)], [np.arange(len(step) + 1)]
    for s in longer.tolist():
        shares = np.union1d(_doubling(before[s] / step[s]), 1 - _doubling(after[s] / step[s]))
        where.append(s + shares)
        row.append(np.full(len(shares), s + 1))
    position = np.concatenate(where)
    order = np.argsort(position, kind="stable")
    position, to = position[order], np.concatenate(row)[order]
    index = np.arange(len(step) + 1)

    added = position != np.round(position)
    stop = points.stop[to] & ~added
    place, tilt = (interpolated(position, index, values) for values in (points.place, points.tilt))
    return LocalPoints(place, tilt, points.contact[to], stop, points.pace[to]), np.flatnonzero(added)


def _doubling(first: float) -> Array:
    """Shares of a span: first, then twice as far each, so far below a half that those of its other end stay apart."""
    return np.asarray(first * 2.0 ** np.arange(max(0, int(np.ceil(np.log2(0.45 / first))))))


def _interpolated_slopes(u: Array, values: Array) -> Array:
    """dv/du of the cubic spline through all values."""
    from scipy.interpolate import CubicSpline  # loaded by runs that need it

    return np.asarray(CubicSpline(u, values)(u, 1))


def _fitted(u: Array, values: Array, fixed: IntArray, tolerance: Tolerance) -> tuple[Array, IntArray, Array, Array]:
    """Parameters of the points, rows that are knots, values and slopes there: of a spline that keeps to the tolerance.

    Args:
        u: (M,) [m].
        values: (M, 6).
        fixed: Rows that are knots, both ends among them.
        tolerance: Of place and tilt.
    """
    is_knot = _first_knots(u, values[:, :3], tolerance)
    at_ends = np.setdiff1d([1, len(u) - 2], fixed)  # no knot there: as many coefficients as points at most
    is_knot[fixed] = True
    is_knot[at_ends] = False
    for _ in range(ROUNDS):
        rows = np.flatnonzero(is_knot)
        v, slope, error, feet = _least_squares(u, values, rows)
        excess = np.maximum(row_norms(error[:, :3]) / tolerance.place, 2 * row_norms(error[:, 3:]) / tolerance.tilt)
        if excess.max() <= 1:
            return u, rows, v, slope
        u = np.where(
            np.abs(feet - u) + tolerance.place * excess < WINDOW * tolerance.place, feet, u
        )  # far off is no foot
        worst = np.maximum(np.maximum.reduceat(excess[:-1], rows[:-1]), excess[rows[1:]])  # at a knot: both its sides
        parts = np.where(worst > 1, np.ceil(MORE * worst**0.25), 1)  # a cubic's error goes with the fourth power
        parts = np.clip(parts, 1, np.diff(rows)).astype(np.int64)
        if not (parts > 1).any():
            break
        before = is_knot.copy()
        is_knot[_parted(rows, parts)] = True
        is_knot[at_ends] = False
        if (is_knot == before).all():
            break
    return u, np.arange(len(u)), values, _interpolated_slopes(u, values)


def _first_knots(u: Array, place: Array, tolerance: Tolerance) -> BoolArray:
    r"""Where to begin with knots, (M,): every so many points, and more where the way turns.

    A cubic over a length h of an arc that turns by a leaves it by some h a^3 / 384 (a^3 = (curvature h)^3): a stretch
    that turns more than the tolerance allows is cut into as many parts as bring it below.
    """
    M = len(u)
    edges = np.append(np.arange(0, M - 1, FIRST_KNOTS), M - 1)
    length, quarter = np.diff(u[edges]), np.maximum(np.diff(edges) // 4, 1)
    out = place[edges[:-1] + quarter] - place[edges[:-1]]
    back = place[edges[1:]] - place[edges[1:] - quarter]
    cosine = np.einsum("ij,ij->i", out, back) / np.maximum(row_norms(out) * row_norms(back), 1e-300)
    turn = np.arccos(np.clip(cosine, -1, 1)) / 0.75  # between the middles of the first and the last quarter
    parts = np.clip(np.ceil((length * turn**3 / (384 * tolerance.place)) ** 0.25), 1, np.diff(edges)).astype(np.int64)
    is_knot = np.zeros(M, dtype=bool)
    is_knot[_parted(edges, parts)] = True
    is_knot[-1] = True
    return is_knot


def _parted(edges: IntArray, parts: IntArray) -> IntArray:
    """Rows that cut the stretches between edges (K + 1,) into so many parts, (K,), their beginnings among them."""
    owner, step = numbered(parts)
    return np.asarray(edges[owner] + step * np.diff(edges)[owner] // parts[owner])


def _least_squares(u: Array, values: Array, rows: IntArray) -> tuple[Array, Array, Array, Array]:
    """The spline nearest to points at u (M,): values and slopes at knots u[rows], its error across the way, the feet.

    Its ends are the points' own: with knots as often as its degree there, its first and last coefficients.
    """
    from scipy.interpolate import BSpline  # loaded by runs that need it

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
    wanted = basis.T @ values
    for k in range(1, CUBIC + 1):
        wanted[k] -= band[k, 0] * values[0]
        wanted[n - 1 - k] -= band[k, n - 1 - k] * values[-1]
        band[k, 0] = band[k, n - 1 - k] = 0.0
    band[0, [0, -1]], wanted[[0, -1]] = 1.0, values[[0, -1]]
    spline = BSpline(t, solveh_banded(band, wanted, lower=True), CUBIC)
    error, ahead = spline(u) - values, spline(u, 1)[:, :3]
    speed = np.einsum("mi,mi->m", ahead, ahead)
    behind = np.einsum("mi,mi->m", error[:, :3], ahead) / np.where(speed > 0, speed, 1.0)
    error[:, :3] -= behind[:, None] * ahead
    return spline(knots), spline(knots, 1), error, _moved(u, behind)


def _moved(u: Array, behind: Array) -> Array:
    """Parameters (M,) less a part of themselves, still rising: no nearer to a neighbour than half of what they were."""
    gap = np.diff(u)
    room = np.minimum(np.append(gap[:1], gap), np.append(gap, gap[-1:])) / 4
    step = np.clip(behind, -room, room)
    step[[0, -1]] = 0.0
    return np.asarray(u - step)


def _pieces(
    knots: Array, v: Array, slope: Array, contact: BoolArray, pace: Array, tilt_tolerance: float
) -> PiecewiseCurve:
    """Pieces from values and slopes at K + 1 knots: the cubic of each, with t from 0 to 1.

    They have so many waypoints that the tool, which turns evenly from one to the next, keeps to its tolerance [rad];
    none is nearer than ``CLOSEST`` for that.
    """
    h = np.diff(knots)[:, None]
    p0, p1, m0, m1 = v[:-1], v[1:], h * slope[:-1], h * slope[1:]
    cubic = np.stack([p0, m0, 3 * (p1 - p0) - 2 * m0 - m1, 2 * (p0 - p1) + m0 + m1], axis=1)
    K = len(cubic)
    poly = np.zeros((K, DEGREE + 1, 2))
    poly[:, : CUBIC + 1] = cubic[:, :, :2]
    stop = np.zeros(K, dtype=bool)
    stop[-1] = True
    bend = np.maximum(row_norms(2 * cubic[:, 2, 3:]), row_norms(2 * cubic[:, 2, 3:] + 6 * cubic[:, 3, 3:]))
    turning = np.ceil(np.sqrt(bend / (4 * tilt_tolerance)))  # a Gibbs vector is half the angle
    turning = np.minimum(turning, np.maximum(h[:, 0] // CLOSEST, 1))
    least = np.maximum(turning.astype(np.int64), -(-SEGMENTS // K))
    return PiecewiseCurve(
        poly=poly,
        polar=np.zeros((K, 4)),
        lift=cubic[:, :, 2],
        stop=stop,
        working=contact,
        tilt=cubic[:, :, 3:],
        pace=pace,
        least=least,
    )
