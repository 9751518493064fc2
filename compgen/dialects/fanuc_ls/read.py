"""Text to meaning, for programs of the form that ``write`` gives; anything else is refused with its line."""

import re
from dataclasses import replace

import numpy as np

from compgen.arrays import Array, IntArray
from compgen.dialects.fanuc_ls import shapes
from compgen.dialects.fanuc_ls.digits import BLOCK, DECIMALS, MOST_DECIMALS, Bytes, different, fits, read_fixed
from compgen.dialects.fanuc_ls.program import Program
from compgen.dialects.fanuc_ls.write import letters, says, speed_said
from compgen.exceptions import InputError
from compgen.ik import ALL_POSTURES
from compgen.rotations import from_wpr
from compgen.units import DEG, MM

_STATEMENT = re.compile(r"\s*\d*:\s*(.*?)\s*;\s*$")
_MOTION = re.compile(r"([JL]) P\[(\d+)\] ([\d.]+)(%|mm/sec|cm/min|inch/min) (FINE|CNT\d+)$")
_FRAME = re.compile(r"(UFRAME|UTOOL)_NUM=(\d+)$")
_NUMBER = r"\s*=\s*(-?\d*\.\d+)\s*"
_POSITION = re.compile(
    r"P\[(\d+)\]\{\s*GP1:\s*UF : (\d+), UT : (\d+),\s*CONFIG : '([FN]) ([UD]) ([TB]), (-?\d+), (-?\d+), (-?\d+)',"
    rf"\s*X{_NUMBER}mm,\s*Y{_NUMBER}mm,\s*Z{_NUMBER}mm,\s*W{_NUMBER}deg,\s*P{_NUMBER}deg,\s*R{_NUMBER}deg\s*\}};\s*"
)


def interpret(data: bytes) -> Program:
    """The program that a text means.

    Text of fixed columns is read by columns, and believed only when writing what was read gives the same bytes.

    Raises:
        InputError: The text is not a program of this form; names the line.
    """
    quick = _by_columns(data)
    if quick is not None and says(*quick, data):
        return quick[0]
    text = data.decode("latin-1").replace("\r\n", "\n")
    sections = re.split(r"^/(MN|POS|END)\b.*\n?", text, flags=re.MULTILINE)
    if len(sections) < 7 or sections[1::2][:3] != ["MN", "POS", "END"] or not text.startswith("/PROG"):
        raise InputError("program: sections /PROG, /MN, /POS and /END are not all there; is this a complete .LS file?")
    head, moves, places = sections[0], sections[2], sections[4]
    name = re.match(r"/PROG\s+(\S+)", head)
    comment = re.search(r'^COMMENT\s*= "(.*)";', head, re.MULTILINE)
    date = re.search(r"^CREATE\s*= DATE (\S+)", head, re.MULTILINE)

    remarks, frames, motions = [], {"UFRAME": 0, "UTOOL": 0}, []
    first = head.count("\n") + 2
    for number, line in enumerate(moves.splitlines(), first):
        statement = _STATEMENT.match(line)
        body = statement.group(1) if statement else ""
        if body.startswith("!"):
            remarks.append(body[1:].rstrip())
        elif (motion := _MOTION.match(body)) and (motion.group(1) == "J") == (motion.group(4) == "%"):
            motions.append((number, *motion.groups()))
        elif frame := _FRAME.match(body):
            frames[frame.group(1)] = int(frame.group(2))
        else:
            raise InputError(f"program: line {number}: '{line.strip()}' is not a statement this reader knows")

    rows, end = [], 0
    for match in _POSITION.finditer(places):
        if match.start() != end:
            break
        rows.append(match.groups())
        end = match.end()
    if end != len(places):
        number = first + moves.count("\n") + 1 + places[:end].count("\n")
        raise InputError(f"program: line {number}: not a position this reader knows")
    order = list(range(1, len(rows) + 1))
    if [int(m[2]) for m in motions] != order or [int(r[0]) for r in rows] != order:
        raise InputError("program: positions are not driven once each in order P[1], P[2], ...")
    if not motions or motions[0][1] != "J" or any(m[1] != "L" for m in motions[1:]):
        raise InputError("program: it does not start with one J motion followed by L motions")
    if {r[1:3] for r in rows} != {(str(frames["UFRAME"]), str(frames["UTOOL"]))} or len({r[3:6] for r in rows}) != 1:
        raise InputError("program: positions differ in frame, tool or CONFIG letters")

    numbers = np.array([r[9:15] for r in rows], dtype=float)
    posture = next(p for p in ALL_POSTURES if letters(p).split() == list(rows[0][3:6]))
    return Program(
        name=name.group(1) if name else "",
        comment=comment.group(1) if comment else "",
        date=date.group(1) if date else "",
        remarks=tuple(remarks),
        uframe=frames["UFRAME"],
        utool=frames["UTOOL"],
        position=numbers[:, :3] * MM,
        rotation=from_wpr(*(numbers[:, 3:] * DEG).T),
        posture=posture,
        turns=np.array([r[6:9] for r in rows], dtype=np.int64),
        speed=np.array([speed_said(f"{m[3]}{m[4]}") for m in motions[1:]]),
        fine=np.array([m[5] == "FINE" for m in motions]),
        decimals=min(max(len(rows[0][9].partition(".")[2]), DECIMALS), MOST_DECIMALS),
    )


def _by_columns(data: bytes) -> tuple[Program, Array] | None:
    """What canonical text would mean, and its table of positions, or None; only ``interpret`` may believe it."""
    moves, places, end = data.find(b"/MN\r\n"), data.find(b"\n/POS\r\n") + 1, data.rfind(b"/END\r\n")
    first = data.find(b":L P[2] ", moves)
    if min(moves, places, end) < 0 or not moves < first < places < end:
        return None
    # the head and the first position, read the careful way, say what all rows share
    first = data.rfind(b"\n", 0, first) + 1
    block = data.find(b"};\r\n", places) + 4
    try:
        small = interpret(data[:first] + data[places:block] + b"/END\r\n")
    except InputError:
        return None
    view = np.frombuffer(data, dtype=np.uint8)
    closing, lines = (_all(view, first, places, mark) for mark in b"]\n")
    equals, quotes = (_all(view, places + 6, end, mark) for mark in b"='")
    N = len(lines) + 1
    if len(closing) != N - 1 or len(equals) != 6 * N or len(quotes) != 2 * N or equals[-1] + 14 > end:
        return None
    tails, which = _texts(view, closing + 2, lines)
    config, config_of = _texts(view, quotes[::2] + 1, quotes[1::2])
    speeds = [_TAIL.match(t) for t in tails]
    turns = [_TURNS.search(t) for t in config]
    if not all(speeds) or not all(turns):
        return None
    whole = read_fixed(view, equals + 2, small.decimals)
    if not fits(whole, small.decimals):
        return None
    numbers = whole.reshape(N, 6) / 10.0**small.decimals
    speed = np.array([speed_said(m.group(1).decode()) for m in speeds if m])
    fine = np.array([m.group(2) == b"FINE" for m in speeds if m])
    digits = np.array([[int(d) for d in m.groups()] for m in turns if m])
    program = replace(
        small,
        position=numbers[:, :3] * MM,
        rotation=from_wpr(*(numbers[:, 3:] * DEG).T),
        turns=digits[config_of],
        speed=speed[which],
        fine=np.concatenate([small.fine, fine[which]]),
    )
    return program, numbers


_TAIL = re.compile(rb"([\d.]+(?:mm/sec|cm/min|inch/min)) (FINE|CNT100) ")
_TURNS = re.compile(rb", (-?\d{1,9}), (-?\d{1,9}), (-?\d{1,9})$")
_LONGEST = 48


def _all(view: Bytes, start: int, end: int, mark: int) -> IntArray:
    """Where a character stands."""
    return shapes.found(view, start, end, lambda part: part[:-1] == mark)


def _texts(view: Bytes, start: IntArray, end: IntArray) -> tuple[list[bytes], IntArray]:
    """The different texts between places, at most 48 characters of each, and which row has which."""
    length = end - start
    width = max(1, min(_LONGEST, int(length.max())))
    texts = np.empty((len(start), width), dtype=np.uint8)
    column = np.arange(width)
    for first in range(0, len(start), BLOCK):
        here = slice(first, first + BLOCK)
        window = shapes.windows(view, start[here], width)
        texts[here] = np.where(column < length[here, None], window, 0)
    rows, which = different(texts)
    return [bytes(t.tobytes().rstrip(b"\0")) for t in texts[rows]], which
