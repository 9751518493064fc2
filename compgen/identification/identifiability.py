r"""What the measurements can tell apart: the scaled Jacobian, its singular values and the order in which columns
stand out.

Columns are scaled by each parameter's prior and freed from what the frames can do as well (projected off them):

    S = (I - F F^+) A diag(sigma) / s

A singular value far below one is a combination of parameters that the data says nothing of against its prior. QR with
column pivoting puts such columns last and names them."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from compgen.core.arrays import Array
from compgen.identification.fit import Fit
from compgen.identification.measurements import Measurements
from compgen.identification.model import Model

KNOWN = 0.5  # share of a parameter's prior variance that the data must take away, to call it identified
ALIKE = 0.95  # correlation beyond which two parameters cannot be told apart


@dataclass(frozen=True, eq=False, slots=True)
class Identifiability:
    """What is known after the measurements."""

    singular: Array  # (K,) of S, falling
    order: tuple[int, ...]  # parameters by how well they stand out, best first
    held: tuple[int, ...]  # parameters that the data says little of: the prior holds them
    alike: tuple[tuple[int, int, float], ...]  # pairs and their correlation
    condition: float  # of S over what the data knows better than the priors
    frames_condition: float  # of the frames' own columns, scaled


def identifiable(model: Model, data: Measurements, found: Fit) -> Identifiability:
    """Judge a fit's Jacobian."""
    K = int(found.active.sum())
    keep = ~found.wild
    D = found.linear.A.shape[2]
    rows = (found.linear.A[keep] / data.sigma[keep, None, None]).reshape(-1, D)
    frames = rows[:, K:]
    size = np.linalg.norm(frames, axis=0)
    scaled = frames / np.where(size > 0, size, 1.0)
    ill = _frames_condition(data, found, K)
    index = np.flatnonzero(found.active)
    if K == 0:
        return Identifiability(np.zeros(0), (), (), (), 1.0, ill)
    values, left = np.linalg.eigh(scaled.T @ scaled)
    base = np.linalg.qr(scaled @ left[:, values > 1e-10 * values[-1]])[0]
    _, group = model.groups()
    spread = np.sqrt(found.posterior.scales.group[group[found.active]])
    S = rows[:, :K] * spread / found.noise
    S = S - base @ (base.T @ S)
    _, pivot = qr(np.linalg.qr(S, mode="r"), mode="r", pivoting=True)
    singular = np.linalg.svd(S, compute_uv=False)
    told = singular[singular > 1.0]
    variance = np.diag(found.posterior.covariance)[:K]
    held = tuple(int(index[k]) for k in range(K) if variance[k] > (1 - KNOWN) * spread[k] ** 2)
    correlation = found.posterior.covariance[:K, :K] / np.sqrt(np.outer(variance, variance))
    upper = np.argwhere(np.triu(np.abs(correlation), 1) > ALIKE)
    alike = tuple((int(index[i]), int(index[j]), float(correlation[i, j])) for i, j in upper.tolist())
    condition = float(told[0] / told[-1]) if len(told) else float("inf")
    order = tuple(int(index[k]) for k in pivot.tolist())
    return Identifiability(np.asarray(singular, dtype=float), order, held, alike, condition, ill)


def _frames_condition(data: Measurements, found: Fit, K: int) -> float:
    """Of the columns of instruments with frames of their own and of the reflectors they saw; axis tests have theirs."""
    free = ~data.aligned[data.instrument] & ~found.wild
    if not free.any():
        return 1.0
    rows = found.linear.A[free].reshape(-1, found.linear.A.shape[2])[:, K:]
    size = np.linalg.norm(rows, axis=0)
    values = np.linalg.svd(rows[:, size > 0] / size[size > 0], compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")


def correlations(found: Fit) -> Array:
    """Correlation of all free parameters, (K', K')."""
    K = int(found.active.sum())
    C = found.posterior.covariance[:K, :K]
    size = np.sqrt(np.diag(C))
    return np.asarray(C / np.outer(size, size))
