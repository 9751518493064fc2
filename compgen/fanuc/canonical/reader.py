"""Text to meaning, for programs of the form that ``compose`` writes; anything else is refused with its line."""

import re
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, frozen
from compgen.core.decimals import DECIMALS, MOST_DECIMALS, fits_fixed, parse_fixed, word_view
from compgen.core.evaluation import parallel_for
from compgen.core.exceptions import InputError
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.canonical.layout import (
    BLOCK,
    MARK,
    MARK_BACK,
    Frame,
    motion_tail,
    motions,
    position_config,
    positions,
)
from compgen.fanuc.canonical.writer import acc_text, fill_poses, parse_speed
from compgen.fanuc.circular import check_circles
from compgen.fanuc.configuration import config_letters
from compgen.fanuc.listing.templates import hash_rows, unique_keys, windows
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import ALL_POSTURES

_STATEMENT = re.compile(r"\s*\d*:\s*(.*?)\s*;\s*$")
_MOTION = re.compile(
    r"([JLC])(?: P\[(\d+)\])? P\[(\d+)\] (\d+\.?\d*|\.\d+)(%|mm/sec|cm/min|inch/min) (FINE|CNT\d+)(?: ACC(\d+))?$"
)
_VIA_LINE, _END_LINE = re.compile(r"\s*\d*:\s*C P\[\d+\]\s*$"), re.compile(r"\s*:\s*(P\[.*)")
_FRAME = re.compile(r"(UFRAME|UTOOL)_NUM=(\d+)$")
_PAYLOAD = re.compile(r"PAYLOAD\[(\d+)\]$")
_NUMBER = r"\s*=\s*(-?\d*\.\d+)\s*"
_POSITION = re.compile(
    r"P\[(\d+)\]\{\s*GP1:\s*UF : (\d+), UT : (\d+),\s*CONFIG : '([FN]) ([UD]) ([TB]), (-?\d+), (-?\d+), (-?\d+)',"
    rf"\s*X{_NUMBER}mm,\s*Y{_NUMBER}mm,\s*Z{_NUMBER}mm,\s*W{_NUMBER}deg,\s*P{_NUMBER}deg,\s*R{_NUMBER}deg\s*\}};\s*"
)


class _Target(NamedTuple):
    """A position that a motion goes to or through."""

    line: int
    letter: str
    number: int
    speed: str
    fine: bool
    via: bool
    acc: str | None


def _statement_lines(moves: str, first: int) -> Iterator[tuple[int, str]]:
    """Lines with their numbers, the via of a circular motion and its end, which stand on two, as one."""
    lines = enumerate(moves.splitlines(), first)
    for number, line in lines:
        if _VIA_LINE.match(line):
            end = _END_LINE.match(next(lines, (0, ""))[1])
            if end is None:
                raise InputError(f"program: line {number}: a circular motion names no end on the line after its via")
            line = f"{line.rstrip()} {end.group(1)}"
        yield number, line


def interpret(data: bytes) -> Program:
    """The program that a text means.

    Canonical text is read by columns, and believed only where writing what was read gives the same bytes.

    Raises:
        InputError: The text is not a program of this form; names the line.
    """
    canonical = read_columns(data)
    if canonical is not None:
        return canonical
    text = data.decode("latin-1").replace("\r\n", "\n")
    sections = re.split(r"^/(MN|POS|END)\b.*\n?", text, flags=re.MULTILINE)
    if len(sections) < 7 or sections[1::2][:3] != ["MN", "POS", "END"] or not text.startswith("/PROG"):
        raise InputError("program: sections /PROG, /MN, /POS and /END are not all there; is this a complete .LS file?")
    head, moves, places = sections[0], sections[2], sections[4]
    name = re.match(r"/PROG\s+(\S+)", head)
    comment = re.search(r'^COMMENT\s*= "(.*)";', head, re.MULTILINE)
    date = re.search(r"^CREATE\s*= DATE (\S+)", head, re.MULTILINE)

    remarks, frames, payload, targets = [], {"UFRAME": 0, "UTOOL": 0}, None, list[_Target]()
    first = head.count("\n") + 2
    for number, line in _statement_lines(moves, first):
        statement = _STATEMENT.match(line)
        body = statement.group(1) if statement else ""
        if body.startswith("!"):
            remarks.append(body[1:].rstrip())
        elif (motion := _MOTION.match(body)) and (motion.group(1) == "J") == (motion.group(5) == "%"):
            letter, via, end, speed, unit, termination, acc = motion.groups()
            if (letter == "C") != (via is not None):
                raise InputError(f"program: line {number}: '{line.strip()}': C has a via and an end, J and L an end")
            if via:
                targets.append(
                    _Target(
                        line=number,
                        letter=letter,
                        number=int(via),
                        speed=f"{speed}{unit}",
                        fine=False,
                        via=True,
                        acc=acc,
                    )
                )
            targets.append(
                _Target(
                    line=number,
                    letter=letter,
                    number=int(end),
                    speed=f"{speed}{unit}",
                    fine=termination == "FINE",
                    via=False,
                    acc=acc,
                )
            )
        elif frame := _FRAME.match(body):
            frames[frame.group(1)] = int(frame.group(2))
        elif (schedule := _PAYLOAD.match(body)) and not targets:
            payload = int(schedule.group(1))
        else:
            raise InputError(f"program: line {number}: '{line.strip()}' is not a statement this reader knows")

    rows, last = [], 0
    for match in _POSITION.finditer(places):
        if match.start() != last:
            break
        rows.append(match.groups())
        last = match.end()
    if last != len(places):
        number = first + moves.count("\n") + 1 + places[:last].count("\n")
        raise InputError(f"program: line {number}: not a position this reader knows")
    order = list(range(1, len(rows) + 1))
    if [t.number for t in targets] != order or [int(r[0]) for r in rows] != order:
        raise InputError("program: positions are not driven once each in order P[1], P[2], ...")
    if not targets or targets[0].letter != "J" or any(t.letter == "J" for t in targets[1:]):
        raise InputError("program: it does not start with one J motion followed by L and C motions")
    if {r[1:3] for r in rows} != {(str(frames["UFRAME"]), str(frames["UTOOL"]))} or len({r[3:6] for r in rows}) != 1:
        raise InputError("program: positions differ in frame, tool or CONFIG letters")

    if len({t.acc for t in targets}) != 1:
        raise InputError("program: motions differ in their ACC")

    numbers = np.array([r[9:15] for r in rows], dtype=float)
    posture = next(p for p in ALL_POSTURES if config_letters(p).split() == list(rows[0][3:6]))
    program = Program(
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
        speed=np.array([parse_speed(t.speed) for t in targets[1:]]),
        fine=np.array([t.fine for t in targets]),
        via=np.array([t.via for t in targets]),
        decimals=min(max(len(rows[0][9].partition(".")[2]), DECIMALS), MOST_DECIMALS),
        payload=payload,
        acc=None if targets[0].acc is None else int(targets[0].acc),
    )
    check_circles(program, lambda n: f"line {targets[n - 1].line}: ")
    return program


def read_columns(data: bytes) -> Program | None:
    """What canonical text means, a block of rows at a time, or None.

    A guess at where the numbers stand is enough: what is read counts only when the rows written from it are, byte for
    byte, those that were read.
    """
    moves, places, end = data.find(b"/MN\r\n"), data.find(b"\n/POS\r\n") + 1, len(data) - len(b"/END\r\n")
    linear = _FIRST.search(data, moves, places) if 0 <= moves < places else None
    if linear is None or not data.startswith(b"/END\r\n", end):
        return None
    # the head and the first position, read line by line, hold what all rows share
    block = data.find(b"};\r\n", places) + 4
    try:
        sample = interpret(data[: linear.start()] + data[places:block] + b"/END\r\n")
        lines = row_ends(data, linear.start(), places, b"\n", 1)
        blocks = row_ends(data, places + len(b"/POS\r\n"), end, MARK, MARK_BACK)
        if len(lines) + 1 != len(blocks):
            return None
        speed, fine = _motions(data, int(linear.group(1)), lines, acc_text(sample.acc))
        position, rotation, turns = _positions(data, sample, blocks)
    except InputError:
        return None
    return replace(
        sample,
        position=frozen(position),
        rotation=frozen(rotation),
        turns=frozen(turns),
        speed=frozen(speed),
        fine=np.concatenate([sample.fine, fine]),
        via=np.zeros(len(position), dtype=bool),
    )


_FIRST = re.compile(rb"^ *(\d{1,8}):L P\[2\] ", re.MULTILINE)
_TAIL = re.compile(rb"(\d+(?:\.\d+)?(?:mm/sec|cm/min|inch/min)) (FINE|CNT100)( ACC\d{1,3})?    ;\r\n")
_CONFIG = re.compile(rb"([FN] [UD] [TB]), (-?\d{1,9}), (-?\d{1,9}), (-?\d{1,9})")
_LONGEST = 48
_WINDOW = 1 << 16  # bytes that are searched for marks at a time
_AHEAD = 32  # rows of one length that are guessed at first


def _motions(data: bytes, line: int, bounds: IntArray, acc: str) -> tuple[Array, BoolArray]:
    """Speeds [m/s] and stops of linear motions to P[2] and so on, with one ACC; row k is from edge k to the next."""
    speed, fine = np.empty(len(bounds) - 1), np.empty(len(bounds) - 1, dtype=bool)

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            first, last = rows.start + 2, rows.stop + 2
            begin = bounds[rows] + motion_tail(line + at, first, last)
            tails, which = _unique_texts(data, begin, bounds[at + 1 : rows.stop + 1])
            _require_text(data, int(bounds[at]), motions(line + at, first, last, tails, which))
            parsed = [_full_match(_TAIL, tail) for tail in tails]
            if any((word or b"") != acc.encode() for *_, word in parsed):
                raise InputError("ACC")
            speed[rows] = np.array([parse_speed(number.decode()) for number, *_ in parsed])[which]
            fine[rows] = np.array([end == b"FINE" for _, end, _ in parsed])[which]

    parallel_for(len(speed), part)
    return speed, fine


def _positions(data: bytes, sample: Program, bounds: IntArray) -> tuple[Array, Array, IntArray]:
    """Positions (N, 3) [m], rotations (N, 3, 3) and turns (N, 3); row k is from edge k to the next."""
    N, frame = len(bounds) - 1, Frame(sample.uframe, sample.utool, sample.decimals)
    position, rotation, turns = np.empty((N, 3)), np.empty((N, 3, 3)), np.empty((N, 3), dtype=np.int64)
    posture = config_letters(sample.posture).encode()

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            begin = bounds[rows] + position_config(frame, at + 1, rows.stop + 1)
            behind = bounds[at + 1 : rows.stop + 1] - frame.tail
            configs, which = _unique_texts(data, begin, behind)
            units = parse_fixed(windows(data, behind, frame.tail), frame.places, frame.decimals)
            if not fits_fixed(units, frame.decimals):
                raise InputError("number")
            _require_text(data, int(bounds[at]), positions(frame, at + 1, units, configs, which))
            parsed = [_full_match(_CONFIG, config) for config in configs]
            if any(own != posture for own, *_ in parsed):
                raise InputError("CONFIG")
            turns[rows] = np.array([[int(n) for n in digits] for _, *digits in parsed])[which]
            fill_poses(units, frame.decimals, position[rows], rotation[rows])

    parallel_for(N, part)
    return position, rotation, turns


def _full_match(form: re.Pattern[bytes], text: bytes) -> tuple[bytes, ...]:
    """What fills a form."""
    match = form.fullmatch(text)
    if match is None:
        raise InputError(text.decode("latin-1"))
    return match.groups()


def _require_text(data: bytes, at: int, text: bytes | memoryview) -> None:
    """Raises InputError unless a text stands at a place."""
    if not data.startswith(text, at):
        raise InputError(f"byte {at}")


def row_ends(data: bytes, start: int, end: int, mark: bytes, back: int, window: int = _WINDOW) -> IntArray:
    """The start, and where each row ends: so far behind its mark. Rows mostly are as long as the one before.

    Raises:
        InputError: The last does not end at the end.
    """
    view = np.frombuffer(data, dtype=np.uint8)
    bounds_parts = [np.array([start])]
    at, width, ahead = start, 0, _AHEAD
    while at < end:
        rows = min(ahead, (end - at) // width) if width else 0
        if rows and (view[at + width - back : at + rows * width : width] == mark[0]).all():
            ends = at + width * np.arange(1, rows + 1)
            ahead *= 2
        else:
            ahead = _AHEAD
            ends = np.flatnonzero(view[at : min(at + window, end)] == mark[0]) + at + back
            width = int(ends[-1] - (ends[-2] if len(ends) > 1 else at)) if len(ends) else 0
        if width == 0:
            break
        bounds_parts.append(ends)
        at = int(ends[-1])
    if at != end:
        raise InputError(f"byte {at}")
    return np.concatenate(bounds_parts)


def _unique_texts(data: bytes, start: IntArray, end: IntArray) -> tuple[list[bytes], IntArray]:
    """The different texts between places and which row has which, by length, first 16 and last 8 characters."""
    length = end - start
    if length.min() < 8 or length.max() > _LONGEST:
        raise InputError("text")
    words = [
        word_view(windows(data, place, 8), 0, np.uint64).copy()
        for place in (start, np.minimum(start + 8, end - 8), end - 8)
    ]
    rows, which = unique_keys(hash_rows([*words, length.view(np.uint64)]))
    return [data[a:b] for a, b in zip(start[rows].tolist(), end[rows].tolist(), strict=True)], which
