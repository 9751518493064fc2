"""A command replaces what it has written itself about the same thing, and nothing else."""

import json
import shutil
from pathlib import Path

import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.cli.output_files import publish

LINE_Y, LINE_X = (ROOT / "paths" / f"{name}.toml" for name in ("line_y", "line_x"))
ASK = ("--ask", "contributions", "--no-live", "-q")


def content(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


@pytest.fixture(scope="module")
def heated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("heat") / "o"
    assert run("heat", LINE_Y, "-q", "-o", folder).returncode == 0
    return folder


def test_heat_keeps_another_paths_day(heated):
    before = content(heated)
    assert set(before) == {"compgen.json", "heat.json", "heat.csv", "runs.csv", "heat.html"}
    refused(run("heat", LINE_X, "-q", "-o", heated), 2, "cgen heat wrote about line_y", "-o")
    assert content(heated) == before
    assert run("heat", LINE_Y, "-q", "-o", heated, "--set", "before.0.duration_h=1").returncode == 0  # its own
    assert content(heated).keys() == before.keys()
    assert content(heated)["heat.json"] != before["heat.json"]


def test_heat_says_the_day_in_numbers(heated):
    day = json.loads((heated / "heat.json").read_text())
    assert (day["schema"], day["name"], day["runs"]["count"]) == (1, "line_y", 1)
    assert set(day["rise_K"]["start"]) == set(day["rise_K"]["end"])
    assert day["runs"]["residual_max_um"] == 0 < day["runs"]["error_max_um"]
    assert len(day["provenance"]["robot_file"]["sha256"]) == 64


def test_a_prediction_keeps_a_program_of_the_path_s_name(tmp_path):
    (tmp_path / "LINE_Y.LS").write_text("of somebody else")
    refused(run("predict", LINE_Y, "-q", "-o", tmp_path), 2, "LINE_Y.LS in it is not what cgen predict wrote", "-o")
    assert content(tmp_path) == {"LINE_Y.LS": b"of somebody else"}


def test_questions_keep_another_paths_answers(tmp_path):
    out = tmp_path / "o"
    assert run("whatif", LINE_Y, *ASK, "-o", out).returncode == 0
    before = content(out)
    assert set(before) == {"compgen.json", "whatif.json", "whatif.html", "contributions.csv"}
    refused(run("whatif", LINE_X, *ASK, "-o", out), 2, "another study", "-o")
    assert content(out) == before
    assert run("whatif", LINE_Y, *ASK, "-o", out).returncode == 0  # its own


@pytest.mark.parametrize("more", [(), ("--fresh",)])
def test_a_study_keeps_what_no_study_has_written(more, tmp_path):
    (tmp_path / "contributions.csv").write_text("of somebody else")
    refused(run("whatif", LINE_Y, *ASK, "-o", tmp_path, *more), 2, str(tmp_path), "-o")
    assert content(tmp_path) == {"contributions.csv": b"of somebody else"}


def test_planned_poses_keep_another_robots(tmp_path):
    assert run("plan-poses", "m710ic50", "-n", "12", "-q", "-o", tmp_path).returncode == 0
    before = content(tmp_path)
    assert set(before) == {
        "compgen.json", "M710IC50_POSES.LS", "poses.csv", "expected.csv", "M710IC50_REVERSALS.LS", "reversals.csv"
    }  # fmt: skip
    refused(run("plan-poses", "ur5", "-n", "12", "-q", "-o", tmp_path), 2, "plan-poses wrote about", "-o")
    assert content(tmp_path) == before
    (tmp_path / "compgen.json").unlink()  # as an older release left it
    refused(run("plan-poses", "ur5", "-n", "12", "-q", "-o", tmp_path), 2, "poses.csv in it is not what", "-o")


def test_a_schema_replaces_only_a_schema(tmp_path):
    file = tmp_path / "plate.toml"
    shutil.copy(LINE_Y, file)
    refused(run("schema", "path", "-o", file), 2, "plate.toml", "not what cgen schema wrote")
    assert file.read_bytes() == LINE_Y.read_bytes()
    file.write_bytes(b"")  # as mktemp leaves it
    for _ in range(2):
        assert run("schema", "path", "-o", file).returncode == 0
    assert len(file.read_bytes()) > 100


def test_the_record_is_there_whenever_another_report_is(tmp_path, monkeypatch):
    """A killed run leaves no report of which nothing tells whose it is."""
    reports = {"report.json": b"1", "page.html": b"1", "a.csv": b"1"}
    publish.publish(tmp_path, {}, reports)
    (tmp_path / "notes.txt").write_text("of somebody else")
    states = []

    def watched(of):
        def step(self, *arguments, **how):
            done = of(self, *arguments, **how)
            states.append({p.name for p in tmp_path.iterdir()} & {*reports})
            return done

        return step

    for name in ("replace", "unlink"):
        monkeypatch.setattr(Path, name, watched(getattr(Path, name)))
    publish.publish(tmp_path, {}, {name: b"2" for name in reports})
    assert set() in states
    assert all("report.json" in state for state in states if state)


@pytest.mark.parametrize("name", ["", ".", "a\0b", "/proc/nowhere/x", "x" * 300])
@pytest.mark.parametrize("arguments", [("schema", "path", "-o"), ("check", "paths/line_y.toml", "-q", "--junit")])
def test_a_name_that_no_file_can_have_is_refused(arguments, name):
    result = run(*arguments, name)
    refused(result, 2, "cgen: ")
    assert "see where it goes" not in result.stderr  # it says which file
