"""The exact path, and what is asked of it: expressions of a piece, a surface and a parameter, at many points."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.planning.boundaries import Boundary, room_expr
from compgen.planning.curves import Pieces, curve_expr, height_expr
from compgen.planning.surfaces import Quadric, along_expr, lift_expr, refuse_ended

MAX_SPACING = 10e-3  # m; the actual path between waypoints is curved by some 1e-4 / m: 1 nm at this spacing
INNER = (0.2, 0.35, 0.5, 0.65, 0.8)  # of a segment, where its chord is measured
ROUNDS = 2  # of Newton from arc length to parameter, which are nearly linear in each other within a segment
#: a segment is even when speed changes by less than this over it, bends by less, and Simpson's rule gives its length
EVEN = (3e-3, 3e-5, 3e-9)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)  # of lengths over -1 to 1


@dataclass(frozen=True, eq=False, slots=True)
class Geometry:
    """Pieces on a surface with an edge; the tool's z axis points into the surface."""

    pieces: Pieces
    surface: Quadric
    boundary: Boundary
    spin: float  # [rad] the tool's x axis against base x, about base z
    table: Array = field(init=False)  # (K, 22) of the pieces

    def __post_init__(self) -> None:
        object.__setattr__(self, "table", frozen(self.pieces.table()))

    def spacing(self, piece: IntArray, t: Array, chord: float, widest: float = MAX_SPACING) -> tuple[Array, Array]:
        """|dP/dt| and the waypoint spacing there, (M,) each [m]."""
        limits = np.array([[chord, widest]])
        speed, spacing, there = self._ask(functions().spacing, piece, t[:, None], limits)
        refuse_ended(there)
        return speed[:, 0], spacing[:, 0]

    def pose(self, piece: IntArray, t: Array) -> tuple[Array, Array, BoolArray]:
        """Tool position and rotation, (M, 3) [m] and (M, 3, 3), and whether the part is there, (M,)."""
        edge = self.boundary.table()
        position, rotation, there, room = self._ask(
            build_pose(edge.shape[1] // 3), piece, t[:, None], self.axis(), edge
        )
        refuse_ended(there)
        return position, rotation.reshape(-1, 3, 3), room[:, 0] >= 0

    def length(self, piece: IntArray, start: Array, end: Array) -> Array:
        """Arc length from start to end within one piece, (M,) [m]; five-point Gauss-Legendre."""
        found, there = self._ask(functions().length, piece, np.column_stack([start, end]))
        refuse_ended(there)
        return found[:, 0]

    def measured(self, piece: IntArray, span: Array) -> tuple[Array, Array]:
        """Arc length of spans (M,) [m], and how fast the parameter runs over it at both ends, (M, 2).

        The latter, the slope of t over the share of the length, is not a number where the span is not even: there only
        Newton finds t, elsewhere a cubic is exact to 1e-13 of the length.
        """
        length, slope, there = self._ask(functions().measured, piece, span)
        refuse_ended(there)
        return length[:, 0], slope

    def chord(self, piece: IntArray, span: Array) -> Array:
        """Distance of the path from the line between a span's ends, the largest of five inner points, (M,) [m]."""
        found, there = self._ask(functions().chord, piece, span)
        refuse_ended(there)
        return found[:, 0]

    def at(
        self, piece: IntArray, span: Array, whole: Array, slope: Array, fraction: Array
    ) -> tuple[Array, Array, Array]:
        """Pose and direction of travel at a fraction of the arc length of a span, (M, 3), (M, 3, 3) and (M, 3).

        ``whole`` (M,) and ``slope`` (M, 2) are what ``measured`` says of the spans.
        """
        t = even_expr(span.T, slope.T, fraction)
        uneven = np.flatnonzero(np.isnan(t))
        t[uneven] = self.uneven(piece[uneven], span[uneven], whole[uneven], fraction[uneven])
        position, rotation, travel = self._ask(functions().place, piece, t[:, None], self.axis())
        return position, rotation.reshape(-1, 3, 3), travel

    def uneven(self, piece: IntArray, span: Array, whole: Array, fraction: Array) -> Array:
        """The parameter at a fraction of the arc length of a span, by Newton, (M,)."""
        if not len(piece):
            return np.zeros(0)
        return self._ask(functions().at, piece, np.column_stack([span, whole, fraction]))[0][:, 0]

    def _ask(self, function: Any, piece: IntArray, *rows: Array) -> tuple[Array, ...]:
        return evaluate(function, IndexedRows(self.table, piece), self.surface.table(), *rows)

    def axis(self) -> Array:
        """Cosine and sine of the spin, (1, 2)."""
        return np.array([[np.cos(self.spin), np.sin(self.spin)]])


def even_expr(span: Any, slope: Any, u: Any) -> Any:
    """The parameter at a fraction of the arc length of an even span, of the span's two ends and two slopes."""
    step = span[1] - span[0]
    t = span[0] + u * (slope[0] + u * (3 * step - 2 * slope[0] - slope[1]))
    return t + u * u * u * (slope[0] + slope[1] - 2 * step)


class Functions:
    """CasADi functions of a row of ``Pieces.table`` (22) and one of ``Quadric.table`` (15), each built when asked for.

    A point's expression is a function of its own, called for every node: SX is put together in C++ then, not in Python.
    """

    def __init__(self) -> None:
        piece, surface, t = ca.SX.sym("piece", 22), ca.SX.sym("surface", 15), ca.SX.sym("t")
        curve, height = curve_expr(piece, t), height_expr(piece, t)
        self._inputs, self._t, self._two = [piece, surface], t, ca.SX.sym("two", 2)
        self._along = ca.Function("along", [piece, surface, t], [*along_expr(surface, curve, height)])
        self._lift = ca.Function("lift", [piece, surface, t], [*lift_expr(surface, curve[0], height[0])])

    def along(self, t: Any) -> Any:
        """As ``along_expr``."""
        return self._along(*self._inputs, t)

    def lift(self, t: Any) -> Any:
        """As ``lift_expr``."""
        return self._lift(*self._inputs, t)

    def _built(self, name: str, given: Sequence[Any], out: Sequence[Any]) -> Any:
        return ca.Function(name, [*self._inputs, *given], [*out])

    @cached_property
    def spacing(self) -> Any:
        """And t, (chord, widest) -> |dP/dt|, spacing, there."""
        p1, p2, there = self.along(self._t)
        speed = ca.norm_2(p1)
        bend = ca.norm_2(ca.cross(p1, p2))
        spacing = ca.fmin(ca.sqrt(8 * self._two[0] * speed**3 / bend), self._two[1])
        return self._built("spacing", [self._t, self._two], [speed, spacing, there])

    @cached_property
    def place(self) -> Any:
        """And t, (cos, sin) -> position, rotation, travel (3)."""
        axis = ca.SX.sym("axis", 2)
        position, rotation, _ = pose_expr(self.lift(self._t), axis)
        travel = self.along(self._t)[0]
        return self._built("place", [self._t, axis], ca.cse([position, ca.vec(rotation.T), travel / ca.norm_2(travel)]))

    def _length(self, start: Any, end: Any) -> tuple[Any, Any]:
        middle, half = (start + end) / 2, (end - start) / 2
        found = [self.along(middle + half * float(node)) for node in NODES]
        total = sum(float(w) * ca.norm_2(p1) for w, (p1, _, _) in zip(WEIGHTS, found))
        there = found[0][2]
        for _, _, more in found[1:]:
            there = ca.fmin(there, more)
        return total * half, there

    @cached_property
    def length(self) -> Any:
        """And (start, end) -> length, there."""
        return self._built("length", [self._two], self._length(self._two[0], self._two[1]))

    @cached_property
    def chord(self) -> Any:
        """And (start, end) -> distance, there."""
        two = self._two
        begin, finish = self.lift(two[0]), self.lift(two[1])
        line = finish[0] - begin[0]
        size = ca.dot(line, line)
        size = ca.if_else(size > 0, size, 1.0)
        farthest, held = 0.0, ca.fmin(begin[3], finish[3])
        for u in INNER:
            point, _, _, more = self.lift(two[0] + u * (two[1] - two[0]))
            off = point - begin[0]
            off = off - ca.dot(off, line) / size * line
            farthest, held = ca.fmax(farthest, ca.norm_2(off)), ca.fmin(held, more)
        return self._built("chord", [two], [farthest, held])

    @cached_property
    def at(self) -> Any:
        """And (start, end, length, fraction) -> t."""
        four = ca.SX.sym("four", 4)
        start, end, whole, fraction = (four[k] for k in range(4))
        found = start + fraction * (end - start)
        for _ in range(ROUNDS):
            found = found - (self._length(start, found)[0] - fraction * whole) / ca.norm_2(self.along(found)[0])
        return self._built("at", [four], [found])

    @cached_property
    def measured(self) -> Any:
        """And (start, end) -> length, slopes (2), there."""
        two = self._two
        step = two[1] - two[0]
        first, middle, last = (ca.norm_2(self.along(two[0] + u * step)[0]) for u in (0.0, 0.5, 1.0))
        total, held = self._length(two[0], two[1])
        even = ca.fabs(last - first) < EVEN[0] * middle
        even = ca.logic_and(even, ca.fabs(first + last - 2 * middle) < EVEN[1] * middle)
        simpson = (first + 4 * middle + last) / 6 * step
        even = ca.logic_and(even, ca.fabs(simpson - total) < EVEN[2] * total)
        slope = ca.if_else(even, total / ca.vertcat(first, last), ca.SX.nan(2))
        return self._built("measured", [two], ca.cse([total, slope, held]))


@lru_cache(maxsize=1)
def functions() -> Functions:
    """The expressions, built once."""
    return Functions()


def pose_expr(lifted: tuple[Any, Any, Any, Any], axis: Any) -> tuple[Any, Any, Any]:
    """Tool position, rotation and extent of the surface of what ``lift_expr`` says; axis: (cos, sin) of the spin."""
    position, normal, _, there = lifted
    z = -normal
    along_x = ca.vertcat(axis, 0)
    x = along_x - z * ca.dot(z, along_x)
    x = x / ca.norm_2(x)
    return position, ca.horzcat(x, ca.cross(z, x), z), there


@lru_cache(maxsize=8)
def build_pose(sides: int) -> Any:
    """Of a row of ``Pieces.table``, one of ``Quadric.table``, t, (cos, sin) and a ``Boundary.table`` of so many sides.

    Gives position, rotation (9, row by row), there, and how far inside the edge.
    """
    piece, surface, t = ca.SX.sym("piece", 22), ca.SX.sym("surface", 15), ca.SX.sym("t")
    axis, edge = ca.SX.sym("axis", 2), ca.SX.sym("edge", 3 * sides + 1)
    xy = curve_expr(piece, t)[0]
    position, rotation, there = pose_expr(lift_expr(surface, xy, height_expr(piece, t)[0]), axis)
    room = room_expr(edge, xy)
    outputs = ca.cse([position, ca.vec(rotation.T), there, room])
    return ca.Function("pose", [piece, surface, t, axis, edge], outputs)
