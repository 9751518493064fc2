"""A real arm: the published UR5 data set, where it is at hand."""

import json
import sys

import pytest
from shipped import ROOT
from typer.testing import CliRunner

from compgen.cli.app import app
from compgen.cli.commands import identify

assert identify
sys.path.insert(0, str(ROOT / "robots"))
from ur5_poses import GRID, RANDOM, converted  # noqa: E402

PLACES = [ROOT.parent / "shared", ROOT.parents[1] / "shared"]
DATA = next((p / "data" / "ur5_tsinghua" for p in PLACES if (p / "data" / "ur5_tsinghua").is_dir()), None)


@pytest.mark.skipif(DATA is None, reason="the published data set is not at hand")
@pytest.mark.parametrize(("count", "reach_mm"), [(20, 0.110), (30, 0.105), (50, 0.098), (1000, 0.0575)])
def test_few_poses_beat_what_peers_reach(tmp_path, count, reach_mm):
    train, test, target = tmp_path / "train.csv", tmp_path / "test.csv", tmp_path / "ur5.toml"
    assert DATA is not None
    train.write_text(converted(DATA / GRID, count))
    test.write_text(converted(DATA / RANDOM))
    robot = str(ROOT / "robots" / "ur5.toml")
    assert CliRunner().invoke(app, ["identify", robot, "--poses", str(train), "-o", str(target), "-q"]).exit_code == 0
    run = CliRunner().invoke(app, ["check-robot", str(target), "--poses", str(test), "--json"])
    assert json.loads(run.stdout)["overall"]["identified"]["mean"] <= reach_mm
