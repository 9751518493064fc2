"""Jerk-limited changes of speed by hand, and how fast a block may be left."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.planning.retiming.blocks import change_duration, reachable_speed


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
