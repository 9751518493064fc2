r"""Where the instrument stands and where the reflectors sit: unknown, and fitted along.

    y = R_i (P + R t_r) + c_i

for instrument i and reflector r at flange (P, R). A start comes from alternating two linear problems: reflectors for
given frames, frames (Kabsch 1976, by SVD) for given reflectors.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, own
from compgen.identification.measurements import Measurements

ROUNDS = 50


@dataclass(frozen=True, eq=False, slots=True)
class InstrumentFrames:
    """World in each instrument's frame, and each reflector in the flange."""

    rotation: Array  # (V, 3, 3)
    origin: Array  # (V, 3) [m]
    reflector: Array  # (R, 3) [m]

    def __post_init__(self) -> None:
        own(self, rotation=("V", 3, 3), origin=("V", 3), reflector=("R", 3))

    def seen(self, data: Measurements, position: Array, rotation: Array) -> Array:
        """Where the instrument sees each row's reflector, (N, 3) [m]."""
        P, R = position[data.pose], rotation[data.pose]
        place = P + np.einsum("nij,nj->ni", R, self.reflector[data.reflector])
        return np.asarray(np.einsum("nij,nj->ni", self.rotation[data.instrument], place) + self.origin[data.instrument])


def begin(data: Measurements, position: Array, rotation: Array) -> InstrumentFrames:
    """Frames that meet the nominal arm best, by alternating linear steps; robust against a few wild rows."""
    V, R = len(data.instruments), len(data.reflectors)
    frames = InstrumentFrames(np.tile(np.eye(3), (V, 1, 1)), np.zeros((V, 3)), np.zeros((R, 3)))
    P, turn = position[data.pose], rotation[data.pose]
    weight = np.ones(len(P))
    last = np.inf
    for _ in range(ROUNDS):
        place = P + np.einsum("nij,nj->ni", turn, frames.reflector[data.reflector])
        frames = _placed(data, frames, place, weight)
        frames = _sat(data, frames, P, turn, weight)
        miss = np.linalg.norm(frames.seen(data, position, rotation) - data.position, axis=1)
        usual = max(float(np.median(miss)), 1e-9)
        weight = 1 / np.maximum(miss / (4 * usual), 1.0) ** 2
        if abs(last - usual) <= 0.02 * usual:
            break
        last = usual
    return frames


def _placed(data: Measurements, frames: InstrumentFrames, place: Array, weight: Array) -> InstrumentFrames:
    """Each instrument's frame, by Kabsch; an aligned one only moves."""
    rotation, origin = frames.rotation.copy(), frames.origin.copy()
    for i, aligned in enumerate(data.aligned.tolist()):
        own_ = data.instrument == i
        w = weight[own_, None] / weight[own_].sum()
        a, b = (w * place[own_]).sum(axis=0), (w * data.position[own_]).sum(axis=0)
        if not aligned:
            u, _, v = np.linalg.svd((w * (place[own_] - a)).T @ (data.position[own_] - b))
            flip = np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))])
            rotation[i] = v.T @ flip @ u.T
        origin[i] = b - rotation[i] @ a
    return InstrumentFrames(rotation, origin, frames.reflector)


def _sat(data: Measurements, frames: InstrumentFrames, P: Array, turn: Array, weight: Array) -> InstrumentFrames:
    """Reflectors and origins together, linear for given frame rotations."""
    V, R = len(frames.origin), len(frames.reflector)
    N = len(P)
    base = np.einsum("nij,nj->ni", frames.rotation[data.instrument], P)
    A = np.zeros((N, 3, 3 * (R + V)))
    through = frames.rotation[data.instrument] @ turn
    for r in range(R):
        A[data.reflector == r, :, 3 * r : 3 * r + 3] = through[data.reflector == r]
    for i in range(V):
        A[data.instrument == i, :, 3 * (R + i) : 3 * (R + i) + 3] = np.eye(3)
    root = np.sqrt(weight)
    lhs, rhs = (A * root[:, None, None]).reshape(3 * N, -1), ((data.position - base) * root[:, None]).ravel()
    # a faint pull to the flange keeps what poses of one orientation cannot tell
    faint = 1e-6 * np.eye(lhs.shape[1])[: 3 * R]
    x = np.linalg.lstsq(np.vstack([lhs, faint]), np.concatenate([rhs, np.zeros(3 * R)]), rcond=None)[0]
    return InstrumentFrames(frames.rotation, x[3 * R :].reshape(V, 3), x[: 3 * R].reshape(R, 3))
