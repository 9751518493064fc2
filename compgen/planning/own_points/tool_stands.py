r"""Given points in the local frame of a surface: where they stand on it and how the tool is tilted from it.

On the surface the tool's axes are z = -n and x, the spin's direction e less its part along z. Where the file gives a
normal m the tool is built in the same way over m; where it gives W, P, R these are its axes. With R0 the upright tool
and R the one asked for, the tilt is the Gibbs vector of R0^T R,

    g = (S32 - S23, S13 - S31, S21 - S12) / (1 + tr S),      S = R0^T R.
"""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, first_true, row_norms
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.planning.mesh import Mesh, refuse_facing_down
from compgen.planning.own_points.given_points import MAX_TILT, GivenPoints
from compgen.planning.own_points.space_curve import LocalPoints
from compgen.planning.surfaces import Quadric

ALONG_SPIN = 1 * DEG  # a normal nearer than this to the spin's direction leaves no x axis


def place_points(points: GivenPoints, surface: Quadric, spin: float, feed: float) -> LocalPoints:
    """Points of the part's frame in the surface's local one.

    Args:
        points: Their positions count from the surface's origin.
        surface: A plane where the points say how the tool stands.
        spin: The tool's x axis against base x [rad].
        feed: Of the process, where a point gives none [m/s].

    Raises:
        InputError: A tool tilted by more than ``MAX_TILT``, or one that the spin gives no x axis.
    """
    tilt = np.zeros_like(points.position)
    if points.normal is None and points.rotation is None:
        place = surface.local(points.position + surface.origin) if surface.A.any() else points.position
    else:
        place = points.position
        rotation = points.rotation if points.normal is None else _standing(points, spin)
        upright = standing_on(np.array([[0.0, 0.0, 1.0]]), spin)[0]
        tilt = _gibbs(points, upright.T @ rotation)
    pace = np.where(np.isnan(points.feed), 1.0, points.feed / feed)
    return LocalPoints(place, tilt, points.contact, points.stop, pace)


def stand_on_mesh(points: GivenPoints, mesh: Mesh, shift: Array) -> tuple[GivenPoints, Array]:
    """Points with the normals of the mesh over or under them, which their file does not give.

    Args:
        points: Without normals.
        mesh: In the frame of the part.
        shift: Of the points in it, (3,) [m].

    Returns:
        The points, and their distance from the mesh, (M,) [m], below 0 in it.

    Raises:
        InputError: A point that the mesh is nowhere under, or where it is inside out.
    """
    xy = points.position[:, :2] + shift[:2]
    over = mesh.over(xy)
    refuse_facing_down(mesh, xy, over, np.arange(len(xy)), lambda row: f"{points.where(row)}: the mesh (surface.file)")
    off = first_true(over.facet < 0)
    if off is not None:
        x, y = xy[off] / MM
        raise InputError(
            f"{points.where(off)}: the mesh (surface.file) is not under x {x:.1f}, y {y:.1f} mm; give the "
            "points' normals i, j, k, or a larger mesh"
        )
    return replace(points, normal=over.normal), (points.position[:, 2] + shift[2] - over.height) * over.normal[:, 2]


def stand_on_surface(points: GivenPoints, surface: Quadric) -> GivenPoints:
    """Points with the normals of a surface under them, which their file does not give."""
    place = surface.local(points.position + surface.origin)
    return replace(points, normal=surface.lift(place[:, :2], place[:, 2])[1])


def standing_on(normal: Array, spin: float) -> Array:
    """The axes of tools that stand on normals (M, 3), (M, 3, 3)."""
    along = np.array([np.cos(spin), np.sin(spin), 0.0])
    x = along - normal * (normal @ along)[:, None]
    x /= row_norms(x)[:, None]
    return np.stack([x, np.cross(-normal, x), -normal], axis=2)


def _standing(points: GivenPoints, spin: float) -> Array:
    normal = points.normal
    if normal is None:
        raise ValueError("points without normals")
    near = first_true(np.abs(normal @ np.array([np.cos(spin), np.sin(spin), 0.0])) > np.cos(ALONG_SPIN))
    if near is not None:
        raise InputError(
            f"{points.where(near)}: the normal points along the tool's x; keep the path off it, or set tool.spin_deg "
            "90 deg off"
        )
    return standing_on(normal, spin)


def _gibbs(points: GivenPoints, turn: Array) -> Array:
    """Gibbs vectors of rotations (M, 3, 3), (M, 3)."""
    trace = np.einsum("mii->m", turn)
    row = first_true(trace < 1 + 2 * np.cos(MAX_TILT))
    if row is not None:
        angle = np.arccos(np.clip((trace[row] - 1) / 2, -1, 1)) / DEG
        raise InputError(
            f"{points.where(row)}: the tool is turned {angle:.0f} deg from pointing down with its x at tool.spin_deg; "
            f"{MAX_TILT / DEG:.0f} at most: i, j, k point out of the part, W P R are degrees; else set "
            "tool.spin_deg, or give a [frame]"
        )
    axis = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1)
    return np.asarray(axis / (1 + trace)[:, None])
