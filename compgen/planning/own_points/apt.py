"""A path's points from APT cutter locations (ISO 4343, as CAM systems write them).

Read are ``GOTO/x,y,z[,i,j,k]`` and ``FROM/``, ``FEDRAT/f[,MMPM]``, ``RAPID`` (for the next move), ``UNITS/MM``,
``GODLTA/dx,dy,dz``, ``STOP`` and ``DELAY`` (the robot stops), ``END`` and ``FINI`` (the program ends); ``$`` goes on
in the next line, ``$$`` begins a remark. i, j, k point from the part into the tool, which is out of the surface. Words
that are known to move nothing are passed over, and every other word is refused.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compgen.core.exceptions import InputError
from compgen.planning.own_points.given_points import (
    GivenPoints,
    PointRow,
    PointRows,
    Triple,
    feed_in_m_s,
    not_driven,
    read_lines,
)

UNIT = 0.01  # that an axis' length may differ from one
NO_AXES = ([0.0, 0.0, 1.0], [0.0, 0.0, 0.0])  # of FROM: points without an axis may still stand on a surface
#: moves, or turns of the points, that are not read
REFUSED = {
    "CIRCLE": "circles are not read; let the CAM system write linear moves",
    "ARC": "circles are not read; let the CAM system write linear moves",
    "MOVARC": "circles are not read; let the CAM system write linear moves",
    "INDIRV": "circles are not read; let the CAM system write linear moves",
    "CYCLE": "drilling cycles are not read; write the moves themselves",
    "COPY": "copies are not read; write the moves themselves",
    "TRANS": "shifts are not read; write the points where they are",
    "TRACUT": "transformed points are not read; write the points where they are",
    "ORIGIN": "a moved origin is not read; write the points where they are",
    "CUTCOM": "cutter compensation is not read; write the tool's own path",
    "ROTABL": "rotary tables are not read; the part stands still",
    "ROTATE": "rotary tables are not read; the part stands still",
    "GOHOME": "a machine's home is not the robot's; remove it",
    "RETRCT": "a machine's retract plane is not known; write the move itself",
    "REFSYS": "another reference system is not read; write the points where they are",
    "TLAXIS": "the tool's axis is read from GOTO; give i, j, k there",
    "MODE": "incremental places are not read; write GOTO in absolute coordinates, or GODLTA",
    "CALL": "macros are not read; write the moves themselves",
    "LOOPST": "loops are not read; write the moves themselves",
    "INSERT": "a machine's own code is not read; write the moves themselves",
    "PREFUN": "a machine's own code is not read; write the moves themselves",
    "SELECT": "only SELECT/TOOL is read; write the points where they are, and remove it",
    "OFSTNO": "a machine's offsets are not known; write the points where they are",
}
#: of these words, what only ends or says what is so already
HARMLESS = {"CUTCOM": "OFF", "CYCLE": "OFF", "TRACUT": "NOMORE", "REFSYS": "NOMORE", "MODE": "ABSOL", "SELECT": "TOOL"}
#: words that move no tool
_STILL = """
AIR AUXFUN CLAMP CLDIST CLEARP COOLNT CUTTER DISPLY END-OF-PATH GECENT HEAD INTOL LEADER LINTOL LOAD MACHIN MULTAX
OPSKIP OUTTOL PAINT PLABEL PROGNO REWIND SAFETY SELCTL SEQNO SPINDL SYN TLDATA TMARK TOLER TOOL TOOLNO TPRINT UNITS
"""
NO_MOTION = frozenset(_STILL.split())
#: what stands behind them is no statement; of the first three not even a $ at the end
TEXT = ("PPRINT", "PARTNO", "REMARK", "TOOL PATH", "CATPROCESS")
ENDS = ("END", "FINI")
OTHER_FEEDS = ("IPM", "IPR", "MMPR", "PERREV", "INVERS")  # said alone, they are of numbers to come
SHORT = re.compile(r"[\x21-\x7e]{1,20}")  # a word that a message may show
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([EDed][+-]?\d+)?", re.ASCII)


def read_apt(source: str | Path) -> GivenPoints:
    """Read a path's points.

    Raises:
        InputError: Not readable, in inches, a move that is not read, a number that is none, an axis that is no unit
            vector or is missing from some of the points, a word that is not known to move nothing.
    """
    reader, end, behind = _Reader(PointRows(str(source))), (0, ""), []
    for line, word, arguments in _statements(str(source), read_lines(source, "an APT file")):
        if end[1]:
            behind += [line] if word not in ENDS else []
        elif word in ENDS:
            end = (line, word)
        else:
            reader.statement(line, word, arguments)
    return reader.rows.given(not_driven(*end, behind))


@dataclass(slots=True)
class _Reader:
    """What stays in force from statement to statement."""

    rows: PointRows
    feed: float = np.nan  # m/s
    rapid: bool = False  # of the next move
    place: Triple | None = None  # mm
    axis: Triple | None = None

    def statement(self, line: int, word: str, arguments: list[str]) -> None:
        """One statement."""
        where = f"{self.rows.source}: line {line}"
        if word in ("LOADTL", "TURRET"):
            self.rows.refuse_another_tool(line, word)
        elif word == "RAPID":
            self.rapid = True
        elif word in ("STOP", "OPSTOP", "DELAY"):
            self.rows.stop()
        elif word == "FEDRAT":
            self.feed = _feed(self.rows.source, line, arguments, self.feed)
        elif word == "FROM":  # where the machine stood, not where the tool goes
            if self.rows.rows:
                raise InputError(f"{where}: FROM after a point: nobody drives there; write GOTO, or remove it")
            numbers = [_number(where, a) for a in arguments[:3]]
            self.place = (numbers[0], numbers[1], numbers[2]) if len(numbers) == 3 else self.place
            axis = [_number(where, a) for a in arguments[3:6] if NUMBER.fullmatch(a)]
            if len(axis) == 3:
                self.axis = None if axis in NO_AXES else _axis(where, axis, has_axes=True)
        elif word in ("GOTO", "GODLTA"):
            self._move(line, where, word, [_number(where, a) for a in arguments])
        else:
            _refuse(where, word, arguments)

    def _move(self, line: int, where: str, word: str, numbers: list[float]) -> None:
        if len(numbers) not in ((3,) if word == "GODLTA" else (3, 6)):
            raise InputError(f"{where}: {word} with {len(numbers)} numbers; give x, y, z, or x, y, z, i, j, k")
        if word == "GODLTA":
            if self.place is None:
                raise InputError(f"{where}: GODLTA before any GOTO; give the first point with GOTO")
            numbers = [a + b for a, b in zip(self.place, numbers, strict=True)]
        self.place = (numbers[0], numbers[1], numbers[2])
        if numbers[3:]:
            self.axis = _axis(where, numbers[3:], has_axes=self.axis is not None or not self.rows.rows)
        feed = np.nan if self.rapid else self.feed
        self.rows.add(PointRow(line=line, position=self.place, feed=feed, contact=not self.rapid, normal=self.axis))
        self.rapid = False


def _refuse(where: str, word: str, arguments: list[str]) -> None:
    """Refuse a word unless it moves nothing."""
    if word == "UNITS" and not arguments[0].startswith("MM"):
        raise InputError(f"{where}: UNITS/{arguments[0][:16]}: points are read in mm; write the file in millimetres")
    if word in NO_MOTION or HARMLESS.get(word) == arguments[0]:
        return
    shown = word if SHORT.fullmatch(word) else "a statement"
    raise InputError(f"{where}: {shown}: {REFUSED.get(word, 'not read; remove it if it moves nothing')}")


def _axis(where: str, given: list[float], *, has_axes: bool) -> Triple:
    """The tool's axis at a point, of which those before have one, too, or are none."""
    if not has_axes:
        raise InputError(f"{where}: i, j, k here and not at the first point; give them from the first on, or nowhere")
    length = float(np.linalg.norm(given))
    if abs(length - 1) > UNIT:
        raise InputError(f"{where}: the axis i, j, k has length {length:.4g}, not 1; mend it")
    return given[0] / length, given[1] / length, given[2] / length


def _feed(name: str, line: int, arguments: list[str], before: float) -> float:
    numbers = [a for a in arguments if NUMBER.fullmatch(a)]
    others = [a for a in arguments if a and a not in ("MMPM", "PERMIN", *numbers) and (numbers or a in OTHER_FEEDS)]
    if others:
        wanted = "feeds are read in mm/min; write the number so, with MMPM"
        shown = others[0] if SHORT.fullmatch(others[0]) else "other words"
        raise InputError(f"{name}: line {line}: FEDRAT in {shown}: {wanted}")
    if not numbers:
        return before  # a word such as RAPID or AUTO: no number of ours
    return feed_in_m_s(name, line, float(numbers[0]))


def _number(where: str, word: str) -> float:
    if not NUMBER.fullmatch(word):
        shown = f"'{word}'" if SHORT.fullmatch(word) else "what stands here"
        raise InputError(f"{where}: {shown} is no number; give x, y, z, or x, y, z, i, j, k")
    return float(re.sub("[Dd]", "E", word))


def _statements(name: str, lines: list[str]) -> Iterator[tuple[int, str, list[str]]]:
    """Line, major word and arguments of each statement."""
    text, first = "", 0
    for n, line in enumerate(lines, 1):
        line = line.split("$$", 1)[0]
        first = first if text else n
        if line.rstrip().endswith("$") and (text or not line.lstrip().upper().startswith(TEXT[:3])):
            text += line.rstrip()[:-1]
            continue
        statement, text = (text + line).strip().upper(), ""
        if not statement:
            continue
        word, _, rest = statement.partition("/")
        if not word.startswith(TEXT):
            yield first, word.strip(), [a.strip() for a in rest.split(",")]
    if text:
        raise InputError(f"{name}: line {len(lines)}: ends with $, which goes on in a line that is not there")
