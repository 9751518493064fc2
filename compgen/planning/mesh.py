r"""A triangle mesh from an STL file, seen along z: how high it is over a place, and which way it faces there.

Corners in one place are one vertex. A corner's normal is the mean, by their areas, of the facets at its vertex that
come one from another over edges of less than ``SHARP``: a wall does not lean the face that it ends at. Over a facet the
normal runs on between those of its corners (Phong 1975), so that a tool that follows it does not jump at other edges.
Facets that face upwards lie in the cells of a grid over x and y: a place asks those of its cell alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, numbered, owns, row_norms
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.polygons import plane_cross
from compgen.core.units import DEG, MM

SHARP = 40 * DEG  # that facets turn by at an edge which parts two faces
UPWARDS = 1e-3  # least z of a normal that counts as facing up: a wall is met by no place
INSIDE = 1e-9  # relative, that a place may lie outside a facet's edge
SAME_HEIGHT = 1e-6  # [m] by which a face below may seem to stand above the edge that it ends at
PER_FACET = 4  # entries of the grid at most, in the mean
MOST_BYTES = 1_500_000_000
HEADER, COUNT = 80, 84  # bytes before the number of triangles, and before the first
LARGEST = 1e5  # mm of a coordinate
RECORD = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
VERTEX = b"vertex"


class Over(NamedTuple):
    """A mesh over M places."""

    height: Array  # (M,) [m] the highest point; NaN where there is none
    normal: Array  # (M, 3) unit, outwards
    facet: IntArray  # (M,) -1 where there is none


@dataclass(frozen=True, eq=False, slots=True)
@owns(vertex=("V", 3), facet=("F", 3), normal=("F", 3, 3))
class Mesh:
    """V vertices and F facets, corners counter-clockwise seen from outside."""

    vertex: Array  # (V, 3) [m]
    facet: IntArray  # (F, 3)
    normal: Array  # (F, 3, 3) unit, at the corners

    @classmethod
    def of_corners(cls, corners: Array) -> "Mesh":
        """Of the corners of F facets, (F, 3, 3) [m]; those without an area are left out."""
        vertex, facet = _joined(corners)
        cross = _cross(vertex, facet)
        real = row_norms(cross) > 0
        facet, cross = facet[real], cross[real]
        face = _faces_at_corners(facet, cross / row_norms(cross)[:, None])
        total: Array = np.column_stack([np.bincount(face, np.repeat(cross[:, k], 3)) for k in range(3)]).astype(float)
        size = row_norms(total)
        normal = total / np.where(size > 0, size, 1.0)[:, None]
        return cls(vertex, facet, normal[face].reshape(-1, 3, 3))

    def facet_normals(self, rows: IntArray | slice = slice(None)) -> Array:
        """Unit normals of facets, (F, 3)."""
        cross = _cross(self.vertex, self.facet[rows])
        return np.asarray(cross / row_norms(cross)[:, None])

    def open_edges(self) -> IntArray:
        """The edges that have no facet, or more than one, on their other side, (E, 2) vertices."""
        ends = np.concatenate([self.facet[:, [0, 1]], self.facet[:, [1, 2]], self.facet[:, [2, 0]]])
        V = len(self.vertex)
        there, back = ends[:, 0] * V + ends[:, 1], ends[:, 1] * V + ends[:, 0]
        rising = np.sort(there)
        first = np.searchsorted(rising, back)
        return np.asarray(ends[(np.searchsorted(rising, back, side="right") - first) != 1])

    def turned(self) -> "Mesh":
        """The same with its facets' other sides outside."""
        return Mesh(self.vertex, self.facet[:, ::-1], -self.normal[:, ::-1])

    def edge_length(self) -> float:
        """The median length of an edge [m]."""
        a, b = self.facet[:, 0], self.facet[:, 1]
        return float(np.median(row_norms(self.vertex[b] - self.vertex[a])))

    def over(self, xy: Array) -> Over:
        """The mesh over places (M, 2) [m]: its highest point there, and its normal.

        Cost: linear in places and facets; the grid has about as many cells as facets in the places' range.
        """
        M = len(xy)
        height, normal, facet_over = np.full(M, -np.inf), np.zeros((M, 3)), np.full(M, -1)
        low, high = xy.min(axis=0), xy.max(axis=0)
        grid = _Grid.of(self, low, high)
        if not len(grid.facets):
            return Over(np.full(M, np.nan), normal, facet_over)
        cell = grid.cell_of(xy)
        left = np.flatnonzero(grid.entries[cell] > 0)
        for k in range(int(grid.entries.max(initial=0))):
            left = left[grid.entries[cell[left]] > k]
            if not len(left):
                break
            facet = grid.facets[grid.first[cell[left]] + k]
            weight, inside = self._weights(facet, xy[left])
            z = np.einsum("mi,mi->m", weight, self.vertex[self.facet[facet], 2])
            higher = inside & (z > height[left])
            rows = left[higher]
            height[rows], facet_over[rows] = z[higher], facet[higher]
            normal[rows] = np.einsum("mi,mij->mj", weight[higher], self.normal[facet[higher]])
        there = facet_over >= 0
        normal[there] /= row_norms(normal[there])[:, None]
        return Over(np.where(there, height, np.nan), normal, facet_over)

    def faces_down(self, xy: Array, height: Array) -> BoolArray:
        """Whether what is on top at places (M, 2) [m] faces down, (M,): above heights (M,) [m] that face up, or NaN."""
        return np.asarray(self.turned().over(xy).height > np.nan_to_num(height, nan=-np.inf) + SAME_HEIGHT)

    def _weights(self, facet: IntArray, xy: Array) -> tuple[Array, BoolArray]:
        """Barycentric weights of places in facets' projections, (M, 3), and whether they are inside."""
        a, b, c = (self.vertex[self.facet[facet, k], :2] for k in range(3))
        weight = np.column_stack([_area(b, c, xy), _area(c, a, xy), _area(a, b, xy)]) / _area(a, b, c)[:, None]
        return weight, np.asarray(weight.min(axis=1) >= -INSIDE)


class _Grid(NamedTuple):
    """Facets by the cells of a grid that their boxes touch."""

    low: Array  # (2,) [m]
    size: float  # [m] of a cell
    shape: tuple[int, int]
    first: IntArray  # of each cell's facets, into ``facets``
    entries: IntArray  # how many each cell has
    facets: IntArray

    @classmethod
    def of(cls, mesh: Mesh, low: Array, high: Array) -> "_Grid":
        """The grid over a range of places, with the facets that face up and reach into it."""
        x, y = (mesh.vertex[:, k][mesh.facet] for k in range(2))
        box = np.column_stack([x.min(axis=1), y.min(axis=1), x.max(axis=1), y.max(axis=1)])
        upward = mesh.facet_normals()[:, 2] > UPWARDS
        rows = np.flatnonzero(upward & (box[:, :2] <= high).all(axis=1) & (box[:, 2:] >= low).all(axis=1))
        extent = np.maximum(high - low, 1e-6)
        size = float(np.sqrt(extent[0] * extent[1] / max(1, len(rows))))
        size = max(size, float(extent.max()) / 4096)
        while True:
            shape = int(extent[0] / size) + 1, int(extent[1] / size) + 1
            lowest = np.clip(((box[rows, :2] - low) / size).astype(np.int64), 0, np.array(shape) - 1)
            highest = np.clip(((box[rows, 2:] - low) / size).astype(np.int64), 0, np.array(shape) - 1)
            across = highest - lowest + 1
            touched = across[:, 0] * across[:, 1]
            if touched.sum() <= PER_FACET * max(len(rows), 256) or shape == (1, 1):
                break
            size *= 1.5
        owner, step = numbered(touched)
        column, row = lowest[owner, 0] + step % across[owner, 0], lowest[owner, 1] + step // across[owner, 0]
        cell = row * shape[0] + column
        order = np.argsort(cell, kind="stable")
        entries = np.bincount(cell, minlength=shape[0] * shape[1])
        return cls(
            low=low,
            size=size,
            shape=shape,
            first=np.cumsum(entries) - entries,
            entries=entries,
            facets=rows[owner[order]],
        )

    def cell_of(self, xy: Array) -> IntArray:
        """The cell of each place, (M,)."""
        at = np.clip(((xy - self.low) / self.size).astype(np.int64), 0, np.array(self.shape) - 1)
        return np.asarray(at[:, 1] * self.shape[0] + at[:, 0])


def _joined(corners: Array) -> tuple[Array, IntArray]:
    """Vertices (V, 3) and the facets' corners among them, (F, 3): corners in one place are one."""
    points = np.ascontiguousarray(corners.reshape(-1, 3) + 0.0)  # minus zero is zero
    order = np.lexsort(points.T[::-1])
    rising = points[order]
    new = np.append(True, (rising[1:] != rising[:-1]).any(axis=1))
    facet = np.empty(len(points), dtype=np.int64)
    facet[order] = np.cumsum(new) - 1
    return rising[new], facet.reshape(-1, 3)


def _cross(vertex: Array, facet: IntArray) -> Array:
    """Normals of facets, twice their areas long, (F, 3) [m2]."""
    a, b, c = (vertex[facet[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _faces_at_corners(facet: IntArray, unit: Array) -> IntArray:
    """A number for each corner, (3 F,): one at a vertex for the facets, of normals (F, 3), that no sharp edge parts."""
    from scipy.sparse import coo_matrix  # loaded by runs that need it
    from scipy.sparse.csgraph import connected_components

    begin, end = facet.ravel(), np.roll(facet, -1, axis=1).ravel()
    at = np.sort(np.column_stack([begin, end]), axis=1)
    corner = np.arange(len(begin)).reshape(-1, 3)
    corners = np.column_stack([corner.ravel(), np.roll(corner, -1, axis=1).ravel()])  # of each edge, by rising vertex
    corners = np.where((begin < end)[:, None], corners, corners[:, ::-1])
    order = np.lexsort(at.T)
    one, other = order[:-1], order[1:]
    smooth = (at[one] == at[other]).all(axis=1)
    smooth &= (unit[one // 3] * unit[other // 3]).sum(axis=1) > np.cos(SHARP)
    ends = corners[one[smooth]].ravel(), corners[other[smooth]].ravel()
    links = coo_matrix((np.ones(len(ends[0]), dtype=bool), ends), shape=(len(begin), len(begin)))
    return np.asarray(connected_components(links, directed=False)[1])


def _area(a: Array, b: Array, c: Array) -> Array:
    """Twice the signed area of triangles in the plane, (M,)."""
    return plane_cross(b - a, c - a)


def refuse_facing_down(mesh: Mesh, xy: Array, over: Over, rows: IntArray, where: Callable[[int], str]) -> None:
    """Refuse a mesh that is inside out, or upside down, under a path.

    Args:
        mesh: In the frame of the part.
        xy: Places, (M, 2) [m].
        over: The mesh over them.
        rows: Of those that the tool touches.
        where: Names the file, and the line where it has one, of a row.

    Raises:
        InputError: What is on top at one of them faces down.
    """
    bad = rows[mesh.faces_down(xy[rows], over.height[rows])]
    if len(bad):
        x, y = xy[bad[0]] / MM
        raise InputError(
            f"{where(int(bad[0]))}: inside out: the triangle on top at x {x:.1f}, y {y:.1f} mm faces down (mirrored, "
            "or upside down?); turn its normals (flip, or reorient faces) and export it again, or turn the part over"
        )


def read_stl(source: str | Path) -> Array:
    """The corners of T triangles, (T, 3, 3) [m], in the file's order and axes; its normals are not looked at.

    Raises:
        InputError: Not readable, cut off, longer than its count says, a facet that is no triangle, a coordinate that is
            no number or beyond 100 m, or no triangle.
    """
    name = str(source)
    content = read_named(source, "give an STL file", MOST_BYTES)
    corners = _ascii(name, content) if _is_ascii(content) else _binary(name, content)
    bad = np.flatnonzero(~(np.abs(corners).max(axis=(1, 2), initial=0.0) <= LARGEST))
    if len(bad):
        raise InputError(
            f"{name}: facet {int(bad[0]) + 1}: a coordinate is not a number, or beyond {LARGEST:g} mm; export it again"
        )
    return corners * MM


def _is_ascii(content: bytes) -> bool:
    """Whether it is text: binary files may begin with "solid" as well, but hold as many bytes as their count says."""
    if not content[:HEADER].lstrip().lower().startswith(b"solid"):
        return False
    return len(content) != COUNT + int.from_bytes(content[HEADER:COUNT], "little") * RECORD.itemsize


def _binary(name: str, content: bytes) -> Array:
    if len(content) < COUNT:
        raise InputError(f"{name}: {len(content)} bytes are no STL file; export it again")
    count = int.from_bytes(content[HEADER:COUNT], "little")
    needed = COUNT + count * RECORD.itemsize
    if len(content) < needed:
        raise InputError(
            f"{name}: cut off: {count} facets need {needed} bytes, and it has {len(content)}; export it again"
        )
    if not count:
        raise InputError(f"{name}: no facets; export the surface of the part")
    more = (len(content) - needed) // RECORD.itemsize
    if more:  # a count that is too small leaves a hole where the rest of the part is
        raise InputError(f"{name}: its count says {count} facets, and it has room for {more} more; export it again")
    with np.errstate(invalid="ignore"):  # of a corner that is no number, which is refused by its facet
        return np.frombuffer(content, RECORD, count, COUNT)["corner"].astype(float)


def _ascii(name: str, content: bytes) -> Array:
    lines = content.splitlines()
    vertices = [line for line in (row.strip() for row in lines) if line.lower().startswith(VERTEX)]
    if not vertices:
        raise InputError(f"{name}: no facets; export the surface of the part")
    try:
        numbers = np.array(b" ".join(line[len(VERTEX) :] for line in vertices).split(), dtype=float)
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) != 3 * len(vertices):
        raise InputError(f"{name}: line {_first_bad(lines)}: a vertex has three numbers; export it again")
    _check_triangles(name, lines)
    if len(vertices) % 3 or not any(row.strip().lower().startswith(b"endsolid") for row in lines[-3:]):
        raise InputError(f"{name}: cut off after line {len(lines)}: no endsolid; export it again")
    return numbers.reshape(-1, 3, 3)


def _check_triangles(name: str, lines: list[bytes]) -> None:
    """Raises InputError where a loop has other than three lines with a vertex."""
    count = 0
    for n, row in enumerate(lines, 1):
        word = row.lstrip()[:7].lower()
        if word[:6] == VERTEX:
            count += 1
        elif word == b"endloop":
            if count != 3:
                raise InputError(
                    f"{name}: line {n}: a facet with {count} vertices on lines of their own; export triangles, each "
                    "vertex on its line"
                )
            count = 0


def _first_bad(lines: list[bytes]) -> int:
    """The first line, from 1, with a vertex that is not three numbers."""
    for n, row in enumerate(lines, 1):
        words = row.split()
        if words and words[0].lower() == VERTEX:
            try:
                if len([float(word) for word in words[1:]]) != 3:
                    return n
            except ValueError:
                return n
    return len(lines)
