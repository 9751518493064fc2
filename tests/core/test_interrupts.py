"""Ctrl-C, SIGTERM and SIGKILL at moments that hurt: one line, the older output whole, nothing left lying about."""

import os
import signal
import subprocess
import sys
import time

import pytest
from forked import HANGS_S
from shipped import ROOT
from stopped import run_stopped, script

GENERATE = ["generate", str(ROOT / "paths" / "optic_spiral.toml"), "-q"]
LONG = ["--set", "path.stepover_mm=20.65", "--set", "process.chord_um=0.2", "--workers", "2"]  # 1e5 waypoints


def run(folder, *arguments, at=None, number=signal.SIGINT, cache=None):
    """A run that sends itself a signal when something happens: an audit event of Python's and a word in it."""
    call = [*GENERATE, "-o", folder / "out", *arguments]
    return run_stopped(call, at, number, XDG_CACHE_HOME=str(cache or folder / "cache"))


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def strays(folder):
    """What lies about beside whole results and whole libraries."""
    known = {"out", "cache", "cache/compgen", "cold", "cold/compgen"}
    names = {str(p.relative_to(folder)) for p in folder.rglob("*") if p.parent != folder / "out"}
    return {n for n in names if n not in known and not n.endswith(".so")}


@pytest.fixture(scope="module")
def older(tmp_path_factory):
    """A folder with an earlier result, and a cache with what the long program needs."""
    folder = tmp_path_factory.mktemp("stopped")
    assert run(folder, *LONG).returncode == 0
    assert run(folder, "--set", "path.stepover_mm=700").returncode == 0
    return folder, content(folder / "out")


MOMENTS = {
    "loading": ("import", "casadi", 1),
    "reading": ("open", "m710ic50.toml", 1),
    "compiling": ("subprocess.Popen", "c", 3),
    "early": ("ctypes.dlopen", ".so", 2),
    "beside": ("ctypes.dlopen", ".so", 9),
    "writing": ("open", "waypoints.csv", 1),
}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("moment", MOMENTS)
def test_a_stopped_run_says_one_line_and_leaves_everything_as_it_was(older, moment, number):
    folder, before = older
    cache = folder / "cold" if moment == "compiling" else None
    completed = run(folder, *LONG, at=MOMENTS[moment], number=number, cache=cache)
    word = "interrupted" if number == signal.SIGINT else "terminated"
    assert (completed.returncode, completed.stderr) == (128 + number, f"cgen: {word}; nothing was written\n")
    assert completed.stdout == ""
    assert content(folder / "out") == before
    assert not strays(folder)


def test_a_library_that_reports_exceptions_itself_is_left_first(tmp_path):
    """ipopt at work: the signal waits for the next iteration's progress, and CasADi has nothing to add."""
    code = """
import os, signal, sys
from compgen.compensation import nonlinear_program
of_ipopt = nonlinear_program._Iterations.eval
def eval_and_interrupt(self, values):
    os.kill(os.getpid(), signal.SIGINT)
    return of_ipopt(self, values)
nonlinear_program._Iterations.eval = eval_and_interrupt
from compgen.__main__ import main
main()
"""
    call = ["generate", "paths/line_y.toml", "-q", "--set", "compensation.solver=ipopt", "-o", str(tmp_path / "out")]
    completed = subprocess.run(
        [sys.executable, "-c", code, *call], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert (completed.returncode, completed.stderr) == (130, "cgen: interrupted; nothing was written\n")


def test_once_the_files_are_put_in_place_a_wish_comes_too_late(tmp_path, older):
    completed = run(tmp_path, *LONG, at=("os.rename", "compgen-", 1), cache=older[0] / "cache")
    assert (completed.returncode, completed.stderr) == (0, "")
    assert "report.json" in content(tmp_path / "out")
    assert not strays(tmp_path)


def test_what_a_killed_run_leaves_is_cleared_away_by_the_next(tmp_path):
    few = ("--set", "path.stepover_mm=200")
    for moment in ("compiling", "writing"):
        completed = run(tmp_path, *few, at=MOMENTS[moment], number=signal.SIGKILL)
        assert completed.returncode == -signal.SIGKILL
        assert any(word in name for name in strays(tmp_path) for word in ("rows.c", "out.compgen-"))
        assert not (tmp_path / "out").exists()
    assert run(tmp_path, *few).returncode == 0
    assert not strays(tmp_path)


def test_folders_made_for_nothing_go_again(tmp_path, older):
    deep, cache = str(tmp_path / "deep" / "er" / "out"), older[0] / "cache"
    completed = run(tmp_path, "--set", "path.stepover_mm=700", "-o", deep, at=MOMENTS["writing"], cache=cache)
    assert completed.returncode == 130
    assert not (tmp_path / "deep").exists()


def test_who_ignores_a_signal_is_not_stopped_by_it(tmp_path):
    """As nohup and a shell's background do."""
    code = (
        "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_IGN); os.execv(sys.executable, sys.argv[1:])"
    )
    inner = script(["generate", ROOT / "paths" / "line_y.toml", "-q", "-o", tmp_path / "out"], ("import", "casadi", 1))
    completed = subprocess.run(
        [sys.executable, "-c", code, sys.executable, "-c", inner], capture_output=True, check=False
    )
    assert (completed.returncode, completed.stderr) == (0, b"")
    assert (tmp_path / "out" / "report.json").exists()


def test_a_study_on_several_processes_stops_at_once_and_keeps_what_is_done(tmp_path):
    """A terminal sends Ctrl-C to all of them."""
    command = [sys.executable, "-m", "compgen", "whatif", "paths/circle_1300.toml", "--workers", "2", "-q"]
    command += ["--vary", "process.feed_mm_s=20:200:400", "-o", str(tmp_path / "out")]
    process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True, start_new_session=True)
    journal = tmp_path / "out" / "scenarios.jsonl"
    while not journal.exists() and process.poll() is None:
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    _, stderr = process.communicate(timeout=HANGS_S)
    assert (process.returncode, stderr) == (130, "cgen: interrupted; finished scenarios are kept\n")
    assert journal.read_bytes().count(b"\n") < 300  # at once: most of the 400 were still to be done


def test_a_signal_inside_a_callback_that_python_runs_by_itself_says_nothing_there_and_is_not_lost():
    code = """
import os, signal, weakref
from compgen.core import interrupts

class Lock: pass

interrupts.install_handlers()
interrupts.raise_on_signal()
lock = Lock()
kept = weakref.ref(lock, lambda _: os.kill(os.getpid(), signal.SIGINT))
other = Lock()
beside = weakref.ref(other, lambda _: 1 / 0)
del lock, other
try:
    interrupts.raise_if_interrupted()
except interrupts.Interrupted as stop:
    raise SystemExit(stop.code)
"""
    completed = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert completed.returncode == 130
    assert "ZeroDivisionError" in completed.stderr  # what is no interrupt is said as ever
    assert "Interrupted" not in completed.stderr
