"""What all commands share, asked of each by one row of ``calls.CALLS``.

The record, silence, refusals in one line, whose files are replaced, the marker, the help, and that the same inputs give
the same bytes: here, and not again in the tests of each command.
"""

import json
import re
import signal
import subprocess
import sys
from hashlib import sha256
from typing import get_args

import pytest
from calls import CALLS, LINE, prepare
from command_line import ENVIRONMENT, refused, run, typed_commands
from shipped import ROOT

from compgen.cli.options import options
from compgen.cli.output_files import marker

COMMANDS = typed_commands()
LONGEST = 300  # characters of a refusal
NOT_THERE = {"schema": ("schema", "nothing"), "init": ("init", "\0"), "compare": ("compare", "not_there", "nor_this")}
NO_FILE = {"schema", "init"}  # whose argument is no file that is read
#: calls that print a record of several, or one that is no record of a command
OTHER_RECORDS = {"check many": "a list of reports", "schema": "a JSON Schema"}
#: calls whose -o names a file, beside which there is no marker
FILES = {"identify", "identify-motion", "teach-frame", "anchor", "export-robot"}
NEW_PAGES = {"resume", "follow"}  # which write into the folder that they are given
PLACED = [name for name, call in CALLS.items() if "-o" in call]


def option_of(command, name):
    return next((p for p in COMMANDS[command].params if name in p.opts), None)


def named(call, option):
    """What a call gives an option."""
    return call[call.index(option) + 1]


SHARING = [name for name, call in CALLS.items() if option_of(call[0], "--workers")]


def with_output(call, place):
    at = call.index("-o") + 1
    return (*call[:at], place, *call[at + 1 :])


def one_line(done, code=2):
    """A refusal: one line of few characters on stderr, and the same as the record."""
    refused(done, code)
    assert done.stderr.startswith("cgen: ")
    assert len(done.stderr) <= LONGEST + 1
    assert json.loads(done.stdout) == {"error": done.stderr.removeprefix("cgen: ").strip(), "exit_code": code}


def snapshot(folder):
    """All files below a folder but what was given."""
    files = (p for p in sorted(folder.rglob("*")) if p.is_file() and not {"paths", "robots"} & {*p.parts[-2:-1]})
    return {str(p.relative_to(folder)): p.read_bytes() for p in files}


@pytest.fixture(scope="module")
def called(tmp_path_factory):
    """A folder where every call was made with ``--json``, by one worker, what each came to, and the files it left."""
    folder = prepare(tmp_path_factory.mktemp("json"))
    one = {name: ("--workers", 1) * (name in SHARING) for name in CALLS}
    done = {name: run(*call, "--json", *one[name], cwd=folder) for name, call in CALLS.items()}
    return folder, done, snapshot(folder)


@pytest.fixture(scope="module")
def silent(tmp_path_factory):
    """The same in another folder, with ``--quiet`` and as many workers as there are cores."""
    folder = prepare(tmp_path_factory.mktemp("quiet"))
    done = {name: run(*call, "-q", cwd=folder) for name, call in CALLS.items()}
    return folder, done, snapshot(folder)


@pytest.fixture(scope="module")
def folder(called):
    """Where everything that a call needs is."""
    return called[0]


def test_every_command_has_a_row():
    assert {call[0] for call in CALLS.values()} == set(COMMANDS)


@pytest.mark.parametrize("name", CALLS)
def test_the_record_is_all_that_stands_on_stdout(called, name):
    done = called[1][name]
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("\n")
    record = json.loads(done.stdout)
    if name not in OTHER_RECORDS:
        assert record["command"] == CALLS[name][0]
    elif name == "check many":
        assert {one["report"]["command"] for one in record} == {"check"}
    else:
        assert record["$schema"]


@pytest.mark.parametrize("name", CALLS)
def test_quiet_says_nothing_but_what_is_asked_for(silent, name):
    done = silent[1][name]
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "" or name == "schema"


def test_the_same_inputs_leave_the_same_bytes(called, silent):
    one, other = called[2], silent[2]
    assert one.keys() == other.keys()
    assert [name for name in one if one[name] != other[name]] == []


@pytest.mark.parametrize("name", PLACED)
def test_the_marker_names_each_file_with_its_hash(folder, name):
    place = folder / named(CALLS[name], "-o")
    if name in FILES:
        assert place.is_file()
        assert not place.with_name(marker.NAME).exists()
        return
    (its,) = json.loads((place / marker.NAME).read_text())["runs"]
    there = {p.name: sha256(p.read_bytes()).hexdigest() for p in place.iterdir() if p.name != marker.NAME}
    assert there
    assert (its["command"], its["files"]) == (CALLS[name][0], there)


@pytest.mark.parametrize("name", PLACED)
def test_a_file_of_somebody_else_is_kept(folder, tmp_path, name):
    """Each file that a call writes, alone in a folder and not the command's own."""
    place = folder / named(CALLS[name], "-o")
    files = [p.name for p in place.iterdir()] if place.is_dir() else [place.name]
    kept = []
    for file in files:
        foreign = tmp_path / file.replace(".", "_")
        foreign.mkdir()
        (foreign / file).write_bytes(b"somebody's")
        done = run(*with_output(CALLS[name], foreign if place.is_dir() else foreign / file), "--json", cwd=folder)
        if snapshot(foreign) == {file: b"somebody's"}:
            one_line(done)
            assert foreign.name in done.stderr
            kept.append(file)
    assert kept == files


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_not_there_is_refused(tmp_path, command):
    one_line(run(*NOT_THERE.get(command, (command, "not_there.toml")), "--json", cwd=tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"\xff\xfe\x00[[{", b"", None], ids=["bytes", "nothing", "a folder"])
@pytest.mark.parametrize("name", [name for name, call in CALLS.items() if call[0] not in NO_FILE])
def test_what_cannot_be_read_is_refused(folder, tmp_path, name, content):
    call = CALLS[name]
    bad = tmp_path / ("bad.LS" if call[1].endswith(".LS") else "bad.toml")
    bad.mkdir() if content is None else bad.write_bytes(content)
    if name == "check many":  # each path for itself
        done = run("check", bad, LINE, "--json", cwd=folder)
        assert done.returncode == 2
        assert [one["exit_code"] for one in json.loads(done.stdout)] == [2, 0]
        return
    one_line(run(call[0], bad, *call[2:], "--json", cwd=folder))


@pytest.mark.parametrize("name", [name for name, call in CALLS.items() if option_of(call[0], "--set")])
def test_an_unknown_key_is_refused(folder, name):
    done = run(*CALLS[name], "--set", "no.such_key=1", "--json", cwd=folder)
    if name == "check many":
        assert {one["exit_code"] for one in json.loads(done.stdout)} == {2}
    else:
        one_line(done)
        assert "no" in done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_an_unknown_option_is_one_record_and_help_is_help(folder, command):
    one_line(run(command, "x", "--bogus", "--json", cwd=folder))
    done = run(command, "-h", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    assert "Example" in done.stdout


@pytest.mark.parametrize("name", SHARING)
def test_any_number_of_workers_gives_the_same(called, name):
    folder, one, three = called[0], called[1][name], (*CALLS[name], "--json", "--workers", 3)
    if name == "resume":  # it says what it has replaced: the second time nothing
        one = run(*three, "--workers", 1, cwd=folder)
    assert run(*three, cwd=folder).stdout == one.stdout


@pytest.mark.parametrize("command", sorted({CALLS[name][0] for name in SHARING}))
@pytest.mark.parametrize("value", ["-1", "257", "abc", "1.5", ""])
def test_a_number_of_workers_that_is_none_is_refused_alike(folder, command, value):
    one_line(run(command, "x", "--workers", value, "--json", cwd=folder))


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


@pytest.mark.parametrize("name", [name for name, call in CALLS.items() if "-o" in call])
@pytest.mark.parametrize("place", ["LINE_Y.LS/x", "", "a" * 300, "a\0b"], ids=["below a file", "none", "long", "zero"])
def test_a_place_that_cannot_be_written_to_is_refused_before_any_work(folder, name, place):
    (folder / "LINE_Y.LS").write_bytes(b"somebody's")
    call = [place if CALLS[name][n - 1] == "-o" else word for n, word in enumerate(CALLS[name])]
    one_line(run(*call, "--json", cwd=folder), 2)


def test_a_folder_may_have_any_name(folder):
    for name in ("with a space", "größe", "-dash", "quote'\"s"):
        done = run("generate", LINE, "-q", "-o", f"{name}/deep er", cwd=folder)
        assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
        assert (folder / name / "deep er" / "LINE_Y.LS").exists()


GRID = ("whatif", LINE, "--workers", "1", "--no-live", "--vary")
BOUNDED = {
    ("generate", LINE, "-o", "b"): (0.5, 2),
    ("generate", LINE, "-o", "b", "--set", "bounds.max_um=900"): (0.5, 2),
    ("predict", LINE, "-o", "bp"): (80, 100),
    ("check", LINE): (0.5, 2),
    ("check", LINE, "paths/line_z.toml"): (0.5, 2),
    ("correct", "plan/LINE_Y_PLAN.LS", "--before", "moving 200mm/s 6h", "-o", "bc"): (0.05, 5),
    ("offsets", LINE): (1, 200),
    ("heat", LINE, "--set", "cycle=[{state='moving', repeat=4, dwell_s=900}]", "-o", "bh"): (0.001, 500),
    (*GRID, "process.feed_mm_s=100,200", "-o", "bw"): (80, 100),
    (*GRID, "process.feed_mm_s=150,200", "--correct", "--fresh", "-o", "bv"): (0.5, 2),
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
    words = next(c for c in CALLS.values() if c[0] == command)
    unbounded = [word for n, word in enumerate(words) if word != "--max-um" and words[n - 1] != "--max-um"]
    refused(
        run(*unbounded, "--max-um", value, cwd=folder), 2, f"--max-um {float(value):.10g}: must be 0.001 to 1000000 um"
    )


NO_ROWS = "it reads and writes files; there is nothing to share out over cores"
NO_ERROR = "it computes no error on the part"
#: option, and the commands that do without it, each with its reason
WITHOUT = {
    "--json": {},
    "--quiet": {},
    "--workers": {
        name: NO_ROWS
        for name in (
            "inspect", "compare", "pages", "check-backup", "inspect-robot", "export-robot", "init", "schema",
            "teach-frame", "plan-motion-log", "explain",
        )
    },
    "--max-um": {
        **{name: NO_ERROR for name in ("inspect", "pages", "inspect-robot", "export-robot", "init", "schema")},
        "explain": NO_ERROR,
        "check-backup": "every digit counts",
        "anchor": "it judges a state, not a path: its verdict says whether the state can be used",
        "identify": "it judges a fit by what it was not fitted to; check-robot has a bound",
        "identify-motion": "it judges a fit by what it was not fitted to; executed has a bound",
        "plan-poses": "nothing is measured yet",
        "plan-motion-log": "nothing is logged yet",
        "plan-touches": "nothing is measured yet",
        "teach-frame": "it judges a frame by the touches' own noise",
    },
}  # fmt: skip
ANNOTATIONS = dict(zip(WITHOUT, (options.Json, options.Quiet, options.Workers, options.MaxUm), strict=True))


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", WITHOUT)
def test_every_command_has_the_option_or_a_reason(command, name):
    option = option_of(command, name)
    assert (option is None) == (command in WITHOUT[name])
    if option is None:
        return
    _, declared = get_args(ANNOTATIONS[name])
    assert option.help == declared.help
    assert set(option.opts) == {declared.default, *declared.param_decls}
    assert option.default in (None, False, 0)


def test_the_exceptions_are_commands():
    assert all(set(reasons) <= set(COMMANDS) for reasons in WITHOUT.values())


def test_the_page_says_what_max_um_bounds_for_every_command_that_has_it():
    page = (ROOT / "docs" / "cli.md").read_text()
    rows = dict(re.findall(r"^\| `([a-z-]+)` \| (.+) \|$", page, re.MULTILINE))
    assert list(rows) == [command for command in COMMANDS if option_of(command, "--max-um")]
