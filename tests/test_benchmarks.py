"""The benchmarks run from start to end, and what cannot be had says why."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from shipped import ROOT

from benchmarks import cases, heat, peers
from benchmarks.peers import chain
from compgen.cli.this_machine import find_machine
from compgen.robot.kinematics import flange_pose


@pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler")
def test_a_short_run_writes_its_table(tmp_path):
    call = [sys.executable, "-m", "benchmarks", "--no-peers", "--points", "3000", "--ipopt", "60", "--starts", "1"]
    compiler, _ = find_machine(1)
    assert compiler is not None
    kept = compiler.folder.parent  # with what other tests have compiled already
    call += ["--folder", str(kept), "--out", str(tmp_path / "results.md")]
    done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "results.md").read_text()
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| ")][1:]
    assert [len(row) for row in rows] == [5] * len(rows)
    told = {row[1].strip(): row[3].strip() for row in rows}
    assert sum("ipopt" in what for what in told) == 2
    assert not any("did not converge" in value for value in told.values())
    assert float(next(value for what, value in told.items() if what == "correction, vectorised")) > 0
    assert "nan" not in page
    measuring = [value for what, value in told.items() if what.startswith("cgen ")]
    assert [float(value.removesuffix(" s")) > 0 for value in measuring] == [True] * 4
    assert "`python -m benchmarks --points 3000 --ipopt 60 --no-peers --starts 1`" in page


def test_the_questions_are_what_compgen_computes(tmp_path):
    """The day of heat by a plain integration of its matrix; the arm's rows by a chain of their own."""
    network = heat.network(20)
    asked, (_, rises) = heat.question(network), heat.by_modes(network)
    matrix, powers = np.array(asked["matrix"]), np.array(asked["powers"])
    rise, step = np.zeros(20), 0.02
    for k in range(round(60 / step)):
        rise = rise + step * (matrix @ rise + powers[0 if k * step < asked["spans"][0] else 1])
    assert np.abs(rise - rises[1]).max() < 1e-4 * rise.max()
    robot = cases.job_of(3000).robot
    rows = np.column_stack([robot.d, robot.a, robot.alpha])
    theta = np.array([[0.1, -0.4, 0.3, 0.2, -0.8, 0.5]])
    assert np.abs(chain.flange(rows, theta[0])[:3, 3] - flange_pose(robot, theta).position[0]).max() < 1e-12
    assert chain.off(rows, theta, [chain.flange(rows, theta[0] + 1e-3)]) > 1e-4


def test_a_peer_that_cannot_be_had_says_why(tmp_path, monkeypatch):
    monkeypatch.setattr(peers, "PEERS", {"nobody": [str(tmp_path / "no such wheel.whl")]})
    told = peers.ask("nobody", {}, tmp_path)
    assert isinstance(told, str)
    assert told.startswith("not installed: ERROR")
    assert "|" not in told
    assert not (tmp_path / "nobody" / "ready").exists()


@pytest.mark.parametrize(
    ("script", "answer"),
    [
        ("import json, sys; print('noise'); print(json.dumps({'a': 2 * json.load(sys.stdin)['a']}))", {"a": 4}),
        ("raise SystemExit('no | way')", "failed: no / way"),
    ],
)
def test_a_peer_is_asked_and_answers(tmp_path, monkeypatch, script, answer):
    place = tmp_path / "somebody"
    (place / "bin").mkdir(parents=True)
    (place / "bin" / "python").symlink_to(sys.executable)
    (place / "ready").touch()
    (tmp_path / "somebody_peer.py").write_text(script)
    monkeypatch.setattr(peers, "HERE", tmp_path)
    assert peers.ask("somebody", {"a": 2}, tmp_path) == answer
