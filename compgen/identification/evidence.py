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
from scipy.linalg import cho_factor, cho_solve, lapack
from scipy.sparse import coo_matrix

from compgen.core.arrays import Array, BoolArray, IntArray

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
    rows: float  # how many, by weight; none: their noise is known
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

    def of_unknowns(self, kept: BoolArray) -> "NormalEquations":
        """The equations of some of the unknowns, (D,), the others at zero."""
        matrix = self.matrix[np.ix_(kept, kept)]
        return NormalEquations(matrix, self.vector[kept], self.sum_of_squares, self.rows, self.kind)


def normal_equations(A: Array, z: Array, weight: Array, kind: int = 0) -> NormalEquations:
    """Normal equations of rows A (n, D), z (n,), weights (n,) of one kind."""
    root = np.sqrt(weight)
    scaled, right = A * root[:, None], z * root
    return NormalEquations(scaled.T @ scaled, scaled.T @ right, float(right @ right), float(weight.sum()), kind)


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
class Scales:
    """Variances: of each group against its prior, of the noise of each kind of rows, and of poses beside rows."""

    group: Array  # (G,) lambda
    noise: Array  # (kinds,) s^2 [m^2], [rad^2]
    rho: float = 0.0  # of the noise that the rows of a pose share, over s^2, where an instrument measured them


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
    group: IntArray,
    frame_precision: Array,
    frame_mean: Array,
    scales: Scales,
    learn_groups: bool = True,
    learn_noise: bool = True,
    rounds: int = ROUNDS,
    ceiling: Array | float = 1e6,
) -> Posterior:
    """The posterior, with scales of the groups and of the noise that maximise the evidence.

    Args:
        channels: Equations of the rows of each kind.
        group: Group of each parameter, (K,); the first K unknowns.
        frame_precision: Prior precision of the other unknowns, (D - K,).
        frame_mean: Prior mean of the other unknowns, (D - K,).
        scales: Where to begin.
        learn_groups: Whether the scales of the groups may change.
        learn_noise: Whether the noise may change.
        rounds: At most so many.
        ceiling: Largest lambda, of all groups or of each, (G,).
    """
    K, G = len(group), len(scales.group)
    size = np.bincount(group, minlength=G)
    lam, noise = scales.group.copy(), scales.noise.copy()
    prior_vector = np.concatenate([np.zeros(K), frame_precision * frame_mean])
    for step in range(rounds + 1):
        precision = np.concatenate([1 / lam[group], frame_precision])
        H = np.diag(precision)
        b = prior_vector.copy()
        for channel in channels:
            H += channel.matrix / noise[channel.kind]
            b += channel.vector / noise[channel.kind]
        root = np.sqrt(np.diag(H))
        factor = cho_factor(H / np.outer(root, root), lower=True)
        inverse, _ = lapack.dpotri(factor[0], lower=1)
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        C = inverse / np.outer(root, root)
        x = cho_solve(factor, b / root) / root
        gamma = 1 - precision * np.diag(C)
        if step == rounds or not (learn_groups or learn_noise):
            break
        new_lam, new_noise = lam.copy(), noise.copy()
        if learn_groups and K:
            new_lam = (NU + np.bincount(group, x[:K] ** 2, G)) / (NU + np.bincount(group, np.maximum(gamma[:K], 0), G))
            new_lam = np.where(size > 0, np.clip(new_lam, FLOOR, ceiling), lam)
        if learn_noise:
            for channel in channels:
                if channel.rows > 0:
                    c = channel.kind
                    determined = float(np.einsum("ij,ji->", C, channel.matrix)) / noise[c]
                    misfit = max(_squared_residual(channel, x), 0.0)
                    freedom = max(channel.rows - determined, 0.0)
                    new_noise[c] = (NOISE_ROWS * USUAL_NOISE[c] ** 2 + misfit) / (NOISE_ROWS + freedom)
        change = max(np.abs(np.log(new_lam / lam)).max(initial=0.0), np.abs(np.log(new_noise / noise)).max())
        lam, noise = new_lam, new_noise
        if change < CONVERGED:
            rounds = min(rounds, step + 1)
    evidence = -0.5 * sum(
        n.rows * np.log(2 * np.pi * noise[n.kind]) + _squared_residual(n, x) / noise[n.kind] for n in channels
    )
    deviation = np.concatenate([x[:K], x[K:] - frame_mean])
    with np.errstate(divide="ignore"):
        log_prior = float(np.log(precision[precision > 0]).sum())
    evidence += 0.5 * (log_prior - float(deviation**2 @ precision) - 2 * float(np.log(np.diag(factor[0]) * root).sum()))
    return Posterior(x, C, np.clip(gamma[:K], 0, 1), Scales(lam, noise, scales.rho), float(evidence))


def _squared_residual(equations: NormalEquations, x: Array) -> float:
    """|z - A x|^2."""
    return float(equations.sum_of_squares - 2 * x @ equations.vector + x @ equations.matrix @ x)
