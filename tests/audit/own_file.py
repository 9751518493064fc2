r"""A path along the lines and arcs, or through the places, of a user's own file, which another reader reads.

What is between two waypoints, halfway, is known where both lie on one line or arc of the file. At a rounded corner, and
on a curve through places, it is within twice the chord of the middle between them: lines are laid so that one chord is
on either side. The tool stands upright.
"""

import numpy as np
from naive_cam import READERS, Line, Unreadable
from naive_way import SAGITTA_MM, cut, from_pieces, worst_in_order

from audit import poses
from audit.checks import below, count
from audit.scope import CHORD_UM, NotJudgedError
from audit.surface import tool_axes

TOLERANCE_UM = 2.0  # path.tolerance_um, where the path file says none
ON_WAY_MM = 1e-4  # from a line or an arc to a waypoint on it: the digits, and the chords on arcs
SHORTEST, LONGEST, SLACK_MM = 0.5, 1.1, 0.1  # of a line or an arc: how long the way along it may be
DISTANCES = 2e8  # of waypoints from pieces, as many as are looked at


class OwnFile:
    """Where the tool shall be at N waypoints and between them, and how far it may be from K lines and arcs."""

    has_own_feeds = True

    def __init__(self, path, folder, written):
        """Reads the file, and finds which waypoints belong to which of its lines and arcs.

        Args:
            path: The path file's tables.
            folder: Where it stands.
            written: Targets in World as the output has them, (N, 3) [mm].

        Raises:
            NotJudgedError: The file cannot be read, or says how the tool stands.
        """
        table, process = path["path"], path["process"]
        self.frame = poses.of_table(path.get("frame", {}))
        self._spin = np.radians(path.get("tool", {}).get("spin_deg", 0.0))
        self._shift = np.array([table.get(f"{a}_mm", 0.0) for a in "xyz"])
        through = table.get("through", "tolerance" if table["pattern"] == "points" else "lines")
        self.is_lines = through == "lines"
        self._tolerance_um = 0.0 if through == "points" else table.get("tolerance_um", TOLERANCE_UM)
        self._sag_um = 2 * process.get("chord_um", CHORD_UM)
        self._moves = _moves(folder / table["file"], table["pattern"], process.get("lift_mm", 20.0))
        self._ways = [cut(m) for m in self._moves]
        self._place = np.array([self._moves[0].start, *(m.end for m in self._moves)])
        self._start, self._end = (np.vstack([way[rows] for way in self._ways]) for rows in (np.s_[:-1], np.s_[1:]))
        if len(self._start) * len(written) > DISTANCES:
            raise NotJudgedError(f"path.file = {table['file']}: not judged; it is too long for the audit")
        self._written, self._at = written, self._local(written)
        self._owner = self._owners()

    def at_waypoints(self):
        """Poses at N waypoints, in World: places as written, once they are judged."""
        return self._written, self._upright(len(self._written))

    def halfway(self):
        """Poses in the middle of N - 1 segments, in World."""
        middle = (self._at[:-1] + self._at[1:]) / 2
        for n in np.flatnonzero(~self._between()):
            if not isinstance(move := self._moves[self._owner[n]], Line):
                middle[n] = _middle(move, self._at[n : n + 2])
        return self.frame[0] + (middle + self._shift) @ self.frame[1].T, self._upright(len(middle))

    def unsure_um(self):
        """How far the path may be from these middles, (N - 1,) [um]."""
        return np.where(self._between(), self._sag_um, 0.0)

    def contact(self):
        """Whether waypoints are on the part, (N,)."""
        working = self.touching()
        return np.concatenate([working[:1], working[:-1] | working[1:], working[-1:]])

    def touching(self):
        """Whether the tool touches somewhere on segments, (N - 1,)."""
        return ~np.array([m.rapid for m in self._moves])[self._owner]

    def feed(self, process):
        """Wanted of segments, (N - 1,) [mm/s], where the process's is what the file leaves open."""
        return np.array([process if m.feed is None else m.feed for m in self._moves])[self._owner]

    def path_checks(self, contact):
        """Whether the waypoints are within the tolerance of the lines and arcs, pass all places, and touch as these."""
        on = [self._off("waypoints off the file's lines, um", self._at, self._tolerance_um)] if self.is_lines else []
        return [
            *on,
            self._missed("waypoints beside the file's places, um", self._at, self._tolerance_um + self._sag_um),
            count("waypoints wrongly on or off the part", np.sum(self.contact() != contact)),
        ]

    def flown_checks(self, there, between, left_um):
        """Whether the tool, at N waypoints and halfway between in World, keeps to the file but for what is left."""
        way = np.empty((2 * len(there) - 1, 3))
        way[::2], way[1::2] = self._local(there), self._local(between)
        allowed = self._tolerance_um + left_um
        off = [self._off("tool off the file's lines, um", way, allowed)] if self.is_lines else []
        return [*off, self._missed("tool beside the file's places, um", way, allowed)]

    def _off(self, what, place, allowed_um):
        arc_mm = [0.0 if isinstance(m, Line) else m.unsure + SAGITTA_MM for m in self._moves]
        may = np.repeat(np.array(arc_mm) + allowed_um / 1e3, [len(way) - 1 for way in self._ways])
        share, _ = worst_in_order(place, self._start, self._end, lambda distance, _: distance / may)
        return below(what, share * allowed_um, 0.0, allowed_um)

    def _missed(self, what, place, allowed_um):
        far, _ = worst_in_order(self._place, place[:-1], place[1:], lambda distance, _: distance)
        return below(what, far * 1e3, 0.0, allowed_um)

    def _local(self, world):
        return (world - self.frame[0]) @ self.frame[1] - self._shift

    def _upright(self, rows):
        return self.frame[1] @ tool_axes(np.tile([0.0, 0.0, 1.0], (rows, 1)), self._spin)

    def _owners(self):
        """Which line or arc each of N - 1 segments is on: its middle is before the place nearest to that one's end."""
        step = np.diff(self._at, axis=0)
        long = np.linalg.norm(step, axis=1)
        gone, passed = np.concatenate([[0.0], np.cumsum(long)]), [0.0]
        for way in self._ways[:-1]:
            length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
            since, until = passed[-1] + SHORTEST * length, passed[-1] + LONGEST * length + SLACK_MM
            low = min(int(np.searchsorted(gone[1:], since)), len(step) - 1)
            rows = slice(low, max(int(np.searchsorted(gone, until)), low + 1))
            out = way[-1] - self._at[:-1][rows]
            share = np.clip((out * step[rows]).sum(axis=1) / np.maximum(long[rows], 1e-9) ** 2, 0, 1)
            far = np.linalg.norm(out - share[:, None] * step[rows], axis=1)
            nearest = int(np.argmax(far <= far.min() + ON_WAY_MM))
            passed.append(max(passed[-1], gone[low + nearest] + share[nearest] * long[low + nearest]))
        return np.searchsorted(passed[1:], (gone[1:] + gone[:-1]) / 2)

    def _between(self):
        """Whether a segment has an end beside its line or arc, (N - 1,)."""
        out = np.full(len(self._owner), not self.is_lines)
        for n in range(len(out)) if self.is_lines else ():
            way = self._ways[self._owner[n]]
            step = np.diff(way, axis=0)
            square = np.maximum((step**2).sum(axis=1), 1e-18)
            out[n] = max(from_pieces(p, way[:-1], step, square).min() for p in self._at[n : n + 2]) > ON_WAY_MM
        return out


def _moves(file, pattern, lift_mm):
    """Lines and arcs of a file, between the approach and the retract."""
    try:
        read = READERS[pattern](file.read_text("utf-8-sig", errors="replace"))
    except (OSError, IndexError, Unreadable) as problem:
        raise NotJudgedError(f"{file}: not judged; the audit's reader does not read it: {problem}") from None
    driven = read.moves[1:] if read.stands else read.moves  # FROM is where the tool stood
    if all(m.rapid for m in driven):
        raise NotJudgedError(f"{file}: not judged; it has no line on the part")
    if read.normal is not None:
        raise NotJudgedError(f"{file}: not judged; it says how the tool stands, the audit's stands upright")
    first, last = driven[0].start, driven[-1].end
    before, behind = ((p[0], p[1], p[2] + lift_mm) for p in (first, last))
    moves = [Line(before, first, rapid=True), *driven, Line(last, behind, rapid=True)]
    return [m for m in moves if not isinstance(m, Line) or m.start != m.end]


def _middle(arc, ends):
    """Halfway between two places on an arc, less than half a turn apart."""
    axis, out = np.array(arc.axis), ends - arc.centre
    high = out @ axis
    out -= high[:, None] * axis
    middle = out.mean(axis=0)
    middle *= np.linalg.norm(out, axis=1).mean() / np.linalg.norm(middle)
    return arc.centre + middle + high.mean() * axis
