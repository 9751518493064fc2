"""A program's text, after the format's description: motions L and the first J, positions, CALLs of pages; nothing else.

What it does not know it refuses, so that nothing in a program goes unread.
"""

import re
from dataclasses import dataclass

import numpy as np

MOTION = re.compile(r"(J|L) +P\[(\d+)\] +(\d+(?:\.\d+)?)(%|mm/sec|cm/min|inch/min) +(FINE|CNT100) *")
FRAME = re.compile(r" *(UFRAME_NUM|UTOOL_NUM)=(\d+) *")
CALL = re.compile(r" *CALL (\w+) *")
IDLE = re.compile(r" *(!.*|MESSAGE\[[^\]]*\]|PAUSE) *")
NUMBER = r"(-?\d*\.\d+) +"
POSITION = re.compile(
    r"\s*P\[(\d+)\]\{\s*GP1:\s*UF : (\d+), UT : (\d+),\s*CONFIG : '([NF]) ([UD]) ([TB]), (-?\d+), (-?\d+), (-?\d+)',\s*"
    + r",\s*".join(rf"{name} = *{NUMBER}{unit}" for name, unit in zip("XYZWPR", ["mm"] * 3 + ["deg"] * 3, strict=True))
    + r"\s*\};"
)
STEPS_MM_S = (1.0, 10 / 60, 2.54 / 60)  # of a speed: whole mm/sec and cm/min, tenths of inch/min
MM_S = {"mm/sec": 1.0, "cm/min": 10 / 60, "inch/min": 25.4 / 60}


class UnreadableError(Exception):
    """A text that this reader does not read."""


@dataclass(frozen=True)
class Program:
    """N positions in the order in which they are driven to."""

    numbers: np.ndarray  # (N, 6) X Y Z [mm] W P R [deg] as written
    letters: np.ndarray  # (N, 3) of CONFIG
    turns: np.ndarray  # (N, 3) of CONFIG
    stop: np.ndarray  # (N,) the robot stops there
    speed_mm_s: np.ndarray  # (N - 1,) written
    uframe: int
    utool: int


def read(folder, name):
    """The program of a folder, its pages one after the other."""
    motions, positions, frames = [], [], set()
    for page in _pages(folder, name):
        steps, places, frame = _page(folder, page)
        if motions:  # a page begins where the one before it ended, standing
            if places[0] != positions[-1]:
                raise UnreadableError(f"{page}: begins elsewhere than the page before it ended")
            steps, places = steps[1:], places[1:]
        motions, positions, frames = motions + steps, positions + places, frames | {frame}
    if len(frames) != 1:
        raise UnreadableError(f"{name}: pages in different frames")
    uframe, utool = frames.pop()
    return Program(
        np.array([p[5:] for p in positions]),
        np.array([p[2] for p in positions]),
        np.array([p[3] for p in positions]),
        np.array([stop for _, stop in motions]),
        np.array([speed for speed, _ in motions[1:]]),
        uframe,
        utool,
    )


def _pages(folder, name):
    """The file itself, or the programs that it calls."""
    called = [match[1] for _, text in _statements(folder, name) if (match := CALL.fullmatch(text))]
    return [f"{program}.LS" for program in called] or [name]


def _text(folder, name):
    try:
        return (folder / name).read_text("latin-1")
    except OSError as problem:
        raise UnreadableError(f"{name}: {problem}") from None


def _statements(folder, name):
    """Line number and statement of each line between /MN and /POS."""
    body = re.search(r"^/MN\r?\n(.*?)^/POS\r?\n(.*)^/END\s*\Z", _text(folder, name), re.S | re.M)
    if not body:
        raise UnreadableError(f"{name}: no /MN, /POS and /END")
    out = []
    for line in body[1].splitlines():
        match = re.fullmatch(r" *(\d+):(.*);", line)
        if not match:
            raise UnreadableError(f"{name}: {line!r} is no statement")
        out.append((int(match[1]), match[2]))
    return out


def _page(folder, name):
    """(speed [mm/s], stop) of each motion, (CONFIG, frames, numbers) of each position, and the frames set."""
    motions, frame = [], {}
    for line, text in _statements(folder, name):
        if match := MOTION.fullmatch(text):
            kind, index, value, unit, end = match.groups()
            n = len(motions) + 1
            if int(index) != n or (kind == "J") != (n == 1) or (unit == "%") != (n == 1):
                raise UnreadableError(f"{name}:{line}: {text.strip()} where motion {n} was expected")
            motions.append((0.0 if n == 1 else float(value) * MM_S[unit], end == "FINE"))
        elif match := FRAME.fullmatch(text):
            frame[match[1]] = int(match[2])
        elif not IDLE.fullmatch(text):
            raise UnreadableError(f"{name}:{line}: {text.strip()!r} is not known here")
    positions, at = [], 0
    block = _text(folder, name).partition("/POS")[2].partition("/END")[0]
    while match := POSITION.match(block, at):
        index, uf, ut, *rest = match.groups()
        if int(index) != len(positions) + 1:
            raise UnreadableError(f"{name}: P[{index}] where P[{len(positions) + 1}] was expected")
        positions.append((int(uf), int(ut), tuple(rest[:3]), tuple(map(int, rest[3:6])), None, *map(float, rest[6:])))
        at = match.end()
    if block[at:].strip():
        raise UnreadableError(f"{name}: {block[at:].strip()[:40]!r} is no position")
    if len(positions) != len(motions) or not motions:
        raise UnreadableError(f"{name}: {len(motions)} motions, {len(positions)} positions")
    used = {p[:2] for p in positions}
    if used != {(frame.get("UFRAME_NUM"), frame.get("UTOOL_NUM"))}:
        raise UnreadableError(f"{name}: positions in other frames than the program sets")
    return motions, positions, used.pop()
