"""The root search behind the time at which a place is passed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.planning.retiming.phases import rising_root


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
