r"""The planned path: a piecewise curve laid onto a surface, cut into waypoints, each with the pose the tool shall have.

Waypoints follow curvature: on a curve of curvature K a chord of length ds leaves it by K ds^2 / 8, so the spacing is
ds = sqrt(8 chord / K), never above ``MAX_SPACING``. Between waypoints the true path stays available: ``at`` gives the
exact pose at any fraction of any segment's arc length.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen, own
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.planning import curves
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.exact_path import MAX_SPACING, NODES, WEIGHTS, ExactPath, PathPoses
from compgen.planning.lead_in import LeadIn
from compgen.planning.surfaces import Quadric

CELLS = 48  # a piece, for its curvature
ALL_CELLS = 2_000_000  # of all pieces: a path of so many short ones has fewer each, two at least
SAFETY = 0.98  # of the spacing, for what the cells do not see
REFINEMENTS = 8  # rounds of adding segments where a piece's curvature changes faster than its cells see
MIN_LENGTH = 1e-6  # m, of a pattern
MAX_WAYPOINTS = 2e7
CHUNK = 24_576  # cells at a time


@dataclass(frozen=True, eq=False, slots=True)
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

    def __post_init__(self) -> None:
        own(
            self,
            arc=("N",),
            contact=("N",),
            stop=("N",),
            piece=("S",),
            span=("S", 2),
            slope=("S", 2),
            via=("N",),
        )

    @property
    def pace(self) -> Array:
        """Share of the feed that each segment is driven at, (N - 1,)."""
        return self.exact.curve.pace[self.piece]

    def at(self, segment: IntArray, fraction: Array) -> PathPoses:
        """M true poses at fractions of segments' arc lengths, and which way the path goes there."""
        first, last = int(segment.min(initial=0)), int(segment.max(initial=0)) + 1
        length = np.diff(self.arc[first : last + 1])[segment - first]
        return self.exact.at(self.piece[segment], self.span[segment], length, self.slope[segment], fraction)

    def subset(self, rows: IntArray, via: BoolArray | None = None) -> "ToolPath":
        """The path with the waypoints at these rows only: rising, both ends of every piece among them.

        Args:
            rows: Of the waypoints that stay, (M,).
            via: Which of them the program passes in the middle of an arc, (M,); none where it is not given.
        """
        span = np.column_stack([self.span[rows[:-1], 0], self.span[rows[1:] - 1, 1]])
        piece = self.piece[rows[:-1]]
        return replace(
            self,
            target=self.target[rows],
            arc=self.arc[rows],
            contact=self.contact[rows],
            stop=self.stop[rows],
            piece=piece,
            span=span,
            slope=self.exact.length_and_slope(piece, span).slope,
            via=np.zeros(len(rows), dtype=bool) if via is None else via,
        )


def plan_tool_path(
    pattern: PiecewiseCurve,
    surface: Quadric,
    boundary: Boundary,
    *,
    spin: float,
    chord: float,
    lift: float,
    spacing: float = MAX_SPACING,
    lead_in: LeadIn | None = None,
    frame: Pose | None = None,
) -> ToolPath:
    """Waypoints of a pattern on a surface, with an approach and a retract along the tool axis.

    Args:
        pattern: The curve in the surface's local plane.
        surface: What it lies on.
        boundary: The part's edge; waypoints outside are not in contact.
        spin: The tool's x axis against base x [rad].
        chord: Largest distance between the path and the straight line between two waypoints [m].
        lift: Length of approach and retract [m]; 0 leaves them out.
        spacing: Largest distance of two waypoints [m].
        lead_in: The approach, where it is not along the tool axis.
        frame: That the surface stands in; None: World.

    Raises:
        InputError: The path has no length, needs too many waypoints, or leaves the surface.
    """
    pieces = np.arange(len(pattern.poly))
    zeros = np.zeros(len(pieces))
    bare = ExactPath(pattern, surface, boundary, spin, frame)
    if bare.length(pieces, zeros, zeros + 1).sum() < MIN_LENGTH:
        raise InputError("path: it has zero length; give it a size")
    if lift > 0:
        (start, tilt), (end, tilt_end) = pattern.start(), pattern.end()
        above = bare.above(0, 0.0, lift) if lead_in is None else lead_in.start
        down = curves.line(above, start, stop=True, working=False)
        down = curves.tilted(down, tilt if lead_in is None else lead_in.tilt, tilt)
        up = curves.line(end, bare.above(len(pattern.poly) - 1, 1.0, lift), stop=True, working=False)
        pattern = curves.join(down, pattern, curves.tilted(up, tilt_end, tilt_end))
    exact = ExactPath(pattern, surface, boundary, spin, frame)
    share, parameter, wanted = _segment_density(exact, chord, spacing)
    keep = wanted > 1e-6
    if wanted.sum() > MAX_WAYPOINTS:
        raise InputError(
            f"path: it needs {wanted.sum():.2g} waypoints, more than {MAX_WAYPOINTS:.0e}; "
            "raise process.chord_um or spacing_mm, or make it smaller"
        )
    # a piece that is dust hands its stop to the one before
    stops = pattern.stop.copy()
    before = np.maximum.accumulate(np.where(keep, np.arange(len(keep)), -1))[~keep & stops]
    stops[before[before >= 0]] = True
    segments = np.where(keep, np.maximum(np.ceil(wanted - 1e-6), pattern.least), 0).astype(np.int64)
    pieces = np.flatnonzero(segments)
    for _ in range(REFINEMENTS):
        piece, span = _spans(pieces, segments[pieces], share, parameter)
        ratio = exact.chord(piece, span) / (SAFETY * chord)
        worst = np.maximum.reduceat(ratio, np.cumsum(segments[pieces]) - segments[pieces])
        pieces, worst = pieces[worst > 1], worst[worst > 1]
        if not len(pieces):
            break
        segments[pieces] = np.ceil(segments[pieces] * np.sqrt(worst) + 0.5)
    pieces = np.flatnonzero(segments)
    if len(piece) < segments.sum():
        piece, span = _spans(pieces, segments[pieces], share, parameter)
    stop = np.zeros(len(piece) + 1, dtype=bool)
    stop[np.cumsum(segments[pieces])] = stops[pieces]
    stop[[0, -1]] = True
    return _path(exact, piece, span, stop)


def subdivided(path: ToolPath, parts: IntArray) -> ToolPath:
    """The path with each segment cut into ``parts`` (N - 1,) of equal parameter; stops stay where they are."""
    owner = np.repeat(np.arange(len(parts)), parts)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    start, size = path.span[owner, 0], np.diff(path.span[owner], axis=1)[:, 0]
    last = step == parts[owner] - 1
    end = np.where(last, path.span[owner, 1], start + size * (step + 1) / parts[owner])
    span = np.column_stack([start + size * step / parts[owner], end])
    stop = np.concatenate([path.stop[:1], last & path.stop[1:][owner]])
    return _path(path.exact, path.piece[owner], span, stop)


def _path(exact: ExactPath, piece: IntArray, span: Array, stop: BoolArray) -> ToolPath:
    """The path whose segments run over these parameters of their pieces."""
    point_piece = np.concatenate([[piece[0]], piece])
    point_t = np.concatenate([[0.0], span[:, 1]])
    target, on_part = exact.pose(point_piece, point_t)
    length, slope = exact.length_and_slope(piece, span)
    arc = np.concatenate([[0.0], np.cumsum(length)])
    working = exact.curve.working[point_piece]
    working[:-1] |= exact.curve.working[piece]  # a work piece's first point is in contact
    return ToolPath(
        exact=exact,
        target=target,
        arc=frozen(arc),
        contact=frozen(working & on_part),
        stop=frozen(stop),
        piece=frozen(piece),
        span=frozen(span),
        slope=frozen(slope),
        via=frozen(np.zeros(len(arc), dtype=bool)),
    )


def _segment_density(exact: ExactPath, chord: float, max_spacing: float) -> tuple[Array, Array, Array]:
    """How many segments each piece wants, and how densely they lie along it.

    Piece k occupies [k, k + 1] on both axes of one running curve: the share of its segments over its parameter.

    Returns:
        The curve's shares and parameters, (K (C + 1),) each, and the number of segments wanted, (K,).
    """
    K = len(exact.curve.poly)
    C = int(np.clip(ALL_CELLS // K, 2, CELLS))
    edges = np.linspace(0, 1, C + 1)
    half = 0.5 / C
    nodes = ((edges[:-1] + half)[:, None] + half * NODES).ravel()
    cells = np.empty((K, C))
    for begin in range(0, K, CHUNK // C):
        pieces = np.arange(begin, min(begin + CHUNK // C, K))
        points = np.repeat(pieces, len(nodes)), np.tile(nodes, len(pieces))
        speed, spacing = exact.speed_and_spacing(*points, SAFETY**2 * chord, max_spacing)
        count = np.tile(WEIGHTS * half, len(pieces) * C) * speed / spacing
        cells[pieces] = count.reshape(len(pieces), C, len(NODES)).sum(axis=2)
    wanted: Array = np.asarray(cells.sum(axis=1))
    share = np.cumsum(cells, axis=1) / np.where(wanted > 0, wanted, 1.0)[:, None]
    start = np.arange(K, dtype=float)[:, None]
    return (start + np.column_stack([np.zeros(K), share])).ravel(), (start + edges).ravel(), wanted


def _spans(pieces: IntArray, segments: IntArray, share: Array, parameter: Array) -> tuple[IntArray, Array]:
    """Each segment's piece and its parameters, (S,) and (S, 2), of pieces cut into so many segments, (K,) each."""
    piece = np.repeat(pieces, segments)
    last = np.cumsum(segments) - 1
    first = last + 1 - segments
    step = np.arange(1, len(piece) + 1) - np.repeat(first, segments)
    span = np.empty((len(piece), 2))
    span[:, 1] = np.interp(piece + step / np.repeat(segments, segments), share, parameter) - piece
    span[last, 1] = 1.0
    span[1:, 0] = span[:-1, 1]
    span[first, 0] = 0.0
    return piece, span
