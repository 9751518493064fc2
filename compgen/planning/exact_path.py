"""The exact path: a piecewise curve on a surface, and its points, lengths and chords by piece and parameter.

Everything is a CasADi expression of a piece's coefficients, the surface's (15) and the parameter t, evaluated at
many points at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.core.pose import Pose
from compgen.planning.boundaries import Boundary, coefficient_count, inside_expr
from compgen.planning.curves import WIDTH, PiecewiseCurve, curve_expr, height_expr, tilt_expr
from compgen.planning.surfaces import Quadric, check_extent, curve_derivatives_expr, lift_expr

MAX_SPACING = 10e-3  # m; the actual path between waypoints is curved by some 1e-4 / m: 1 nm at this spacing
INNER = (0.2, 0.35, 0.5, 0.65, 0.8)  # of a segment, where its chord is measured
ROUNDS = 2  # of Newton from arc length to parameter, which are nearly linear in each other within a segment
#: a segment is even when speed changes by less than this over it, bends by less, and Simpson's rule gives its length
EVEN = (3e-3, 3e-5, 3e-9)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)  # of lengths over -1 to 1


class PathPoses(NamedTuple):
    """M poses on the path, and which way it goes there."""

    pose: Pose
    travel: Array  # (M, 3) unit vectors


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ExactPath:
    """A piecewise curve on a surface with an edge; the tool's z axis points into the surface."""

    curve: PiecewiseCurve
    surface: Quadric
    boundary: Boundary
    spin: float  # [rad] the tool's x axis against the frame's x, about its z
    frame: Pose | None = None  # that the surface stands in; None: World
    coefficients: Array = field(init=False)  # (K, WIDTH) of the curve's pieces

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", frozen(self.curve.coefficients()))

    def speed_and_spacing(
        self, piece: IntArray, t: Array, chord: float, max_spacing: float = MAX_SPACING
    ) -> tuple[Array, Array]:
        """|dP/dt| and the spacing of waypoints whose chords keep to ``chord`` [m], (M,) each [m].

        Raises:
            InputError: The surface ends inside the path; so do the methods below.
        """
        speed, spacing = self._on_surface(path_functions().spacing, piece, t[:, None], np.array([[chord, max_spacing]]))
        return speed[:, 0], spacing[:, 0]

    def pose(self, piece: IntArray, t: Array) -> tuple[Pose, BoolArray]:
        """M poses of the tool, and whether the part is there, (M,)."""
        edge = self.boundary.coefficients()
        position, rotation, extent, inside = self._evaluate(
            build_pose(self.boundary.shape), piece, t[:, None], self.spin_vector(), edge
        )
        check_extent(extent)
        return self.in_world(Pose.from_rows(position, rotation)), inside[:, 0] >= 0

    def length(self, piece: IntArray, start: Array, end: Array) -> Array:
        """Arc length from start to end within one piece, (M,) [m]; five-point Gauss-Legendre."""
        return self._on_surface(path_functions().length, piece, np.column_stack([start, end]))[0][:, 0]

    def length_and_slope(self, piece: IntArray, span: Array) -> tuple[Array, Array]:
        """Arc lengths of spans (M,) [m], and slopes of t over the share of them at both ends, (M, 2).

        NaN where a span is not even: there only Newton finds t; elsewhere a cubic is exact to 1e-13 of the length.
        """
        length, slope = self._on_surface(path_functions().length_and_slope, piece, span)
        return length[:, 0], slope

    def chord(self, piece: IntArray, span: Array) -> Array:
        """Distance of the path from the line between a span's ends, the largest of five inner points, (M,) [m]."""
        return self._on_surface(path_functions().chord, piece, span)[0][:, 0]

    def sag(self, piece: IntArray, span: Array) -> Array:
        """From the middle of the line between a span's ends to the path there, square to the line, (M, 3) [m]."""
        (sag,) = self._on_surface(path_functions().sag, piece, span)
        return sag if self.frame is None else sag @ self.frame.rotation.T

    def at(self, piece: IntArray, span: Array, length: Array, slope: Array, fraction: Array) -> PathPoses:
        """Pose and direction of travel at a fraction of the arc length of a span.

        Args:
            piece: (M,).
            span: Parameters at both ends, (M, 2).
            length: Of the spans, (M,) [m], as ``length_and_slope`` has it.
            slope: (M, 2), as ``length_and_slope`` has it.
            fraction: (M,), 0 to 1.
        """
        t = parameter_expr(span.T, slope.T, fraction)
        uneven = np.flatnonzero(np.isnan(t))
        t[uneven] = self.parameter_by_newton(piece[uneven], span[uneven], length[uneven], fraction[uneven])
        return self.pose_and_travel(piece, t)

    def pose_and_travel(self, piece: IntArray, t: Array) -> PathPoses:
        """Pose and direction of travel at parameters t (M,) of pieces (M,)."""
        position, rotation, travel = self._evaluate(
            path_functions().pose_and_travel, piece, t[:, None], self.spin_vector()
        )
        turned = travel if self.frame is None else travel @ self.frame.rotation.T
        return PathPoses(self.in_world(Pose.from_rows(position, rotation)), turned)

    def above(self, piece: int, t: float, lift: float) -> Array:
        """A point on the tool axis over a point of the path, (3,) x, y along the surface and the height above it [m].

        Args:
            piece: Of the curve.
            t: Its parameter.
            lift: How far over it [m].
        """
        place, tilt = self.curve.place_and_tilt(piece, t)
        if not tilt.any():
            return np.asarray(place + np.array([0.0, 0.0, lift]))
        pose = self.pose(np.array([piece]), np.array([t]))[0][0]
        return self.local(pose.position - lift * pose.rotation[:, 2])

    def in_world(self, pose: Pose) -> Pose:
        """Poses given in the frame, in World."""
        return pose if self.frame is None else self.frame @ pose

    def in_frame(self, pose: Pose) -> Pose:
        """Poses given in World, in the frame."""
        return pose if self.frame is None else self.frame.inverse() @ pose

    def local(self, point: Array) -> Array:
        """x, y along the surface and the height above it of a point near it, (3,) in World to (3,) [m]."""
        return self.surface.local(point if self.frame is None else self.frame.inverse().act(point))

    def parameter_by_newton(self, piece: IntArray, span: Array, length: Array, fraction: Array) -> Array:
        """The parameter at a fraction of the arc length of a span, by Newton's method, (M,)."""
        if not len(piece):
            return np.zeros(0)
        return self._evaluate(path_functions().parameter, piece, np.column_stack([span, length, fraction]))[0][:, 0]

    def spin_vector(self) -> Array:
        """Cosine and sine of the spin, (1, 2)."""
        return np.array([[np.cos(self.spin), np.sin(self.spin)]])

    def _on_surface(self, function: Any, piece: IntArray, *rows: Array) -> tuple[Array, ...]:
        """What a function says of places that the surface extends to, by the extent that it says last."""
        *outputs, extent = self._evaluate(function, piece, *rows)
        check_extent(extent)
        return tuple(outputs)

    def _evaluate(self, function: Any, piece: IntArray, *rows: Array) -> tuple[Array, ...]:
        return evaluate(function, IndexedRows(self.coefficients, piece), self.surface.coefficients(), *rows)


def parameter_expr(span: Any, slope: Any, u: Any) -> Any:
    """The parameter at a fraction u of the arc length of an even span: a cubic of its two ends and two slopes."""
    step = span[1] - span[0]
    t = span[0] + u * (slope[0] + u * (3 * step - 2 * slope[0] - slope[1]))
    return t + u * u * u * (slope[0] + slope[1] - 2 * step)


class PathFunctions:
    """CasADi functions of a piece (WIDTH) and a surface (15) with further inputs, each built when asked for.

    A point's expression is a function of its own, called for every node: SX is put together in C++ then, not in Python.
    """

    def __init__(self) -> None:
        piece, surface, t = ca.SX.sym("piece", WIDTH), ca.SX.sym("surface", 15), ca.SX.sym("t")
        curve, height = curve_expr(piece, t), height_expr(piece, t)
        self._inputs, self._t, self._pair = [piece, surface], t, ca.SX.sym("pair", 2)
        derivatives = curve_derivatives_expr(surface, curve, height)
        self._derivatives = ca.Function("derivatives", [piece, surface, t], [*derivatives])
        self._lift = ca.Function("lift", [piece, surface, t], [*lift_expr(surface, curve[0], height[0])])

    def derivatives(self, t: Any) -> Any:
        """P', P'' and the extent of the surface, as ``curve_derivatives_expr`` has them."""
        return self._derivatives(*self._inputs, t)

    def lift(self, t: Any) -> Any:
        """Position, normal, local z and the extent of the surface, as ``lift_expr`` has them."""
        return self._lift(*self._inputs, t)

    def _build(self, name: str, inputs: Sequence[Any], outputs: Sequence[Any]) -> Any:
        return ca.Function(name, [*self._inputs, *inputs], [*outputs])

    @cached_property
    def spacing(self) -> Any:
        """t, (chord, largest spacing) -> |dP/dt|, spacing, extent."""
        p1, p2, extent = self.derivatives(self._t)
        speed = ca.norm_2(p1)
        bend = ca.norm_2(ca.cross(p1, p2))
        spacing = ca.fmin(ca.sqrt(8 * self._pair[0] * speed**3 / bend), self._pair[1])
        return self._build("spacing", [self._t, self._pair], [speed, spacing, extent])

    @cached_property
    def pose_and_travel(self) -> Any:
        """t, (cos, sin) of the spin -> position (3), rotation (9, row by row), travel (3)."""
        axis = ca.SX.sym("axis", 2)
        position, rotation, _ = tilted_pose_expr(self.lift(self._t), axis, tilt_expr(self._inputs[0], self._t))
        travel = self.derivatives(self._t)[0]
        outputs = ca.cse([position, ca.vec(rotation.T), travel / ca.norm_2(travel)])
        return self._build("pose_and_travel", [self._t, axis], outputs)

    def _length(self, start: Any, end: Any) -> tuple[Any, Any]:
        """Arc length and the smallest extent, by Gauss-Legendre quadrature."""
        middle, half = (start + end) / 2, (end - start) / 2
        derivatives = [self.derivatives(middle + half * float(node)) for node in NODES]
        total = sum(float(w) * ca.norm_2(p1) for w, (p1, _, _) in zip(WEIGHTS, derivatives, strict=True))
        smallest = derivatives[0][2]
        for _, _, extent in derivatives[1:]:
            smallest = ca.fmin(smallest, extent)
        return total * half, smallest

    @cached_property
    def length(self) -> Any:
        """(start, end) -> length, extent."""
        return self._build("length", [self._pair], self._length(self._pair[0], self._pair[1]))

    @cached_property
    def chord(self) -> Any:
        """(start, end) -> distance, extent."""
        start, end = self._pair[0], self._pair[1]
        first, last = self.lift(start), self.lift(end)
        line = last[0] - first[0]
        length_squared = ca.dot(line, line)
        length_squared = ca.if_else(length_squared > 0, length_squared, 1.0)
        farthest, smallest = 0.0, ca.fmin(first[3], last[3])
        for u in INNER:
            point, _, _, extent = self.lift(start + u * (end - start))
            offset = point - first[0]
            offset = offset - ca.dot(offset, line) / length_squared * line
            farthest, smallest = ca.fmax(farthest, ca.norm_2(offset)), ca.fmin(smallest, extent)
        return self._build("chord", [self._pair], [farthest, smallest])

    @cached_property
    def sag(self) -> Any:
        """(start, end) -> sag (3), extent."""
        start, end = self._pair[0], self._pair[1]
        first, middle, last = self.lift(start), self.lift((start + end) / 2), self.lift(end)
        line, sag = last[0] - first[0], middle[0] - (first[0] + last[0]) / 2
        sag = sag - ca.dot(sag, line) / ca.fmax(ca.dot(line, line), 1e-30) * line
        return self._build("sag", [self._pair], [sag, ca.fmin(ca.fmin(first[3], middle[3]), last[3])])

    @cached_property
    def parameter(self) -> Any:
        """(start, end, length, fraction) -> t."""
        span = ca.SX.sym("span", 4)
        start, end, length, fraction = (span[k] for k in range(4))
        t = start + fraction * (end - start)
        for _ in range(ROUNDS):
            t = t - (self._length(start, t)[0] - fraction * length) / ca.norm_2(self.derivatives(t)[0])
        return self._build("parameter", [span], [t])

    @cached_property
    def length_and_slope(self) -> Any:
        """(start, end) -> length, slopes (2), extent."""
        start, end = self._pair[0], self._pair[1]
        step = end - start
        first, middle, last = (ca.norm_2(self.derivatives(start + u * step)[0]) for u in (0.0, 0.5, 1.0))
        length, extent = self._length(start, end)
        even = ca.fabs(last - first) < EVEN[0] * middle
        even = ca.logic_and(even, ca.fabs(first + last - 2 * middle) < EVEN[1] * middle)
        simpson = (first + 4 * middle + last) / 6 * step
        even = ca.logic_and(even, ca.fabs(simpson - length) < EVEN[2] * length)
        slope = ca.if_else(even, length / ca.vertcat(first, last), ca.SX.nan(2))
        return self._build("length_and_slope", [self._pair], ca.cse([length, slope, extent]))


@lru_cache(maxsize=1)
def path_functions() -> PathFunctions:
    """The functions, built once."""
    return PathFunctions()


def tilted_pose_expr(lifted: tuple[Any, Any, Any, Any], axis: Any, tilt: Any) -> tuple[Any, Any, Any]:
    r"""Tool position, rotation and extent of the outputs of ``lift_expr``.

    The tool stands on the surface, then turns by the Gibbs vector g in its own axes (Rodrigues):

        R = (x, y, z) (I + 2 / (1 + |g|^2) ([g] + [g]^2)),    and without a tilt R = (x, y, z) to the last bit

    Args:
        lifted: Position, normal, local z and extent.
        axis: (cos, sin) of the spin.
        tilt: g, (3, 1).
    """
    position, normal, _, extent = lifted
    z = -normal
    along_x = ca.vertcat(axis, 0)
    x = along_x - z * ca.dot(z, along_x)
    x = x / ca.norm_2(x)
    cross = ca.skew(tilt)
    turned = ca.SX.eye(3) + 2 / (1 + ca.dot(tilt, tilt)) * (cross + cross @ cross)
    return position, ca.horzcat(x, ca.cross(z, x), z) @ turned, extent


@lru_cache(maxsize=8)
def build_pose(shape: tuple[int, int, int]) -> Any:
    """The pose, position (3) and rotation (9, row by row), the extent, and whether the part is there.

    Inputs: piece (WIDTH), surface (15), t, (cos, sin) of the spin, boundary of so many sides, edges and slots.
    """
    piece, surface, t = ca.SX.sym("piece", WIDTH), ca.SX.sym("surface", 15), ca.SX.sym("t")
    axis, edge = ca.SX.sym("axis", 2), ca.SX.sym("edge", coefficient_count(shape))
    xy = curve_expr(piece, t)[0]
    position, rotation, extent = tilted_pose_expr(
        lift_expr(surface, xy, height_expr(piece, t)[0]), axis, tilt_expr(piece, t)
    )
    outputs = ca.cse([position, ca.vec(rotation.T), extent, inside_expr(edge, xy, shape)])
    return ca.Function("pose", [piece, surface, t, axis, edge], outputs)
