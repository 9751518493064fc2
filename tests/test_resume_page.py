"""The simulated day of docs/resume.md: its words are what the script writes, and its short day is simulated anew."""

import sys

import pytest
from shipped import ROOT

sys.path.insert(0, str(ROOT / "docs"))
import resume_day


@pytest.fixture(scope="module")
def short():
    return resume_day.simulate(*resume_day.DAYS["short"])


def test_the_page_is_what_its_script_writes_from_its_numbers():
    text = resume_day.PAGE.read_text(encoding="utf-8")
    assert resume_day.page_with(text, resume_day.NUMBERS.read_text()) == text


def test_the_short_day_is_what_the_page_says(short):
    rows = resume_day.rows_of("short", *short)
    written = [line for line in resume_day.NUMBERS.read_text().splitlines() if line.startswith("short,")]
    assert len(rows) == len(written) == 3
    for row, line in zip(rows, written, strict=True):
        now, then = row.split(","), line.split(",")
        assert now[:5] == then[:5]
        for a, b in zip(now[5:], then[5:], strict=True):
            assert float(a) == pytest.approx(float(b), abs=0.051)


def test_the_short_day_bites_and_following_holds_it(short):
    day, runs = short
    share = {name: resume_day.share_within(error, length) for name, (error, length, _, _) in runs.items()}
    assert share["as written"] < 0.8
    assert share["followed"] >= 0.95
    assert share["resumed at each page"] >= 0.95
    assert runs["followed"][3] >= 1
    # pages are no longer than the start window, as the claim wants
    assert max(day.times.duration) < 1500


def test_of_the_long_day_95_percent_of_the_path_keep_the_bound():
    rows = [line.split(",") for line in resume_day.NUMBERS.read_text().splitlines()[1:]]
    (followed,) = [row for row in rows if row[:2] == ["9 h", "followed"]]
    assert float(followed[-1]) >= 95
    assert float(followed[2]) == pytest.approx(9, abs=0.1)  # hours
