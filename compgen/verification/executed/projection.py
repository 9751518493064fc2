r"""The nearest point of a course to each row of a log, by millions.

From the marks of a track every row has an expected arc length. It is moved along the course until the row lies square
to it, s <- s + (p - q(s)) . t(s), and of the ways about there the one with the nearest point is taken.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, dot, own
from compgen.verification.executed.course import Course
from compgen.verification.executed.tracking import Track

STEPS = 3  # along the course
FARTHEST = 3e-3  # [m] that one of them goes
TIE = 1e-18  # m2: of two ways as near, the expected one
NEIGHBOURS = (0, -1, 1, -2, 2)
BLOCK = 262_144  # rows at a time


@dataclass(frozen=True, eq=False, slots=True)
class Projection:
    """M rows of a log beside the course."""

    arc: Array  # (M,) [m]
    way: IntArray  # (M,)
    off: Array  # (M, 3) [m] from the nearest point of the course to the row
    distance: Array  # (M,) [m]

    def __post_init__(self) -> None:
        own(self, arc=("M",), way=("M",), off=("M", 3), distance=("M",))


def project(course: Course, position: Array, travelled: Array, track: Track) -> Projection:
    """The nearest points to all rows of a log, (M, 3) [m], that a track has laid along the course."""
    expected = _expected(course, travelled, track)
    M = len(position)
    arc, way, off = np.empty(M), np.empty(M, dtype=np.int64), np.empty((M, 3))
    tangent = course.tangents()
    for rows in _blocks(M):
        arc[rows], way[rows], off[rows] = nearest(course.position, course.arc, tangent, position[rows], expected[rows])
    return Projection(arc, way, off, np.sqrt(dot(off, off)))


def _expected(course: Course, travelled: Array, track: Track) -> Array:
    """Arc length at each row: by the way that the log has travelled from the mark before, (M,) [m]."""
    return np.clip(np.interp(travelled, *_rising(track.travelled, track.arc)), 0.0, course.length)


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    """Pairs with x rising."""
    keep = np.append(True, np.diff(x) > 0)
    return x[keep], y[keep]


def nearest(nodes: Array, arc_at: Array, tangent: Array, points: Array, arc: Array) -> tuple[Array, IntArray, Array]:
    """Nearest points of a polyline to others, each looked for about an expected arc length.

    Args:
        nodes: Of the polyline, (N, 3) [m].
        arc_at: Arc length at them, (N,) [m].
        tangent: Of its ways, (N - 1, 3).
        points: (M, 3) [m].
        arc: Expected, (M,) [m].

    Returns:
        Arc length (M,), way (M,), and the vector from the nearest point (M, 3).
    """
    last, end, length = len(arc_at) - 2, float(arc_at[-1]), np.diff(arc_at)

    def way_of(arc: Array) -> IntArray:
        return np.asarray(np.clip(np.searchsorted(arc_at, arc, side="right") - 1, 0, last))

    for _ in range(STEPS):
        k = way_of(arc)
        q = nodes[k] + (arc - arc_at[k])[:, None] * tangent[k]
        arc = np.clip(arc + np.clip(dot(points - q, tangent[k]), -FARTHEST, FARTHEST), 0.0, end)
    k = way_of(arc)
    best = np.full(len(arc), np.inf)
    best_arc, best_way, best_off = arc.copy(), k.copy(), np.zeros((len(arc), 3))
    for neighbour in NEIGHBOURS:
        way = np.clip(k + neighbour, 0, last)
        start, t = nodes[way], tangent[way]
        share = np.clip(dot(points - start, t), 0.0, length[way])
        off = points - (start + share[:, None] * t)
        squared = dot(off, off)
        nearer = squared < best - TIE
        best[nearer] = squared[nearer]
        best_arc[nearer] = arc_at[way[nearer]] + share[nearer]
        best_way[nearer], best_off[nearer] = way[nearer], off[nearer]
    return best_arc, best_way, best_off


def _blocks(count: int) -> Iterator[slice]:
    return (slice(begin, min(begin + BLOCK, count)) for begin in range(0, count, BLOCK))


def components(course: Course, projection: Projection, rows: IntArray | BoolArray | slice) -> tuple[Array, Array]:
    """Across the travel in the surface, and along the tool's axis away from the surface, of some rows [m].

    side = t x z / |t x z|, across = off . side, normal = - off . z, z the tool's axis at the nearest node.
    """
    way, off = projection.way[rows], projection.off[rows]
    z = course.rotation[way, :, 2]
    side = np.cross(course.tangents()[way], z)
    size = np.sqrt(dot(side, side))
    leads = size < 0.5  # along the tool's own axis there is no side: the tool's x serves
    side = np.where(leads[:, None], course.rotation[way, :, 1], side / np.where(leads, 1.0, size)[:, None])
    return dot(off, side), -dot(off, z)
