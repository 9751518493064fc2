r"""How well a model predicts what it has not seen: blocked cross-validation.

Poses that follow each other are alike (same posture, same warmth), so they are left out in blocks: consecutive poses
make a block, blocks are dealt to the folds in turn, and all rows of a pose stay together. For each fold the linear
problem, with its scales and noise, is solved anew from the other folds' rows; its own rows are then predicted. Rows
that were set aside as wild take part in neither."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.identification.evidence import posterior
from compgen.identification.fit import Fit, frame_prior, normals
from compgen.identification.measurements import Measurements
from compgen.identification.model import Model

FOLDS = 10
BLOCKS = 50  # about so many blocks of consecutive poses
ROUNDS = 25


@dataclass(frozen=True, eq=False, slots=True)
class HeldOut:
    """Distances between measured and predicted places that were not used for the prediction."""

    distance: Array  # (N,) [m]; NaN at rows set aside
    block: IntArray  # (N,)

    @property
    def mean(self) -> float:
        """Mean distance [m]."""
        return float(np.nanmean(self.distance))

    def interval(self) -> tuple[float, float]:
        """95 % confidence interval of the mean, from the spread of the blocks' means [m]."""
        return _interval(self.distance, self.block)


def blocks_of(data: Measurements) -> IntArray:
    """The block of each row, (N,)."""
    size = max(1, round(len(data.theta) / BLOCKS))
    rank = np.empty(len(data.theta), dtype=int)
    rank[np.argsort(data.time, kind="stable")] = np.arange(len(data.theta))
    return np.asarray(rank[data.pose] // size)


def held_out(model: Model, data: Measurements, found: Fit) -> HeldOut:
    """Cross-validation of a fit, by folds of blocks."""
    block = blocks_of(data)
    fold = block % FOLDS
    at = np.concatenate([(found.p / model.prior)[found.active], np.zeros(_frames(found))])
    weight = (~found.wild) / data.sigma**2
    everything = normals(found.linear, weight, at)
    _, group = model.groups()
    fixed, target = frame_prior(data, found.frames, _frames(found))
    distance = np.full(len(block), np.nan)
    for k in range(FOLDS):
        own = fold == k
        if not (own & ~found.wild).any():
            continue
        rest = [a.less(b) for a, b in zip(everything, normals(found.linear, weight, at, own))]
        if rest[0].count * (data.sigma**2).min() < 3:
            continue
        told = posterior(rest, group[found.active], fixed, target, found.posterior.scales, rounds=ROUNDS)
        step = told.x - at
        missed = found.linear.z[own] - found.linear.A[own] @ step
        distance[own] = np.linalg.norm(missed, axis=1)
    distance[found.wild] = np.nan
    return HeldOut(distance, block)


def better(model: HeldOut, other: HeldOut) -> tuple[float, float]:
    """95 % interval of how much nearer a model predicts than another, on the same rows [m]."""
    return _interval(other.distance - model.distance, model.block)


def _interval(values: Array, block: IntArray) -> tuple[float, float]:
    means, sizes = [], []
    for b in np.unique(block):
        own = values[(block == b) & np.isfinite(values)]
        if len(own):
            means.append(float(own.mean()))
            sizes.append(len(own))
    weights = np.array(sizes) / sum(sizes) if sizes else np.zeros(0)
    if len(means) < 2:
        return float("-inf"), float("inf")
    centre = float(weights @ np.array(means))
    spread = np.sqrt(float((weights**2) @ (np.array(means) - centre) ** 2) * len(means) / (len(means) - 1))
    return centre - 1.96 * spread, centre + 1.96 * spread


def _frames(found: Fit) -> int:
    return int(found.linear.A.shape[2] - found.active.sum())
