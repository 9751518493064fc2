r"""A pattern laid onto a mesh: points of its curve, projected along z, with the mesh's normals.

The pattern is sampled every ``step`` of its length, and every ``BEND``, finer where the mesh bends; over (x, y) the
point stands at the mesh's highest z plus the height that the pattern asks for, and the tool against the mesh's normal.
Past the mesh, and over a face that the tool does not work, beyond a step or a sharp edge, it is off the part: height
and normal run on evenly between the places before and after, and no such face may be higher. So that the way does not
bend at the edge itself, and a smooth curve cut the corner there, it leaves the part along its surface: at a length d
behind the edge, off the part over a length L whose first point is at e, it is nearer to the plane of the surface at the
edge, by

    (1 - S((d - e) / D)) (1 - S(d / L))        S(s) = 10 s^3 - 15 s^4 + 6 s^5

of what this is higher; towards the edge where it comes back to the part alike. Of that plane no more than a slope of
``STEEPEST`` is followed.

With slopes p = -n_x / n_z and q = -n_y / n_z of the normals about a place, over a distance e to each side,

    H = (dp/dx  dp/dy)      I = (1 + p^2   p q  )      S = I^-1 H / sqrt(1 + p^2 + q^2)
        (dq/dx  dq/dy)          (p q    1 + q^2)

the larger eigenvalue of S is 1 over the radius of the sharpest hollow there: a tool of a larger radius would not touch
the bottom of it, and cut its sides.
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, lengths_along, numbered, row_norms
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.mesh import SHARP, Mesh, Over, refuse_facing_down
from compgen.planning.own_points.given_points import GivenPoints

MOST_POINTS = 4_000_000
FINEST, COARSEST = 0.1 * MM, 2 * MM  # between points
BEND = 8 * DEG  # between points, that a bend of the pattern is no corner where the robot stops
PER_EDGE = 3  # points over an edge of the mesh
REACH = 2.0  # median edges to each side over which curvature is taken
FLAT = 1e-3  # [1/m] of a hollow that is none
LEAST_STEP = 10 * UM  # that a path within its tolerance does not show
LEAVING = 10 * MM  # behind an edge, over which the way bends
STEEPEST = 2.0  # that it goes down or up there: behind a rounding that ends upright it would fall beside the part
CREASE = 20 * DEG  # that a facet may differ from the mean of its neighbours


class Laid(NamedTuple):
    """A pattern on a mesh."""

    points: GivenPoints
    on_mesh: float  # share of the pattern on the part that the mesh is under
    hollow: float  # [m] radius of the sharpest hollow under the tool; infinite where there is none
    facets: float  # [m] by which flat facets stand off a smooth surface, about, at most


def lay(
    pattern: PiecewiseCurve,
    boundary: Boundary,
    mesh: Mesh,
    shift: Array,
    source: str,
    tolerance: float,
    tool_radius: float,
) -> Laid:
    """Points of a pattern on a mesh.

    Args:
        pattern: Its x and y about the shift, its heights above the mesh.
        boundary: The part's edge about the shift; outside there is no contact.
        mesh: In the frame of the part.
        shift: Of the pattern, (3,) [m].
        source: The mesh's file, for messages.
        tolerance: By which a curve through the points may leave the mesh between them, about [m].
        tool_radius: Of the tool's working face [m]; 0: not to be looked at.

    Raises:
        InputError: The mesh is nowhere under the pattern, is inside out there, has a sharp edge, a step or a hollow
            sharper than the tool under it, or is higher beside it, or the pattern needs too many points.
    """
    step = float(np.clip(mesh.edge_length() / PER_EDGE, FINEST, COARSEST))
    piece, t = _samples(pattern, step, source)
    coarse = pattern.derivatives(piece, t)[0] + shift[:2]
    piece, t = _finer_where_it_bends(piece, t, coarse, mesh, tolerance, source)
    first = np.flatnonzero(np.diff(piece, prepend=-1))
    place, height = pattern.derivatives(piece, t)[0], pattern.height(piece, t)[0]
    xy = place + shift[:2]
    over = mesh.over(xy)
    under = over.facet >= 0
    touching = pattern.working[piece] & boundary.contains(place) & (height <= 0)
    on = touching & under
    refuse_facing_down(mesh, xy, over, np.flatnonzero(touching), lambda row: source)
    if not on.any():
        raise InputError(f"{source}: {_elsewhere(mesh, xy)}")
    lean = np.zeros(len(xy))
    lean[under] = np.arccos(np.clip((mesh.facet_normals(over.facet[under]) * over.normal[under]).sum(axis=1), -1, 1))
    turn, steps = _turns_and_steps(over, under, xy, lean)
    contact = on[1:] & on[:-1]
    _refuse_creases(xy, np.where(contact, turn, 0.0), np.where(on, lean, 0.0), source)
    _refuse_steps(over, xy, steps & contact, source)
    hollow, facets = _sharpest_hollow(mesh, xy[on], source, tool_radius), _off_smooth(mesh, over.facet[on])
    rows, contact, stop = _once_each(first, np.append(on[0], contact), pattern.stop)
    apart = ~(under[1:] & under[:-1]) | (turn > SHARP) | steps | (np.maximum(lean[1:], lean[:-1]) > CREASE)
    part = _part(on, over, height, apart)[rows]
    xy, height, over = xy[rows], height[rows], Over(over.height[rows], over.normal[rows], over.facet[rows])
    u = lengths_along(xy)
    height = height + _heights(over, part, xy, u)
    _refuse_what_stands_above(over, xy, height, part, np.delete(steps, first[1:] - 1), source)
    normal = np.column_stack([_run_on(over.normal[:, k], part, u) for k in range(3)])
    points = GivenPoints(
        source=source,
        line=np.zeros(len(rows), dtype=np.int64),
        position=np.column_stack([xy, height + shift[2]]),
        normal=normal / row_norms(normal)[:, None],
        rotation=None,
        feed=np.full(len(rows), np.nan),
        contact=contact,
        stop=stop,
    )
    return Laid(points, float(on.sum() / touching.sum()), hollow, facets)


def _samples(pattern: PiecewiseCurve, step: float, source: str) -> tuple[IntArray, Array]:
    """Pieces and parameters of points so far apart at most, (M,) each."""
    K = len(pattern.poly)
    middle = np.linspace(0, 1, 9)
    way = pattern.derivatives(np.repeat(np.arange(K), 9), np.tile(middle, K))[1]
    speed, along = row_norms(way).reshape(K, 9), np.unwrap(np.arctan2(way[:, 1], way[:, 0]).reshape(K, 9))
    turns = 8 * np.abs(np.diff(along)).max(axis=1) / BEND
    rise = np.abs(np.diff(pattern.height(np.repeat(np.arange(K), 2), np.tile([0.0, 1.0], K))[0].reshape(K, 2)))[:, 0]
    count = np.maximum(2, np.ceil(np.maximum((speed.max(axis=1) + rise) / step, turns)).astype(np.int64)) + 1
    piece, number = _numbered(count, source)
    return piece, number / (count[piece] - 1)


def _numbered(count: IntArray, source: str) -> tuple[IntArray, IntArray]:
    """``numbered`` counts of points; raises InputError where they are too many."""
    if count.sum() > MOST_POINTS:
        raise InputError(
            f"{source}: the path over it needs {count.sum():.2g} points, more than {MOST_POINTS:.0e}; raise "
            "path.stepover_mm or surface.tolerance_um, or give a coarser mesh"
        )
    return numbered(count)


def _finer_where_it_bends(
    piece: IntArray, t: Array, xy: Array, mesh: Mesh, tolerance: float, source: str
) -> tuple[IntArray, Array]:
    """The points, and others between those where the mesh bends more than a curve through them would show.

    Between two points a distance s apart, at which it turns by a, an edge of the mesh stands off a curve by s a / 8
    about; a distance is at most twice the one beside it, for a curve would run straight along a much longer one.
    """
    over, within = mesh.over(xy), np.diff(piece) == 0
    under = over.facet >= 0
    facing = np.where(under[:, None], mesh.facet_normals(over.facet), 0.0)
    way = np.hypot(row_norms(np.diff(xy, axis=0)), np.nan_to_num(np.diff(over.height)))
    turn = np.arccos(np.clip((facing[1:] * facing[:-1]).sum(axis=1), -1, 1)) * (under[1:] & under[:-1])
    span = np.clip(8 * tolerance / np.maximum(turn, 1e-9), FINEST, np.where(within, np.maximum(way, FINEST), np.inf))
    doublings, farther = np.log2(span), np.cumsum(within)
    doublings = np.minimum.accumulate(doublings - farther) + farther
    doublings = np.minimum.accumulate((doublings + farther)[::-1])[::-1] - farther
    count = np.append(np.where(within, np.maximum(np.ceil(way / 2.0**doublings - 1e-9), 1), 1), 1).astype(np.int64)
    before, number = _numbered(count, source)
    ahead = np.minimum(before + 1, len(t) - 1)
    return piece[before], t[before] + number / count[before] * (t[ahead] - t[before])


def _once_each(first: IntArray, contact: BoolArray, stops: BoolArray) -> tuple[IntArray, BoolArray, BoolArray]:
    """Which samples are kept, and contact and stop at each.

    Where a piece begins the point stands twice: the second is kept, and takes what the way to the first says.

    Args:
        first: The first sample of each piece, (K,).
        contact: On the way to each sample, (M,).
        stops: At the end of each piece, (K,).
    """
    twin, stop = first[1:], np.zeros(len(contact), dtype=bool)
    stop[np.append(twin - 1, len(stop) - 1)] = stops
    contact[twin], stop[twin] = contact[twin - 1], stop[twin - 1]
    rows = np.delete(np.arange(len(stop)), twin - 1)
    return rows, contact[rows], stop[rows]


def _run_on(values: Array, part: BoolArray, u: Array) -> Array:
    """Values of the part, and straight between them along the way u, (M,)."""
    return np.interp(u, u[part], values[part])


def _heights(over: Over, part: BoolArray, xy: Array, u: Array) -> Array:
    """Heights of the part, and beyond it between its edges, which the way u leaves along its surface, (M,) [m]."""
    straight = _run_on(over.height, part, u)
    height = straight.copy()
    for order in (slice(None), slice(None, None, -1)):  # behind an edge that the way leaves, and one that it comes to
        height[order] += _behind_edges(xy[order], over.normal[order], part[order], straight[order])
    return height


def _behind_edges(xy: Array, normal: Array, part: BoolArray, straight: Array) -> Array:
    """What is added to straight heights behind each edge that the way leaves, (M,) [m]."""
    rows, u, M = np.arange(len(xy)), lengths_along(xy), len(xy)
    off = np.flatnonzero(~part & np.logical_or.accumulate(part))
    edge = np.maximum.accumulate(np.where(part, rows, 0))[off]
    again = np.minimum.accumulate(np.where(part, rows, M)[::-1])[::-1][off]
    d, e = u[off] - u[edge], u[edge + 1] - u[edge]
    L = np.append(u, np.inf)[again] - u[edge]
    rise = -((xy[off] - xy[edge]) * normal[edge, :2]).sum(axis=1) / normal[edge, 2]
    plane = straight[edge] + np.clip(rise, -STEEPEST * d, STEEPEST * d)
    added = np.zeros(M)
    added[off] = (1 - _eased((d - e) / LEAVING)) * (1 - _eased(d / np.maximum(L, d))) * (plane - straight[off])
    return added


def _eased(share: Array) -> Array:
    """From 0 to 1 without slope and curvature at both ends."""
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(10 * s**3 - 15 * s**4 + 6 * s**5)


def _turns_and_steps(over: Over, under: BoolArray, xy: Array, lean: Array) -> tuple[Array, BoolArray]:
    """How far the normal turns from places to the next ones [rad], and whether a step lies between, (M - 1,) each.

    On two facets that meet, a way leaves the mean of both normals by what they lean, ``lean`` (M,) [rad] from the
    normals, and half of what they turn at most. What leaves it by more is a face over another, whether with a wall or a
    rounding of less than a way. Without the mesh under both there is neither.
    """
    rows = np.flatnonzero(under[1:] & under[:-1])
    turn, steps = np.zeros(len(xy) - 1), np.zeros(len(xy) - 1, dtype=bool)
    turn[rows] = np.arccos(np.clip((over.normal[rows] * over.normal[rows + 1]).sum(axis=1), -1, 1))
    place = np.column_stack([xy, over.height])
    way, normal = place[rows + 1] - place[rows], over.normal[rows] + over.normal[rows + 1]
    most = np.minimum(np.maximum(lean[rows], lean[rows + 1]) + turn[rows] / 2, CREASE)
    steps[rows] = np.abs((way * normal).sum(axis=1)) / row_norms(normal) > np.sin(most) * row_norms(way) + LEAST_STEP
    return turn, steps


def _refuse_creases(xy: Array, turn: Array, lean: Array, source: str) -> None:
    """Refuses an edge that places lie beside, ``lean`` (M,) from their facets, or that two of them lie across."""
    worst = int(np.argmax(lean))
    sharpest, (x, y) = lean[worst], xy[worst] / MM
    if turn.max(initial=0.0) > SHARP:
        sharpest, (x, y) = turn.max(), xy[np.argmax(turn)] / MM
    if sharpest > CREASE:
        raise InputError(
            f"{source}: a sharp edge under the path at x {x:.1f}, y {y:.1f} mm: facets turn by "
            f"{sharpest / DEG:.0f} deg; keep the path off it ([boundary]), or export a finer mesh"
        )


def _refuse_steps(over: Over, xy: Array, steps: BoolArray, source: str) -> None:
    if steps.any():
        height = np.abs(np.diff(over.height))
        worst = int(np.argmax(np.where(steps, height, 0.0)))
        x, y = xy[worst] / MM
        apart = np.hypot(*(xy[worst + 1] - xy[worst])) / MM
        raise InputError(
            f"{source}: a step or a very small rounding under the path at x {x:.1f}, y {y:.1f} mm: the mesh is "
            f"{height[worst] / MM:.3g} mm higher {apart:.2g} mm further; keep the path off it ([boundary]), or "
            "export one surface"
        )


def _part(on: BoolArray, over: Over, height: Array, apart: BoolArray) -> BoolArray:
    """Where the surface is under the path that the tool works, (M,): no face beyond a step or a sharp edge.

    A way between sweeps, at heights (M,) above 0, may come back to it: what is as high as what the tool works, or lower
    by no more than that height.
    """
    number, worked = np.append(0, np.cumsum(apart)), over.height[on]
    again = (height > 0) & (over.height <= worked.max()) & (over.height + height >= worked.min())
    return np.asarray((over.facet >= 0) & (np.isin(number, number[on]) | again))


def _refuse_what_stands_above(
    over: Over, xy: Array, height: Array, part: BoolArray, steps: BoolArray, source: str
) -> None:
    """Refuses a face that the tool does not work where it is higher than the way, and a step up that is."""
    above = np.where(part, -np.inf, over.height - height)  # NaN off the mesh
    up, down = over.height[1:] - height[:-1], over.height[:-1] - height[1:]
    over_step = steps & part[1:] & part[:-1]
    above[:-1] = np.fmax(above[:-1], np.where(over_step, np.maximum(up, down), -np.inf))
    first = int(np.argmax(above > LEAST_STEP))
    if above[first] > LEAST_STEP:
        x, y = xy[first] / MM
        raise InputError(
            f"{source}: the path runs into the mesh at x {x:.1f}, y {y:.1f} mm, beside what it works: the mesh is "
            f"{above[first] / MM:.3g} mm higher there; keep off it (path.lead_mm, [boundary], process.lift_mm)"
        )


def _sharpest_hollow(mesh: Mesh, xy: Array, source: str, tool_radius: float) -> float:
    """The smallest radius of a hollow under places (M, 2) [m]."""
    e, here, slopes = REACH * mesh.edge_length(), mesh.over(xy), []
    for dx, dy in ((0.0, 0.0), (e, 0.0), (-e, 0.0), (0.0, e), (0.0, -e)):
        there = mesh.over(xy + np.array([dx, dy]))
        way = np.column_stack([np.full((len(xy), 2), [dx, dy]), there.height - here.height])
        mean = here.normal + there.normal
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = -there.normal[:, :2] / there.normal[:, 2:]  # NaN off the mesh
        slope[np.abs((way * mean).sum(axis=1)) > np.sin(CREASE) * row_norms(way) * row_norms(mean)] = np.nan
        slopes.append(slope)  # and on another face
    (p, q), right, left, far, near = slopes[0].T, *slopes[1:]
    hxx, hyx = ((right - left) / (2 * e)).T
    hxy, hyy = ((far - near) / (2 * e)).T
    size = np.sqrt(1 + p * p + q * q)
    metric = np.stack([np.stack([1 + p * p, p * q], 1), np.stack([p * q, 1 + q * q], 1)], 1)
    mixed = (hxy + hyx) / 2
    H = np.stack([np.stack([hxx, mixed], 1), np.stack([mixed, hyy], 1)], 1) / size[:, None, None]
    known = np.flatnonzero(np.isfinite(H).all(axis=(1, 2)))
    if not len(known):
        return np.inf
    S = np.linalg.solve(metric[known], H[known])
    half_trace = (S[:, 0, 0] + S[:, 1, 1]) / 2
    determinant = S[:, 0, 0] * S[:, 1, 1] - S[:, 0, 1] * S[:, 1, 0]
    bend = half_trace + np.sqrt(np.maximum(half_trace**2 - determinant, 0.0))
    worst = int(np.argmax(bend))
    if bend[worst] < FLAT:
        return np.inf
    radius = 1 / float(bend[worst])
    if radius < tool_radius:
        x, y = xy[known[worst]] / MM
        raise InputError(
            f"{source}: the hollow at x {x:.1f}, y {y:.1f} mm has a radius of {radius / MM:.1f} mm, sharper than the "
            f"tool (surface.tool_radius_mm {tool_radius / MM:g}); take a smaller tool, or keep off it ([boundary])"
        )
    return radius


def _off_smooth(mesh: Mesh, facet: IntArray) -> float:
    """About how far facets stand off a smooth surface through their corners [m]: edge times turn along it over 8."""
    rows = np.unique(facet)
    corner, normal = mesh.facet[rows], mesh.normal[rows]
    worst = 0.0
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = mesh.vertex[corner[:, a]] - mesh.vertex[corner[:, b]]
        worst = max(worst, float(np.abs((edge * (normal[:, a] - normal[:, b])).sum(axis=1)).max() / 8))
    return worst


def _elsewhere(mesh: Mesh, xy: Array) -> str:
    """Where the mesh is and where the pattern."""
    low, high = mesh.vertex.min(axis=0)[:2] / MM, mesh.vertex.max(axis=0)[:2] / MM
    first, last = xy.min(axis=0) / MM, xy.max(axis=0) / MM
    size = float((high - low).max())
    slip = "; is it in metres?" if size < 5 else "; move the pattern (path.x_mm, y_mm), or the mesh"
    return (
        f"it is not under the path: it covers x {low[0]:.0f} to {high[0]:.0f}, y {low[1]:.0f} to {high[1]:.0f} mm, the "
        f"path x {first[0]:.0f} to {last[0]:.0f}, y {first[1]:.0f} to {last[1]:.0f}{slip}"
    )
