"""What to measure next: the squares that a measurement takes out of a band, by hand, and the three that cost least."""

import json
import re
import shlex

import numpy as np
import pytest
from command_line import run
from numpy.testing import assert_allclose
from shipped import ROOT

from compgen.report.band_words import next_words
from compgen.report.next_measurements import STEPS, STEPS_OF_PROGRAM, next_steps

LINE = ROOT / "paths" / "line_y.toml"
#: of the shipped spiral, docs/uncertainty.md
SPIRAL = {
    "cte": 31.0, "thermocouples": 20.0, "thermal physics missing": 17.0, "temperature law": 12.0, "air": 10.0,
    "profile shape": 8.0, "one-sided intervals": 6.0, "start delay": 3.0, "feed": 1.0,
}  # fmt: skip
SQUARES = 961 + 400 + 289 + 144 + 100 + 64 + 36 + 9 + 1


def test_the_shipped_spiral_asks_for_a_hot_length_a_bath_and_a_log():
    steps = next_steps(44.0, SPIRAL)
    assert [s["what"] for s in steps] == ["one hot length", "sensors in one bath", "a temperature log of the day"]
    gone = np.array([961 + 36, 400, 144 + 100 + 1])
    assert_allclose([s["takes_um"] for s in steps], 44 * (1 - np.sqrt(1 - gone / SQUARES)), rtol=1e-5)
    assert_allclose([s["left_um"] for s in steps], 44 * np.sqrt(1 - np.cumsum(gone) / SQUARES), rtol=1e-5)
    assert [round(s["takes_um"]) for s in steps] == [13, 5, 3]
    assert round(steps[-1]["left_um"]) == 19


def test_a_step_that_takes_little_or_has_nothing_to_take_is_not_named():
    assert next_steps(44.0, {"thermal physics missing": 44.0}) == []
    assert next_steps(0.0, {}) == []
    assert [s["what"] for s in next_steps(44.0, {"cte": 44.0, "tool": 2.0})] == ["one hot length"]
    (frame,) = next_steps(10.0, {"part's frame": 10.0})
    assert frame["left_um"] == pytest.approx(10 / np.sqrt(2), rel=1e-5)
    assert frame["command"].startswith("cgen teach-frame")


def test_a_day_whose_temperatures_are_logged_is_not_asked_for_again():
    """What the law leaves open behind a log's end no log takes away."""
    (sensor,) = next_steps(20.0, {"temperature law": 16.0, "temperature log": 12.0})
    assert sensor["what"] == "a sensor on every node"


def test_an_hour_counts():
    """Poses take more off than a gauge for the tool, in eight times its time."""
    steps = next_steps(30.0, {"identified parameters": 25.0, "tool": 16.0})
    assert [s["what"] for s in steps] == ["the tool against a gauge", "twice as many poses, at best"]
    assert steps[0]["takes_um"] < steps[1]["takes_um"]


def test_twice_as_many_measurements_leave_half_of_the_variance():
    """Poses were said to end what the identified arm leaves open: 159 um were to become 36."""
    (poses,) = next_steps(100.0, {"identified parameters": 80.0, "thermal physics missing": 60.0})
    assert poses["what"] == "twice as many poses, at best"
    assert_allclose(poses["left_um"], np.sqrt(6400 / 2 + 3600), rtol=1e-5)


def test_where_the_part_stands_is_taken_up_by_its_frame_and_by_no_pose():
    """Teaching leaves 80 of 100 um: of each source 64 % of its variance."""
    budget = {"identified parameters": 80.0, "thermal physics missing": 60.0}
    frame, poses = next_steps(100.0, budget, taught_um=80.0)
    assert frame["command"].startswith("cgen teach-frame ROBOT --touches")
    assert_allclose([frame["takes_um"], frame["left_um"]], [20, 80], rtol=1e-5)
    assert_allclose([poses["takes_um"], poses["left_um"]], [100 - np.sqrt(1e4 - 2048), np.sqrt(6400 - 2048)], rtol=1e-5)
    assert [s["what"] for s in next_steps(100.0, budget, taught_um=10.0)] == ["the part's frame, taught"]


def test_the_words_name_command_and_what_is_larger_than_the_band():
    record = {"p95_um": 44.0, "next": next_steps(44.0, SPIRAL), "unknown": []}
    words = next_words(record)
    assert words.startswith("one hot length: -13 um (then, with your own values, cgen generate PATH --set robot.")
    assert words.endswith("all of these leave 19 um of the band")
    record["unknown"] = [{"what": "play", "size_um": [55, 175]}, {"what": "spindle", "size_um": [2, 5]}]
    assert next_words(record).endswith("; larger than the band, so first: play")
    assert next_words({"next": []}) == ""


def test_a_program_that_exists_is_told_no_key_of_a_path_file():
    steps = next_steps(44.0, SPIRAL, STEPS_OF_PROGRAM)
    assert [s["what"] for s in steps] == ["one hot length", "sensors in one bath"]
    assert steps[1]["command"] == "cgen correct PROGRAM --set thermal.uncertainty.sensors_K=0.1"
    assert not any("generate" in step.command for step in STEPS_OF_PROGRAM)


def test_every_command_exists_and_has_the_options_that_are_named():
    for step in (*STEPS, *STEPS_OF_PROGRAM):
        for name, options in re.findall(r"cgen ([a-z-]+)([^,]*)", step.command):
            shown = run(name, "--help").stdout
            assert all(option in shown for option in re.findall(r"--[a-z-]+", options)), step.command


def test_what_a_hot_length_is_said_to_take_off_it_takes_off(tmp_path):
    """By the command as printed, in a shell: what half a unit of expansion leaves open is all that is between."""
    before, command = band(tmp_path / "before"), STEPS[0].command.replace("PATH", str(LINE))
    promised = next(step for step in before["next"] if step["what"] == STEPS[0].what)
    after = band(tmp_path / "after", *shlex.split(command)[3:])
    assert before["p95_um"] - after["p95_um"] == pytest.approx(promised["takes_um"], rel=0.25)
    assert after["budget_um"]["cte"] < before["budget_um"]["cte"] / 4


def band(folder, *options):
    """Of a shipped line."""
    assert run("generate", LINE, "-o", folder, *options).returncode == 0
    return json.loads((folder / "report.json").read_text())["band"]
