"""Where a robot stood, and which rows of its log rest there."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.verification.executed.course import ProgramCourse

STANDING = 0.03  # of the written speed
LEAST_STAND = 0.12  # s
STAND_BIN = 0.04  # s
RESTING_ROWS = 20  # beside the bins of a stand that may rest as well: a bin of the finest log


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """Where the robot stood for longer than the program says, or where the program waits."""

    time: float  # [s] log's clock at the first row that rests there; the last steady one where none does
    arc: float  # [m]
    stood: float  # [s] that rows rest there
    beyond: float  # [s] that the stop cost beyond its assumed ramps and ``planned``
    planned: float  # [s] that the program waits there
    at_stop: bool  # where the program stops; else it was held


def standing_rows(course: ProgramCourse, time: Array, arc: Array, noise: float) -> list[tuple[int, int]]:
    """First and last row of each time that the robot stands, by bins of a fixed length in time."""
    width = max(STAND_BIN, 3 * float(np.median(np.diff(time))))
    edges = np.unique(np.append(np.searchsorted(time, np.arange(time[0], time[-1], width)), len(time) - 1))
    moved, span = np.abs(np.diff(arc[edges])), np.diff(time[edges])
    cruise = np.abs(np.diff(course.at(course.cruise, arc[edges])))
    still = (moved <= 8 * noise + 1e-6) & (cruise <= STANDING * span) | (moved < 1e-6)
    begins = np.flatnonzero(still & ~np.append(False, still[:-1]))
    ends = np.flatnonzero(still & ~np.append(still[1:], False)) + 1
    rows = np.column_stack([edges[begins], edges[ends]])
    return [(a, b) for a, b in rows.tolist() if time[b] - time[a] >= LEAST_STAND]


def all_at_rest(arc: Array, first: int, last: int, reach: float) -> tuple[int, int]:
    """First and last row of a stand with the rows beside its bins that lie where it does, within a reach [m]."""
    begin, place = max(first - RESTING_ROWS, 0), float(np.median(arc[first : last + 1]))
    rows = begin + np.flatnonzero(np.abs(arc[begin : last + RESTING_ROWS + 1] - place) <= reach)
    return int(min(first, rows[0])), int(max(last, rows[-1]))
