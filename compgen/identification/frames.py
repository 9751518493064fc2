r"""Frames of instruments and positions of reflectors: unknown, and fitted with the parameters.

    y = R_i (P + R t_r) + c_i

for instrument i and reflector r at flange (P, R). A start comes from alternating two linear problems: reflectors for
given frames, frames (Kabsch 1976, by SVD) for given reflectors.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own
from compgen.identification.measurements import Measurements

FAINT = 1e-6  # weight of what keeps a reflector near the flange where poses of one orientation do not tell its place
ROUNDS = 50


@dataclass(frozen=True, eq=False, slots=True)
class InstrumentFrames:
    """World in each instrument's frame, and each reflector in the flange."""

    rotation: Array  # (V, 3, 3)
    origin: Array  # (V, 3) [m]
    reflector: Array  # (R, 3) [m]

    def __post_init__(self) -> None:
        own(self, rotation=("V", 3, 3), origin=("V", 3), reflector=("R", 3))

    def predict(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """Position of each row's reflector in its instrument's frame, (N, 3) [m], for the flange at each pose."""
        P, R = position[data.pose], rotation[data.pose]
        reflector = P + np.einsum("nij,nj->ni", R, self.reflector[data.reflector])
        return np.asarray(
            np.einsum("nij,nj->ni", self.rotation[data.instrument], reflector) + self.origin[data.instrument]
        )


def initial_frames(data: Measurements, position: Array, rotation: Array) -> InstrumentFrames:
    """Frames that fit the nominal arm best, by alternating linear steps; robust against a few outliers."""
    V, R = len(data.instruments), len(data.reflectors)
    frames = InstrumentFrames(np.tile(np.eye(3), (V, 1, 1)), np.zeros((V, 3)), np.zeros((R, 3)))
    P, rotation_of_row = position[data.pose], rotation[data.pose]
    weight = np.ones(len(P))
    previous = np.inf
    for _ in range(ROUNDS):
        reflector = P + np.einsum("nij,nj->ni", rotation_of_row, frames.reflector[data.reflector])
        frames = _fit_instruments(data, frames, reflector, weight)
        frames = _fit_reflectors(data, frames, P, rotation_of_row, weight)
        distance = measured_distance(frames, data, position, rotation)
        median = max(float(np.median(distance)), 1e-9)
        weight = 1 / np.maximum(distance / (4 * median), 1.0) ** 2
        if abs(previous - median) <= 0.02 * median:
            break
        previous = median
    return frames


def measured_distance(frames: InstrumentFrames, data: Measurements, position: Array, rotation: Array) -> Array:
    """How far each row was measured from where it is predicted, along the coordinates that were measured, (N,) [m]."""
    difference = frames.predict(data, position, rotation) - data.position
    return np.asarray(np.linalg.norm(np.where(np.isfinite(data.position), difference, 0.0), axis=1))


def _fit_instruments(data: Measurements, frames: InstrumentFrames, reflector: Array, weight: Array) -> InstrumentFrames:
    """Each instrument's frame, by Kabsch; an aligned one only moves."""
    rotation, origin = frames.rotation.copy(), frames.origin.copy()
    for i, aligned in enumerate(data.aligned.tolist()):
        rows = data.instrument == i
        measured = np.isfinite(data.position[rows])
        total = np.array([weight[rows][column].sum() or 1.0 for column in measured.T])
        share = weight[rows, None] * measured / total
        place = np.where(measured, data.position[rows], 0.0)
        centre, measured_centre = (share * reflector[rows]).sum(axis=0), (share * place).sum(axis=0)
        if not aligned:
            u, _, v = np.linalg.svd((share * (reflector[rows] - centre)).T @ (place - measured_centre))
            flip = np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))])
            rotation[i] = v.T @ flip @ u.T
        origin[i] = measured_centre - rotation[i] @ centre
    return InstrumentFrames(rotation, origin, frames.reflector)


def _fit_reflectors(
    data: Measurements, frames: InstrumentFrames, P: Array, rotation: Array, weight: Array
) -> InstrumentFrames:
    """Reflectors and origins together, linear for given frame rotations."""
    V, R = len(frames.origin), len(frames.reflector)
    N = len(P)
    flange = np.einsum("nij,nj->ni", frames.rotation[data.instrument], P)
    A = np.zeros((N, 3, 3 * (R + V)))
    to_instrument = frames.rotation[data.instrument] @ rotation
    for r in range(R):
        A[data.reflector == r, :, 3 * r : 3 * r + 3] = to_instrument[data.reflector == r]
    for i in range(V):
        A[data.instrument == i, :, 3 * (R + i) : 3 * (R + i) + 3] = np.eye(3)
    measured = np.isfinite(data.position)
    root = np.sqrt(weight)[:, None] * measured  # a coordinate that was not measured says nothing
    lhs = (A * root[:, :, None]).reshape(3 * N, -1)
    rhs = ((np.where(measured, data.position, 0.0) - flange) * root).ravel()
    regularisation = FAINT * np.eye(lhs.shape[1])[: 3 * R]
    x = np.linalg.lstsq(np.vstack([lhs, regularisation]), np.concatenate([rhs, np.zeros(3 * R)]), rcond=None)[0]
    return InstrumentFrames(frames.rotation, x[3 * R :].reshape(V, 3), x[: 3 * R].reshape(R, 3))
