r"""Rows of measurements too far off to be noise: which they are, and how little they weigh before that is known.

A row is an outlier whose deviation from what the other rows say has a chance below 1 % of happening even once in all
rows of Gaussian noise. Until then Student's t gives each the weight (4 + n) / (4 + |z|^2 / s^2), n its numbers.

At the first row of a file, and behind a gap in it, nobody knows on which side of their play joints are. A joint that
lags behind by b u, u in [-1, 1], moves a row's residual z. Where u is not known, z is that of u = 0 to

    sum_i |z(u_i = 1) - z(u_i = 0)|        over the joints that are not known,

to first order. A row that is far from the others, and no further than so, says nothing of either.
"""

from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.units import UM
from compgen.identification.evidence import Posterior
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.linearisation import Linearisation
from compgen.identification.measurements import PLACE, Measurements
from compgen.identification.model import ArmModel

CHANCE = 0.01  # that Gaussian noise alone sets a row aside, somewhere in the data
DEGREES_OF_FREEDOM = 4.0  # of Student's t
BEYOND = 1.5  # times what play explains: half-widths are not known exactly, and instruments have noise


def outlier_threshold(rows: int, numbers: IntArray | int = 3) -> Array:
    """Squared deviation over variance beyond which a row of so many numbers is an outlier."""
    return np.asarray(chdtri(numbers, CHANCE / max(rows, 1)))


def leave_one_out_distance(linear: Linearisation, solution: Posterior, data: Measurements, outlier: BoolArray) -> Array:
    """Squared deviation of each row from what the others say of it, over its variance, (N,).

    For a row inside the fit e' (s^2 V - A C A')^-1 e, for one that was set aside e' (s^2 V + A C A')^-1 e.
    """
    s2 = solution.scales.noise[data.kind] * (data.sigma**2 + solution.scales.rho * (data.kind == PLACE))
    sign = np.where(outlier, 1.0, -1.0)
    distance = np.empty(len(s2))
    for numbers in np.unique(data.numbers).tolist():
        rows = data.numbers == numbers
        A, z = linear.A[rows, :numbers], linear.z[rows, :numbers]
        # all rows in one product: a small one for each row takes many times as long
        spread = (A.reshape(-1, A.shape[2]) @ solution.covariance).reshape(A.shape)
        fit_variance = spread @ np.swapaxes(A, 1, 2)
        S = s2[rows, None, None] * np.eye(numbers) + sign[rows, None, None] * fit_variance
        values, vectors = np.linalg.eigh(S)
        values = np.maximum(values, 0.1 * s2[rows, None])  # the fit follows some rows wherever they go
        component = np.einsum("nji,nj->ni", vectors, z)
        distance[rows] = (component**2 / values).sum(axis=1)
    return distance


def student_weights(z: Array, s2: Array, numbers: IntArray) -> Array:
    """Weights of Student's t for rows of one number or three, (N,)."""
    return np.asarray((DEGREES_OF_FREEDOM + numbers) / (DEGREES_OF_FREEDOM + (z**2).sum(axis=1) / s2))


def reach_of_play(model: ArmModel, data: Measurements, p: Array, frames: InstrumentFrames) -> Array:
    """How far each row may be from where it is predicted, for joints whose side is not known, (N,) [m]."""

    def residual(direction: Array) -> Array:
        return np.nan_to_num(frames.residual(data, *model.pose(replace(data, direction=direction), p)))

    middle, unknown = residual(data.direction), data.direction == 0
    sides = [residual(data.direction + unknown * joint) - middle for joint in np.eye(6)]
    return np.asarray(np.linalg.norm(sides, axis=2).sum(axis=0))


def explained_by_play(data: Measurements, far: BoolArray, distance: Array, reach: Array) -> BoolArray:
    """Which rows are off by no more than the unknown sides of their joints, at poses with one that is far off, (N,)."""
    within = distance <= BEYOND * reach
    return np.asarray(within & np.isin(data.pose, data.pose[far & within]))


def unknown_sides_finding(data: Measurements, rows: IntArray, distance: Array) -> Finding:
    """What is said of rows that play explains, of which there is one or more."""
    worst, count = int(rows[np.argmax(distance[rows])]), f"{len(rows)} rows do" if len(rows) > 1 else "1 row does"
    return Finding.of(
        Code.UNKNOWN_SIDES,
        f"{count} not count: it is not known from which side their joints came (the first pose, a gap in 'order'), and "
        f"play explains what is off, up to {distance[worst] / UM:.0f} um ({data.label[worst]})",
    )
