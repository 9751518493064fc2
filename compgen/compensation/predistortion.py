r"""Commanding a path off its targets so that the controller's smoothing leads the tool back onto them.

The command runs along the path by its words, from a stop to the next, at its place r(s(u)) at time u: from a stop at
once at its speed, for the smoothing is the ramp. Where E is the mean by the smoothing's weights, the tool passes the
way E[s] at

    d = E[r(s)] - r(E[s])        (k v^2 sigma^2 / 2 at a steady speed v on a curvature k)

beside its path. So c is commanded beside the path with the least of

    int |E[c] + d|^2 dt + g^6 int |c'''|^2 dt,      g = RIGID sigma

a banded problem in cubic splines of time, which at stops are zero. Of a wave that goes by at w and of which the
smoothing passes H(w), it leaves (g w)^6 / (H^2 + (g w)^6): hardly anything of long waves, and never more than there is,
where the plain iteration c <- c + (target - E c) multiplies what is left by 1 - H each time, which exceeds 1 where
H < 0. Corners are left as they are, and so is what the tool does off the part. Lines of length l are themselves a
smoothing, k l^2 / 12 to their inner side; as they are written half of their sag outwards, k l^2 / 48 of that is left.
All here is of continuous time, and nothing that proves it imports it.
"""

from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solveh_banded

from compgen.core.arrays import Array, BoolArray, cumulated, frozen, interpolated, owns, row_norms
from compgen.core.pose import Pose
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot

if TYPE_CHECKING:
    from scipy.sparse import csr_array

RIGID, RIGID_ARCS = 0.12, 0.6  # of c in sigma; an arc says no shorter wave than it is long
STIFFER, STIFFEST = 1.4, 15.0  # until c is not so far off as waves that hardly pass would have it
MOST = 3.0  # times as far as the tool is led
CORNER = 0.1  # [rad] change of direction that no filter follows
STRAIGHT = 1e-7  # [m] pull that is not worth a command
SETTLING = 14.0  # time constants of a first-order lag that count
FINE = 120  # samples in the smoothing's support
EVERY = 4  # of them counts
BLOCK = 20_000  # of these at once
KNOTS = 10  # of c in the support
HELD = 1e3  # weight of c = 0 at a stop
BESIDE = 1e-3  # weight of what is off the part


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(position=("N", 3), theta=("N", 6), arc=("N",), speed=("S",), stop=("N",))
class Commanded:
    """A path of N waypoints as it shall be driven, for what a controller makes of it."""

    position: Array  # (N, 3) [m] of the TCP
    theta: Array  # (N, 6) [rad]
    arc: Array  # (N,) [m]
    speed: Array  # (N - 1,) [m/s] programmed
    stop: BoolArray  # (N,)
    by_lines: bool = False  # straight from waypoint to waypoint, whose inner side the smoothing averages
    beside: BoolArray | None = None  # (N,) off the part; None: nowhere; everywhere: all of it counts as on it
    held: BoolArray | None = None  # (N,) left as they are, as corners; None: none
    first: Array | None = None  # (R,) [s] of the statement that each run begins with; None: of its first waypoint

    @property
    def on_part(self) -> BoolArray:
        """Which waypoints must be right, (N,)."""
        return np.ones(len(self.arc), dtype=bool) if self.beside is None or self.beside.all() else ~self.beside


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(weights=("W",))
class _Kernel:
    """A smoothing's weights about their mean, a step apart, an odd number."""

    weights: Array  # (W,)
    step: float  # [s]
    support: float  # [s] how long they reach
    rigid: float  # [s] RIGID sigma

    def mean(self, rows: Array) -> Array:
        """E of rows (M, C) a step apart, (M - W + 1, C)."""
        return np.stack([np.convolve(column, self.weights, mode="valid") for column in rows.T], axis=1)


def predistortion(robot: Robot, tool: Pose, path: Commanded, largest: float) -> Array:
    """How far off its targets a path is commanded for the controller's motion, across its direction, (N, 3) [m].

    Args:
        robot: With the motion that is inverted.
        tool: TCP in the flange.
        path: As it shall be driven, at full override.
        largest: No further than this [m].

    Returns:
        Zero where the robot file does not ask for it, on straight lines, and at stops.
    """
    motion = robot.motion
    if motion is None or not motion.may_predistort or len(path.arc) < 3:
        return np.zeros_like(path.position)
    shift = _shift(robot, motion, path)
    if motion.space == "joint":
        shift = (flange_pose(robot, path.theta + shift) @ tool).position - path.position
    ahead = _directions(path)
    shift -= np.einsum("ij,ij->i", shift, ahead)[:, None] * ahead
    return frozen(shift * np.minimum(1.0, largest / np.maximum(row_norms(shift), 1e-12))[:, None])


def bent_runs(motion: ControllerMotion, path: Commanded) -> BoolArray:
    """Which runs from a stop to the next have bends on the part that are worth a command, (R,)."""
    speed, variance = np.append(path.speed, path.speed[-1]), max(motion.in_run(t).variance for t in (0.0, inf))
    pull = row_norms(_curvature(path, _rows(motion, path))) * speed**2 * variance / 2
    bent = (pull > STRAIGHT) & path.on_part & ~_corners(path)
    stops = np.flatnonzero(path.stop)
    return np.array([bent[a : b + 1].any() for a, b in zip(stops[:-1], stops[1:], strict=True)], dtype=bool)


def _rows(motion: ControllerMotion, path: Commanded) -> Array:
    """What is smoothed, (N, C)."""
    return path.theta if motion.space == "joint" else path.position


def _shift(robot: Robot, motion: ControllerMotion, path: Commanded) -> Array:
    """c at the waypoints, of what is smoothed, (N, C)."""
    rows = _rows(motion, path)
    taken = np.diff(path.arc) / path.speed
    clock = cumulated(robot.controller.line_time(taken) if path.by_lines else taken)
    corner, shift, inner = _corners(path), np.zeros_like(rows), np.zeros_like(rows)
    if path.by_lines:
        gap, times = np.diff(path.arc), (*motion.moving_averages, *motion.after_long, *motion.first_orders)
        averaged = gap < path.speed * min(t for t in times if t > 0)
        inner[1:] = np.where(averaged, gap**2 / 48, 0.0)[:, None] * _curvature(path, rows)[1:]
    stops, on_part = np.flatnonzero(path.stop), path.on_part
    lasts = np.diff(clock)[stops[:-1]] if path.first is None else path.first
    for k in np.flatnonzero(bent_runs(motion, path)).tolist():
        first, last = stops[k], stops[k + 1]
        run, kernel = slice(first, last + 1), _kernel(motion.in_run(lasts[k]), RIGID if path.by_lines else RIGID_ARCS)
        time = clock[run] - clock[first]
        at, led = _led(kernel, time, path.arc[run], rows[run], corner[run])
        led += interpolated(at, time, inner[run])
        near = _near(at, time[corner[run]], kernel.support)
        on = np.interp(at, time, on_part[run].astype(float)) > 0
        led = np.where(on[:, None], led * near[:, None], 0.0)
        shift[run] = _least(kernel, at, led, on, time)
        rigid = kernel.rigid
        while np.abs(shift[run]).max() > MOST * np.abs(led).max() and rigid < STIFFEST * kernel.rigid:
            rigid *= STIFFER
            shift[run] = _least(replace(kernel, rigid=rigid), at, led, on, time)
        if path.held is not None:  # what is led to nothing there is nothing there
            shift[run] *= _near(time, time[corner[run]], kernel.support)[:, None]
    return shift


def _led(kernel: _Kernel, time: Array, arc: Array, rows: Array, corner: BoolArray) -> tuple[Array, Array]:
    """When the tool is how far off a run, (M,) [s] and d (M, C), of n waypoints at times and arc lengths (n,)."""
    half = len(kernel.weights) // 2
    grid = kernel.step * np.arange(-2 * half, int(np.ceil(time[-1] / kernel.step)) + 2 * half + 1)
    way = np.interp(grid, time, arc)
    led = kernel.mean(_on_curve(arc, rows, corner, way))
    return np.asarray(grid[half : len(grid) - half]), led - _on_curve(
        arc, rows, corner, kernel.mean(way[:, None])[:, 0]
    )


def _on_curve(arc: Array, rows: Array, corner: BoolArray, way: Array) -> Array:
    """Rows (n, C) between each other at arc lengths (M,), by cubics from corner to corner, (M, C)."""
    from scipy.interpolate import CubicHermiteSpline  # loaded by runs that need it

    edges = np.flatnonzero(np.concatenate([[True], corner[1:-1], [True]]))
    piece = np.clip(np.searchsorted(arc[edges], way, side="right") - 1, 0, len(edges) - 2)
    places = np.empty((len(way), rows.shape[1]))
    for number in np.unique(piece).tolist():
        of = slice(edges[number], edges[number + 1] + 1)
        slope = np.gradient(rows[of], arc[of], axis=0, edge_order=2 if len(arc[of]) > 2 else 1)
        places[piece == number] = CubicHermiteSpline(arc[of], rows[of], slope)(way[piece == number])
    return places


def _least(kernel: _Kernel, at: Array, led: Array, on: BoolArray, time: Array) -> Array:
    """c at the waypoints of a run, (n, C).

    Args:
        kernel: Of the smoothing.
        at: When the tool is led off (M,) [s].
        led: d there, (M, C), where it shall be none.
        on: Where that counts, (M,).
        time: When the command passes the waypoints, (n,) [s].
    """
    from scipy.interpolate import BSpline  # loaded by runs that need it
    from scipy.sparse import csr_array, diags_array

    count = max(int(np.ceil(time[-1] / kernel.support * KNOTS)), 4) + 3
    apart = time[-1] / (count - 3)
    knots = apart * np.arange(-3, count + 1)
    knots[[3, -4]] = 0.0, time[-1]

    def splines(u: Array) -> csr_array:
        return csr_array(BSpline.design_matrix(np.clip(u, 0.0, time[-1]), knots, 3))

    half, W = len(kernel.weights) // 2, len(kernel.weights)
    rows = np.arange(0, len(at), EVERY)
    normal, wanted = csr_array((count, count)), np.zeros((count, led.shape[1]))
    for some in np.array_split(rows, len(rows) // BLOCK + 1):
        u = kernel.step * np.arange(-half, some[-1] - some[0] + half + 1) + at[some[0]]
        columns = (some - some[0])[:, None] + np.arange(W)
        mean = csr_array((np.tile(kernel.weights, len(some)), columns.ravel(), W * np.arange(len(some) + 1)))
        weight = np.where(on[some], 1.0, BESIDE)
        smoothed = diags_array(weight) @ (mean @ splines(u))
        normal = normal + smoothed.T @ smoothed
        wanted -= smoothed.T @ (weight[:, None] * led[some])
    spacing = EVERY * kernel.step
    bend = np.sqrt(apart / spacing) * (kernel.rigid / apart) ** 3
    third = bend * diags_array([-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(count - 3, count))
    ends = HELD * splines(time[[0, -1]])
    weights = _solved(csr_array(normal + third.T @ third + ends.T @ ends), wanted)
    shift = splines(time) @ weights
    shift[[0, -1]] = 0.0
    return np.asarray(shift)


def _solved(normal: "csr_array", wanted: Array) -> Array:
    """Of a banded symmetric system."""
    entries = normal.tocoo()
    reach = int(np.abs(entries.row - entries.col).max())
    bands = np.zeros((reach + 1, normal.shape[0]))
    for k in range(reach + 1):
        bands[reach - k, k:] = normal.diagonal(k)
    return np.asarray(solveh_banded(bands, wanted))


def _near(at: Array, corners: Array, support: float) -> Array:
    """Share of what is led off that counts at times (M,), none within a support of corners, all beyond two."""
    if not len(corners):
        return np.ones(len(at))
    edges = np.concatenate([[-np.inf], corners, [np.inf]])
    after = np.searchsorted(corners, at) + 1
    away = np.minimum(at - edges[after - 1], edges[after] - at)
    return np.asarray(np.clip(away / support - 1, 0.0, 1.0))


def _corners(path: Commanded) -> BoolArray:
    """Where the path turns sharply without a stop, or is held, (N,)."""
    line = np.diff(path.position, axis=0)
    line /= np.maximum(row_norms(line), 1e-12)[:, None]
    sharp = np.zeros(len(path.arc), dtype=bool)
    sharp[1:-1] = np.einsum("ij,ij->i", line[1:], line[:-1]) < np.cos(CORNER)
    sharp &= ~path.stop
    return sharp if path.held is None else sharp | path.held


def _directions(path: Commanded) -> Array:
    """Directions of travel at the waypoints, (N, 3), between those of both neighbours."""
    line = np.diff(path.position, axis=0)
    line /= np.maximum(row_norms(line), 1e-12)[:, None]
    ahead = np.concatenate([line[:1], line[1:] + line[:-1], line[-1:]])
    return np.asarray(ahead / np.maximum(row_norms(ahead), 1e-12)[:, None])


def _curvature(path: Commanded, rows: Array) -> Array:
    """d^2 r / d s^2 of rows (N, C) by central differences, (N, C); zero at both ends and at corners and stops."""
    gap = np.maximum(np.diff(path.arc), 1e-12)[:, None]
    slope = np.diff(rows, axis=0) / gap
    curvature = np.zeros_like(rows)
    curvature[1:-1] = 2 * np.diff(slope, axis=0) / (gap[1:] + gap[:-1])
    curvature[path.stop | _corners(path)] = 0.0
    return curvature


def _kernel(motion: ControllerMotion, rigid: float) -> _Kernel:
    """Its weights: boxes with the variance of their windows, and exponentials."""
    support = sum(motion.moving_averages) + SETTLING * sum(motion.first_orders)
    step = support / FINE
    weights = np.ones(1)
    for window in motion.moving_averages:
        if window > step:
            n = np.sqrt((window / step) ** 2 + 1)
            m = 2 * int((n - 1) / 2) + 1
            weights = np.convolve(weights, np.concatenate([[(n - m) / 2], np.ones(m), [(n - m) / 2]]) / n)
    for constant in motion.first_orders:
        if constant > 0:
            decay = np.exp(-step * np.arange(int(SETTLING * constant / step) + 1) / constant)
            weights = np.convolve(weights, decay / decay.sum())
    mean = round(float(np.arange(len(weights)) @ weights))
    half = max(mean, len(weights) - 1 - mean)
    padded = np.pad(weights, (half - mean, half - (len(weights) - 1 - mean)))
    return _Kernel(weights=padded, step=step, support=support, rigid=rigid * float(np.sqrt(motion.variance)))
