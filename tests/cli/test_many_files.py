"""Folders and patterns in the place of files, and SARIF of what is found in them."""

import json
import re
import shutil

import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.core.toml import line_of_key

GOLDEN = ROOT / "tests" / "golden"


@pytest.fixture
def programs(tmp_path):
    """A folder of two programs and of files that are none, with one below it."""
    folder = tmp_path / "my programs"
    (folder / "inner").mkdir(parents=True)
    for name in ("TRAPS.LS", "MOVES.LS"):
        shutil.copy(GOLDEN / name, folder / name)
    shutil.copy(GOLDEN / "NOPOS.LS", folder / "inner" / "b.ls")
    (folder / "notes.txt").write_text("none")
    return folder


@pytest.mark.parametrize(
    ("typed", "files"),
    [
        ("my programs", ["MOVES.LS", "TRAPS.LS"]),
        ("my programs/", ["MOVES.LS", "TRAPS.LS"]),
        ("my programs/*", ["MOVES.LS", "TRAPS.LS"]),
        ("my*/[TM]*.LS", ["MOVES.LS", "TRAPS.LS"]),
        ("my programs/**/*", ["MOVES.LS", "TRAPS.LS", "inner/b.ls"]),
    ],
)
def test_a_folder_or_a_pattern_stands_for_its_programs_by_name(programs, typed, files):
    done = run("inspect", typed, "--json", cwd=programs.parent)
    assert (done.returncode, done.stderr) == (0, "")
    records = json.loads(done.stdout)
    assert [(r["path"], r["exit_code"]) for r in records] == [(f"my programs/{name}", 0) for name in files]


def test_one_program_is_inspected_as_before_and_several_one_after_the_other(programs):
    one, other = (run("inspect", programs / name).stdout for name in ("MOVES.LS", "TRAPS.LS"))
    assert run("inspect", programs).stdout == f"{programs}/MOVES.LS:\n{one}{programs}/TRAPS.LS:\n{other}"
    assert run("inspect", programs / "inner").stdout == run("inspect", programs / "inner" / "b.ls").stdout
    assert json.loads(run("inspect", programs / "MOVES.LS", "--json").stdout)["name"] == "MOVES"


@pytest.mark.parametrize(
    ("command", "typed", "words"),
    [
        ("inspect", "empty", "empty: no program (.LS) in this folder; give"),
        ("inspect", "*.LS", "*.LS: no program (.LS) matches; give"),
        ("inspect", "nowhere.LS", "nowhere.LS: cannot be read"),
        ("check", "empty", "empty: no path file (.toml) in this folder"),
        ("check", "paths/**/x*.toml", "no path file (.toml) matches"),
    ],
)
def test_nothing_that_matches_is_one_line(tmp_path, command, typed, words):
    (tmp_path / "empty").mkdir()
    refused(run(command, typed, cwd=tmp_path), 2, words)


def test_of_several_one_without_files_stops_no_other(programs):
    (programs / "inner" / "b.ls").unlink()
    done = run("inspect", programs / "inner", "*.none", programs / "MOVES.LS", "--json", cwd=programs)
    assert [one["exit_code"] for one in json.loads(done.stdout)] == [2, 2, 0]
    assert (done.returncode, done.stderr.count("\n")) == (2, 2)


def test_a_name_with_the_signs_of_a_pattern_is_a_name_where_it_is_there(tmp_path):
    shutil.copy(GOLDEN / "MOVES.LS", tmp_path / "A[1].LS")
    (tmp_path / "d[1]").mkdir()
    shutil.copy(GOLDEN / "MOVES.LS", tmp_path / "d[1]" / "B.LS")
    for typed in ("A[1].LS", "d[1]"):
        assert run("inspect", typed, cwd=tmp_path).returncode == 0


def results(content):
    """The results of a SARIF file, as what the standard asks for is held: code, level, file, line and message."""
    log = json.loads(content)
    assert log["version"] == "2.1.0"
    assert log["$schema"].endswith("sarif-2.1.0.json")
    assert set(log) == {"$schema", "version", "runs"}
    (only,) = log["runs"]
    driver = only["tool"]["driver"]
    assert driver["name"] == "compgen"
    rules = [rule["id"] for rule in driver["rules"]]
    assert len(set(rules)) == len(rules)
    assert only["columnKind"] in ("utf16CodeUnits", "unicodeCodePoints")
    assert [type(each["executionSuccessful"]) for each in only["invocations"]] == [bool]
    for result in only["results"]:
        assert result["ruleId"] in rules
        assert result["level"] in ("none", "note", "warning", "error")
        assert result["message"]["text"]
        (place,) = result["locations"]
        physical = place["physicalLocation"]
        assert physical["region"]["startLine"] >= 1
        uri = physical["artifactLocation"]["uri"]
        assert re.fullmatch(r"[A-Za-z0-9._~:/%-]+", uri)  # no character that a URI has not
        yield result["ruleId"], result["level"], uri, physical["region"]["startLine"], result["message"]["text"]


def test_what_makes_a_program_unsafe_stands_at_its_line(programs):
    (programs / "ZZ.LS").write_bytes((programs / "MOVES.LS").read_bytes().replace(b"/END", b""))
    call = ("inspect", "my programs", "--sarif", "r.sarif", "--json")
    done = run(*call, cwd=programs.parent)
    refused(done, 2, "ZZ.LS: ", "/END is missing")
    content = (programs.parent / "r.sarif").read_bytes()
    rows = list(results(content))
    unsafe = [row for row in rows if row[0] == "correction.unsafe"]
    assert {row[1] for row in unsafe} == {"warning"}
    reported = [u for one in json.loads(done.stdout) if "report" in one for u in one["report"]["unsafe"]]
    assert [(row[3], row[4]) for row in unsafe] == [(u["line"], f"{u['text']}: {u['reason']}") for u in reported]
    assert {row[2] for row in unsafe} <= {"my%20programs/MOVES.LS", "my%20programs/TRAPS.LS"}
    text = (programs / "TRAPS.LS").read_text("latin-1").splitlines()
    calls = [row for row in unsafe if row[2].endswith("TRAPS.LS") and row[4].startswith(("CALL ", "SKIP ", "JMP "))]
    assert calls
    assert all(row[4].split()[0] in text[row[3] - 1] for row in calls)
    assert rows[-1][:3] == ("bad-input", "error", "my%20programs/ZZ.LS")
    assert f"line {rows[-1][3]}: /END is missing" in rows[-1][4]
    run(*call, cwd=programs.parent)
    assert (programs.parent / "r.sarif").read_bytes() == content


def test_a_broken_bound_stands_at_its_key_and_a_refusal_at_its_own(tmp_path):
    (tmp_path / "my").mkdir()
    text = (ROOT / "paths" / "line_y.toml").read_text()
    mended = re.sub(r"^max_um *=.*$", "max_um = 0.001", text, flags=re.MULTILINE)
    assert mended != text
    wrong = text.replace("[process]", "[process]\nfed_mm_s = 3")
    for name, content in (("a", mended), ("b", wrong), ("c", f"{text}\n[\n")):
        (tmp_path / "my" / f"{name}.toml").write_text(content)
    done = run("check", "my", "--sarif", "r.sarif", "-q", cwd=tmp_path)
    assert done.returncode == 2
    rows = {(row[0], row[2]): row for row in results((tmp_path / "r.sarif").read_bytes())}
    broken, unknown = rows["bounds.max_um", "my/a.toml"], rows["bad-input", "my/b.toml"]
    assert broken[1] == "error"
    assert mended.splitlines()[broken[3] - 1] == "max_um = 0.001"
    assert wrong.splitlines()[unknown[3] - 1] == "fed_mm_s = 3"
    assert rows["bad-input", "my/c.toml"][3] > len(text.splitlines())


@pytest.mark.parametrize(
    ("key", "line"),
    [("a", 1), ("t", 2), ("t.a", 3), ("t.none", 2), ("rows", 4), ("rows.1.b", 5), ("t.in.c", 7), ("no.c", 1), ("", 1)],
)
def test_the_line_of_a_key_is_its_own_or_that_of_its_table(key, line):
    assert line_of_key("a = 1\n[t]\n a= 2\n[[rows]]\nb = 1\n[t.in] # t.a = 1\nc = [\n[1]]\n", key) == line


def test_a_file_of_somebody_is_not_taken_for_the_sarif_file(programs):
    before = (programs / "notes.txt").read_bytes()
    refused(run("inspect", programs, "--sarif", programs / "notes.txt"), 2, "notes.txt: it is there", "inspect --sarif")
    assert (programs / "notes.txt").read_bytes() == before


def test_a_position_that_a_motion_uses_and_the_program_lacks_is_no_success(programs):
    text = (GOLDEN / "MOVES.LS").read_bytes()
    first = re.search(rb"(?m)^P\[(\d+)[^{\n]*\{", text)
    assert first is not None
    begin, end, name = first.start(), text.index(b"};") + 2, first[1].decode()
    bad = programs / "LACKS.LS"
    bad.write_bytes(text[:begin] + text[end:].lstrip())
    refused(run("inspect", "-q", bad), 1, f"P[{name}]: used but not defined; mend the program")
    record = json.loads(run("inspect", "--json", bad).stdout)
    assert record["positions"]["undefined"] == [int(name)]
    assert run("inspect", "-q", programs / "MOVES.LS").returncode == 0
