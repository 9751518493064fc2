"""Entries of [[before]], [[cycle]], [[after]] and [[shift]]: checked, in SI."""

from collections.abc import Sequence

from compgen.core.exceptions import InputError
from compgen.core.units import HOUR, MM
from compgen.thermal.schedule import Shift, Step, check_shifts
from compgen.thermal.tables import schema as sh


def steps_of(rows: Sequence[sh.StepTable], name: str, where: str, own_feed: float) -> tuple[Step, ...]:
    """Entries of [[before]], [[cycle]] or [[after]].

    Raises:
        InputError: Keys that miss or contradict each other.
    """
    found = []
    for i, row in enumerate(rows):
        key = f"{where}: {name}.{i}"
        moving = row.state == "moving"
        if moving and row.feed_mm_s is None and row.program is None and name == "before":
            raise InputError(f"{key}.feed_mm_s: missing; state 'moving' needs it, or a program that has one")
        for word in ("program", "repeat", "dwell_s", "dwell", "duty", "shifts"):
            if not moving and getattr(row, word) not in (None, False):
                raise InputError(f"{key}.{word}: state '{row.state}' has none; set state = 'moving' or remove it")
        if (row.duration_h is None) == (row.repeat is None):
            told = "missing" if row.repeat is None else "conflicts with repeat"
            raise InputError(f"{key}.duration_h: {told}; give a duration_h" + (" or a repeat, one of them" * moving))
        if row.repeat is None and (row.dwell_s is not None or row.dwell is not None):
            raise InputError(f"{key}.dwell_s: only a repeat has a dwell; give repeat instead of duration_h, or a duty")
        found.append(
            Step(
                key=key,
                state=row.state,
                feed=_feed(row, own_feed),
                program=row.program or "",
                duration=None if row.duration_h is None else row.duration_h * HOUR,
                repeat=row.repeat,
                dwell=row.dwell_s or 0.0,
                rest=row.dwell or "idle",
                share=1.0 if row.duty is None else row.duty,
                shifts=row.shifts,
            )
        )
    return tuple(found)


def _feed(row: sh.StepTable, own_feed: float) -> float:
    """As said; else the own program's, or 0 for what another program's file says."""
    if row.state != "moving":
        return 0.0
    if row.feed_mm_s is not None:
        return row.feed_mm_s * MM
    return 0.0 if row.program else own_feed


def shifts_of(rows: Sequence[sh.ShiftTable], where: str) -> tuple[Shift, ...]:
    """The shifts of a day.

    Raises:
        InputError: They overlap.
    """
    for i, row in enumerate(rows):
        if not row.from_h < row.to_h <= row.from_h + 24:
            raise InputError(
                f"{where}: shift.{i}.to_h: {row.to_h:g} must be above from_h = {row.from_h:g}, and at most 24 h later; "
                "a night shift from 22 ends at 30"
            )
    found = tuple(
        Shift(r.from_h * HOUR, r.to_h * HOUR, tuple((a * HOUR, b * HOUR) for a, b in r.breaks_h)) for r in rows
    )
    check_shifts(found, where)
    return found
