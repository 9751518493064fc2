"""The date in a program's header: YY-MM-DD."""

import pytest

from compgen.core.dates import checked_date
from compgen.core.exceptions import InputError


@pytest.mark.parametrize(
    "date", ["1926-01-31", "2026-1-31", "26-13-01", "26-02-30", "26-00-10", "26-01-00", "26-1-1", "", "26-01-31 "]
)
def test_what_is_no_date_is_refused(date):
    with pytest.raises(InputError, match="YY-MM-DD"):
        checked_date(date)


@pytest.mark.parametrize("date", ["24-02-29", "26-01-01", "99-12-31"])
def test_a_date_is_taken_as_it_is(date):
    assert checked_date(date) == checked_date(f"20{date}") == date
