r"""What the measurements can identify: the scaled Jacobian and its singular values.

Columns are scaled by each parameter's prior and freed from what the frames can do as well (projected off them):

    S = (I - F F^+) A diag(sigma) / s

A singular value far below one is a combination of parameters that the data adds nothing to its prior.

Some directions of the arm's geometry no row can see: all measurements leave them as they are. Distances and touches of
spheres that stand anywhere see no frame: where the base stands, the first zero and the first d move everything
together. Of zeros and lengths, a direction v (in units of the priors) is unseen where

    |S v| < UNSEEN,    S = (I - F F^+) A / s

with the rows A over their noise s, freed from what frames, reflectors and places take up: the
measurements then take less than a hundredth from the prior's variance.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.error_model.rigid_share import rigid_share
from compgen.identification.fit import Fit
from compgen.identification.measurements import PLACE, WORLD, Measurements, blank_rows
from compgen.identification.model import ArmModel

KNOWN = 0.5  # share of a parameter's prior variance that the data must take away, to call it identified
CORRELATED = 0.95  # correlation beyond which two parameters cannot be told apart
UNSEEN = 0.1
GEOMETRY = ("joint_zeros", "link_offsets")
PART = 0.3  # share of the largest, from which a parameter is part of a direction
NAMED = 4  # directions
POSTURES = 200  # drawn at random, the same every time


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Identifiability:
    """Which parameters the measurements determine, and which the priors hold."""

    singular_values: Array  # (K,) of S, falling
    held_by_prior: tuple[int, ...]  # parameters that the data says little of: the prior holds them
    correlated: tuple[tuple[int, int, float], ...]  # pairs and their correlation
    condition: float  # of S over what the data knows better than the priors
    frames_condition: float  # of the frames' own columns, scaled


def assess_identifiability(model: ArmModel, data: Measurements, fitted: Fit) -> Identifiability:
    """Singular values, correlations and condition numbers of a fit's scaled Jacobian."""
    K = int(fitted.active.sum())
    rows = scaled_rows(data, fitted)
    index = np.flatnonzero(fitted.active)
    _, group = model.groups()
    spread = np.sqrt(fitted.posterior.scales.group[group[fitted.active]])
    S = _freed(rows[:, :K] * spread, rows[:, K:])
    singular = np.linalg.svd(S, compute_uv=False)
    above_prior = singular[singular > 1.0]
    variance = np.diag(fitted.posterior.covariance)[:K]
    held_by_prior = tuple(int(index[k]) for k in range(K) if variance[k] > (1 - KNOWN) * spread[k] ** 2)
    correlation = correlations(fitted)
    upper = np.argwhere(np.triu(np.abs(correlation), 1) > CORRELATED)
    correlated = tuple((int(index[i]), int(index[j]), float(correlation[i, j])) for i, j in upper.tolist())
    condition = float(above_prior[0] / above_prior[-1]) if len(above_prior) else float("inf") if K else 1.0
    return Identifiability(
        singular_values=np.asarray(singular, dtype=float),
        held_by_prior=held_by_prior,
        correlated=correlated,
        condition=condition,
        frames_condition=_condition_of_frames(data, fitted, K),
    )


def scaled_rows(data: Measurements, fitted: Fit) -> Array:
    """The Jacobian of the rows kept over their noise, and of what was known beforehand, (n, D)."""
    kept = ~fitted.outlier
    noise = (data.sigma * fitted.noise_of_row)[kept, None, None]
    rows = (fitted.linear.A[kept] / noise).reshape(-1, fitted.linear.A.shape[2])
    return np.concatenate([rows, fitted.linear.C])


def _condition_of_frames(data: Measurements, fitted: Fit, K: int) -> float:
    """Condition of the columns of free instrument frames and of their reflectors; axis tests are aligned with World."""
    free = ~np.append(data.aligned, False)[data.instrument] & ~fitted.outlier
    if not free.any():
        return 1.0
    rows = fitted.linear.A[free].reshape(-1, fitted.linear.A.shape[2])[:, K:]
    rows = np.concatenate([rows, fitted.linear.C[:, K:] * fitted.noise])
    size = np.linalg.norm(rows, axis=0)
    values = np.linalg.svd(rows[:, size > 0] / size[size > 0], compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else float("inf")


def correlations(fitted: Fit) -> Array:
    """Correlation of all free parameters, (K', K')."""
    K = int(fitted.active.sum())
    C = fitted.posterior.covariance[:K, :K]
    size = np.sqrt(np.diag(C))
    return np.asarray(C / np.outer(size, size))


def largest_moves(model: ArmModel, fitted: Fit) -> Array:
    """The largest move of a measured place by each active parameter's value, (K',) [m].

    Less what the frames of instrument and reflectors take up: dy/dp_k p_k projected off the frames' columns of the
    Jacobian. Valid to first order about the fit.
    """
    K = int(fitted.active.sum())
    A = fitted.linear.A.reshape(-1, fitted.linear.A.shape[2])
    columns = A[:, :K] * (fitted.p / model.prior)[fitted.active]
    basis = np.linalg.qr(A[:, K:])[0]
    left = columns - basis @ (basis.T @ columns)
    return np.asarray(np.linalg.norm(left.reshape(len(fitted.linear.A), 3, K), axis=1).max(axis=0))


def taught_sigma(model: ArmModel, fitted: Fit, nodes: int, limits: Array) -> float:
    """How well a cold flange is known in a frame that it has taught itself: rms of a coordinate's sigma [m].

        sigma^2 = mean tr(D C D') / 3,    D = dP/dp less the rigid motion of all POSTURES (``rigid_share``)

    with C the posterior covariance of the active parameters. A frame taught nearer to the part leaves less.

    Args:
        model: The arm.
        fitted: Its fit.
        nodes: How many nodes the heat model has.
        limits: Between which the joint angles are drawn, (6, 2) [rad].
    """
    theta = np.random.default_rng(0).uniform(limits[:, 0], limits[:, 1], (POSTURES, 6))
    rows = blank_rows(theta, np.arange(POSTURES), [""] * POSTURES, nodes)
    place, _, dP, _ = model.derivatives(fitted.active, rows, fitted.p)
    column, frame, K = dP * model.prior[fitted.active], rigid_share(place), dP.shape[2]
    root = np.linalg.cholesky(fitted.posterior.covariance[:K, :K])
    return float(np.sqrt(((frame.left(column, frame.motion(column), place) @ root) ** 2).sum(axis=2).mean()))


def unobservable(model: ArmModel, data: Measurements, fitted: Fit) -> Iterator[Finding]:
    """What distances and touches leave unknown, as findings; nothing where an instrument alone measured."""
    if (data.kind == PLACE).all():
        return
    if (data.instrument == WORLD).all():
        yield Finding.of(
            Code.UNOBSERVABLE,
            "no row sees the base: where it stands (base_frame), the zero of J1 and d1 stay nominal, and World is the "
            "robot file's; teach the part's frame with the arm (cgen teach-frame)",
        )
    directions = unseen_directions(model, data, fitted)
    if directions:
        more = f", and {len(directions) - NAMED} more" if len(directions) > NAMED else ""
        yield Finding.of(
            Code.UNOBSERVABLE, f"no row sees {'; '.join(directions[:NAMED])}{more}: held near nominal by the priors"
        )


def unseen_directions(model: ArmModel, data: Measurements, fitted: Fit) -> list[str]:
    """Directions of zeros and lengths that no row sees, each by the names of its parameters."""
    index = np.flatnonzero(fitted.active)
    columns = [n for n, k in enumerate(index.tolist()) if model.parameters[k].source in GEOMETRY]
    rows = scaled_rows(data, fitted)
    S = _freed(rows[:, columns], rows[:, len(index) :])
    values, vectors = np.linalg.eigh(S.T @ S)
    unseen = _simplest(vectors[:, values < UNSEEN**2])
    names = [model.parameters[index[n]].name for n in columns]
    return [
        " with ".join(names[n] for n in np.argsort(-np.abs(v), kind="stable") if abs(v[n]) > PART * np.abs(v).max())
        for v in unseen.T
    ]


def _freed(columns: Array, others: Array) -> Array:
    """Columns less what others take up."""
    size = np.linalg.norm(others, axis=0)
    values, vectors = np.linalg.eigh((scaled := others / np.where(size > 0, size, 1.0)).T @ scaled)
    basis = np.linalg.qr(scaled @ vectors[:, values > 1e-10 * max(values[-1], 1e-300)])[0]
    return np.asarray(columns - basis @ (basis.T @ columns))


def _simplest(basis: Array) -> Array:
    """The same space by directions that have few parameters each: Gauss-Jordan on the largest entries, (K, m)."""
    basis = basis.copy()
    for m in range(basis.shape[1]):
        taken = np.abs(basis).copy()
        taken[:, :m] = 0.0
        row, column = divmod(int(np.argmax(taken)), taken.shape[1])
        basis[:, [m, column]] = basis[:, [column, m]]
        basis[:, m] /= basis[row, m]
        for other in range(basis.shape[1]):
            if other != m:
                basis[:, other] -= basis[row, other] * basis[:, m]
    return basis
