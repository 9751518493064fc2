"""Holes in the part, in any outline: polygons, round ones, slots; none crosses an edge or another, or lies in one."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.exceptions import InputError
from compgen.core.polygons import crossing, edges_of, turned_lines
from compgen.planning.boundaries import EDGE_M, Boundary, ring_of, unbounded


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(lines=("L", 4))
class Hole:
    """What lies within lines that close a ring, or nearer than a radius to the one line of a slot."""

    lines: Array  # (L, 4) [m] x, y to x, y
    radius: float  # [m] 0 of a ring

    def turned(self, angle: float) -> "Hole":
        """The hole turned about the middle of the part [rad]."""
        return Hole(lines=turned_lines(self.lines, angle), radius=self.radius)

    def moved(self, by: Array) -> "Hole":
        """The hole moved, (2,) [m]."""
        return Hole(lines=self.lines + np.tile(by, 2), radius=self.radius)

    def in_part(self, part: Boundary) -> Boundary:
        """A part with this hole too."""
        if not self.radius:
            return replace(part, edges=np.vstack([part.edges, self.lines]))
        return replace(part, slots=np.vstack([part.slots, np.append(self.lines[0], self.radius)]))


def ring_hole(corners: Array, name: str) -> Hole:
    """A polygon of corners (C, 2) [m]; refused as ``ring_of`` says."""
    return Hole(lines=edges_of(ring_of(corners, name)), radius=0.0)


def slot_hole(length: float, width: float) -> Hole:
    """Round at both ends, so long along x and so wide overall [m]; as long as wide it is round."""
    reach = (length - width) / 2
    return Hole(lines=np.array([[-reach, 0.0, reach, 0.0]]), radius=width / 2)


def pierced(part: Boundary, holes: Sequence[Hole]) -> Boundary:
    """A part with holes.

    Raises:
        InputError: One is not inside the outline, crosses an edge, or lies in another; begins with "holes.<n>".
    """
    for n, hole in enumerate(holes):
        corners = hole.lines.reshape(-1, 2)
        inside = part.contains(corners)
        around = hole.in_part(unbounded())
        in_it = [m for m, other in enumerate(holes[:n]) if not around.contains(other.lines[:1, :2]).all()]
        if in_it or not inside.any():
            raise InputError(f"holes.{n}: it is not inside the outline, or in another hole; move it, or remove it")
        if not inside.all() or _room(part, hole) < hole.radius - EDGE_M:
            raise InputError(f"holes.{n}: it crosses another edge; part them")
        part = hole.in_part(part)
    return part


def _room(part: Boundary, hole: Hole) -> float:
    """Distance of a hole's lines from what bounds a part, the least [m]; negative where they cross."""
    corners = hole.lines.reshape(-1, 2)
    sides = part.offsets - (part.normals @ corners.T).max(axis=1, initial=-np.inf)
    room = [part.radius - np.hypot(*corners.T).max(), *sides]
    for others, radius in ((part.edges, np.zeros(len(part.edges))), (part.slots[:, :4], part.slots[:, 4])):
        if len(others):
            crosses = crossing(hole.lines, others).any()
            room.append(-1.0 if crosses else float((_between(hole.lines, others) - radius).min()))
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
