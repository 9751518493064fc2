"""Output that no terminal shows: whole lines, no colours, and a reader that leaves early changes nothing."""

import os
import re
import subprocess
import sys

import pytest
from calls import CALLS, LINE, prepare
from command_line import ENVIRONMENT, run, terminal_output
from forked import code_of, run_forked

TWICE = {"init", "resume"}  # which say what they have found done


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return prepare(tmp_path_factory.mktemp("calls"))


@pytest.mark.parametrize("name", [*CALLS, "help", "help of one"])
def test_nothing_is_wrapped_and_nothing_is_coloured(folder, name, monkeypatch):
    call = CALLS.get(name, ("check", "--help") if name == "help of one" else ("--help",))
    monkeypatch.setenv("COLUMNS", "300")
    if name in TWICE:
        run(*call, cwd=folder)
    wide = run(*call, cwd=folder)
    for variable, value in (("COLUMNS", "40"), ("FORCE_COLOR", "1"), ("TTY_COMPATIBLE", "1"), ("TERM", "dumb")):
        monkeypatch.setenv(variable, value)
    narrow = run(*call, cwd=folder)
    assert wide.returncode == narrow.returncode == 0
    strip = re.compile(r"│ +[\d.]+ │$", re.MULTILINE) if name == "check many" else re.compile("$^")  # seconds
    assert strip.sub("", narrow.stdout) == strip.sub("", wide.stdout)
    assert "\x1b" not in narrow.stdout + narrow.stderr
    assert not [line for line in narrow.stdout.splitlines() if line != line.rstrip()]


def test_a_title_wider_than_its_table_is_one_line(folder):
    title = "a title of many words " * 10
    done = run("check", LINE, "--set", f"title={title!r}", cwd=folder)
    assert done.stdout.splitlines()[0] == title.rstrip()


@pytest.mark.parametrize("name", CALLS)
def test_a_reader_that_leaves_at_once_changes_nothing(folder, name):
    reading, writing = os.pipe()
    os.close(reading)
    done = run_forked(code_of(CALLS[name]), cwd=folder, stdout=writing)
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_exit_code_of_a_verdict_outlives_its_reader(folder):
    script = f"{sys.executable} -m compgen check {LINE} --max-um 0.5 | head -1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "--norc", "-c", script], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert done.stdout.count("\n") == 1
    assert done.stderr.count("\n") == 1
    assert "outside bounds" in done.stderr


def test_files_are_whole_though_nobody_reads_what_is_said(folder):
    script = f"{sys.executable} -m compgen generate {LINE} -o unread 2>&1 | true"
    subprocess.run(["bash", "--norc", "-c", script], cwd=folder, env=ENVIRONMENT, check=True)
    read, unread = ({f.name: f.read_bytes() for f in (folder / name).iterdir()} for name in ("made", "unread"))
    assert unread == read


def test_a_stream_that_is_closed_is_no_fault(folder):
    script = f"{sys.executable} -m compgen check {LINE} >&- 2>&-"
    assert subprocess.run(["bash", "--norc", "-c", script], cwd=folder, env=ENVIRONMENT, check=False).returncode == 0


@pytest.mark.parametrize("variables", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_a_terminal_without_colours_gets_none(folder, variables):
    environment = {**ENVIRONMENT, "TERM": "xterm", **variables}
    call = [sys.executable, "-m", "compgen", "check", LINE]
    output = terminal_output(
        lambda terminal: subprocess.Popen(call, cwd=folder, env=environment, stdout=terminal, stderr=terminal)
    )
    codes = {int(code) for style in re.findall(rb"\x1b\[([0-9;]*)m", output) for code in style.split(b";") if code}
    assert not {code for code in codes if 30 <= code <= 49 or 90 <= code <= 107}
    assert b"TCP error, um" in output


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is full")
@pytest.mark.parametrize("more", [(), ("paths/line_z.toml",), ("--json",)])
def test_an_output_that_is_full_is_refused(folder, more):
    with open("/dev/full", "wb") as full:
        done = run_forked(code_of(["check", LINE, *more]), cwd=folder, stdout=full.fileno())
    assert done.returncode == 2
    assert done.stderr == "cgen: output: cannot be written: No space left on device; see where it goes\n"
