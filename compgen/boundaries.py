"""Edges of the part: nothing, a circle, or a hexagon; convex, so a straight sweep crosses it once."""

from dataclasses import dataclass

import numpy as np

from compgen.arrays import Array, BoolArray, own

EDGE_M = 1e-9  # a point this near outside still counts as on the edge


@dataclass(frozen=True, eq=False, slots=True)
class Boundary:
    """The points p with normals . p <= offsets and |p| <= radius, about the surface's local origin."""

    normals: Array  # (K, 2)
    offsets: Array  # (K,) [m]
    radius: float  # [m], infinite when there is no circle

    def __post_init__(self) -> None:
        own(self, normals=("K", 2), offsets=("K",))

    def contains(self, xy: Array) -> BoolArray:
        """Whether points lie inside or on the edge, (M, 2) to (M,)."""
        flat = np.all(xy @ self.normals.T <= self.offsets + EDGE_M, axis=1)
        return np.asarray(flat & (np.hypot(xy[:, 0], xy[:, 1]) <= self.radius + EDGE_M))

    def table(self) -> Array:
        """Each side's normal and offset, and the radius, with what still counts as on the edge, (1, 3 K + 1)."""
        sides = np.column_stack([self.normals, self.offsets + EDGE_M])
        return np.append(sides.ravel(), self.radius + EDGE_M)[None]

    def clip(self, y: float) -> tuple[float, float] | None:
        """Where the line at this y enters and leaves [m]; None when it misses."""
        low, high = -np.inf, np.inf
        if np.isfinite(self.radius):
            if abs(y) >= self.radius:
                return None
            high = float(np.sqrt(self.radius**2 - y**2))
            low = -high
        for (nx, ny), offset in zip(self.normals, self.offsets):
            room = float(offset - ny * y)
            if abs(nx) < 1e-12:
                if room < 0:
                    return None
            elif nx > 0:
                high = min(high, room / nx)
            else:
                low = max(low, room / nx)
        return (low, high) if high - low > EDGE_M else None

    def widest(self, y0: float, y1: float) -> tuple[float, float]:
        """Smallest and largest x of the part between two lines that meet it [m]."""
        points = [(x, y) for y in (y0, y1) for x in self.clip(y) or ()]
        points += [(x, y) for x, y in self._extremes() if min(y0, y1) < y < max(y0, y1)]
        return min(x for x, _ in points), max(x for x, _ in points)

    def _extremes(self) -> list[tuple[float, float]]:
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


def unbounded() -> Boundary:
    """No edge: every point is on the part."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), np.inf)


def circle(diameter: float) -> Boundary:
    """A round part."""
    return Boundary(np.zeros((0, 2)), np.zeros(0), diameter / 2)


def hexagon(corner_to_corner: float, rotation: float) -> Boundary:
    """A regular hexagon; at rotation 0 [rad] two corners lie on the x axis."""
    angles = rotation + np.pi / 6 + np.arange(6) * np.pi / 3
    inradius = corner_to_corner / 2 * np.cos(np.pi / 6)
    return Boundary(np.column_stack([np.cos(angles), np.sin(angles)]), np.full(6, inradius), np.inf)
