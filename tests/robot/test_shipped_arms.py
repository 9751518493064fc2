"""Shipped arms against public URDF files: joints' origins and axes typed from those files, 1,000 poses each.

The files are ROS-Industrial's (repository ros-industrial/fanuc); each robot file names its own, with the commit.
"""

import re

import numpy as np
import pytest
from shipped import ROOT

from compgen.core.toml import read_toml_text
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import cell_of
from compgen.robot.inverse_kinematics import ALL_POSTURES, Posture, check_arm_class, solve_flange
from compgen.robot.kinematics import flange_pose

#: of base_link: World's height; of each joint: its origin in the joint before, in m
ORIGINS = {
    "m710ic50": (0.565, (0, 0, 0.565), (0.15, 0, 0), (0, 0, 0.87), (0, 0, 0.17), (1.016, 0, 0), (0.175, 0, 0)),
    "m710ic45m": (0.565, (0, 0, 0.565), (0.15, 0, 0), (0, 0, 1.15), (0, 0, 0.17), (1.295, 0, 0), (0.175, 0, 0)),
    "lrmate200id": (0.33, (0, 0, 0.33), (0.05, 0, 0), (0, 0, 0.33), (0, 0, 0.035), (0.335, 0, 0), (0.08, 0, 0)),
    "lrmate200id7l": (0.33, (0, 0, 0.33), (0.05, 0, 0), (0, 0, 0.44), (0, 0, 0.035), (0.42, 0, 0), (0.08, 0, 0)),
    # this file's joint 1 stands on the floor and its links lie beside each other; it has no frame for World
    "m10ia": (
        0.45, (0, 0, 0), (0.15, -0.04, 0.45), (0, -0.0225, 0.6), (0.1805, 0.0625, 0.2), (0.4595, -0.0565, 0),
        (0.1, 0.0565, 0),
    ),
    "m20ia": (0.525, (0, 0, 0.525), (0.15, 0, 0), (0, 0, 0.79), (0, 0, 0.25), (0.835, 0, 0), (0.1, 0, 0)),
    "m20ia10l": (0.525, (0, 0, 0.525), (0.15, 0, 0), (0, 0, 0.79), (0, 0, 0.25), (1.04, 0, 0), (0.1, 0, 0)),
    "m20ib25": (0.65, (0, 0, 0.65), (0.075, 0, 0), (0, 0, 0.905), (0, 0, 0.12), (0.865, 0, 0), (0.1, 0, 0)),
    "m900ia260l": (0.95, (0, 0, 0.95), (0.37, 0, 0), (0, 0, 1.05), (0, 0, 0.2), (1.705, 0, 0), (0.27, 0, 0)),
    "m900ib700": (0.94, (0, 0, 0.94), (0.41, 0, 0), (0, 0, 1.12), (0, 0, 0.25), (1.285, 0, 0), (0.3, 0, 0)),
    "r1000ia80f": (0.45, (0, 0, 0.45), (0.32, 0, 0), (0, 0, 0.87), (0, 0, 0.225), (1.015, 0, 0), (0.175, 0, 0)),
    "r2000ib210f": (0.67, (0, 0, 0.67), (0.312, 0, 0), (0, 0, 1.075), (0, 0, 0.225), (1.28, 0, 0), (0.235, 0, 0)),
    "r2000ic165f": (0.67, (0, 0, 0.67), (0.312, 0, 0), (0, 0, 1.075), (0, 0, 0.225), (1.28, 0, 0), (0.215, 0, 0)),
}  # fmt: skip
AXES = ((0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0))
TOOL0 = np.array([[0, 0, 1.0], [0, -1.0, 0], [1.0, 0, 0]])  # rpy = (pi, -pi / 2, 0), from link 6
#: lowest and highest joint of the file [rad], its joint 3 being J2 + J3
LIMITS = {
    "lrmate200id": (
        (-2.965, -1.745329, -2.450966, -3.315, -2.18, -6.285),
        (2.965, 2.530727, 4.886922, 3.315, 2.18, 6.285),
    ),
    "m10ia": (
        (-3.14, -1.57, -3.14, -3.31, -3.31, -6.28),
        (3.14, 2.79, 4.61, 3.31, 3.31, 6.28),
    ),
    "m20ia": (
        (-2.96706, -1.745329, -3.228859, -3.490658, -2.443461, -4.712389),
        (2.96706, 2.792527, 4.766843, 3.490658, 2.443461, 4.712389),
    ),
    "m900ia260l": (
        (-3.141593, -1.308997, -2.116665, -6.283185, -2.181662, -6.283185),
        (3.141593, 1.308997, 1.570796, 6.283185, 2.181662, 6.283185),
    ),
    "m900ib700": (
        (-3.1415, -1.117, -2.2689, -6.2831, -2.1293, -6.2831),
        (3.1415, 1.5707, 0.5235, 6.2831, 2.1293, 6.2831),
    ),
    "r1000ia80f": (
        (-3.1415, -1.5707, -3.1415, -6.2831, -2.1816, -6.2831),
        (3.1415, 2.7052, 3.1415, 6.2831, 2.1816, 6.2831),
    ),
}  # fmt: skip


def robot_of(name):
    file = ROOT / "robots" / f"{name}.toml"
    return cell_of(read_toml_text(file, "robots"), file, ()).robot


def turn(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def urdf_pose(name, q):
    """Position in World and rotation of tool0."""
    height, *origins = ORIGINS[name]
    position, rotation = np.zeros(3), np.eye(3)
    for origin, axis, angle in zip(origins, AXES, q, strict=True):
        position, rotation = position + rotation @ origin, rotation @ turn(axis, angle)
    return position - [0, 0, height], rotation @ TOOL0


@pytest.mark.parametrize("name", ORIGINS)
def test_an_arm_is_that_of_its_urdf_at_a_thousand_poses(name):
    robot, rng = robot_of(name), np.random.default_rng(7)
    q = rng.uniform(-np.pi, np.pi, (1000, 6))
    theta = robot.to_theta(q - q[:, [1]] * [0, 0, 1, 0, 0, 0])  # the file's joint 3 is J2 + J3
    flange = flange_pose(robot, theta)
    worst_place = worst_turn = 0.0
    for n in range(1000):
        position, rotation = urdf_pose(name, q[n])
        worst_place = max(worst_place, np.abs(flange.position[n] - position).max())
        worst_turn = max(worst_turn, np.abs(flange.rotation[n] - rotation).max())
    assert worst_place < 1e-12
    assert worst_turn < 1e-12


@pytest.mark.parametrize("name", ORIGINS)
def test_the_closed_form_serves_it_in_every_posture(name):
    robot, rng = robot_of(name), np.random.default_rng(3)
    check_arm_class(robot, robot.name)
    theta = robot.to_theta(np.zeros(6)) + rng.uniform(-1, 1, (50, 6)) * [2.5, 0.6, 0.6, 2.5, 1.5, 2.5]
    flange = flange_pose(robot, theta)
    reached = np.zeros(50, dtype=bool)
    for posture in ALL_POSTURES:
        solved = solve_flange(robot, flange, posture)
        there = flange_pose(robot, solved.theta)
        good = (np.abs(there.position - flange.position) < 1e-9).all(axis=1)
        reached |= good & (np.abs(np.sin((solved.theta - theta) / 2)) < 1e-7).all(axis=1)
    assert reached.all()


@pytest.mark.parametrize("name", LIMITS)
def test_limits_are_those_of_the_urdf_to_its_digits(name):
    robot = robot_of(name)
    zero, (low, high) = robot.to_theta(np.zeros(6)), (np.rad2deg(v) for v in LIMITS[name])
    tolerance = 0.5 if name == "m10ia" else 0.15  # radians with two digits
    assert np.abs(np.rad2deg(robot.lower - zero) - low).max() <= tolerance
    assert np.abs(np.rad2deg(robot.upper - zero) - high).max() <= tolerance


@pytest.mark.parametrize("name", [n for n in ORIGINS if n != "m710ic50"])
def test_a_file_names_its_source_and_has_no_heat_of_its_own(name):
    text = (ROOT / "robots" / f"{name}.toml").read_text()
    assert re.search(r"ros-industrial/fanuc, fanuc_\w+/urdf/\w+\.xacro", text)
    assert re.search(r"commit [0-9a-f]{40};", text)
    assert "[thermal" not in text


def test_an_arm_without_heat_is_generated_for_as_a_cold_arm(tmp_path):
    (tmp_path / "small.toml").write_text(
        'robot = "lrmate200id"\n[path]\npattern = "circle"\ndiameter_mm = 100\nx_mm = 400\ny_mm = 0\nz_mm = 0\n'
        "[process]\nfeed_mm_s = 50\n[bounds]\nmax_um = 4\n"
    )
    job = load_job(str(tmp_path / "small.toml"))
    assert job.robot.name == "lrmate200id"
    assert job.posture == Posture()
