"""Which touches are chosen: judged by trying all choices, and by the information matrix."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.identification.choice_by_exchange import PathDrift, path_weight, plan_touches

NOISE = 0.3


def case(seed):
    rng = np.random.default_rng(seed)
    Q, K, r = int(rng.integers(2, 7)), int(rng.integers(5, 11)), int(rng.integers(1, 4))
    root, column, length = rng.normal(size=(Q, Q)), rng.normal(size=(9, 3, Q)), rng.uniform(0.1, 1, 9)
    count = int(rng.integers(1, min(5, K)))
    return root @ root.T + 0.1 * np.eye(Q), column, length, rng.normal(size=(K, r, Q)), count


def left(prior, column, length, rows):
    """Mean variance along the path after some touches, from the information matrix."""
    S = np.linalg.inv(np.linalg.inv(prior) + sum(H.T @ H / NOISE**2 for H in rows))
    return sum(w * np.trace(C @ S @ C.T) for C, w in zip(column, length / length.sum(), strict=True))


def planned(prior, column, length, rows, count):
    noise = np.broadcast_to(NOISE**2 * np.eye(rows.shape[1]), (len(rows), rows.shape[1], rows.shape[1]))
    return plan_touches(PathDrift(prior, path_weight(column, length)), rows, noise, count)


@pytest.mark.parametrize("first", range(0, 120, 20))
def test_no_other_choice_leaves_less(first):
    for seed in range(first, first + 20):
        prior, column, length, rows, count = case(seed)
        plan = planned(prior, column, length, rows, count)
        least = min(left(prior, column, length, rows[list(s)]) for s in combinations(range(len(rows)), count))
        assert_allclose(left(prior, column, length, rows[plan.chosen]), least, rtol=1e-9)


def test_what_each_touch_leaves_is_what_the_information_matrix_says():
    prior, column, length, rows, _ = case(3)
    plan = planned(prior, column, length, rows, 4)
    for n in range(5):
        assert_allclose(plan.variance[n], left(prior, column, length, rows[plan.chosen[:n]]), rtol=1e-9)
    more = [left(prior, column, length, rows[[*plan.chosen, k]]) for k in range(len(rows)) if k not in plan.chosen]
    assert_allclose(plan.next_variance, min(more), rtol=1e-9)


def test_a_touch_that_sees_nothing_of_the_path_is_never_taken():
    """It tells a lot, but of what neither the path nor any other touch depends on."""
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(6, 1, 3))
    rows[:, :, 2] = 0
    rows[2] = [[0, 0, 1e3]]
    column = rng.normal(size=(5, 3, 3))
    column[:, :, 2] = 0
    plan = planned(np.eye(3), column, np.ones(5), rows, 5)
    assert 2 not in plan.chosen


def test_the_touch_along_the_drift_is_the_first():
    """One thing drifts along x; a touch along x tells it, one along y does not."""
    column = np.zeros((4, 3, 1))
    column[:, 0] = 1.0
    plan = planned(np.eye(1), column, np.ones(4), np.array([[[0.0]], [[1.0]], [[0.6]]]), 1)
    assert plan.chosen.tolist() == [1]
    assert_allclose(plan.variance, [1.0, NOISE**2 / (1 + NOISE**2)])


def test_one_more_touch_is_another_one():
    """The first tells all but everything; once more it would tell something, the other tells next to nothing."""
    column = np.zeros((4, 3, 1))
    column[:, 0] = 1.0
    plan = planned(np.eye(1), column, np.ones(4), np.array([[[1.0]], [[1e-6]]]), 1)
    assert_allclose(plan.next_variance, plan.variance[-1], rtol=1e-9)
