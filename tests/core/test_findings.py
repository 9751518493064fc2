"""Messages: one printable line of at most 300 characters, cut in the middle so that place and mend stay."""

import pytest

from compgen.cli.screen.messages import print_error
from compgen.core.codes import Code, Level
from compgen.core.findings import MOST_CHARACTERS, Finding, beyond_text, one_line


def test_a_short_message_stays_as_it_is():
    assert one_line("paths/a.toml: duty: unknown key; did you mean 'dwell'?").endswith("'dwell'?")


def test_a_long_one_loses_its_middle():
    line = one_line(f"paths/a.toml: {'x' * 5000}; give less")
    assert len(line) == MOST_CHARACTERS
    assert line.startswith("paths/a.toml: xxx")
    assert " ... " in line
    assert line.endswith("; give less")


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
