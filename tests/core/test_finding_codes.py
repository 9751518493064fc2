"""The registry of finding codes: what is found takes its code from there, at a level that the code may have."""

import ast
import json

import pytest
from shipped import ROOT
from test_architecture import ROOMS

from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.job.bounds import Bounds
from compgen.verification.deviation import COMPONENTS, Extent
from compgen.verification.verdict import checks

#: keys of files that are spelt as a code is
KEYS = {
    ("compgen/report/key_words.py", "bounds.max"),
    ("compgen/report/study_page.py", "bounds.max_um"),
    ("compgen/pipelines/files/path_file.py", "path.file"),
}
REGISTRY = ROOT / "compgen" / "core" / "finding_codes.py"


@pytest.fixture(scope="module")
def trees():
    """The source of each file; kept no longer than these tests: a search for cycles would walk through all of it."""
    return {
        path.relative_to(ROOT): ast.parse(path.read_text())
        for folder in ("compgen", "docs", "benchmarks")
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path != REGISTRY
    }


def names_in(tree, enum):
    """Members of an enumeration that a piece of source names."""
    return [
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == enum
    ]


def calls(trees):
    """Where a finding is made: its level, None where its code alone says it, and the code."""
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if not isinstance(node, ast.Call):
                continue
            if ast.unparse(node.func) == "Finding":
                level, code, _ = node.args
                assert not node.keywords
                yield path, level, code
            elif ast.unparse(node.func) == "Finding.of":
                yield path, None, node.args[0]


def test_a_finding_takes_its_code_from_the_registry_at_a_level_that_it_may_have(trees):
    made = list(calls(trees))
    assert len(made) > 150
    for path, level, code in made:
        where = f"{path}:{code.lineno}"
        texts = [n.value for n in ast.walk(code) if isinstance(n, ast.Constant) and isinstance(n.value, str)]
        assert set(texts) <= {"bounds.", "bounds.guaranteed.", "code"}, where  # by a bound's key, or read again
        for name in names_in(code, "Code"):
            if level is None:
                assert len(Code[name].levels) == 1, where
            else:
                assert {Level[other] for other in names_in(level, "Level")} <= set(Code[name].levels), where


def test_no_level_is_said_where_its_code_has_no_other(trees):
    for path, level, code in calls(trees):
        if level is not None and isinstance(code, ast.Attribute):
            assert len(Code[code.attr].levels) > 1, f"{path}:{code.lineno}"


def test_each_code_is_found_by_its_own_room_first_and_none_by_nobody(trees):
    rooms: dict[Code, set[str]] = {}
    for path, _, code in calls(trees):
        for name in names_in(code, "Code"):
            rooms.setdefault(Code[name], set()).add(path.parts[1])
    named = {Code[name] for path, tree in trees.items() for name in names_in(tree, "Code")}
    by_key = {code for code in Code if code.startswith("bounds.") and code not in named}
    extents = {name: Extent(*[0.0] * len(Extent.__dataclass_fields__)) for name in COMPONENTS}
    keys = [key for key, *_ in checks(extents, Bounds())]
    assert by_key | {Code.BOUNDS_MAX_UM} == {
        Code(f"bounds.{more}{key}") for key in keys for more in ("", "guaranteed.")
    }
    assert set(Code) == named | by_key
    for code, some in rooms.items():
        assert code.room == min(some, key=ROOMS.index) or code is Code.BOUNDS_MAX_UM, code
    assert {code.room for code in Code} <= set(ROOMS)


def test_no_code_is_typed_a_second_time(trees):
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and "." in node.value:
                assert node.value not in set(Code) or (path.as_posix(), node.value) in KEYS, f"{path}:{node.lineno}"
            if isinstance(node, ast.Compare) and "code" in [getattr(n, "attr", None) for n in ast.walk(node)]:
                texts = [n.value for n in ast.walk(node) if isinstance(n, ast.Constant)]
                assert not set(texts) & set(Code), f"{path}:{node.lineno}"


def test_each_code_says_what_it_means_and_what_to_do():
    for code in Code:
        assert code.levels
        assert len(set(code.levels)) == len(code.levels)
        assert code.meaning.endswith(".")
        assert code.remedy.endswith(".")
        assert code.name == code.upper().replace(".", "_")
        assert "|" not in code.meaning + code.remedy  # a table's


def test_a_level_that_a_code_may_not_have_fails():
    with pytest.raises(ValueError, match=r"correction.none is no note: outside"):
        Finding(Level.NOTE, Code.CORRECTION_NONE, "nothing")


def test_a_code_of_one_level_says_it_and_one_of_several_does_not():
    assert Finding.of(Code.CORRECTION_NONE, "nothing") == Finding(Level.OUTSIDE, Code.CORRECTION_NONE, "nothing")
    with pytest.raises(ValueError, match="too many values"):
        Finding.of(Code.MOTION_KNOWN, "which level?")


def test_a_record_has_the_text_of_a_code():
    record = Finding(Level.OUTSIDE, Code.CORRECTION_NONE, "nothing").record()
    assert json.dumps(record) == '{"level": "outside", "code": "correction.none", "message": "nothing"}'
    assert type(record["code"]) is str


def test_the_page_of_findings_is_made_from_the_registry(monkeypatch):
    """To renew it: python docs/finding_tables.py."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import finding_tables

    assert (ROOT / "docs" / "findings.md").read_text() == finding_tables.page()
