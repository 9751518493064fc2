r"""Waypoints a whole number of interpolation periods apart: segments of a path laid out along its arc length.

A line of n periods at a feed v is planned as long as

    l_n = (n v T - r) / (1 + e)    with T the period, r what digits add to a length, e what a correction stretches it by

so that what the text says never lasts longer than n periods: a controller that rounds up would take one more. n is the
most that the spacing allows where the line lies. Where not even one period fits (n = 0), the path is cut as finely as
the spacing asks, and the speed follows the length.

The way is walked stretch by stretch of equal n, each with as many whole lines as fit. What is left at the end of a
chain (a row of pieces that are one smooth curve) becomes one more line, and all lines of n > 1 give it what it lacks:

    l = l_1 + g (l_n - l_1)        with one g for the chain

so that lines of one period keep theirs. A chain of lines of one period alone ends in a line of up to two, where the
spacing allows it, or else shares what it lacks among all of its lines. Many lines end in one as long as themselves.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray, cumulated, numbered

STRETCH = 5e-4  # e: of warm links, at 40 K; another error's own is added where it is known
WORD_STEP = 0.005  # relative: a share of the feed is written so exactly at least
EXACTLY = 1e-9  # periods, or lines: what rounding of floats may miss
MANY = 500  # lines of a chain, from where they give a last one of their own length: it costs them 0.2 % at most
DUST = 1e-6  # of a line that the spacing asks for


@dataclass(frozen=True, slots=True)
class Periods:
    """One interpolation period as a length of path."""

    length: float  # [m] driven in one period at the feed
    rounding: float  # [m] that the digits of two positions add to their distance at most


class Cells(NamedTuple):
    """A path of K pieces in C cells each, in driving order."""

    length: Array  # (K, C) [m]
    limit: Array  # (K, C) [m] of the spacing
    stretch: Array  # (K, C) e


class SegmentLayout(NamedTuple):
    """S segments along the arc length, chain after chain."""

    length: Array  # (S,) [m]
    per_chain: IntArray  # (H,) how many each chain has


def lay_out(cells: Cells, loosest: Array, pace: Array, first: IntArray, periods: Periods | None) -> SegmentLayout:
    """Segments that last whole periods where the spacing allows it.

    Args:
        cells: Of the path.
        loosest: Limits of the spacing for a line that takes the rest of a chain, (K, C) [m].
        pace: Share of the feed that each piece is driven at, (K,).
        first: The piece that each chain begins with, (H,).
        periods: None cuts as the spacing asks, everywhere.
    """
    C = cells.length.shape[1]
    one = np.full(len(pace), np.inf)  # v T of each piece
    rounding = 0.0
    if periods is not None:
        one, rounding = periods.length * np.where(pace == 1, 1.0, pace * (1 - WORD_STEP)), periods.rounding
        one = np.where(one > rounding, one, np.inf)  # so slow that digits hide a period: it does not matter there
    stretch = (1 + cells.stretch).ravel()
    unit = np.repeat(one, C)
    # next to a stretch of shorter lines none is longer than one period
    shortest = ((unit - rounding) / stretch).reshape(cells.limit.shape)
    n = np.floor((cells.limit.ravel() * stretch + rounding) / unit + EXACTLY).astype(np.int64)
    changes = np.zeros(len(n), dtype=bool)
    changes[first * C] = True
    changes[1:] |= n[1:] != n[:-1]
    begin = np.flatnonzero(changes)
    n, unit, stretch = n[begin], unit[begin], np.maximum.reduceat(stretch, begin)
    with np.errstate(invalid="ignore"):
        whole, single = (np.where(n > 0, (k * unit - rounding) / stretch, 0.0) for k in (n, 1))
    owner = np.searchsorted(first * C, begin, side="right") - 1
    way = _Way(
        cumulated(cells.length),
        cumulated(cells.length / np.minimum(cells.limit, shortest)),
        np.append(begin[1:], changes.size),
    )
    stretches = _Stretches(n=n, whole=whole, single=single, unit=unit, widest=stretch, owner=owner)
    walk = _walk(way, stretches)
    end = np.append(first[1:], len(pace)) * C
    return _with_rests(_lines(way, stretches, walk), stretches, walk.rest, loosest.ravel()[end - 1])


class _Way(NamedTuple):
    """The cells' edges along the way, and the ends of the Z stretches of equal n among them."""

    edge: Array  # (X + 1,) [m]
    lines: Array  # (X + 1,) before it, as short as the spacing asks
    end: IntArray  # (Z,) edge at which each stretch ends

    def counted(self, at: Array) -> Array:
        """Lines before some places (M,) [m]."""
        return np.interp(at, self.edge, self.lines)


class _Stretches(NamedTuple):
    """Z stretches of equal n along the way."""

    n: IntArray  # (Z,)
    whole: Array  # (Z,) [m] l_n
    single: Array  # (Z,) [m] l_1; 0 where n is 0
    unit: Array  # (Z,) [m] v T
    widest: Array  # (Z,) 1 + e
    owner: IntArray  # (Z,) their chain


class _Walk(NamedTuple):
    """How the stretches are filled."""

    lines: IntArray  # (Z,) of each
    begin: Array  # (Z,) [m] where the first of them begins
    finish: Array  # (Z,) [m] where the last of them ends
    rest: Array  # (H,) [m] left at the end of each chain


class _Lines(NamedTuple):
    """S lines."""

    length: Array  # (S,) [m]
    n: IntArray  # (S,) periods; 0 where they are shorter than one
    single: Array  # (S,) [m] l_1 there
    owner: IntArray  # (S,) their chain

    def with_more(self, at: IntArray, more: "_Lines") -> "_Lines":
        """With others before some rows."""
        return _Lines(*(np.insert(column, at, others) for column, others in zip(self, more, strict=True)))


def _walk(way: _Way, s: _Stretches) -> _Walk:
    """Whole lines into every stretch, all chains side by side.

    Where n rises the last line may reach over into the next stretch, where it falls it may not.
    """
    Z, H = len(s.n), int(s.owner[-1]) + 1
    head = np.searchsorted(s.owner, np.arange(H))
    size = np.diff(np.append(head, Z))
    lines, begin, finish = np.zeros(Z, dtype=np.int64), np.zeros(Z), np.zeros(Z)
    limit = way.edge[way.end]
    at = np.append(0.0, limit)[head]
    for k in range(int(size.max())):
        chain = np.flatnonzero(size > k)
        z, start = head[chain] + k, at[chain]
        begin[z] = start
        fine = s.n[z] == 0
        room = np.maximum(limit[z] - start, 0.0) / np.where(fine, 1.0, s.whole[z])
        fits, reaches = np.floor(room + EXACTLY), np.ceil(room - EXACTLY)
        after = np.minimum(z + 1, Z - 1)
        over = (k + 1 < size[chain]) & (s.n[after] > s.n[z]) & (start + reaches * s.whole[z] <= limit[after])
        # short lines may reach over as well, but not beyond the chain
        low, high = way.counted(start), way.counted(limit[z])
        wanted = np.where(limit[z] > start, np.maximum(np.ceil(high - low - DUST), 1), 0)
        to = np.minimum(np.interp(low + wanted, way.lines, way.edge), limit[(head + size - 1)[chain]])
        lines[z] = np.where(fine, wanted, np.where(over, reaches, fits))
        at[chain] = np.where(fine, np.where(wanted > 0, to, start), start + lines[z] * s.whole[z])
        finish[z] = at[chain]
    rest = limit[head + size - 1] - at
    return _Walk(lines, begin, finish, np.where(rest <= EXACTLY * s.unit[head], 0.0, rest))


def _lines(way: _Way, s: _Stretches, walk: _Walk) -> _Lines:
    """The lines of the stretches."""
    length, single = np.repeat(s.whole, walk.lines), np.repeat(s.single, walk.lines)
    n, chain = np.repeat(s.n, walk.lines), np.repeat(s.owner, walk.lines)
    fine = np.flatnonzero((s.n == 0) & (walk.lines > 0))
    if len(fine):
        # evenly in the count of lines that the spacing asks for
        k, begin, end = walk.lines[fine], walk.begin[fine], walk.finish[fine]
        low, high = way.counted(begin), way.counted(end)
        row, step = numbered(k)
        step += 1
        ends = np.interp(low[row] + (high - low)[row] * step / k[row], way.lines, way.edge)
        ends[step == k[row]] = end
        length[n == 0] = ends - np.where(step == 1, begin[row], np.append(0.0, ends[:-1]))
    return _Lines(length, n, single, chain)


def _with_rests(lines: _Lines, s: _Stretches, rest: Array, limit: Array) -> SegmentLayout:
    """The lengths of all segments, with what is left at the ends of the chains.

    Args:
        lines: Of the stretches.
        s: The stretches.
        rest: Left at the end of each chain, (H,) [m].
        limit: Of the spacing there, (H,) [m].
    """
    H = len(rest)
    last = np.append(np.flatnonzero(np.diff(s.owner)), len(s.owner) - 1)  # stretch of each chain
    unit, widest, single = s.unit[last], s.widest[last], s.single[last]
    rounding = np.where(single > 0, unit - single * widest, 0.0)
    left = rest > 0
    size = np.bincount(lines.owner, minlength=H)
    with np.errstate(invalid="ignore"):
        n = np.where(left, np.maximum(np.ceil((rest * widest + rounding) / unit - EXACTLY), 1), 0).astype(np.int64)
        n = np.where(left & (size > MANY), s.n[last], n)
        more = np.where(left, (n * unit - rounding) / widest, 0.0)
    slack = (
        np.bincount(lines.owner, (lines.n > 0) * (lines.length - lines.single), minlength=H) + (more - single) * left
    )
    lacking = np.where(left, more - rest, 0.0)
    gives = left & (slack >= lacking)
    # lines of one period alone: the last of them takes the rest, or all share what is lacking
    final = np.maximum(np.cumsum(size) - 1, 0)
    takes = left & ~gives & (size > 0) & (size <= MANY) & (limit >= single + rest)
    takes[takes] = lines.n[final[takes]] == 1
    length = lines.length.copy()
    length[final[takes]] += rest[takes]
    grows = np.flatnonzero(left & ~takes)
    whole = lines._replace(length=length).with_more(
        np.cumsum(size)[grows], _Lines(more[grows], n[grows], single[grows], grows)
    )
    g = np.where(gives, 1 - lacking / np.where(slack > 0, slack, 1.0), 1.0)[whole.owner]
    length = np.where(whole.n > 0, whole.single + g * (whole.length - whole.single), whole.length)
    ones = np.bincount(whole.owner, (whole.n == 1) * length, minlength=H)
    f = np.where(left & ~takes & ~gives, 1 - lacking / np.where(ones > 0, ones, 1.0), 1.0)[whole.owner]
    return SegmentLayout(np.where(whole.n == 1, f * length, length), np.bincount(whole.owner, minlength=H))
