"""What a terminal shows of a long run."""

import os
import pty
import re
import subprocess
import sys

import pytest
from ls_text import cartesian, program
from shipped import ROOT, path_file

from compgen.cli import progress_bar
from compgen.fanuc.frames import known_without_a_table
from compgen.pipelines import correct, generate
from compgen.pipelines.path_file import load_job
from compgen.pipelines.robot_file import load_cell


def told(work):
    """Stages and shares as a run tells them."""
    heard = []
    work(lambda stage, share: heard.append((stage, share)))
    return heard


def rising(course, heard):
    names = [stage.partition(":")[0] for stage, _ in heard]
    assert set(names) <= set(course)
    shares = [progress_bar.overall_share(course, name, share) for name, (_, share) in zip(names, heard)]
    assert all(b >= a - 1e-12 for a, b in zip(shares, shares[1:]))
    assert shares[0] == 0
    return shares


def test_the_stages_of_a_run_are_known_and_their_shares_rise():
    thin = ["process.thin_um=1.5", "path.stepover_mm=200"]
    heard = told(lambda tell: generate.generate(load_job(path_file("optic_spiral"), None, thin), tell))
    assert [name for name in progress_bar.GENERATE if name != "report"] == list(
        dict.fromkeys(s.partition(":")[0] for s, _ in heard)
    )
    assert rising(progress_bar.GENERATE, heard)[-1] > 0.7
    assert any(re.fullmatch(r"path: \d+ waypoints", stage) for stage, _ in heard)
    rising(progress_bar.CHECK, heard)
    rising(progress_bar.PREDICT, told(lambda tell: generate.predict(load_job(path_file("line_x")), tell)))


def test_the_stages_of_a_correction_are_known_and_their_shares_rise():
    points = [cartesian(n, (1300 + n, 20, 200, 180, 0, 0)) for n in range(1, 9)]
    text = program([f"L P[{n}] 100mm/sec FINE" for n in range(1, 9)], points)
    cell = load_cell("m710ic50", ())
    rising(
        progress_bar.CORRECT,
        told(lambda tell: correct.correct(text, cell, known_without_a_table(), (), correct.Options(), tell)),
    )


@pytest.mark.parametrize(
    ("left", "since", "words"),
    [
        (None, 0, "time left: ?"),
        (12.4, 0, "12 s left"),
        (12.4, 5, "7 s left"),
        (3.0, 60, "1 s left"),
        (3725.0, 0, "1:02:05 left"),
    ],
)
def test_time_left_counts_down_and_never_below_a_second(left, since, words):
    assert progress_bar.time_left_text(left, since) == words


def test_a_terminal_sees_the_share_rise_and_a_short_run_shows_nothing(tmp_path):
    long = ["--set", "path.stepover_mm=10.325", "--set", "process.chord_um=0.2"]  # 2e5 waypoints
    seen = {}
    for name, more in (("long", long), ("short", ["--set", "path.stepover_mm=700"])):
        here, there = pty.openpty()
        command = [sys.executable, "-m", "compgen", "generate", "paths/optic_spiral.toml", "-o", str(tmp_path), *more]
        surroundings = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
        run = subprocess.Popen(command, cwd=ROOT, stderr=there, stdout=subprocess.DEVNULL, env=surroundings)
        os.close(there)
        text = b""
        while True:
            try:
                text += os.read(here, 65536)
            except OSError:  # nobody holds the other end
                break
        os.close(here)
        assert run.wait() == 0
        seen[name] = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text.decode())
    assert seen["short"] == ""
    frames = [f for f in re.split(r"[\r\n]+", seen["long"]) if f.strip()]
    shares = [int(re.search(r"(\d+) %", f)[1]) for f in frames]
    assert shares == sorted(shares)
    assert shares[-1] - shares[0] > 50
    assert all(f.split()[0] in {n.split()[0] for n in progress_bar.GENERATE} for f in frames)
    assert sum("waypoints/s" in f for f in frames) > len(frames) / 2
    left = [int(m[1]) for f in frames if (m := re.search(r"(\d+) s left", f))]
    assert left
    assert max(left) < 100
    assert "Traceback" not in seen["long"]
