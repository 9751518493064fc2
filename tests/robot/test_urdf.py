"""URDF files to robot files: drawn arms of the class, with any zero and any signs, and one line for what is refused."""

import re

import numpy as np
import pinocchio as pin
import pytest
from command_line import refused, run
from drawn_urdf import drawn_urdf, numbers, second_arm
from numpy.testing import assert_allclose

from compgen.pipelines.files.robot_file import load_robot
from compgen.robot.kinematics import flange_pose
from compgen.robot.urdf import read_urdf


@pytest.mark.parametrize("seed", range(12))
def test_a_drawn_arm_is_found_with_its_signs_and_its_zero(tmp_path, seed):
    text, base, sizes, _ = drawn_urdf(seed)
    (tmp_path / "drawn.urdf").write_text(text)
    arm = read_urdf(str(tmp_path / "drawn.urdf"))
    assert_allclose([*arm.arm.a[:3], -arm.arm.d[3], -arm.arm.d[5]], sizes, atol=1e-9)
    assert_allclose(arm.arm.origin, base, atol=1e-9)
    result = run("init", "--urdf", tmp_path / "drawn.urdf", "--j3", "alone", tmp_path)
    assert result.returncode == 0, result.stderr
    robot = load_robot(str(tmp_path / "robots" / "drawn.toml"))
    model = pin.buildModelFromXML(text)
    data, frame = model.createData(), model.getFrameId("tool0")
    q = np.random.default_rng(seed).uniform(-3, 3, (200, 6))
    ours = flange_pose(robot, robot.to_theta(q))
    for n in range(200):
        pin.framesForwardKinematics(model, data, q[n])
        assert np.abs(ours.position[n] - (data.oMf[frame].translation - base)).max() < 1e-8
        if n == 0:
            fixed = ours.rotation[0].T @ data.oMf[frame].rotation
        assert np.abs(ours.rotation[n] @ fixed - data.oMf[frame].rotation).max() < 1e-8


@pytest.mark.parametrize("name", ["m710ic50", "lrmate200id7l", "m900ib700", "m10ia"])
def test_a_shipped_arm_goes_out_and_comes_back(tmp_path, name):
    assert run("export-robot", name, "-o", tmp_path / f"{name}.urdf").returncode == 0
    assert run("init", "--urdf", tmp_path / f"{name}.urdf", tmp_path).returncode == 0
    back, robot = load_robot(str(tmp_path / "robots" / f"{name}.toml")), load_robot(name)
    for field in ("a", "d", "alpha", "pendant_map", "pendant_zero", "lower", "upper", "speed"):
        assert_allclose(getattr(back, field), getattr(robot, field), atol=1e-9)
    assert back.joint_names == robot.joint_names


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"wrist": 0.03}, "axes 4, 5 and 6 do not meet"),
        ({"wrist": 2e-5}, "one passes 0.02 mm from where the wrist is"),  # 0.0 was said
        ({"beside": 0.1}, "the wrist stands 100 mm beside the plane of axis 1"),
        ({"tip": np.array([0.3, 0.2, 1.0])}, "mm off axis 6: a tool, not the flange"),
    ],
)
def test_an_arm_of_another_class_is_refused(tmp_path, changes, words):
    text, *_ = drawn_urdf(3, **changes)
    (tmp_path / "drawn.urdf").write_text(text)
    refused(run("init", "--urdf", tmp_path / "drawn.urdf", tmp_path), 2, words, "spherical wrist")
    assert not (tmp_path / "robots" / "drawn.toml").exists()


def in_mm(text):
    return re.sub(r'xyz="([^"]*)" rpy', lambda m: f'xyz="{numbers(1e3 * np.array(m[1].split(), float))}" rpy', text)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("</robot>", "<xacro:arm/></robot>"), "run xacro on it first"),
        (
            lambda t: t.replace("<robot", "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'").replace(
                "</robot>", "<xacro:arm/></robot>"
            ),
            "run xacro on it first",
        ),
        (lambda t: t.replace("</robot>", ""), "not XML"),
        (lambda t: t.replace("</robot>", "<link name='x'><!-- xacro:\nend --></robot>"), "not XML: mismatched tag"),
        (lambda t: t.replace("</robot>", "<!-- xacro: --><a:b/></robot>"), "not XML: unbound prefix"),
        (
            lambda t: t.replace('velocity="3"', 'velocity="0"'),
            "'joint_1': limit velocity: 0: no joint turns so; give it",
        ),
        (lambda t: t.replace("robot", "model"), "no <robot>"),
        (lambda t: "<!DOCTYPE a>" + t, "document type"),
        (
            lambda t: t.replace('name="joint_4" type="revolute"', 'name="joint_4" type="prismatic"'),
            "'joint_4' is prismatic",
        ),
        (
            lambda t: t.replace('name="joint_4" type="revolute"', 'name="joint_4" type="fixed"'),
            "5 moving joints in a row",
        ),
        (lambda t: t.replace('lower="-2" ', "", 1), "joint 'joint_1': limit lower: missing"),
        (lambda t: t.replace('rpy="1 2 3"', 'rpy="1 2"'), "joint 'end': origin rpy: '1 2' is not 3 numbers"),
        (lambda t: t.replace('xyz="', 'xyz="nan ', 1), "is not 3 numbers"),
        (lambda t: "", "not XML"),
        (lambda t: t.replace('lower="-2"', 'lower="3"', 1), "joint 'joint_1': limit lower 3 is not below upper 2"),
        (in_mm, "a URDF file is in metres: is it in mm?"),
        (
            lambda t: t.replace("<limit", '<mimic joint="joint_1"/><limit', 3),
            "mimics 'joint_1': it does not move by itself",
        ),
        (
            lambda t: t.replace('lower="-2"', 'lower="-170"', 1),
            "'joint_1': limit lower: -170 rad is beyond 30; is it in deg",
        ),
        (lambda t: t.replace('velocity="5"', 'velocity="285"'), "'joint_3': limit velocity: 285 rad/s is beyond 30"),
        (lambda t: t.replace('"tool0"', '"tcp"'), "no link is named tool0 or flange, and behind 'l6' come tcp"),
        (lambda t: t.replace("</robot>", second_arm(t) + "</robot>"), "2 chains of six moving joints, ending in"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, change, words):
    text, *_ = drawn_urdf(1)
    (tmp_path / "drawn.urdf").write_text(change(text))
    refused(run("init", "--urdf", tmp_path / "drawn.urdf", tmp_path), 2, words)
    assert not (tmp_path / "robots" / "drawn.toml").exists()


def test_macros_in_remarks_are_none(tmp_path):
    """What xacro prints keeps its file's remarks: it was to be run again, which changes nothing."""
    text, *_ = drawn_urdf(1)
    bare = tmp_path / "bare.urdf"
    bare.write_text(text)
    remarked = tmp_path / "remarked.urdf"
    remarked.write_text(
        f"<!-- was <xacro:arm prefix='a'/> -->\n{text.replace('</robot>', '<!-- xacro: end --></robot>')}"
    )
    assert_allclose(read_urdf(str(remarked)).arm.a, read_urdf(str(bare)).arm.a, atol=0)


def test_an_axis_2_behind_axis_1_is_named_where_it_turns_joints_2_and_3_round(tmp_path):
    """Upper arm upright and forearm to the front at the file's zero, where joints count as FANUC's; a1 is -0.1 m."""
    sizes, fanucs = np.array([-0.1, 0.8, 0.2, 0.9, 0.15]), np.ones(6)
    text, *_ = drawn_urdf(1, sizes, np.deg2rad([0, -90, 0, 0, 60, 0]), fanucs)
    (tmp_path / "behind.urdf").write_text(text)
    words = ("behind.urdf", "axis 2 lies behind axis 1", "a1 is negative", "say --j3 alone")
    refused(run("init", "--urdf", tmp_path / "behind.urdf", tmp_path), 2, *words)
    assert run("init", "--urdf", tmp_path / "behind.urdf", "--j3", "alone", tmp_path).returncode == 0
    text, *_ = drawn_urdf(1, np.abs(sizes), np.deg2rad([0, -90, 0, 0, 60, 0]), fanucs)
    (tmp_path / "before.urdf").write_text(text)
    assert run("init", "--urdf", tmp_path / "before.urdf", tmp_path).returncode == 0


def test_signs_that_are_not_fanucs_ask_for_j3_alone_and_a_file_is_not_replaced(tmp_path):
    text, *_ = drawn_urdf(1, sign=np.array([1, 1, -1, 1, 1, 1.0]))
    (tmp_path / "drawn.urdf").write_text(text)
    refused(
        run("init", "--urdf", tmp_path / "drawn.urdf", tmp_path), 2, "joints 2 and 3 do not count", "say --j3 alone"
    )
    assert run("init", "--urdf", tmp_path / "drawn.urdf", "--j3", "alone", tmp_path).returncode == 0
    refused(run("init", "--urdf", tmp_path / "drawn.urdf", "--j3", "alone", tmp_path), 2, "it is there")
