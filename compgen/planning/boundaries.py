"""Edges of the part: nothing, a circle, a hexagon, a rectangle or a polygon; and holes in it.

The outline is convex: what a straight sweep crosses once. Of a polygon that is not, the outline is the hull, and its
notches are holes in that. A point is in one when the ray from it towards +x crosses their edges an odd number of times.
A round hole or a slot is what lies nearer to a line than its radius. Holes neither cross an edge or each other, nor lie
in one another. Sweeps run over the whole outline.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, owns
from compgen.core.evaluation import evaluate
from compgen.core.exceptions import InputError
from compgen.core.polygons import TINY, crossing, edges_of, plane_cross, signed_area, turned_lines

EDGE_M = 1e-9  # a point this near outside still counts as on the edge
MOUTH = 1e-6  # m by which a notch reaches past the hull


@dataclass(frozen=True, eq=False, slots=True)
@owns(normals=("K", 2), offsets=("K",), edges=("E", 4), slots=("S", 5))
class Boundary:
    """The points p with normals . p <= offsets and |p| <= radius, about the surface's local origin."""

    normals: Array  # (K, 2)
    offsets: Array  # (K,) [m]
    radius: float  # [m], infinite when there is no circle
    edges: Array = field(default_factory=lambda: np.zeros((0, 4)))  # (E, 4) [m] x, y to x, y, of notches and holes
    slots: Array = field(default_factory=lambda: np.zeros((0, 5)))  # (S, 5) [m] x, y to x, y, and the radius about it

    def coefficients(self) -> Array:
        """Sides, radius, edges and slots as ``inside_expr`` takes them, (1, 3 K + 1 + 4 E + 5 S)."""
        sides = np.column_stack([self.normals, self.offsets + EDGE_M])
        slots = self.slots - [0, 0, 0, 0, EDGE_M]
        return np.concatenate([sides.ravel(), [self.radius + EDGE_M], self.edges.ravel(), slots.ravel()])[None]

    @property
    def shape(self) -> tuple[int, int, int]:
        """How many sides, edges and slots there are."""
        return len(self.normals), len(self.edges), len(self.slots)

    def contains(self, xy: Array) -> BoolArray:
        """Whether points lie inside or on the edge, (M, 2) to (M,)."""
        return np.asarray(evaluate(_build_inside(self.shape), self.coefficients(), xy)[0][:, 0] >= 0)

    def clip(self, y: Array | float) -> Array:
        """x at which lines of constant y enter and leave the part, (...) to (..., 2) [m]; NaN where a line misses."""
        y = np.asarray(y, dtype=float)
        low, high, meets = np.full(y.shape, -np.inf), np.full(y.shape, np.inf), np.ones(y.shape, dtype=bool)
        if np.isfinite(self.radius):
            high = np.sqrt(np.maximum(self.radius**2 - y**2, 0.0))
            low = -high
        for (nx, ny), offset in zip(self.normals, self.offsets, strict=True):
            remainder = offset - ny * y  # of nx x
            if abs(nx) < 1e-12:
                meets &= remainder >= 0
            elif nx > 0:
                high = np.minimum(high, remainder / nx)
            else:
                low = np.maximum(low, remainder / nx)
        meets &= high - low > EDGE_M
        return np.where(meets[..., None], np.stack([low, high], axis=-1), np.nan)

    def x_range(self, y0: Array | float, y1: Array | float) -> Array:
        """Smallest and largest x of the part between two lines of constant y that meet it, (..., 2) [m]."""
        ends = self.clip(y0), self.clip(y1)
        low, high = np.minimum(ends[0][..., 0], ends[1][..., 0]), np.maximum(ends[0][..., 1], ends[1][..., 1])
        for x, y in self._vertices():
            between = (np.minimum(y0, y1) < y) & (y < np.maximum(y0, y1))
            low, high = np.where(between, np.minimum(low, x), low), np.where(between, np.maximum(high, x), high)
        return np.stack([low, high], axis=-1)

    def _vertices(self) -> list[tuple[float, float]]:
        """Corners, or the circle's points of smallest and largest x."""
        if not len(self.normals):
            return [(-self.radius, 0.0), (self.radius, 0.0)]
        pairs = zip(
            self.normals, np.roll(self.normals, -1, axis=0), self.offsets, np.roll(self.offsets, -1), strict=True
        )
        corners = [np.linalg.solve(np.array([a, b]), np.array([c, d])) for a, b, c, d in pairs]
        return [(float(x), float(y)) for x, y in corners]

    def circumradius(self) -> float:
        """Radius of the circle about the centre that holds the whole part [m]."""
        if not len(self.normals):
            return self.radius
        return float(min(self.radius, max(np.hypot(x, y) for x, y in self._vertices())))

    def y_range(self) -> tuple[float, float]:
        """Smallest and largest y of the part [m]."""
        if not len(self.normals):
            return -self.radius, self.radius
        y = [y for _, y in self._vertices()]
        return max(-self.radius, min(y)), min(self.radius, max(y))

    def turned(self, angle: float) -> "Boundary":
        """The boundary turned about the centre [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        edges, lines = turned_lines(self.edges, angle), turned_lines(self.slots[:, :4], angle)
        slots = np.hstack([lines, self.slots[:, 4:]])
        return Boundary(self.normals @ np.array([[c, s], [-s, c]]), self.offsets, self.radius, edges, slots)


def coefficient_count(shape: tuple[int, int, int]) -> int:
    """Numbers of a boundary of so many sides, edges and slots."""
    return 3 * shape[0] + 1 + 4 * shape[1] + 5 * shape[2]


def inside_expr(edge: Any, xy: Any, shape: tuple[int, int, int]) -> Any:
    """Not negative where a point (2, 1) is on a part of these coefficients, of so many sides, edges and slots.

    It is how far inside the outline, or outside the next slot, the point lies [m]; -1 in notches and other holes.
    """
    sides, edges, slots = shape
    distance = edge[3 * sides] - ca.norm_2(xy)
    for k in range(sides):
        distance = ca.fmin(distance, edge[3 * k + 2] - ca.dot(edge[3 * k : 3 * k + 2], xy))
    for k in range(slots):
        row = edge[3 * sides + 1 + 4 * edges + 5 * k :]
        along, off = row[2:4] - row[:2], xy - row[:2]
        share = ca.fmax(0, ca.fmin(1, ca.dot(off, along) / ca.fmax(ca.dot(along, along), TINY)))
        distance = ca.fmin(distance, ca.norm_2(off - share * along) - row[4])
    if not edges:
        return distance
    outside: Any = 1  # of notches and holes: -1 after each edge crossed an odd number of times
    for k in range(edges):
        x0, y0, x1, y1 = (edge[3 * sides + 1 + 4 * k + i] for i in range(4))
        step = ca.if_else(y1 - y0 == 0, 1, y1 - y0)
        meets = ca.logic_and((y0 > xy[1]) != (y1 > xy[1]), xy[0] < x0 + (xy[1] - y0) / step * (x1 - x0))
        outside = outside * (1 - 2 * meets)
    return ca.if_else(outside > 0, distance, ca.fmin(distance, -1))


@lru_cache(maxsize=4)
def _build_inside(shape: tuple[int, int, int]) -> Any:
    """(boundary, point (2)) -> whether it is inside."""
    edge, xy = ca.SX.sym("edge", coefficient_count(shape)), ca.SX.sym("xy", 2)
    return ca.Function("inside", [edge, xy], [inside_expr(edge, xy, shape)])


def unbounded() -> Boundary:
    """No edge: every point is on the part."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), np.inf)


def round_part(diameter: float) -> Boundary:
    """A round part of a diameter [m]."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), diameter / 2)


def hexagon(corner_to_corner: float, rotation: float) -> Boundary:
    """A regular hexagon, corner to corner [m]; at rotation 0 [rad] two corners lie on the x axis."""
    angles = rotation + np.pi / 6 + np.arange(6) * np.pi / 3
    inradius = corner_to_corner / 2 * np.cos(np.pi / 6)
    return Boundary(np.column_stack([np.cos(angles), np.sin(angles)]), np.full(6, inradius), np.inf)


def rectangle(x_size: float, y_size: float, rotation: float) -> Boundary:
    """A rectangle of two sizes [m]; at rotation 0 [rad] its sides are along x and y."""
    angles = rotation + np.arange(4) * np.pi / 2
    offsets = np.array([x_size, y_size, x_size, y_size]) / 2
    return Boundary(np.column_stack([np.cos(angles), np.sin(angles)]), offsets, np.inf)


def polygon(corners: Array) -> Boundary:
    """A polygon of corners (C, 2) [m] in order round it.

    Raises:
        InputError: As for ``ring_of``; the message begins with "corners_mm".
    """
    from scipy.spatial import ConvexHull  # loaded by runs that need it

    ring = ring_of(corners, "corners_mm")
    on_hull = np.sort(ConvexHull(ring).vertices)
    hull = ring[on_hull]
    along = np.roll(hull, -1, axis=0) - hull
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    nexts = np.append(on_hull[1:], on_hull[0] + len(ring))
    mouths = [(a, b, normal) for a, b, normal in zip(on_hull, nexts, normals, strict=True) if b - a > 1]
    # a notch reaches past the hull, whose edge before it is no part
    notches = [
        np.vstack([ring[np.arange(a, b + 1) % len(ring)], ring[[b % len(ring), a]] + MOUTH * normal])
        for a, b, normal in mouths
    ]
    edges = np.vstack([np.zeros((0, 4)), *(edges_of(corners) for corners in notches)])
    return Boundary(normals, (normals * hull).sum(axis=1), np.inf, edges)


def ring_of(corners: Array, name: str) -> Array:
    """Corners counter-clockwise, without any that lie straight between their neighbours.

    Raises:
        InputError: Fewer than three corners, no area, or edges that cross; the message begins with ``name``.
    """
    if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
        corners = corners[:-1]
    if len(corners) < 3:
        raise InputError(f"{name}: {len(corners)} corners; give three at least")
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    if (np.hypot(*(after - corners).T) < EDGE_M).any():
        raise InputError(f"{name}: a corner stands twice running; leave one out")
    if crossing(edges_of(corners), edges_of(corners)).any():
        raise InputError(f"{name}: its edges cross each other; give the corners in order round it")
    area = signed_area(corners)
    kept = corners[np.abs(plane_cross(corners - before, after - corners)) > EDGE_M * np.hypot(*(after - before).T)]
    if len(kept) < 3 or abs(area) < EDGE_M:
        raise InputError(f"{name}: it has no area; give corners that do not lie on one line")
    return np.array(kept if area > 0 else kept[::-1])


def ring_hole(corners: Array, name: str) -> Boundary:
    """A polygon of corners (C, 2) [m] in a part without an outline; refused as ``ring_of`` says."""
    return replace(unbounded(), edges=edges_of(ring_of(corners, name)))


def slot_hole(length: float, width: float) -> Boundary:
    """Round at both ends, so long along x and so wide overall [m]; as long as wide it is round."""
    reach = (length - width) / 2
    return replace(unbounded(), slots=np.array([[-reach, 0.0, reach, 0.0, width / 2]]))


def moved_hole(hole: Boundary, by: Array) -> Boundary:
    """A hole moved, (2,) [m]."""
    return replace(hole, edges=hole.edges + np.tile(by, 2), slots=hole.slots + np.append(np.tile(by, 2), 0.0))


def pierced(part: Boundary, holes: Sequence[Boundary]) -> Boundary:
    """A part with holes.

    Raises:
        InputError: One is not inside the outline, crosses an edge, or lies in another; begins with "holes.<n>".
    """
    for n, hole in enumerate(holes):
        inside = part.contains(_lines(hole).reshape(-1, 2))
        in_it = any(not hole.contains(_lines(other)[:1, :2]).all() for other in holes[:n])
        if in_it or not inside.any():
            raise InputError(f"holes.{n}: it is not inside the outline, or in another hole; move it, or remove it")
        if not inside.all() or _room(part, _lines(hole)) < hole.slots[:, 4].sum() - EDGE_M:
            raise InputError(f"holes.{n}: it crosses another edge; part them")
        part = replace(part, edges=np.vstack([part.edges, hole.edges]), slots=np.vstack([part.slots, hole.slots]))
    return part


def _lines(hole: Boundary) -> Array:
    """The ring of a hole, or the middle line of a slot, (L, 4) [m]."""
    return np.vstack([hole.edges, hole.slots[:, :4]])


def _room(part: Boundary, lines: Array) -> float:
    """Distance of a hole's lines (L, 4) from what bounds a part, the least [m]; negative where they cross."""
    corners = lines.reshape(-1, 2)
    sides = part.offsets - (part.normals @ corners.T).max(axis=1, initial=-np.inf)
    room = [part.radius - np.hypot(*corners.T).max(), *sides]
    for others, radius in ((part.edges, np.zeros(len(part.edges))), (part.slots[:, :4], part.slots[:, 4])):
        if len(others):
            apart = float((_between(lines, others) - radius).min())
            room.append(-1.0 if crossing(lines, others).any() else apart)
    return float(min(room))


def _between(a: Array, b: Array) -> Array:
    """Distance of lines (A, 4) from lines (B, 4) that do not cross them, (A, B) [m]."""
    return np.minimum(
        np.minimum(_from_line(a[:, None, :2], b), _from_line(a[:, None, 2:], b)),
        np.minimum(_from_line(b[:, None, :2], a), _from_line(b[:, None, 2:], a)).T,
    )


def _from_line(point: Array, line: Array) -> Array:
    """Distance of points (A, 1, 2) from lines (B, 4), (A, B) [m]."""
    along, off = line[:, 2:] - line[:, :2], point - line[:, :2]
    share = np.clip((off * along).sum(axis=2) / np.maximum((along**2).sum(axis=1), EDGE_M**2), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - share[..., None] * along, axis=2))
