r"""Piecewise plane curves: every pattern is one.

One formula covers straight sweeps, arcs, Archimedean spirals, smooth turns and moves along the tool axis, so that
nothing downstream asks which it is. On each piece, t from 0 to 1:

    p(t) = sum_k c_k t^k + (r0 + r1 t) (cos, sin)(f0 + f1 t)        h(t) = h0 + h1 t        g(t) = (1 - t) g0

with p in the local plane of the surface, h the height above it along the normal, and g the Gibbs vector (the axis times
tan of half the angle) by which a lead-in tilts the tool in its own axes. Pieces join end to end; where
``stop`` is false the next piece continues with the same direction and curvature, where it is true the robot stops.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import pi
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own
from compgen.core.evaluation import IndexedRows, evaluate

DEGREE = 7


@dataclass(frozen=True, eq=False, slots=True)
class PiecewiseCurve:
    """A plane curve of K pieces, in the order they are driven, with its height above the surface."""

    poly: Array  # (K, 8, 2) [m] c_k
    polar: Array  # (K, 4) [m, m, rad, rad] r0, r1, f0, f1
    lift: Array  # (K, 2) [m] h0, h1
    stop: BoolArray  # (K,) the robot stops at the end of the piece
    working: BoolArray  # (K,) the tool may touch the part here
    tilt: Array  # (K, 3) [-] g0

    def __post_init__(self) -> None:
        own(self, poly=("K", DEGREE + 1, 2), polar=("K", 4), lift=("K", 2), stop=("K",), working=("K",), tilt=("K", 3))

    def coefficients(self) -> Array:
        """A row for each piece, (K, 25), as ``curve_expr``, ``height_expr`` and ``tilt_expr`` take it."""
        return np.hstack([self.poly.reshape(len(self.poly), -1), self.polar, self.lift, self.tilt])

    def derivatives(self, piece: IntArray, t: Array) -> tuple[Array, Array, Array]:
        """p, dp/dt and d2p/dt2 at parameters t (M,) of pieces (M,), (M, 2) each [m]."""
        p, d1, d2, _, _ = evaluate(
            _build_derivatives(), IndexedRows(self.coefficients(), piece), np.asarray(t, dtype=float)[:, None]
        )
        return p, d1, d2

    def height(self, piece: IntArray, t: Array) -> tuple[Array, Array]:
        """h and dh/dt at parameters t (M,) of pieces (M,), (M,) each [m]."""
        h0, h1 = self.lift[piece].T
        return h0 + h1 * t, h1

    def subset(self, rows: IntArray) -> "PiecewiseCurve":
        """The pieces at these rows, in their order."""
        return PiecewiseCurve(*(getattr(self, name)[rows] for name in PiecewiseCurve.__slots__))

    def end(self) -> tuple[float, float]:
        """Where the last piece ends [m]."""
        p, _, _ = self.derivatives(np.array([len(self.poly) - 1]), np.array([1.0]))
        return float(p[0, 0]), float(p[0, 1])

    def start(self) -> tuple[float, float]:
        """Where the first piece starts [m]."""
        p, _, _ = self.derivatives(np.array([0]), np.array([0.0]))
        return float(p[0, 0]), float(p[0, 1])


def curve_expr(piece: Any, t: Any) -> tuple[Any, Any, Any]:
    """p, dp/dt and d2p/dt2, (2, 1) each [m], of a piece's coefficients (25, 1) at a parameter."""
    c, (r0, r1, f0, f1) = ca.reshape(piece[:16], 2, DEGREE + 1), ca.vertsplit(piece[16:20])
    p, d1, d2 = c[:, DEGREE], ca.SX.zeros(2), ca.SX.zeros(2)
    for k in range(DEGREE - 1, -1, -1):
        p, d1, d2 = p * t + c[:, k], d1 * t + p, d2 * t + 2 * d1
    r, angle = r0 + r1 * t, f0 + f1 * t
    out = ca.vertcat(ca.cos(angle), ca.sin(angle))
    across = ca.vertcat(-out[1], out[0])
    return p + r * out, d1 + r1 * out + r * f1 * across, d2 + 2 * r1 * f1 * across - r * f1**2 * out


def height_expr(piece: Any, t: Any) -> tuple[Any, Any]:
    """h and dh/dt [m] of a piece's coefficients (25, 1) at a parameter."""
    return piece[20] + piece[21] * t, piece[21]


def tilt_expr(piece: Any, t: Any) -> Any:
    """The Gibbs vector g (3, 1) of a piece's coefficients (25, 1) at a parameter."""
    return (1 - t) * piece[22:25]


@lru_cache(maxsize=1)
def _build_derivatives() -> Any:
    """(piece (25), t) -> p (2), dp/dt (2), d2p/dt2 (2), h, dh/dt."""
    piece, t = ca.SX.sym("piece", 25), ca.SX.sym("t")
    return ca.Function("curve", [piece, t], [*curve_expr(piece, t), *height_expr(piece, t)])


def join(*curves: PiecewiseCurve) -> PiecewiseCurve:
    """Curves one after the other."""
    return PiecewiseCurve(*(np.concatenate([getattr(c, f) for c in curves]) for f in PiecewiseCurve.__slots__))


def line(
    start: Sequence[float] | Array, end: Sequence[float], *, stop: bool = False, working: bool = True
) -> PiecewiseCurve:
    """A straight line from start to end, (x, y) or (x, y, height) [m]."""
    return lines(np.array([start], dtype=float), np.array([end], dtype=float), np.array([stop]), np.array([working]))


def tilted(curve: PiecewiseCurve, tilt: Array) -> PiecewiseCurve:
    """A curve along each of whose pieces the tool turns back from a tilt, (3,) as a Gibbs vector in its own axes."""
    return replace(curve, tilt=np.tile(tilt, (len(curve.poly), 1)))


def lines(start: Array, end: Array, stop: BoolArray, working: BoolArray) -> PiecewiseCurve:
    """K straight lines from starts to ends, (K, 2) or (K, 3) [m]; ``stop`` and ``working`` (K,)."""
    poly, lift = np.zeros((len(start), DEGREE + 1, 2)), np.zeros((len(start), 2))
    poly[:, 0], poly[:, 1] = start[:, :2], end[:, :2] - start[:, :2]
    if start.shape[1] == 3:
        lift[:, 0], lift[:, 1] = start[:, 2], end[:, 2] - start[:, 2]
    return PiecewiseCurve(poly, np.zeros((len(start), 4)), lift, stop, working, np.zeros((len(start), 3)))


def spiral(
    centre: Sequence[float],
    radii: tuple[float, float],
    angles: tuple[float, float],
    *,
    stop: bool = False,
    working: bool = True,
) -> PiecewiseCurve:
    """Archimedean spiral about a centre (x, y) [m], radii [m] over angles [rad]; equal radii make an arc.

    It is cut into quarter turns; ``stop`` holds at the end of the last.
    """
    quarters = max(1, int(np.ceil(abs(angles[1] - angles[0]) / (pi / 2) - 1e-9)))
    r, f = np.linspace(*radii, quarters + 1), np.linspace(*angles, quarters + 1)
    poly = np.zeros((quarters, DEGREE + 1, 2))
    poly[:, 0] = centre
    polar = np.column_stack([r[:-1], np.diff(r), f[:-1], np.diff(f)])
    stops = np.zeros(quarters, dtype=bool)
    stops[-1] = stop
    upright = np.zeros((quarters, 3))
    return PiecewiseCurve(poly, polar, np.zeros((quarters, 2)), stops, np.full(quarters, working), upright)


def u_turn(start: Sequence[float], end: Sequence[float], heading: Sequence[float], reach: float) -> PiecewiseCurve:
    r"""A smooth turn back: leaves along ``heading``, arrives against it, with no curvature at either end.

    Septic Hermite with p' = +/- ``reach`` heading and p'' = p''' = 0 at the ends, so that curvature and its rate
    run on without a jump and the robot need not stop.
    """
    a, b, v = (np.array([x], dtype=float) for x in (start, end, heading))
    return u_turns(a, b, v, reach)


def u_turns(start: Array, end: Array, heading: Array, reach: float) -> PiecewiseCurve:
    """K smooth turns back as ``u_turn`` has them; start, end [m] and heading (K, 2) each, reach [m]."""
    K = len(start)
    c = np.zeros((K, DEGREE + 1, 2))
    c[:, 0], c[:, 1] = start, reach * heading
    gap, slope = end - start - c[:, 1], -reach * heading - c[:, 1]
    # c4..c7 from p(1), p'(1), p''(1) = 0, p'''(1) = 0
    system = np.array([[1, 1, 1, 1], [4, 5, 6, 7], [12, 20, 30, 42], [24, 60, 120, 210]], dtype=float)
    c[:, 4:] = np.linalg.solve(system, np.stack([gap, slope, 0 * gap, 0 * gap], axis=1))
    never = np.zeros(K, dtype=bool)
    return PiecewiseCurve(c, np.zeros((K, 4)), np.zeros((K, 2)), never, never, np.zeros((K, 3)))
