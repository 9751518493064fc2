"""A second reader of CAM files, character by character: G-code, APT and CSV points, to lines and arcs in mm.

It is slow, it has no regular expressions, it shares nothing with the package, and it refuses what it does not know:
a file that only one reader understands has no independent reading.

G-code after RS274/NGC (NIST IR 6556; LinuxCNC's "G-code overview") and ISO 6983-1:

- A block is a line of words, a letter and a number each. Blanks mean nothing, small letters are large ones. ``( )``
  and all behind ``;`` are remarks. A letter may stand once in a block, G and M once for each group.
- The order of words in a block means nothing: what it does goes feed, tool, plane, units, offset, distance mode,
  motion, and the end of the program last.
- G0 G1 G2 G3 and G90 G91 are modal; an axis that is left out stays where it is. G91 leaves I J K alone (G91.1).
- G2 goes with the clock round I J from where the block begins, seen from above; an end that is the start is a full
  circle; R > 0 is the arc up to half a turn, R < 0 the other one. The third axis runs evenly along (helix).
- G4 waits: P or X is its time, and X no place.
- M2 and M30 end the program; a file that begins with a line ``%`` ends at the next one. What follows is not read.

APT after ISO 4343 and the CL files of CAM systems (Creo's "CL output for circular interpolation"):

- ``MAJOR/minor, number, ...``; ``$`` at the end goes on in the next line, all behind ``$$`` is a remark.
- GOTO is a straight line to x, y, z, and i, j, k is the tool's axis; GODLTA is one by so much. FROM says where the
  tool is. RAPID is for the next motion alone. FEDRAT is in units a minute.
- CIRCLE/ x, y, z, i, j, k, r: the next GOTO is the end of an arc that turns right-handed about i, j, k.
- PARTNO, PPRINT, REMARK and TPRINT have text. FINI and END end the program.

CSV points: a header of names with units, then a row a point (docs/own_paths.md).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

Place = tuple[float, float, float]
INCH = 25.4
APART_MM = 0.0127  # radius at both ends of an arc: LinuxCNC's limit


class Unreadable(ValueError):
    """Something that this reader does not know."""


@dataclass(frozen=True)
class Line:
    start: Place
    end: Place
    feed: float | None = None  # [mm/s]; None: the file does not say
    rapid: bool = False  # off the part
    normal: Place | None = None  # the tool's axis at the end
    line: int = 0  # of the file


@dataclass(frozen=True)
class Arc:
    start: Place
    end: Place
    centre: Place  # at the height of the start
    axis: Place  # unit vector
    turn: float  # [rad], right-handed about the axis
    feed: float | None = None
    rapid: bool = False
    normal: Place | None = None
    line: int = 0

    def at(self, share: float) -> Place:
        """Where it is after a share of it; the radius and the height run evenly from start to end."""
        out = [s - c for s, c in zip(self.start, self.centre, strict=True)]
        rise = dot([e - c for e, c in zip(self.end, self.centre, strict=True)], self.axis)
        end = [e - c - rise * a for e, c, a in zip(self.end, self.centre, self.axis, strict=True)]
        radius = length(out) + share * (length(end) - length(out))
        unit = [v / length(out) for v in out]
        aside = cross(self.axis, unit)
        cos, sin = math.cos(share * self.turn), math.sin(share * self.turn)
        x, y, z = (
            c + radius * (cos * u + sin * v) + share * rise * a
            for c, u, v, a in zip(self.centre, unit, aside, self.axis, strict=True)
        )
        return x, y, z

    @property
    def unsure(self) -> float:
        """By how much [mm] the radii at both ends differ: the file's rounding."""
        rise = dot([e - c for e, c in zip(self.end, self.centre, strict=True)], self.axis)
        end = [e - c - rise * a for e, c, a in zip(self.end, self.centre, self.axis, strict=True)]
        return abs(length(end) - length([s - c for s, c in zip(self.start, self.centre, strict=True)]))


@dataclass
class Reading:
    """A file: its motions in order, and the line that ended it (0: the file's own end)."""

    moves: list[Line | Arc] = field(default_factory=list)
    ended: int = 0
    normal: Place | None = None  # the tool's axis where it begins
    points: bool = False  # places to be passed, not lines
    stands: bool = False  # the first motion comes from where FROM says that the tool stands


def place(values: Iterable[float | None]) -> Place:
    """Three coordinates that are known."""
    x, y, z = values
    if x is None or y is None or z is None:
        raise Unreadable("a place that is not known")
    return x, y, z


def dot(a, b) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


def cross(a, b) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def length(a) -> float:
    return math.sqrt(dot(a, a))


def number(text: str, exponent: bool = False) -> float:
    """A sign, digits and one point; nothing else."""
    digits = text[1:] if text[:1] in ("+", "-") else text
    if exponent and "E" in digits.upper():
        digits, _, power = digits.upper().partition("E")
        power = power[1:] if power[:1] in ("+", "-") else power
        if not power or any(c not in "0123456789" for c in power):
            raise Unreadable(f"not a number: {text!r}")
    if (
        digits.count(".") > 1
        or not digits.replace(".", "")
        or any(c not in "0123456789" for c in digits.replace(".", ""))
    ):
        raise Unreadable(f"not a number: {text!r}")
    return float(text)


def lines_of(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


# G-code ----------------------------------------------------------------------------------------------------------

#: Words that say nothing of where the tool goes, and the group of which a block may have one.
STILL_G = {40: "cutter", 43: "length", 49: "length", 80: "motion", 94: "feed", 97: "spindle", 61: "path", 64: "path"}
STILL_M = {0: "stop", 1: "stop", 3: "spindle", 4: "spindle", 5: "spindle", 7: "mist", 8: "flood", 9: "coolant", 48: "o"}
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


def words(line: str) -> list[tuple[str, float]]:
    """Letters and numbers of a block."""
    kept, i = "", 0
    while i < len(line):
        if line[i] == ";":
            break
        if line[i] == "(":
            end = line.find(")", i)
            if end < 0 or "(" in line[i + 1 : end]:
                raise Unreadable("a remark that is not closed, or one in another")
            i = end
        elif line[i] not in " \t":
            kept += line[i].upper()
        i += 1
    out: list[tuple[str, float]] = []
    i = 0
    while i < len(kept):
        letter = kept[i]
        if letter not in "ABCDEFGHIJKLMNOPQRSTUVWXYZ":
            raise Unreadable(f"not a word: {kept[i:]!r}")
        end = i + 1
        while end < len(kept) and kept[end] in "+-.0123456789":
            end += 1
        out.append((letter, number(kept[i + 1 : end])))
        i = end
    return out


def gcode(text: str) -> Reading:
    """Lines and arcs of a G-code file."""
    read = Reading()
    at: list[float | None] = [None, None, None]
    plane, scale, absolute, motion, feed, offset = PLANES[17], 1.0, True, None, None, None
    percent, begun, centres_absolute = False, False, False
    for n, line in enumerate(lines_of(text), 1):
        if line.strip(" \t") == "%":
            if begun and not percent:
                if any(other.strip(" \t") for other in lines_of(text)[n:]):
                    raise Unreadable(f"line {n}: a % without one before, and more behind it")
                read.ended = n
                return read
            if percent:
                read.ended = n
                return read
            percent = True
            continue
        block = words(line)
        begun = begun or bool(block)
        if not block:
            continue
        codes: dict[str, float] = {}
        has: dict[str, float] = {}
        for letter, value in block:
            if letter in "GM":
                group = group_of(letter, value, n)
                if group in codes:
                    raise Unreadable(f"line {n}: two words of one kind")
                codes[group] = value
            elif letter in has:
                raise Unreadable(f"line {n}: {letter} stands twice")
            else:
                has[letter] = value
        dwell = "dwell" in codes
        for letter in has:
            if letter == "H" and codes.get("length") == 43:  # which tool's length: coordinates are its tip's
                continue
            if letter not in "NSFTXYZIJKRP" and not (letter == "O" and not read.moves and len(block) == 1):
                raise Unreadable(f"line {n}: {letter} is not known")
        if (has.get("T") is not None or "tool" in codes) and read.moves:
            raise Unreadable(f"line {n}: another tool")
        if dwell:
            if len(codes) > 1 or len(has.keys() - {"N"}) != 1 or not has.keys() & {"P", "X"}:
                raise Unreadable(f"line {n}: a dwell with other words")
            continue
        if "P" in has:
            raise Unreadable(f"line {n}: P without a dwell")
        plane = PLANES[int(codes["plane"])] if "plane" in codes else plane
        if "units" in codes:
            scale = INCH if codes["units"] == 20 else 1.0
        if "offset" in codes:
            if offset != codes["offset"] and (offset is not None or read.moves or any(v is not None for v in at)):
                raise Unreadable(f"line {n}: another work offset")
            offset = codes["offset"]
        if "centres" in codes:
            centres_absolute = codes["centres"] == 90.1
        absolute = codes["distance"] == 90 if "distance" in codes else absolute
        if "F" in has:
            if has["F"] <= 0:
                raise Unreadable(f"line {n}: a feed of nothing")
            feed = has["F"] * scale / 60
        if "motion" in codes:
            motion = None if codes["motion"] == 80 else codes["motion"]
        axes = {k: has[c] * scale for k, c in enumerate("XYZ") if c in has}
        around = {c: has[c] * scale for c in "IJKR" if c in has}
        if axes or around:
            if motion is None:
                raise Unreadable(f"line {n}: a place, and no word how to go there")
            if motion in (0, 1) and around:
                raise Unreadable(f"line {n}: a centre, and a straight line")
            if not absolute and any(v is None for v in at):
                raise Unreadable(f"line {n}: by so much from an unknown place")
            end = list(at)
            for k, value in axes.items():
                before = at[k]
                end[k] = value if absolute or before is None else before + value
            if any(v is None for v in end) and motion != 0:
                raise Unreadable(f"line {n}: a line to an unknown place")
            if any(v is None for v in at) or any(v is None for v in end):
                if motion in (2, 3):
                    raise Unreadable(f"line {n}: an arc from an unknown place")
            elif motion in (0, 1):
                if motion == 1 or axes:
                    read.moves.append(Line(place(at), place(end), None if motion == 0 else feed, motion == 0, None, n))
            else:
                read.moves.append(arc(at, end, around, plane, motion == 3, centres_absolute, feed, n))
            at = end
        elif motion in (2, 3) and "motion" in codes:
            raise Unreadable(f"line {n}: an arc without an end and a centre")
        if codes.get("stop") in (2, 30):
            read.ended = n
            return read
    if percent:
        raise Unreadable("the file begins with %, and no other one ends it")
    return read


def group_of(letter: str, value: float, n: int) -> str:
    if letter == "M":
        if value in (2, 30):
            return "stop"
        if value == 6:
            return "tool"
        if value not in STILL_M:
            raise Unreadable(f"line {n}: M{value:g} is not known")
        return STILL_M[int(value)]
    if value in (0, 1, 2, 3, 80):
        return "motion"
    if value == 4:
        return "dwell"
    if value in PLANES:
        return "plane"
    if value in (20, 21):
        return "units"
    if value in (54, 55, 56, 57, 58, 59):
        return "offset"
    if value in (90, 91):
        return "distance"
    if value in (90.1, 91.1):
        return "centres"
    if value not in STILL_G:
        raise Unreadable(f"line {n}: G{value:g} is not known")
    return STILL_G[int(value)]


def arc(at, end, around, plane, left, centres_absolute, feed, n) -> Arc:
    """An arc of G2 (with the clock) or G3, in a plane, by its centre or its radius."""
    u, v, w = plane
    names = "IJK"
    axis = place(1.0 if k == w else 0.0 for k in range(3))
    chord = (end[u] - at[u], end[v] - at[v])
    far = math.hypot(*chord)
    centre = list(at)
    if "R" in around:
        if len(around) > 1 or far == 0:
            raise Unreadable(f"line {n}: R beside a centre, or a full circle by R")
        radius = abs(around["R"])
        high2 = radius**2 - (far / 2) ** 2
        if high2 < 0 and far / 2 - radius > APART_MM:
            raise Unreadable(f"line {n}: the radius does not reach")
        high = math.sqrt(max(high2, 0.0)) * (1 if (around["R"] > 0) == left else -1)
        centre[u] = at[u] + chord[0] / 2 - high * chord[1] / far
        centre[v] = at[v] + chord[1] / 2 + high * chord[0] / far
    else:
        if names[w] in around or (names[u] not in around and names[v] not in around):
            raise Unreadable(f"line {n}: an arc without a centre in its plane")
        if centres_absolute:
            if names[u] not in around or names[v] not in around:
                raise Unreadable(f"line {n}: half a centre")
            centre[u], centre[v] = around[names[u]], around[names[v]]
        else:
            centre[u] += around.get(names[u], 0.0)
            centre[v] += around.get(names[v], 0.0)
    first = math.atan2(at[v] - centre[v], at[u] - centre[u])
    last = math.atan2(end[v] - centre[v], end[u] - centre[u])
    turn = (last - first) % (2 * math.pi) if left else -((first - last) % (2 * math.pi))
    if far == 0:
        turn = 2 * math.pi if left else -2 * math.pi
    elif abs(turn) < 1e-12:
        raise Unreadable(f"line {n}: an end on the way from the centre to the start")
    return checked(Arc(place(at), place(end), place(centre), axis, turn, feed, False, None, n))


def checked(move: Arc) -> Arc:
    """The arc, when it has a radius and ends where it says."""
    if length([s - c for s, c in zip(move.start, move.centre, strict=True)]) == 0 or move.unsure > APART_MM:
        raise Unreadable(f"line {move.line}: the centre is not in the middle between start and end")
    return move


# APT -------------------------------------------------------------------------------------------------------------

TEXT = ("PARTNO", "PPRINT", "REMARK", "TPRINT")
STILL = (
    "MACHIN",
    "CLEARP",
    "CUTTER",
    "LOADTL",
    "SPINDL",
    "COOLNT",
    "MULTAX",
    "INTOL",
    "OUTTOL",
    "STOP",
    "OPSTOP",
    "DELAY",
)


def statements(text: str) -> list[tuple[int, str]]:
    """Lines joined where a ``$`` goes on, without remarks; each with the line where it begins."""
    out, waiting, first = [], "", 0
    for n, line in enumerate(lines_of(text), 1):
        line = line[: line.index("$$")] if "$$" in line else line
        line = line.strip(" \t")
        first = first or n
        if line.endswith("$"):
            waiting += line[:-1]
            continue
        if waiting + line:
            out.append((first, waiting + line))
        waiting, first = "", 0
    if waiting:
        raise Unreadable("the last line goes on")
    return out


def apt(text: str) -> Reading:
    """Lines and arcs of an APT file."""
    read = Reading()
    at: Place | None = None
    normal: Place | None = None
    scale, feed, rapid, circle, from_there = 1.0, None, False, None, False
    for n, statement in statements(text):
        if any(statement.upper().startswith(word) for word in TEXT):
            continue
        major, slash, rest = statement.partition("/")
        major = major.strip(" \t").upper()
        minors = [m.strip(" \t").upper() for m in rest.split(",")] if slash else []
        if circle is not None and major not in ("GOTO", "FEDRAT"):
            raise Unreadable(f"line {n}: a circle without an end")
        if major in ("FINI", "END"):
            read.ended = n
            break
        if major == "UNITS":
            if minors not in (["MM"], ["INCHES"]) or at is not None:
                raise Unreadable(f"line {n}: units")
            scale = INCH if minors == ["INCHES"] else 1.0
        elif major == "CUTCOM" and minors == ["OFF"]:
            continue
        elif major == "FEDRAT":
            feeds = [m for m in minors if m not in ("MMPM", "PERMIN")]
            if len(feeds) != 1 or number(feeds[0], True) <= 0:
                raise Unreadable(f"line {n}: a feed that is not in mm a minute")
            feed = number(feeds[0], True) * scale / 60
        elif major == "RAPID" and not minors:
            rapid = True
        elif major == "CIRCLE":
            values = [number(m, True) for m in minors]
            if len(values) != 7 or at is None:
                raise Unreadable(f"line {n}: a circle is x, y, z, i, j, k, r, from a known place")
            circle = [scale * v for v in values[:3]], values[3:6], scale * values[6]
        elif major in ("GOTO", "FROM", "GODLTA"):
            values = [number(m, True) for m in minors]
            if len(values) not in (3, 6) or (major == "GODLTA" and (len(values) == 6 or at is None)):
                raise Unreadable(f"line {n}: {major} wants x, y, z and may have i, j, k")
            axis = place(values[3:]) if values[3:] else None
            if (major != "GODLTA" and at is not None and (axis is None) != (normal is None)) or (
                axis and abs(length(axis) - 1) > 1e-3
            ):
                raise Unreadable(f"line {n}: a tool's axis that is no unit vector, or not in every line")
            end = place(scale * v for v in values[:3])
            if major == "GODLTA" and at is not None:
                end, axis = place(a + e for a, e in zip(at, end, strict=True)), normal
            if major == "FROM" and at is not None:
                raise Unreadable(f"line {n}: FROM after a motion")
            if at is None:
                read.normal = axis
            elif circle is not None:
                read.moves.append(apt_arc(at, end, circle, feed, axis, n))
            else:
                read.moves.append(Line(at, end, None if rapid else feed, rapid or from_there, axis, n))
            from_there = major == "FROM"
            read.stands = read.stands or from_there
            at, normal, circle, rapid = end, axis, None, rapid and major == "FROM"
        elif major not in STILL or (major == "LOADTL" and at is not None):
            raise Unreadable(f"line {n}: {major} is not known")
    if circle is not None:
        raise Unreadable("a circle without an end")
    return read


def apt_arc(at, end, circle, feed, normal, n) -> Arc:
    centre, axis, radius = circle
    if abs(length(axis) - 1) > 1e-3:
        raise Unreadable(f"line {n}: a circle's axis is no unit vector")
    axis = place(a / length(axis) for a in axis)
    high = dot([a - c for a, c in zip(at, centre, strict=True)], axis)
    centre = place(c + high * a for c, a in zip(centre, axis, strict=True))
    out, last = [a - c for a, c in zip(at, centre, strict=True)], [e - c for e, c in zip(end, centre, strict=True)]
    turn = math.atan2(dot(cross(out, last), axis), dot(out, last)) % (2 * math.pi)
    flat = [a - b - (dot(last, axis) - dot(out, axis)) * c for a, b, c in zip(last, out, axis, strict=True)]
    turn = 2 * math.pi if length(flat) < 1e-9 else turn  # back above or below where it began
    move = checked(Arc(at, end, centre, axis, turn, feed, False, normal, n))
    if abs(length(out) - radius) > APART_MM or turn == 0:
        raise Unreadable(f"line {n}: the circle's radius is another one")
    return move


# CSV points ------------------------------------------------------------------------------------------------------

COLUMNS = ("x_mm", "y_mm", "z_mm", "i", "j", "k", "feed_mm_s", "contact", "stop")


def points(text: str) -> Reading:
    """Places of a CSV file, as lines between them; whether lines are meant the path file says."""
    rows = [(n, line.split(",")) for n, line in enumerate(lines_of(text), 1) if line.strip(" \t")]
    header = [name.strip(" \t") for name in rows[0][1]]
    size = {c: 25.4 if c[0] + "_in" in header else 1.0 for c in COLUMNS[:3]}  # each coordinate in its own unit
    header = [name[0] + "_mm" if name in ("x_in", "y_in", "z_in") else name for name in header]
    if len(set(header)) < len(header) or not set(header) <= set(COLUMNS) or not set(COLUMNS[:3]) <= set(header):
        raise Unreadable(f"columns {header}")
    if 0 < len(set("ijk") & set(header)) < 3:
        raise Unreadable("half a normal")
    read = Reading(points=True)
    at: Place | None = None
    for n, cells in rows[1:]:
        if len(cells) != len(header):
            raise Unreadable(f"line {n}: {len(cells)} cells")
        row = {name: cell.strip(" \t") for name, cell in zip(header, cells, strict=True)}
        end = place(size[c] * number(row[c], True) for c in COLUMNS[:3])
        normal = place(number(row[c], True) for c in "ijk") if "i" in row else None
        if normal and abs(length(normal) - 1) > 1e-3:
            raise Unreadable(f"line {n}: a normal that is no unit vector")
        feed = number(row["feed_mm_s"], True) if row.get("feed_mm_s") else None
        if row.get("contact", "1") not in ("0", "1") or row.get("stop", "0") not in ("0", "1"):
            raise Unreadable(f"line {n}: 0 or 1")
        if at is None:
            read.normal = normal
        else:
            read.moves.append(Line(at, end, feed, row.get("contact") == "0", normal, n))
        at = end
    return read


READERS = {"gcode": gcode, "apt": apt, "points": points}
