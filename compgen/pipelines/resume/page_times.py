"""Which page runs when, on the log's clock: as somebody wrote it down, or one after the other from the first start on.

A file of starts has a row whenever a page begins: ``time_s``, ``page`` (0: the robot stands) and, where it is known,
``loaded``, the last page that the controller has. A row of the page that runs already says that it still runs, one
behind a stand in its middle that it goes on. A page that is not followed by a row ends when its motion does; then the
robot stands, servo on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from compgen.core.csv_table import CsvTable, ended_rows, table_of_rows
from compgen.core.exceptions import InputError
from compgen.core.files import MOST_TABLE_BYTES, read_named

KNOWN = ("time_s", "page", "loaded")
MOST_STARTS = 5000


@dataclass(frozen=True, slots=True)
class PageMoment:
    """A page begins or still runs, or the robot stands (page 0)."""

    time: float  # [s] on the log's clock
    page: int
    loaded: int = 0  # the last page that the controller has; 0: nobody says
    into: float = 0.0  # [s] since the page began


@dataclass(frozen=True, slots=True)
class PageTimes:
    """What the robot does, from the planned start on."""

    starts: tuple[PageMoment, ...]  # by rising times
    duration: tuple[float, ...]  # [s] of each page
    planned: float  # [s] when the job was planned to start
    last_reported: int = 0  # page of those written down as begun or loaded, wherever the log ends

    def running(self, time: float) -> tuple[int, float]:
        """The page that runs and for how long [s]; page 0 where the robot stands."""
        now = [s for s in self.starts if s.time <= time]
        if not now or now[-1].page == 0:
            return 0, 0.0
        elapsed = time - now[-1].time + now[-1].into
        return (now[-1].page, elapsed) if elapsed < self.duration[now[-1].page - 1] else (0, 0.0)

    def last(self, time: float) -> int:
        """The last page that has begun; 0: none."""
        return max((s.page for s in self.starts if s.time <= time), default=0)

    def begun_behind(self, time: float) -> int:
        """The last page of which somebody wrote that it began behind a time; 0: none."""
        return max((s.page for s in self.starts if s.time > time), default=0) if self.last_reported else 0

    def loaded(self, time: float) -> int:
        """The last page that the controller has: of those that have begun by then, and of all that somebody wrote."""
        return max((self.last_reported, *(max(s.page, s.loaded) for s in self.starts if s.time <= time)))

    def stretches(self, until: float) -> list[tuple[float, float, int, float]]:
        """Begin, end, page (0: standing) and how far into its motion it begins [s], from the planned start on."""
        standing = PageMoment(self.planned, 0)
        moments = [standing, *(s for s in self.starts if s.time < until), PageMoment(until, 0)]
        pieces = []
        time = self.planned
        for start, after in pairwise(moments):
            into = max(0.0, time - start.time) + start.into
            moving = 0.0 if start.page == 0 else max(0.0, self.duration[start.page - 1] - into)
            stop = min(after.time, time + moving)
            if stop > time:
                pieces.append((time, stop, start.page, into))
            if after.time > stop:
                pieces.append((stop, after.time, 0, 0.0))
            time = max(time, after.time)
        return pieces


def planned_times(duration: Sequence[float], planned: float, started: float) -> PageTimes:
    """Pages that run one after the other without a wait.

    Args:
        duration: Of each page [s].
        planned: When the job was planned to start [s].
        started: When the first page started [s].
    """
    begins = started + np.concatenate([[0.0], np.cumsum(duration)[:-1]])
    starts = tuple(PageMoment(float(t), k) for k, t in enumerate(begins.tolist(), 1))
    return PageTimes(starts, tuple(duration), planned)


def _whole_rows(source: str) -> CsvTable | None:
    """The rows that have an end; None while there are none: the file is still being written."""
    rows = ended_rows(read_named(source, "give the CSV file of page starts", MOST_TABLE_BYTES))
    table = table_of_rows(source, rows, ("time_s", "page"), KNOWN) if rows else None
    return table if table is not None and table.line else None


def read_page_times(source: str | Path, duration: Sequence[float], planned: float) -> PageTimes:
    """Pages as somebody wrote them down while they ran; an empty or absent file says that none has begun.

    Args:
        source: The CSV file.
        duration: Of each page [s].
        planned: When the job was planned to start [s].

    Raises:
        InputError: A bad file, times that fall, a page that is not there.
    """
    table = _whole_rows(str(source)) if Path(source).exists() else None
    if table is None:
        return PageTimes((), tuple(duration), planned)
    time, page = table.numbers("time_s"), table.numbers("page")
    loaded = table.numbers("loaded", gaps=True) if table.has("loaded") else np.zeros(len(time))
    starts: list[PageMoment] = []
    latest, ran = 0, 0.0
    for row, (t, p, have) in enumerate(zip(time.tolist(), page.tolist(), np.nan_to_num(loaded).tolist(), strict=True)):
        for column, value in (("page", p), ("loaded", have)):
            if value != int(value) or not 0 <= value <= len(duration):
                raise InputError(f"{table.location(row, column)}: {value:g}: the job has pages 1 to {len(duration)}")
        if starts and t < starts[-1].time:
            raise InputError(f"{table.location(row, 'time_s')}: {t:g} after {starts[-1].time:g}: time must rise")
        if p and p < latest:
            raise InputError(f"{table.location(row, 'page')}: {p:g}: a later page has begun already; mend the row")
        begun, latest = latest, max(latest, int(p))
        is_same = bool(starts) and p == starts[-1].page
        if is_same and have <= starts[-1].loaded:
            continue  # it still stands, or runs
        if len(starts) == MOST_STARTS:
            raise InputError(f"{table.location(row)}: over {MOST_STARTS} starts; give a row when a page begins")
        if starts and starts[-1].page:
            ran = starts[-1].into + t - starts[-1].time
        goes_on = p == begun > 0 and (is_same or ran < duration[begun - 1])
        starts.append(PageMoment(t, int(p), int(have), ran if goes_on else 0.0))
    last_reported = max((max(s.page, s.loaded) for s in starts), default=0)
    return PageTimes(tuple(starts), tuple(duration), planned, last_reported)
