"""``cgen explain``: what a code means, by itself, in a report, and of all of them."""

import json

import pytest
from command_line import refused, run
from shipped import ROOT

from compgen.core.finding_codes import Code


@pytest.mark.parametrize("typed", ["thermal.none", "[thermal.none]", "Thermal.None:", "`thermal.none`"])
def test_a_code_is_explained_as_the_registry_has_it_however_it_was_copied(typed):
    done = run("explain", typed)
    code = Code.THERMAL_NONE
    assert done.stdout.splitlines() == [
        f"{code} (warning, note): {code.meaning}",
        f"  What to do: {code.remedy}",
        f"  {ROOT}/docs/findings.md#{code}",
    ]
    assert run("explain", typed, "--json").stdout == run("explain", code.value, "--json").stdout


def test_every_code_has_its_place_on_the_page_that_is_named():
    page = (ROOT / "docs" / "findings.md").read_text()
    records = json.loads(run("explain", "--json").stdout)["codes"]
    assert sorted(record["code"] for record in records) == sorted(Code)
    for record in records:
        place, _, anchor = record["page"].partition("#")
        assert place == "docs/findings.md"
        assert page.count(f'<a id="{anchor}"></a>`{record["code"]}` |') == 1


def test_all_codes_are_listed_by_room():
    lines = run("explain").stdout.splitlines()
    codes = [line.split()[0] for line in lines if line.startswith("  ")]
    assert sorted(codes) == sorted(Code)
    rooms = [line.partition("(")[2].rstrip("/):") for line in lines if not line.startswith("  ")]
    assert [Code(code).room for code in codes] == sorted((Code(code).room for code in codes), key=rooms.index)


def test_the_findings_of_a_report_are_explained_once_each(tmp_path):
    rows = [
        ("warning", Code.THERMAL_NONE, "cold\x1b[2J"),
        ("note", Code.PATH_LINES, "a"),
        ("note", Code.PATH_LINES, "b"),
    ]
    findings = [{"level": level, "code": code, "message": message} for level, code, message in rows]
    (tmp_path / "report.json").write_text(
        json.dumps({"findings": [*findings, {"code": "of.later"}, {"code": "thermal.none"}, 1]})
    )
    for place in (tmp_path, tmp_path / "report.json"):
        lines = run("explain", place).stdout.splitlines()
        assert [line for line in lines if line.startswith(("thermal.none ", "path.lines "))] == [lines[0], lines[4]]
        assert "  warning: cold\\x1b[2J" in lines
        assert {"  note: a", "  note: b"} < set(lines)


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("thermal.nine", "near: thermal.none, "),
        ("xyzzy", "no finding has this code; cgen explain lists all"),
        (" ", "cgen explain lists"),
        ("paths/line_y.toml", "it has no findings"),
        ("tests", "tests/report.json: no such file; give a report.json, its folder, or a code"),
    ],
)
def test_what_is_no_code_is_one_line(typed, words):
    refused(run("explain", typed), 2, words)
