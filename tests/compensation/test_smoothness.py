"""Smoothness: what it halves and leaves, and its matrix against differences of the cost."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solveh_banded

from compgen.compensation.problem import Settings
from compgen.compensation.smoothness import component_weights, smoothing_matrix, waypoint_lengths
from compgen.core.units import MM


@pytest.mark.parametrize(("period", "passed"), [(5e-3, 0.06), (10e-3, 0.5), (40e-3, 0.99)])
def test_smoothing_halves_its_own_period_and_leaves_longer_ones(period, passed):
    arc = np.arange(0, 2, 0.2e-3)
    settings = Settings(rate_period=0.0)  # the default's 10 mm
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


@pytest.mark.parametrize("count", [2, 3, 40])
def test_what_waypoints_stand_for_is_the_trapezoidal_rule(count):
    rng = np.random.default_rng(1)
    arc, f = np.cumsum(rng.uniform(0.5e-3, 3e-3, count)), rng.normal(size=count)
    assert waypoint_lengths(arc) @ f == pytest.approx(np.trapezoid(f, arc), rel=1e-12)


def test_an_angle_counts_as_the_distance_that_it_moves_a_point_250_mm_away():
    """A spin that is free counts ten thousand times less."""
    turn = 1e-6 * np.eye(3)  # about x, y, z
    away = 250 * MM * np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    moved = np.linalg.norm(np.cross(turn, away), axis=1)
    assert_allclose(component_weights(Settings()), [1, 1, 1, *(moved / 1e-6)])
    assert_allclose(component_weights(Settings(free_spin=True))[5], 1e-4 * moved[2] / 1e-6)
