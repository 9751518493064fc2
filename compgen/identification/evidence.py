r"""The linear problem of each Gauss-Newton step: a Gaussian posterior, its scales by maximum evidence.

Unknowns x = (u, f): parameters in units of their prior, u_k = p_k / sigma_k with prior N(0, lambda_g(k)), and frames
f with (nearly) none. Rows z = A x + noise of variance s^2. Then

    C = (A'A / s^2 + D)^-1,   x = C A'z / s^2,   D = diag(1 / lambda_g)

and the scales maximise the evidence of the rows by MacKay's fixed point (1992, Neural Computation 4, 415),

    lambda_g = (nu + sum_g u^2) / (nu + sum_g gamma),   gamma_k = 1 - C_kk / lambda_g
    s^2 = (nu_s s_0^2 + |z - A x|^2) / (nu_s + n - sum gamma)

nu_s and s_0 say what noise is usual, so that few rows cannot be explained to the last digit. nu is the weight of the
robot file's own sigma, as so many measured parameters. A group that the data does not need shrinks to nominal; with
few rows all of them do. Nothing blows up: C is bounded by the priors, and each lambda by its ceiling.

Rows of one pose share what the arm does there and no model says: noise of the pose beside that of each row,

    cov = s^2 (W^-1 + rho 1 1'),   cov^-1 = (W - c (W 1)(W 1)') / s^2,   c = rho / (1 + rho 1'W 1)

by Sherman and Morrison, coordinate by coordinate. Without it three reflectors on a pose would count as three poses."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, cholesky, lapack
from scipy.sparse import coo_matrix

from compgen.core.arrays import Array, IntArray

NU = 0.3
#: [m], [rad] of one number of each kind (``measurements``): an instrument's and the arm's repeatability together
USUAL_NOISE = (30e-6, 50e-6, 30e-6, 30e-6, 1.0)
NOISE_ROWS = 10.0  # weight of the usual noise, as so many measured coordinates
ROUNDS = 60
FLOOR = 1e-6  # of lambda
CONVERGED = 0.02  # relative change of the scales that ends the rounds


@dataclass(frozen=True, eq=False, slots=True)
class NormalEquations:
    """Normal equations A'A x = A'z of rows of one kind of noise, weighted."""

    matrix: Array  # (D, D) A'A
    vector: Array  # (D,) A'z
    sum_of_squares: float  # z'z
    rows: float  # how many, by their share; none: their noise is known
    kind: int = 0  # whose noise they have

    def without(self, other: "NormalEquations") -> "NormalEquations":
        """The equations less those of some of the rows."""
        return NormalEquations(
            self.matrix - other.matrix,
            self.vector - other.vector,
            self.sum_of_squares - other.sum_of_squares,
            self.rows - other.rows,
            self.kind,
        )


def normal_equations(A: Array, z: Array, share: Array, sigma: Array, kind: int = 0) -> NormalEquations:
    """Normal equations of rows A (n, D), z (n,) of one kind.

    Args:
        A: Slopes.
        z: Residuals.
        share: How much each counts as a row, (n,): 1, or 0 where it is set aside.
        sigma: Its standard deviation relative to the kind's, (n,). A row of a small one is no more than one row.
        kind: Whose noise they have.
    """
    root = np.sqrt(share) / sigma
    scaled, right = A * root[:, None], z * root
    return NormalEquations(scaled.T @ scaled, scaled.T @ right, float(right @ right), float(share.sum()), kind)


def pose_equations(A: Array, z: Array, weight: Array, pose: IntArray, rho: float) -> NormalEquations:
    """What noise common to the rows of each pose takes away from the equations of rows A (N, 3, D), z (N, 3)."""
    _, index = np.unique(pose, return_inverse=True)
    D = A.shape[2]
    members = coo_matrix((weight, (index, np.arange(len(index)))), (int(index.max(initial=-1)) + 1, len(index))).tocsr()
    share = np.sqrt(rho / (1 + rho * np.bincount(index, weight)))
    rows = (members @ A.reshape(len(A), 3 * D)).reshape(len(share), 3, D) * share[:, None, None]
    right = ((members @ z) * share[:, None]).ravel()
    rows = rows.reshape(len(right), D)
    return NormalEquations(rows.T @ rows, rows.T @ right, float(right @ right), 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class FitPrior:
    """What is known of the unknowns before the rows: K parameters in groups, and the others."""

    group: IntArray  # (K,) of each parameter; the first K unknowns
    precision: Array  # (D - K,) of the others
    mean: Array  # (D - K,)
    ceiling: Array  # (G,) largest lambda of each group


@dataclass(frozen=True, eq=False, slots=True)
class Scales:
    """Variances: of each group against its prior, of the noise of each kind of rows, and of poses beside rows."""

    group: Array  # (G,) lambda
    noise: Array  # (kinds,) s^2 [m^2], [rad^2]
    rho: float = 0.0  # of the noise that the rows of a pose share, over s^2, where an instrument measured them

    def precision(self, prior: FitPrior) -> Array:
        """Of all unknowns before the rows, (D,)."""
        return np.concatenate([1 / self.group[prior.group], prior.precision])


@dataclass(frozen=True, eq=False, slots=True)
class Posterior:
    """Mean and covariance of the unknowns."""

    x: Array  # (D,)
    covariance: Array  # (D, D)
    gamma: Array  # (K,) share of each parameter that the data determines, 0 to 1
    scales: Scales
    log_evidence: float


def posterior(
    channels: Sequence[NormalEquations],
    prior: FitPrior,
    scales: Scales,
    *,
    learn_groups: bool = True,
    learn_noise: bool = True,
    rounds: int = ROUNDS,
) -> Posterior:
    """The posterior, with scales of the groups and of the noise that maximise the evidence.

    Args:
        channels: Equations of the rows of each kind.
        prior: Of the unknowns.
        scales: Where to begin.
        learn_groups: Whether the scales of the groups may change.
        learn_noise: Whether the noise may change.
        rounds: At most so many.
    """
    K, learning = len(prior.group), learn_groups or learn_noise
    for step in range(rounds + 1):
        x, C, log_det = _solved(channels, prior, scales)
        gamma = (1 - scales.precision(prior) * np.diag(C))[:K]
        if step == rounds or not learning:
            break
        lam = _group_scales(prior, scales, x[:K], gamma) if learn_groups else scales.group
        noise = _noise(channels, scales, x, C) if learn_noise else scales.noise
        moved = np.abs(np.log(np.concatenate([lam / scales.group, noise / scales.noise]))).max()
        scales = Scales(lam, noise, scales.rho)
        learning = moved >= CONVERGED
    misfit = sum(
        n.rows * np.log(2 * np.pi * scales.noise[n.kind]) + _squares(n, x) / scales.noise[n.kind] for n in channels
    )
    precision = scales.precision(prior)
    deviation = np.concatenate([x[:K], x[K:] - prior.mean])
    log_prior = float(np.log(precision[precision > 0]).sum())
    evidence = 0.5 * (log_prior - misfit - float(deviation**2 @ precision) - log_det)
    return Posterior(x, C, np.clip(gamma, 0, 1), scales, float(evidence))


def _solved(channels: Sequence[NormalEquations], prior: FitPrior, scales: Scales) -> tuple[Array, Array, float]:
    """x (D,), C (D, D), and the logarithm of det C^-1."""
    H = np.diag(scales.precision(prior))
    b = np.concatenate([np.zeros(len(prior.group)), prior.precision * prior.mean])
    for channel in channels:
        H += channel.matrix / scales.noise[channel.kind]
        b += channel.vector / scales.noise[channel.kind]
    root = np.sqrt(np.diag(H))
    scale = np.outer(root, root)
    factor = cholesky((H / scale).T, lower=True, overwrite_a=True)  # as LAPACK wants it: no copy
    inverse, _ = lapack.dpotri(factor, lower=1)  # nothing above its diagonal
    C = inverse + inverse.T
    np.fill_diagonal(C, np.diag(inverse))
    C /= scale
    return cho_solve((factor, True), b / root) / root, C, 2 * float(np.log(np.diag(factor) * root).sum())


def _group_scales(prior: FitPrior, scales: Scales, u: Array, gamma: Array) -> Array:
    """The next lambda of each group, (G,)."""
    G = len(scales.group)
    determined = np.bincount(prior.group, np.maximum(gamma, 0), G)
    lam = np.clip((NU + np.bincount(prior.group, u**2, G)) / (NU + determined), FLOOR, prior.ceiling)
    return np.where(np.bincount(prior.group, minlength=G) > 0, lam, scales.group)


def _noise(channels: Sequence[NormalEquations], scales: Scales, x: Array, C: Array) -> Array:
    """The next s^2 of each kind of rows, (kinds,)."""
    noise = scales.noise.copy()
    for channel in channels:
        if channel.rows > 0:
            c = channel.kind
            determined = float(np.einsum("ij,ji->", C, channel.matrix)) / scales.noise[c]
            freedom = max(channel.rows - determined, 0.0)
            misfit = max(_squares(channel, x), 0.0)
            noise[c] = (NOISE_ROWS * USUAL_NOISE[c] ** 2 + misfit) / (NOISE_ROWS + freedom)
    return noise


def _squares(equations: NormalEquations, x: Array) -> float:
    """|z - A x|^2."""
    return float(equations.sum_of_squares - 2 * x @ equations.vector + x @ equations.matrix @ x)
