r"""Which of several texts of one path a log was driven from.

Where two texts A and B differ by D(s) square to the path, a run of A is off A by nothing and a run of B by D, whatever
else pulls it off both. So the log's deviation e from A is split, over its rows, by least squares,

    e = beta D + gamma a + rest,       a = v^2 curvature: what a controller's smoothing pulls by

and beta is 0 for a run of A and 1 for a run of B. Rows that no such sum explains, as in corners that are cut, lose
weight, w = 1 / (1 + (rest / scatter)^2). The uncertainty is that of rows that scatter together over stretches.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, dot, norm
from compgen.verification.executed.course import Course
from compgen.verification.executed.laid_log import LaidLog
from compgen.verification.executed.path_deviation import PathDeviation
from compgen.verification.executed.projection import project
from compgen.verification.executed.tracking import follow

ROWS = 100_000  # of a log that texts are compared at
SPAN = 2e-3  # [m] on each side over which curvature is taken
BLOCKS = 40  # stretches that scatter for themselves
ROUNDS = 12  # of weighing rows
LEAST_DIFFERENCE = 1e-6  # [m] rms: texts that are nearer are the same


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


def likeness(course: Course, deviation: PathDeviation, laid: LaidLog, name: str, other: Course) -> Likeness | None:
    """How a log stands between its own text and another one; None where the other one is another path."""
    rows = deviation.row[deviation.judged]
    rows = rows[:: max(1, len(rows) // ROWS)]
    if len(rows) < 20:
        return None
    position, travelled = laid.position[rows], laid.travelled[rows]
    track = follow(other, position, travelled)
    if not track.on.any() or track.share < 0.9 or track.covered < 0.5 * (travelled[-1] - travelled[0]):
        return None
    beside = project(other, position, travelled, track)
    own = laid.projection
    difference = own.off[rows] - beside.off  # B - A where the log is
    arc = own.arc[rows]
    pull = curvature(course, arc) * (deviation.speed[np.searchsorted(deviation.row, rows)] ** 2)[:, None]
    tangent = course.tangents()[own.way[rows]]
    difference, pull = (v - dot(v, tangent)[:, None] * tangent for v in (difference, pull))
    size = float(np.sqrt(np.mean(dot(difference, difference))))
    if size < LEAST_DIFFERENCE:
        return Likeness(name, size, 0.0, np.inf)
    A = np.column_stack([difference.ravel(), pull.ravel()])
    scale = np.sqrt((A**2).sum(axis=0))
    A = A / np.where(scale > 0, scale, 1.0)
    e, weight = own.off[rows].ravel(), np.ones(A.shape[0])
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


def curvature(course: Course, arc: Array) -> Array:
    """Curvature vectors of the course at arc lengths, over a short span, (m, 3) [1/m]."""
    s = np.clip(arc, SPAN, max(course.length - SPAN, SPAN))
    return (course.place(s + SPAN) - 2 * course.place(s) + course.place(s - SPAN)) / SPAN**2
