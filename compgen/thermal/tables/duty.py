"""From [[before]], [[cycle]], [[after]] and [[shift]] of a path file to steps and shifts in SI."""

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
    steps = []
    for i, row in enumerate(rows):
        key = f"{where}: {name}.{i}"
        moving = row.state == "moving"
        if moving and row.feed_mm_s is None and row.program is None and name == "before":
            raise InputError(f"{key}.feed_mm_s: missing; state 'moving' needs it, or a program that has one")
        for optional in ("program", "repeat", "dwell_s", "dwell", "duty", "shifts"):
            if not moving and getattr(row, optional) not in (None, False):
                raise InputError(f"{key}.{optional}: state '{row.state}' has none; set state = 'moving' or remove it")
        if (row.duration_h is None) == (row.repeat is None):
            reason = "missing" if row.repeat is None else "conflicts with repeat"
            raise InputError(f"{key}.duration_h: {reason}; give a duration_h" + (" or a repeat, one of them" * moving))
        if row.repeat is None and (row.dwell_s is not None or row.dwell is not None):
            raise InputError(f"{key}.dwell_s: only a repeat has a dwell; give repeat instead of duration_h, or a duty")
        steps.append(
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
    return tuple(steps)


def _feed(row: sh.StepTable, own_feed: float) -> float:
    """The row's; else the job's own, or 0 where another program's file says it."""
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
    shifts = tuple(
        Shift(r.from_h * HOUR, r.to_h * HOUR, tuple((a * HOUR, b * HOUR) for a, b in r.breaks_h)) for r in rows
    )
    check_shifts(shifts, where)
    return shifts
