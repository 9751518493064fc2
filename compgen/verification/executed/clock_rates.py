"""The rate of a course's clock over a log, the stretches in which it is the same, and the rows in which it stands.

Rates are fitted in windows of one run each, by least squares; a change of override is where the windows' rates change
to another level and stay there. Levels are sought by the best of all partitions, a price on each edge.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated
from compgen.verification.executed.course import ProgramCourse

WINDOW = 0.25  # [s] least
WINDOW_ROWS = 8
WINDOWS = 2000  # of a log
SAME_RATE = 0.004  # rates that differ by less are one override
FINEST_RATE = 2e-4  # scatter of rates that is taken as none
LEAST_STRETCH = 3  # windows
BRIEF = 3.0  # [s] that an operator leaves an override at least
SLIGHT = 0.1  # of a rate: shorter stretches that differ by less are the controller's own
STANDING = 0.03  # of the written speed
LEAST_STAND = 0.12  # s
STAND_BIN = 0.04  # s
RESTING_ROWS = 20  # beside the bins of a stand that may rest as well: a bin of the finest log
LONG_RUN = 2.4  # [s] of a run whose rate is sure; shorter ones count where there are no others


@dataclass(frozen=True, slots=True)
class Stretch:
    """Part of a log at one override."""

    begin: float  # [s] log's clock
    end: float  # [s]
    rate: float  # of the written speed, by the log's clock
    sigma: float  # of the rate
    alike: tuple[int, int] = (0, 0)  # [%] lowest and highest override that drive the same, where several do

    @property
    def words(self) -> str:
        """The override, and which others it cannot be told from."""
        low, high = self.alike
        return f"{100 * self.override:.0f} %" + (f" ({low} to {high} % drive these lines alike)" if low < high else "")

    @property
    def override(self) -> float:
        """The override in whole percent, as controllers have it, as a share; of some that drive alike the nearest."""
        low, high = self.alike if self.alike[0] < self.alike[1] else (1, 100)
        return min(max(round(100 * self.rate), low), high) / 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Stand:
    """Where the robot stood for longer than the program says, or where the program waits."""

    time: float  # [s] log's clock at the first row that rests there; the last steady one where none does
    arc: float  # [m]
    stood: float  # [s] that rows rest there
    beyond: float  # [s] that the stop cost beyond its assumed ramps and ``planned``
    planned: float  # [s] that the program waits there
    at_stop: bool  # where the program stops; else it was held


@dataclass(frozen=True, eq=False, slots=True)
class Windows:
    """Rates in W windows."""

    rate: Array  # (W,)
    begin: Array  # (W,) [s]
    end: Array  # (W,) [s]


def window_rates(time: Array, clock: Array, run: IntArray, inside: BoolArray) -> Windows:
    """Rates of a clock in windows, by least squares on rows (M,) that are ``inside``; a window lies in one run."""
    rows = np.flatnonzero(inside)
    if not len(rows):
        return Windows(np.zeros(0), np.zeros(0), np.zeros(0))
    t, c, r = time[rows], clock[rows], run[rows]
    width = max(WINDOW, (t[-1] - t[0]) / WINDOWS, WINDOW_ROWS * float(np.median(np.diff(time))))
    begins_run = np.append(True, np.diff(r) != 0)
    index = np.cumsum(begins_run) - 1
    first = t[begins_run][index]
    last = t[np.append(begins_run[1:], True)][index]
    long = last - first >= LONG_RUN
    if long.any() and long.sum() >= 0.5 * len(long) and not long.all():
        return window_rates(t[long], c[long], r[long], np.ones(int(long.sum()), dtype=bool))
    parts = np.maximum(np.floor((last - first) / width), 1)
    part = np.minimum(np.floor((t - first) / np.maximum(last - first, 1e-9) * parts), parts - 1)
    begins = np.flatnonzero(begins_run | np.append(True, np.diff(part) != 0))
    index = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(t))))
    count = np.bincount(index)
    x, y = t - t[begins][index], c - c[begins][index]
    mean_x, mean_y = np.bincount(index, x) / count, np.bincount(index, y) / count
    xx = np.bincount(index, x * x) - count * mean_x**2
    xy = np.bincount(index, x * y) - count * mean_x * mean_y
    ends = t[np.append(begins[1:], len(t)) - 1]
    good = (count >= 4) & (xx > 0) & (ends - t[begins] > 0.3 * width)
    good = good if good.any() else (count >= 3) & (xx > 0)
    return Windows((xy / np.where(xx > 0, xx, 1.0))[good], t[begins][good], ends[good])


def stretches_of(windows: Windows) -> tuple[tuple[Stretch, ...], float]:
    """Windows of one rate together, and how far rates scatter inside of them, rms."""
    rate, n = windows.rate, len(windows.rate)
    if not n:
        return (), np.inf
    beside = rate[np.clip(np.arange(n)[:, None] + [-1, 0, 1], 0, n - 1)]
    smooth = np.median(beside, axis=1) if n > 4 else rate
    noise = FINEST_RATE
    if n > 3:
        noise = max(1.4826 * float(np.median(np.abs(np.diff(rate)))) / np.sqrt(2), noise)
    edges = _merged(windows, _change_points(smooth / noise, 8 * np.log(max(n, 2)) + 8), noise)
    stretches, scatter = [], []
    for a, b in zip(edges[:-1], edges[1:], strict=True):
        weight = windows.end[a:b] - windows.begin[a:b]
        away = np.abs(rate[a:b] - np.median(rate[a:b]))
        near = away <= max(5 * noise, float(np.median(away)))
        value = float(np.average(rate[a:b][near], weights=weight[near]))
        scatter.append(rate[a:b] - value)
        sigma = 1.4826 * float(np.median(np.abs(scatter[-1]))) / np.sqrt(near.sum())
        stretches.append(Stretch(float(windows.begin[a]), float(windows.end[b - 1]), value, max(sigma, 1e-6)))
    return tuple(stretches), float(np.sqrt(np.mean(np.concatenate(scatter) ** 2)))


def badness(stretches: tuple[Stretch, ...], spread: float) -> float:
    """What stretches leave unexplained, with a price on each of them."""
    return float(np.log(spread**2 + FINEST_RATE**2)) + 0.5 * len(stretches)


def _change_points(values: Array, penalty: float) -> list[int]:
    """Edges of stretches of equal values: least squares with a price on each edge, the best of all."""
    n = len(values)
    total, squares = cumulated(values), cumulated(values**2)
    best, before = np.full(n + 1, -penalty), np.zeros(n + 1, dtype=np.int64)
    for k in range(1, n + 1):
        j = np.arange(k)
        price = best[:k] + squares[k] - squares[:k] - (total[k] - total[:k]) ** 2 / (k - j) + penalty
        before[k] = int(np.argmin(price))
        best[k] = price[before[k]]
    edges = [n]
    while edges[-1] > 0:
        edges.append(int(before[edges[-1]]))
    return edges[::-1]


def _merged(windows: Windows, edges: list[int], noise: float) -> list[int]:
    """Edges without those of stretches that are too short, or hardly another rate than their neighbour."""
    rate, edges = windows.rate, list(edges)
    while len(edges) > 2:
        medians = np.array([float(np.median(rate[a:b])) for a, b in zip(edges[:-1], edges[1:], strict=True)])
        sizes = np.diff(edges)
        steps = np.abs(np.diff(medians)) / np.maximum(medians[1:], medians[:-1])
        sure = np.maximum(SAME_RATE, 4 * noise * np.sqrt(1 / sizes[1:] + 1 / sizes[:-1]))
        lasts = windows.end[np.array(edges[1:]) - 1] - windows.begin[np.array(edges[:-1])]
        least = np.minimum(np.append(np.inf, steps), np.append(steps, np.inf))  # to the nearer neighbour
        brief = (lasts < BRIEF) & (least < SLIGHT) | (sizes < LEAST_STRETCH) & (len(rate) >= 4 * LEAST_STRETCH)
        if (steps < sure).any():
            del edges[int(np.argmin(steps / sure)) + 1]
        elif brief.any():
            i = int(np.flatnonzero(brief)[np.argmin(lasts[brief])])
            left, right = (steps[i - 1] if i else np.inf), (steps[i] if i < len(steps) else np.inf)
            del edges[i if left < right else i + 1]
        else:
            break
    return edges


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


def whole_rests(arc: Array, stands: list[tuple[int, int]], reach: float) -> list[tuple[int, int]]:
    """First and last row of each rest, with all rows that lie there within a reach [m]: once, if noise parted them."""
    rests: list[tuple[int, int]] = []
    for first, last in stands:
        begin, end = _all_at_rest(arc, first, last, reach)
        if rests and begin <= rests[-1][1]:
            begin, end = rests[-1][0], max(rests.pop()[1], end)
        rests.append((begin, end))
    return rests


def _all_at_rest(arc: Array, first: int, last: int, reach: float) -> tuple[int, int]:
    """First and last row of a stand with the rows beside its bins that lie where it does, within a reach [m]."""
    begin, place = max(first - RESTING_ROWS, 0), float(np.median(arc[first : last + 1]))
    rows = begin + np.flatnonzero(np.abs(arc[begin : last + RESTING_ROWS + 1] - place) <= reach)
    return int(min(first, rows[0])), int(max(last, rows[-1]))
