"""A user's G-code, APT or CSV file as corners of straight lines, read for the judge alone.

It shares nothing with the reader that the plan is made from: what both understand is in the file, and what one of them
takes for something else shows as a distance. Arcs and helices are cut into chords that leave them by ``SAG`` at most.
What this reader does not know is refused: a result that only one of them has read is none.
"""

import csv
import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from math import acos, atan2, ceil, cos, hypot, pi, sin, sqrt
from pathlib import Path

import numpy as np
from python_calamine import CalamineWorkbook

from compgen.core.arrays import Array, IntArray
from compgen.core.csv_table import CsvTable, Recorded
from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.job.bounds import OwnFile

SAG = 1e-4  # mm
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|", "blanks": " "}
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "ft": 304.8, "um": 0.001}
MOTION_G, COUNTING_G, DWELL_G = (0.0, 1.0, 2.0, 3.0), (90.0, 91.0), 4.0
QUIET_G = {17.0, 21.0, 40.0, 43.0, 49.0, 54.0, 55.0, 56.0, 57.0, 58.0, 59.0, 61.0, 64.0, 80.0, 91.1, 94.0, 98.0, 99.0}
ENDS, TEXTS = ("FINI", "END"), ("PPRINT", "PARTNO", "REMARK")

Place = tuple[float, float, float]  # mm


class _Corners:
    """Corners as they are read."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.corner: list[Place] = []
        self.line: list[int] = []
        self.given: list[bool] = []

    def add(self, line: int, place: Place, *, given: bool = True) -> None:
        if self.corner and self.corner[-1] == place:
            return
        self.corner.append(place)
        self.line.append(line)
        self.given.append(given)

    def refuse(self, line: int, what: str) -> InputError:
        message = f"{self.source}: line {line}: the second reading, which judges the result, does not know {what}"
        return InputError(f"{message}; say it in plainer words")


def read_own_file(
    source: Path, pattern: str, shift: Array, recorded: CsvTable | None = None, *, joined: bool
) -> OwnFile:
    """Read a path's file for the judge.

    Args:
        source: The file.
        pattern: ``gcode``, ``apt`` or ``points`` (CSV).
        shift: Of all places, (3,) [m].
        recorded: How the first reader took a file of points of another writer's form: its layout and lines alone.
        joined: Whether the path is the lines between the places.

    Raises:
        InputError: It cannot be read, or holds what this reader does not know.
    """
    corners = _Corners(str(source))
    try:
        lines = [line.decode("latin-1") for line in source.read_bytes().removeprefix(BOM_UTF8).splitlines()]
        if recorded is not None and recorded.recorded is not None:
            _recorded(source, recorded.line, recorded.recorded, corners)
        else:
            {"gcode": _gcode, "apt": _apt, "points": _csv}[pattern](lines, corners)
    except (OSError, ValueError, KeyError, IndexError) as fault:
        raise InputError(f"{source}: the second reading, which judges the result, fails: {fault}; mend it") from None
    given = np.array(corners.given, dtype=bool)
    place = np.array(corners.corner, dtype=float).reshape(-1, 3) * MM + shift
    return OwnFile(str(source), place, np.array(corners.line, dtype=np.int64), given, joined)


def _recorded(source: Path, lines: Sequence[int] | IntArray, how: Recorded, corners: _Corners) -> None:
    """Places by the layout that is said of a file; cells are parted and numbers are read anew."""
    rows = dict[int, Sequence[object]]()
    if how.parted in SEPARATORS:
        text = (f"{line.strip(' ')}\n" for line in re.split("\r\n|\r|\n", _decoded(source.read_bytes())))
        reader = csv.reader(text, delimiter=SEPARATORS[how.parted], skipinitialspace=True)
        for row in reader:
            rows[reader.line_num] = row
    else:
        sheet = CalamineWorkbook.from_path(source).get_sheet_by_name(how.parted.removeprefix("sheet ").strip("'"))
        rows = dict(enumerate(sheet.to_python(skip_empty_area=False), 1))
    thousands = "," if how.sign == "." else "."
    for n in lines:
        cells = [(str(rows[n][k]), unit) for k, unit in (how.columns[f"{axis}_mm"] for axis in "xyz")]
        plain = (re.sub(r"[^0-9eE.,+-]", "", cell.replace(thousands, "")).replace(",", ".") for cell, _ in cells)
        x, y, z = (float(cell) * MILLIMETRES[unit] for cell, (_, unit) in zip(plain, cells, strict=True))
        corners.add(int(n), (x, y, z))


def _decoded(data: bytes) -> str:
    """Text in two bytes a sign, in UTF-8, or else in Latin letters, of which no place has any."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16")
    if data[1:2] == b"\0":
        return data.decode("utf-16-le")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _csv(lines: list[str], corners: _Corners) -> None:
    text = [(n, line) for n, line in enumerate(lines, 1) if line.strip(" \t,") and not line.lstrip().startswith("#")]
    rows = csv.reader(line for _, line in text)
    heads = [cell.strip() for cell in next(rows)]
    x, y, z = (heads.index(f"{axis}_mm") for axis in "xyz")
    for (n, _), row in zip(text[1:], rows, strict=True):
        corners.add(n, (float(row[x]), float(row[y]), float(row[z])))


def _apt(lines: list[str], corners: _Corners) -> None:
    whole, begun, at = "", 0, (0.0, 0.0, 0.0)
    for n, line in enumerate(lines, 1):
        begun = begun or n
        part = line[: line.index("$$")] if "$$" in line else line
        if part.rstrip().endswith("$") and (whole or not part.strip().upper().startswith(TEXTS)):
            whole += part.rstrip()[:-1]
            continue
        statement, first = (whole + part).strip().upper(), begun
        whole, begun = "", 0
        if statement in ENDS:
            return
        word, _, rest = (piece.strip() for piece in statement.partition("/"))
        if word == "UNITS" and rest[:2] != "MM":
            raise corners.refuse(first, f"UNITS/{rest[:16]}")
        if word in ("GOTO", "GODLTA", "FROM"):
            numbers = [float(cell.replace("D", "E")) for cell in rest.split(",")]
            x, y, z = numbers[:3]
            at = (at[0] + x, at[1] + y, at[2] + z) if word == "GODLTA" else (x, y, z)
            if word != "FROM":
                corners.add(first, at)


def _gcode(lines: list[str], corners: _Corners) -> None:
    at: dict[str, float] = {}
    motion, relative, begun = -1.0, False, False
    for n, line in enumerate(lines, 1):
        words = list(_words(line))
        if not words:
            if begun and line.strip() == "%":
                return
            continue
        begun = True
        codes = [value for letter, value in words if letter == "G"]
        values = {letter: value for letter, value in words if letter in "XYZIJKRP"}
        for code in codes:
            if code not in MOTION_G and code not in COUNTING_G and code not in QUIET_G and code != DWELL_G:
                raise corners.refuse(n, f"G{code:g}")
        motion = next((code for code in reversed(codes) if code in MOTION_G), motion)
        relative = next((code == 91.0 for code in reversed(codes) if code in COUNTING_G), relative)
        moves = any(axis in values for axis in "XYZ") or (motion >= 2 and ("I" in values or "J" in values))
        if moves and DWELL_G not in codes:
            start = dict(at)
            at |= {a: values[a] + (start[a] if relative else 0.0) for a in "XYZ" if a in values}
            if len(at) == 3:
                if motion >= 2:
                    _arc(corners, n, start, at, values, -1 if motion == 2 else 1)
                corners.add(n, (at["X"], at["Y"], at["Z"]))
        if any(letter == "M" and value in (2.0, 30.0) for letter, value in words):
            return


def _words(line: str) -> Iterator[tuple[str, float]]:
    """Letters and numbers of a block, character by character, without remarks."""
    letter, number, inside = "", "", False
    for sign in line.upper() + "\n":
        if inside or sign == "(":
            inside = sign != ")"
        elif sign == ";":
            break
        elif sign in "+-.0123456789":
            number += sign
        elif sign.isalpha():
            if letter:
                yield letter, float(number)
            letter, number = sign, ""
    if letter:
        yield letter, float(number)


def _arc(
    corners: _Corners, line: int, start: dict[str, float], end: dict[str, float], values: dict[str, float], sense: int
) -> None:
    """Corners on an arc, without its ends; its sense is -1 clockwise, else 1."""
    dx, dy = end["X"] - start["X"], end["Y"] - start["Y"]
    if "R" in values:
        # the centre lies beside the chord, where the arc's shorter or (R < 0) longer way turns in its sense
        aside = sqrt(max(values["R"] ** 2 / (dx * dx + dy * dy) - 0.25, 0.0)) * sense * (1 if values["R"] > 0 else -1)
        cx, cy = start["X"] + dx / 2 - aside * dy, start["Y"] + dy / 2 + aside * dx
    else:
        cx, cy = start["X"] + values.get("I", 0.0), start["Y"] + values.get("J", 0.0)
    a0, r0 = atan2(start["Y"] - cy, start["X"] - cx), hypot(start["X"] - cx, start["Y"] - cy)
    a1, r1 = atan2(end["Y"] - cy, end["X"] - cx), hypot(end["X"] - cx, end["Y"] - cy)
    way = (a1 - a0) * sense
    while way < 1e-9:
        way += 2 * pi
    while way > 2 * pi + 1e-9:
        way -= 2 * pi
    pieces = ceil(way / (2 * acos(max(1 - SAG / max(r0, SAG), -1.0))))
    for k in range(1, pieces):
        share = k / pieces
        a, r = a0 + sense * way * share, r0 + (r1 - r0) * share
        corners.add(line, (cx + r * cos(a), cy + r * sin(a), start["Z"] + share * (end["Z"] - start["Z"])), given=False)
