"""Statements of a program as units, and between which of them it may be split into pages.

A program may be split after a motion that stops (FINE), where nothing that belongs together lies on both sides: not
inside IF or FOR, not between a label and a jump to it, not in an arc of A or S motions, not between the two ends of a
bracket (LOCK PREG, Arc Start, Weave, Track ...), not after an END, and not while something is in force that a new
program could not repeat. A wrapped statement and the listing of point logic are one unit.
"""

import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from compgen.core.arrays import BoolArray, IntArray, owns
from compgen.fanuc.listing.lines import letters
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import POINT_LOGIC, POINT_LOGIC_END, TIME_AFTER_STOP
from compgen.fanuc.vocabulary import (
    ARC_LETTERS,
    BRACKETS,
    END,
    LABEL,
    POSITION,
    POSITION_BEFORE_EQUALS,
    REMARKS,
    without_words,
)

_LINE_END = re.compile(rb"\r\n|\n|\r")


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(
    span=("S", 2),
    line=("S",),
    motion=("S",),
    stop=("S",),
    locked=("S",),
    unconditional=("S",),
    moves=("A",),
    move_unit=("A",),
    mention_unit=("U",),
    mention=("U",),
)
class Flow:
    """S units of /MN, in order."""

    span: IntArray  # (S, 2) bytes, from the begin of a unit's first line to the begin of the next unit's
    line: IntArray  # (S,) physical line at which it begins, from 1
    motion: IntArray  # (S,) the motion that it is, NO_NUMBER for none
    moves: IntArray  # (A,) active motions, those inside point logic among them
    move_unit: IntArray  # (A,) the unit of each
    stop: BoolArray  # (S,) it is a motion that stops
    locked: BoolArray  # (S,) what belongs together lies on both sides of its end
    unconditional: BoolArray  # (S,) it runs once, whatever happens at run time
    text: dict[int, str]  # of units that are no motion, and no remark
    options: dict[int, str]  # of motions that have any, with the listing of point logic
    mention_unit: IntArray  # (U,) a unit that names a position
    mention: IntArray  # (U,) and the position's number, NO_NUMBER for one that is found at run time

    @property
    def may_split_after(self) -> BoolArray:
        """Whether the program may be split after each unit; never behind the last motion."""
        moves = np.flatnonzero(self.motion != NO_NUMBER)
        last = moves[-1] if len(moves) else 0
        return np.asarray(self.stop & ~self.locked & (np.arange(len(self.stop)) < last))


def read_flow(program: LsProgram) -> Flow:
    """The units of a program and what ties them together."""
    begin, end, line = _units(program)
    S, m = len(begin), program.motions
    owner = np.searchsorted(line, m.line, side="right") - 1
    head = np.flatnonzero(line[owner] == m.line) if S else np.zeros(0, dtype=np.int64)
    motion = np.full(S, NO_NUMBER, dtype=np.int64)
    active = head[~m.disabled[head]]
    motion[owner[active]] = active
    text = dict(_texts(program.data, begin, end, np.flatnonzero(motion == NO_NUMBER)))
    moves = np.flatnonzero(motion != NO_NUMBER)
    options = {int(s): m.options[motion[s]] for s in moves[_marks(m.options, bool)[motion[moves]]]}
    for s in [s for s, option in options.items() if POINT_LOGIC.search(option)]:
        options[s] = " ".join(program.text((begin[s], end[s])).split())  # with the listing that follows
    texts = dict(sorted({**text, **options}.items()))
    fine = {text for text in set(m.termination) if text.upper() == "FINE"}
    stop = np.zeros(S, dtype=bool)
    stop[moves] = _marks(m.termination, fine.__contains__)[motion[moves]]
    for s, option in options.items():
        if TIME_AFTER_STOP.search(option):
            stop[s] = False  # its logic runs after the stop
    mention_unit, mention = _mentions(program, motion, owner, texts)
    branches = [*_brackets(texts, S), *_labels(texts)]
    depth = _depth(branches, S)
    ties = [*_ends(texts, S), *_arcs(program, motion), *_written(texts, mention_unit, mention)]
    return Flow(
        span=np.column_stack([begin, end]),
        line=line,
        motion=motion,
        moves=np.flatnonzero(~m.disabled),
        move_unit=owner[~m.disabled],
        stop=stop,
        locked=(depth + _depth(ties, S)) > 0,
        unconditional=np.asarray(_depth([(a, min(b + 1, S)) for a, b in branches], S) == 0),
        text=text,
        options=options,
        mention_unit=mention_unit,
        mention=mention,
    )


def _units(program: LsProgram) -> tuple[IntArray, IntArray, IntArray]:
    """First byte, end and line of each unit."""
    data, line, begin = program.data, program.statements, program.place
    if not len(line):
        return begin, begin, line
    first, stop = int(begin[0]), _section_end(data, int(begin[-1]))
    listed = [i for i, option in enumerate(program.motions.options) if option and POINT_LOGIC.search(option)]
    if listed:
        rules = [r.start() for r in POINT_LOGIC_END.finditer(data, first, stop)]
        keep = np.ones(len(line), dtype=bool)
        for i in listed:
            at = int(np.searchsorted(line, program.motions.line[i]))
            rule = next((r for r in rules if r > begin[at]), stop)  # without its rule it runs to the end
            keep[at + 1 :] &= begin[at + 1 :] > rule
        begin, line = begin[keep], line[keep]
    return begin, np.append(begin[1:], stop), line


def _section_end(data: bytes, at: int) -> int:
    """Where the section ends that a place lies in."""
    match = re.compile(rb"(?<=[\r\n])/(?:POS|END)\b", re.IGNORECASE).search(data, at)
    return match.start() if match else len(data)


def _texts(data: bytes, begin: IntArray, end: IntArray, which: IntArray) -> Iterator[tuple[int, str]]:
    """What some units say: numbers, names, line ends and what stands after the semicolon left out."""
    for s in which.tolist():
        lines = _LINE_END.split(data[begin[s] : end[s]])
        text = " ".join(letters(line.partition(b":")[2].decode("latin-1")) for line in lines if b":" in line)
        text = " ".join(text.partition(";")[0].split())
        if text and not text.startswith(REMARKS):
            yield s, without_words(text)


def _mentions(
    program: LsProgram, motion: IntArray, owner: IntArray, texts: dict[int, str]
) -> tuple[IntArray, IntArray]:
    """Which unit names which position."""
    m = program.motions
    many = np.fromiter(map(len, m.position), dtype=np.int64, count=len(m.position))
    number = np.fromiter(chain.from_iterable(m.position), dtype=np.int64, count=int(many.sum()))
    keep = np.repeat(~m.disabled, many)
    if len(elsewhere := np.flatnonzero(number < 0)):  # PR[n], or P[R[n]], one of the file's that is found at run time
        target = list(chain.from_iterable(m.target))
        keep[elsewhere] &= np.array([target[i][:2] == "P[" for i in elsewhere.tolist()])
    units, numbers = np.repeat(owner, many)[keep], number[keep]
    named = [(s, match.group(1)) for s, text in texts.items() for match in POSITION.finditer(text)]
    if named:
        units = np.append(units, [s for s, _ in named])
        numbers = np.append(numbers, [int(n) if n else NO_NUMBER for _, n in named])
    order = np.argsort(units, kind="stable")
    return units[order], numbers[order]


def _marks(texts: Collection[str], test: Callable[[str], bool]) -> BoolArray:
    """A test of each text."""
    return np.fromiter(map(test, texts), dtype=bool, count=len(texts))


def _brackets(texts: dict[int, str], count: int) -> Iterator[tuple[int, int]]:
    """From each opening to its closing; what is never closed reaches to the end."""
    for bracket in BRACKETS:
        stack: list[int] = []
        for s, text in texts.items():
            if bracket.closes.search(text):
                if stack:
                    yield stack.pop(), s
            elif bracket.opens.search(text):
                stack.append(s)
        yield from ((s, count) for s in stack)


def _labels(texts: dict[int, str]) -> Iterator[tuple[int, int]]:
    """From the first to the last mention of each label; a label found at run time may be any."""
    where: dict[str, list[int]] = {}
    for s, text in texts.items():
        for match in LABEL.finditer(text):
            where.setdefault(match.group(1), []).append(s)
    if "" in where:
        everywhere = [s for units in where.values() for s in units]
        yield min(everywhere), max(everywhere)
    yield from ((units[0], units[-1]) for units in where.values())


def _ends(texts: dict[int, str], count: int) -> Iterator[tuple[int, int]]:
    """After an END nothing may be called any more: all of them stand in the last part."""
    yield from ((s, count) for s, text in texts.items() if END.search(text))


def _arcs(program: LsProgram, motion: IntArray) -> Iterator[tuple[int, int]]:
    """Motions before an A or S: its curve needs them."""
    if not set(ARC_LETTERS) & set(program.motions.letter):
        return
    moves = np.flatnonzero(motion != NO_NUMBER)
    letters = [program.motions.letter[i] for i in motion[moves].tolist()]
    yield from (
        (int(a), int(b))
        for a, b, letter in zip(moves[:-1], moves[1:], letters[1:], strict=True)
        if letter in ARC_LETTERS
    )


def _written(texts: dict[int, str], unit: IntArray, mention: IntArray) -> Iterator[tuple[int, int]]:
    """All mentions of a position that is written at run time: another program has its own, to start from too."""
    for text in texts.values():
        if match := POSITION_BEFORE_EQUALS.search(text):
            number = int(match.group(1)) if match.group(1) else NO_NUMBER
            same = unit if number == NO_NUMBER else unit[(mention == number) | (mention == NO_NUMBER)]
            yield int(same.min()), int(same.max()) + 1


def _depth(intervals: list[tuple[int, int]], count: int) -> IntArray:
    """How many intervals reach over the end of each unit."""
    steps = np.zeros(count + 1, dtype=np.int64)
    for a, b in intervals:
        steps[a] += 1
        steps[b] -= 1
    return np.asarray(np.cumsum(steps)[:-1])
