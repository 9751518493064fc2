"""Order statistics of draws, against sums of the binomial and by simulation."""

from math import comb

import numpy as np
import pytest

from compgen.job.bounds import draws_needed, draws_that_may_break

CASES = [(0.95, 0.95), (0.9, 0.9), (0.99, 0.95), (0.5, 0.5), (0.95, 0.99), (0.999, 0.9), (0.05, 0.95)]


def binomial_tail(draws: int, broken: int, share: float) -> float:
    """P(Bin(draws, 1 - share) <= broken), term by term."""
    return sum(comb(draws, i) * (1 - share) ** i * share ** (draws - i) for i in range(broken + 1))


def test_the_draws_of_the_textbook() -> None:
    assert [draws_needed(*case) for case in [(0.95, 0.95), (0.9, 0.9), (0.99, 0.95), (0.95, 0.99)]] == [59, 22, 299, 90]


@pytest.mark.parametrize(("share", "confidence"), CASES)
def test_the_fewest_draws_are_enough_and_one_less_is_not(share: float, confidence: float) -> None:
    n = draws_needed(share, confidence)
    assert binomial_tail(n, 0, share) <= 1 - confidence + 1e-12
    assert n == 1 or binomial_tail(n - 1, 0, share) > 1 - confidence
    assert draws_that_may_break(n, share, confidence) is not None
    assert n == 1 or draws_that_may_break(n - 1, share, confidence) is None


@pytest.mark.parametrize(("share", "confidence"), CASES)
@pytest.mark.parametrize("more", [0, 1, 34, 122, 600])
def test_as_many_may_break_as_the_binomial_allows(share: float, confidence: float, more: int) -> None:
    n = draws_needed(share, confidence) + more
    broken = draws_that_may_break(n, share, confidence)
    assert broken is not None
    assert binomial_tail(n, broken, share) <= 1 - confidence + 1e-12
    assert broken == n - 1 or binomial_tail(n, broken + 1, share) > 1 - confidence


def test_ninety_three_draws_let_one_break() -> None:
    assert [draws_that_may_break(n, 0.95, 0.95) for n in (58, 59, 92, 93, 124)] == [None, 0, 0, 1, 2]


@pytest.mark.parametrize("draws", [59, 93, 300])
def test_the_order_statistic_is_above_the_quantile_as_often_as_it_says(draws: int) -> None:
    share = confidence = 0.95
    broken = draws_that_may_break(draws, share, confidence)
    assert broken is not None
    rng = np.random.default_rng(1)
    values = np.sort(rng.exponential(size=(4000, draws)), axis=1)
    above = float(np.mean(values[:, -1 - broken] >= -np.log(1 - share)))
    assert above >= confidence - 4 * np.sqrt(0.05 * 0.95 / 4000)
    assert np.mean(values[:, -2 - broken] >= -np.log(1 - share)) < confidence  # one more would not be verified
