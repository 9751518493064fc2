"""A short run of the campaign on damaged TOML, CSV and JSON files; tests/campaigns/mutants.py has the long one."""

import mutants


def test_damaged_files_are_taken_or_refused_in_one_line(monkeypatch):
    monkeypatch.setenv("CC", "")
    monkeypatch.setattr(mutants, "LIMIT", 120)
    entries = mutants.run(range(60))
    counts = {kind: sum(entry["kind"] == kind for entry in entries) for kind in ("passed", "refused", "failed")}
    assert counts["failed"] == 0, [entry for entry in entries if entry["kind"] == "failed"]
    assert counts["refused"] > 20
    assert counts["passed"] > 5


def test_a_fault_is_seen(monkeypatch):
    """A Python error, a second line and a folder after a refusal are failures: else the campaign proves nothing."""
    assert mutants._judged(0, "", "", mutants.ROOT)[0] == "passed"
    assert mutants._judged(2, "", "cgen: a: b\n", mutants.ROOT / "nowhere")[0] == "refused"
    for code, err in (
        (2, ""),
        (2, "cgen: a\nb\n"),
        (1, "x" * 301),
        (0, "RuntimeWarning\n"),
        (7, "cgen: a\n"),
        (2, "\x1b\n"),
    ):
        assert mutants._judged(code, "", err, mutants.ROOT / "nowhere")[0] == "failed"


def test_measured_lines_that_lack_a_coordinate_are_identified(tmp_path, monkeypatch):
    """The page draws residuals in space only where a row has a place."""
    monkeypatch.setenv("CC", "")
    bases = mutants.made_bases(tmp_path)
    arguments, files = next((words, files) for _, words, files in bases if "--lines" in words)
    outcome = mutants.attempt(
        mutants.Case(arguments, {n: t.encode() for n, t in files.items()}), tmp_path / "run", limit=120
    )
    assert outcome.kind == "passed", outcome.reason
