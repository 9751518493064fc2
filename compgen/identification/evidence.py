r"""The linear problem inside each step: a Gaussian posterior, and the scales that the data itself asks for.

Unknowns x = (u, f): parameters in units of their prior, u_k = p_k / sigma_k with prior N(0, lambda_g(k)), and frames
f with (nearly) none. Rows z = A x + noise of variance s^2. Then

    C = (A'A / s^2 + D)^-1,   x = C A'z / s^2,   D = diag(1 / lambda_g)

and the scales maximise the evidence of the rows by MacKay's fixed point (1992, Neural Computation 4, 415),

    lambda_g = (nu + sum_g u^2) / (nu + sum_g gamma),   gamma_k = 1 - C_kk / lambda_g
    s^2 = (nu_s s_0^2 + |z - A x|^2) / (nu_s + n - sum gamma)

nu_s and s_0 say what noise is usual, so that few rows cannot be explained to the last digit. nu is the weight of the
robot file's own sigma, as so many measured parameters. A group that the data does not need shrinks to nominal; with
few rows all of them do. Nothing blows up: C is bounded by the priors."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lapack

from compgen.core.arrays import Array, IntArray

NU = 0.3
USUAL_NOISE = (30e-6, 50e-6)  # [m], [rad] of one coordinate: an instrument's and the arm's repeatability together
NOISE_ROWS = 10.0  # weight of the usual noise, as so many measured coordinates
ROUNDS = 60
SETTLED = 0.02  # relative change of the scales that ends the rounds


@dataclass(frozen=True, eq=False, slots=True)
class Normal:
    """Sums over rows of one kind of noise: all that the linear problem needs."""

    square: Array  # (D, D) A'A
    side: Array  # (D,) A'z
    length: float  # z'z
    count: float  # rows

    def less(self, other: "Normal") -> "Normal":
        """Without some of the rows."""
        return Normal(
            self.square - other.square, self.side - other.side, self.length - other.length, self.count - other.count
        )


def normal_of(A: Array, z: Array, weight: Array) -> Normal:
    """Sums over rows A (n, D), z (n,), weights (n,)."""
    root = np.sqrt(weight)
    scaled, right = A * root[:, None], z * root
    return Normal(scaled.T @ scaled, scaled.T @ right, float(right @ right), float(weight.sum()))


@dataclass(frozen=True, eq=False, slots=True)
class Scales:
    """What the data says about scales: of each group against its prior, and of the noise."""

    group: Array  # (G,) lambda
    noise: Array  # (channels,) s^2 [m^2], [rad^2]


@dataclass(frozen=True, eq=False, slots=True)
class Posterior:
    """Mean and covariance of the unknowns."""

    x: Array  # (D,)
    covariance: Array  # (D, D)
    gamma: Array  # (K,) how much of each parameter the data says, 0 to 1
    scales: Scales
    log_evidence: float


def posterior(
    channels: Sequence[Normal],
    group: IntArray,
    fixed: Array,
    target: Array,
    scales: Scales,
    learn_groups: bool = True,
    learn_noise: bool = True,
    rounds: int = ROUNDS,
) -> Posterior:
    """Scales and posterior together.

    Args:
        channels: Sums of the position rows, and of the orientation rows if any.
        group: Group of each parameter, (K,); the first K unknowns.
        fixed: Prior precision of the other unknowns, (D - K,).
        target: Prior mean of the other unknowns, (D - K,).
        scales: Where to begin.
        learn_groups: Whether the scales of the groups may change.
        learn_noise: Whether the noise may change.
        rounds: At most so many.
    """
    K, G = len(group), len(scales.group)
    size = np.bincount(group, minlength=G)
    lam, noise = scales.group.copy(), scales.noise.copy()
    pull = np.concatenate([np.zeros(K), fixed * target])
    for turn in range(rounds + 1):
        precision = np.concatenate([1 / lam[group], fixed])
        H = np.diag(precision)
        b = pull.copy()
        for normal, s2 in zip(channels, noise):
            H += normal.square / s2
            b += normal.side / s2
        root = np.sqrt(np.diag(H))
        factor = cho_factor(H / np.outer(root, root), lower=True)
        inverse, _ = lapack.dpotri(factor[0], lower=1)
        inverse = np.tril(inverse) + np.tril(inverse, -1).T
        C = inverse / np.outer(root, root)
        x = cho_solve(factor, b / root) / root
        gamma = 1 - precision * np.diag(C)
        if turn == rounds or not (learn_groups or learn_noise):
            break
        new, fresh = lam.copy(), noise.copy()
        if learn_groups and K:
            new = (NU + np.bincount(group, x[:K] ** 2, G)) / (NU + np.bincount(group, np.maximum(gamma[:K], 0), G))
            new = np.where(size > 0, np.clip(new, 1e-6, 1e6), lam)
        if learn_noise:
            for c, normal in enumerate(channels):
                if normal.count > 0:
                    used = float(np.einsum("ij,ji->", C, normal.square)) / noise[c]
                    rest = max(_rest(normal, x), 0.0)
                    free = max(normal.count - used, 0.0)
                    fresh[c] = (NOISE_ROWS * USUAL_NOISE[c] ** 2 + rest) / (NOISE_ROWS + free)
        change = max(np.abs(np.log(new / lam)).max(initial=0.0), np.abs(np.log(fresh / noise)).max())
        lam, noise = new, fresh
        if change < SETTLED:
            rounds = min(rounds, turn + 1)
    evidence = -0.5 * sum(
        n.count * np.log(2 * np.pi * s2) + _rest(n, x) / s2 for n, s2 in zip(channels, noise) if n.count
    )
    pulled = np.concatenate([x[:K], x[K:] - target])
    with np.errstate(divide="ignore"):
        log_prior = float(np.log(precision[precision > 0]).sum())
    evidence += 0.5 * (log_prior - float(pulled**2 @ precision) - 2 * float(np.log(np.diag(factor[0]) * root).sum()))
    return Posterior(x, C, np.clip(gamma[:K], 0, 1), Scales(lam, noise), float(evidence))


def _rest(normal: Normal, x: Array) -> float:
    """|z - A x|^2."""
    return float(normal.length - 2 * x @ normal.side + x @ normal.square @ x)
