"""How far a log's motion is off the path of a program's text: across it, normal to it, and where.

A row counts on a way that is straight or circular and surely driven, and stands for the length of path around it.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own, rms
from compgen.verification.deviation import Extent, percentile99
from compgen.verification.executed.course import Course
from compgen.verification.executed.laid_log import LaidLog, row_noise
from compgen.verification.executed.projection import components

FARTHEST = 20e-3  # [m] off the path: a corner that is cut at speed
SPEED_SPAN = 0.04  # [s] over which a row's speed is taken
RESTING = 0.01  # of the written speed: the robot stands


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PathDeviation:
    """R rows of a log that are on the course, from the first to the last of them."""

    row: IntArray  # (R,) of the log
    time: Array  # (R,) [s] log's clock
    arc: Array  # (R,) [m]
    across: Array  # (R,) [m]
    normal: Array  # (R,) [m] along the tool's axis, away from the surface
    distance: Array  # (R,) [m]
    speed: Array  # (R,) [m/s] along the course
    judged: BoolArray  # (R,)
    noise: float  # [m] of across and normal from row to row
    extents: dict[str, Extent]  # total, across, normal; empty where nothing is judged
    away: int  # rows farther than that from the course between the first and the last that is on it

    def __post_init__(self) -> None:
        own(
            self,
            row=("R",),
            time=("R",),
            arc=("R",),
            across=("R",),
            normal=("R",),
            distance=("R",),
            speed=("R",),
            judged=("R",),
        )


def deviation_of(course: Course, laid: LaidLog) -> PathDeviation:
    """How far the rows of a log are off the course."""
    track, projection = laid.track, laid.projection
    on = track.row[track.on]
    rows = np.arange(int(on[0]), int(on[-1]) + 1)
    near = projection.distance[rows] <= FARTHEST
    away = int((~near).sum())
    rows = rows[near]
    arc, time = projection.arc[rows], laid.time[rows]
    across, normal = components(course, projection, rows)
    noise = row_noise(np.column_stack([across, normal]))
    judged = course.judged[projection.way[rows]]
    distance = projection.distance[rows]
    extents = {}
    if judged.any():
        weight = _lengths(arc)[judged]
        weight = weight if weight.sum() > 0 else np.ones(len(weight))
        for name, values in (("total", distance), ("across", np.abs(across)), ("normal", np.abs(normal))):
            extents[name] = _extent(values[judged], weight, arc[judged])
    return PathDeviation(
        row=rows,
        time=time,
        arc=arc,
        across=across,
        normal=normal,
        distance=distance,
        speed=_speed(time, arc),
        judged=judged,
        noise=noise,
        extents=extents,
        away=away,
    )


def _lengths(arc: Array) -> Array:
    """Length of path that each row stands for, (R,) [m]."""
    gaps = np.abs(np.diff(arc))
    return np.asarray((np.append(gaps, 0.0) + np.append(0.0, gaps)) / 2)


def _extent(values: Array, weight: Array, arc: Array) -> Extent:
    largest = int(np.argmax(values))
    return Extent(float(values[largest]), percentile99(values, weight), rms(values, weight), float(arc[largest]))


def _speed(time: Array, arc: Array) -> Array:
    """Speed along the course over a short span around each row, (R,) [m/s]."""
    half = max(1, round(SPEED_SPAN / 2 / max(float(np.median(np.diff(time))), 1e-6))) if len(time) > 1 else 1
    before = np.maximum(np.arange(len(time)) - half, 0)
    after = np.minimum(np.arange(len(time)) + half, len(time) - 1)
    return np.asarray((arc[after] - arc[before]) / np.maximum(time[after] - time[before], 1e-6))
