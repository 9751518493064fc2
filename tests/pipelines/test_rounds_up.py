"""Whether a controller rounds lines up to whole periods: what the shipped files say, and a file that says nothing."""

import tomllib

import pytest
from shipped import ROOT

from compgen.pipelines.files.robot_file import known_robots, load_any_robot, load_cell

KEY = "rounds_up_to_period"


def periods_notes(cell):
    return [finding.message for finding in cell.input_findings if finding.code == "controller.periods"]


@pytest.mark.parametrize("name", known_robots())
def test_shipped_files_say_it_and_only_fanucs_round_up(name):
    tables = tomllib.loads((ROOT / "robots" / f"{name}.toml").read_text())
    assert tables["controller"][KEY] is (tables["maker"] == "FANUC")
    assert load_any_robot(name).controller.rounds_up_to_period is (tables["maker"] == "FANUC")


def test_a_file_without_the_key_rounds_up_and_a_note_says_so_once(tmp_path):
    text = (ROOT / "robots" / "m710ic50.toml").read_text()
    silent = tmp_path / "silent.toml"
    silent.write_text("".join(line for line in text.splitlines(keepends=True) if not line.startswith(KEY)))
    cell = load_cell(str(silent))
    assert cell.robot.controller.rounds_up_to_period
    (note,) = periods_notes(cell)
    assert f"controller.{KEY}" in note
    assert not periods_notes(load_cell(str(silent), (f"controller.{KEY}=false",)))
    assert not periods_notes(load_cell("m710ic50"))
