r"""Surfaces that a tool path lies on: plane, sphere and conic asphere are one thing, a quadric.

In the local frame (origin on the surface, z along the normal there) a point p = (x, y, z) is on the surface when

    F(p) = p^T A p + b^T p = 0,        normal n = g / |g|,   g = 2 A p + b.

Given x and y, z is the root near zero of a2 z^2 + a1 z + a0 = 0, written so that nothing cancels.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.evaluation import evaluate
from compgen.core.exceptions import InputError

LOCAL_ROUNDS = 8  # each leaves the share height / radius of curvature of the one before


@dataclass(frozen=True, eq=False, slots=True)
@owns(origin=(3,), A=(3, 3), b=(3,))
class Quadric:
    """A surface placed in the base frame with its local axes parallel to the base axes."""

    origin: Array  # (3,) [m] where the local origin stands in the base frame
    A: Array  # (3, 3) [1/m]
    b: Array  # (3,) [-]

    def coefficients(self) -> Array:
        """Origin, A row by row and b, (1, 15), as ``lift_expr`` and ``curve_derivatives_expr`` take them."""
        return np.concatenate([self.origin, self.A.ravel(), self.b])[None]

    def lift(self, xy: Array, height: Array) -> tuple[Array, Array]:
        """Base position at a height above the surface at local (x, y), and the normal there, (M, 3) [m] and (M, 3).

        Raises:
            InputError: The surface does not extend to a point.
        """
        position, normal, extent = evaluate(_build_lift(), self.coefficients(), xy, height[:, None])
        check_extent(extent)
        return position, normal

    def local(self, point: Array) -> Array:
        """x, y along the surface and the height above it of points near it, (..., 3) in the base frame [m].

        Raises:
            InputError: The surface does not extend to a point.
        """
        points = np.atleast_2d(point)
        xy, height = points[:, :2] - self.origin[:2], np.zeros(len(points))
        for _ in range(LOCAL_ROUNDS):
            position, normal = self.lift(xy, height)
            gap = points - position
            along = np.einsum("ij,ij->i", gap, normal)
            height = height + along
            xy = xy + (gap - along[:, None] * normal)[:, :2]
        return np.column_stack([xy, height]).reshape(np.shape(point))


def check_extent(extent: Array) -> None:
    """Raises InputError unless the surface extends to all points: ``extent`` of ``lift_expr`` above zero."""
    if not np.all(extent > 0):
        raise InputError("surface: it ends inside the path; raise radius_of_curvature_m or make the path smaller")


def lift_expr(surface: Any, xy: Any, height: Any) -> tuple[Any, Any, Any, Any]:
    """Base position (3, 1) [m], normal (3, 1), local z [m], and extent: above zero where the surface has the point."""
    A, b = ca.reshape(surface[3:12], 3, 3), surface[12:15]
    x, y = xy[0], xy[1]
    a0 = A[0, 0] * x * x + A[1, 1] * y * y + 2 * A[0, 1] * x * y + b[0] * x + b[1] * y
    a1 = b[2] + 2 * (A[0, 2] * x + A[1, 2] * y)
    under_root = a1 * a1 - 4 * A[2, 2] * a0
    z = -2 * a0 / (a1 + ca.sqrt(under_root))
    p = ca.vertcat(xy, z)
    g = 2 * (A @ p) + b
    n = g / ca.norm_2(g)
    extent = ca.if_else(under_root >= 0, a1, -1.0)
    return surface[:3] + p + height * n, n, z, extent


def curve_derivatives_expr(
    surface: Any, xy: tuple[Any, Any, Any], height: tuple[Any, Any, Any]
) -> tuple[Any, Any, Any]:
    r"""First and second derivative of the lifted point along a plane curve, (3, 1) each [m], and the extent.

    With g . p' = 0 and g . p'' + 2 p'^T A p' = 0 on the surface, and n' = (g' - n (n . g')) / |g|, g' = 2 A p':

        P' = p' + h' n + h n',        P'' = p'' + h'' n + 2 h' n' (less h n'', zero on a plane and at height zero)
    """
    A, b = ca.reshape(surface[3:12], 3, 3), surface[12:15]
    _, n, z, extent = lift_expr(surface, xy[0], height[0])
    g = 2 * (A @ ca.vertcat(xy[0], z)) + b
    p1 = ca.vertcat(xy[1], -ca.dot(g[:2], xy[1]) / g[2])
    bend = 2 * ca.dot(p1, A @ p1)
    p2 = ca.vertcat(xy[2], -(ca.dot(g[:2], xy[2]) + bend) / g[2])
    g1 = 2 * (A @ p1)
    n1 = (g1 - n * ca.dot(n, g1)) / ca.norm_2(g)
    return p1 + height[1] * n + height[0] * n1, p2 + height[2] * n + 2 * height[1] * n1, extent


@lru_cache(maxsize=1)
def _build_lift() -> Any:
    """(surface (15), xy (2), height) -> position (3), normal (3), extent."""
    surface, xy, height = ca.SX.sym("surface", 15), ca.SX.sym("xy", 2), ca.SX.sym("h")
    position, normal, _, extent = lift_expr(surface, xy, height)
    return ca.Function("lift", [surface, xy, height], [position, normal, extent])


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
