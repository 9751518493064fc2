"""Durations as a shift says them: 35min, 1h30min, 90s."""

import re

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MINUTE

_PART = re.compile(r"(\d+(?:\.\d+)?|\.\d+)\s*(h|min|s)")
_UNITS = {"h": HOUR, "min": MINUTE, "s": 1.0}


def duration(text: str, option: str) -> float:
    """Seconds.

    Args:
        text: Numbers with h, min or s, the largest unit first.
        option: That it stands behind, for the message.

    Raises:
        InputError: Another text.
    """
    parts = _PART.findall(text.strip())
    units = [unit for _, unit in parts]
    if not parts or _PART.sub("", text).strip() or units != sorted(set(units), key=list(_UNITS).index):
        raise InputError(f"{option} {text!r:.60}: not a duration; write it as 35min, 1h30min or 90s")
    return float(sum(float(number) * _UNITS[unit] for number, unit in parts))
