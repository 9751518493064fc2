"""Whole outputs, and nothing of anybody else's touched."""

import json
import os
import platform
import signal
import subprocess
import sys
import threading
from hashlib import sha256
from pathlib import Path

import pytest
from forked import run_forked
from shipped import ROOT

from compgen.cli.output_files import publish
from compgen.cli.output_files.publish import alone_in
from compgen.core.exceptions import InputError

OURS = {"A.LS", "page.html", "report.json"}
PROGRAMS, REPORTS = {"A.LS": b"new program"}, {"page.html": b"new page", "report.json": b"new report"}
FILES = {**PROGRAMS, **REPORTS}


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in Path(folder).rglob("*") if p.is_file()}


def test_a_new_folder_appears_whole(tmp_path):
    publish.publish(tmp_path / "deep" / "out", PROGRAMS, REPORTS, OURS)
    assert content(tmp_path) == {f"deep/out/{n}": c for n, c in FILES.items()}


def test_an_earlier_run_is_replaced_as_a_whole(tmp_path):
    publish.publish(tmp_path / "out", {"A.LS": b"old"}, {"report.json": b"old"}, OURS)
    publish.publish(tmp_path / "out", {}, {"report.json": b"new"}, OURS)
    assert content(tmp_path) == {"out/report.json": b"new"}


def test_foreign_files_and_folders_stay_where_they_are(tmp_path):
    out = tmp_path / "out"
    (out / "data" / "deep").mkdir(parents=True)
    (out / "data" / "deep" / "x").write_text("x")
    (out / "B.LS").write_text("another program")
    (out / "data").chmod(0o555)
    inode, deep = out.stat().st_ino, (out / "data").stat().st_ino
    publish.publish(out, PROGRAMS, REPORTS, OURS)
    assert (out.stat().st_ino, (out / "data").stat().st_ino) == (inode, deep)
    assert content(out) == {**FILES, "B.LS": b"another program", "data/deep/x": b"x"}
    assert [p.name for p in tmp_path.iterdir()] == ["out"]
    (out / "data").chmod(0o755)


def test_the_folder_one_stands_in_is_not_moved(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    inode = tmp_path.stat().st_ino
    publish.publish(Path("."), PROGRAMS, REPORTS, OURS)
    publish.publish(Path("."), PROGRAMS, REPORTS, OURS)
    assert tmp_path.stat().st_ino == inode
    assert content(tmp_path) == FILES


def test_a_folder_named_like_a_file_of_ours_is_refused(tmp_path):
    (tmp_path / "A.LS" / "keep").mkdir(parents=True)
    with pytest.raises(InputError, match="is a folder"):
        publish.publish(tmp_path, PROGRAMS, REPORTS, OURS)
    assert [p.name for p in tmp_path.iterdir()] == ["A.LS"]


def test_left_overs_of_killed_runs_are_removed_and_never_brought_back(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    out = tmp_path / "o[1]"
    for process in (dead.pid, os.getpid()):
        stage = tmp_path / f".o[1].compgen-{platform.node()}-{process}-abc"
        stage.mkdir()
        (stage / "B.LS").write_text("never published")
    alive = tmp_path / f".o[1].compgen-{platform.node()}-1-abc"
    alive.mkdir()
    publish.publish(out, PROGRAMS, REPORTS, OURS)
    publish.publish(out, PROGRAMS, REPORTS, OURS)
    assert content(out) == FILES
    assert {p.name for p in tmp_path.iterdir()} == {"o[1]", alive.name}


@pytest.mark.parametrize("machine", ["elsewhere", f"{platform.node()}-2", f"{platform.node()}-7-8", ""])
def test_left_overs_of_other_machines_stay(tmp_path, machine):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    name = f"{machine}-{dead.pid}-0123456789abcdef" if machine else f"{dead.pid}-01234567"
    for stage in (tmp_path / f".out.compgen-{name}", tmp_path / "out" / f".compgen-{name}"):
        stage.mkdir(parents=True)
        (stage / "A.LS").write_text("of a run that goes on elsewhere")
    publish.publish(tmp_path / "out", PROGRAMS, REPORTS, OURS)
    assert len([f for f in content(tmp_path) if "compgen-" in f]) == 2


def test_several_programs_begin_without_their_main_program(tmp_path, monkeypatch):
    publish.publish(tmp_path, {"B.LS": b"old", "A.LS": b"old"}, {}, OURS | {"B.LS", "C.LS"})
    (tmp_path / "mine").write_text("mine")
    replaced: list[dict[str, bytes]] = []

    def watched_replace(self, to):
        replaced.append(content(tmp_path))
        os.rename(self, to)

    monkeypatch.setattr(Path, "replace", watched_replace)
    publish.publish(tmp_path, {"C.LS": b"new", "A.LS": b"new"}, {}, OURS | {"B.LS", "C.LS"}, "A.pages.json")
    assert [sorted(n for n in files if n.endswith(".LS") and "/" not in n) for files in replaced] == [[], ["C.LS"]]


def test_runs_on_the_same_folder_put_their_files_there_one_after_the_other(tmp_path, monkeypatch):
    """Else the pages of one stand beside the main program of another."""
    (tmp_path / "mine").write_text("mine")
    publish.publish(tmp_path, {"P_01.LS": b"old", "P_02.LS": b"old", "P.LS": b"old"}, {})
    replace_files = publish.replace_files
    second: list[threading.Thread] = []

    def interrupted_by_another(*arguments, **how):
        if not second:
            new = {"P_01.LS": b"second", "P.LS": b"second"}
            second.append(threading.Thread(target=publish.publish, args=(tmp_path, new, {}, {*new, "P_02.LS"})))
            second[0].start()
            second[0].join(0.3)
            assert second[0].is_alive()
        replace_files(*arguments, **how)

    monkeypatch.setattr(publish, "replace_files", interrupted_by_another)
    first = {"P_01.LS": b"first", "P_02.LS": b"first", "P.LS": b"first"}
    publish.publish(tmp_path, first, {}, {*first})
    second[0].join()
    assert content(tmp_path) == {"mine": b"mine", "P_01.LS": b"second", "P.LS": b"second"}


def test_pages_that_another_run_has_written_meanwhile_go_with_its_manifest(tmp_path):
    def manifest(*pages):
        record = {"main": entry("P.LS"), "pages": [entry(page) for page in pages]}
        return json.dumps(record).encode()

    def entry(name):
        return {"file": name, "sha256": sha256(name.encode()).hexdigest()}

    def files(*pages):
        return {**{name: name.encode() for name in (*pages, "P.LS")}, "P.pages.json": manifest(*pages)}

    (tmp_path / "mine").write_text("mine")
    publish.publish(tmp_path, files("P_01.LS", "P_02.LS"), {}, (), "P.pages.json")
    publish.publish(tmp_path, files("P_01.LS"), {}, (), "P.pages.json")
    assert set(content(tmp_path)) == {"mine", "P.LS", "P_01.LS", "P.pages.json"}


def test_a_folder_that_has_lost_its_name_is_locked_again_under_it(tmp_path, monkeypatch):
    out, away = tmp_path / "out", tmp_path / "away"
    out.mkdir()
    locks = []

    def flock(handle, how):
        locks.append(os.fstat(handle).st_ino)
        if len(locks) == 1:  # another run puts its folder there while this one waits
            out.rename(away)
            out.mkdir()

    monkeypatch.setattr("compgen.cli.output_files.publish.fcntl.flock", flock)
    with alone_in(out):
        assert locks == [away.stat().st_ino, out.stat().st_ino]


def test_the_pages_of_two_runs_never_stand_together(tmp_path, monkeypatch):
    """Nor the older ones under the newer manifest, which would not know them: the next run would be refused."""
    pages = ("P.pages.json", "P_01.LS", "P_02.LS", "P_03.LS", "P.LS")
    publish.publish(tmp_path, dict.fromkeys(pages, b"old"), {})
    (tmp_path / "mine").write_text("mine")
    states = []
    for name in ("replace", "unlink"):
        step = getattr(Path, name)

        def recorded(self, *arguments, step=step, **how):
            states.append({n: c for n, c in content(tmp_path).items() if "/" not in n and n != "mine"})
            return step(self, *arguments, **how)

        monkeypatch.setattr(Path, name, recorded)
    publish.publish(tmp_path, dict.fromkeys((*pages[:3], "P.LS"), b"new"), {}, {*pages}, "P.pages.json")
    assert len(states) > 6
    for state in states:
        assert len({c for n, c in state.items() if n.endswith(".LS")}) <= 1
        is_old = b"old" in {c for n, c in state.items() if n.endswith(".LS")}
        assert not is_old or state["P.pages.json"] == b"old"


def test_one_file_follows_no_link(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (tmp_path / ".r.html.part").symlink_to(victim)
    (tmp_path / "r.html").symlink_to(victim)
    publish.write_file(tmp_path / "r.html", b"page")
    assert victim.read_text() == "mine"
    assert (tmp_path / "r.html").read_bytes() == b"page"
    assert not (tmp_path / "r.html").is_symlink()


def test_what_a_killed_run_left_of_one_file_goes_with_the_next(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for name in (f".r.html.compgen-{platform.node()}-{dead.pid}-0", f".r.html.compgen-elsewhere-{dead.pid}-0"):
        (tmp_path / name).write_text("half")
    publish.write_file(tmp_path / "r.html", b"page")
    assert sorted(p.name for p in tmp_path.iterdir()) == [f".r.html.compgen-elsewhere-{dead.pid}-0", "r.html"]


def test_a_hidden_folder_with_a_folder_in_it_is_left_alone(tmp_path):
    stage = tmp_path / f".out.compgen-{platform.node()}-{os.getpid()}-abc"
    (stage / "data").mkdir(parents=True)
    publish.publish(tmp_path / "out", PROGRAMS, REPORTS, OURS)
    assert (stage / "data").is_dir()


KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, {root!r})
from compgen.cli.output_files import publish
count = 0
def count_down(event, args):
    global count
    if event in ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.fsync", "ctypes.dlsym"):
        count += 1
        if count == {step}:
            os.kill(os.getpid(), signal.SIGKILL)
import ctypes
sys.addaudithook(count_down)
publish.publish(Path({out!r}), {programs!r}, {reports!r}, {ours!r})
"""


@pytest.mark.parametrize("foreign", [False, True])
def test_killed_at_every_step_no_program_stands_beside_a_report_of_another(tmp_path, foreign):
    old_program, old_reports = {"A.LS": b"old program"}, {"page.html": b"old page", "report.json": b"old report"}
    steps = 0
    for step in range(1, 60):
        out = tmp_path / f"{foreign}{step}"
        publish.publish(out, old_program, old_reports, OURS)
        if foreign:
            (out / "mine").write_text("mine")
        code = KILLED.format(root=str(ROOT), step=step, out=str(out), programs=PROGRAMS, reports=REPORTS, ours=OURS)
        killed = run_forked(code).returncode == -signal.SIGKILL
        files = {n: c for n, c in content(out).items() if n in OURS}
        if foreign:
            assert (out / "mine").read_text() == "mine"
            assert "A.LS" in files, step  # the old program or the new one
            assert len({text.split()[0] for text in files.values()}) == 1, (step, files)
        else:
            assert files in ({**old_program, **old_reports}, FILES)
        publish.publish(out, PROGRAMS, REPORTS, OURS)
        assert {n: c for n, c in content(out).items() if n in OURS} == FILES
        assert not [p for p in tmp_path.iterdir() if p.name.startswith(".")]
        if not killed:
            break
        steps += 1
    assert steps > 5
    assert not killed


@pytest.mark.parametrize("name", ["x" * 300, "a/b\0c"])
def test_names_no_file_system_takes_are_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"cannot be written: .*; give another folder$"):
        publish.check_writable(tmp_path / name)


def test_a_broken_link_is_refused(tmp_path):
    (tmp_path / "out").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="broken link"):
        publish.check_writable(tmp_path / "out")
