"""The date that a program's header has: an argument, never the clock's."""

import re
from calendar import monthrange

from compgen.core.exceptions import InputError

DEFAULT_DATE = "26-01-01"  # fixed, so that the same inputs give the same bytes


def checked_date(date: str) -> str:
    """A date YY-MM-DD, given so or as 20YY-MM-DD.

    Raises:
        InputError: It is none.
    """
    match = re.fullmatch(r"(?:20)?([0-9]{2})-(0[1-9]|1[0-2])-([0-9]{2})", date)
    if match is None or not 1 <= int(match[3]) <= monthrange(2000 + int(match[1]), int(match[2]))[1]:
        raise InputError(f"--date {date}: not a date YY-MM-DD, as in 26-01-31 or 2026-01-31")
    return date[-8:]
