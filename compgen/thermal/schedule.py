"""From the steps of a cell's day to stretches of duty: repeats, dwells, shifts and breaks.

What a cell does around the runs of a program, and how warm that leaves the robot.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.units import DAY, HOUR
from compgen.thermal.ambient import Ambient, still_air
from compgen.thermal.duty import Duty
from compgen.thermal.integration import state_after
from compgen.thermal.model import ThermalModel

MAX_STRETCHES = 200_000  # stretches
STANDING = Duty("idle", 0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """One entry of [[before]], [[cycle]] or [[after]]."""

    key: str  # where it stands, for messages
    state: Literal["moving", "idle", "off"]
    feed: float  # [m/s], 0 unless moving
    program: str = ""  # a path file that moves; "" is the job's own
    duration: float | None = None  # [s]
    repeat: int | None = None  # runs of the program instead of a duration
    dwell: float = 0.0  # [s] after each run
    rest: Literal["idle", "off"] = "idle"  # during the dwell
    share: float = 1.0  # duty ratio while moving
    shifts: bool = False  # only inside the shifts


@dataclass(frozen=True, slots=True)
class Shift:
    """Working hours, the same every day; a night shift ends after 24 h."""

    start: float  # [s] of the day
    end: float  # [s]
    breaks: tuple[tuple[float, float], ...] = ()  # [s] of the day


def expand_steps(
    steps: Sequence[Step], shifts: Sequence[Shift], clock: float, run_time: Callable[[Step], float]
) -> list[tuple[Step, Duty]]:
    """Stretches of constant duty, in order, each with the step it comes from.

    Args:
        steps: In order.
        shifts: Of a day; may be empty.
        clock: When the first step begins, [s] of the day.
        run_time: How long one run of a step's program takes [s]; called only where a step repeats.

    Returns:
        Their durations add up to the steps'. A step inside shifts is idle in the breaks and off between the shifts.

    Raises:
        InputError: Too many stretches.
    """
    stretches: list[tuple[Step, Duty]] = []
    for step in steps:
        if step.repeat is not None:
            run = Duty("moving", step.feed, run_time(step), step.share)
            pair = [run] if step.dwell == 0 else [run, Duty(step.rest, 0.0, step.dwell)]
            if len(pair) == 1:
                duties = [replace(run, duration=run.duration * step.repeat)]
            else:
                duties = pair * min(step.repeat, MAX_STRETCHES)
        else:
            duties = [Duty(step.state, step.feed, step.duration or 0.0, step.share)]
        if step.shifts:
            uncut, duties, now = duties, [], clock
            for duty in uncut:
                duties += cut_at_shifts(duty, shifts, now)
                now += duty.duration
        clock += sum(d.duration for d in duties)
        stretches += [(step, d) for d in duties]
        if len(stretches) > MAX_STRETCHES:
            raise InputError(
                f"{step.key}: over {MAX_STRETCHES} stretches of duty; say it as a duration_h with a duty ratio"
            )
    return stretches


def cut_at_shifts(duty: Duty, shifts: Sequence[Shift], clock: float) -> Iterator[Duty]:
    """A stretch of wall-clock time cut at the edges of shifts and breaks."""
    day = clock // DAY
    spans: list[tuple[float, float, bool]] = []  # begin, end, is it a break
    for n in range(-1, int(duty.duration / DAY) + 2):
        base = (day + n) * DAY
        for s in shifts:
            spans.append((base + s.start, base + s.end, False))
            spans += [(base + a, base + b, True) for a, b in s.breaks]
    end = clock + duty.duration
    edges = sorted({clock, end, *(t for a, b, _ in spans for t in (a, b) if clock < t < end)})
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        middle = (a + b) / 2
        breaks = [is_break for begin, stop, is_break in spans if begin <= middle < stop]
        if not breaks:
            yield Duty("off", 0.0, b - a)
        elif any(breaks):
            yield Duty("idle", 0.0, b - a)
        else:
            yield replace(duty, duration=b - a)


def check_shifts(shifts: Sequence[Shift], where: str) -> None:
    """Raises InputError where shifts or breaks overlap, or a break lies outside its shift."""
    for i, s in enumerate(shifts):
        for j, (a, b) in enumerate(s.breaks):
            if not s.start <= a < b <= s.end:
                raise InputError(
                    f"{where}: shift.{i}.breaks_h.{j}: {[a / HOUR, b / HOUR]} must rise and lie within the shift, "
                    f"{s.start / HOUR:g} to {s.end / HOUR:g} h"
                )
        order = sorted(s.breaks)
        if any(x[1] > y[0] for x, y in zip(order[:-1], order[1:], strict=True)):
            raise InputError(f"{where}: shift.{i}.breaks_h: the breaks overlap; part them")
        for k, other in enumerate(shifts[:i]):
            for turn in (-DAY, 0.0, DAY):
                if s.start < other.end + turn and other.start + turn < s.end:
                    raise InputError(
                        f"{where}: shift.{i}: {s.start / HOUR:g} to {s.end / HOUR:g} h overlaps shift.{k}, "
                        f"{other.start / HOUR:g} to {other.end / HOUR:g} h; part them"
                    )


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class History:
    """Duties before a program, between its runs and after them; without any it starts cold and runs once."""

    before: tuple[Duty, ...] = ()
    given: int | None = None  # how many of them are what the user says was before, not the cycle's; None: all
    cycle: tuple[Duty, ...] = ()  # the program's own runs and what is between them; empty: one run
    after: tuple[Duty, ...] = ()
    runs: tuple[float, ...] = (0.0,)  # [s] when each run of the program begins, counted from the first
    standing: Duty = STANDING  # one second of servo on before the program
    air: Ambient = field(default_factory=still_air)  # from the first duty of ``before`` on
    step_at: Mapping[float, str] = field(default_factory=dict)  # feed [m/s] to the key of the first step that has it

    @property
    def clock(self) -> float:
        """When the program starts, counted from the first duty of ``before`` [s]."""
        return sum(d.duration for d in self.before)

    def state(self, heat: ThermalModel) -> Array:
        """Thermal state when the program starts, (S,)."""
        return state_after(heat, self.before, air=self.air)
