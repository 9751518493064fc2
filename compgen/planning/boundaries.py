"""Edges of the part: nothing, a circle, or a hexagon; convex, so a straight sweep crosses it once."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, own
from compgen.core.evaluation import evaluate

EDGE_M = 1e-9  # a point this near outside still counts as on the edge


@dataclass(frozen=True, eq=False, slots=True)
class Boundary:
    """The points p with normals . p <= offsets and |p| <= radius, about the surface's local origin."""

    normals: Array  # (K, 2)
    offsets: Array  # (K,) [m]
    radius: float  # [m], infinite when there is no circle

    def __post_init__(self) -> None:
        own(self, normals=("K", 2), offsets=("K",))

    def coefficients(self) -> Array:
        """Each side's normal and offset, and the radius, (1, 3 K + 1), as ``inside_distance_expr`` takes them."""
        sides = np.column_stack([self.normals, self.offsets + EDGE_M])
        return np.append(sides.ravel(), self.radius + EDGE_M)[None]

    def contains(self, xy: Array) -> BoolArray:
        """Whether points lie inside or on the edge, (M, 2) to (M,)."""
        return np.asarray(evaluate(_build_inside_distance(len(self.normals)), self.coefficients(), xy)[0][:, 0] >= 0)

    def clip(self, y: Array | float) -> Array:
        """x at which lines of constant y enter and leave the part, (...) to (..., 2) [m]; NaN where a line misses."""
        y = np.asarray(y, dtype=float)
        low, high, meets = np.full(y.shape, -np.inf), np.full(y.shape, np.inf), np.full(y.shape, True)
        if np.isfinite(self.radius):
            high = np.sqrt(np.maximum(self.radius**2 - y**2, 0.0))
            low = -high
        for (nx, ny), offset in zip(self.normals, self.offsets):
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
        pairs = zip(self.normals, np.roll(self.normals, -1, axis=0), self.offsets, np.roll(self.offsets, -1))
        corners = [np.linalg.solve(np.array([a, b]), np.array([c, d])) for a, b, c, d in pairs]
        return [(float(x), float(y)) for x, y in corners]

    def circumradius(self) -> float:
        """Radius of the circle about the centre that holds the whole part [m]."""
        if not len(self.normals):
            return self.radius
        return float(min(self.radius, self.offsets.max() / np.cos(np.pi / len(self.normals))))

    def half_height(self) -> float:
        """Largest |y| inside [m]."""
        if not len(self.normals):
            return self.radius
        angles = np.arctan2(self.normals[:, 1], self.normals[:, 0]) + np.pi / len(self.normals)
        return float(min(self.radius, self.circumradius() * np.abs(np.sin(angles)).max()))


def inside_distance_expr(edge: Any, xy: Any) -> Any:
    """How far a point (2, 1) lies inside a boundary of these coefficients [m]: negative outside."""
    distance = edge[-1] - ca.norm_2(xy)
    for k in range(edge.numel() // 3):
        distance = ca.fmin(distance, edge[3 * k + 2] - ca.dot(edge[3 * k : 3 * k + 2], xy))
    return distance


@lru_cache(maxsize=4)
def _build_inside_distance(sides: int) -> Any:
    """(boundary (3 sides + 1), point (2)) -> distance inside."""
    edge, xy = ca.SX.sym("edge", 3 * sides + 1), ca.SX.sym("xy", 2)
    return ca.Function("inside_distance", [edge, xy], [inside_distance_expr(edge, xy)])


def unbounded() -> Boundary:
    """No edge: every point is on the part."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), np.inf)


def circle(diameter: float) -> Boundary:
    """A round part of a diameter [m]."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), diameter / 2)


def hexagon(corner_to_corner: float, rotation: float) -> Boundary:
    """A regular hexagon, corner to corner [m]; at rotation 0 [rad] two corners lie on the x axis."""
    angles = rotation + np.pi / 6 + np.arange(6) * np.pi / 3
    inradius = corner_to_corner / 2 * np.cos(np.pi / 6)
    return Boundary(np.column_stack([np.cos(angles), np.sin(angles)]), np.full(6, inradius), np.inf)
