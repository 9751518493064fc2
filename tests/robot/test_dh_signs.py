"""DH rows as a data sheet has them: other signs of axes and lengths are the same arm, pendant and limits included."""

import re
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen.core.exceptions import InputError, JointLimitError
from compgen.core.units import DEG
from compgen.error_model.rigid_chain import rigid_chain
from compgen.identification.measured_poses import check_within_limits
from compgen.pipelines.files.robot_file import load_any_robot, load_arm, load_robot
from compgen.pipelines.files.robot_sheet import robot_sheet
from compgen.report.robot_files import export_record
from compgen.robot.configuration import has_posture
from compgen.robot.inverse_kinematics import ALL_POSTURES, is_class, solve_flange
from compgen.robot.joint_path import check_joint_limits
from compgen.robot.kinematics import flange_pose

RNG = np.random.default_rng(4)
AREA = "j2_j3_deg = [[-60, -80], [60, -80], [60, 20], [10, 20], [10, -10], [-60, 40]]"


def rewritten(folder, flips, turns):
    """The study's arm with the x axes of some rows (1 to 5) turned about, and the z axes behind some, in its file.

    x_i the other way: a_i changes its sign, theta_i and theta_{i + 1} move by 180 deg, and alpha_i changes its sign.
    z_i the other way: alpha_i and alpha_{i + 1} move by 180 deg, d_{i + 1} and theta_{i + 1} change their sign.
    """
    d, a = np.array([0, 0, 0, -1016, 0, -175.0]), np.array([150, 870, 170, 0, 0, 0.0])
    alpha, offset, sign = np.array([-90, 180, -90, 90, -90, 180.0]), np.array([0, -90, 0, 0, 0, 0.0]), np.ones(6)
    for i in turns:
        alpha[[i - 1, i]] += 180
        d[i], sign[i], offset[i] = -d[i], -sign[i], -offset[i]
    for i in flips:
        a[i - 1], alpha[i - 1] = -a[i - 1], -alpha[i - 1]
        offset[i - 1], offset[i] = offset[i - 1] + 180, offset[i] + 180
    matrix = np.diag(sign)
    matrix[2, 1] = sign[2]
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    alpha, offset = (180 - (180 - angle) % 360 for angle in (alpha, offset))
    lists = {"d_mm": d, "a_mm": a, "alpha_deg": alpha, "offset_deg": offset}
    for key, values in lists.items():
        text = re.sub(rf"^{key} = .*$", f"{key} = {values.tolist()}", text, count=1, flags=re.MULTILINE)
    rows = "matrix = " + str(matrix.tolist())
    text = re.sub(r"^matrix = \[\n(.*\n){6}\]$", rows, text, count=1, flags=re.MULTILINE)
    text = text[: text.index("# First thermal model")].replace("j2_j3_deg = []", AREA)
    (folder / "other.toml").write_text(text)
    return load_any_robot(str(folder / "other.toml"))


@pytest.mark.parametrize(
    ("flips", "turns"),
    [
        *(((i,), ()) for i in range(1, 6)),
        *(((), (i,)) for i in range(1, 6)),
        ((1, 3), (2, 5)),
        ((2, 4), (1, 3)),
        ((1, 2, 3, 4, 5), (1, 2, 3, 4, 5)),
    ],
)
def test_other_signs_are_the_same_arm_at_the_pendant(tmp_path, flips, turns):
    other, robot = rewritten(tmp_path, flips, turns), load_robot("m710ic50")
    pendant = RNG.uniform(-1.5, 1.5, (500, 6))
    ours, its = flange_pose(robot, robot.to_theta(pendant)), flange_pose(other, other.to_theta(pendant))
    assert_allclose(its.position, ours.position, atol=1e-12)
    assert_allclose(its.rotation, ours.rotation, atol=1e-12)
    assert is_class(other)
    ends = [other.to_pendant(v) for v in (other.lower, other.upper)]
    expected = [robot.to_pendant(v) for v in (robot.lower, robot.upper)]
    assert_allclose(np.sort(ends, axis=0), np.sort(expected, axis=0), atol=1e-9)
    theta = other.to_theta(pendant)
    for posture in ALL_POSTURES:
        assert (has_posture(other, theta, posture) == has_posture(robot, robot.to_theta(pendant), posture)).all()


def test_the_closed_form_solves_it(tmp_path):
    other = rewritten(tmp_path, (1, 3), (2, 5))
    theta = other.to_theta(RNG.uniform(-0.5, 0.5, (50, 6)))
    flange, reached = flange_pose(other, theta), np.zeros(50, dtype=bool)
    for posture in ALL_POSTURES:
        solved = solve_flange(other, flange, posture)
        reached |= (np.abs(np.sin((solved.theta - theta) / 2)) < 1e-7).all(axis=1)
    assert reached.all()


@pytest.mark.parametrize("name", ["ur5", "irb120"])
def test_arms_that_are_not_of_the_class_keep_their_rows(name):
    robot = load_any_robot(name)
    text = (ROOT / "robots" / f"{name}.toml").read_text()
    for key, values in (("d_mm", robot.d), ("a_mm", robot.a)):
        row = re.search(rf"^{key} = \[(.*)\]", text, re.MULTILINE)
        assert row is not None
        given = [float(v) for v in row[1].split(",")]
        assert_allclose(values * 1000, given, atol=1e-9)


def with_matrix(rows):
    """The text of an M-20iA whose pendant has another matrix."""
    text = (ROOT / "robots" / "m20ia.toml").read_text()
    return re.sub(r"^matrix = \[\n(.*\n){6}\]$", f"matrix = {rows}", text, count=1, flags=re.MULTILINE)


def counting_the_other_way(joint):
    """The text of an M-20iA where the pendant of one joint counts the other way."""
    rows = [[float(i == k or (i == 2 and k == 1)) for k in range(6)] for i in range(6)]
    rows[joint] = [-v for v in rows[joint]]
    return with_matrix(rows)


@pytest.mark.parametrize("joint", range(6))
def test_limits_of_a_joint_that_counts_the_other_way_change_places(tmp_path, joint):
    text = counting_the_other_way(joint)
    (tmp_path / "other.toml").write_text(text)
    other, robot = load_any_robot(str(tmp_path / "other.toml")), load_robot("m20ia")
    zero = robot.pendant_zero[joint]
    assert_allclose(other.lower[joint] - zero, -(robot.upper[joint] - zero))
    assert_allclose(other.upper[joint] - zero, -(robot.lower[joint] - zero))


def test_every_pair_of_flips_is_one_arm(tmp_path):
    robot = load_robot("m710ic50")
    pendant = RNG.uniform(-1, 1, (20, 6))
    ours = flange_pose(robot, robot.to_theta(pendant)).position
    for flip, turn in product(range(1, 6), range(1, 6)):
        other = rewritten(tmp_path, (flip,), (turn,))
        assert_allclose(flange_pose(other, other.to_theta(pendant)).position, ours, atol=1e-12)


@pytest.mark.parametrize(("flips", "turns"), [((), ()), ((2,), (1,)), ((), (2,)), ((1, 2, 3), (1, 2, 3))])
def test_the_polygon_is_that_of_the_pendant_whatever_the_signs(tmp_path, flips, turns):
    other = rewritten(tmp_path, flips, turns)
    pendant = RNG.uniform(-1.5, 1.5, (500, 6))
    assert_allclose(other.interference.plane(other.to_theta(pendant)), pendant[:, 1:3], atol=1e-12)
    plain = rewritten(tmp_path, (), ())
    expected = plain.interference.clearance(plain.to_theta(pendant))
    assert 50 < (expected > 0).sum() < 450
    assert_allclose(other.interference.clearance(other.to_theta(pendant)), expected, atol=1e-12)


@pytest.mark.parametrize("joint", range(6))
def test_limits_are_quoted_as_the_data_sheet_prints_them(tmp_path, joint):
    """The pendant of one joint counts the other way, with a range that is not the same to both sides."""
    text = counting_the_other_way(joint)
    key = ["j1", "j2", "j2_plus_j3", "j4", "j5", "j6"][joint]
    text = re.sub(rf"^{key}_deg = .*$", f"{key}_deg = [-40, 130]", text, count=1, flags=re.MULTILINE)
    (tmp_path / "other.toml").write_text(text)
    arm = load_arm(str(tmp_path / "other.toml"))
    assert_allclose(arm.robot.quoted_limits[:, joint] / DEG, [-40, 130])
    assert_allclose(robot_sheet(arm).limits[joint], [-40, 130])
    beyond = np.zeros((1, 6))
    beyond[0, joint] = 150 * DEG
    theta = arm.robot.to_theta(beyond)
    with pytest.raises(JointLimitError) as caught:
        check_joint_limits(arm.robot, theta)
    assert_allclose([caught.value.value / DEG, caught.value.lower / DEG, caught.value.upper / DEG], [150, -40, 130])
    with pytest.raises(InputError, match=r"at 150.000 deg is outside its limits -40 to 130 deg"):
        check_within_limits(arm.robot, theta, lambda m, k: "row 1")


@pytest.mark.parametrize("way", [1, -1])
def test_exported_joints_turn_as_the_pendant_counts(tmp_path, way):
    rows = [[float(i == k) * (way if i in (0, 4) else 1) for k in range(6)] for i in range(6)]
    text = with_matrix(rows)
    (tmp_path / "other.toml").write_text(
        text.replace("j2_plus_j3_deg", "j3_deg").replace("j1_deg = [-170, 170]", "j1_deg = [-40, 130]")
    )
    arm = load_arm(str(tmp_path / "other.toml"))
    joints: Any = export_record(arm.robot, rigid_chain(arm.robot, (), np.zeros(0)), {}, "")["joints"]
    assert_allclose(joints[0]["axis"], [0, 0, way], atol=1e-9)
    assert_allclose(joints[4]["axis"], [0, -way, 0], atol=1e-9)


@pytest.mark.parametrize(("coupling", "name"), [(1, "J2+J3"), (-1, "J3-J2"), (0, "J3")])
def test_what_a_third_limit_is_of_follows_from_the_matrix(tmp_path, coupling, name):
    """Limits of J3 alone held on J2 + J3, which was called J3, and J3 - J2 was called J2 + J3."""
    text = with_matrix([[float(i == k) + coupling * ((i, k) == (2, 1)) for k in range(6)] for i in range(6)])
    alone = text.replace("j2_plus_j3_deg", "j3_deg")
    right, wrong = (text, alone) if coupling else (alone, text)
    (tmp_path / "right.toml").write_text(right)
    (tmp_path / "wrong.toml").write_text(wrong)
    robot = load_robot(str(tmp_path / "right.toml"))
    assert robot.joint_names[2] == name
    record = export_record(robot, rigid_chain(robot, (), np.zeros(0)), {}, "")
    assert str(record["pendant"]).replace(" ", "") == f"joint3is{name}"
    with pytest.raises(InputError, match=r"limits\.(j3|j2_plus_j3)_deg: pendant.matrix .* J3 to J2; give"):
        load_robot(str(tmp_path / "wrong.toml"))


@pytest.mark.parametrize(("length", "by"), [("-1016", "1016"), ("-175", "175")])
def test_a_length_of_the_wrong_sign_is_named_before_anything_is_driven(tmp_path, length, by):
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    assert f" {length}" in text
    (tmp_path / "arm.toml").write_text(text.replace(f" {length}", f" {by}", 1))
    with pytest.raises(InputError, match=r"dh: within J5's limits .* folds back onto it; mend the sign of d4 or d6"):
        load_robot(str(tmp_path / "arm.toml"))


@pytest.mark.parametrize("limits", ["[10, 189.6]", "[10, 180]", "[-10, 350]", "[-120, -5]"])
def test_limits_that_keep_the_wrist_bent_to_one_side_are_taken(tmp_path, limits):
    text = (ROOT / "robots" / "m10ia.toml").read_text()
    (tmp_path / "arm.toml").write_text(re.sub(r"j5_deg = \[.*?\]", f"j5_deg = {limits}", text))
    assert load_robot(str(tmp_path / "arm.toml")).name
