r"""Piecewise plane curves: every pattern is one.

One formula covers straight sweeps, arcs, Archimedean spirals, smooth turns and moves along the tool axis, so that
nothing downstream asks which it is. On each piece, t from 0 to 1:

    p(t) = sum_k c_k t^k + (r0 + r1 t) (cos, sin)(f0 + f1 t)        h(t) = sum_k h_k t^k        g(t) = sum_k g_k t^k

with p in the local plane of the surface, h the height above it along the normal, and g the Gibbs vector (the axis times
tan of half the angle) by which the tool is tilted in its own axes. Pieces join end to end; where
``stop`` is false the next piece continues with the same direction and curvature, where it is true the robot stops.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import comb, pi
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.core.evaluation import IndexedRows, evaluate

DEGREE = 7  # of p
CUBIC = 3  # the degree of h and g
SEGMENTS = 3  # of a piece at least
ANGLES_EQUAL = 1e-11  # rad, and Gibbs vectors
_BINOMIALS = np.array([[comb(k, i) for k in range(DEGREE + 1)] for i in range(DEGREE + 1)], dtype=float)
WIDTH = 2 * (DEGREE + 1) + 4 + 4 * (CUBIC + 1)  # coefficients of a piece


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    poly=("K", DEGREE + 1, 2),
    polar=("K", 4),
    lift=("K", CUBIC + 1),
    stop=("K",),
    working=("K",),
    tilt=("K", CUBIC + 1, 3),
    pace=("K",),
    least=("K",),
)
class PiecewiseCurve:
    """A plane curve of K pieces, in the order they are driven, with its height above the surface."""

    poly: Array  # (K, 8, 2) [m] c_k
    polar: Array  # (K, 4) [m, m, rad, rad] r0, r1, f0, f1
    lift: Array  # (K, 4) [m] h_k
    stop: BoolArray  # (K,) the robot stops at the end of the piece
    working: BoolArray  # (K,) the tool may touch the part here
    tilt: Array  # (K, 4, 3) [-] g_k
    pace: Array  # (K,) share of the feed that the piece is driven at
    least: IntArray  # (K,) segments that the piece is cut into at least: joint motion is a curve and not a chord

    def coefficients(self) -> Array:
        """A row for each piece, (K, WIDTH), as ``curve_expr``, ``height_expr`` and ``tilt_expr`` take it."""
        K = len(self.poly)
        return np.hstack([self.poly.reshape(K, -1), self.polar, self.lift, self.tilt.reshape(K, -1)])

    def derivatives(self, piece: IntArray, t: Array) -> tuple[Array, Array, Array]:
        """p, dp/dt and d2p/dt2 at parameters t (M,) of pieces (M,), (M, 2) each [m]."""
        p, d1, d2 = evaluate(
            _build_derivatives(), IndexedRows(self.coefficients(), piece), np.asarray(t, dtype=float)[:, None]
        )
        return p, d1, d2

    def height(self, piece: IntArray, t: Array) -> tuple[Array, Array]:
        """h and dh/dt at parameters t (M,) of pieces (M,), (M,) each [m]."""
        h = self.lift[piece].T
        return h[0] + t * (h[1] + t * (h[2] + t * h[3])), h[1] + t * (2 * h[2] + 3 * t * h[3])

    def turned(self, angle: float) -> "PiecewiseCurve":
        """The curve turned about the local origin [rad]; the tool keeps its axes."""
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, -s], [s, c]])
        return replace(self, poly=self.poly @ turn.T, polar=self.polar + np.array([0.0, 0.0, angle, 0.0]))

    def subset(self, rows: IntArray) -> "PiecewiseCurve":
        """The pieces at these rows, in their order."""
        return PiecewiseCurve(**{name: getattr(self, name)[rows] for name in PiecewiseCurve.__slots__})

    def cut(self, count: IntArray) -> "PiecewiseCurve":
        """The same curve with each piece cut into so many (K,), each with a parameter from 0 to 1 of its own."""
        piece = np.repeat(np.arange(len(count)), count)
        width = 1.0 / count[piece]
        start = (np.arange(len(piece)) - (np.cumsum(count) - count)[piece]) * width
        rows, last = self.subset(piece), np.append(piece[1:] != piece[:-1], True)
        r0, r1, f0, f1 = rows.polar.T
        return replace(
            rows,
            poly=_parts(rows.poly, start, width),
            polar=np.column_stack([r0 + r1 * start, r1 * width, f0 + f1 * start, f1 * width]),
            lift=_parts(rows.lift, start, width),
            tilt=_parts(rows.tilt, start, width),
            stop=rows.stop & last,
            least=np.ceil(rows.least * width).astype(np.int64),
        )

    def start(self) -> tuple[Array, Array]:
        """Where the first piece starts, (3,) x, y and height [m], and its tilt there, (3,)."""
        return self.place_and_tilt(0, 0.0)

    def end(self) -> tuple[Array, Array]:
        """Where the last piece ends, (3,) x, y and height [m], and its tilt there, (3,)."""
        return self.place_and_tilt(len(self.poly) - 1, 1.0)

    def place_and_tilt(self, piece: int, t: float) -> tuple[Array, Array]:
        """x, y and height, (3,) [m], and the tilt, (3,), at a parameter of a piece."""
        row, at = np.array([piece]), np.array([t])
        place = np.append(self.derivatives(row, at)[0][0], self.height(row, at)[0])
        return place, np.asarray(t ** np.arange(CUBIC + 1) @ self.tilt[piece])


def _parts(c: Array, start: Array, width: Array) -> Array:
    """Coefficients (P, D, ...) of polynomials in t as those in u, where t = start + width u."""
    j, k = np.ogrid[: c.shape[1], : c.shape[1]]
    powers = np.where(k >= j, _BINOMIALS[: len(j), : len(j)] * start[:, None, None] ** np.maximum(k - j, 0), 0.0)
    return np.asarray(np.einsum("pjk,pk...->pj...", powers * width[:, None, None] ** j, c))


def curve_expr(piece: Any, t: Any) -> tuple[Any, Any, Any]:
    """p, dp/dt and d2p/dt2, (2, 1) each [m], of a piece's coefficients (WIDTH, 1) at a parameter."""
    (r0, r1, f0, f1) = ca.vertsplit(piece[16:20])
    p, d1, d2 = _polynomial(ca.reshape(piece[:16], 2, DEGREE + 1), t)
    r, angle = r0 + r1 * t, f0 + f1 * t
    out = ca.vertcat(ca.cos(angle), ca.sin(angle))
    across = ca.vertcat(-out[1], out[0])
    return p + r * out, d1 + r1 * out + r * f1 * across, d2 + 2 * r1 * f1 * across - r * f1**2 * out


def height_expr(piece: Any, t: Any) -> tuple[Any, Any, Any]:
    """h, dh/dt and d2h/dt2 [m] of a piece's coefficients (WIDTH, 1) at a parameter."""
    return _polynomial(ca.reshape(piece[20:24], 1, CUBIC + 1), t)


def tilt_expr(piece: Any, t: Any) -> Any:
    """The Gibbs vector g (3, 1) of a piece's coefficients (WIDTH, 1) at a parameter."""
    return _polynomial(ca.reshape(piece[24:WIDTH], 3, CUBIC + 1), t)[0]


def _polynomial(c: Any, t: Any) -> tuple[Any, Any, Any]:
    """sum_k c_k t^k of columns c_k, and its first two derivatives."""
    p, d1, d2 = c[:, -1], ca.SX.zeros(c.shape[0]), ca.SX.zeros(c.shape[0])
    for k in range(c.shape[1] - 2, -1, -1):
        p, d1, d2 = p * t + c[:, k], d1 * t + p, d2 * t + 2 * d1
    return p, d1, d2


@lru_cache(maxsize=1)
def _build_derivatives() -> Any:
    """(piece (WIDTH), t) -> p (2), dp/dt (2), d2p/dt2 (2)."""
    piece, t = ca.SX.sym("piece", WIDTH), ca.SX.sym("t")
    return ca.Function("curve", [piece, t], [*curve_expr(piece, t)])


def join(*curves: PiecewiseCurve) -> PiecewiseCurve:
    """Curves one after the other."""
    return PiecewiseCurve(**{f: np.concatenate([getattr(c, f) for c in curves]) for f in PiecewiseCurve.__slots__})


def goes_on(curve: PiecewiseCurve) -> BoolArray:
    """Whether each piece but the last runs on into the next one as the same curve, (K - 1,).

    Then the parameter may run on beyond 1: p(t + 1), with the binomials of (t + 1)^k.
    """
    cubic = _BINOMIALS[: CUBIC + 1, : CUBIC + 1]
    a, b = curve.subset(np.arange(len(curve.poly) - 1)), curve.subset(np.arange(1, len(curve.poly)))
    size = 1e-12 + 1e-12 * np.abs(curve.polar[:, 0]).max(initial=0.0)
    polar = b.polar - np.column_stack([a.polar[:, 0] + a.polar[:, 1], a.polar[:, 1], *a.polar[:, 2:].T])
    polar[:, 2] -= a.polar[:, 3]
    return np.asarray(
        (np.abs(np.einsum("ij,kjc->kic", _BINOMIALS, a.poly) - b.poly).max(axis=(1, 2)) < size)
        & (np.abs(np.einsum("ij,kj->ki", cubic, a.lift) - b.lift).max(axis=1) < size)
        & (np.abs(np.einsum("ij,kjc->kic", cubic, a.tilt) - b.tilt).max(axis=(1, 2)) < ANGLES_EQUAL)
        & (np.abs(polar[:, :2]).max(axis=1) < size)
        & (np.abs(polar[:, 2:]).max(axis=1) < ANGLES_EQUAL)
        & (a.working == b.working)
        & (a.pace == b.pace)
    )


def line(
    start: Sequence[float] | Array, end: Sequence[float] | Array, *, stop: bool = False, working: bool = True
) -> PiecewiseCurve:
    """A straight line from start to end, (x, y) or (x, y, height) [m]."""
    return lines(np.array([start], dtype=float), np.array([end], dtype=float), np.array([stop]), np.array([working]))


def tilted(curve: PiecewiseCurve, start: Array, end: Array) -> PiecewiseCurve:
    """A curve along each of whose pieces the tool turns from tilt to tilt, (3,) Gibbs vectors in its own axes."""
    return replace(curve, tilt=np.tile([start, end - start, 0 * start, 0 * start], (len(curve.poly), 1, 1)))


def lines(start: Array, end: Array, stop: BoolArray, working: BoolArray) -> PiecewiseCurve:
    """K straight lines from starts to ends, (K, 2) or (K, 3) [m]; ``stop`` and ``working`` (K,)."""
    poly, lift = np.zeros((len(start), DEGREE + 1, 2)), np.zeros((len(start), CUBIC + 1))
    poly[:, 0], poly[:, 1] = start[:, :2], end[:, :2] - start[:, :2]
    if start.shape[1] == 3:
        lift[:, 0], lift[:, 1] = start[:, 2], end[:, 2] - start[:, 2]
    return _plain(poly=poly, polar=np.zeros((len(start), 4)), lift=lift, stop=stop, working=working)


def spiral(
    centre: Sequence[float], radii: tuple[float, float], angles: tuple[float, float], *, stop: bool = False
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
    flat = np.zeros((quarters, CUBIC + 1))
    return _plain(poly=poly, polar=polar, lift=flat, stop=stops, working=np.ones(quarters, dtype=bool))


def _plain(poly: Array, polar: Array, lift: Array, stop: BoolArray, working: BoolArray) -> PiecewiseCurve:
    """Pieces along which the tool stands on the surface, at the feed."""
    K = len(poly)
    tilt, pace, least = np.zeros((K, CUBIC + 1, 3)), np.ones(K), np.full(K, SEGMENTS)
    return PiecewiseCurve(
        poly=poly, polar=polar, lift=lift, stop=stop, working=working, tilt=tilt, pace=pace, least=least
    )


def u_turns(start: Array, end: Array, heading: Array, reach: float) -> PiecewiseCurve:
    r"""K smooth turns back: each leaves along its heading, arrives against it, with no curvature at either end.

    Septic Hermite with p' = +/- ``reach`` heading and p'' = p''' = 0 at the ends, so that curvature and its rate
    run on without a jump and the robot need not stop.

    Args:
        start: (K, 2) [m].
        end: (K, 2) [m].
        heading: (K, 2) unit vectors.
        reach: Of the slope at both ends [m].
    """
    K = len(start)
    c = np.zeros((K, DEGREE + 1, 2))
    c[:, 0], c[:, 1] = start, reach * heading
    gap, slope = end - start - c[:, 1], -reach * heading - c[:, 1]
    # c4..c7 from p(1), p'(1), p''(1) = 0, p'''(1) = 0
    system = np.array([[1, 1, 1, 1], [4, 5, 6, 7], [12, 20, 30, 42], [24, 60, 120, 210]], dtype=float)
    c[:, 4:] = np.linalg.solve(system, np.stack([gap, slope, 0 * gap, 0 * gap], axis=1))
    never = np.zeros(K, dtype=bool)
    return _plain(poly=c, polar=np.zeros((K, 4)), lift=np.zeros((K, CUBIC + 1)), stop=never, working=never)
