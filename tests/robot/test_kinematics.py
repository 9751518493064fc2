"""The nominal chain against published and recomputed poses, and against a second forward kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from naive_arm import poses_of_rows
from numpy.testing import assert_allclose

from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, MM
from compgen.robot.kinematics import flange_pose

# pendant J1..J6 [deg], flange X Y Z [mm], W P R [deg]: published and recomputed pairs of this arm
CHECK_VALUES = [
    ((0, 0, 0, 0, -90, 0), (1166, 0, 865), (180, 0, 0)),
    ((10, 20, -15, 30, -60, 45), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((10, 20, -15, -150, 60, -135), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((10, 20, -15, 210, 60, 225), (1513.4993, 189.9246, 569.3554), (150.7201, 11.7854, 63.7208)),
    ((-170, -40, 60, -200, 30, 190), (-91.841, -46.583, 1721.479), (-2.5082, -58.9644, 24.4350)),
    ((20, -80, -150, 10, 40, 0), (-1474.831, -516.008, -667.117), (-170.8266, 19.3867, 28.1068)),
    ((0, 0, 80, 0, -30, 0), (271.497, 0, 2034.143), (0, -40, 180)),
    ((0, 0, 81, 0, -30, 0), (251.161, 0, 2036.086), (0, -39, 180)),
]


@pytest.mark.parametrize(("pendant", "position", "wpr"), CHECK_VALUES)
def test_flange_stands_where_the_check_values_say(robot, pendant, position, wpr):
    flange = flange_pose(robot, robot.to_theta(np.array([pendant]) * DEG))
    assert_allclose(flange.position[0] / MM, position, atol=6e-4)  # mm, as printed
    difference = np.array([a[0] for a in to_wpr(flange.rotation)]) / DEG - wpr
    assert_allclose((difference + 180) % 360 - 180, 0, atol=6e-5)  # deg, as printed


def test_all_zero_joints_give_the_mastering_pose(robot):
    flange = flange_pose(robot, robot.to_theta(np.zeros((1, 6))))[0]
    assert_allclose(flange.position / MM, (1341, 0, 1040), atol=1e-9)
    assert_allclose(flange.rotation, [[0, 0, 1], [0, -1, 0], [1, 0, 0]], atol=1e-12)  # tool z along +x


def test_a_chain_with_alpha6_zero_points_the_tool_backwards(robot):
    """The study's Table 2 has alpha6 = 0: same positions, orientation off by Rx(180)."""
    alpha = robot.alpha.copy()
    alpha[5] = 0.0
    q = np.random.default_rng(1).uniform(-2, 2, (50, 6))
    ours, theirs = flange_pose(robot, q), flange_pose(replace(robot, alpha=alpha), q)
    assert_allclose(ours.position, theirs.position, atol=1e-14)
    assert_allclose(ours.rotation, theirs.rotation @ np.diag([1.0, -1.0, -1.0]), atol=1e-14)


def test_flange_poses_are_those_of_a_second_forward_kinematics(robot):
    q = np.random.default_rng(5).uniform(robot.lower, robot.upper, (5000, 6))
    flange, (position, rotation) = flange_pose(robot, q), poses_of_rows(robot, q)
    assert_allclose(flange.position, position, atol=1e-12)
    assert_allclose(flange.rotation, rotation, atol=1e-12)
