"""Smoothness: what it halves and leaves, and its matrix against differences of the cost."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solveh_banded

from compgen.compensation.problem import Settings
from compgen.compensation.smoothness import smoothing_matrix, waypoint_lengths


@pytest.mark.parametrize(("period", "passed"), [(5e-3, 0.06), (10e-3, 0.5), (40e-3, 0.99)])
def test_smoothing_halves_its_own_period_and_leaves_longer_ones(period, passed):
    arc = np.arange(0, 2, 0.2e-3)
    settings = Settings(rate_period=0.0, curvature_period=10e-3)
    wave = np.cos(2 * np.pi * arc / period)
    stop = np.zeros(len(arc), dtype=bool)
    out = solveh_banded(smoothing_matrix(arc, stop, settings), waypoint_lengths(arc) * wave)
    middle = slice(len(arc) // 3, 2 * len(arc) // 3)
    assert np.ptp(out[middle]) / np.ptp(wave[middle]) == pytest.approx(passed, abs=0.02)


def test_the_matrix_is_the_gradient_of_the_stated_cost():
    rng = np.random.default_rng(0)
    arc = np.cumsum(rng.uniform(0.5e-3, 3e-3, 40))
    stop = rng.random(40) < 0.2
    settings = Settings(rate_period=3e-3, curvature_period=8e-3)
    c = rng.normal(size=40)

    def cost(c):
        h = np.diff(arc)
        first = np.diff(c) / h
        between = (h[:-1] + h[1:]) / 2
        second = np.diff(first) / between
        return (
            np.sum(waypoint_lengths(arc) * c**2)
            + (3e-3 / 2 / np.pi) ** 2 * np.sum(h * first**2)
            + (8e-3 / 2 / np.pi) ** 4 * np.sum(between * ~stop[1:-1] * second**2)
        ) / 2

    second, first, diagonal = smoothing_matrix(arc, stop, settings)
    full = np.diag(diagonal) + np.diag(first[1:], 1) + np.diag(first[1:], -1)
    full += np.diag(second[2:], 2) + np.diag(second[2:], -2)
    gradient = [(cost(c + e) - cost(c - e)) / 2e-6 for e in 1e-6 * np.eye(40)]
    assert_allclose(full @ c, gradient, rtol=1e-5, atol=1e-9)
