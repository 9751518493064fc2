"""The one offset that leaves least, judged by trying its neighbours and by offsets that are known."""

import numpy as np
import pytest
from naive_arm import frame, numbers
from numpy.testing import assert_allclose

from compgen.compensation.rigid_offset import best_frame, register_shift, register_turn
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_matrix, rotation_vector, to_wpr

RNG = np.random.default_rng(0)
UF = (1200.0, -30.0, 150.0, 0.3, -0.2, 15.0)


def pose_of(values):
    matrix = frame(*values)
    return Pose(matrix[:3, 3] / 1e3, matrix[:3, :3])


def left(frame_numbers, position, error, weight):
    """sum g |e'|^2 with another user frame, by 4 x 4 matrices in mm."""
    change = np.linalg.inv(frame(*UF)) @ frame(*frame_numbers)
    moved = position * 1e3 @ change[:3, :3].T + change[:3, 3]
    return weight @ ((error * 1e3 + moved - position * 1e3) ** 2).sum(axis=1) / weight.sum()


def test_a_frame_that_moved_is_moved_back():
    """All that errs is a part 0.12 mm and 0.02 deg away: the frame typed in leaves no more than its digits."""
    position = RNG.uniform(-0.6, 0.6, (300, 3)) * [1, 1, 0.1]
    true = np.array([0.12, -0.05, 0.03]) / 1e3, rotation_matrix(np.radians([0.004, -0.02, 0.011]))
    error = position @ true[1].T + true[0] - position
    typed = best_frame(pose_of(UF), position, error, np.ones(300))
    assert_allclose(np.sqrt(left(typed, position, error, np.ones(300))), 0, atol=0.006)
    assert_allclose(
        typed,
        numbers(frame(*UF) @ np.linalg.inv(np.vstack([np.column_stack([true[1], true[0] * 1e3]), [0, 0, 0, 1]]))),
        atol=2e-3,
    )


@pytest.mark.parametrize("case", range(6))
def test_no_neighbour_on_the_pendant_leaves_less(case):
    rng = np.random.default_rng(case)
    position, weight = rng.uniform(-0.6, 0.6, (80, 3)), rng.uniform(0, 1, 80)
    error = 1e-4 * rng.normal(size=(80, 3)) + 2e-4 * position[:, [1, 2, 0]]
    typed = best_frame(pose_of(UF), position, error, weight)
    least = left(typed, position, error, weight)
    assert least < left(UF, position, error, weight)
    for i in range(6):
        for step in (-0.001, 0.001):
            assert left(typed + step * np.eye(6)[i], position, error, weight) >= least
    assert_allclose(typed, np.round(typed, 3), atol=1e-12)


def test_points_on_a_line_leave_the_turn_about_it_alone():
    position = np.column_stack([np.linspace(-0.5, 0.5, 50), np.zeros(50), np.zeros(50)])
    error = np.tile([0.0, 1e-4, 0.0], (50, 1))
    typed = best_frame(Pose(np.zeros(3), np.eye(3)), position, error, np.ones(50))
    assert_allclose(typed, [0, -0.1, 0, 0, 0, 0], atol=1e-9)


def test_a_register_shifts_by_the_mean_error_the_other_way():
    error = np.array([[1.0, 0, 0], [0, 2.0, 0]]) * 1e-4
    assert_allclose(register_shift(error, np.array([3.0, 1.0])), [-0.075, -0.05, 0])


def test_angles_of_a_register_added_to_those_of_positions_turn_the_tool_back():
    """The tool is 0.05 deg off about axes of its own at each point; added number by number, as the pendant adds."""
    wpr = np.column_stack([RNG.uniform(170, 190, 60), RNG.uniform(-8, 8, 60), RNG.uniform(-40, 40, 60)])
    wanted = from_wpr(*np.radians(wpr.T))
    off = np.array([0.03, -0.05, 0.02])
    actual = from_wpr(*np.radians((wpr - off).T))
    turn = rotation_vector(actual @ np.swapaxes(wanted, 1, 2))
    assert_allclose(register_turn(turn, wanted, np.ones(60)), off, atol=1.1e-3)
    assert_allclose(np.degrees(np.unwrap(to_wpr(actual)[1])), wpr[:, 1] - off[1], atol=1e-9)
