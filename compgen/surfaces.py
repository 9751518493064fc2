r"""Surfaces that a tool path lies on: plane, sphere and conic asphere are one thing, a quadric.

In the local frame (origin on the surface, z along the normal there) a point p = (x, y, z) is on the surface when

    F(p) = p^T A p + b^T p = 0,        normal n = g / |g|,   g = 2 A p + b.

Given x and y, z is the root near zero of a2 z^2 + a1 z + a0 = 0, written so that nothing cancels.
"""

from dataclasses import dataclass

import numpy as np

from compgen.arrays import Array, dot, own
from compgen.exceptions import InputError


@dataclass(frozen=True, eq=False, slots=True)
class Quadric:
    """A surface placed in the base frame with its local axes parallel to the base axes."""

    origin: Array  # (3,) [m] where the local origin stands in the base frame
    A: Array  # (3, 3) [1/m]
    b: Array  # (3,) [-]

    def __post_init__(self) -> None:
        own(self, origin=(3,), A=(3, 3), b=(3,))

    def height(self, xy: Array) -> Array:
        """z over local (x, y), (M, 2) to (M,) [m].

        Raises:
            InputError: The surface does not extend to a point.
        """
        x, y = xy[:, 0], xy[:, 1]
        A, b = self.A, self.b
        a0 = A[0, 0] * x * x + A[1, 1] * y * y + 2 * A[0, 1] * x * y + b[0] * x + b[1] * y
        a1 = b[2] + 2 * (A[0, 2] * x + A[1, 2] * y)
        under_root = a1 * a1 - 4 * A[2, 2] * a0
        if np.any(under_root < 0) or np.any(a1 <= 0):
            raise InputError("surface: it ends inside the path; raise radius_of_curvature_m or make the path smaller")
        return np.asarray(-2 * a0 / (a1 + np.sqrt(under_root)))

    def gradient(self, p: Array) -> Array:
        """g = 2 A p + b, (M, 3)."""
        return np.asarray(2 * p @ self.A + self.b)

    def lift(self, xy: Array, height: Array) -> tuple[Array, Array]:
        """Base position at a height above the surface, and the normal there, (M, 3) [m] and (M, 3)."""
        p = np.column_stack([xy, self.height(xy)])
        g = self.gradient(p)
        n = g / np.linalg.norm(g, axis=1, keepdims=True)
        return self.origin + p + height[:, None] * n, n

    def along(self, xy: tuple[Array, Array, Array], height: tuple[Array, Array]) -> tuple[Array, Array]:
        r"""First and second derivative of the lifted point along a plane curve.

        With g . p' = 0 and g . p'' + 2 p'^T A p' = 0 on the surface, and n' = (g' - n (n . g')) / |g|, g' = 2 A p':

            P' = p' + h' n + h n',        P'' = p'' (at height zero, or where the plane curve stands still)

        Args:
            xy: Plane curve and its first two derivatives, (M, 2) each [m].
            height: h and h', (M,) each [m].

        Returns:
            P' and P'', (M, 3) each [m].
        """
        p = np.column_stack([xy[0], self.height(xy[0])])
        g = self.gradient(p)
        slope = -(g[:, 0] * xy[1][:, 0] + g[:, 1] * xy[1][:, 1]) / g[:, 2]
        p1 = np.column_stack([xy[1], slope])
        bend = 2 * dot(p1 @ self.A, p1)
        p2 = np.column_stack([xy[2], -(g[:, 0] * xy[2][:, 0] + g[:, 1] * xy[2][:, 1] + bend) / g[:, 2]])
        size = np.linalg.norm(g, axis=1, keepdims=True)
        n = g / size
        g1 = 2 * p1 @ self.A
        n1 = (g1 - n * dot(n, g1)[:, None]) / size
        return p1 + height[1][:, None] * n + height[0][:, None] * n1, p2


def plane(origin: Array) -> Quadric:
    """The plane z = const through the origin."""
    return Quadric(origin, np.zeros((3, 3)), np.array([0.0, 0.0, 1.0]))


def conic(origin: Array, radius_of_curvature: float, conic_constant: float, off_axis: float) -> Quadric:
    r"""A segment of a concave conic asphere, standing on the point at the off-axis distance.

    The parent, vertex at zero, opening upwards, with radius of curvature R and conic constant k:

        z - (x^2 + y^2 + (1 + k) z^2) / (2 R) = 0

    The segment's local frame stands at (rho, 0, z(rho)) of the parent with z along the normal there and x in the
    meridian plane, away from the parent's axis. k = 0 is a sphere, k = -1 a paraboloid.

    Args:
        origin: Where the segment's centre stands in the base frame, (3,) [m].
        radius_of_curvature: R [m], > 0.
        conic_constant: k [-].
        off_axis: rho [m], >= 0.

    Raises:
        InputError: The parent does not reach the off-axis distance.
    """
    R, k, rho = radius_of_curvature, conic_constant, off_axis
    root = 1 - (1 + k) * (rho / R) ** 2
    if root <= 0:
        raise InputError(f"surface.off_axis_m: {rho} lies beyond the parent surface; make it smaller")
    p0 = np.array([rho, 0.0, rho**2 / (R * (1 + np.sqrt(root)))])
    parent_A = -np.diag([1.0, 1.0, 1.0 + k]) / (2 * R)
    g0 = 2 * parent_A @ p0 + np.array([0.0, 0.0, 1.0])
    n = g0 / np.linalg.norm(g0)
    local = np.column_stack([np.cross([0.0, 1.0, 0.0], n), [0.0, 1.0, 0.0], n])
    return Quadric(origin, local.T @ parent_A @ local, local.T @ g0)
