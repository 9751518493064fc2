r"""Given lines and arcs as a path: kept as they are, corners rounded within the tolerance, a stop where that cannot be.

At a corner between two ways u = dX/ds and v behind it, with curvatures k_u and k_v, the ways end a length d before and
begin a length d behind it. Between them x and y run over a polynomial of degree five that has place, direction and
curvature of both ways at its ends; height and tilt over a cubic B-spline whose control points lie on both ways. It
leaves the ways, and the corner, by

    3/16 d |v - u| + 0.011 d^2 |k_v - k_u|

at most (the first is exact for lines; the second the largest difference of polynomial and ways that touch), and the
tilt, whose slopes over the length differ by w, by d w / 6. d is the length at which one of these reaches its tolerance,
no more than 0.4 of the shorter way, or a quarter of a radius. A rounding shorter than ``SHORTEST`` to each side cannot
be said in a program's digits: the robot stops there, and where it turns by more than ``SHARPEST``. Where the way turns
so little that any smooth motion through the waypoints stays within the tolerance, nothing is rounded: a CAM file's
short blocks stay as they are.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, numbered, row_norms
from compgen.core.units import DEG, UM
from compgen.planning.curves import CUBIC, DEGREE, PiecewiseCurve
from compgen.planning.exact_path import MAX_SPACING
from compgen.planning.own_points.given_points import GivenArcs
from compgen.planning.own_points.space_curve import NO_BULGE, LocalPoints, SpaceCurve, Tolerance

SHORTEST = 20 * UM
SHARPEST = 150 * DEG
BENDS, TOUCHES, TILTS = 3 / 16, 0.011, 1 / 6  # shares of d |v - u|, d^2 |k_v - k_u|, d w
FLAT = 8.0  # tolerances: a smooth motion through waypoints L apart that turn by a leaves lines by a L / 8
KEPT = 0.95  # of the tolerance, for what is of higher order
OF_LENGTH, OF_RADIUS = 0.4, 0.25  # of the shorter way, and of a radius, that a rounding takes at most
DUST = 1e-9  # share of a way
PER_TURN = 4  # pieces of an arc's whole turn at least
QUINTIC = 5
#: of a uniform cubic B-spline: a piece's polynomial from four control points
B_SPLINE = np.array([[1.0, 4.0, 1.0, 0.0], [-3.0, 0.0, 3.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]]) / 6
#: of a polynomial of degree five: its coefficients from place, first and second derivative at both ends
HERMITE = np.linalg.inv(
    np.array(
        [
            [1, 0, 0, 0, 0, 0],
            [0, 1, 0, 0, 0, 0],
            [0, 0, 2, 0, 0, 0],
            [1, 1, 1, 1, 1, 1],
            [0, 1, 2, 3, 4, 5],
            [0, 0, 2, 6, 12, 20],
        ],
        dtype=float,
    )
)

#: coefficients of p(t / 2) and of p((1 + t) / 2) from those of p(t)
FIRST_HALF = np.diag(0.5 ** np.arange(QUINTIC + 1))
SECOND_HALF = np.array([[comb(i, k) * 0.5**i for i in range(QUINTIC + 1)] for k in range(QUINTIC + 1)])


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Ways:
    """W lines and arcs, or helices, from point to point of local points."""

    start: Array  # (W, 3) [m]
    step: Array  # (W, 3) [m] from start to end
    centre: Array  # (W, 2) [m] of arcs
    radius: Array  # (W, 2) [m] at both ends; 0 of lines
    angle: Array  # (W,) [rad] at the start of arcs
    swept: Array  # (W,) [rad]; 0 of lines
    tilt: Array  # (W, 3) at the start
    turn: Array  # (W, 3) change of the tilt

    @property
    def length(self) -> Array:
        """Of each, (W,) [m]."""
        flat = np.where(self.swept != 0, np.abs(self.swept) * self.radius.mean(axis=1), row_norms(self.step[:, :2]))
        return np.hypot(flat, self.step[:, 2])

    def at(self, rows: IntArray, share: Array) -> tuple[Array, Array, Array]:
        """Place, direction and curvature at a share of the length of some of them, (M, 3) [m], (M, 3), (M, 3) [1/m]."""
        length = self.length[rows][:, None]
        place, slope = self.start[rows] + share[:, None] * self.step[rows], self.step[rows] / length
        bend = np.zeros_like(place)
        swept, growth = self.swept[rows], np.diff(self.radius[rows], axis=1)[:, 0]
        radius, angle = self.radius[rows, 0] + share * growth, self.angle[rows] + share * swept
        out = np.column_stack([np.cos(angle), np.sin(angle)])
        across = np.column_stack([-out[:, 1], out[:, 0]])
        arc = np.flatnonzero(swept)
        spin = (swept[:, None] / length)[arc]
        place[arc, :2] = self.centre[rows][arc] + radius[arc, None] * out[arc]
        slope[arc, :2] = growth[arc, None] / length[arc] * out[arc] + radius[arc, None] * spin * across[arc]
        bend[arc, :2] = (
            2 * growth[arc, None] / length[arc] * spin * across[arc] - radius[arc, None] * spin**2 * out[arc]
        )
        return place, slope, bend


def line_path(points: LocalPoints, arcs: GivenArcs | None, tolerance: Tolerance) -> SpaceCurve:
    """The lines and arcs along points, in their order, with their corners rounded within the tolerance.

    Args:
        points: In the local frame of a plane.
        arcs: Which of the ways are arcs, in the same frame.
        tolerance: Of place and tilt; turns sharper than its corner are stops.
    """
    ways = _ways(points, arcs)
    reach, sharp = _roundings(ways, tolerance, points.stop[1:-1])
    length = ways.length
    before, after = np.append(0.0, reach) / length, 1 - np.append(reach, 0.0) / length
    contact, pace = points.contact[1:], points.pace[1:]
    rounded = np.flatnonzero(reach > 0)
    poly, polar, cubics = _rounded_corners(ways, rounded, reach[rounded])
    way, share = _parts_of_ways(ways, before, after)
    line_poly, line_polar, line_cubics = _pieces_of_ways(ways, way, share)
    # a corner's halves belong to the ways before and behind it, in whose order all pieces stand
    owner = np.concatenate([way, rounded, rounded + 1])
    place = np.concatenate([share[:, 0], np.full(len(rounded), 2.0), np.full(len(rounded), -1.0)])
    order = np.lexsort([place, owner])
    owner = owner[order]
    cubic = np.concatenate([line_cubics, cubics])[order]
    stop = np.zeros(len(order), dtype=bool)
    last = np.append(owner[1:] != owner[:-1], True)
    stop[last] = np.append(points.stop[1:-1] | sharp, True)
    curve = PiecewiseCurve(
        poly=np.concatenate([line_poly, poly])[order],
        polar=np.concatenate([line_polar, polar])[order],
        lift=cubic[..., 0],
        stop=stop,
        working=contact[owner],
        tilt=cubic[..., 1:],
        pace=pace[owner],
        least=np.ones(len(order), dtype=np.int64),
    )
    return SpaceCurve(curve, int((sharp & ~points.stop[1:-1]).sum()), NO_BULGE)


def _ways(points: LocalPoints, arcs: GivenArcs | None) -> _Ways:
    place, step = points.place, np.diff(points.place, axis=0)
    swept = np.zeros(len(step)) if arcs is None else arcs.swept[1:]
    centre = np.zeros((len(step), 2)) if arcs is None else arcs.centre[1:]
    out = place[:-1, :2] - centre, place[1:, :2] - centre
    radius = np.column_stack([row_norms(out[0]), row_norms(out[1])])
    radius[swept == 0] = 0.0
    angle = np.arctan2(out[0][:, 1], out[0][:, 0])
    return _Ways(
        start=place[:-1],
        step=step,
        centre=centre,
        radius=radius,
        angle=angle,
        swept=swept,
        tilt=points.tilt[:-1],
        turn=np.diff(points.tilt, axis=0),
    )


def _roundings(ways: _Ways, tolerance: Tolerance, stop: BoolArray) -> tuple[Array, BoolArray]:
    """How far roundings reach to each side of the W - 1 inner points [m], 0 without; and which are sharp."""
    rows, length = np.arange(len(ways.swept) - 1), ways.length
    _, u, k_u = ways.at(rows, np.ones(len(rows)))
    _, v, k_v = ways.at(rows + 1, np.zeros(len(rows)))
    turn, bend = row_norms(v - u), row_norms(k_v - k_u)
    w = row_norms(ways.turn[1:] / length[1:, None] - ways.turn[:-1] / length[:-1, None])
    place, tilt = KEPT * tolerance.place, KEPT * tolerance.tilt / 2  # a Gibbs vector is half the angle
    first = BENDS * turn
    with np.errstate(divide="ignore"):
        allowed = np.minimum(2 * place / (first + np.sqrt(first**2 + 4 * TOUCHES * bend * place)), tilt / (TILTS * w))
    angle = 2 * np.arcsin(np.clip(turn / 2, 0, 1))
    sharp = (allowed < SHORTEST) | (angle > min(SHARPEST, tolerance.corner))
    apart = np.minimum(np.maximum(length[:-1], length[1:]), MAX_SPACING)  # of waypoints there, at most
    flat = (angle * apart < FLAT * place) & (w * apart < FLAT * tilt)
    half = OF_LENGTH * np.minimum(length[:-1], length[1:])
    radius = np.where(ways.swept != 0, ways.radius.min(axis=1), np.inf)
    reach = np.minimum(np.minimum(allowed, half), OF_RADIUS * np.minimum(radius[:-1], radius[1:]))
    return np.where(sharp | stop | flat, 0.0, reach), sharp


def _parts_of_ways(ways: _Ways, before: Array, after: Array) -> tuple[IntArray, Array]:
    """What roundings leave of the ways, arcs in parts of a quarter turn: the way of each, and its shares, (K, 2)."""
    left = np.maximum(after - before, 0.0)
    count = np.where(left > DUST, np.maximum(np.ceil(np.abs(ways.swept) * left * PER_TURN / (2 * np.pi)), 1), 0)
    count = count.astype(np.int64)
    way, number = numbered(count)
    step = left[way] / count[way]
    begin = before[way] + number * step
    return way, np.column_stack([begin, np.where(number + 1 == count[way], after[way], begin + step)])


def _pieces_of_ways(ways: _Ways, way: IntArray, share: Array) -> tuple[Array, Array, Array]:
    """Polynomials (K, 8, 2), polar parts (K, 4), and cubics of height and tilt (K, 4, 4) of parts of ways."""
    begin, size = share[:, 0], share[:, 1] - share[:, 0]
    poly, polar, cubics = (
        np.zeros((len(way), DEGREE + 1, 2)),
        np.zeros((len(way), 4)),
        np.zeros((len(way), CUBIC + 1, 4)),
    )
    is_arc = ways.swept[way] != 0
    start, step = ways.start[way] + begin[:, None] * ways.step[way], size[:, None] * ways.step[way]
    poly[:, 0] = np.where(is_arc[:, None], ways.centre[way], start[:, :2])
    poly[:, 1] = np.where(is_arc[:, None], 0.0, step[:, :2])
    growth = np.diff(ways.radius[way], axis=1)[:, 0]
    parts = [ways.radius[way, 0] + begin * growth, size * growth]
    parts += [ways.angle[way] + begin * ways.swept[way], size * ways.swept[way]]
    polar[is_arc] = np.column_stack(parts)[is_arc]
    cubics[:, 0] = np.column_stack([start[:, 2], ways.tilt[way] + begin[:, None] * ways.turn[way]])
    cubics[:, 1] = np.column_stack([step[:, 2], size[:, None] * ways.turn[way]])
    return poly, polar, cubics


def _rounded_corners(ways: _Ways, corner: IntArray, reach: Array) -> tuple[Array, Array, Array]:
    """Both halves of roundings, the first halves first, as ``_pieces_of_ways`` has them."""
    length, d = ways.length, reach[:, None]
    one = ways.at(corner, 1 - reach / length[corner])
    two = ways.at(corner + 1, reach / length[corner + 1])
    ends = [scaled[:, :2] for place, slope, bend in (one, two) for scaled in (place, 2 * d * slope, 4 * d**2 * bend)]
    whole = np.einsum("kn,mnc->mkc", HERMITE, np.stack(ends, axis=1))
    poly = np.zeros((2 * len(corner), DEGREE + 1, 2))
    poly[: len(corner), : QUINTIC + 1] = np.einsum("ki,mic->mkc", FIRST_HALF, whole)
    poly[len(corner) :, : QUINTIC + 1] = np.einsum("ki,mic->mkc", SECOND_HALF, whole)
    middle = np.column_stack([ways.start[corner + 1][:, 2], ways.tilt[corner + 1]])
    before, after = (
        np.column_stack([ways.step[w][:, 2], ways.turn[w]]) / length[w, None] for w in (corner, corner + 1)
    )
    control = np.stack([middle - k * d * before for k in (2, 1)] + [middle + k * d * after for k in (0, 1, 2)], axis=1)
    cubics = np.concatenate([np.einsum("ki,mic->mkc", B_SPLINE, control[:, k : k + 4]) for k in (0, 1)])
    return poly, np.zeros((2 * len(corner), 4)), cubics
