"""A program's text by the second reader: motions L and the first J, positions, CALLs of pages; nothing else.

What it does not know it refuses, so that nothing in a program goes unread.
"""

import re
from dataclasses import dataclass

import naive_ls
import numpy as np

FRAME = re.compile(r" *(UFRAME_NUM|UTOOL_NUM)=(\d+) *")
CALL = re.compile(r" *CALL (\w+) *")
IDLE = re.compile(r" *(!.*|MESSAGE\[[^\]]*\]|PAUSE) *")
CONFIG = re.compile(r"([NF]) ([UD]) ([TB]), (-?\d+), (-?\d+), (-?\d+)")
STEPS_MM_S = (1.0, 10 / 60, 2.54 / 60)  # of a speed: whole mm/sec and cm/min, tenths of inch/min


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


@dataclass(frozen=True)
class Place:
    """A position as it is written."""

    letters: tuple[str, ...]
    turns: tuple[int, ...]
    numbers: tuple[float, ...]


def read(folder, name):
    """The program of a folder, its pages one after the other."""
    motions: list[naive_ls.Move] = []
    places: list[Place] = []
    frames: set[tuple[int, int]] = set()
    for page in _pages(folder, name):
        steps, positions, frame = _page(folder, page)
        if motions:  # a page begins where the one before it ended, standing
            if positions[0] != places[-1]:
                raise UnreadableError(f"{page}: begins elsewhere than the page before it ended")
            steps, positions = steps[1:], positions[1:]
        motions, places, frames = motions + steps, places + positions, frames | {frame}
    if len(frames) != 1:
        raise UnreadableError(f"{name}: pages in different frames")
    uframe, utool = frames.pop()
    return Program(
        np.array([p.numbers for p in places]),
        np.array([p.letters for p in places]),
        np.array([p.turns for p in places]),
        np.array([m.termination == "FINE" for m in motions]),
        np.array([naive_ls.mm_s(m.speed) for m in motions[1:]]),
        uframe,
        utool,
    )


def _text(folder, name):
    try:
        return (folder / name).read_bytes()
    except OSError as problem:
        raise UnreadableError(f"{name}: {problem}") from None


def _statements(data, name):
    """Each statement between /MN and /POS, all of whose lines are statements."""
    parts = naive_ls.sections(naive_ls.lines_of(data.decode("latin-1")))
    if not parts.keys() >= {"MN", "POS", "END"}:
        raise UnreadableError(f"{name}: no /MN, /POS and /END")
    for line in parts["MN"]:
        if not re.fullmatch(r" *\d+:.*;", line):
            raise UnreadableError(f"{name}: {line!r} is no statement")
    return naive_ls.statements(parts["MN"])


def _pages(folder, name):
    """The file itself, or the programs that it calls."""
    called = [match[1] for text in _statements(_text(folder, name), name) if (match := CALL.fullmatch(text))]
    return [f"{program}.LS" for program in called] or [name]


def _page(folder, name):
    """Motions and positions in the order in which they are driven, and the frames that are set."""
    data = _text(folder, name)
    statements = _statements(data, name)
    try:
        positions, motions = naive_ls.read(data)
    except ValueError as problem:
        raise UnreadableError(f"{name}: {problem}") from None
    frame, others = {}, [text for text in statements if not re.match(r" *[JLCAS] ", text)]
    for text in others:
        if match := FRAME.fullmatch(text):
            frame[match[1]] = int(match[2])
        elif not IDLE.fullmatch(text):
            raise UnreadableError(f"{name}: {text.strip()!r} is not known here")
    if len(statements) != len(motions) + len(others) or list(positions) != list(range(1, len(motions) + 1)):
        raise UnreadableError(f"{name}: {len(motions)} motions, positions {list(positions)[:3]} ...")
    for n, m in enumerate(motions, 1):
        unit = m.speed.lstrip("0123456789.")
        known = unit == "%" if n == 1 else unit in ("mm/sec", "cm/min", "inch/min")
        if (m.letter, m.targets, m.rest, m.disabled) != ("J" if n == 1 else "L", (f"P[{n}]",), "", False) or not (
            known and m.termination in ("FINE", "CNT100")
        ):
            raise UnreadableError(f"{name}: {m} where motion {n} was expected")
    used = {(p.groups[1].uf, p.groups[1].ut) for p in positions.values() if 1 in p.groups}
    if not motions or used != {(frame.get("UFRAME_NUM"), frame.get("UTOOL_NUM"))}:
        raise UnreadableError(f"{name}: positions in other frames than the program sets")
    return motions, [_place(name, p) for p in positions.values()], used.pop()


def _place(name, position):
    """A position of the arm's group alone, by X Y Z W P R and CONFIG."""
    group = position.groups.get(1)
    match = group and group.config and CONFIG.fullmatch(group.config)
    if not match or len(position.groups) > 1 or list(group.axes) != list("XYZWPR") or None in group.axes.values():
        raise UnreadableError(f"{name}: {position} is no position by X Y Z W P R and CONFIG")
    return Place(match.groups()[:3], tuple(map(int, match.groups()[3:])), tuple(group.axes.values()))
