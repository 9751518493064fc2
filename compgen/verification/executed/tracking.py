r"""Where along a course each row of a log is: nearest points by rising arc length, on marks first, then by millions.

Marks are rows that are one step of travelled way apart. From a mark at arc length s the next one is expected at

    s + L_(k+1) - L_k,       L the way that the log itself has travelled,

and its nearest point is looked for about there, the farther from there the dearer, and never back: a course that
crosses itself, lies beside itself or comes back on its own way is followed in order, whatever the override, and however
long the robot stands. The log may begin anywhere on the course: every place near its first mark is tried, and the one
that it can be followed from for longest is taken.

From the marks every row has an expected arc length. It is moved along the course until the row lies square to it,
s <- s + (p - q(s)) . t(s), and of the ways about there the one with the nearest point is taken, no farther along than a
corner is cut: another pass over the same line may be the next way but one.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, dot, lengths_along, owns, step_lengths
from compgen.verification.executed.course import ProgramCourse

GATE = 5e-3  # [m] off the course, and yet on it: corrections are clamped at 3 mm
MARKS = 3000  # of a log
FINEST = 2e-4  # [m] between marks
SLACK = 0.1  # of the step between two marks: chords are shorter than arcs
STARTS = 24  # places that a log is followed from
TRIAL = 150  # marks by which starts are compared first
PROGRESS = 0.05  # of a square metre off the expected place, against one off the course
SAME_PLACE = 5e-5  # [m] more off the course: starts between which only the order tells, so the earliest comes first
MOVED = 8  # times the noise: what moves a row by less is noise
BACK = 3e-4  # [m] that a mark may lie behind the one before: the log's noise
AHEAD = 20e-3  # [m] that a mark may be ahead of where it is expected: a corner is cut short
LOST = 12  # marks off the course in a row: it is looked for anew further along
LEAST_SHARE = 0.6  # of the marks that must lie on the course
LEAST_COVERED = 0.02  # [m] of the course, or a hundredth of it where that is shorter
SAME_WAY = 0.75, 1.35  # way along the course over way of the log
STEPS = 3  # along the course, from where a row is expected
FARTHEST = 3e-3  # [m] that one of them goes
STILL = 1e-9  # [m] by which none goes farther: all are there
TIE = 1e-18  # m2: of two ways as near, the expected one
NEIGHBOURS = (0, -1, 1, -2, 2)
BLOCK = 262_144  # rows at a time
THINNED = 200_000  # rows at most that marks are taken from


@dataclass(frozen=True, eq=False, slots=True)
@owns(row=("K",), travelled=("K",), arc=("K",), distance=("K",), on=("K",))
class Track:
    """K marks of a log along a course."""

    row: IntArray  # (K,) rows of the log
    travelled: Array  # (K,) [m] by the log
    arc: Array  # (K,) [m] along the course
    distance: Array  # (K,) [m] off it
    on: BoolArray  # (K,) nearer than the gate

    @property
    def share(self) -> float:
        """Of the marks from the first to the last that is on the course, those that are."""
        on = np.flatnonzero(self.on)
        return float(self.on[on[0] : on[-1] + 1].mean()) if len(on) else 0.0

    @property
    def covered(self) -> float:
        """Way along the course from the first to the last mark that is on it [m]."""
        on = np.flatnonzero(self.on)
        return float(self.arc[on[-1]] - self.arc[on[0]]) if len(on) else 0.0


def fits(course: ProgramCourse, track: Track) -> bool:
    """Whether a track says that its log is of this course."""
    on = np.flatnonzero(track.on)
    if len(on) < 3 or track.share < LEAST_SHARE or track.covered < min(LEAST_COVERED, 0.01 * course.length):
        return False
    way = float(track.travelled[on[-1]] - track.travelled[on[0]])
    return SAME_WAY[0] <= track.covered / max(way, 1e-9) <= SAME_WAY[1]


def travelled_way(position: Array, noise: float) -> Array:
    """Way travelled at each row of a log, (M, 3) [m] to (M,) [m]; what noise moves a standing robot by is left out."""
    rows = np.append(np.arange(0, len(position) - 1, max(1, len(position) // THINNED)), len(position) - 1)
    kept, last = [0], position[rows[0]]
    steps = step_lengths(position[rows])
    if (steps > MOVED * noise).all():
        return np.asarray(np.interp(np.arange(len(position)), rows, cumulated(steps)))
    least = (MOVED * noise) ** 2
    places = position[rows].tolist()
    x, y, z = last.tolist()
    for k, (a, b, c) in enumerate(places):
        if (a - x) ** 2 + (b - y) ** 2 + (c - z) ** 2 > least:
            kept.append(k)
            x, y, z = a, b, c
    way = lengths_along(position[rows[kept]])
    return np.asarray(np.interp(np.arange(len(position)), rows[kept], way))


def marks(travelled: Array) -> IntArray:
    """Rows one step of way apart, the first and the last among them."""
    goal = np.arange(travelled[0], travelled[-1], max(float(travelled[-1] - travelled[0]) / MARKS, FINEST))
    return np.unique(np.concatenate([[0], np.searchsorted(travelled, goal), [len(travelled) - 1]]))


def follow(course: ProgramCourse, position: Array, travelled: Array, gate: float = GATE) -> Track:
    """A log laid along a course, as far as it can be.

    Args:
        course: Of the program.
        position: Of the log in the course's frame, (M, 3) [m].
        travelled: Way at each row, (M,) [m].
        gate: How far off the course a mark may be [m].
    """
    row = marks(travelled)
    follower = _Follower(course, position[row], travelled[row], gate)
    near = np.flatnonzero(follower.near())
    if not len(near):
        nothing = np.zeros(len(row))
        return Track(row, travelled[row], nothing, nothing + np.inf, np.zeros(len(row), dtype=bool))
    first = int(near[0])
    starts = follower.places(first)
    if len(starts) > 1:
        trials = [follower.run(first, start, min(first + TRIAL, len(row))) for start in starts]
        count = np.array([on.sum() for _, _, on in trials])
        away = np.array([np.minimum(d, gate).mean() for _, d, _ in trials])
        alike = (count > count.max() - 2) & (away <= away[count > count.max() - 2].min() + SAME_PLACE)
        starts = starts[np.lexsort((np.where(alike, starts, away), ~alike))[: max(1, STARTS // 6)]]
    runs = [follower.run(first, start, len(row)) for start in starts]
    counts = [(int(on.sum()), -float(np.minimum(d, gate).sum())) for _, d, on in runs]
    arc, distance, on = runs[max(range(len(runs)), key=lambda i: counts[i])]
    return Track(row, travelled[row], arc, distance, on)


class _Follower:
    """A course prepared for following marks along it."""

    def __init__(self, course: ProgramCourse, place: Array, travelled: Array, gate: float) -> None:
        self.course, self.place, self.travelled, self.gate = course, place, travelled, gate
        self.start, self.step = course.position[:-1], np.diff(course.position, axis=0)
        self.squared = np.maximum(dot(self.step, self.step), 1e-24)
        self.lengths = np.diff(course.arc)
        spacing = max(course.length / 400_000, 1e-4, gate / 4)
        self.sample = np.unique(np.concatenate([course.arc, np.arange(0.0, course.length, spacing)]))
        self.tree = cKDTree(course.place(self.sample))
        self.reach = gate + spacing

    def near(self) -> BoolArray:
        """Marks that are near the course anywhere."""
        distance, _ = self.tree.query(self.place, distance_upper_bound=self.reach)
        return np.asarray(np.isfinite(distance))

    def places(self, mark: int, after: float = -np.inf) -> Array:
        """Arc lengths at which the course comes near a mark, each once, the nearest first."""
        rows = np.array(sorted(self.tree.query_ball_point(self.place[mark], self.reach)), dtype=np.int64)
        rows = rows[self.sample[rows] >= after]
        if not len(rows):
            return np.zeros(0)
        distance = np.linalg.norm(self.course.place(self.sample[rows]) - self.place[mark], axis=1)
        passes = np.split(np.arange(len(rows)), np.flatnonzero(np.diff(rows) > 1) + 1)
        best = np.array([one[np.argmin(distance[one])] for one in passes])
        order = np.argsort(distance[best], kind="stable")[:STARTS]
        return np.asarray(self.sample[rows[best[order]]])

    def run(self, first: int, start: float, last: int) -> tuple[Array, Array, BoolArray]:
        """Arc length, distance and whether on the course of marks, followed from ``first`` at ``start`` to ``last``."""
        K = len(self.place)
        arc, distance, on = np.full(K, np.nan), np.full(K, np.inf), np.zeros(K, dtype=bool)
        s, top, missed, last_on = start, start, 0, 0.0
        for k in range(first, last):
            ahead = float(self.travelled[k] - self.travelled[k - 1]) if k > first else 0.0
            window = SLACK * ahead + 2 * FINEST + self.gate / 4
            back = min(window, s + ahead - top + BACK) if k > first else self.gate
            near, away = self._nearest(self.place[k], s + ahead, back, max(window, AHEAD))
            if away <= self.gate:
                s, missed, last_on = near, 0, near
                top = max(top, near) if k > first else near
                arc[k], distance[k], on[k] = near, away, True
                continue
            s, missed = min(s + ahead, self.course.length), missed + 1
            arc[k], distance[k] = s, away
            if missed >= LOST:
                anew = self.places(k, after=last_on - self.gate)
                if len(anew):
                    s, missed = float(anew.min()), 0
                else:
                    s = last_on
        arc[:first] = arc[first]
        known = np.isfinite(arc)
        arc[~known] = arc[known][-1] if known.any() else 0.0
        return arc, distance, on

    def _nearest(self, point: Array, expected: float, back: float, ahead: float) -> tuple[float, float]:
        """The nearest place of the course about the arc length that is expected, and how far it is."""
        arc = self.course.arc
        a = max(int(np.searchsorted(arc, expected - back, side="right")) - 1, 0)
        b = max(min(int(np.searchsorted(arc, expected + ahead)), len(self.lengths)), a + 1)
        a, b = min(a, len(self.lengths) - 1), min(b, len(self.lengths))
        away = point - self.start[a:b]
        share = np.einsum("ij,ij->i", away, self.step[a:b]) / self.squared[a:b]
        length = np.maximum(self.lengths[a:b], 1e-12)
        low, high = (np.clip((s - arc[a:b]) / length, 0.0, 1.0) for s in (expected - back, expected + ahead))
        share = np.clip(share, low, high)
        off = away - share[:, None] * self.step[a:b]
        squared = np.einsum("ij,ij->i", off, off)
        places = arc[a:b] + share * self.lengths[a:b]
        k = int(np.argmin(squared + PROGRESS * (places - expected) ** 2))
        return float(arc[a + k] + share[k] * self.lengths[a + k]), float(np.sqrt(squared[k]))


@dataclass(frozen=True, eq=False, slots=True)
@owns(arc=("M",), way=("M",), off=("M", 3), distance=("M",))
class Projection:
    """M rows of a log beside the course."""

    arc: Array  # (M,) [m]
    way: IntArray  # (M,)
    off: Array  # (M, 3) [m] from the nearest point of the course to the row
    distance: Array  # (M,) [m]


def project(course: ProgramCourse, position: Array, travelled: Array, track: Track) -> Projection:
    """The nearest points to all rows of a log, (M, 3) [m], that a track has laid along the course."""
    on = track.on  # of marks off the course it is a guess where they are
    expected = np.clip(np.interp(travelled, *rising(track.travelled[on], track.arc[on])), 0.0, course.length)
    M = len(position)
    arc, way, off = np.empty(M), np.empty(M, dtype=np.int64), np.empty((M, 3))
    tangent = course.tangents()
    for rows in (slice(begin, begin + BLOCK) for begin in range(0, M, BLOCK)):
        arc[rows], way[rows], off[rows] = nearest(course.position, course.arc, tangent, position[rows], expected[rows])
    return Projection(arc, way, off, np.sqrt(dot(off, off)))


def rising(x: Array, y: Array) -> tuple[Array, Array]:
    """Pairs without those whose x does not rise."""
    keep = np.append(True, np.diff(x) > 0)
    return x[keep], y[keep]


def nearest(
    nodes: Array, arc_at: Array, tangent: Array, points: Array, arc: Array, steps: int = STEPS
) -> tuple[Array, IntArray, Array]:
    """Nearest points of a polyline to others, each looked for about an expected arc length.

    Args:
        nodes: Of the polyline, (N, 3) [m].
        arc_at: Arc length at them, (N,) [m].
        tangent: Of its ways, (N - 1, 3).
        points: (M, 3) [m].
        arc: Expected, (M,) [m].
        steps: Of ``FARTHEST`` at most, from there.

    Returns:
        Arc length (M,), way (M,), and the vector from the nearest point (M, 3).
    """
    last, end, length = len(arc_at) - 2, float(arc_at[-1]), np.diff(arc_at)

    def way_of(arc: Array) -> IntArray:
        return np.minimum(np.maximum(np.searchsorted(arc_at, arc, side="right") - 1, 0), last)

    for _ in range(steps):
        k = way_of(arc)
        t = tangent.take(k, axis=0)
        q = nodes.take(k, axis=0) + (arc - arc_at.take(k))[:, None] * t
        step = np.minimum(np.maximum(dot(points - q, t), -FARTHEST), FARTHEST)
        before, arc = arc, np.minimum(np.maximum(arc + step, 0.0), end)
        if np.abs(arc - before).max(initial=0.0) < STILL:
            break
    k = way_of(arc)
    best = np.full(len(arc), np.inf)
    best_arc, best_way, best_off = arc.copy(), k.copy(), np.zeros((len(arc), 3))
    for neighbour in NEIGHBOURS:
        way = np.minimum(np.maximum(k + neighbour, 0), last)
        start, t = nodes.take(way, axis=0), tangent.take(way, axis=0)
        share = np.minimum(np.maximum(dot(points - start, t), 0.0), length.take(way))
        off = points - (start + share[:, None] * t)
        squared = dot(off, off)
        place = arc_at.take(way) + share
        nearer = (squared < best - TIE) & ((neighbour == 0) | (np.abs(place - arc) <= AHEAD))
        best[nearer] = squared[nearer]
        best_arc[nearer] = place[nearer]
        best_way[nearer], best_off[nearer] = way[nearer], off[nearer]
    return best_arc, best_way, best_off


def components(
    course: ProgramCourse, projection: Projection, rows: IntArray | BoolArray | slice
) -> tuple[Array, Array]:
    """Across the travel in the surface, and along the tool's axis away from the surface, of some rows [m].

    side = t x z / |t x z|, across = off . side, normal = - off . z, z the tool's axis at the nearest node.
    """
    way, off = projection.way[rows], projection.off[rows]
    z = course.rotation[way, :, 2]
    side = np.cross(course.tangents()[way], z)
    size = np.sqrt(dot(side, side))
    leads = size < 0.5  # along the tool's own axis there is no side: the tool's x serves
    side = np.where(leads[:, None], course.rotation[way, :, 1], side / np.where(leads, 1.0, size)[:, None])
    return dot(off, side), -dot(off, z)
