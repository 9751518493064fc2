"""The shipped robots and paths, laid down for a user."""

import pytest
from command_line import refused, run
from shipped import ROOT


def test_init_lays_down_what_is_missing(tmp_path):
    assert run("init", tmp_path).returncode == 0
    ours = {p.name for p in (tmp_path / "paths").iterdir()}
    assert {"spiral_1300.toml", "path.schema.json"} <= ours
    (tmp_path / "paths" / "line_y.toml").write_text("mine")
    assert run("init", tmp_path).returncode == 0
    assert (tmp_path / "paths" / "line_y.toml").read_text() == "mine"
    assert run("generate", "paths/line_x.toml", "-q", cwd=tmp_path).returncode == 0
    assert (tmp_path / "outputs" / "line_x" / "LINE_X.LS").exists()


def test_wheel_carries_robots_and_paths():
    """The build's own table says so; the slow proof is a fresh install."""
    text = (ROOT / "pyproject.toml").read_text()
    assert '"robots" = "compgen/data/robots"' in text
    assert '"paths" = "compgen/data/paths"' in text
    assert '"docs" = "compgen/data/docs"' in text


def test_init_lays_down_the_files_of_a_tutorial_and_keeps_those_there(tmp_path):
    done = run("init", tmp_path, "--tutorial", "robodk")
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1] == f"2 files of the tutorial in {tmp_path}: PASSES.LS, frames.toml"
    data = ROOT / "docs" / "tutorials" / "data" / "robodk"
    assert all((tmp_path / file.name).read_bytes() == file.read_bytes() for file in data.iterdir())
    (tmp_path / "frames.toml").write_text("mine")
    assert "0 files of the tutorial" in run("init", tmp_path, "--tutorial", "robodk").stdout
    assert (tmp_path / "frames.toml").read_text() == "mine"


@pytest.mark.parametrize("name", ["robots", "..", ""])
def test_a_tutorial_without_files_is_refused_by_the_names_there_are(name, tmp_path):
    refused(run("init", tmp_path / "cell", "--tutorial", name), 2, "--tutorial", "robodk")
    assert not (tmp_path / "cell").exists()
