"""``--json``, ``-q``, ``--workers`` and ``--max-um`` at work: the same in every command that has them."""

import json
import signal
import subprocess
import sys

import pytest
from calls import CALLS, LINE, prepare
from command_line import ENVIRONMENT, refused, run
from shipped import ROOT
from typer.main import get_command

from compgen.cli.app import app

COMMANDS = get_command(app).commands
MEASURED = {"anchor", "executed", "follow", "identify", "identify-motion", "teach-frame", "validate"}  # in their tests
NOT_THERE = {"schema": ("schema", "nothing"), "init": ("init", "\0"), "compare": ("compare", "not_there", "nor_this")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return prepare(tmp_path_factory.mktemp("calls"))


def test_every_command_is_called_here_or_needs_a_measurement():
    assert {call[0] for call in CALLS.values()} | MEASURED == set(COMMANDS)


@pytest.mark.parametrize("name", CALLS)
def test_the_record_is_all_that_stands_on_stdout(folder, name):
    done = run(*CALLS[name], "--json", cwd=folder)
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record
    if name == "check many":
        assert {one["report"]["command"] for one in record} == {"check"}
    elif name != "schema":  # whose record is a JSON Schema
        assert record["command"] == CALLS[name][0]
    assert done.stdout.endswith("\n")
    assert done.stderr == ""


@pytest.mark.parametrize("name", CALLS)
def test_quiet_says_nothing_but_what_is_asked_for(folder, name):
    done = run(*CALLS[name], "-q", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "" or name == "schema"


@pytest.mark.parametrize("command", COMMANDS)
def test_a_refusal_is_json_too(tmp_path, command):
    arguments = NOT_THERE.get(command, (command, "not_there.toml"))
    done = run(*arguments, "--json", cwd=tmp_path)
    refused(done, 2)
    record = json.loads(done.stdout)
    assert record["exit_code"] == 2
    assert done.stderr == f"cgen: {record['error']}\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("more", [(), ("--json",)])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
def test_a_run_that_is_stopped_before_it_has_begun_to_write_leaves_one_record(name, more):
    """The signal comes in the middle of the work, for which the command line's own module stands in here."""
    number = getattr(signal, name)
    script = (
        "import os, sys, types\n"
        f"work = types.SimpleNamespace(main=lambda: os.kill(os.getpid(), {int(number)}))\n"
        "sys.modules['compgen.cli.main'] = work\n"
        f"sys.argv = ['cgen', 'check', 'some.toml', *{more!r}]\n"
        "from compgen.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], env=ENVIRONMENT, cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 128 + number
    message = done.stderr.removeprefix("cgen: ").strip()
    assert message.endswith("ed; nothing was written")
    assert (json.loads(done.stdout) if more else done.stdout) == (
        {"error": message, "exit_code": 128 + number} if more else ""
    )


SHARING = [n for n, c in CALLS.items() if any("--workers" in p.opts for p in COMMANDS[c[0]].params)]


@pytest.mark.parametrize("name", SHARING)
def test_any_number_of_workers_gives_the_same(folder, name):
    one, three = (run(*CALLS[name], "--json", "--workers", n, cwd=folder) for n in (1, 3))
    assert one.returncode == 0, one.stderr
    assert one.stdout == three.stdout


def one_record(result, code):
    refused(result, code)
    assert json.loads(result.stdout) == {"error": result.stderr.removeprefix("cgen: ").strip(), "exit_code": code}


@pytest.mark.parametrize("command", sorted({CALLS[name][0] for name in SHARING}))
@pytest.mark.parametrize("value", ["-1", "257", "abc", "1.5", ""])
def test_a_number_of_workers_that_is_none_is_refused_alike(folder, command, value):
    one_record(run(command, "x", "--workers", value, "--json", cwd=folder), 2)


@pytest.mark.parametrize("command", COMMANDS)
def test_wrong_use_is_one_record_and_help_is_help(folder, command):
    one_record(run(command, "x", "--bogus", "--json", cwd=folder), 2)
    assert "Example" in run(command, "-h", cwd=folder).stdout


@pytest.mark.parametrize("name", [name for name, call in CALLS.items() if "-o" in call and call[0] != "pages"])
@pytest.mark.parametrize("place", ["LINE_Y.LS/x", "", "a" * 300, "a\0b"], ids=["below a file", "none", "long", "zero"])
def test_a_place_that_cannot_be_written_to_is_refused_before_any_work(folder, name, place):
    (folder / "LINE_Y.LS").write_bytes(b"somebody's")
    call = [place if CALLS[name][n - 1] == "-o" else word for n, word in enumerate(CALLS[name])]
    one_record(run(*call, "--json", cwd=folder), 2)


def test_a_folder_may_have_any_name(folder):
    for name in ("with a space", "größe", "-dash", "quote'\"s"):
        done = run("generate", LINE, "-q", "-o", f"{name}/deep er", cwd=folder)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        assert (folder / name / "deep er" / "LINE_Y.LS").exists()


BOUNDED = {
    ("generate", LINE, "-o", "b"): (0.5, 2),
    ("generate", LINE, "-o", "b", "--set", "bounds.max_um=900"): (0.5, 2),
    ("predict", LINE, "-o", "bp"): (80, 100),
    ("check", LINE): (0.5, 2),
    ("check", LINE, "paths/line_z.toml"): (0.5, 2),
    ("correct", "plan/LINE_Y_PLAN.LS", "--before", "moving 200mm/s 6h", "-o", "bc"): (0.05, 5),
    ("offsets", LINE): (1, 200),
    ("heat", LINE, "--set", "cycle=[{state='moving', repeat=4, dwell_s=900}]", "-o", "bh"): (0.001, 500),
    ("whatif", LINE, "--vary", "process.feed_mm_s=100,200", "--workers", "1", "-o", "bw"): (80, 100),
    ("whatif", LINE, "--vary", "process.feed_mm_s=150,200", "--correct", "--workers", "1", "--fresh", "-o", "bv"):
        (0.5, 2),
    ("resume", "paged", "--from-page", "2", "--late", "65min", "--date", "2026-01-31"): (0.1, 5),
    ("compare", "made", "again"): (0.1, 5),
}  # fmt: skip


@pytest.mark.parametrize("call", BOUNDED, ids=[" ".join(c[:2]) for c in BOUNDED])
def test_an_error_beyond_max_um_is_exit_1_and_within_it_0(folder, call):
    less, more = BOUNDED[call]
    outside = run(*call, "--max-um", less, "--json", cwd=folder)
    assert outside.returncode == 1, outside.stderr
    assert json.loads(outside.stdout)
    assert outside.stderr.startswith("cgen: ")
    inside = run(*call, "--max-um", more, "--json", cwd=folder)
    assert (inside.returncode, inside.stderr) == (0, "")


@pytest.mark.parametrize("command", [c for c in COMMANDS if any("--max-um" in p.opts for p in COMMANDS[c].params)])
@pytest.mark.parametrize("value", ["0", "nan", "1e7", "-1", "inf"])
def test_a_bound_that_is_none_is_refused_alike(folder, command, value):
    call = next((c for c in CALLS.values() if c[0] == command), None)
    if call is None:
        pytest.skip("it needs a measurement")
    call = [word for n, word in enumerate(call) if word != "--max-um" and call[n - 1] != "--max-um"]
    refused(run(*call, "--max-um", value, cwd=folder), 2, f"--max-um {float(value):g}: must be 0.001 to 1e+06 um")
