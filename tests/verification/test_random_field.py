"""A random field: of unit variance, alike nearby, strange far away."""

import numpy as np

from compgen.verification.band import LENGTH, random_field


def test_the_field_has_unit_variance_and_the_correlation_of_its_kernel() -> None:
    distance = np.array([0.0, 0.02, 0.5, 1.0, 3.0]) * LENGTH
    place = np.zeros((len(distance), 3))
    place[:, 1] = distance
    z = np.array([random_field(np.random.default_rng(k), place) for k in range(2000)])  # (draws, places, 3)
    np.testing.assert_allclose(z.mean(axis=0), 0.0, atol=0.1)
    covariance = np.einsum("dpi,di->p", z, z[:, 0]) / (3 * len(z))
    np.testing.assert_allclose(covariance, np.exp(-(distance**2) / (2 * LENGTH**2)), atol=0.06)
    between = np.einsum("dpi,dpj->ij", z, z) / (len(z) * len(place))
    np.testing.assert_allclose(between, np.eye(3), atol=0.06)


def test_the_same_numbers_give_the_same_field() -> None:
    place = np.random.default_rng(0).normal(size=(5, 3))
    first, again, other = (random_field(np.random.default_rng(seed), place) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1
