r"""The planned path: a piecewise curve laid onto a surface, cut into waypoints, each with the pose the tool shall have.

Waypoints follow curvature: on a curve of curvature K the path leaves a chord of length ds by a sag of K ds^2 / 8, so
the spacing is ds = sqrt(8 chord / K) at most, never above ``MAX_SPACING``. For a program of lines, where the period of
the controller is known, their ends stand off the path by half of the sag, ``balance``, so that they leave it to either
side: twice the sag is then within the chord, and the spacing is driven in whole periods (``whole_periods``). Between
waypoints the true path stays available: ``at`` gives the exact pose at any fraction of any segment's arc length.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, dot, frozen, numbered, owns, row_norms
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.planning import curves
from compgen.planning.exact_path import MAX_SPACING, NODES, WEIGHTS, ExactPath, PathPoses
from compgen.planning.lead_in import LeadIn
from compgen.planning.whole_periods import STRETCH, Cells, Periods, SegmentLayout, lay_out

CELLS = 48  # a piece, for its curvature
ALL_CELLS = 2_000_000  # of all pieces: a path of so many short ones has fewer each, two at least
SAFETY = 0.98  # of the spacing, for what the cells do not see
REFINEMENTS = 8  # rounds of narrowing the spacing where curvature changes faster than the cells see
ALIKE = 1e-7  # shares of their sag by which two lines may differ that are as long: rounding makes some 1e-10 of it
SIDES = 2.0  # of a line, to each of which it may leave the path by the chord
AT_STOP = (
    1.5  # times as far, in chords, a line leaves the path whose end at a stop stands on it: 3/4 of its sag, not 1/2
)
STRAIGHT = 1e-8  # m of sag
SAME_SIDE = 0.9  # cosine of two sags' angle
CORRECTIONS = 4  # of the places of waypoints, until segments have the lengths that are wanted
PLACED = 1e-8  # m
MIN_LENGTH = 1e-6  # m, of a pattern
MAX_WAYPOINTS = 2e7
CHUNK = 24_576  # cells at a time


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    arc=("N",), contact=("N",), stop=("N",), piece=("S",), span=("S", 2), slope=("S", 2), via=("N",), balance=("N", 3)
)
class ToolPath:
    """N waypoints with N - 1 segments between them."""

    exact: ExactPath
    target: Pose  # N of the TCP in World
    arc: Array  # (N,) [m] arc length from the first waypoint
    contact: BoolArray  # (N,) on the part
    stop: BoolArray  # (N,) the robot stops here
    piece: IntArray  # (N - 1,) which piece a segment lies on
    span: Array  # (N - 1, 2) its parameters there
    slope: Array  # (N - 1, 2) as ``ExactPath.length_and_slope`` has it
    via: BoolArray  # (N,) the program passes it in the middle of an arc
    balance: (
        Array  # (N, 3) [m] from the target to where the line's ends stand, so that it leaves the path to both sides
    )

    @property
    def pace(self) -> Array:
        """Share of the feed that each segment is driven at, (N - 1,)."""
        return self.exact.curve.pace[self.piece]

    def rows_on_part(self) -> IntArray:
        """Waypoints where the tool touches; all of a path that never does."""
        return np.flatnonzero(self.contact if self.contact.any() else np.ones_like(self.contact))

    def touching_segments(self) -> BoolArray:
        """Where the tool works, and touches at one end at least, (N - 1,)."""
        return np.asarray((self.contact[:-1] | self.contact[1:]) & self.exact.curve.working[self.piece])

    def segments_on_part(self) -> BoolArray:
        """The same, (N - 1,); all of a path that never touches."""
        touching = self.touching_segments()
        return touching if touching.any() else np.ones_like(touching)

    def at(self, segment: IntArray, fraction: Array) -> PathPoses:
        """M true poses at fractions of segments' arc lengths, and which way the path goes there."""
        length = self.arc[segment + 1] - self.arc[segment]
        return self.exact.at(self.piece[segment], self.span[segment], length, self.slope[segment], fraction)

    def subset(self, rows: IntArray, via: BoolArray | None = None) -> "ToolPath":
        """The path with the waypoints at these rows only: rising, both ends of every piece among them.

        Args:
            rows: Of the waypoints that stay, (M,).
            via: Which of them the program passes in the middle of an arc, (M,); none where it is not given.
        """
        span = np.column_stack([self.span[rows[:-1], 0], self.span[rows[1:] - 1, 1]])
        piece = self.piece[rows[:-1]]
        lines = via is None and self.balance.any()
        return replace(
            self,
            target=self.target[rows],
            arc=self.arc[rows],
            contact=self.contact[rows],
            stop=self.stop[rows],
            piece=piece,
            span=span,
            slope=self.exact.length_and_slope(piece, span)[1],
            via=np.zeros(len(rows), dtype=bool) if via is None else via,
            balance=balance_of(self.exact, piece, span, self.stop[rows]) if lines else np.zeros((len(rows), 3)),
        )


@dataclass(frozen=True, slots=True)
class LayoutSettings:
    """How far apart waypoints are."""

    chord: float  # [m] largest distance between the path and a line
    spacing: float = MAX_SPACING  # [m] largest distance of two waypoints
    periods: Periods | None = None  # of the controller, which lines last a whole number of; None: as the chord asks

    @property
    def sag(self) -> float:
        """Largest distance of the path from a line between two waypoints on it [m]."""
        return self.chord if self.periods is None else SIDES * self.chord


def plan_tool_path(
    bare: ExactPath, layout: LayoutSettings, *, lift: float = 0.0, lead_in: LeadIn | None = None
) -> ToolPath:
    """Waypoints of a pattern on a surface, with an approach and a retract along the tool axis.

    Args:
        bare: The pattern on its surface; waypoints beyond its boundary are not in contact.
        layout: How far apart waypoints are.
        lift: Length of approach and retract [m]; 0 leaves them out.
        lead_in: The approach, where it is not along the tool axis.

    Raises:
        InputError: The path has no length, needs too many waypoints, or leaves the surface.
    """
    pattern = bare.curve
    pieces = np.arange(len(pattern.poly))
    zeros = np.zeros(len(pieces))
    if bare.length(pieces, zeros, zeros + 1).sum() < MIN_LENGTH:
        raise InputError("path: it has zero length; give it a size")
    if lift > 0:
        (start, tilt), (end, tilt_end) = pattern.start(), pattern.end()
        above = bare.above(0, 0.0, lift) if lead_in is None else lead_in.start
        down = curves.line(above, start, stop=True, working=False)
        down = curves.tilted(down, tilt if lead_in is None else lead_in.tilt, tilt)
        up = curves.line(end, bare.above(len(pattern.poly) - 1, 1.0, lift), stop=True, working=False)
        pattern = curves.join(down, pattern, curves.tilted(up, tilt_end, tilt_end))
    exact = replace(bare, curve=pattern)
    return _laid(exact, _cells(exact, layout), layout)


class SegmentLimits(NamedTuple):
    """What a path's errors ask of its waypoints, by segments of one of its layouts."""

    arc: Array  # (N,) [m] of that layout
    spacing: Array  # (N - 1,) [m] largest distance of two waypoints
    stretch: Array  # (N - 1,) by which the correction lengthens a line


def relaid(path: ToolPath, limits: Sequence[SegmentLimits], layout: LayoutSettings) -> ToolPath:
    """The path laid out anew, within further limits."""
    cells = _cells(path.exact, layout)
    kept = np.flatnonzero(_kept(cells))
    limit, stretch = cells.limit[kept], cells.stretch[kept]
    at = cumulated(cells.length[kept])
    for wishes in limits:
        first = np.clip(np.searchsorted(wishes.arc, at[:-1], side="right") - 1, 0, len(wishes.spacing) - 1)
        last = np.clip(np.searchsorted(wishes.arc, at[1:]), first + 1, len(wishes.spacing))
        rows = np.column_stack([first, last]).ravel()
        least = np.minimum.reduceat(np.append(wishes.spacing, np.inf), rows)[::2]
        most = np.maximum.reduceat(np.append(wishes.stretch, 0.0), rows)[::2]
        limit = np.minimum(limit, least.reshape(limit.shape))
        stretch = np.maximum(stretch, STRETCH + most.reshape(limit.shape))
    cells.limit[kept], cells.stretch[kept] = limit, stretch
    return _laid(path.exact, cells, layout)


def _laid(exact: ExactPath, cells: Cells, settings: LayoutSettings) -> ToolPath:
    """Waypoints on a path whose cells are known.

    Raises:
        InputError: It needs too many of them.
    """
    curve = exact.curve
    keep = _kept(cells)
    needed = (cells.length / cells.limit).sum()
    if needed > MAX_WAYPOINTS:
        raise InputError(
            f"path: it needs {needed:.2g} waypoints, more than {MAX_WAYPOINTS:.0e}; "
            "raise process.chord_um or spacing_mm, or make it smaller"
        )
    # a piece that is dust hands its stop to the one before
    stops = curve.stop.copy()
    before = np.maximum.accumulate(np.where(keep, np.arange(len(keep)), -1))[~keep & stops]
    stops[before[before >= 0]] = True
    pieces = np.flatnonzero(keep)
    cells = Cells(*(values[keep] for values in cells))
    limit = np.minimum(cells.limit, cells.length.sum(axis=1, keepdims=True) / curve.least[keep, None])
    goes_on = np.zeros(len(pieces), dtype=bool)
    if settings.periods is not None:
        goes_on[1:] = curves.goes_on(curve)[pieces[:-1]] & (np.diff(pieces) == 1) & ~stops[pieces[:-1]]
    first, balanced = np.flatnonzero(~goes_on), settings.periods is not None
    for _ in range(REFINEMENTS):
        layout = lay_out(cells._replace(limit=limit), cells.limit, curve.pace[keep], first, settings.periods)
        at, row, span = _spans(exact, pieces, cells.length, first, layout, exactly=balanced)
        ends = np.cumsum(layout.per_chain)[np.append(stops[pieces[first[1:] - 1]], True)]
        sag = exact.chord(pieces[row], span)
        corners = ends[:-1][(np.minimum(sag[ends[:-1] - 1], sag[ends[:-1]]) > STRAIGHT) & balanced]
        beyond = sag / (SAFETY * settings.sag)
        beyond[np.concatenate([corners - 1, corners])] *= AT_STOP
        if not (beyond > 1).any():
            break
        limit = _narrowed(limit, at, beyond)
    stop = np.zeros(len(row) + 1, dtype=bool)
    stop[np.append(0, ends)] = True
    return _path(exact, pieces[row], span, stop, balanced=balanced)


def _kept(cells: Cells) -> BoolArray:
    """Pieces that are more than dust, (K,)."""
    return np.asarray((cells.length / cells.limit).sum(axis=1) > 1e-6)


def _narrowed(limit: Array, at: Array, beyond: Array) -> Array:
    """The limits (K, C) of the spacing, lower where segments leave the path too far.

    Args:
        limit: (K, C) [m].
        at: Where the segments begin and end in pieces of C cells, (S + 1,) counted on.
        beyond: How many times the chord each leaves it by, (S,).
    """
    C = limit.shape[1]
    bad = np.flatnonzero(beyond > 1)
    first = np.floor(at[bad] * C + 1e-9).astype(np.int64)
    size = np.maximum(np.ceil(at[bad + 1] * C - 1e-9).astype(np.int64) - first, 1)
    segment, number = numbered(size)
    cell = first[segment] + number
    lower = np.ones(limit.size)
    np.minimum.at(lower, np.minimum(cell, limit.size - 1), np.repeat(1 / np.sqrt(beyond[bad]) * SAFETY, size))
    return limit * lower.reshape(limit.shape)


def _path(exact: ExactPath, piece: IntArray, span: Array, stop: BoolArray, *, balanced: bool) -> ToolPath:
    """The path whose segments run over these parameters of their pieces."""
    point_piece = np.concatenate([[piece[0]], piece])
    target, on_part = exact.pose(point_piece, np.concatenate([[0.0], span[:, 1]]))
    length, slope = exact.length_and_slope(piece, span)
    arc = cumulated(length)
    working = exact.curve.working[point_piece]
    working[:-1] |= exact.curve.working[piece]  # a work piece's first point is in contact
    via = np.zeros(len(arc), dtype=bool)
    return ToolPath(
        exact=exact,
        target=target,
        arc=frozen(arc),
        contact=frozen(working & on_part),
        stop=frozen(stop),
        piece=frozen(piece),
        span=frozen(span),
        slope=frozen(slope),
        via=frozen(via),
        balance=frozen(balance_of(exact, piece, span, stop) if balanced else np.zeros((len(arc), 3))),
    )


def balance_of(exact: ExactPath, piece: IntArray, span: Array, stop: BoolArray) -> Array:
    """By how much the ends of lines stand beside the path, (N, 3) [m]: half the sag of the longer line at each.

    Then a line leaves the path by half its sag on either side. A corner between two curves stands on the path. Of two
    lines as long, as on a circle, it is the next one's, whatever a processor makes of their last digits.
    """
    sag, none = exact.sag(piece, span), np.zeros((1, 3))
    before, after = np.concatenate([none, sag]), np.concatenate([sag, none])
    size = row_norms(before), row_norms(after)
    balance = np.where((size[0] > size[1] * (1 + ALIKE))[:, None], before, after) / 2
    turns = dot(before, after) < SAME_SIDE * size[0] * size[1]  # a stop for a page's sake is no corner
    balance[stop & (np.minimum(*size) > STRAIGHT) & turns] = 0.0
    return balance


def _cells(exact: ExactPath, layout: LayoutSettings) -> Cells:
    """The path's pieces in cells: how long they are, and the spacing that the chord allows there."""
    K = len(exact.curve.poly)
    C = int(np.clip(ALL_CELLS // K, 2, CELLS))
    half = 0.5 / C
    nodes = ((np.linspace(0, 1, C + 1)[:-1] + half)[:, None] + half * NODES).ravel()
    length, limit = np.empty((K, C)), np.empty((K, C))
    for begin in range(0, K, CHUNK // C):
        pieces = np.arange(begin, min(begin + CHUNK // C, K))
        points = np.repeat(pieces, len(nodes)), np.tile(nodes, len(pieces))
        speed, spacing = exact.speed_and_spacing(*points, SAFETY**2 * layout.sag, layout.spacing)
        way = (np.tile(WEIGHTS * half, len(pieces) * C) * speed).reshape(-1, len(NODES))
        length[pieces] = way.sum(axis=1).reshape(-1, C)
        count = (way / spacing.reshape(way.shape)).sum(axis=1)
        dust = count == 0
        limit[pieces] = np.where(dust, layout.spacing, way.sum(axis=1) / np.where(dust, 1.0, count)).reshape(-1, C)
    return Cells(length, limit, np.full((K, C), STRETCH))


def _spans(
    exact: ExactPath, pieces: IntArray, cells: Array, first: IntArray, layout: SegmentLayout, *, exactly: bool
) -> tuple[Array, IntArray, Array]:
    """Where segments of some lengths begin and end.

    Args:
        exact: The path.
        pieces: Of it that are kept, (K,).
        cells: Their lengths, (K, C) [m].
        first: Which of them each chain begins with, (H,).
        layout: Of S segments.
        exactly: Whether lengths count, and not only their shares.

    Returns:
        Their ends counted on through pieces of length one, (S + 1,), the piece of each, (S,), its parameters, (S, 2).
    """
    K, C = cells.shape
    ends = np.cumsum(layout.per_chain)
    edge = cumulated(cells)
    start = edge[first * C]
    chain = np.repeat(np.arange(len(first)), layout.per_chain)
    way = np.cumsum(layout.length)
    way += (start - np.append(0.0, way[ends[:-1] - 1]))[chain]
    at = np.append(0.0, np.interp(way, edge, np.arange(K * C + 1) / C))
    at[np.append(0, ends)] = np.append(first, K)
    for _ in range(CORRECTIONS if exactly else 0):
        row = np.minimum(np.floor(at[:-1]).astype(np.int64), K - 1)
        length = exact.length(pieces[row], at[:-1] - row, at[1:] - row)
        actual = np.cumsum(length)
        actual += (start - np.append(0.0, actual[ends[:-1] - 1]))[chain]
        off = way - actual
        off[ends - 1] = 0.0
        at[1:] += off * (np.diff(at) / length)
        if np.abs(off).max() < PLACED:
            break
    row = np.minimum(np.floor(at[:-1]).astype(np.int64), K - 1)
    span = np.column_stack([at[:-1], at[1:]]) - row[:, None]
    last_of_piece = np.abs(span[:, 1] - 1) < 1e-12
    span[last_of_piece, 1] = 1.0
    return at, row, span
