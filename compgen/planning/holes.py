"""Holes in the part, in any outline: polygons, round ones, slots; none crosses an edge or another, or lies in one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.polygons import crossing, edges_of
from compgen.planning.boundaries import EDGE_M, Boundary, ring_of, unbounded


def ring_hole(corners: Array, name: str) -> Boundary:
    """A polygon of corners (C, 2) [m] in a part without an outline; refused as ``ring_of`` says."""
    return replace(unbounded(), edges=edges_of(ring_of(corners, name)))


def slot_hole(length: float, width: float) -> Boundary:
    """Round at both ends, so long along x and so wide overall [m]; as long as wide it is round."""
    reach = (length - width) / 2
    return replace(unbounded(), slots=np.array([[-reach, 0.0, reach, 0.0, width / 2]]))


def moved(hole: Boundary, by: Array) -> Boundary:
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
