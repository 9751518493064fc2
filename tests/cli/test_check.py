"""``check`` of many paths: every outcome in JUnit, one bad path stops no other, one exit code for all."""

import json
import os
import shutil
import signal
from xml.etree import ElementTree

import pytest
from command_line import refused, run
from shipped import ROOT
from stopped import run_stopped

from compgen.cli.commands import check as command
from compgen.cli.screen.ci_reports import JudgedPath, junit_xml
from compgen.core import interrupts
from compgen.pipelines.planned import generate
from compgen.report import band_words

OUTSIDE = {"level": "outside", "code": "bounds.max_um", "message": "too large"}
CASE_TAGS = {"failure", "error", "skipped", "system-out"}


def parsed(content):
    """JUnit XML with what the readers of GitHub, GitLab and Jenkins need: its root, and its cases by name."""
    root = ElementTree.fromstring(content)
    suites = [root] if root.tag == "testsuite" else root.findall("testsuite")
    assert root.tag in ("testsuites", "testsuite")
    assert suites
    for suite in [root, *suites]:
        cases = list(suite.iter("testcase"))
        assert suite.get("name")
        assert int(suite.attrib["tests"]) == len(cases) > 0
        for key, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
            assert int(suite.attrib[key]) == sum(case.find(tag) is not None for case in cases)
        assert float(suite.attrib["time"]) == pytest.approx(
            sum(float(c.attrib["time"]) for c in cases), abs=0.001 * len(cases)
        )
    for case in root.iter("testcase"):
        assert case.get("classname")
        assert case.get("name")
        assert float(case.attrib["time"]) >= 0
        assert {child.tag for child in case} <= CASE_TAGS
        assert len([child for child in case if child.tag != "system-out"]) <= 1
        for child in case:
            assert child.tag == "system-out" or child.get("message")
            assert child.tag in ("system-out", "skipped") or child.get("type")
    cases = list(root.iter("testcase"))
    by_name = {case.get("name"): case for case in cases}
    assert len(by_name) == len(cases)
    return root, by_name


@pytest.fixture
def paths(tmp_path):
    """Paths that are inside, outside, refused, and beyond the arm."""
    text = (ROOT / "paths" / "line_y.toml").read_text()
    shutil.copytree(ROOT / "robots", tmp_path / "robots")
    folder = tmp_path / "paths"
    folder.mkdir()
    (folder / "inside.toml").write_text(text)
    (folder / "outside.toml").write_text(text.replace("max_um = 2.5", "max_um = 0.2"))
    (folder / "bad.toml").write_text("[path\n")
    (folder / "far.toml").write_text(text.replace("x_mm = 1350", "x_mm = 2400"))
    return folder


def all_of(paths):
    return sorted(str(p.relative_to(paths.parent)) for p in paths.glob("*.toml"))


def test_every_outcome_is_a_case_and_the_exit_code_is_the_largest(paths, tmp_path):
    names = all_of(paths)
    done = run("check", *names, "--junit", "r.xml", cwd=tmp_path)
    assert done.returncode == 3
    root, cases = parsed((tmp_path / "r.xml").read_bytes())
    assert list(cases) == names
    assert [root.get(key) for key in ("tests", "failures", "errors", "skipped")] == ["4", "1", "2", "0"]
    assert cases["paths/outside.toml"].find("failure").get("type") == "outside"
    assert "bounds.max_um = 0.2" in cases["paths/outside.toml"].find("failure").text
    assert cases["paths/bad.toml"].find("error").get("type") == "bad input"
    assert cases["paths/bad.toml"].find("error").text == "exit code 2"
    assert cases["paths/far.toml"].find("error").get("type") == "cannot be done"
    assert float(cases["paths/inside.toml"].get("time")) > 0
    assert "1 of 4 paths inside" in done.stdout
    lines = done.stderr.splitlines()
    assert len(lines) == 3
    for line, name in zip(lines, (n for n in names if n != "paths/inside.toml"), strict=True):
        assert line.startswith(f"cgen: {name}: ")
        assert len(line) <= 300
        assert line.count(name) == 1


def test_json_of_many_is_a_list_and_of_one_its_report(paths, tmp_path):
    many = run("check", *all_of(paths)[:1], "paths/inside.toml", "paths/outside.toml", "--json", cwd=tmp_path)
    assert many.returncode == 2
    bad, inside, outside = json.loads(many.stdout)
    assert (bad["path"], bad["exit_code"]) == ("paths/bad.toml", 2)
    assert "not TOML" in bad["error"]
    one = run("check", "paths/inside.toml", "--json", "--workers", "1", cwd=tmp_path)
    assert inside == {"path": "paths/inside.toml", "exit_code": 0, "report": json.loads(one.stdout)}
    assert (outside["exit_code"], outside["report"]["verdict"]) == (1, "outside")


def test_a_refused_path_alone_has_a_case_too(paths, tmp_path):
    done = run("check", "paths/bad.toml", "--junit", "r.xml", "--json", cwd=tmp_path)
    refused(done, 2, "paths/bad.toml", "not TOML")
    record = json.loads(done.stdout)
    assert record["exit_code"] == 2
    assert "paths/bad.toml" in record["error"]
    root, cases = parsed((tmp_path / "r.xml").read_bytes())
    assert (root.tag, root.get("errors")) == ("testsuite", "1")
    assert cases["check"].find("error").get("message") == record["error"]


def test_a_path_that_stands_twice_is_checked_once(paths, tmp_path):
    done = run("check", "paths/inside.toml", "./paths/inside.toml", "--json", cwd=tmp_path)
    assert [(entry["exit_code"], entry["report"]["verdict"]) for entry in json.loads(done.stdout)] == [(0, "inside")]
    assert done.stderr == "cgen: note: ./paths/inside.toml: given twice; it is checked once\n"


@pytest.mark.parametrize("quiet", ["-q", "--quiet"])
def test_quiet_leaves_notes_away_and_refusals_not(paths, tmp_path, quiet):
    done = run("check", "paths/bad.toml", "./paths/bad.toml", quiet, cwd=tmp_path)
    refused(done, 2, "cgen: paths/bad.toml: ")
    assert done.stdout == ""


def test_a_fault_of_compgen_is_an_error_and_the_others_are_judged(paths, tmp_path, monkeypatch):
    proper, calls = generate.generate, []

    def faulty(job, *arguments):
        calls.append(job.name)
        if job.name == "inside":
            raise ZeroDivisionError("by\x1b nothing")
        return proper(job, *arguments)

    monkeypatch.setattr(generate, "generate", faulty)
    done = run("check", "paths/inside.toml", "paths/outside.toml", "--junit", "r.xml", cwd=tmp_path)
    assert done.returncode == 70
    assert calls == ["inside", "outside"]
    assert "Traceback" in done.stderr
    _, cases = parsed((tmp_path / "r.xml").read_bytes())
    error = cases["paths/inside.toml"].find("error")
    assert (error.get("type"), error.text) == ("crash", "exit code 70")
    assert "ZeroDivisionError" in error.get("message")
    assert cases["paths/outside.toml"].find("failure") is not None


def test_a_run_that_is_stopped_says_how_far_it_came(tmp_path):
    file = tmp_path / "r.xml"

    def judge(path):
        if path == "b":
            raise interrupts.Interrupted(signal.SIGINT)
        return {"findings": [], "verdict": "inside", "bounds": {}}, ""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("compgen.report.band_words.headline", lambda summary: "words")
        with pytest.raises(interrupts.Interrupted):
            command.judge_all(["a", "b", "c"], judge, str(file))
    root, cases = parsed(file.read_bytes())
    assert [root.get(key) for key in ("tests", "failures", "errors", "skipped")] == ["3", "0", "1", "1"]
    assert cases["b"].find("error").get("type") == "interrupted"
    assert cases["c"].find("skipped") is not None


def test_a_run_stopped_by_a_signal_keeps_what_was_judged(paths, tmp_path):
    arguments = ["check", paths / "inside.toml", paths / "outside.toml", "--junit", tmp_path / "r.xml", "--json"]
    done = run_stopped(arguments, ("open", "outside.toml", 1))
    assert done.returncode == 130
    assert done.stderr.count("\n") == 1
    assert "1 of 2 paths were checked" in done.stderr
    assert json.loads(done.stdout)["exit_code"] == 130
    root, cases = parsed((tmp_path / "r.xml").read_bytes())
    assert (root.get("errors"), root.get("skipped")) == ("1", "0")
    assert cases[str(paths / "outside.toml")].find("error").get("type") == "interrupted"


def test_a_killed_run_leaves_a_file_that_says_so(paths, tmp_path):
    (tmp_path / "r.xml").write_bytes(junit_xml([JudgedPath("old.toml", 0, 1.0), JudgedPath("older.toml", 0, 1.0)]))
    arguments = ["check", paths / "inside.toml", paths / "outside.toml", "--junit", tmp_path / "r.xml", "-q"]
    killed = run_stopped(arguments, ("import", "casadi", 1), signal.SIGKILL)
    assert killed.returncode == -signal.SIGKILL
    root, cases = parsed((tmp_path / "r.xml").read_bytes())
    assert (root.get("errors"), root.get("skipped")) == ("1", "1")
    assert "old.toml" not in cases


def test_a_path_file_is_not_taken_for_the_junit_file(paths, tmp_path):
    before = (paths / "inside.toml").read_bytes()
    refused(run("check", "--junit", "paths/inside.toml", "paths/outside.toml", cwd=tmp_path), 2, "paths/inside.toml")
    assert (paths / "inside.toml").read_bytes() == before


def test_every_outcome_is_a_case(monkeypatch):
    monkeypatch.setattr(band_words, "headline", lambda summary: "as large as it is")
    outcomes = [
        JudgedPath("a.toml", 0, 1.0, {"findings": [], "verdict": "inside"}),
        JudgedPath("b.toml", 1, 1.0, {"findings": [OUTSIDE], "verdict": "outside"}, "m"),
        *(JudgedPath(f"{code}.toml", code, 1.0, message="why") for code in (2, 3, 70, 130)),
        JudgedPath("late.toml", None, 0.0),
    ]
    _, cases = parsed(junit_xml(outcomes))
    assert list(cases) == [outcome.path for outcome in outcomes]
    kinds = [next((c.tag for c in case if c.tag != "system-out"), "passed") for case in cases.values()]
    assert kinds == ["passed", "failure", *4 * ["error"], "skipped"]


def test_a_name_that_is_not_utf8_is_carried(paths, tmp_path):
    name = os.fsdecode(b"paths/\xff<\"&'\x01.toml")
    try:
        (tmp_path / name).write_text("[path\n")
    except OSError:
        pytest.skip("the file system takes no such name")
    done = run("check", name, "--junit", "r.xml", "--json", cwd=tmp_path)
    assert done.returncode == 2
    assert json.loads(done.stdout)["exit_code"] == 2
    root, _ = parsed((tmp_path / "r.xml").read_bytes())
    assert root.get("name") == "compgen.\\udcff<\"&'\\x01"


@pytest.mark.parametrize("count", [1, 2])
def test_no_character_breaks_the_file(count):
    text = "\x00\x1b[31m <&>\"' \ud800 \ufffe ü \U0001f916\nend"
    outcomes = [JudgedPath(text, 2, 0.5, message=text), JudgedPath("b", 0, 0.1)]
    content = junit_xml(outcomes[:count])
    root, _ = parsed(content)
    message = root.find(".//error").get("message")
    assert "ü \U0001f916" in message
    assert "\\x1b[31m" in message
    assert "\\ud800" in message
