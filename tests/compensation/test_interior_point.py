"""The interior point on programs whose optimum is known by hand, and on one that has none."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from compgen.compensation import interior_point
from compgen.compensation.constraints import Balls
from compgen.compensation.interior_point import LocalProgram
from compgen.compensation.problem import Status

N, RADII = 40, np.array([2.0, 3.0])
WANTED = np.random.default_rng(4).normal(scale=3.0, size=(N, 6))  # um


def solve(stiffness: float, start: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, Status]:
    """The nearest to what is wanted of each waypoint within a ball for its first three and one for its last three."""
    balls = Balls(np.repeat(free[:, None], 2, axis=1), RADII)

    def linearise(x: np.ndarray) -> LocalProgram:
        return LocalProgram(x, stiffness * (x - WANTED), np.tile(stiffness * np.eye(6), (N, 1, 1)), (balls,))

    return interior_point.solve(linearise, np.zeros((3, N)), start, free)


@pytest.mark.parametrize("stiffness", [1.0, 30.0])
def test_the_nearest_point_of_a_ball_is_where_the_line_to_its_centre_leaves_it(stiffness):
    free = np.arange(N) % 7 != 3
    start = np.full((N, 6), 0.1)
    x, status = solve(stiffness, start, free)
    assert status is Status.CONVERGED
    size = np.repeat(np.linalg.norm(WANTED.reshape(N, 2, 3), axis=2), 3, axis=1)
    nearest = WANTED * np.minimum(1.0, np.repeat(RADII, 3) / size)
    assert_allclose(x[free], nearest[free], atol=3e-4)  # um: the root of the last barrier, where a ball is just touched
    assert np.array_equal(x[~free], start[~free])


def test_a_cost_without_a_least_value_fails_and_leaves_the_start():
    start = np.full((N, 6), 0.1)
    x, status = solve(-1e6, start, np.ones(N, dtype=bool))
    assert status is Status.FAILED
    assert np.array_equal(x, start)


def test_what_has_not_come_to_rest_is_not_called_an_optimum(monkeypatch):
    monkeypatch.setattr(interior_point, "MAX_ITERATIONS", 3)
    assert solve(1.0, np.full((N, 6), 0.1), np.ones(N, dtype=bool))[1] is Status.UNSETTLED
