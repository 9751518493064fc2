"""Jerk-limited changes of speed by hand, and the root search behind them; ruckig confirms the rest in every run."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.core.exceptions import ImpossibleError
from compgen.planning.speed_profile import Blocks, change_duration, constant_jerk_phases, reachable_speed, rising_root


@pytest.mark.parametrize("power", [1, 2, 3])
def test_roots_are_root_also_where_a_function_is_flat(power):
    rng = np.random.default_rng(5)
    expected, high = rng.uniform(0, 1, 500) ** 3, np.ones(500)
    expected[:3] = 0, 1, 1e-12

    def excess(x):
        return x**power - expected**power, power * x ** (power - 1)

    for guess in (0.0, 0.5, 1.0):
        root = rising_root(excess, 0 * high, high, guess * high)
        assert_allclose(root, expected, rtol=1e-14, atol=1e-9)


@pytest.mark.parametrize(("dv", "expected"), [(0.08, 0.4), (0.02, 0.2), (0.32, 1.0)])
def test_duration_of_a_change_of_speed_by_hand(dv, expected):
    """a = 0.4 m/s2 and j = 2 m/s3: full acceleration is reached from 0.08 m/s on."""
    assert_allclose(change_duration(np.array([dv]), np.array([0.4]), np.array([2.0])), expected, rtol=1e-14)


def test_reachable_speed_takes_the_whole_length():
    rng = np.random.default_rng(9)
    v0, length = rng.uniform(0, 0.1, 300), rng.uniform(0.1, 1, 300)
    a, j = rng.uniform(0.1, 5, 300), rng.uniform(1, 50, 300)
    v1 = reachable_speed(v0, length, a, j)
    assert_allclose((v0 + v1) / 2 * change_duration(v1 - v0, a, j), length, rtol=1e-6)


def test_a_block_too_short_for_its_change_of_speed_is_refused():
    start, length, v0, v1, v, a, j = (np.array([x]) for x in (0.25, 1e-3, 0.0, 0.5, 0.5, 0.4, 2.0))
    with pytest.raises(ImpossibleError, match=r"0\.2500 m along the path"):
        constant_jerk_phases(Blocks(start, length, v0, v1, v, a, j))
