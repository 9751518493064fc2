"""Dates and durations as they are typed; the date that a program's header has is an argument, never the clock's."""

import re
from calendar import monthrange

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE

DEFAULT_DATE = "26-01-01"  # fixed, so that the same inputs give the same bytes
_PART = re.compile(r"(\d+(?:\.\d*)?|\.\d+)\s*(h|min|s)")
_UNITS = {"h": HOUR, "min": MINUTE, "s": 1.0}


def checked_date(date: str) -> str:
    """A date YY-MM-DD, given so or as 20YY-MM-DD.

    Raises:
        InputError: It is none.
    """
    match = re.fullmatch(r"(?:20)?([0-9]{2})-(0[1-9]|1[0-2])-([0-9]{2})", date)
    if match is None or not 1 <= int(match[3]) <= monthrange(2000 + int(match[1]), int(match[2]))[1]:
        raise InputError(f"--date {date}: not a date YY-MM-DD, as in 26-01-31 or 2026-01-31")
    return date[-8:]


def duration(text: str, option: str) -> float:
    """Seconds.

    Args:
        text: Hours, minutes and seconds: ``90s``, ``20min``, ``1.5h``, ``1h30min``.
        option: That gave them, for the message.

    Raises:
        InputError: Not a duration.
    """
    parts = _PART.findall(text.strip())
    units = [unit for _, unit in parts]
    if not parts or _PART.sub("", text).strip() or units != sorted(set(units), key=list(_UNITS).index):
        raise InputError(f"{option} {text!r:.60}: not a duration with its unit; write it as 35min, 1h30min or 90s")
    return float(sum(float(number) * _UNITS[unit] for number, unit in parts))
