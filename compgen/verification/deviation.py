"""The verdict: what the twin did with the text, against the true path, against the bounds."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, frozen, own, row_norms
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.core.findings import Finding, Level
from compgen.core.units import MDEG, UM
from compgen.planning.exact_path import parameter_expr, path_functions
from compgen.planning.toolpath import ToolPath
from compgen.verification.twin import Ride

FEW = 64  # of so many values one is looked at first, for where the percentile lies

UNKNOWN = -1.0  # in place of a parameter
#: size of the position error; along the direction of travel; across it, in the surface; along the tool axis, away from
#: the surface; between the tool axes
COMPONENTS = ("total", "feed", "cross", "normal", "axis_angle")


@dataclass(frozen=True, slots=True)
class Extent:
    """How large one component gets along the path, [m] or [rad]."""

    max: float
    p99: float  # what 99 % of the path's length stay at or below
    rms: float
    where: float  # [m] arc length at the largest


@dataclass(frozen=True, eq=False, slots=True)
class Deviation:
    """Actual against true pose at M samples of a ride."""

    arc: Array  # (M,) [m]
    time: Array  # (M,) [s]
    error: Array  # (M, 3) [m] base axes
    normal: Array  # (M,) [m] along the tool axis, away from the surface
    extents: dict[str, Extent]  # of COMPONENTS

    def __post_init__(self) -> None:
        own(self, arc=("M",), time=("M",), error=("M", 3), normal=("M",))

    def total(self) -> Array:
        """Size of the position error, (M,) [m]."""
        return row_norms(self.error)


@dataclass(frozen=True, slots=True)
class Bounds:
    """The promise of a path: largest allowed values after correction; None asks for nothing."""

    max: float | None = None  # [m]
    p99: float | None = None  # [m]
    rms: float | None = None  # [m]
    feed: float | None = None  # [m] largest along feed
    cross: float | None = None  # [m]
    normal: float | None = None  # [m]
    axis: float | None = None  # [rad]


def deviation(path: ToolPath, *rides: Ride) -> Deviation:
    """Compare each sample with the true path at the same fraction of the same segment."""
    return deviations(path, sum(len(ride.time) for ride in rides), rides)


def deviations(path: ToolPath, samples: int, rides: Iterable[Ride]) -> Deviation:
    """The same for a ride that comes in stretches, of so many samples in all, keeping no more than the comparison."""
    arc, time, error = np.empty(samples), np.empty(samples), np.empty((samples, 3))
    feed, cross, normal, angle = (np.empty(samples) for _ in range(4))
    at = 0
    for ride in rides:
        rows = slice(at, at + len(ride.time))
        at, time[rows] = rows.stop, ride.time
        arc[rows], error[rows], parts = _compared(path, ride)
        feed[rows], cross[rows], normal[rows], angle[rows] = parts.T
    weight = _lengths(arc)
    extents = {"total": _extent(row_norms(error), weight, arc)}
    for name, values in zip(COMPONENTS[1:], (feed, cross, normal, angle)):
        extents[name] = _extent(np.abs(values), weight, arc)
    return Deviation(frozen(arc), frozen(time), frozen(error), frozen(normal), extents)


def _lengths(arc: Array) -> Array:
    """Length of path that each sample stands for, (M,) [m]."""
    gaps = np.diff(arc)
    lengths = np.zeros_like(arc)
    lengths[:-1] = gaps
    lengths[1:] += gaps
    lengths /= 2
    return lengths


def _compared(path: ToolPath, ride: Ride) -> tuple[Array, Array, Array]:
    """arc (M,), error (M, 3), and feed, cross, normal and angle (M, 4) of samples."""
    segment, fraction = ride.segment, ride.fraction
    first, last = int(segment[0]), int(segment[-1]) + 1
    gaps = np.diff(path.arc[first : last + 1])
    exact, piece = path.exact, path.piece[segment]
    known = np.full((1, 1), UNKNOWN)
    odd = np.isnan(path.slope[first:last, 0])
    if odd.any():
        rows = np.flatnonzero(odd[segment - first])
        known = np.full((len(segment), 1), UNKNOWN)
        mine = segment[rows]
        known[rows, 0] = exact.parameter_by_newton(piece[rows], path.span[mine], gaps[mine - first], fraction[rows])
    error, parts = evaluate(
        _parts(), IndexedRows(exact.coefficients, piece), exact.surface.coefficients(), exact.spin_vector(),
        IndexedRows(path.span, segment), IndexedRows(path.slope, segment), fraction[:, None], known,
        ride.position, ride.rotation.reshape(-1, 9),
    )  # fmt: skip
    return path.arc[segment] + fraction * gaps[segment - first], error, parts


@lru_cache(maxsize=1)
def _parts() -> Any:
    """Of a place on the path and an actual pose: the error in base axes (3); along feed, across, normal, of the axis.

    Inputs: piece (22), surface (15) and axis (2) as ``ExactPath`` has them; the segment's span (2) and slope (2), the
    fraction of it; its parameter there, where that is known; actual position (3), rotation (9, row by row).
    """
    widths = {"piece": 22, "surface": 15, "axis": 2, "span": 2, "slope": 2, "u": 1, "known": 1, "q": 3, "s": 9}
    inputs = [ca.SX.sym(name, size) for name, size in widths.items()]
    piece, surface, axis, span, slope, u, known, q, s = inputs
    t = ca.if_else(known > UNKNOWN, known, parameter_expr(span, slope, u))
    p, r, travel = path_functions().pose_and_travel(piece, surface, t, axis)
    rotation = ca.reshape(r, 3, 3).T
    axis, real, error = rotation[:, 2], ca.vertcat(s[2], s[5], s[8]), q - p
    # approach and retract run along the axis: cross feed is then the tool's y, feed its x
    ahead = ca.if_else(ca.norm_2(ca.cross(travel, axis)) > 1e-3, travel, rotation[:, 0])
    side = ca.cross(ahead, axis)
    side = side / ca.norm_2(side)
    angle = ca.atan2(ca.norm_2(ca.cross(axis, real)), ca.dot(axis, real))
    parts = ca.vertcat(ca.dot(error, ca.cross(axis, side)), ca.dot(error, side), ca.dot(error, -axis), angle)
    return ca.Function("parts", inputs, ca.cse([error, parts]))


def _extent(values: Array, weight: Array, arc: Array) -> Extent:
    """Of sizes (M,), each for a length of path (M,) [m] at an arc length (M,) [m]."""
    worst = int(np.argmax(values))
    return Extent(float(values[worst]), percentile99(values, weight), rms(values, weight), float(arc[worst]))


def percentile99(values: Array, weight: Array) -> float:
    """The value that 99 % of the path's length stay at or below."""
    whole = float(np.sum(weight))
    goal, below = 0.99 * whole, 0.0
    # a few values tell from where on to look: what lies there is sorted, if it is the last hundredth and more
    some = np.sort(values[::FEW])
    for share in (0.98, 0.9):
        tail = np.flatnonzero(values >= some[int(share * len(some))])
        left = whole - float(np.sum(weight[tail]))
        if left < goal:
            values, weight, below = values[tail], weight[tail], left
            break
    order = np.argsort(values)
    passed = below + np.cumsum(weight[order])
    return float(values[order[min(int(np.searchsorted(passed, goal)), len(order) - 1)]])


def rms(values: Array, weight: Array) -> float:
    """Root of the mean square along the path."""
    square = values * values
    square *= weight
    return float(np.sqrt(np.sum(square) / np.sum(weight)))


def statistics(deviation: Deviation) -> dict[str, dict[str, float]]:
    """Largest, 99th percentile and rms of each component: total, feed, cross, normal [um], axis angle [mdeg]."""
    table = {}
    for name, extent in deviation.extents.items():
        factor, unit = (MDEG, "mdeg") if name == "axis_angle" else (UM, "um")
        table[name] = {f"{key}_{unit}": getattr(extent, key) / factor for key in ("max", "p99", "rms")}
    return table


def judge(deviation: Deviation, bounds: Bounds) -> list[Finding]:
    """One finding for each bound that is broken, naming where it is worst."""
    total, feed, cross, normal, angle = (deviation.extents[name] for name in COMPONENTS)
    checks = [
        ("max_um", total, total.max, bounds.max),
        ("p99_um", total, total.p99, bounds.p99),
        ("rms_um", total, total.rms, bounds.rms),
        ("feed_um", feed, feed.max, bounds.feed),
        ("cross_um", cross, cross.max, bounds.cross),
        ("normal_um", normal, normal.max, bounds.normal),
        ("axis_mdeg", angle, angle.max, bounds.axis),
    ]
    found = []
    for key, extent, value, bound in checks:
        if bound is not None and not value <= bound:
            unit = key.split("_")[1]
            factor = MDEG if unit == "mdeg" else UM
            told = f"{value / factor:.3f} {unit} after correction is above bounds.{key} = {bound / factor:g}"
            found.append(Finding(Level.OUTSIDE, f"bounds.{key}", f"{told}; worst {extent.where:.3f} m along the path"))
    return found
