r"""The planned path: pieces laid onto a surface, cut into waypoints, each with the pose the tool shall have.

Waypoints follow curvature: on a curve of curvature K a chord of length ds leaves it by K ds^2 / 8, so the spacing is
ds = sqrt(8 chord / K), never above ``MAX_SPACING``. Between waypoints the true path stays available: ``at`` gives the
exact pose at any fraction of any segment's arc length.
"""

from dataclasses import dataclass

import numpy as np

from compgen import pieces as pc
from compgen.arrays import Array, BoolArray, IntArray, own, unit
from compgen.boundaries import Boundary
from compgen.exceptions import InputError
from compgen.pieces import Pieces
from compgen.surfaces import Quadric

MAX_SPACING = 10e-3  # m; the actual path between waypoints is curved by some 1e-4 / m: 1 nm at this spacing
MIN_SEGMENTS = 3  # a piece, so that its joint motion is a curve and not a chord
CELLS = 48  # a piece, for its curvature
SAFETY = 0.98  # of the spacing, for what the cells do not see

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, eq=False, slots=True)
class Geometry:
    """The exact path: pieces on a surface with an edge; the tool's z axis points into the surface."""

    pieces: Pieces
    surface: Quadric
    boundary: Boundary
    spin: float  # [rad] the tool's x axis against base x, about base z

    def velocity(self, piece: IntArray, t: Array) -> Array:
        """dP/dt, (M, 3) [m]."""
        return self.surface.along(self.pieces.plane_curve(piece, t), self.pieces.height(piece, t))[0]

    def spacing(self, piece: IntArray, t: Array, chord: float) -> tuple[Array, Array]:
        """|dP/dt| and the waypoint spacing there, (M,) each [m]."""
        p1, p2 = self.surface.along(self.pieces.plane_curve(piece, t), self.pieces.height(piece, t))
        speed = np.linalg.norm(p1, axis=1)
        bend = np.linalg.norm(np.cross(p1, p2), axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            spacing = np.sqrt(8 * chord * speed**3 / bend)
        return speed, np.fmin(spacing, MAX_SPACING)

    def pose(self, piece: IntArray, t: Array) -> tuple[Array, Array]:
        """Tool position and rotation, (M, 3) [m] and (M, 3, 3)."""
        xy, _, _ = self.pieces.plane_curve(piece, t)
        position, normal = self.surface.lift(xy, self.pieces.height(piece, t)[0])
        z = -normal
        along = np.array([np.cos(self.spin), np.sin(self.spin), 0.0])
        x = unit(along - z * (z @ along)[:, None])
        return position, np.stack([x, np.cross(z, x), z], axis=-1)

    def length(self, piece: IntArray, start: Array, end: Array) -> Array:
        """Arc length from start to end within one piece, (M,) [m]; five-point Gauss-Legendre."""
        middle, half = (start + end) / 2, (end - start) / 2
        total = np.zeros(len(start))
        for node, weight in zip(_NODES, _WEIGHTS):
            total += weight * np.linalg.norm(self.velocity(piece, middle + half * node), axis=1)
        return np.asarray(total * half)


@dataclass(frozen=True, eq=False, slots=True)
class ToolPath:
    """N waypoints with N - 1 segments between them."""

    geometry: Geometry
    position: Array  # (N, 3) [m] base frame
    rotation: Array  # (N, 3, 3) tool axes as columns
    arc: Array  # (N,) [m] arc length from the first waypoint
    contact: BoolArray  # (N,) on the part
    stop: BoolArray  # (N,) the robot stops here
    piece: IntArray  # (N - 1,) which piece a segment lies on
    span: Array  # (N - 1, 2) its parameters there

    def __post_init__(self) -> None:
        own(
            self,
            position=("N", 3),
            rotation=("N", 3, 3),
            arc=("N",),
            contact=("N",),
            stop=("N",),
            piece=("S",),
            span=("S", 2),
        )

    def at(self, segment: IntArray, fraction: Array) -> tuple[Array, Array, Array]:
        """True position, rotation and direction of travel at a fraction of a segment's arc length.

        Returns:
            (M, 3) [m], (M, 3, 3), (M, 3) unit vectors.
        """
        piece, (start, end) = self.piece[segment], self.span[segment].T
        whole = np.diff(self.arc)[segment]
        t = start + fraction * (end - start)
        for _ in range(2):  # t is nearly linear in arc length within a segment
            speed = np.linalg.norm(self.geometry.velocity(piece, t), axis=1)
            t = t - (self.geometry.length(piece, start, t) - fraction * whole) / speed
        position, rotation = self.geometry.pose(piece, t)
        return position, rotation, unit(self.geometry.velocity(piece, t))


def build(pattern: Pieces, surface: Quadric, boundary: Boundary, *, spin: float, chord: float, lift: float) -> ToolPath:
    """Waypoints of a pattern on a surface, with an approach and a retract along the tool axis.

    Args:
        pattern: The way in the local plane.
        surface: What it lies on.
        boundary: The part's edge; waypoints outside are not in contact.
        spin: The tool's x axis against base x [rad].
        chord: Largest distance between the path and the straight line between two waypoints [m].
        lift: Length of approach and retract [m]; 0 leaves them out.

    Raises:
        InputError: The path has no length.
    """
    if lift > 0:
        (x0, y0), (x1, y1) = pattern.start(), pattern.end()
        top = float(pattern.height(np.array([len(pattern.poly) - 1]), np.array([1.0]))[0][0])
        down = pc.line((x0, y0, lift), (x0, y0, 0.0), stop=True, working=False)
        up = pc.line((x1, y1, top), (x1, y1, top + lift), stop=True, working=False)
        pattern = pc.join(down, pattern, up)
    geometry = Geometry(pattern, surface, boundary, spin)

    K = len(pattern.poly)
    edges = np.linspace(0, 1, CELLS + 1)
    piece = np.repeat(np.arange(K), CELLS)
    half = 0.5 / CELLS
    middle = np.tile(edges[:-1] + half, K)
    work = np.zeros(K * CELLS)
    for node, weight in zip(_NODES, _WEIGHTS):
        speed, spacing = geometry.spacing(piece, middle + half * node, SAFETY**2 * chord)
        work += weight * half * speed / spacing
    cells = work.reshape(K, CELLS)
    segments = np.ceil(cells.sum(axis=1) - 1e-6).astype(np.int64)
    if segments.sum() == 0:
        raise InputError("path: it has zero length; give it a size")
    keep = segments > 0
    segments = np.where(keep, np.maximum(segments, MIN_SEGMENTS), 0)

    # invert the running work of each piece: piece k occupies [k, k + 1] on both axes
    share = np.cumsum(cells, axis=1) / np.where(keep, cells.sum(axis=1), 1.0)[:, None]
    done = (np.arange(K)[:, None] + np.column_stack([np.zeros(K), share])).ravel()
    where = (np.arange(K)[:, None] + edges).ravel()
    seg_piece = np.repeat(np.arange(K), segments)
    first = np.concatenate([[0], np.cumsum(segments)[:-1]])
    step = np.arange(len(seg_piece)) - first[seg_piece]
    n = segments[seg_piece]
    span = np.column_stack([np.interp(seg_piece + s / n, done, where) - seg_piece for s in (step, step + 1)])
    span[step == 0, 0], span[step == n - 1, 1] = 0.0, 1.0

    point_piece = np.concatenate([[seg_piece[0]], seg_piece])
    point_t = np.concatenate([[0.0], span[:, 1]])
    position, rotation = geometry.pose(point_piece, point_t)
    arc = np.concatenate([[0.0], np.cumsum(geometry.length(seg_piece, span[:, 0], span[:, 1]))])
    xy, _, _ = pattern.plane_curve(point_piece, point_t)
    ends = step == n - 1
    stop = np.concatenate([[True], ends & pattern.stop[seg_piece]])
    stop[-1] = True
    working = pattern.working[point_piece].copy()
    working[:-1] |= pattern.working[seg_piece]  # a work piece's first point is in contact
    return ToolPath(
        geometry=geometry,
        position=position,
        rotation=rotation,
        arc=arc,
        contact=working & boundary.contains(xy),
        stop=stop,
        piece=seg_piece,
        span=span,
    )
