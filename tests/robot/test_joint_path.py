"""Joint paths: continuous on one branch, or refused with the waypoint and the joint named."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from naive_arm import poses_of_rows
from numpy.testing import assert_allclose

from compgen.core.exceptions import JointLimitError, SingularityError, UnreachableError
from compgen.core.pose import Pose
from compgen.core.units import DEG
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.joint_path import check_joint_limits, follow_branch, nearest_turns

DOWN = np.diag([1.0, -1.0, -1.0])


def down(points):
    points = np.asarray(points, dtype=float)
    return Pose(points, np.broadcast_to(DOWN, (len(points), 3, 3)))


@settings(max_examples=60, deadline=None)
@given(st.floats(0.9, 1.8), st.floats(-0.6, 0.6), st.floats(-0.2, 0.8))
def test_a_program_keeps_its_branch_and_runs_on(robot, x, y, z):
    reach = np.hypot(np.hypot(x, y) + 0.02 - 0.15, z + 0.175)  # of the wrist centre from joint 2, at most
    assume(reach < 0.87 + np.hypot(0.17, 1.016) - 2e-3)  # what lies beyond is refused, see below
    t = np.linspace(0, 2 * np.pi, 200)
    flange = down(np.column_stack([x + 0.02 * np.cos(t), y + 0.02 * np.sin(t), np.full(200, z)]))
    theta = follow_branch(robot, flange, Posture())
    assert np.abs(np.diff(theta, axis=0)).max() < 0.01
    assert_allclose(poses_of_rows(robot, theta)[0], flange.position, atol=1e-12)


def test_out_of_reach_names_waypoint_and_distance(robot):
    flange = down([[1.5, 0, 0.2], [2.3, 0, 0.2]])
    with pytest.raises(UnreachableError) as caught:
        follow_branch(robot, flange, Posture())
    assert caught.value.waypoint == 2
    reach = 0.87 + np.hypot(0.17, 1.016)
    assert caught.value.distance == pytest.approx(np.hypot(2.3 - 0.15, 0.375) - reach, abs=1e-9)


def test_shoulder_singularity_between_waypoints_is_seen(robot):
    flange = down([[0.0, -0.6, 1.0], [0.0, 0.6, 1.0]])
    with pytest.raises(SingularityError, match="J1"):
        follow_branch(robot, flange, Posture())


def test_wrist_singularity_is_refused(robot):
    theta = np.tile(robot.to_theta(np.array([[0, 0, -20, 0, 0, 0]]) * DEG), (5, 1))
    theta[:, 4] = np.linspace(-3, 3, 5) * DEG
    with pytest.raises(SingularityError, match="J5"):
        follow_branch(robot, Pose(*poses_of_rows(robot, theta)), Posture())


def test_stretched_arm_is_refused(robot):
    flange = down([[2.0119, 0, 0.203]])
    with pytest.raises(SingularityError, match="J3"):
        follow_branch(robot, flange, Posture())


def test_limit_names_joint_value_and_waypoint(robot):
    upper = robot.upper.copy()
    upper[0] = 10 * DEG
    angle = np.array([0, 9.9, 10.5]) * DEG
    flange = down(np.column_stack([1.3 * np.cos(angle), 1.3 * np.sin(angle), np.full(3, 0.3)]))
    with pytest.raises(JointLimitError) as caught:
        follow_branch(replace(robot, upper=upper), flange, Posture())
    assert (caught.value.waypoint, caught.value.joint) == (3, "J1")
    assert caught.value.value == pytest.approx(10.5 * DEG)


def test_coupled_limit_is_a_limit_on_j2_plus_j3(robot):
    """A pendant J3 that is legal at one J2 is not at another."""
    legal = robot.to_theta(np.array([[0, 20, -170, 0, 40, 0]]) * DEG)
    beyond = robot.to_theta(np.array([[0, -20, -170, 0, 40, 0]]) * DEG)
    check_joint_limits(robot, legal)
    with pytest.raises(JointLimitError, match=r"J2\+J3"):
        check_joint_limits(robot, beyond)


def test_joint_6_runs_on_through_180(robot):
    t = np.linspace(0, 2.2 * np.pi, 400)
    theta = np.tile(robot.to_theta(np.array([[0, 10, -20, 0, -60, 0]]) * DEG), (400, 1))
    theta[:, 5] = t - 1
    solved = follow_branch(robot, Pose(*poses_of_rows(robot, theta)), Posture())
    assert_allclose(solved[:, 5], theta[:, 5], atol=1e-9)
    assert solved[:, 5].max() > np.pi


@pytest.mark.parametrize("ends", [(150.0, 250.0), (250.0, 190.0)])
def test_joint_3_runs_on_through_200_and_begins_there(ends, robot):
    theta = np.tile(robot.to_theta(np.array([10, 110, 0, 30, -60, 45]) * DEG), (50, 1))
    theta[:, 2] = np.linspace(ends[0], ends[1], 50) * DEG
    solved = follow_branch(robot, Pose(*poses_of_rows(robot, theta)), Posture(up=False))
    assert_allclose(solved, theta, atol=1e-9)


def test_nearest_turns_bring_each_joint_within_half_a_turn_of_its_reference():
    rng = np.random.default_rng(6)
    theta, reference = rng.uniform(-3, 3, (200, 6)), rng.uniform(-12, 12, (200, 6))
    turned = nearest_turns(theta, reference)
    assert np.abs(turned - reference).max() <= np.pi * (1 + 1e-12)
    assert_allclose(np.remainder((turned - theta) / (2 * np.pi) + 0.5, 1), 0.5, atol=1e-12)
