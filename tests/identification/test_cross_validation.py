"""Which model is identified: the richest of those whose foretelling of poses left out no measurement tells apart."""

import numpy as np
import pytest

from compgen.core.units import UM
from compgen.identification.cross_validation import CrossValidation, confidence_interval, richest_of_the_best

BLOCKS, ROWS = 50, 4


def foretold(*worse_um, scatter_um=2.0):
    """Models from the plainest, whose held-out distances are so much above 45 um and scatter by blocks."""
    rng, block = np.random.default_rng(5), np.repeat(np.arange(BLOCKS), ROWS)
    each = rng.normal(0, scatter_um, (len(worse_um), BLOCKS))
    each -= each.mean(axis=1, keepdims=True)  # the means are those that are named
    return [CrossValidation((45 + w + e[block]) * UM, block) for w, e in zip(worse_um, each, strict=True)]


@pytest.mark.parametrize(
    ("worse_um", "chosen"),
    [
        ((600, 60, 0.0, 0.2), 3),  # 0.2 um, and the blocks leave 0.4 open
        ((600, 60, 0.0, 2.0), 2),
        ((600, 0.1, 2.0, 0.0), 3),
        ((600, 0.0, 0.3, 9.0), 2),
        ((0.0, 60, 80, 90), 0),
    ],
)
def test_the_richest_is_taken_that_foretells_no_worse(worse_um, chosen):
    assert richest_of_the_best(foretold(*worse_um)) == chosen


def test_rows_of_a_small_sigma_tell_models_apart_where_others_hide_it():
    """Half of the rows are of 5 um, half of 200; the second model leaves a place 3 um more along x. 300 draws.

    Each row by its sigma, the plain one is found in most; all rows alike, in fewer.
    """
    rng, block, right = np.random.default_rng(6), np.repeat(np.arange(BLOCKS), ROWS), [0, 0]
    sigma = np.where(np.arange(len(block)) % 2, 200.0, 5.0)
    for _ in range(300):
        noise = rng.normal(size=(len(block), 3)) * sigma[:, None]
        distances = [np.linalg.norm(off, axis=1) * UM for off in (noise, noise + np.array([3.0, 0, 0]))]
        for k, of_row in enumerate((sigma / np.median(sigma), 1.0)):
            right[k] += richest_of_the_best([CrossValidation(d, block, of_row) for d in distances]) == 0
    assert right[0] > 200 > 1.2 * right[1]


def test_the_more_poses_scatter_the_less_tells_models_apart():
    assert richest_of_the_best(foretold(9, 0.0, 1.0, scatter_um=1.0)) == 1
    assert richest_of_the_best(foretold(9, 0.0, 1.0, scatter_um=4.0)) == 2


def test_the_interval_of_a_mean_holds_it_in_95_of_100_draws():
    """Rows of a block err alike, so blocks are what counts; 3000 draws of 40 tell the share to 0.4 %."""
    rng, block = np.random.default_rng(8), np.repeat(np.arange(40), 2)
    held = [
        low <= 0 <= high for low, high in (confidence_interval(rng.normal(size=40)[block], block) for _ in range(3000))
    ]
    assert 0.93 <= np.mean(held) <= 0.965
