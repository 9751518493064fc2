"""A path's points from G-code of three axes (ISO 6983, RS-274): ``G0 G1 G2 G3`` with ``X Y Z I J R F``.

Millimetres, arcs in the XY plane with centres relative to their start; the tool stands on the surface. ``G0`` is off
the part. Read as well: ``G90`` and ``G91``, ``G4``, ``M0`` and ``M1`` (the robot stops), ``M2``, ``M30`` and a second
``%`` (the program ends), and words without motion. What would move the tool otherwise is refused: inches, other planes,
another work offset in mid-file, rotary axes, cutter compensation, cycles, macros, several turns in one arc.
"""

import re
from math import atan2, hypot, nan, pi, sqrt
from pathlib import Path

from compgen.core.exceptions import InputError
from compgen.planning.own_points.given_points import (
    LINE,
    Arc,
    GivenPoints,
    PointRow,
    PointRows,
    feed_in_m_s,
    not_driven,
    read_lines,
)

WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))", re.ASCII)
SAME_ANGLE = 1e-9  # rad: an arc that ends where it begins is a whole circle
RADII = (0.02, 0.001)  # mm, and share of them, by which an arc's two radii may differ
MODES = {0, 1, 2, 3, 4, 17, 21, 40, 43, 49, 54, 55, 56, 57, 58, 59, 61, 64, 80, 90, 91, 94, 98, 99}
REFUSED = {
    18: "arcs in the ZX plane are not read; use G17, or lines",
    19: "arcs in the YZ plane are not read; use G17, or lines",
    20: "points are read in mm; write the file in millimetres (G21)",
    70: "an older word for inches (or a cycle); points are read in mm: write the file in millimetres (G21)",
    28: "a machine's home is not the robot's; remove it",
    30: "a machine's home is not the robot's; remove it",
    41: "cutter compensation is not read; write the tool's own path",
    42: "cutter compensation is not read; write the tool's own path",
    53: "machine coordinates are not the part's; remove it",
    65: "macros are not read; write the moves themselves",
    66: "macros are not read; write the moves themselves",
    92: "shifted coordinates are not read; write the points where they are",
    93: "inverse-time feed is not read; write mm/min (G94)",
    95: "feed per revolution is not read; write mm/min (G94)",
}


UNREAD = "not read: write the moves themselves, where the tool really goes; remove it only if it changes nothing"
MOTIONS, OFFSETS = (0, 1, 2, 3), (54, 55, 56, 57, 58, 59)
#: words that mean something else with a line than with an arc, or nothing that is read
STRANGE = {
    "R": "a corner's radius is not read; write the arc itself",
    "I": "it belongs to arcs; say G2 or G3, or remove it",
    "J": "it belongs to arcs; say G2 or G3, or remove it",
    "K": "it belongs to arcs in other planes, which are not read",
    "L": "repeats are not read; write the moves themselves",
    "Q": "cycles are not read; write the moves themselves",
}
IN_INCHES = re.compile(
    r"[(;]\W*(?:(?:UNITS?|DIMENSIONS?|PROGRAM)\b\W*(?:(?:ARE|IN|IS)\b\W*)*)?INCH(?:ES)?\W*$", re.IGNORECASE
)
DWELL = frozenset("PXUSF")  # words that say how long G4 waits


def read_gcode(source: str | Path) -> GivenPoints:
    """Read a path's points.

    Raises:
        InputError: Not readable, a word that is none, a code that is not read, an arc that is none, motion before the
            place of all axes is known.
    """
    name = str(source)
    rows, reader, behind = PointRows(name), _Reader(name), []
    for n, text in enumerate(read_lines(source, "a G-code file"), 1):
        if IN_INCHES.search(text):
            raise InputError(
                f"{name}: line {n}: a remark says inches; points are read in mm: write them so, and remove it"
            )
        block = re.sub(r"\([^)]*\)", " ", text).split(";", 1)[0].strip().upper()  # without remarks
        if reader.end is not None:
            behind += [n] if block and block != "%" else []
        elif block:
            reader.block(n, block, rows)
    return rows.given(() if reader.end is None else not_driven(*reader.end, behind))


class _Reader:
    """What stays in force from block to block."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.motion: int | None = None
        self.absolute = True
        self.feed = nan
        self.place: dict[str, float] = {}  # mm, of the axes that were given
        self.offset: float | None = None  # G54 to G59
        self.begun = False  # any block that says something
        self.program: float | None = None  # its number, O
        self.end: tuple[int, str] | None = None  # line, and the word that ends the program

    def block(self, line: int, text: str, rows: PointRows) -> None:
        """One line."""
        if text == "%":
            self.end = (line, "%") if self.begun else None
            return
        self.begun = True
        if text.startswith("/"):
            raise InputError(f"{self.name}: line {line}: a block that may be skipped; remove its / or the block")
        words = self._words(line, text)
        codes = [(letter, value) for letter, value in words if letter in "GM"]
        values = {letter: value for letter, value in words if letter not in "GMN"}
        self._refuse_contradictions(line, [value for letter, value in codes if letter == "G"], values)
        for letter, value in codes:
            self._code(line, letter, value, rows)
        waits = ("G", 4) in codes
        if "P" in values and not waits and not (values.keys() & set("IJR") and values["P"] == 1):
            where = f"{self.name}: line {line}: P{values['P']:g}"
            raise InputError(f"{where} is read with G4 alone; remove it, or say it in plainer words")
        if "F" in values and not waits:
            self.feed = feed_in_m_s(self.name, line, values["F"])
        if not waits:
            self._move(line, values, rows)
        if waits or {("M", 0), ("M", 1)} & set(codes):
            rows.stop()
        if ends := [value for letter, value in codes if letter == "M" and value in (2, 30)]:
            self.end = (line, f"M{ends[0]:g}")

    def _move(self, line: int, values: dict[str, float], rows: PointRows) -> None:
        """The motion of a block, if it has one."""
        axes = {a: values[a] for a in "XYZ" if a in values}
        if not axes and not (self.motion in (2, 3) and values.keys() & set("IJ")):
            return
        where = f"{self.name}: line {line}"
        if self.motion is None:
            raise InputError(f"{where}: a place without G0, G1, G2 or G3; say how to go there")
        if self.motion in (0, 1) and (strange := values.keys() & STRANGE.keys()):
            letter = min(strange)
            raise InputError(f"{where}: {letter} with G{self.motion}: {STRANGE[letter]}")
        start = dict(self.place)
        for a, value in axes.items():
            if not self.absolute and a not in start:
                raise InputError(f"{where}: G91 before {a} is known; give the first place with G90")
            self.place[a] = value if self.absolute else start[a] + value
        if len(self.place) < 3:
            if self.motion != 0:
                missing = next(a for a in "XYZ" if a not in self.place)
                raise InputError(f"{where}: {missing} is not known yet; give it before the first cut")
            return
        end, arc = (self.place["X"], self.place["Y"], self.place["Z"]), LINE
        if self.motion in (2, 3):
            if len(start) < 3:
                raise InputError(f"{where}: an arc from an unknown place; give X, Y, Z before it")
            arc = self._arc(line, (start["X"], start["Y"]), end[:2], values)
        feed = self.feed if self.motion else nan
        rows.add(PointRow(line=line, position=end, feed=feed, contact=self.motion != 0, arc=arc))

    def _refuse_contradictions(self, line: int, codes: list[float], values: dict[str, float]) -> None:
        """Of the G-codes of a block and its other words."""
        where = f"{self.name}: line {line}"
        motions = [f"G{g:g}" for g in codes if g in MOTIONS]
        if len(motions) > 1:
            raise InputError(f"{where}: {' and '.join(motions)} in one block; keep one motion a block")
        if {90, 91} <= set(codes):
            raise InputError(f"{where}: G90 and G91 in one block; keep one of them")
        if 4 in codes and (motions or values.keys() - DWELL or {"P", "X"} <= values.keys()):
            raise InputError(f"{where}: G4 waits, and the block says more; write it in a block of its own")
        if "O" in values:
            if self.program not in (None, values["O"]):
                raise InputError(f"{where}: O{values['O']:g}: a second program in the file; give one of them")
            self.program = values["O"]

    def _words(self, line: int, text: str) -> list[tuple[str, float]]:
        if re.search(r"[#=\[\]]|\b(IF|WHILE|GOTO|DO\d|END\d)", text):
            raise InputError(f"{self.name}: line {line}: macros are not read; write the moves themselves")
        compact = re.sub(r"\s+", "", text)
        matches = list(WORD.finditer(compact))
        if sum(m.end() - m.start() for m in matches) != len(compact):
            raise InputError(f"{self.name}: line {line}: not words of a letter and a number; mend it, or remove it")
        words = [(m[1], float(m[2])) for m in matches]
        letters = [letter for letter, _ in words]
        for letter in letters:
            if letter not in "GM" and letters.count(letter) > 1:
                raise InputError(f"{self.name}: line {line}: {letter} stands twice in a block; keep one")
            if letter == "E":
                raise InputError(f"{self.name}: line {line}: E is no word that is read; write plain numbers")
            if letter in "ABCUVW":
                raise InputError(
                    f"{self.name}: line {line}: rotary or second axis {letter} is a machine's own, of unknown "
                    "geometry; write the points with their normals (pattern = 'points' or 'apt')"
                )
        return words

    def _code(self, line: int, letter: str, value: float, rows: PointRows) -> None:
        """What a code changes, or its refusal."""
        where = f"{self.name}: line {line}: {letter}{value:g}"
        if letter == "G":
            self._preparatory(where, value)
        elif value in (97, 98, 99):
            raise InputError(f"{where}: sub-programs are not read; write the moves themselves")
        elif value == 6:
            rows.refuse_another_tool(line, f"M{value:g}")

    def _preparatory(self, where: str, value: float) -> None:
        """What a G-code changes, or its refusal."""
        if value in REFUSED:
            raise InputError(f"{where}: {REFUSED[int(value)]}")
        if value == 91.1:
            return
        if value not in MODES:
            known = "cycles are not read; write the moves themselves" if 73 <= value <= 89 else UNREAD
            raise InputError(f"{where}: {known}")
        if value in MOTIONS:
            self.motion = int(value)
        elif value in (90, 91):
            self.absolute = value == 90
        elif value in OFFSETS:
            if self.place and value != (self.offset or OFFSETS[0]):
                raise InputError(f"{where}: another work offset in mid-file, of unknown place; write a file for each")
            self.offset = value

    def _arc(self, line: int, start: tuple[float, float], end: tuple[float, float], values: dict[str, float]) -> Arc:
        """The arc between two places [mm]."""
        where = f"{self.name}: line {line}"
        turn = -1.0 if self.motion == 2 else 1.0
        if "K" in values:
            raise InputError(f"{where}: K belongs to arcs in other planes, which are not read; give I and J (G17)")
        if "L" in values:
            raise InputError(f"{where}: {STRANGE['L']}")
        if "R" in values:
            if values.keys() & set("IJ"):
                raise InputError(f"{where}: R and a centre (I, J) both say the arc; keep one of them")
            centre = _centre(where, start, end, values["R"], turn)
        elif "I" in values or "J" in values:
            centre = (start[0] + values.get("I", 0.0), start[1] + values.get("J", 0.0))
        else:
            raise InputError(f"{where}: an arc without I, J or R; give its centre")
        radii = [hypot(p[0] - centre[0], p[1] - centre[1]) for p in (start, end)]
        if not radii[0] > 0 or abs(radii[1] - radii[0]) > max(RADII[0], RADII[1] * radii[0]):
            raise InputError(
                f"{where}: the arc's ends are {radii[0]:.3f} and {radii[1]:.3f} mm from its centre; mend I and J"
            )
        first, last = (atan2(p[1] - centre[1], p[0] - centre[0]) for p in (start, end))
        swept = turn * (last - first) % (2 * pi)
        if swept < SAME_ANGLE:
            swept = 2 * pi
        return Arc(centre, turn * swept)


def _centre(
    where: str, start: tuple[float, float], end: tuple[float, float], radius: float, turn: float
) -> tuple[float, float]:
    """The centre of an arc by its radius; a negative one goes the long way round."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = hypot(dx, dy)
    if not 0 < chord <= 2 * abs(radius) * (1 + 1e-6):
        raise InputError(f"{where}: R = {radius:g} mm makes no arc between places {chord:.3f} mm apart; give I and J")
    height = sqrt(max(radius * radius - chord * chord / 4, 0.0)) * turn * (1 if radius > 0 else -1)
    return (start[0] + end[0]) / 2 - height * dy / chord, (start[1] + end[1]) / 2 + height * dx / chord
