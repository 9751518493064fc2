"""The verdict: what the twin did with the text, against the true path, against the bounds."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from compgen.arrays import Array, dot, frozen, own
from compgen.evaluation import evaluate
from compgen.toolpath import ToolPath
from compgen.twin import Ride
from compgen.units import MDEG, MM, UM

BAND = (1 * MM, 20 * MM)  # the mid-spatial periods of a smoothing tool
STEP = 0.25 * MM
BINS = 1000  # for the percentile
AROUND = 2000  # samples beside a piece that its band-pass needs
PIECE = 2**18 - 2 * AROUND


@dataclass(frozen=True, eq=False, slots=True)
class Deviation:
    """Actual against true pose at M samples of a ride."""

    arc: Array  # (M,) [m]
    time: Array  # (M,) [s]
    weight: Array  # (M,) [m] length of path that a sample stands for
    error: Array  # (M, 3) [m] base axes
    feed: Array  # (M,) [m] along the direction of travel
    cross: Array  # (M,) [m] across it, in the surface
    normal: Array  # (M,) [m] along the tool axis, away from the surface
    angle: Array  # (M,) [rad] between the tool axes

    def __post_init__(self) -> None:
        own(self, error=("M", 3), **{n: ("M",) for n in ("arc", "time", "weight", "feed", "cross", "normal", "angle")})

    def total(self) -> Array:
        """Size of the position error, (M,) [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


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


@dataclass(frozen=True, slots=True)
class Finding:
    """Something the user must know. ``outside`` fails the job, ``warning`` and ``note`` do not."""

    level: str  # "outside", "warning", "note"
    code: str
    message: str


def deviation(path: ToolPath, *rides: Ride) -> Deviation:
    """Compare each sample with the true path at the same fraction of the same segment."""
    return deviations(path, rides)


def deviations(path: ToolPath, rides: Iterable[Ride]) -> Deviation:
    """The same for a ride that comes in stretches, keeping no more than the comparison."""
    parts = [_compared(path, ride) for ride in rides]
    arc, time, error, feed, cross, normal, angle = (np.concatenate(columns) for columns in zip(*parts))
    gaps = np.diff(arc)
    weight = np.concatenate([gaps, [0.0]]) / 2 + np.concatenate([[0.0], gaps]) / 2
    return Deviation(*map(frozen, (arc, time, weight, error, feed, cross, normal, angle)))


def _compared(path: ToolPath, ride: Ride) -> tuple[Array, ...]:
    """arc, time, error, feed, cross, normal and angle of samples."""
    position, rotation, travel = path.at(ride.segment, ride.fraction)
    real = ride.rotation.reshape(-1, 9)
    error, parts = evaluate(_parts(), position, rotation.reshape(-1, 9), travel, ride.position, real)
    first, last = int(ride.segment[0]), int(ride.segment[-1]) + 1
    gaps = np.diff(path.arc[first : last + 1])
    arc = path.arc[ride.segment] + ride.fraction * gaps[ride.segment - first]
    return (arc, ride.time, error, *(np.ascontiguousarray(column) for column in parts.T))


@lru_cache(maxsize=1)
def _parts() -> Any:
    """Of a true and an actual pose: the error in base axes (3), and along feed, across, normal, and of the axis (4).

    Inputs: true position (3), rotation (9, row by row), direction of travel (3); actual position, rotation.
    """
    p, r, travel, q, s = (ca.SX.sym(name, size) for name, size in zip("prtqs", (3, 9, 3, 3, 9)))
    rotation = ca.reshape(r, 3, 3).T
    axis, real, error = rotation[:, 2], ca.vertcat(s[2], s[5], s[8]), q - p
    # approach and retract run along the axis: cross feed is then the tool's y, feed its x
    ahead = ca.if_else(ca.norm_2(ca.cross(travel, axis)) > 1e-3, travel, rotation[:, 0])
    side = ca.cross(ahead, axis)
    side = side / ca.norm_2(side)
    angle = ca.atan2(ca.norm_2(ca.cross(axis, real)), ca.dot(axis, real))
    parts = ca.vertcat(ca.dot(error, ca.cross(axis, side)), ca.dot(error, side), ca.dot(error, -axis), angle)
    return ca.Function("parts", [p, r, travel, q, s], [error, parts])


def percentile99(values: Array, weight: Array) -> float:
    """The value that 99 % of the path's length stay at or below."""
    # the ends of coarse bins say which few values can be it; only those are sorted
    low, high = float(values.min()), float(values.max())
    below = 0.0
    goal = 0.99 * float(np.sum(weight))
    if high > low and len(values) > BINS:
        bin_of = np.minimum(((values - low) * (BINS / (high - low))).astype(np.int64), BINS - 1)
        filled = np.cumsum(np.bincount(bin_of, weights=weight, minlength=BINS))
        k = int(np.searchsorted(filled, goal * (1 - 1e-9)))
        near = (bin_of >= k - 1) & (bin_of <= k + 1)
        below = float(filled[k - 2]) if k >= 2 else 0.0
        values, weight = values[near], weight[near]
    order = np.argsort(values, kind="stable")
    passed = below + np.cumsum(weight[order])
    return float(values[order][min(int(np.searchsorted(passed, goal)), len(order) - 1)])


def rms(values: Array, weight: Array) -> float:
    """Root of the mean square along the path."""
    return float(np.sqrt(np.average(values**2, weights=weight)))


def mid_spatial(path: ToolPath, correction: Array) -> float:
    """Rms of what the correction itself puts onto the surface at periods of 1 to 20 mm along the path [m].

    Its component along the tool axis, sampled every quarter millimetre between stops and passed through a fourth-order
    Butterworth band; before rounding. Runs shorter than five periods of the longest say nothing and are left out.
    """
    heave = dot(correction[:, :3], -path.rotation[:, :, 2])
    power, count = 0.0, 0
    stops = np.flatnonzero(path.stop)
    for first, last in zip(stops[:-1].tolist(), stops[1:].tolist()):
        arc = path.arc[first : last + 1]
        length = float(arc[-1] - arc[0])
        if length > 5 * BAND[1]:
            total = len(np.arange(0.0, length, STEP))
            for begin in range(0, total, PIECE):
                end = min(total, begin + PIECE)
                # a piece with its surroundings, so that cutting it out leaves no trace
                low, high = max(0, begin - AROUND), min(total, end + AROUND)
                run = _through(arc, heave[first : last + 1], arc[0] + STEP * np.arange(low, high))
                passed = _band_passed(run)[begin - low : end - low]
                power, count = power + float(np.sum(passed**2)), count + len(passed)
    return float(np.sqrt(power / count)) if count else 0.0


def _through(x: Array, y: Array, at: Array) -> Array:
    """A cubic through the four points around each place: straight lines would put their own corners into the band."""
    if len(x) < 4:
        return np.interp(at, x, y)
    k = np.clip(np.searchsorted(x, at, side="right") - 2, 0, len(x) - 4)
    total = np.zeros(len(at))
    for i in range(4):
        share = y[k + i]
        for j in range(4):
            if j != i:
                share = share * (at - x[k + j]) / (x[k + i] - x[k + j])
        total += share
    return total


def _band_passed(run: Array) -> Array:
    r"""Samples through a Butterworth band of fourth order, forth and back, by their spectrum.

    Bilinear transform: |H|^2 = 1 / (1 + Q^8), Q = (w^2 - w1 w2) / (w (w2 - w1)) with w = tan(pi f step); forth and back
    leaves |H|^2 of the amplitude and no shift. Both ends are carried on turned about the end point.
    """
    pad = min(AROUND, len(run) - 1)
    whole = np.concatenate([2 * run[0] - run[pad:0:-1], run, 2 * run[-1] - run[-2 : -pad - 2 : -1]])
    w1, w2 = (np.tan(np.pi * STEP / period) for period in (BAND[1], BAND[0]))
    w = np.tan(np.pi * np.minimum(np.fft.rfftfreq(len(whole)), 0.4999))
    w[0] = 1e-12
    gain = 1 / (1 + ((w * w - w1 * w2) / (w * (w2 - w1))) ** 8)
    return np.asarray(np.fft.irfft(np.fft.rfft(whole) * gain, len(whole))[pad : pad + len(run)])


def statistics(deviation: Deviation) -> dict[str, dict[str, float]]:
    """Largest, 99th percentile and rms of each component: total, feed, cross, normal [um], axis angle [mdeg]."""
    parts = {
        "total": (deviation.total(), UM, "um"),
        "feed": (np.abs(deviation.feed), UM, "um"),
        "cross": (np.abs(deviation.cross), UM, "um"),
        "normal": (np.abs(deviation.normal), UM, "um"),
        "axis_angle": (deviation.angle, MDEG, "mdeg"),
    }
    return {
        name: {
            f"max_{unit}": float(values.max() / factor),
            f"p99_{unit}": percentile99(values, deviation.weight) / factor,
            f"rms_{unit}": rms(values, deviation.weight) / factor,
        }
        for name, (values, factor, unit) in parts.items()
    }


def judge(deviation: Deviation, bounds: Bounds) -> list[Finding]:
    """One finding for each bound that is broken, naming where it is worst."""
    total = deviation.total()
    checks = [
        ("max_um", total, bounds.max, total.max(), UM, "um"),
        ("p99_um", total, bounds.p99, percentile99(total, deviation.weight), UM, "um"),
        ("rms_um", total, bounds.rms, rms(total, deviation.weight), UM, "um"),
        ("feed_um", np.abs(deviation.feed), bounds.feed, np.abs(deviation.feed).max(), UM, "um"),
        ("cross_um", np.abs(deviation.cross), bounds.cross, np.abs(deviation.cross).max(), UM, "um"),
        ("normal_um", np.abs(deviation.normal), bounds.normal, np.abs(deviation.normal).max(), UM, "um"),
        ("axis_mdeg", deviation.angle, bounds.axis, deviation.angle.max(), MDEG, "mdeg"),
    ]
    found = []
    for key, values, bound, value, factor, unit in checks:
        if bound is not None and not value <= bound:
            m = int(np.argmax(values))
            found.append(
                Finding(
                    "outside",
                    f"bounds.{key}",
                    f"{value / factor:.3f} {unit} after correction is above bounds.{key} = {bound / factor:g}; "
                    f"worst {deviation.arc[m]:.3f} m along the path",
                )
            )
    return found
