r"""How far a log's motion is off the path of a program's text: across it, normal to it, and where; and of which text.

A row counts on a way that is straight or circular and surely driven, and stands for the length of such ways around it.

Where two texts A and B differ by D(s) square to the path, a run of A is off A by nothing and a run of B by D, whatever
else pulls it off both. So the log's deviation e from A is split, over its rows, by least squares,

    e = beta D + gamma a + rest,       a = v^2 curvature: what a controller's smoothing pulls by

and beta is 0 for a run of A and 1 for a run of B. Rows that no such sum explains, as in corners that are cut, lose
weight, w = 1 / (1 + (rest / scatter)^2). The uncertainty is that of rows that scatter together over stretches.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, dot, norm, owns, thinned
from compgen.verification.deviation import Extent, extent_of, sample_lengths
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.executed.followed_log import FollowedLog, row_noise
from compgen.verification.executed.tracking import components, follow, project

FARTHEST = 20e-3  # [m] off the path: a corner that is cut at speed
SPEED_SPAN = 0.04  # [s] over which a row's speed is taken
ROWS = 100_000  # of a log that texts are compared at
SPAN = 2e-3  # [m] on each side over which curvature is taken
BLOCKS = 40  # stretches that scatter for themselves
ROUNDS = 12  # of weighing rows
LEAST_DIFFERENCE = 1e-6  # [m] rms: texts that are nearer are the same
RESTING = 0.01  # of the written speed: the robot stands


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(row=("R",), time=("R",), arc=("R",), across=("R",), normal=("R",), distance=("R",), speed=("R",), judged=("R",))
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


def log_deviation(course: ProgramCourse, followed: FollowedLog) -> PathDeviation:
    """How far the rows of a log are off the course."""
    track, projection = followed.track, followed.projection
    on = track.row[track.on]
    rows = np.arange(int(on[0]), int(on[-1]) + 1)
    near = projection.distance[rows] <= FARTHEST
    away = int((~near).sum())
    rows = rows[near]
    arc, time = projection.arc[rows], followed.time[rows]
    across, normal = components(course, projection, rows)
    noise = row_noise(np.column_stack([across, normal]))
    judged = course.judged[projection.way[rows]]
    distance = projection.distance[rows]
    extents = {}
    if judged.any():
        beside = judged[1:] & judged[:-1] & (np.diff(rows) == 1)  # no way that is not judged lies between
        weight = sample_lengths(arc, beside)[judged]
        weight = weight if weight.sum() > 0 else np.ones(len(weight))
        for name, values in (("total", distance), ("across", np.abs(across)), ("normal", np.abs(normal))):
            extents[name] = extent_of(values[judged], weight, arc[judged])
    return PathDeviation(
        row=rows,
        time=time,
        arc=arc,
        across=across,
        normal=normal,
        distance=distance,
        speed=speeds(time, arc),
        judged=judged,
        noise=noise,
        extents=extents,
        away=away,
    )


def speeds(time: Array, place: Array) -> Array:
    """Speed over a short span around each row of arc lengths (R,) or places (R, 3) [m], as many [m/s]."""
    half = max(1, round(SPEED_SPAN / 2 / max(float(np.median(np.diff(time))), 1e-6))) if len(time) > 1 else 1
    before = np.maximum(np.arange(len(time)) - half, 0)
    after = np.minimum(np.arange(len(time)) + half, len(time) - 1)
    return np.asarray(((place[after] - place[before]).T / np.maximum(time[after] - time[before], 1e-6)).T)


@dataclass(frozen=True, slots=True)
class Likeness:
    """How a log stands between two texts."""

    name: str  # of the other text
    differs: float  # [m] rms of the difference between the two, square to the path
    beta: float  # 0: this text was driven, 1: the other one
    sigma: float

    @property
    def is_other(self) -> bool:
        """Whether the other text was driven."""
        return self.is_sure and self.beta > 0.5

    @property
    def is_sure(self) -> bool:
        """Whether the log can tell the two."""
        return self.sigma < 0.12 and min(abs(self.beta), abs(self.beta - 1)) < 0.35 + 3 * self.sigma


def likeness(
    course: ProgramCourse, deviation: PathDeviation, followed: FollowedLog, name: str, other: ProgramCourse
) -> Likeness | None:
    """How a log stands between its own text and another one; None where the other one is another path."""
    rows = thinned(deviation.row[deviation.judged], ROWS)
    if len(rows) < 20:
        return None
    position, travelled = followed.position[rows], followed.travelled[rows]
    track = follow(other, position, travelled)
    if not track.on.any() or track.share < 0.9 or track.covered < 0.5 * (travelled[-1] - travelled[0]):
        return None
    beside = project(other, position, travelled, track)
    here = followed.projection
    difference = here.off[rows] - beside.off  # B - A where the log is
    arc = here.arc[rows]
    pull = curvature(course, arc) * (deviation.speed[np.searchsorted(deviation.row, rows)] ** 2)[:, None]
    tangent = course.tangents()[here.way[rows]]
    difference, pull = (v - dot(v, tangent)[:, None] * tangent for v in (difference, pull))
    size = float(np.sqrt(np.mean(dot(difference, difference))))
    if size < LEAST_DIFFERENCE:
        return Likeness(name, size, 0.0, np.inf)
    A = np.column_stack([difference.ravel(), pull.ravel()])
    scale = np.sqrt((A**2).sum(axis=0))
    A = A / np.where(scale > 0, scale, 1.0)
    e, weight = here.off[rows].ravel(), np.ones(A.shape[0])
    for _ in range(ROUNDS):
        weighted = weight[:, None] * A
        inverse = np.linalg.pinv(weighted.T @ A, rcond=1e-9)
        value = inverse @ (weighted.T @ e)
        rest = e - A @ value
        size_of_rest = np.repeat(norm(rest.reshape(-1, 3)), 3)
        weight = 1 / (1 + (size_of_rest / max(2 * float(np.median(size_of_rest)), 1e-9)) ** 2)
    rest = rest[:, None] * weighted
    parts = np.array([part.sum(axis=0) for part in np.array_split(rest, BLOCKS)])
    covariance = inverse @ (parts.T @ parts) @ inverse
    return Likeness(name, size, float(value[0] / scale[0]), float(np.sqrt(max(covariance[0, 0], 0.0)) / scale[0]))


def curvature(course: ProgramCourse, arc: Array) -> Array:
    """Curvature vectors of the course at arc lengths, over a short span, (m, 3) [1/m]."""
    s = np.clip(arc, SPAN, max(course.length - SPAN, SPAN))
    return (course.place(s + SPAN) - 2 * course.place(s) + course.place(s - SPAN)) / SPAN**2
