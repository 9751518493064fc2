r"""How far the real tool is from the true path: what the twin did with the text, sample by sample.

Each sample is compared with the path at the same fraction of the same segment. With the tool's axis z, the direction of
travel t and the error e = actual - target,

    side = t x z / |t x z|,    feed = e . (z x side),    cross = e . side,    normal = - e . z

and statistics weigh a sample by the length of path that it stands for.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, owns, rms, row_norms
from compgen.core.evaluation import IndexedRows, evaluate
from compgen.core.pose import Pose
from compgen.core.units import MDEG, UM
from compgen.planning.curves import WIDTH
from compgen.planning.exact_path import parameter_expr, path_functions
from compgen.planning.toolpath import ToolPath
from compgen.verification.twin import Execution, owning_segments

SUBSAMPLE = 64  # one of so many values tells first about where the percentile lies
UNKNOWN = -1.0  # in place of a parameter
#: size of the position error; along the direction of travel and across it, square to the tool; along the tool axis,
#: away from the part; between the tool axes
COMPONENTS = ("total", "feed", "cross", "normal", "axis_angle")


@dataclass(frozen=True, slots=True)
class Sizes:
    """How large an error gets along a path, [m] or [rad]."""

    max: float
    p99: float  # what 99 % of the path's length stay at or below
    rms: float


@dataclass(frozen=True, slots=True)
class Extent(Sizes):
    """How large one component of the error gets, and where."""

    where: float  # [m] arc length at the largest


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(arc=("M",), time=("M",), error=("M", 3), normal=("M",))
class Deviation:
    """Actual against true pose at M samples of an execution."""

    arc: Array  # (M,) [m]
    time: Array  # (M,) [s]
    error: Array  # (M, 3) [m] base axes
    normal: Array  # (M,) [m] along the tool axis, away from the surface
    extents: dict[str, Extent]  # of COMPONENTS
    on_part: dict[str, Extent]  # of COMPONENTS where the tool touches; the same for a path that never does

    def total(self) -> Array:
        """Size of the position error, (M,) [m]."""
        return row_norms(self.error)


def deviation_from_path(path: ToolPath, executions: Iterable[Execution], samples: int) -> Deviation:
    """The deviation of a program's execution, which may come in chunks: no more than the comparison is kept.

    Args:
        path: What the program was made from.
        executions: One after the other along the program.
        samples: Of all of them.
    """
    arc, time, error = np.empty(samples), np.empty(samples), np.empty((samples, 3))
    feed, cross, normal, angle = (np.empty(samples) for _ in range(4))
    touching = np.empty(samples, dtype=bool)
    on_part = path.touching_segments()
    begin = 0
    for execution in executions:
        rows = slice(begin, begin + len(execution.time))
        begin, time[rows] = rows.stop, execution.time
        segment = owning_segments(on_part, execution.segment, np.flatnonzero(execution.fraction == 0))
        touching[rows] = on_part[segment]
        fraction = np.where(segment < execution.segment, 1.0, execution.fraction)
        arc[rows], error[rows], components = _compare(path, execution.actual, segment, fraction)
        feed[rows], cross[rows], normal[rows], angle[rows] = components.T
    weight = sample_lengths(arc)
    sizes = dict(zip(COMPONENTS, (row_norms(error), feed, cross, normal, angle), strict=True))
    extents = {name: extent_of(np.abs(values), weight, arc) for name, values in sizes.items()}
    touched = extents
    if touching.any() and not touching.all():
        part = weight[touching], arc[touching]
        touched = {name: extent_of(np.abs(values[touching]), *part) for name, values in sizes.items()}
    return Deviation(
        arc=frozen(arc), time=frozen(time), error=frozen(error), normal=frozen(normal), extents=extents, on_part=touched
    )


def sample_lengths(arc: Array, counted: BoolArray | None = None) -> Array:
    """Length of path that each sample stands for, (M,) [m], of the gaps between samples that count, (M - 1,)."""
    gaps = np.abs(np.diff(arc)) * (1.0 if counted is None else counted)
    lengths = np.zeros_like(arc)
    lengths[:-1] = gaps
    lengths[1:] += gaps
    lengths /= 2
    return lengths


def _compare(path: ToolPath, actual: Pose, segment: IntArray, fraction: Array) -> tuple[Array, Array, Array]:
    """arc (M,), error (M, 3), and feed, cross, normal and angle (M, 4) of samples."""
    first, last = int(segment[0]), int(segment[-1]) + 1
    gaps = np.diff(path.arc[first : last + 1])
    exact, piece = path.exact, path.piece[segment]
    parameter = np.full((1, 1), UNKNOWN)
    uneven = np.isnan(path.slope[first:last, 0])
    if uneven.any():
        rows = np.flatnonzero(uneven[segment - first])
        parameter = np.full((len(segment), 1), UNKNOWN)
        k = segment[rows]
        parameter[rows, 0] = exact.parameter_by_newton(piece[rows], path.span[k], gaps[k - first], fraction[rows])
    actual = exact.in_frame(actual)
    laid = IndexedRows(exact.coefficients, piece), exact.surface.coefficients(), exact.spin_vector()
    place = IndexedRows(path.span, segment), IndexedRows(path.slope, segment), fraction[:, None], parameter
    error, components = evaluate(_build_components(), *laid, *place, actual.position, actual.rotation_rows)
    if exact.frame is not None:
        error = error @ exact.frame.rotation.T
    return path.arc[segment] + fraction * gaps[segment - first], error, components


@lru_cache(maxsize=1)
def _build_components() -> Any:
    """Of a point of the path and an actual pose: the error in base axes (3); feed, cross, normal, axis angle (4).

    Inputs: piece, surface (15) and axis (2) as ``ExactPath`` has them; the segment's span (2) and slope (2), the
    fraction of it; its parameter there, where that is known; actual position (3), rotation (9, row by row).
    """
    widths = {"piece": WIDTH, "surface": 15, "axis": 2, "span": 2, "slope": 2, "u": 1, "known": 1, "q": 3, "s": 9}
    inputs = [ca.SX.sym(name, size) for name, size in widths.items()]
    piece, surface, axis, span, slope, u, known, q, s = inputs
    t = ca.if_else(known > UNKNOWN, known, parameter_expr(span, slope, u))
    p, r, travel = path_functions().pose_and_travel(piece, surface, t, axis)
    rotation = ca.reshape(r, 3, 3).T
    axis, actual_axis, error = rotation[:, 2], ca.vertcat(s[2], s[5], s[8]), q - p
    # approach and retract run along the axis: cross feed is then the tool's y, feed its x
    ahead = ca.if_else(ca.norm_2(ca.cross(travel, axis)) > 1e-3, travel, rotation[:, 0])
    side = ca.cross(ahead, axis)
    side = side / ca.norm_2(side)
    angle = ca.atan2(ca.norm_2(ca.cross(axis, actual_axis)), ca.dot(axis, actual_axis))
    components = ca.vertcat(ca.dot(error, ca.cross(axis, side)), ca.dot(error, side), ca.dot(error, -axis), angle)
    return ca.Function("components", inputs, ca.cse([error, components]))


def extent_of(values: Array, weight: Array, arc: Array) -> Extent:
    """Of sizes (M,), each for a length of path (M,) [m] at an arc length (M,) [m]."""
    largest = int(np.argmax(values))
    return Extent(float(values[largest]), percentile99(values, weight), rms(values, weight), float(arc[largest]))


def percentile99(values: Array, weight: Array) -> float:
    """The value that 99 % of the path's length stay at or below."""
    total = float(np.sum(weight))
    goal, below = 0.99 * total, 0.0
    # a subsample tells where the largest values begin: only those are sorted, if they are the last hundredth and more
    subsample = np.sort(values[::SUBSAMPLE])
    for share in (0.98, 0.9):
        tail = np.flatnonzero(values >= subsample[int(share * len(subsample))])
        rest = total - float(np.sum(weight[tail]))
        if rest < goal:
            values, weight, below = values[tail], weight[tail], rest
            break
    order = np.argsort(values)
    cumulated = below + np.cumsum(weight[order])
    return float(values[order[min(int(np.searchsorted(cumulated, goal)), len(order) - 1)]])


def statistics(deviation: Deviation, *, on_part: bool = False) -> dict[str, dict[str, float]]:
    """Largest, 99th percentile and rms of each component: total, feed, cross, normal [um], axis angle [mdeg]."""
    table = {}
    for name, extent in (deviation.on_part if on_part else deviation.extents).items():
        factor, unit = (MDEG, "mdeg") if name == "axis_angle" else (UM, "um")
        table[name] = {f"{key}_{unit}": getattr(extent, key) / factor for key in ("max", "p99", "rms")}
    return table
