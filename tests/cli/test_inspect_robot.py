"""``cgen inspect-robot`` as a user with a data sheet and a pendant meets it."""

import json
import tomllib
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from command_line import refused, run
from naive_arm import config, flange, frame, numbers
from numpy.testing import assert_allclose
from shipped import ROOT

KEYS = ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")
SHIPPED = sorted(p.stem for p in (ROOT / "robots").glob("*.toml"))


def sheet(robot):
    result = run("inspect-robot", robot, "--json")
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def test_the_table_to_compare_is_what_the_second_arm_says():
    record = sheet("m710ic50")
    assert len(record["poses"]) == 9
    for pose in record["poses"]:
        there = flange(pose["joints_deg"])
        pose_numbers = [pose[k] for k in KEYS]
        assert_allclose(frame(*pose_numbers), there, atol=2e-3)
        assert pose["config"] == config(pose["joints_deg"])
        if abs(pose["p_deg"]) < 89:
            assert_allclose(np.mod(np.subtract(numbers(there)[3:], pose_numbers[3:]) + 180, 360), 180, atol=1e-3)


def test_reach_and_limits_are_those_of_the_data_sheet():
    """2050 mm is what the study and public tables give; limits as the robot file prints them."""
    record = sheet("m710ic50")
    assert record["wrist_reach_mm"]["outward"] == pytest.approx(2050, abs=1)
    limits = tomllib.loads((ROOT / "robots" / "m710ic50.toml").read_text())["limits"]
    keys = ("j1_deg", "j2_deg", "j2_plus_j3_deg", "j4_deg", "j5_deg", "j6_deg")
    assert [[j["lower_deg"], j["upper_deg"]] for j in record["joints"]] == [limits[k] for k in keys]
    assert record["pendant_J3"] == "against the horizontal"
    assert sheet("m20ia")["wrist_reach_mm"]["outward"] == pytest.approx(1811, abs=1.5)  # as its maker says


@pytest.mark.parametrize("robot", ["m710ic50", "m20ia"])
def test_an_arm_that_stretches_out_reaches_as_far_as_its_links_are_long(robot):
    """Straight ahead and straight up, a1 + a2 + |a3, d4| and a2 + |a3, d4|: a grid of joints alone was 0.3 mm short."""
    dh = tomllib.loads((ROOT / "robots" / f"{robot}.toml").read_text())["dh"]
    stretched = dh["a_mm"][1] + np.hypot(dh["a_mm"][2], dh["d_mm"][3])
    reach = sheet(robot)["wrist_reach_mm"]
    assert [reach["outward"], reach["high"]] == pytest.approx([dh["a_mm"][0] + stretched, stretched], abs=0.0501)


@pytest.mark.parametrize("robot", SHIPPED)
def test_every_shipped_arm_has_a_sheet_and_a_picture(robot, tmp_path):
    result = run("inspect-robot", robot, "-o", tmp_path / "o")
    assert result.returncode == 0, result.stderr
    record = json.loads((tmp_path / "o" / "robot.json").read_text())
    assert record == sheet(robot)
    picture = ET.fromstring((tmp_path / "o" / "zero.svg").read_text())
    circles = picture.findall("{http://www.w3.org/2000/svg}circle")
    assert len(circles) == 14
    assert picture.get("role") == "img"
    zero_words = picture.findtext("{http://www.w3.org/2000/svg}title", "")
    style = picture.findtext("{http://www.w3.org/2000/svg}style", "")
    assert "prefers-color-scheme:dark" in style
    (x0, z0), (x, z) = ((float(circles[n].attrib["cx"]), float(circles[n].attrib["cy"])) for n in (0, 6))
    zero = next(p for p in record["poses"] if not any(p["joints_deg"]))
    texts = picture.findall("{http://www.w3.org/2000/svg}text")
    assert all(t.text for t in texts)
    boxes = [(float(t.attrib["x"]), float(t.attrib["y"]), 6 * len(t.text or "")) for t in texts]
    for n, (x1, y1, length) in enumerate(boxes):
        assert 0 <= x1 <= x1 + length <= float(picture.attrib["width"]), "a word is cut"
        for x2, y2, other in boxes[n + 1 :]:
            assert abs(y1 - y2) >= 10 or x1 + length <= x2 or x2 + other <= x1, "words meet"
    assert f"X {zero['x_mm']:.0f}, Y {zero['y_mm']:.0f}, Z {zero['z_mm']:.0f} mm" in zero_words
    assert (x - x0) * zero["z_mm"] == pytest.approx((z0 - z) * zero["x_mm"], abs=1 + 0.1 * abs(zero["x_mm"]))
    again = run("inspect-robot", robot, "-o", tmp_path / "o", "-q")
    assert again.returncode == 0, again.stderr


def test_what_is_not_a_robot_file_and_a_folder_of_others_are_refused(tmp_path):
    refused(run("inspect-robot", "nobody"), 2, "nobody")
    (tmp_path / "zero.svg").write_text("mine")
    refused(run("inspect-robot", "m20ia", "-o", tmp_path), 2, "zero.svg", "not what cgen inspect-robot wrote")
