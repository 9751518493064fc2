import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from compgen.core.exceptions import InputError, JointLimitError, SingularityError, UnreachableError
from compgen.core.units import DEG
from compgen.fanuc.configuration import postures_of
from compgen.robot import inverse_kinematics
from compgen.robot.kinematics import evaluate, nominal_chain

DOWN = np.diag([1.0, -1.0, -1.0])


def forward(robot, theta):
    q = ca.SX.sym("q", 6)
    position, rotation = nominal_chain(robot, q).pose_expr()
    p, r = evaluate(ca.Function("f", [q], [position, ca.densify(rotation)]), theta)
    return p, r.reshape(-1, 3, 3).transpose(0, 2, 1)


def down(points):
    points = np.asarray(points, dtype=float)
    return points, np.broadcast_to(DOWN, (len(points), 3, 3))


def test_every_branch_reaches_the_pose(robot):
    theta = np.random.default_rng(0).uniform(robot.lower, robot.upper, (3000, 6))
    position, rotation = forward(robot, theta)
    branches = inverse_kinematics.solve_all(robot, position, rotation)
    assert branches.shape == (3000, 8, 6)
    for k in range(8):
        legal = ~np.isnan(branches[:, k, 0])
        assert legal.mean() > 0.8
        p, r = forward(robot, branches[legal, k])
        assert_allclose(p, position[legal], atol=1e-13)
        assert_allclose(r, rotation[legal], atol=1e-11)


def test_one_branch_is_the_joints_the_pose_came_from(robot):
    theta = np.random.default_rng(1).uniform(robot.lower, robot.upper, (3000, 6))
    branches = inverse_kinematics.solve_all(robot, *forward(robot, theta))
    off = np.abs((branches - theta[:, None] + np.pi) % (2 * np.pi) - np.pi)
    assert np.nanmax(np.nanmin(off.max(axis=2), axis=1)) < 1e-9


def test_the_eight_branches_differ(robot):
    theta = robot.to_theta(np.array([[10, 20, -15, 30, -60, 45]]) * DEG)
    branches = inverse_kinematics.solve_all(robot, *forward(robot, theta))[0]
    for i in range(8):
        for j in range(i):
            assert np.abs((branches[i] - branches[j] + np.pi) % (2 * np.pi) - np.pi).max() > 1e-3


def test_branch_names_follow_the_controllers_rules(robot):
    theta = np.random.default_rng(2).uniform(robot.lower, robot.upper, (500, 6))
    position, rotation = forward(robot, theta)
    for posture in inverse_kinematics.ALL_POSTURES:
        solved, margin = inverse_kinematics.solve(robot, position, rotation, posture)
        inside = (margin > 1e-3) & (np.abs(np.sin(solved[:, 4])) > 1e-3)
        assert {*postures_of(robot, solved[inside])} == {posture}


def test_alpha6_zero_is_solved_too(robot):
    from dataclasses import replace

    other = replace(robot, alpha=np.append(robot.alpha[:5], 0.0))
    theta = np.random.default_rng(3).uniform(-1, 1, (100, 6))
    position, rotation = forward(other, theta)
    solved = inverse_kinematics.solve_all(other, position, rotation)
    p, r = forward(other, solved[:, 0])
    assert_allclose(p, position, atol=1e-13)
    assert_allclose(r, rotation, atol=1e-11)


def test_another_arm_class_is_refused(robot):
    from dataclasses import replace

    with pytest.raises(InputError, match="no closed-form"):
        inverse_kinematics.check_arm_class(replace(robot, d=robot.d + np.array([0, 0.1, 0, 0, 0, 0])))


@settings(max_examples=60, deadline=None)
@given(st.floats(0.9, 1.8), st.floats(-0.6, 0.6), st.floats(-0.2, 0.8))
def test_a_program_keeps_its_branch_and_runs_on(robot, x, y, z):
    reach = np.hypot(np.hypot(x, y) + 0.02 - 0.15, z + 0.175)  # of the wrist centre from joint 2, at most
    assume(reach < 0.87 + np.hypot(0.17, 1.016) - 2e-3)  # what lies beyond is refused, see below
    t = np.linspace(0, 2 * np.pi, 200)
    points, rotation = down(np.column_stack([x + 0.02 * np.cos(t), y + 0.02 * np.sin(t), np.full(200, z)]))
    theta = inverse_kinematics.follow(robot, points, rotation, inverse_kinematics.Posture())
    assert np.abs(np.diff(theta, axis=0)).max() < 0.01
    assert_allclose(forward(robot, theta)[0], points, atol=1e-12)


def test_out_of_reach_names_waypoint_and_distance(robot):
    points, rotation = down([[1.5, 0, 0.2], [2.3, 0, 0.2]])
    with pytest.raises(UnreachableError) as caught:
        inverse_kinematics.follow(robot, points, rotation, inverse_kinematics.Posture())
    assert caught.value.waypoint == 2
    reach = 0.87 + np.hypot(0.17, 1.016)
    assert caught.value.distance == pytest.approx(np.hypot(2.3 - 0.15, 0.375) - reach, abs=1e-9)


def test_reach_at_the_cells_height_is_2012_mm(robot):
    for x, ok in ((2.0105, True), (2.0125, False)):
        points, rotation = down([[x, 0, 0.203]])
        _, margin = inverse_kinematics.solve(robot, points, rotation, inverse_kinematics.Posture())
        assert bool(margin[0] > 0) == ok


def test_shoulder_singularity_between_waypoints_is_seen(robot):
    points, rotation = down([[0.0, -0.6, 1.0], [0.0, 0.6, 1.0]])
    with pytest.raises(SingularityError, match="J1"):
        inverse_kinematics.follow(robot, points, rotation, inverse_kinematics.Posture())


def test_wrist_singularity_is_refused(robot):
    theta = np.tile(robot.to_theta(np.array([[0, 0, -20, 0, 0, 0]]) * DEG), (5, 1))
    theta[:, 4] = np.linspace(-3, 3, 5) * DEG
    with pytest.raises(SingularityError, match="J5"):
        inverse_kinematics.follow(robot, *forward(robot, theta), inverse_kinematics.Posture())


def test_stretched_arm_is_refused(robot):
    points, rotation = down([[2.0119, 0, 0.203]])
    with pytest.raises(SingularityError, match="J3"):
        inverse_kinematics.follow(robot, points, rotation, inverse_kinematics.Posture())


def test_limit_names_joint_value_and_waypoint(robot):
    from dataclasses import replace

    upper = robot.upper.copy()
    upper[0] = 10 * DEG
    angle = np.array([0, 9.9, 10.5]) * DEG
    points, rotation = down(np.column_stack([1.3 * np.cos(angle), 1.3 * np.sin(angle), np.full(3, 0.3)]))
    with pytest.raises(JointLimitError) as caught:
        inverse_kinematics.follow(replace(robot, upper=upper), points, rotation, inverse_kinematics.Posture())
    assert (caught.value.waypoint, caught.value.joint) == (3, "J1")
    assert caught.value.value == pytest.approx(10.5 * DEG)


def test_coupled_limit_is_a_limit_on_j2_plus_j3(robot):
    """A pendant J3 that is legal at one J2 is not at another."""
    legal = robot.to_theta(np.array([[0, 20, -170, 0, 40, 0]]) * DEG)
    beyond = robot.to_theta(np.array([[0, -20, -170, 0, 40, 0]]) * DEG)
    inverse_kinematics.refuse_limits(robot, legal)
    with pytest.raises(JointLimitError, match=r"J2\+J3"):
        inverse_kinematics.refuse_limits(robot, beyond)


def test_joint_6_runs_on_through_180(robot):
    t = np.linspace(0, 2.2 * np.pi, 400)
    theta = np.tile(robot.to_theta(np.array([[0, 10, -20, 0, -60, 0]]) * DEG), (400, 1))
    theta[:, 5] = t - 1
    solved = inverse_kinematics.follow(robot, *forward(robot, theta), inverse_kinematics.Posture())
    assert_allclose(solved[:, 5], theta[:, 5], atol=1e-9)
    assert solved[:, 5].max() > np.pi


def test_plain_forward_agrees_with_the_symbolic_chain(robot):
    q = np.random.default_rng(5).uniform(robot.lower, robot.upper, (500, 6))
    for ours, symbolic in zip(inverse_kinematics.forward(robot, q), forward(robot, q)):
        assert_allclose(ours, symbolic, atol=1e-12)
