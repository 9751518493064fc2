r"""Commanding a path off its targets so that the controller's smoothing leads the tool back onto them.

Smoothing by weights of variance sigma^2 draws a bend inwards. Where s(t) is the way that the command has gone, E[.] the
mean by the weights and k = d^2 r / d s^2 the curvature of what is smoothed (places, or joints),

    led = V k / 2,      V = E[s^2] - E[s]^2   (v^2 sigma^2 at a steady speed v)

so p k / 2 is commanded against it, with S p = V, S the smoothing. Lines of length l between waypoints are themselves a
smoothing, of variance l^2 / 6 of the way. A wave of the path that goes by at w is smoothed by H(w), and curvature is
commanded through

    F(w) = L(w) (1 / H - 1) / (w^2 sigma^2 / 2),      L = 1 where H >= 0.97, fading to 0 where H = 0.9

and no content is commanded that the smoothing passes by less than 0.9: the plain iteration c <- c + (target - S c)
multiplies what is left by 1 - H each time, which exceeds 1 where H < 0. Curvature is taken run by run, mirrored at
stops and corners: what a corner is rounded by stays, and is reported. All here is of continuous time, and nothing that
proves it imports it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import BSpline
from scipy.signal import fftconvolve

from compgen.core.arrays import Array, BoolArray, frozen, owns, row_norms
from compgen.core.pose import Pose
from compgen.robot.kinematics import flange_pose
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot

PASSES, PASSES_FULLY = 0.9, 0.97  # share of a wave that the smoothing passes: inverted from, and fully from
CORNER = 0.1  # [rad] change of direction that no filter follows
STRAIGHT = 1e-7  # [m] pull that is not worth a command
SETTLING = 8.0  # time constants of a first-order lag that count
FINE = 60  # samples in the smoothing's support, where V is not the steady one
SPLINES, REACH = 50, 4.0  # of p on the way from a stop: how many, and supports beyond the ramp
STIFFNESS, STIFFEST = 0.5, 4.0  # of p: weight of its third difference, raised until the joints can follow it
JERK = 0.32  # share of a joint's jerk that p may ask for
ROUNDS = 8  # of weighing what is left, for its largest to be small
HELD = 1e3  # weight of p = 0 at the stop


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
    beside: BoolArray | None = None  # (N,) off the part; None: nowhere


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
    rows = path.theta if motion.space == "joint" else path.position
    curvature, bent = _smooth_curvature(motion, path, rows, _breaks(path))
    weighted = _square_of_way(robot, motion, path, bent)[:, None] / 2 * curvature
    if motion.space == "joint":
        weighted = (flange_pose(robot, path.theta + weighted) @ tool).position - path.position
    ahead = _directions(path)
    weighted -= np.einsum("ij,ij->i", weighted, ahead)[:, None] * ahead
    return frozen(-weighted * np.minimum(1.0, largest / np.maximum(row_norms(weighted), 1e-12))[:, None])


def _breaks(path: Commanded) -> BoolArray:
    """Where no bend goes on: stops, and corners, (N,)."""
    line = np.diff(path.position, axis=0)
    line /= np.maximum(row_norms(line), 1e-12)[:, None]
    breaks = path.stop.copy()
    breaks[[0, -1]] = True
    breaks[1:-1] |= np.einsum("ij,ij->i", line[1:], line[:-1]) < np.cos(CORNER)
    return breaks


def _directions(path: Commanded) -> Array:
    """Directions of travel at the waypoints, (N, 3), between those of both neighbours."""
    line = np.diff(path.position, axis=0)
    line /= np.maximum(row_norms(line), 1e-12)[:, None]
    ahead = np.concatenate([line[:1], line[1:] + line[:-1], line[-1:]])
    return np.asarray(ahead / np.maximum(row_norms(ahead), 1e-12)[:, None])


def _smooth_curvature(
    motion: ControllerMotion, path: Commanded, rows: Array, breaks: BoolArray
) -> tuple[Array, BoolArray]:
    """F applied to d^2 r / d s^2 of rows (N, C), between two breaks each for itself, (N, C); and where it is bent."""
    curvature = _curvature(path, rows)
    curvature[breaks] = 0.0
    if path.beside is not None and not path.beside.all():
        curvature = _no_sharper_beside(curvature, path.beside)
    at_speed = np.concatenate([[0.0], np.cumsum(np.diff(path.arc) / path.speed)])
    steady = np.append(path.speed, path.speed[-1]) ** 2 * variance(motion) / 2
    bent = row_norms(curvature) * steady > STRAIGHT
    step, kernel = _kernel(motion)
    half, edges = len(kernel) // 2, np.flatnonzero(breaks)
    through = np.zeros_like(rows)
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        inner = slice(first + 1, last)
        if last - first < 3 or not bent[inner].any():
            continue
        time = at_speed[first : last + 1] - at_speed[first]
        grid = np.linspace(0.0, time[-1], max(2, int(np.ceil(time[-1] / step)) + 1))
        on_grid = np.column_stack([np.interp(grid, time[1:-1], column) for column in curvature[inner].T])
        mirrored = np.pad(on_grid, ((half, half), (0, 0)), mode="reflect")
        smooth = fftconvolve(mirrored, kernel[:, None], mode="valid", axes=0)
        through[first : last + 1] = np.column_stack([np.interp(time, grid, column) for column in smooth.T])
    return through, bent


def _no_sharper_beside(curvature: Array, beside: BoolArray) -> Array:
    """Curvature (N, C) that off the part is no sharper than at the part's nearest waypoint, where it becomes that one.

    The filter reaches farther than the smoothing: what a turn off the part is rounded by would be commanded on it.
    """
    on_part, rows = np.flatnonzero(~beside), np.arange(len(beside))
    after = np.clip(np.searchsorted(on_part, rows), 1, len(on_part) - 1) if len(on_part) > 1 else np.zeros_like(rows)
    before = np.maximum(after - 1, 0)
    nearest = np.where(rows - on_part[before] < on_part[after] - rows, on_part[before], on_part[after])
    held = curvature[nearest]
    sharper = beside & (row_norms(curvature) > row_norms(held))
    return np.where(sharper[:, None], held, curvature)


def _curvature(path: Commanded, rows: Array) -> Array:
    """d^2 r / d s^2 of rows (N, C) by central differences, (N, C); zero at both ends."""
    gap = np.maximum(np.diff(path.arc), 1e-12)[:, None]
    slope = np.diff(rows, axis=0) / gap
    curvature = np.zeros_like(rows)
    curvature[1:-1] = 2 * np.diff(slope, axis=0) / (gap[1:] + gap[:-1])
    return curvature


def _kernel(motion: ControllerMotion) -> tuple[float, Array]:
    """Step [s] and weights of F in time: (1 / pi) integral of F cos(w t) up to where F ends."""
    full, last = band_edges(motion)
    step = float(np.sqrt(variance(motion)))
    half = int(np.ceil(2 * np.pi / (last - full) / step))
    w = np.linspace(0.0, last, 400)
    time = step * np.arange(-half, half + 1)
    weights = np.trapezoid(inverted(motion, w) * np.cos(time[:, None] * w), w, axis=1)
    return step, np.asarray(weights / weights.sum())


def _square_of_way(robot: Robot, motion: ControllerMotion, path: Commanded, bent: BoolArray) -> Array:
    """p of S p = V at the waypoints, (N,) [m2]: v^2 sigma^2, and near a stop beside a bend what a ramp makes of it."""
    speed = np.maximum(np.append(path.speed[0], path.speed), np.append(path.speed, path.speed[-1]))
    square = speed**2 * variance(motion)
    bend = square[:, None] / 2 * np.abs(_curvature(path, path.theta))
    if path.by_lines:
        gap = np.diff(path.arc)
        averaged = gap < path.speed * min(t for t in (*motion.moving_averages, *motion.first_orders) if t > 0)
        square[1:] += np.where(averaged, gap**2 / 6, 0.0)
    stops = np.flatnonzero(path.stop)
    for first, last in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        rows = slice(first, last + 1)
        if not bent[rows].any():
            continue
        ramp = (_ramp(robot, path, first, first) + _ramp(robot, path, last, last - 1)) / 2
        allowed = JERK * float((robot.jerk / np.maximum(bend[first + 1 : last].max(axis=0), 1e-12)).min())
        stiffness = STIFFNESS
        nodes, share, steepest = _from_rest(motion, round(ramp, 3), stiffness)
        while steepest > allowed and stiffness < STIFFEST:
            stiffness *= 1.25
            nodes, share, steepest = _from_rest(motion, round(ramp, 3), stiffness)
        for way in (path.arc[rows] - path.arc[first], path.arc[last] - path.arc[rows]):
            square[rows] *= np.interp(way / speed[rows], nodes, share)
    return np.asarray(square)


def _ramp(robot: Robot, path: Commanded, stop: int, segment: int) -> float:
    """How long a controller is taken to need from a stop to the speed of a segment beside it [s].

    With a and j what 90 and 45 % of the joints' limits allow along the path, v / a + a / j, or 2 sqrt(v / j).
    """
    turn = np.abs(path.theta[segment + 1] - path.theta[segment])
    slope = turn / max(float(path.arc[segment + 1] - path.arc[segment]), 1e-9) + 1e-12
    a, j = 0.9 * float((robot.acceleration / slope).min()), 0.45 * float((robot.jerk / slope).min())
    v = float(path.speed[segment])
    return v / a + a / j if v > a * a / j else 2 * float(np.sqrt(v / j))


@lru_cache(maxsize=64)
def _from_rest(motion: ControllerMotion, ramp: float, stiffness: float) -> tuple[Array, Array, float]:
    """p over v^2 sigma^2 on the way from a stop, over way / v [s]: nodes, values, and its largest third derivative.

    Least squares of S p = V over cubic splines of the way, zero at the stop, with little third difference.
    """
    weights, step, support = _weights(motion)
    end = ramp + REACH * support
    time = step * np.arange(-2 * len(weights), int((end + support) / step))
    u = np.clip(time / ramp, 0.0, 1.0)
    done = np.where(time < ramp, ramp * u**3 * (1 - u / 2), time - ramp / 2)

    def smooth(rows: Array) -> Array:
        return np.asarray(np.apply_along_axis(np.convolve, 0, rows, weights, "valid"))

    V = (smooth((done**2)[:, None]) - smooth(done[:, None]) ** 2)[:, 0] / variance(motion)
    apart = end / (SPLINES - 3)
    knots = apart * np.arange(-3, SPLINES + 1)
    basis = BSpline.design_matrix(np.clip(done, 0.0, knots[SPLINES]), knots, 3).toarray()
    basis[done <= 0] = 0.0
    basis[:, -3:] = 0.0  # steady at the end: 1 and nothing else
    rest = np.where(done <= 0, 0.0, 1.0)
    bend = stiffness * np.diff(np.eye(SPLINES), 3, axis=0)
    at_stop = HELD * BSpline.design_matrix(np.zeros(1), knots, 3).toarray()
    rows = np.concatenate([smooth(basis), bend, at_stop])
    wanted = np.concatenate([V - smooth(rest[:, None])[:, 0], np.zeros(len(bend)), [-HELD]])
    share_of = np.ones(len(rows))
    for _ in range(ROUNDS):
        weight = np.linalg.lstsq(rows * share_of[:, None], wanted * share_of, rcond=None)[0]
        left = np.abs(rows @ weight - wanted)[: len(V)]
        share_of[: len(V)] *= np.sqrt(0.2 + left / left.max())
        share_of[: len(V)] /= np.sqrt(np.mean(share_of[: len(V)] ** 2))
    weight[-3:] = 0.0
    nodes = np.linspace(0.0, end, 8 * SPLINES)
    share = 1.0 + BSpline(knots, weight, 3)(nodes)
    share[0] = 0.0
    return nodes, share, float(np.abs(np.diff(weight, 3)).max() / apart**3)


def _weights(motion: ControllerMotion) -> tuple[Array, float, float]:
    """The smoothing's weights about their mean, a step apart, an odd number; the step, and how long they reach [s]."""
    support = sum(motion.moving_averages) + SETTLING * sum(motion.first_orders)
    step = support / FINE
    weights = np.ones(1)
    for window in motion.moving_averages:
        n = window / step
        if n > 1:
            weights = np.convolve(weights, np.append(np.ones(int(n)), n - int(n)) / n)
    for constant in motion.first_orders:
        if constant > 0:
            decay = np.exp(-step * np.arange(int(SETTLING * constant / step) + 1) / constant)
            weights = np.convolve(weights, decay / decay.sum())
    mean = round(float(np.arange(len(weights)) @ weights))
    half = max(mean, len(weights) - 1 - mean)
    return np.pad(weights, (half - mean, half - (len(weights) - 1 - mean))), step, support


def variance(motion: ControllerMotion) -> float:
    """sigma^2 of the weights in continuous time [s2]: T^2 / 12 of each mean, T^2 of each lag."""
    return sum(t * t for t in motion.moving_averages) / 12 + sum(t * t for t in motion.first_orders)


def passed(motion: ControllerMotion, w: Array) -> Array:
    r"""H(w) in continuous time, delays removed: prod sinc(w T / 2) prod 1 / sqrt(1 + w^2 T^2), (F,) of (F,) [rad/s]."""
    w = np.asarray(w, dtype=float)
    gain = np.ones_like(w)
    for window in motion.moving_averages:
        gain = gain * np.sinc(w * window / (2 * np.pi))
    for constant in motion.first_orders:
        gain = gain / np.sqrt(1 + (w * constant) ** 2)
    return gain


def inverted(motion: ControllerMotion, w: Array) -> Array:
    """F(w): by how much curvature of a wave is commanded against its pull, (F,); 0 where H < 0.9."""
    w = np.maximum(np.abs(np.asarray(w, dtype=float)), 1e-9)
    full, last = band_edges(motion)
    fade = 0.5 + 0.5 * np.cos(np.pi * np.clip((w - full) / (last - full), 0.0, 1.0))
    gain = np.maximum(passed(motion, np.minimum(w, last)), 0.5)
    half = np.minimum(w, last) ** 2 * variance(motion) / 2
    # below a thousandth the quotient has no digits left, and is 1
    return np.asarray(fade * np.where(half < 1e-3, 1.0, (1 / gain - 1) / np.maximum(half, 1e-12)))


def band_edges(motion: ControllerMotion) -> tuple[float, float]:
    """Up to which frequency all is inverted, and from which on nothing [rad/s]: H = 0.97 and H = 0.9."""
    edges = []
    for share in (PASSES_FULLY, PASSES):
        low, high = 0.0, 3.0 / np.sqrt(variance(motion))
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if passed(motion, np.array([middle]))[0] > share else (low, middle)
        edges.append(low)
    return edges[0], edges[1]
