"""Messages: one printable line of at most 300 characters, cut in the middle so that place and mend stay."""

import random
import re

import pytest

from compgen.cli.screen.messages import finding_lines, print_error
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import (
    MOST_CHARACTERS,
    NOT_DONE,
    OF_EVERY_JOB,
    OF_SAFETY,
    Finding,
    beyond_text,
    in_reading_order,
    is_for_every_job,
    one_line,
)


def test_a_short_message_stays_as_it_is():
    assert one_line("paths/a.toml: duty: unknown key; did you mean 'dwell'?").endswith("'dwell'?")


def test_a_long_one_loses_its_middle():
    line = one_line(f"paths/a.toml: {'x' * 5000}; give less")
    assert len(line) == MOST_CHARACTERS
    assert line.startswith("paths/a.toml: xxx")
    assert " ... " in line
    assert line.endswith("; give less")


def test_a_long_one_is_cut_between_words():
    words = one_line(" ".join(f"word{k:04d}" for k in range(100))).split()
    assert words.count("...") == 1
    assert all(re.fullmatch(r"word\d{4}|\.\.\.", word) for word in words)


def test_what_does_not_print_is_escaped():
    assert one_line("a\nb\r\n\tc\x1b[31m\udcff") == "a b c\\x1b[31m\\udcff"


def test_findings_and_refusals_are_cut(capsys):
    assert len(Finding(Level.NOTE, Code.TIMING_FEED, "word " * 400).message) <= MOST_CHARACTERS
    assert print_error("word\n" * 400, 2) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert len(message.strip()) <= MOST_CHARACTERS


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(4.585, 2.5, "4.58"), (2.5004, 2.5, "2.5004"), (2.504, 2.503, "2.504"), (2.5, 2.5, "2.50"), (0.9999, 1, "0.9999")],
)
def test_a_value_shows_on_which_side_of_its_limit_it_is(value, limit, text):
    assert beyond_text(value, limit) == text


def test_the_last_bit_of_a_number_is_shown_where_it_decides():
    assert float(beyond_text(2.5000000000000004, 2.5)) > 2.5


SIZES = ("", ", 12.5 um of 90 um", ", 40 um")
DRAWN = [
    Finding(level, code, f"about {code}{SIZES[n % 3]}{', 300 um/s' if n % 2 else ''}")
    for n, code in enumerate(Code)
    for level in code.levels
]


def test_safety_and_what_was_not_done_are_read_first_then_what_breaks_a_bound_and_the_rest_by_micrometres():
    shuffled = random.Random(7).sample(DRAWN, len(DRAWN))
    ordered = in_reading_order(f.record() for f in shuffled)
    assert sorted(map(str, ordered)) == sorted(map(str, DRAWN))
    first, second = (sum(f.code in kind for f in DRAWN) for kind in (OF_SAFETY, NOT_DONE))
    assert {f.code for f in ordered[:first]} == OF_SAFETY
    assert {f.code for f in ordered[first : first + second]} == NOT_DONE
    assert not OF_SAFETY & NOT_DONE
    assert not OF_EVERY_JOB & (OF_SAFETY | NOT_DONE)
    rest = [f for f in ordered[first + second :] if f.level in (Level.WARNING, Level.NOTE)]
    assert ordered[-len(rest) :] == rest
    unsized = {Level.WARNING: float("inf"), Level.NOTE: 0.0}
    sizes = [90 if "of 90 um" in f.message else 40 if " 40 um" in f.message else unsized[f.level] for f in rest]
    assert sizes == sorted(sizes, reverse=True)
    assert set(sizes) == {0.0, 40, 90, float("inf")}


def test_only_notes_are_folded_and_nothing_that_is_not_known():
    folded = {f for f in DRAWN if is_for_every_job(f)}
    assert {f.level for f in folded} == {Level.NOTE}
    assert not [f.code for f in folded if "not known" in f.code.meaning or "not sure" in f.code.meaning]
    shown = finding_lines(DRAWN, verbose=False)
    assert shown[-1] == f"{len(folded)} notes that every job has: --verbose shows them"
    assert len(shown) == len(DRAWN) - len(folded) + 1
    assert sorted(finding_lines(DRAWN, verbose=True)) == sorted(f"{f.level} [{f.code}]: {f.message}" for f in DRAWN)
    one = finding_lines([Finding(Level.NOTE, Code.PATH_THINNED, "a"), *DRAWN[:1]], verbose=False)
    assert one[1:] == ["1 note that every job has: --verbose shows it"]
