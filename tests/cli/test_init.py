"""The shipped robots and paths, laid down for a user."""

from command_line import run
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
