"""The audit on an identified robot and a part that it taught; ``audit_mutants.py taught:`` plants errors there."""

import json
import shutil

import audited_case
import numpy as np
import pytest
from audit.__main__ import main
from audit.arm import Spots, of_study
from audit.judge import audit
from audit.taught import Taught, of_frame
from command_line import run
from naive_errors import about, bends, shifts
from shipped import ROOT
from wider_arm import BENDS

SHIPPED = (ROOT / "robots" / "m710ic50.toml").read_text()
DOWN = (np.array([12.0, -8.0, 150.0]), np.eye(3))


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A folder with the case's files, and the output of its taught path."""
    folder = tmp_path_factory.mktemp("case")
    audited_case.write(folder, SHIPPED)
    result = run("generate", folder / "taught.toml", "--robot", folder / "own.toml", "-o", folder / "out")
    assert result.returncode == 0, result.stderr
    return folder


def test_it_agrees_with_an_identified_robot_on_a_part_that_it_taught(case):
    _, checks = audit(case / "out", case / "taught.toml", case / "own.toml")
    assert [c for c in checks if not c.kept] == []
    sizes = json.loads((case / "out" / "report.json").read_text())["band"]["budget_um"]
    assert {"identified parameters", "part's frame", "fit noise", "repeatability"} <= sizes.keys()


@pytest.mark.parametrize(("robot", "words"), [
    ([], "with an identified robot file as third argument"),
    (["own.toml", "payload_kg = 34\n", "payload_kg = 35\n"], "not the robot file that this output was made with"),
    (["nowhere.toml"], "No such file"),
])  # fmt: skip
def test_without_its_robot_file_it_is_not_judged(case, tmp_path, capsys, robot, words):
    shutil.copytree(case, tmp_path, dirs_exist_ok=True)
    if len(robot) > 1:
        text = (tmp_path / robot[0]).read_text()
        assert robot[1] in text
        (tmp_path / robot[0]).write_text(text.replace(robot[1], robot[2]))
    named = [str(tmp_path / name) for name in robot[:1]]
    assert main([str(tmp_path / "out"), str(tmp_path / "taught.toml"), *named]) == 2
    words_said = capsys.readouterr().err
    assert words in words_said
    assert words_said.count("\n") == 1


def spots(seed, count):
    rng = np.random.default_rng(seed)
    pendant = np.radians(rng.uniform([-30, 0, -40, -20, -80, -40], [30, 40, 0, 20, -50, 40], (count, 6)))
    return Spots(of_study(), pendant, np.zeros((count, 6)), np.zeros((count, 5)), DOWN)


def taught(probing=None):
    of_touches = spots(1, 9)
    touches = [{"joints_deg": q, "noise_um": 9.0} for q in np.degrees(of_touches.pendant)]
    for touch in touches if probing else ():
        touch["probing"] = probing
    return Taught({"touches": touches, "probe_mm": DOWN[0]}, of_study(), DOWN)


def test_what_moves_part_and_touches_alike_is_taken_up():
    frame, path, shift, turn = taught(), spots(2, 5), np.array([0.3, -0.2, 0.1]), np.array([1e-4, 2e-4, -3e-4])
    effects = [(shift + np.cross(turn, s.pose()[0]))[:, :, None] for s in (path, frame.spots)]
    left = frame.left(path, *effects)
    assert np.abs(effects[0]).max() > 0.3
    assert np.abs(left).max() < 2e-3  # the probe is held a little


def test_a_probe_that_is_too_long_is_taken_up_where_it_is_the_tool():
    frame, path, longer = taught(), spots(2, 5), np.array([0.02, -0.03, 0.05])
    effects = [(s.flange()[1] @ longer)[:, :, None] for s in (path, frame.spots)]
    assert np.abs(frame.left(path, *effects)).max() < 1e-3
    frame.is_tool = False
    assert np.abs(frame.left(path, *effects)).max() > 0.02


def test_noise_of_touches_opens_the_frame_as_drawn_touches_do():
    """A thousand draws of the touches' noise: where the part is found."""
    frame, path, rng = taught(), spots(2, 3), np.random.default_rng(3)
    place, flange = path.pose()[0], path.flange()[1]
    columns = frame.frame(place, flange)
    expected = np.einsum("niq,niq->n", columns, columns)
    drawn = frame.left(path, np.zeros((3, 3, 4000)), rng.normal(0, 9e-3, (9, 3, 4000)))
    np.testing.assert_allclose((drawn**2).sum(axis=1).mean(axis=1), expected, rtol=0.1)


def test_a_smooth_field_is_taken_up_near_the_touches_and_not_far_away():
    frame = taught()
    place, flange = frame.spots.pose()[0], frame.spots.flange()[1]
    near, far = frame.field(place, flange), frame.field(place + 5000.0, flange)
    assert near.max() < 0.6
    assert far.min() > 1.0  # a turn that the field made there


def test_a_frame_that_another_robot_taught_counts_by_its_sigmas():
    table = {"through": "model", "robot_file": "m710ic50 0123456789abcdef", "touches": [{}],
             "sigma_um": [9.0, 14.0, 7.0], "sigma_mdeg": [0.0, 0.0, 4.0]}  # fmt: skip
    frame = of_frame(table, of_study(), DOWN, "f" * 64, np.zeros(3))
    columns = frame.frame(np.array([[1000.0, 0.0, 0.0]]), None)[0]
    turned = 1000 * np.radians(4e-3)
    np.testing.assert_allclose(np.diag(columns @ columns.T), [0.009**2, 0.014**2 + turned**2, 0.007**2])


def test_bends_are_those_of_the_arms_that_are_flown():
    """By hand in two places: axes and half levers of each link, millimetres here and metres there."""
    for (link, plane), (row, axis, lever) in BENDS.items():
        table = {"link": [link], "plane": [plane], "node": ["j2"], "rate_arcsec_K": [3600.0], "column_mm": 565}
        ((number, (matrix,)),) = bends(table, {"j2": np.array([0.001])}).items()
        angle = np.radians(0.001)
        assert number == row
        turn = about(np.array(axis, float), np.array([angle]))[0, :3, :3]
        np.testing.assert_allclose(matrix[0, :3, :3], turn, atol=1e-12, err_msg=f"{link} {plane}")
        moved = np.cross(angle * np.array(axis), np.array(lever)) * 1e3
        np.testing.assert_allclose(matrix[0, :3, 3], moved, atol=1e-9, err_msg=f"{link} {plane}")


def test_shifts_go_away_from_zero_along_their_links():
    table = {"of": ["d1", "base y", "a3", "d4", "tool", "fixture x"], "node": 6 * ["j2"], "rate_um_K": 6 * [10.0]}
    moved = shifts(table, {"j2": np.array([2.0])})
    places = {row: [m[0, :3, 3].tolist() for m in matrices] for row, matrices in moved.items()}
    up, side, away = [0, 0, 0.02], [0, 0.02, 0], [-0.02, 0, 0]
    assert places == {0: [up, side, away], 3: [[0.02, 0, 0], [0, 0, -0.02]], 6: [up]}
