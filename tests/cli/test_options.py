"""Options that several commands share."""

import pytest

from compgen.cli.options import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError
from compgen.pipelines.program_text import DATE


def test_the_date_of_the_help_is_the_date_of_the_programs():
    assert DEFAULT_DATE == DATE


@pytest.mark.parametrize("date", ["2026-01-31", "26-13-01", "26-02-30", "26-1-1", "", "26-01-31 "])
def test_what_is_no_date_is_refused(date):
    with pytest.raises(InputError, match="YY-MM-DD"):
        checked_date(date)


def test_a_date_is_taken_as_it_is():
    assert checked_date("24-02-29") == "24-02-29"
