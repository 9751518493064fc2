r"""Where joints 2 and 3 may stand together: a polygon of the pendant's J2 and J3, outside of which the arm hits itself.

Data sheets draw it as an "interference area": straight edges, not always convex. With x = (J2, J3) of a pose and y_e(x)
the point of edge e nearest to x,

    clearance(x) = +/- min_e |x - y_e(x)| - margin,        + inside, - outside

Around a pose x_0 inside, every edge is kept behind the line through its point nearest to x_0, square to the way there:

    n_e . (x - y_e(x_0)) >= margin,        n_e = (x_0 - y_e(x_0)) / |x_0 - y_e(x_0)|

These half planes hold x_0 and none of the edges' points, and what they share is convex: a straight way in it from x_0
crosses no edge, whether the polygon is convex or not. So small corrections have linear limits, decided by the planned
pose; all that is lost are places that a correction of that size could reach only around a corner.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, norm, owns
from compgen.core.polygons import crossing, edges_of, plane_cross, signed_area

ON_EDGE = 1e-9  # [rad] nearer than this, the way to an edge has no direction: the edge's own normal is taken


class HalfPlanes(NamedTuple):
    """Of N poses and E edges: normal . x >= bound, for x = (J2, J3) [rad]."""

    normal: Array  # (N, E, 2)
    bound: Array  # (N, E) [rad]
    near: BoolArray  # (N, E) edges that count


@dataclass(frozen=True, eq=False, slots=True)
@owns(corner=("E", 2), to_plane=(2, 6), zero=(6,))
class Interference:
    """The polygon that J2 and J3 may be in, corners counter-clockwise."""

    corner: Array  # (E, 2) [rad]
    to_plane: Array  # (2, 6) (J2, J3) = to_plane (theta - zero)
    zero: Array  # (6,) [rad] theta at pendant zero
    margin: float = 0.0  # [rad] kept from the edges

    @classmethod
    def of(cls, corner: Array, pendant_map: Array, pendant_zero: Array) -> "Interference":
        """The polygon of the pendant's J2 and J3, for joints theta = M pendant + theta_0."""
        return cls(corner, np.asarray(np.linalg.inv(pendant_map)[1:3], dtype=float), pendant_zero)

    def plane(self, theta: Array) -> Array:
        """J2 and J3 of the pendant, (N, 2) [rad], of joints (N, 6) [rad]."""
        return np.asarray((theta - self.zero) @ self.to_plane.T)

    def clearance(self, theta: Array) -> Array:
        """How far poses (N, 6) [rad] are inside the polygon, less the margin, (N,) [rad]; negative: outside."""
        x = self.plane(theta)
        distance, inside = np.full(len(x), np.inf), np.zeros(len(x), dtype=bool)
        for a, b in self._edges():
            distance = np.minimum(distance, norm(x - _nearest(x, a, b)))
            if a[1] != b[1]:  # even-odd rule: does a ray to the right pass the edge?
                between = (x[:, 1] < a[1]) != (x[:, 1] < b[1])
                crossing = a[0] + (x[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
                inside ^= between & (x[:, 0] < crossing)
        return np.where(inside, distance, -distance) - self.margin

    def crossed(self, theta: Array) -> BoolArray:
        """Whether the straight way in joints from each pose to the next passes an edge, (N - 1,)."""
        x = self.plane(theta)
        p, q = x[:-1], x[1:]
        crossed = np.zeros(len(p), dtype=bool)
        for a, b in self._edges():
            sides = plane_cross(b - a, p - a), plane_cross(b - a, q - a)
            ends = plane_cross(q - p, a - p), plane_cross(q - p, b - p)
            crossed |= (sides[0] * sides[1] < 0) & (ends[0] * ends[1] < 0)
        return crossed

    def half_planes(self, theta: Array, reach: float) -> HalfPlanes:
        """The half planes about poses (N, 6) [rad] of the edges within a reach [rad] of them."""
        x = self.plane(theta)
        normal, bound, near = [], [], []
        for a, b in self._edges():
            y = _nearest(x, a, b)
            way = x - y
            length = norm(way)
            inward = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
            n = np.where((length > ON_EDGE)[:, None], way / np.maximum(length, ON_EDGE)[:, None], inward)
            normal.append(n)
            bound.append((n * y).sum(axis=1) + self.margin)
            near.append(length < reach + self.margin)
        return HalfPlanes(np.stack(normal, axis=1), np.stack(bound, axis=1), np.stack(near, axis=1))

    def _edges(self) -> list[tuple[Array, Array]]:
        return list(zip(self.corner, np.roll(self.corner, -1, axis=0), strict=True))


def _nearest(x: Array, a: Array, b: Array) -> Array:
    """The points of the edge from a to b nearest to points (N, 2)."""
    along = b - a
    return np.asarray(a + np.clip((x - a) @ along / (along @ along), 0.0, 1.0)[:, None] * along)


def polygon_fault(corner: Array) -> str:
    """What is wrong with a polygon (E, 2), in words; empty when nothing is."""
    if len(corner) < 3:
        return f"{len(corner)} corners enclose nothing; give three or more, or none"
    ahead = np.roll(corner, -1, axis=0)
    same = np.flatnonzero((corner == ahead).all(axis=1))
    if len(same):
        return f"corner {same[0] + 1} and the next are the same; leave one out"
    pairs = np.argwhere(np.triu(crossing(edges_of(corner), edges_of(corner)), 1))
    if len(pairs):
        i, k = pairs[0] + 1
        return f"the edges behind corners {i} and {k} cross; give the corners in their order"
    if abs(signed_area(corner)) < 1e-6:
        return "its corners lie on one line; give those around the area that is allowed"
    return ""
