r"""How well a model predicts measurements that it was not fitted to: blocked cross-validation.

Poses that follow each other are alike (same posture, same warmth), so they are left out in blocks: consecutive poses
make a block, blocks are dealt to the folds in turn, and all rows of a pose stay together. For each fold the linear
problem, with its scales and noise, is solved anew from the other folds' rows; its own rows are then predicted.
A distance between two poses is left out with either.
Rows that were set aside take no part in the solution and count in the error: what is measured next time will have its
wild rows too. Models are compared by a mean in which no row counts for more than LIMIT medians, each over its sigma
beside the others of its kind."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.identification.fit import Fit
from compgen.identification.measurements import NONE, Measurements
from compgen.identification.model import ArmModel

FOLDS = 10
BLOCKS = 50  # about so many blocks of consecutive poses
SMALLEST = 2  # poses of a block
LIMIT = 5.0  # medians of the distances, that one row may count for where models are compared
ROUNDS = 25


@dataclass(frozen=True, eq=False, slots=True)
class CrossValidation:
    """Distances of measured positions from predictions that did not use them."""

    #: (N,) [m] of all rows, those that were set aside with them; NaN where nothing predicts a row. A row of one number
    #: counts sqrt(3) times its misfit, as the place that it is one coordinate of
    distance: Array
    block: IntArray  # (N,)
    sigma: Array | float = 1.0  # (N,) of each row beside the others of its kind

    @property
    def mean(self) -> float:
        """Mean distance of all rows [m]."""
        return float(np.nanmean(self.distance))

    @property
    def robust_mean(self) -> float:
        """Mean of a row of usual sigma, in which none counts for more than LIMIT medians [m]."""
        return float(np.nanmean(self.limited(self.most)))

    @property
    def most(self) -> float:
        """What a row may count for where models are compared [m]."""
        return LIMIT * float(np.nanmedian(self.distance / self.sigma))

    def limited(self, most: float) -> Array:
        """Distances over their sigmas, none above ``most``, (N,) [m]."""
        return np.minimum(self.distance / self.sigma, most)

    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the mean, from the spread of the blocks' means [m]."""
        return confidence_interval(self.distance, self.block)


def blocks_of_poses(data: Measurements) -> IntArray:
    """The block of each pose, (M,)."""
    size = max(SMALLEST, round(len(data.theta) / BLOCKS))
    rank = np.empty(len(data.theta), dtype=int)
    rank[np.argsort(data.time, kind="stable")] = np.arange(len(data.theta))
    return np.asarray(rank // size)


def cross_validate(model: ArmModel, data: Measurements, fitted: Fit) -> CrossValidation:
    """Cross-validation of a fit, by folds of blocks."""
    block = blocks_of_poses(data)[data.pose]  # of a row at two poses that of the first
    problem = fitted.problem(model, data)
    all_rows = problem.equations()
    distance = np.full(len(block), np.nan)
    for k in range(FOLDS):
        held_out = held_out_rows(data, k)
        if not held_out.any():
            continue
        of_fold = problem.equations(held_out, with_known=False)
        training = [a.without(b) for a, b in zip(all_rows, of_fold, strict=True)]
        if sum(t.rows for t in training) < 3:
            continue
        refitted = problem.solve(training, learn_groups=True, learn_noise=True, rounds=ROUNDS)
        residual = problem.left(refitted.x, held_out)
        distance[held_out] = np.linalg.norm(residual, axis=1) * np.sqrt(3 / data.numbers[held_out])
    return CrossValidation(distance, block, data.sigma)


def held_out_rows(data: Measurements, fold: int) -> BoolArray:
    """Rows of the poses that a fold leaves out, (N,): with either end at one of them."""
    left_out = blocks_of_poses(data) % FOLDS == fold
    return np.asarray(left_out[data.pose] | (left_out[data.ends.pose] & (data.ends.pose != NONE)))


def improvement_interval(model: CrossValidation, other: CrossValidation) -> tuple[float, float]:
    """95 % interval of how much nearer a model predicts than another, on all rows, each to LIMIT medians [m]."""
    return confidence_interval(other.limited(other.most) - model.limited(other.most), model.block)


def richest_of_the_best(foretold: Sequence[CrossValidation]) -> int:
    """Which of models, from the plainest, is the richest that foretells no worse than the best, at 95 %.

    What a plainer one leaves out would count as known to be nothing, and no measurement has shown that.
    """
    best = foretold[int(np.nanargmin([f.robust_mean for f in foretold]))]
    return max(i for i, f in enumerate(foretold) if f is best or improvement_interval(best, f)[0] <= 0)


def confidence_interval(values: Array, block: IntArray) -> tuple[float, float]:
    """95 % confidence interval of the mean of values, (N,), from the spread of the means of their blocks."""
    known = np.isfinite(values)
    of_blocks = [values[known & (block == b)] for b in np.unique(block[known])]
    if len(of_blocks) < 2:
        return float("-inf"), float("inf")
    means = np.array([inside.mean() for inside in of_blocks])
    weights = np.array([len(inside) for inside in of_blocks]) / known.sum()
    centre = float(weights @ means)
    spread = np.sqrt(float((weights**2) @ (means - centre) ** 2) * len(means) / (len(means) - 1))
    return centre - 1.96 * spread, centre + 1.96 * spread
