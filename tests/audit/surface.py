r"""The surface a path lies on: a plane, or a concave conic.

A conic's parent, vertex in the origin and opening upwards, is X^2 + Y^2 + (1 + k) Z^2 - 2 R Z = 0. The part stands on
it at P0 = (rho, 0, Z0), with its z along the normal there and its x away from the parent's axis. Over local x and y the
height is a root of a quadratic, the normal minus the gradient.
"""

from dataclasses import dataclass

import numpy as np

ROUNDS = 6  # each leaves the share height / radius of curvature


@dataclass(frozen=True)
class Surface:
    """A conic, or with an infinite radius the plane, its local origin at a point of the path's frame."""

    origin_mm: np.ndarray  # (3,)
    radius_mm: float = np.inf
    conic: float = 0.0
    off_axis_mm: float = 0.0

    def point_and_normal(self, xyh):
        """Of local x, y along and height above the surface (M, 3): position in the frame (M, 3) [mm], normal (M, 3)."""
        x, y, height = xyh.T
        z, normal = np.zeros(len(x)), np.tile([0.0, 0.0, 1.0], (len(x), 1))
        if np.isfinite(self.radius_mm):
            R, D, rho = self.radius_mm, np.array([1, 1, 1 + self.conic]), self.off_axis_mm
            foot = np.array([rho, 0, rho**2 / (R * (1 + np.sqrt(1 - (1 + self.conic) * (rho / R) ** 2)))])
            up = np.array([-foot[0], 0, R - (1 + self.conic) * foot[2]])
            up /= np.linalg.norm(up)
            axes = np.array([[up[2], 0, -up[0]], [0, 1, 0], up])  # rows: x, y, z of the part in the parent
            q = foot + x[:, None] * axes[0] + y[:, None] * axes[1]
            # the root near zero of a z^2 + b z + c; x and y are tangent at the foot, so that c has no linear terms
            a, b, c = (D * up * up).sum(), 2 * (q * D) @ up - 2 * R * up[2], (D * axes[0] ** 2).sum() * x**2 + y**2
            z = 2 * c / (-b + np.sqrt(b * b - 4 * a * c))
            q = q + z[:, None] * up
            normal = np.column_stack([-q[:, 0], -q[:, 1], R - (1 + self.conic) * q[:, 2]]) @ axes.T
            normal /= np.linalg.norm(normal, axis=1)[:, None]
        return self.origin_mm + np.column_stack([x, y, z]) + height[:, None] * normal, normal

    def local(self, point):
        """x, y and height of points near it, (M, 3) [mm]."""
        xyh = point - self.origin_mm
        xyh[:, 2] = 0
        for _ in range(ROUNDS):
            position, normal = self.point_and_normal(xyh)
            away = point - position
            along = (away * normal).sum(axis=1)
            xyh[:, :2] += (away - along[:, None] * normal)[:, :2]
            xyh[:, 2] += along
        return xyh


def tool_axes(normal, spin):
    """The tool standing on the surface, (M, 3, 3): z into it, x by an angle [rad] from x of the frame."""
    z = -normal
    x = np.array([np.cos(spin), np.sin(spin), 0.0]) - z * (z[:, 0] * np.cos(spin) + z[:, 1] * np.sin(spin))[:, None]
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2)
