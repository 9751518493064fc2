"""Files that are no regular ones are refused at once, by whoever reads them."""

import os
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest
from command_line import refused, run

from compgen.core.exceptions import InputError
from compgen.core.files import near_file, read_regular
from compgen.core.toml import read_toml
from compgen.program.frames import load_frames


@pytest.fixture
def pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    return tmp_path / "pipe.toml"


def test_a_regular_file_is_read_whole(tmp_path):
    (tmp_path / "a").write_bytes(b"\0\xff" * 70_000)
    assert read_regular(tmp_path / "a") == b"\0\xff" * 70_000
    assert read_regular(str(tmp_path / "a"), 140_000) == b"\0\xff" * 70_000


def test_what_may_never_end_or_cannot_be_held_is_refused(tmp_path, pipe):
    with open(tmp_path / "sparse", "wb") as file:
        file.truncate(1 << 36)
    for name, reason in ((pipe, "a pipe or a device"), ("/dev/zero", "a pipe or a device"), (tmp_path, "a folder")):
        with pytest.raises(OSError, match="it is") as caught:
            read_regular(name)
        assert reason in (caught.value.strerror or "")
    with pytest.raises(OSError, match="larger than 1 MB"):
        read_regular(tmp_path / "sparse", 1_000_000)


def test_a_file_of_the_system_that_would_be_waited_for_is_refused(tmp_path, monkeypatch):
    """As /proc/kmsg is: a regular file by its mode, and reading it finds nothing yet."""
    (tmp_path / "kmsg").write_bytes(b"")
    monkeypatch.setattr("builtins.open", lambda *a, **k: nullcontext(SimpleNamespace(read=lambda most: None)))
    with pytest.raises(OSError, match="it is a pipe or a device"):
        read_regular(tmp_path / "kmsg")


@pytest.mark.parametrize("read", [lambda f: read_toml(f, "paths"), lambda f: load_frames(str(f))])
def test_readers_of_tables_do_not_wait_for_a_pipe(pipe, read):
    with pytest.raises(InputError, match="cannot be read: it is a pipe or a device; give a"):
        read(pipe)


@pytest.mark.parametrize("command", ["check", "generate", "heat", "inspect", "correct", "pages"])
def test_commands_do_not_wait_for_a_pipe(tmp_path, pipe, command):
    where = [] if command in ("check", "inspect") else ["-o", tmp_path / "out"]
    refused(run(command, pipe, *where), 2, "pipe.toml: cannot be read: it is a pipe or a device; give a")
    assert not (tmp_path / "out").exists()


def test_neither_a_provenance_file_nor_a_journal_is_waited_for(tmp_path):
    program = tmp_path / "A.LS"
    program.write_bytes(b"/PROG A\n/MN\n/POS\n/END\n")
    os.mkfifo(tmp_path / "A.compgen.json")
    refused(run("correct", program, "--restore", "-o", tmp_path / "out"), 2, "A.compgen.json is not beside it")
    os.mkfifo(tmp_path / "scenarios.jsonl")
    varied = run("whatif", "paths/line_y.toml", "--vary", "feed=20,40", "--workers", 1, "-o", tmp_path)
    refused(varied, 2, "scenarios.jsonl: cannot be read: it is a pipe or a device")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("uframe = 3", "uframe: must be a table"),
        ("[uframe.1]\nx_mm = 0x" + "f" * 5000, "uframe.1.x_mm: a number of thousands of digits is not a length"),
        (f"[uframe.{'9' * 5000}]\nx_mm = 1", "a frame's number is 1 to 999"),
        ('["uframe"."\u00b2"]\nx_mm = 1', "a frame's number is 1 to 999"),
        ("[uframe.1]\nx_mm = " + "[" * 300 + "]" * 300, "uframe.1.x_mm: [[[...]]] is not a length"),
    ],
)
def test_frames_that_are_none_are_refused(tmp_path, text, words):
    (tmp_path / "f.toml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_frames(str(tmp_path / "f.toml"))
    assert words in str(caught.value), caught.value


def test_a_backup_with_endless_numbers_is_refused(tmp_path):
    entry = "".join(f"  {axis}: {'9' * 400}\n" for axis in "XYZWPR")
    (tmp_path / "sysframe.va").write_text(f"[*SYSTEM*]$MNUFRAME  Storage: CMOS\n     [1,1] =\n{entry}")
    with pytest.raises(InputError, match="a coordinate is beyond 100000"):
        load_frames(str(tmp_path / "sysframe.va"))


def test_a_pipe_is_not_written_over(pipe):
    refused(run("schema", "path", "-o", pipe), 2, "it is no regular file")
    assert pipe.is_fifo()


def test_keys_and_names_without_end_are_refused_before_any_work(tmp_path):
    deep = ".".join(["a"] * 3000) + "=1"
    for option in (
        ["check", "paths/line_y.toml", "--set", deep],
        ["check", "paths/line_y.toml", "--set", f"robot.{deep}"],
    ):
        refused(run(*option), 2, "a: nested more than 20 deep")
    varied = run("whatif", "paths/line_y.toml", "--vary", deep, "-o", tmp_path / "out")
    refused(varied, 2, "nested more than 20 deep")
    assert not (tmp_path / "out").exists()
    refused(run("check", "paths/line_y.toml", "--robot", "a" * 300), 2, "no robot has such a name")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "paths").mkdir()
    for name in ("paths/mirror.toml", "paths/lens.toml", "PART.LS", "notes.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "paths" / "mirrors.toml").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("paths/miror.toml", "paths/mirror.toml"),
        ("mirror.toml", "paths/mirror.toml"),
        ("mirror", "paths/mirror.toml"),
        ("paths/Mirror.TOML", "paths/mirror.toml"),
        ("paths/mirror.tom", "paths/mirror.toml"),
        ("part.ls", "PART.LS"),
        ("PART.L", "PART.LS"),
        ("nowhere/lens.toml", "paths/lens.toml"),
        ("paths/window.toml", None),
        ("a\0b.toml", None),
    ],
)
def test_the_nearest_file_of_the_kind(folder, name, near):
    assert near_file(Path(name), "paths") == near
