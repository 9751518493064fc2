"""The closed-form inverse kinematics against an independent forward kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from naive_arm import poses_of_rows
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.units import DEG
from compgen.robot.configuration import postures_of
from compgen.robot.inverse_kinematics import ALL_POSTURES, Posture, check_arm_class, solve_flange


def solve_all(robot, position, rotation):
    """All eight branches, (N, 8, 6) [rad], in the order of ``ALL_POSTURES``; NaN where out of reach."""
    branches = []
    for posture in ALL_POSTURES:
        theta, margin = solve_flange(robot, Pose(position, rotation), posture)
        branches.append(np.where(margin[:, None] >= 0, theta, np.nan))
    return np.stack(branches, axis=1)


def test_every_branch_reaches_the_pose(robot):
    theta = np.random.default_rng(0).uniform(robot.lower, robot.upper, (3000, 6))
    position, rotation = poses_of_rows(robot, theta)
    branches = solve_all(robot, position, rotation)
    assert branches.shape == (3000, 8, 6)
    for k in range(8):
        legal = ~np.isnan(branches[:, k, 0])
        assert legal.mean() > 0.8
        p, r = poses_of_rows(robot, branches[legal, k])
        assert_allclose(p, position[legal], atol=1e-13)
        assert_allclose(r, rotation[legal], atol=1e-11)


def test_one_branch_is_the_joints_the_pose_came_from(robot):
    theta = np.random.default_rng(1).uniform(robot.lower, robot.upper, (3000, 6))
    branches = solve_all(robot, *poses_of_rows(robot, theta))
    difference = np.abs((branches - theta[:, None] + np.pi) % (2 * np.pi) - np.pi)
    assert np.nanmax(np.nanmin(difference.max(axis=2), axis=1)) < 1e-9


@pytest.mark.parametrize("j5_deg", [0.0, 1e-10, -1e-7, 3e-6, -5e-5])
def test_a_straight_wrist_reaches_the_pose(j5_deg, robot):
    """Where joints 4 and 6 turn about one line, each is told by rounding alone; together they are not."""
    theta = np.random.default_rng(5).uniform(robot.lower, robot.upper, (300, 6))
    theta[:, 4] = robot.pendant_zero[4] + j5_deg * DEG
    position, rotation = poses_of_rows(robot, theta)
    branches = solve_all(robot, position, rotation)
    for k in range(8):
        legal = ~np.isnan(branches[:, k, 0])
        assert_allclose(poses_of_rows(robot, branches[legal, k])[1], rotation[legal], atol=3e-10)
        assert (np.abs(np.delete(branches[legal, k], 2, axis=1)) <= np.pi + 1e-12).all()


def test_joint_3_of_a_range_of_more_than_a_turn_runs_on_as_the_elbow_opens(robot):
    """J2 + J3 up to 280 deg: one side of the stretch to the other, and no jump at 180 or 200 deg."""
    elbow = np.arange(-80.0, 250.0, 0.5)
    elbow = elbow[np.abs(elbow - 80.5) > 1]  # stretched
    theta = np.zeros((len(elbow), 6))
    theta[:] = robot.to_theta(np.array([10.0, -20.0, 0.0, 30.0, -60.0, 45.0]) * DEG)
    theta[:, 2] = elbow * DEG
    branches = solve_all(robot, *poses_of_rows(robot, theta))
    assert np.nanmin(np.abs(branches - theta[:, None]).max(axis=2), axis=1).max() < 1e-9


def test_the_eight_branches_differ(robot):
    theta = robot.to_theta(np.array([[10, 20, -15, 30, -60, 45]]) * DEG)
    branches = solve_all(robot, *poses_of_rows(robot, theta))[0]
    for i in range(8):
        for j in range(i):
            assert np.abs((branches[i] - branches[j] + np.pi) % (2 * np.pi) - np.pi).max() > 1e-3


def test_branch_names_follow_the_controllers_rules(robot):
    theta = np.random.default_rng(2).uniform(robot.lower, robot.upper, (500, 6))
    position, rotation = poses_of_rows(robot, theta)
    for posture in ALL_POSTURES:
        solved, margin = solve_flange(robot, Pose(position, rotation), posture)
        inside = (margin > 1e-3) & (np.abs(np.sin(solved[:, 4])) > 1e-3)
        assert {*postures_of(robot, solved[inside])} == {posture}


def test_alpha6_zero_is_solved_too(robot):
    other = replace(robot, alpha=np.append(robot.alpha[:5], 0.0))
    theta = np.random.default_rng(3).uniform(-1, 1, (100, 6))
    position, rotation = poses_of_rows(other, theta)
    solved = solve_all(other, position, rotation)
    p, r = poses_of_rows(other, solved[:, 0])
    assert_allclose(p, position, atol=1e-13)
    assert_allclose(r, rotation, atol=1e-11)


def test_another_arm_class_is_refused(robot):
    with pytest.raises(InputError, match=r"^mine\.toml: dh: no closed-form.*; paths and programs need the layout"):
        check_arm_class(replace(robot, d=robot.d + np.array([0, 0.1, 0, 0, 0, 0])), "mine.toml")
    for row in (3, 5):  # a forearm or a flange of no length
        with pytest.raises(InputError, match="no closed-form"):
            check_arm_class(replace(robot, d=np.where(np.arange(6) == row, 0.0, robot.d)), "mine.toml")


def test_reach_at_the_cells_height_is_2012_mm(robot):
    for x, ok in ((2.0105, True), (2.0125, False)):
        points, rotation = np.array([[x, 0, 0.203]]), np.diag([1.0, -1.0, -1.0])[None]
        _, margin = solve_flange(robot, Pose(points, rotation), Posture())
        assert bool(margin[0] > 0) == ok
