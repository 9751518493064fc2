"""What a terminal shows of a long run."""

import os
import re
import subprocess
import sys
import time

import pytest
from command_line import terminal_output
from ls_text import cartesian, program
from shipped import ROOT, path_file

from compgen.cli.screen import progress_bar
from compgen.core import stages
from compgen.core.stages import RunStage
from compgen.pipelines import correct
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.files.robot_file import load_cell
from compgen.pipelines.planned import generate
from compgen.program.frames import default_frames


def reports_of(work):
    """Stages and shares as a run reports them."""
    reports = []
    work(lambda stage, share: reports.append((stage, share)))
    return reports


def rising(weights, reports):
    assert {stage.name for stage, _ in reports} <= set(weights)
    shares = [progress_bar.overall_share(weights, stage, share) for stage, share in reports]
    assert all(b >= a - 1e-12 for a, b in zip(shares, shares[1:], strict=False))
    assert shares[0] == 0
    return shares


def test_the_stages_of_a_run_are_known_and_their_shares_rise():
    one_draw = "bounds.guaranteed={max_um=1000, share=0.5, confidence=0.5}"
    thin = ["process.thin_um=1.5", "path.stepover_mm=200", one_draw]
    reports = reports_of(lambda progress: generate.generate(load_job(path_file("optic_spiral"), None, thin), progress))
    assert [stage for stage in progress_bar.GENERATE if stage != stages.REPORT] == list(
        dict.fromkeys(s.name for s, _ in reports)
    )
    assert rising(progress_bar.GENERATE, reports)[-1] > 0.7
    assert any(stage == f"path: {stage.waypoints} waypoints" for stage, _ in reports)
    rising(progress_bar.CHECK, reports)
    rising(progress_bar.PREDICT, reports_of(lambda progress: generate.predict(load_job(path_file("line_x")), progress)))


def test_the_stages_of_a_correction_are_known_and_their_shares_rise():
    points = [cartesian(n, (1300 + n, 20, 200, 180, 0, 0)) for n in range(1, 9)]
    text = program([f"L P[{n}] 100mm/sec FINE" for n in range(1, 9)], points)
    cell = load_cell("m710ic50", ())
    rising(
        progress_bar.CORRECT,
        reports_of(lambda progress: correct.correct(text, cell, default_frames(), (), correct.Options(), progress)),
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


def test_a_short_run_shows_nothing_and_a_long_one_a_bar_that_never_falls(monkeypatch, capsys):
    clock = [100.0]
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    with progress_bar.show_progress({stages.PATH: 1, stages.TEXT: 3}, quiet=False) as progress:
        progress(RunStage(stages.PATH, waypoints=1000), 0.5)
        clock[0] += 0.9 * progress_bar.DELAY
        progress(stages.PATH, 1.0)
    assert capsys.readouterr().err == ""
    with progress_bar.show_progress({stages.PATH: 1, stages.TEXT: 3}, quiet=False) as progress:
        progress(RunStage(stages.PATH, waypoints=1000), 1.0)
        clock[0] += 10.0
        progress(stages.TEXT, 0.0)
        progress(stages.PATH, 0.0)
    shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", capsys.readouterr().err)
    assert "25 %" in shown
    assert "25 waypoints/s" in shown
    assert "30 s left" in shown


def test_what_a_stage_is_at_is_shown_and_no_time_left_where_its_share_is_uneven(monkeypatch, capsys):
    clock = [100.0]
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    for stage, words in (
        (RunStage(stages.CORRECTION, "ipopt 50%", is_even=False), ["correction: ipopt 50%", "time left: ?"]),
        (RunStage(stages.FIT, "12 waypoints"), ["fit: 12 waypoints", "10 s left"]),  # a name that counts nothing
    ):
        with progress_bar.show_progress(quiet=False) as progress:
            clock[0] += 10.0
            progress(stage, 0.5)
        shown = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", capsys.readouterr().err)
        assert all(word in shown for word in words)
        assert "waypoints/s" not in shown


def test_quiet_shows_no_bar_on_a_terminal_either(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with progress_bar.show_progress({stages.PATH: 1}, delay=0.0, quiet=True) as progress:
        progress(stages.PATH, 0.5)
    assert capsys.readouterr().err == ""


def test_a_terminal_sees_the_share_rise(tmp_path):
    long = ["--set", "path.stepover_mm=10.325", "--set", "process.chord_um=0.2"]  # 2e5 waypoints
    command = [sys.executable, "-m", "compgen", "generate", "paths/optic_spiral.toml", "-o", str(tmp_path), *long]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "100", "PYTHONUTF8": "1"}
    output = terminal_output(
        lambda terminal: subprocess.Popen(
            command, cwd=ROOT, stderr=terminal, stdout=subprocess.DEVNULL, env=environment
        )
    )
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", output.decode())
    frames = [f for f in re.split(r"[\r\n]+", text) if f.strip()]
    shares = [int(re.findall(r"(\d+) %", f)[0]) for f in frames]
    assert shares == sorted(shares)
    assert shares[-1] - shares[0] > 50
    assert all(f.split()[0] in {n.split()[0] for n in progress_bar.GENERATE} for f in frames)
    assert sum("waypoints/s" in f for f in frames) > len(frames) / 2
    left = [int(m[1]) for f in frames if (m := re.search(r"(\d+) s left", f))]
    assert left
    assert max(left) < 100
    assert "Traceback" not in text
