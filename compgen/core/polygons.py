"""Plane polygons by their corners: which edges cross, and the area within."""

import numpy as np

from compgen.core.arrays import Array, BoolArray

TINY = 1e-30  # of products of areas: below only rounding tells the side


def edges_of(corner: Array) -> Array:
    """The edges of a ring of corners (E, 2), each from its corner to the next, (E, 4)."""
    return np.hstack([corner, np.roll(corner, -1, axis=0)])


def plane_cross(a: Array, b: Array) -> Array:
    """a x b of plane vectors, (..., 2) to (...)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def crossing(first: Array, second: Array) -> BoolArray:
    """Which edges (A, 4) cross which (B, 4) inside of both, (A, B)."""
    a, b = first[:, None, :2], first[:, None, 2:]
    c, d = second[None, :, :2], second[None, :, 2:]
    of_first = plane_cross(b - a, c - a) * plane_cross(b - a, d - a)
    of_second = plane_cross(d - c, a - c) * plane_cross(d - c, b - c)
    return np.asarray((of_first < -TINY) & (of_second < -TINY))


def turned_lines(lines: Array, angle: float) -> Array:
    """Lines (L, 4) turned about the origin [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(lines.reshape(-1, 2, 2) @ np.array([[c, s], [-s, c]])).reshape(-1, 4)


def signed_area(corner: Array) -> float:
    """Area within corners (E, 2), positive when they run counter-clockwise."""
    return float(plane_cross(corner, np.roll(corner, -1, axis=0)).sum() / 2)
