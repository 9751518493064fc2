"""Dates and clocks as loggers write them, to seconds: since 2000 with a date, since midnight with a clock alone.

``datetime`` reads the dates. The order of day, month and year is the one that fits every row; two that fit are refused.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from datetime import datetime, timedelta

from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR, MINUTE

_START = datetime(2000, 1, 1)
_MOMENT = re.compile(
    r"'?(?P<date>\d{1,4}(?P<sign>[-./ ])\w{1,9}(?P=sign)\d{2,4}|[a-z]{3,9}\.? \d{1,2},? \d{4})?[t, -]*"
    r"(?P<clock>((?P<days>\d{1,2}) days?, )?(?P<h>\d{1,3}):(?P<m>[0-5]\d)(:(?P<s>[0-5]\d)([.,:](?P<f>\d{1,9}))?)?"
    "([ \u00a0\u202f]?(?P<half>[ap])[.]?[ \u00a0\u202f]?m[.]?)?"
    r"( ?(?P<zone>z|[+-][01]\d:?[0-5]\d))?)?",
    re.IGNORECASE | re.ASCII,
)
#: formats by the order of day, month and year, with a slash for every sign but a point: nobody points mdy
_FORMATS = {
    "dmy": ("%d/%m/%Y", "%d.%m.%Y", "%d/%m/%y", "%d.%m.%y", "%d/%b/%Y", "%d/%b/%y", "%d/%B/%Y"),
    "mdy": ("%m/%d/%Y", "%m/%d/%y", "%b/%d/%Y", "%B/%d/%Y"),
    "ymd": ("%Y/%m/%d", "%y/%m/%d", "%Y.%m.%d", "%Y/%b/%d"),
}


def time_of(cell: str) -> tuple[str, str, float]:
    """What a cell is ("d" for a date, "c" a clock, "z" a zone; empty: no time), its date, and seconds from midnight."""
    part = _MOMENT.fullmatch(cell)
    hour, half = (int(part["h"] or 0), part["half"]) if part else (0, None)
    if part is None or hour > (12 if half else 23 if part["date"] else 999):
        return "", "", 0.0
    ahead = datetime.strptime(part["zone"].upper(), "%z").utcoffset() if part["zone"] else None
    hour = hour % 12 + 12 * (half in "pP") if half else hour
    seconds = float(f"{part['s'] or 0}.{part['f'] or 0}") - (ahead or timedelta()).total_seconds()
    date = re.sub(r"[-/, ]+", "/", part["date"] or "").replace("./", "/")
    kind = "d" * bool(date) + "c" * bool(part["clock"]) + "z" * bool(part["zone"])
    return kind, date, int(part["days"] or 0) * DAY + hour * HOUR + int(part["m"] or 0) * MINUTE + seconds


def seconds_of(
    cells: Sequence[str], order: str | None, where: Callable[[int], str], mend: Callable[[str], str]
) -> list[float]:
    """Times in seconds.

    Args:
        cells: A row's date, clock or both.
        order: Of day, month and year, as dmy; None: as the rows have it.
        where: File, line and column of a row, for messages.
        mend: How a user says an order of some.

    Raises:
        InputError: A cell is no time, or written otherwise than the first; the order is open; time runs back.
    """
    parts = [time_of(cell) for cell in cells]
    other = next((row for row, part in enumerate(parts) if part[0] != parts[0][0]), None)
    if other is not None:
        raise InputError(
            f"{where(other)}: '{cells[other][:30]}' is no time like '{cells[0][:30]}'; mend or remove the row"
        )
    days = _days(sorted({date for _, date, _ in parts} - {""}), order, f"{where(0)}: '{cells[0][:30]}'", mend)
    times = [days.get(date, 0.0) + clock for _, date, clock in parts]
    back = next((row for row in range(1, len(times)) if times[row] < times[row - 1]), None)
    if back is not None:
        past = "sort the rows, or write zones" if days else "if it is past midnight, write dates too"
        raise InputError(f"{where(back)}: '{cells[back][:30]}' runs back from '{cells[back - 1][:30]}'; {past}")
    is_clear = days or HOUR <= min(times) <= max(times) < DAY or any(re.search(":.*:|m", cell) for cell in cells)
    if not is_clear:
        raise InputError(f"{where(0)}: '{cells[0]}' may be minutes and seconds; write it with its hours, as 0:08:15")
    return times


def _days(dates: Sequence[str], order: str | None, first: str, mend: Callable[[str], str]) -> Mapping[str, float]:
    """Seconds from the year 2000 to each date, by the one order that fits all of them."""
    fits = {}
    for candidate in [order] if order else _FORMATS:
        days = [_seconds(written, _FORMATS[candidate]) for written in dates]
        if None not in days:
            fits[candidate] = {date: day or 0.0 for date, day in zip(dates, days, strict=True)}
    if not fits or any(days != fits[min(fits)] for days in fits.values()):
        orders = " or ".join(f'"{candidate}"' for candidate in fits)
        what = (
            f"may be {orders}, of day, month, year; {mend(f'dates = {orders}')}"
            if fits
            else "fits no order with others"
        )
        raise InputError(f"{first}: the date {what}{'' if fits else '; write all dates alike'}")
    return fits[min(fits)]


def _seconds(written: str, formats: Sequence[str]) -> float | None:
    """Seconds from the year 2000 to a date; None where no format fits."""
    for text in formats:
        with suppress(ValueError):
            return (datetime.strptime(written, text) - _START).days * DAY
    return None
