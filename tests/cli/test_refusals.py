"""What a refusal names: what the user gave or has to give, never a file that he does not know of."""

import pytest
from command_line import refused, run

LINE = "paths/line_y.toml"
TOUCHING = {"anchor": LINE, "teach-frame": "m710ic50", "identify": "m710ic50"}


@pytest.mark.parametrize("command", TOUCHING)
def test_touches_that_are_not_there_are_named_before_the_artefact_beside_them(tmp_path, command):
    done = run(command, TOUCHING[command], "--touches", tmp_path / "none.csv")
    refused(done, 2, f"{tmp_path / 'none.csv'}: cannot be read: no such file; give the CSV of touches")
    assert "artefact" not in done.stderr


@pytest.mark.parametrize("command", TOUCHING)
def test_an_artefact_that_nobody_named_is_asked_for(tmp_path, command):
    touches = tmp_path / "touches.csv"
    touches.write_text("time_s,target\n")
    done = run(command, TOUCHING[command], "--touches", touches)
    refused(done, 2, "--artefact: missing, and no artefact.toml is beside ", "give the TOML of what was touched")


@pytest.mark.parametrize("command", TOUCHING)
def test_the_file_that_the_command_is_about_comes_first(command):
    done = run(command, "nope.toml", "--touches", "none.csv")
    refused(done, 2, "nope.toml: no such file")


def test_a_log_is_named_as_it_was_typed():
    refused(run("anchor", LINE, "--touches", LINE, "--log", "none.csv"), 2, "cgen: --log none.csv: no such file")
