r"""Where the tool shall go, by closed form: straight lines and windings in x, y along a surface and height above it.

A winding is r = r0 + (r1 - r0) t over angles f0 + (f1 - f0) t about the pattern's centre: an arc or a spiral. Each
pattern is what docs/keys.md says of it; the approach comes down onto its first point, the retract leaves its last.
"""

from dataclasses import dataclass

import numpy as np

FOUND_MM = 1e-5  # from the end of a piece to the waypoint there
ENDS = 1e-6  # of a piece's parameter


class OffCurveError(Exception):
    """The waypoints are not a walk along the curve."""


@dataclass(frozen=True)
class Straight:
    """From a to b, each (3,) x, y, height [mm]."""

    a: np.ndarray
    b: np.ndarray
    touching: bool = True  # the tool may touch here

    def at(self, t):
        """Points, (M, 3) [mm]."""
        return self.a + t[:, None] * (self.b - self.a)

    def slope(self, t):
        """d point / dt, (M, 3) [mm]."""
        return np.tile(self.b - self.a, (len(t), 1))

    def parameter(self, xyh):
        """t of points near it in their order, (M,)."""
        way = self.b - self.a
        return (xyh - self.a) @ way / (way @ way)


@dataclass(frozen=True)
class Winding:
    """From radius r0 at angle f0 to r1 at f1 [mm], [rad]."""

    r0: float
    r1: float
    f0: float
    f1: float
    touching: bool = True

    def at(self, t):
        """Points, (M, 3) [mm]."""
        r, f = self.r0 + t * (self.r1 - self.r0), self.f0 + t * (self.f1 - self.f0)
        return np.column_stack([r * np.cos(f), r * np.sin(f), 0 * t])

    def slope(self, t):
        """d point / dt, (M, 3) [mm]."""
        r, f = self.r0 + t * (self.r1 - self.r0), self.f0 + t * (self.f1 - self.f0)
        dr, df = self.r1 - self.r0, self.f1 - self.f0
        return np.column_stack([dr * np.cos(f) - r * df * np.sin(f), dr * np.sin(f) + r * df * np.cos(f), 0 * t])

    def parameter(self, xyh):
        """t of points near it in their order, (M,): by their angle, and nearest to them."""
        angle = np.arctan2(xyh[:, 1], xyh[:, 0])
        angle[0] = self.f0  # the middle of a spiral has none
        t = (np.unwrap(angle) - self.f0) / (self.f1 - self.f0)
        for _ in range(2):
            slope = self.slope(t)
            t = t + ((xyh - self.at(t)) * slope).sum(axis=1) / (slope * slope).sum(axis=1)
        return t


def pattern(table, boundary):
    """The pieces of a path file's [path], in the order in which they are driven."""
    kind = table["pattern"]
    if kind == "line":
        h = table["length_mm"] / 2
        ends = {"x": ([-h, 0, 0], [h, 0, 0]), "y": ([0, -h, 0], [0, h, 0]), "z": ([0, 0, 0], [0, 0, 2 * h])}
        return _polyline(ends[table["axis"]])
    if kind == "circle":
        return [_circle(table["diameter_mm"] / 2, 0.0)]
    if kind == "spiral":
        R = table["diameter_mm"] / 2 if "diameter_mm" in table else boundary.outer_radius
        turns = table["turns"] if "turns" in table else R / table["stepover_mm"]
        return [Winding(0.0, R, 0.0, 2 * np.pi * turns)]
    if kind == "raster":
        return _raster(table, boundary)
    L = table["size_mm"]  # iso9283: square, circle of 0.8 sides, circle of 0.1 sides, meander back
    square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0, -0.5), (0, -0.4)]
    meander = [(0, -0.05), (-0.2, -0.05), (-0.2, 0.1), (-0.3, 0.1), (-0.3, -0.1), (-0.4, 0), (-0.4, -0.5), (-0.5, -0.5)]
    to_small = _flat([(0, -0.4), (0, -0.05)], L)
    return [
        *_flat(square, L),
        _circle(0.4 * L, -np.pi / 2),
        *to_small,
        _circle(0.05 * L, -np.pi / 2),
        *_flat(meander, L),
    ]


def with_lift(pieces, lift_mm):
    """Pieces between the approach and the retract."""
    start, end = pieces[0].at(np.zeros(1))[0], pieces[-1].at(np.ones(1))[0]
    up = np.array([0.0, 0.0, lift_mm])
    return [Straight(start + up, start, False), *pieces, Straight(end, end + up, False)] if lift_mm else pieces


def walk(pieces, xyh):
    """Which piece each of N - 1 segments between points (N, 3) lies on, and its parameters at both ends (N - 1, 2).

    Raises:
        OffCurveError: The end of a piece is no waypoint, waypoints go back, or follow the end of the last piece.
    """
    piece, span, begin = [], [], 0
    for k, p in enumerate(pieces):
        end = p.at(np.ones(1))[0]
        at_end = np.flatnonzero(np.linalg.norm(xyh[begin + 1 :] - end, axis=1) < FOUND_MM)
        if not len(at_end):
            raise OffCurveError(f"no waypoint after the {begin + 1}th at the end of piece {k + 1} of the closed form")
        last = begin + 1 + int(at_end[0])
        t = p.parameter(xyh[begin : last + 1])
        if not (np.all(np.diff(t) > 0) and abs(t[0]) < ENDS and abs(t[-1] - 1) < ENDS):
            raise OffCurveError(
                f"the waypoints {begin + 1} to {last + 1} do not go along piece {k + 1} of the closed form"
            )
        piece += [k] * (last - begin)
        span.append(np.column_stack([t[:-1], t[1:]]))
        begin = last
    if begin != len(xyh) - 1:
        raise OffCurveError(f"{len(xyh) - 1 - begin} waypoints after the end of the closed form")
    return np.array(piece), np.concatenate(span)


def middle(piece, span):
    """Parameters halfway along spans of a piece by length, (M,): Newton's method on Simpson's rule."""
    begin, end = span.T

    def speed(t):
        return np.linalg.norm(piece.slope(t), axis=1)

    def length(a, b):
        return (speed(a) + 4 * speed((a + b) / 2) + speed(b)) * (b - a) / 6

    t, whole = (begin + end) / 2, length(begin, end)
    for _ in range(3):
        t = t - (length(begin, t) - whole / 2) / speed(t)
    return t


@dataclass(frozen=True)
class Boundary:
    """The edge of a part: a convex polygon with its corners counter-clockwise, or without any a circle."""

    outer_radius: float  # [mm] of the circle, of the corners
    corners: np.ndarray | None = None  # (K, 2) [mm]

    @classmethod
    def polygon(cls, corners, rotation_deg):
        """With corners (K, 2) [mm], turned."""
        c, s = np.cos(np.radians(rotation_deg)), np.sin(np.radians(rotation_deg))
        return cls(float(np.linalg.norm(corners, axis=1).max()), np.asarray(corners) @ np.array([[c, s], [-s, c]]))

    def inside(self, xy):
        """How far points (M, 2) lie inside, (M,) [mm]."""
        if self.corners is None:
            return self.outer_radius - np.linalg.norm(xy, axis=1)
        way = np.roll(self.corners, -1, axis=0) - self.corners
        left = np.column_stack([-way[:, 1], way[:, 0]]) / np.linalg.norm(way, axis=1)[:, None]
        return ((xy[:, None] - self.corners) * left).sum(axis=2).min(axis=1)

    def half_height(self):
        """Largest y [mm]."""
        return self.outer_radius if self.corners is None else float(self.corners[:, 1].max())

    def across(self, y):
        """Smallest and largest x [mm] at a y inside."""
        if self.corners is None:
            return np.array([-1, 1]) * np.sqrt(self.outer_radius**2 - y**2)
        a = self.corners
        b = np.roll(a, -1, axis=0)
        cut = (a[:, 1] - y) * (b[:, 1] - y) <= 0
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
        x = x[cut & np.isfinite(x)]
        return np.array([x.min(), x.max()])

    def between(self, low, high):
        """Smallest and largest x [mm] of the part between two y."""
        widest = [0.0] if self.corners is None else self.corners[:, 1]
        x = np.array([self.across(y) for y in (low, high, *(y for y in widest if low < y < high))])
        return np.array([x[:, 0].min(), x[:, 1].max()])


def _raster(table, boundary):
    """Sweeps along x from -y to +y, there and back, with square turns outside of what lies between two of them."""
    step, lead = table["stepover_mm"], np.array([-1, 1]) * table.get("lead_mm", 5)
    count = int(np.ceil(2 * boundary.half_height() / step - 1e-9))
    y = (np.arange(count) - (count - 1) / 2) * step
    ends = [boundary.across(v) + lead for v in y]
    turns = [boundary.between(a, b) + lead for a, b in zip(y[:-1], y[1:], strict=True)]
    points = [(ends[0][0], y[0])]
    for k in range(count):
        far = 1 if k % 2 == 0 else 0
        x = turns[k][far] if k < count - 1 else ends[k][far]
        points += [(x, y[k]), (x, y[k + 1])] if k < count - 1 else [(x, y[k])]
    return _flat(points, 1.0)


def _circle(radius, angle):
    return Winding(radius, radius, angle, angle + 2 * np.pi)


def _flat(points, size):
    return _polyline([(size * x, size * y, 0.0) for x, y in points])


def _polyline(points):
    corners = np.array(points, dtype=float)
    return [Straight(a, b) for a, b in zip(corners[:-1], corners[1:], strict=True)]
