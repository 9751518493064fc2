"""A short run of the campaign of stopped runs and full disks; tests/campaigns/kills.py has the long one."""

import kills
import pytest

OLDER, WHOLE = {"A.LS": b"old", "r.json": b"old"}, {"A.LS": b"new", "r.json": b"new"}


def test_stopped_at_steps_of_writing_nothing_is_half_written_and_the_next_run_clears_up(tmp_path, monkeypatch):
    monkeypatch.setenv("CC", "")
    monkeypatch.setenv("XDG_CACHE_HOME", "")  # restored: the campaign sets it
    campaign = kills.Campaign(tmp_path, {"pages": kills.COMMANDS["pages"]})
    steps = len(campaign.boundaries)
    assert steps > 25
    beside_others = [seed for seed, (_, situation, _) in enumerate(campaign.boundaries) if situation == "foreign"]
    rows = [campaign.tried(seed) for seed in (*beside_others, *range(steps, steps + 8))]
    assert [row for row in rows if row["wrong"]] == []
    assert sum(kills.kind_of(row) == "killed" for row in rows) >= 8


@pytest.mark.parametrize(
    ("situation", "out", "word"),
    [
        ("own", {"A.LS": b"new", "r.json": b"old"}, "files of two runs"),
        ("own", {"A.LS": b"ne", "r.json": b"new"}, "half of one"),
        ("own", {"r.json": b"old"}, "A.LS is lost"),
        ("own", {"A.LS": b"new"}, "neither the older set nor the new"),
        ("new", {"r.json": b"new"}, "neither the older set nor the new"),
        ("foreign", {"A.LS": b"old", "r.json": b"old"}, "a foreign file has changed"),
    ],
)
def test_the_judge_of_files_bites(situation, out, word):
    older = {} if situation == "new" else OLDER
    assert any(word in fault for fault in kills.faults_of_files(True, situation, older, WHOLE, out))
    assert kills.faults_of_files(True, "own", older or OLDER, WHOLE, WHOLE) == []


def test_the_judge_of_words_bites(tmp_path):
    stop = kills.Stop("SIGTERM", 3)
    for code, said in ((143, ""), (143, "a\nb\n"), (1, "Traceback"), (-15, ""), (70, "x"), (-9, "")):
        assert kills.faults_of_end(tmp_path, stop, kills.End(code, said, [], 0.0)), (code, said)
    assert kills.faults_of_end(tmp_path, stop, kills.End(143, "cgen: terminated\n", [], 0.0)) == []
    (tmp_path / ".out.compgen-here-1-2").mkdir()
    assert kills.faults_of_end(tmp_path, stop, kills.End(143, "cgen: terminated\n", [], 0.0))
    assert kills.faults_of_end(tmp_path, kills.Stop("SIGKILL", 3), kills.End(-9, "", [], 0.0)) == []
