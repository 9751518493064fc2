r"""At which override statements that last whole interpolation periods were driven.

At the override f a statement of t seconds lasts ceil(t / (f T)) T: no rate of one clock, for what is added hangs on f.
So every whole percent is tried. Where lines are equally long several drive alike, to the period: then the plainest of
them is taken, and the others are named.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.units import PERCENT
from compgen.verification.executed.clock_rates import Stretch, Windows, badness, stretches_of
from compgen.verification.executed.course import ProgramCourse

ROUNDS = 2  # of parting a log into stretches, and of finding the override of each
TOGETHER = 4  # windows
EDGE = 2  # windows beside a change of rate, of which nobody knows on which side of it they are
ALIKE = 1e-3  # of a time: clocks of logs are off by that
WHOLE = 0.4 * PERCENT  # of a time, by which it may miss that of an override in whole percent
NEARER = 1 / 3  # of how far written speeds are from whole percent, that whole periods leave
PRICE = 2.0  # that one of two clocks must explain rates better by, to be believed against the robot file


@dataclass(frozen=True, eq=False, slots=True)
class DrivenAt:
    """The override of a stretch, in percent."""

    percent: int
    lowest: int  # of those that drive alike
    highest: int
    off: float  # share by which the stretch took another time


@dataclass(frozen=True, eq=False, slots=True)
class TimedLog:
    """A log by one clock of the course."""

    clock: Array  # (N,) [s] of the nodes, at full override
    stretches: tuple[Stretch, ...]
    spread: float  # of the rates inside of them
    off: float  # largest share by which a stretch took another time than at its override


def timed_log(course: ProgramCourse, rates: Callable[[Array], Windows], place: Callable[[Array], Array]) -> TimedLog:
    """A log by the clock that explains it: that of whole periods if the robot file has it, and if it is no worse.

    Args:
        course: Of the program.
        rates: Of a clock of the nodes, in windows of the log that are the same for all clocks.
        place: Arc lengths at times of the log [s to m].
    """
    windows = rates(course.cruise)
    stretches, spread = stretches_of(windows)
    off = max((abs(s.rate / s.override - 1) for s in stretches), default=0.0)
    written = TimedLog(course.cruise, stretches, spread, off)
    if not stretches:
        return written
    counted = _in_whole_periods(course, rates, written, windows, place)
    better = badness(counted.stretches, counted.spread) - badness(stretches, spread)
    if abs(better) <= PRICE and course.counted:  # lines are equally long, or so long that periods do not count
        return written if off < ALIKE and counted.off > WHOLE else counted
    if abs(better) <= PRICE:
        return counted if off > ALIKE and counted.off < NEARER * off else written
    return counted if better < 0 else written


def _in_whole_periods(
    course: ProgramCourse,
    rates: Callable[[Array], Windows],
    written: TimedLog,
    windows: Windows,
    place: Callable[[Array], Array],
) -> TimedLog:
    """A log by statements in whole periods: each stretch at the override at which they last as long as it did."""
    percent = np.arange(round(100 * min(s.override for s in written.stretches)), 101)
    begins, ends, span = place(windows.begin), place(windows.end), windows.end - windows.begin
    clocks = (course.counted_clock(p * PERCENT) / (p * PERCENT) for p in percent.tolist())
    lasts = np.array([course.at(clock, ends) - course.at(clock, begins) for clock in clocks])

    def driven_in(stretches: tuple[Stretch, ...]) -> tuple[DrivenAt, ...]:
        edges = [np.searchsorted(windows.begin, [s.begin, s.end]).tolist() for s in stretches]
        sure = [(a + EDGE * (a > 0), b - EDGE * (b < len(span))) if b - a > 3 * EDGE else (a, b) for a, b in edges]
        return tuple(_driven_at(percent, lasts[:, a:b], span[a:b]) for a, b in sure)

    stretches, spread, clock = written.stretches, written.spread, written.clock
    for _ in range(ROUNDS):
        later = place(np.array([s.begin for s in stretches[1:]]))
        which = np.searchsorted(later, course.arc[:-1], side="right")
        clock = course.counted_clock(PERCENT * np.array([d.percent for d in driven_in(stretches)])[which])
        stretches, spread = stretches_of(rates(clock))
    driven = driven_in(stretches)
    known = tuple(replace(s, alike=(d.lowest, d.highest)) for s, d in zip(stretches, driven, strict=True))
    return TimedLog(clock, known, spread, max(d.off for d in driven))


def _driven_at(percent: IntArray, lasts: Array, span: Array) -> DrivenAt:
    """The override of a stretch of windows that took (W,) [s], of those in percent (P,) that they last (P, W) [s] at.

    Windows count a few together, for smoothing shifts what one lasts into the next, and by their absolute difference,
    for a controller near its limits takes longer over some lines.
    """
    begins = np.arange(0, max(len(span) // TOGETHER, 1)) * TOGETHER
    lasts, span = np.add.reduceat(lasts, begins, axis=1), np.add.reduceat(span, begins)
    away = np.abs(lasts - span).sum(axis=1)
    nearest = lasts[np.argmin(away)]
    alike = percent[np.abs(lasts - nearest).sum(axis=1) <= ALIKE * span.sum()].tolist()
    middle = (alike[0] + alike[-1]) / 2
    chosen = min(alike, key=lambda p: (p != 100, p % 10 > 0, p % 5 > 0, abs(p - middle)))
    return DrivenAt(chosen, alike[0], alike[-1], abs(float(np.median(nearest / span)) - 1))
