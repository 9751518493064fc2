"""Points that a user gives: where the tool goes, how it stands, how fast; and how they grow as a file is read."""

from codecs import BOM_UTF8
from dataclasses import dataclass, field, replace
from math import pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, first_true, numbered, owns, row_norms
from compgen.core.exceptions import InputError
from compgen.core.files import read_named
from compgen.core.units import DEG, MM, UM

SAME = 0.999 * UM  # points nearer than this are one; those a last digit apart are two, however they are rounded
UNUSUAL = 20.0  # times the usual step, from where a long one is a slip
SMALL = 5 * MM  # a whole path below this was written in metres
MAX_TILT = 150 * DEG  # of the tool from upright: at 180 deg its tilt has no one axis
STEP_ERROR = 2 * UM  # that an arc's chord leaves it, where a curve is laid through points of it
QUARTER = 16  # points of a quarter turn at least
MAX_BYTES = 500_000_000
MINUTE = 60.0  # s
FEEDS = (0.05, 2000.0)  # mm/s that a program can say
LARGEST = 1e4  # mm
TURNED = 1e-6  # rad, of a tool that stands


@dataclass(frozen=True, eq=False, slots=True)
@owns(centre=("M", 2), swept=("M",))
class GivenArcs:
    """Which of the M ways to points are arcs, or helices, about an axis along z."""

    centre: Array  # (M, 2) [m]
    swept: Array  # (M,) [rad] counterclockwise; 0: the way is a line


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(line=("M",), position=("M", 3), feed=("M",), contact=("M",), stop=("M",))
class GivenPoints:
    """M points of a path in the frame of the part, in the order they are driven."""

    source: str  # the file, for messages
    line: IntArray  # (M,) of the file; 0: it has none
    position: Array  # (M, 3) [m]
    normal: Array | None  # (M, 3) unit, out of the surface; the tool's z axis points against it
    rotation: Array | None  # (M, 3, 3) of the tool; None with ``normal``, or where the surface says it
    feed: Array  # (M,) [m/s] on the way to each point; NaN where the file does not say
    contact: BoolArray  # (M,) on the way to each point the tool may touch the part
    stop: BoolArray  # (M,) the robot stops there
    arcs: GivenArcs | None = None  # None: every way is a line
    notes: tuple[str, ...] = ()  # what of the file is not driven
    read_as: tuple[str, ...] = ()  # how a file of another writer's form was understood

    def where(self, row: int) -> str:
        """File and line of a point, or its place where the file has no lines, for messages."""
        x, y = self.position[row, :2] / MM
        return f"{self.source}: " + (f"line {self.line[row]}" if self.line[row] else f"at x {x:.1f}, y {y:.1f} mm")

    def divided(self, step: float) -> "GivenPoints":
        """With further points on lines and arcs, no further apart than a step [m]; of points without normals."""
        size = row_norms(np.diff(self.position, axis=0))
        if self.arcs is not None:
            radius = row_norms(self.position[1:, :2] - self.arcs.centre[1:])
            size = np.maximum(size, np.abs(self.arcs.swept[1:]) * radius)
        return self._cut(np.maximum(np.ceil(size / step), 1).astype(np.int64))

    def as_points(self) -> "GivenPoints":
        """With points on the arcs in place of the arcs: what a curve is laid through."""
        if self.arcs is None:
            return self
        swept = np.abs(self.arcs.swept[1:])
        radius = np.maximum(row_norms(self.position[1:, :2] - self.arcs.centre[1:]), STEP_ERROR)
        count = np.maximum(np.ceil(swept / np.sqrt(8 * STEP_ERROR / radius)), np.ceil(QUARTER * swept / (pi / 2)))
        return replace(self._cut(np.maximum(count, 1).astype(np.int64)), arcs=None)

    def _cut(self, count: IntArray) -> "GivenPoints":
        """With the way to each point but the first in so many parts (M - 1,)."""
        way, number = numbered(count)
        share = (number + 1) / count[way]
        start, end = self.position[way], self.position[way + 1]
        position, arcs = start + share[:, None] * (end - start), self.arcs
        if arcs is not None:
            swept, centre = arcs.swept[way + 1], arcs.centre[way + 1]
            out = [p[:, :2] - centre for p in (start, end)]
            radius = row_norms(out[0]) + share * (row_norms(out[1]) - row_norms(out[0]))
            angle = np.arctan2(out[0][:, 1], out[0][:, 0]) + share * swept
            round_way = centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            position[:, :2] = np.where((swept != 0)[:, None], round_way, position[:, :2])
            arcs = GivenArcs(np.vstack([arcs.centre[:1], centre]), np.append(0.0, swept / count[way]))
        last = share == 1
        position[last] = end[last]
        rows = np.append(0, way + 1)
        return replace(
            self,
            line=self.line[rows],
            position=np.vstack([self.position[:1], position]),
            feed=self.feed[rows],
            contact=self.contact[rows],
            stop=self.stop[rows] & np.append(True, last),
            arcs=arcs,
        )


def check_points(points: GivenPoints, jump: float) -> None:
    """Refuse what no path can be laid through.

    Args:
        points: The points.
        jump: Length from which a step on the part that is also many times the usual one is a slip [m].

    Raises:
        InputError: Fewer than two points, two that are one, a path as small as metres taken for millimetres, or a step
            far beyond the others.
    """
    position = points.position
    if len(position) < 2:
        raise InputError(f"{points.source}: {len(position)} points are no path; give two at least")
    size = float(np.linalg.norm(np.ptp(points.as_points().position, axis=0)))
    if size < SMALL and len(position) >= 10:
        raise InputError(
            f"{points.source}: the whole path is {size / MM:.3g} mm long and wide; if it is in metres, give millimetres"
        )
    step = row_norms(np.diff(position, axis=0))
    near = first_true((step < SAME) & (True if points.arcs is None else points.arcs.swept[1:] == 0))
    if near is not None:
        raise InputError(
            f"{points.where(near + 1)}: the same place as line {points.line[near]}; leave one of the two out"
        )
    usual = float(np.median(step))
    far = first_true((step > jump) & (step > UNUSUAL * usual) & points.contact[1:] & points.contact[:-1])
    if far is not None:
        raise InputError(
            f"{points.where(far + 1)}: {step[far] / MM:.1f} mm from the point before, where steps are {usual / MM:.3g} "
            "mm; mend it, say contact = 0 off the part, or raise path.jump_mm"
        )


def read_lines(source: str | Path, kind: str) -> list[str]:
    """Lines of a text file.

    Args:
        source: The file.
        kind: What it should be, for messages.

    Raises:
        InputError: It cannot be read, or is no text.
    """
    data = read_named(source, f"give {kind}", MAX_BYTES)
    if b"\0" in data:
        raise InputError(f"{source}: holds zero bytes, so it is no text; give {kind}")
    # bytes end at CR and LF alone: as Latin letters, one byte of Å and of Cyrillic х would end a line, and a remark
    return [line.decode("latin-1") for line in data.removeprefix(BOM_UTF8).splitlines()]


Triple = tuple[float, float, float]


class Arc(NamedTuple):
    """The way to a point in the XY plane; a line where nothing is swept."""

    centre: tuple[float, float]  # mm
    swept: float  # rad, counterclockwise


LINE = Arc((0.0, 0.0), 0.0)


@dataclass(slots=True, kw_only=True)
class PointRow:
    """A point as it is read."""

    line: int
    position: Triple  # mm
    feed: float  # m/s on the way to it
    contact: bool
    normal: Triple | None = None
    arc: Arc = LINE
    stop: bool = False


@dataclass(slots=True)
class PointRows:
    """Points in the order they are read; ``given`` freezes them."""

    source: str
    rows: list[PointRow] = field(default_factory=list)

    def add(self, row: PointRow) -> None:
        """One more point; one at the very place of the last is the same point.

        Raises:
            InputError: A coordinate beyond any cell, or a tool that turns where it stands.
        """
        where = f"{self.source}: line {row.line}"
        if max(map(abs, row.position)) > LARGEST:
            raise InputError(f"{where}: a coordinate is beyond {LARGEST:g} mm; mend it")
        last = self.rows[-1] if self.rows else None
        if last is None or last.position != row.position or row.arc.swept != 0:
            self.rows.append(row)
        elif row.normal and last.normal and np.linalg.norm(np.subtract(row.normal, last.normal)) > TURNED:
            raise InputError(f"{where}: the tool turns where it stands (line {last.line}); let it move while it turns")

    def stop(self) -> None:
        """The robot stops at the last point."""
        if self.rows:
            self.rows[-1].stop = True

    def refuse_another_tool(self, line: int, word: str) -> None:
        """Refuse a change of tool behind a place on the part: the robot has one tool."""
        where = f"{self.source}: line {line}"
        if any(row.contact for row in self.rows):
            raise InputError(f"{where}: {word}: another tool in mid-file; write a file for each tool")

    def given(self, notes: tuple[str, ...] = ()) -> GivenPoints:
        """The points; without normals the surface says how the tool stands.

        Args:
            notes: What of the file is not driven.
        """
        normals = [row.normal for row in self.rows if row.normal is not None]
        swept = np.array([row.arc.swept for row in self.rows])
        centre = np.array([row.arc.centre for row in self.rows]).reshape(-1, 2) * MM
        return GivenPoints(
            source=self.source,
            line=np.array([row.line for row in self.rows], dtype=np.int64),
            position=np.array([row.position for row in self.rows], dtype=float).reshape(-1, 3) * MM,
            normal=np.array(normals, dtype=float).reshape(-1, 3) if normals else None,
            rotation=None,
            feed=np.array([row.feed for row in self.rows], dtype=float),
            contact=np.array([row.contact for row in self.rows], dtype=bool),
            stop=np.array([row.stop for row in self.rows], dtype=bool),
            arcs=GivenArcs(centre, swept) if swept.any() else None,
            notes=notes,
        )


def not_driven(last: int, word: str, lines: list[int]) -> tuple[str, ...]:
    """In words, which lines behind the end of a program are not driven; none where there are none."""
    if not lines:
        return ()
    where = f"line {lines[0]} behind it is" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]} behind it are"
    return (f"{word} in line {last} ends the program: {where} not driven",)


def feed_in_m_s(source: str, line: int, mm_min: float) -> float:
    """A feed in SI.

    Raises:
        InputError: No program can say it.
    """
    if not FEEDS[0] * MINUTE <= mm_min <= FEEDS[1] * MINUTE:
        low, high = (f * MINUTE for f in FEEDS)
        raise InputError(f"{source}: line {line}: a feed of {mm_min:g} mm/min is outside {low:g} to {high:g}; mend it")
    return mm_min / MINUTE * MM
