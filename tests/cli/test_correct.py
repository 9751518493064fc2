"""``cgen correct`` as a user meets it: files, exit codes, one-line refusals, the folder untouched on error."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from command_line import ENVIRONMENT, refused, run
from corrected import HOME, ROUNDED_UM, left
from ls_text import at, cartesian, joint_form, program
from shipped import ROOT

ROBOT = ROOT / "robots" / "m710ic50.toml"
BEFORE = ("--before", "moving 200mm/s 6h")


@pytest.fixture
def here(tmp_path):
    """A folder with a program in it, and one with an earlier result."""
    (tmp_path / "PART.LS").write_bytes(part())
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    return tmp_path


def part(count=8, **how):
    rng = np.random.default_rng(2)
    q = np.array(HOME) + rng.uniform(-15, 15, (count, 6))
    return program(
        [f"J P[{n}] 10% FINE" for n in range(1, count + 1)],
        [at(n, row) for n, row in enumerate(q, 1)],
        name="PART",
        **how,
    )


def correct(folder, *more, name="PART.LS"):
    return run("correct", folder / name, "-o", folder / "out", *more)


def untouched(folder):
    return [p.name for p in (folder / "out").iterdir()] == ["notes.txt"]


def robot_file(folder, *changes):
    text = ROBOT.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "arm.toml").write_text(text)
    return folder / "arm.toml"


def test_the_whole_set_is_written_and_the_program_keeps_its_name(here):
    result = correct(here, *BEFORE)
    assert result.returncode == 0, result.stderr
    assert {p.name for p in (here / "out").iterdir()} == {
        "PART.LS", "PART.compgen.json", "report.json", "report.html", "positions.csv", "notes.txt"
    }  # fmt: skip
    assert (here / "PART.LS").read_bytes() == part()
    text = (here / "out" / "PART.LS").read_bytes()
    assert left(part(), text, 1, HOME) < ROUNDED_UM
    data = json.loads((here / "out" / "report.json").read_text())
    assert data["positions"] == {"corrected": 8, "new": 0, "unchanged": 0}
    assert data["verdict"] == "inside"
    assert data["after"]["total"]["max_um"] < 1.1 < 30 < data["before"]["total"]["max_um"]
    rows = (here / "out" / "positions.csv").read_text().splitlines()
    assert len(rows) == 9
    assert all(row.count(",") == rows[0].count(",") for row in rows)
    page = (here / "out" / "report.html").read_text()
    assert "8 positions corrected" in page
    assert ">nan" not in page
    assert "8 positions corrected" in result.stdout


def test_json_is_the_report_and_quiet_is_quiet(here):
    result = correct(here, "--json")
    assert json.loads(result.stdout) == json.loads((here / "out" / "report.json").read_text())
    result = correct(here, "-q")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_two_runs_give_the_same_bytes(here):
    def files():
        assert correct(here, *BEFORE, "--split", "--insert", "5").returncode == 0
        return {p.name: p.read_bytes() for p in (here / "out").iterdir()}

    assert files() == files()


def test_no_error_no_change(here):
    assert correct(here, "--set", "thermal.cte_um_m_K=0", "-q").returncode == 0
    assert (here / "out" / "PART.LS").read_bytes() == part()


def test_restore_gives_the_planned_program_back(here):
    assert correct(here, *BEFORE, "-q").returncode == 0
    result = run("correct", here / "out" / "PART.LS", "--restore", "-o", here / "back")
    assert result.returncode == 0, result.stderr
    assert (here / "back" / "PART.LS").read_bytes() == part()


def test_restore_refuses_what_does_not_belong_together(here):
    alone = run("correct", here / "PART.LS", "--restore", "-o", here / "out")
    refused(alone, 2, "PART.compgen.json is not beside it")
    assert untouched(here)
    assert correct(here, *BEFORE, "-q").returncode == 0
    provenance = here / "out" / "PART.compgen.json"
    shutil.copy(provenance, here)
    refused(run("correct", here / "PART.LS", "--restore", "-o", here / "b"), 2, "another program")
    provenance.write_bytes(provenance.read_bytes()[:-200])
    refused(run("correct", here / "out" / "PART.LS", "--restore", "-o", here / "b"), 2, "PART.compgen.json")
    assert not (here / "b").exists()


def test_a_corrected_program_is_refused_in_its_place_and_elsewhere(here):
    assert correct(here, *BEFORE, "-q").returncode == 0
    shutil.copy(here / "out" / "PART.LS", here / "COPY.LS")
    for program_file in (here / "out" / "PART.LS", here / "COPY.LS"):
        result = run("correct", program_file, "-o", here / "second")
        refused(result, 2, program_file.name, "mark", "--restore", "--again")
        assert not (here / "second").exists()
    assert run("correct", here / "COPY.LS", "--again", "-q", "-o", here / "second").returncode == 0


def test_a_program_too_small_for_the_mark_is_known_by_its_provenance(here):
    (here / "ONE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME)]))
    assert correct(here, *BEFORE, "-q", name="ONE.LS").returncode == 0
    refused(run("correct", here / "out" / "ONE.LS", "-o", here / "second"), 2, "mark", "ONE.compgen.json")
    (here / "out" / "ONE.LS").rename(here / "out" / "TWO.LS")
    refused(run("correct", here / "out" / "TWO.LS", "-o", here / "second"), 2, "mark", "ONE.compgen.json")


CONTROLLERS = [
    ([('compensation = "none"', 'compensation = "unknown"')], ("controller.compensation", "'none' or 'signature'")),
    ([('compensation = "none"', 'compensation = "signature"')], ("controller.signature", "missing")),
    (
        [('compensation = "none"', 'compensation = "signature"\nsignature = "S-2"\nidentified_with = "S-1"')],
        ("controller.identified_with", "S-1", "S-2", "identify again"),
    ),
    ([('compensation = "none"', 'compensation = "signature"\nsignature = "S-2"')], ("identified_with", "S-2")),
    ([('compensation = "none"', 'compensation = "none"\nidentified_with = "S-1"')], ("identified_with", "S-1")),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), CONTROLLERS, ids=lambda v: v[0] if isinstance(v, tuple) else None)
def test_a_controller_that_corrects_itself_otherwise_is_refused(changes, words, here):
    result = correct(here, "--robot", robot_file(here, *changes))
    refused(result, 2, "arm.toml", *words)
    assert untouched(here)


def test_a_matching_signature_is_taken_and_said(here):
    arm = robot_file(
        here, ('compensation = "none"', 'compensation = "signature"\nsignature = "S-1"\nidentified_with = "S-1"')
    )
    result = correct(here, "--robot", arm, *BEFORE)
    assert result.returncode == 0, result.stderr
    assert "S-1" in result.stdout


GOOD = part().decode()
BAD_PROGRAMS = {
    "binary": (b"\x00\x01TP\x00\x00" * 50, ("binary", ".TP")),
    "not a program": (b"hello\n", ("/PROG",)),
    "empty": (b"", ("/PROG",)),
    "translated": (GOOD.replace("/ATTR\n", "/ATTR\nKOMMENTAR = \"x\";\n").encode(), ("language", "English")),
    "cut off": (GOOD[: GOOD.index("/END") - 90].encode(), ("/END", "cut off")),
    "used but undefined": (GOOD.replace("J P[3] ", "J P[33] ").encode(), ("P[33]", "not defined", "line ")),
    "defined twice": (GOOD.replace("P[3]{", "P[2]{").encode(), ("P[2]", "twice", "line ")),
    "no motion group": (GOOD.replace("/MN", "DEFAULT_GROUP = *,*,*;\n/MN").encode(), ("DEFAULT_GROUP", "group")),
    "no such frame": (GOOD.replace("UF : 0", "UF : 31", 1).encode(), ("uframe 31", "line ", "--frames")),
    "huge position number": (GOOD.replace("P[3]{", "P[" + "9" * 30 + "]{").encode(), ("line ",)),
    "huge frame number": (GOOD.replace("UF : 0", "UF : " + "9" * 30, 1).encode(), ("line ",)),
    "number of 400 digits": (GOOD.replace("X = ", "X = " + "9" * 400, 1).encode(), ("line ",)),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD_PROGRAMS)
def test_a_bad_program_is_refused_in_one_line_and_nothing_is_written(kind, here):
    data, words = BAD_PROGRAMS[kind]
    (here / "BAD.LS").write_bytes(data)
    refused(correct(here, name="BAD.LS"), 2, "BAD.LS", *words)
    assert untouched(here)


LISTED = {
    "CONFIG empty": (GOOD.replace("N U T, 0, 0, 0", "", 1), "CONFIG"),
    "UF : F": (GOOD.replace("UF : 0", "UF : F", 1), "UF : F"),
    "untaught": (program(["J P[1] 10% FINE"], [cartesian(1, ("********",) * 6)]).decode(), "****"),
    "PR target": (GOOD.replace("J P[3]", "J PR[3]"), "PR[3]"),
    "out of reach": (program(["J P[1] 10% FINE"], [cartesian(1, (9000, 0, 0, 0, 0, 0))]).decode(), "out of reach"),
    "beyond a limit": (program(["J P[1] 9% FINE"], [joint_form(1, (0, 0, 0, 0, 126, 0))]).decode(), "beyond its limit"),
    "number overflow": (GOOD.replace("W = ", "W = 99999999999", 1), "more digits"),
}  # fmt: skip


@pytest.mark.parametrize("kind", LISTED)
def test_what_cannot_be_corrected_is_listed_and_strict_refuses_it(kind, here):
    text, words = LISTED[kind]
    (here / "ODD.LS").write_text(text)
    result = correct(here, "--strict", name="ODD.LS")
    refused(result, 2, "ODD.LS", "line ", words, "--strict")
    assert untouched(here)
    result = correct(here, name="ODD.LS")
    assert result.returncode == 0, result.stderr
    assert any(
        words in u["text"] + u["reason"] for u in json.loads((here / "out" / "report.json").read_text())["unsafe"]
    )
    assert words in " ".join(result.stdout.split())


ARGUMENTS = [
    (("--frames", "no.toml"), ("no.toml", "cannot be read")),
    (("--frames", "README.md"), ("README.md", "not TOML")),
    (("--frames", "pyproject.toml"), ("pyproject.toml", "unknown key")),
    (("--robot", "kuka"), ("kuka",)),
    (("--robot", ""), ("--robot",)),
    (("--before", "moving 200 5h"), ("--before", "unit")),
    (("--before", "moving 200mm/s"), ("--before",)),
    (("--before", "moving -200mm/s 5h"), ("--before",)),
    (("--before", "flying 1h"), ("--before",)),
    (("--before", "moving nanmm/s 5h"), ("--before",)),
    (("--insert", "0"), ("--insert", "0.1")),
    (("--insert", "nan"), ("--insert",)),
    (("--max-um", "-3"), ("--max-um",)),
    (("--set", "thermal.cte=3"), ("thermal.cte",)),
    (("--set", "thermal.cte_um_m_K"), ("--set",)),
    (("-o", ""), ("-o",)),
    (("-o", "README.md"), ("README.md",)),
]


@pytest.mark.parametrize(("arguments", "words"), ARGUMENTS, ids=lambda v: " ".join(v))
def test_a_bad_argument_is_refused_in_one_line(arguments, words, here):
    refused(run("correct", here / "PART.LS", "-o", here / "out", *arguments), 2, *words)
    assert untouched(here)


def test_a_program_that_is_not_there_is_refused(here):
    refused(correct(here, name="NONE.LS"), 2, "NONE.LS", "cannot be read")
    refused(run("correct", here, "-o", here / "out"), 2, "cannot be read")
    assert untouched(here)


def test_outside_its_bound_the_report_is_written_and_the_program_only_by_force(here):
    (here / "COARSE.LS").write_bytes(program(["J P[1] 10% FINE"], [at(1, HOME, form="{:.1f}")]))
    result = correct(here, *BEFORE, "--max-um", "5", name="COARSE.LS")
    refused(result, 1, "COARSE.LS not written", "--force", "line 4")
    assert {"report.json", "report.html"} < {p.name for p in (here / "out").iterdir()}
    assert not (here / "out" / "COARSE.LS").exists()
    assert correct(here, *BEFORE, "--max-um", "5", "--force", name="COARSE.LS").returncode == 1
    assert (here / "out" / "COARSE.LS").exists()
    assert correct(here, *BEFORE, "--max-um", "200", name="COARSE.LS").returncode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals")
def test_killed_at_any_moment_nothing_is_half_written(here):
    """The result of an earlier run stays whole, or the new one is there whole."""
    assert correct(here, "-q").returncode == 0
    whole = {p.name: p.read_bytes() for p in (here / "out").iterdir()}
    command = [
        sys.executable,
        "-m",
        "compgen",
        "correct",
        str(here / "PART.LS"),
        "-q",
        "-o",
        str(here / "out"),
        *BEFORE,
    ]
    start = time.monotonic()
    assert subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, check=False).returncode == 0
    took = time.monotonic() - start
    new = {p.name: p.read_bytes() for p in (here / "out").iterdir()}
    assert new != whole
    for share in (0.3, 0.8, 0.9, 0.97):
        assert correct(here, "-q").returncode == 0
        process = subprocess.Popen(command, cwd=ROOT, env=ENVIRONMENT, start_new_session=True)
        time.sleep(share * took)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        found = {p.name: p.read_bytes() for p in (here / "out").iterdir() if not p.name.startswith(".")}
        for name, content in found.items():
            assert content in (whole[name], new[name])
        if "PART.LS" in found:
            same = whole if found["PART.LS"] == whole["PART.LS"] else new
            assert found == same


def test_a_result_never_replaces_the_program_it_was_made_from(here):
    for more in ((), ("--force",), ("--restore",)):
        refused(run("correct", here / "PART.LS", "-o", here, "-q", *more), 2, "PART.LS", "would replace it", "-o")
    assert (here / "PART.LS").read_bytes() == part()
    assert not (here / "PART.compgen.json").exists()
