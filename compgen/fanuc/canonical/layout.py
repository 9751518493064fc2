"""The rows of a canonical program: one line of text for each motion, one block for each position.

A text is a function of a few columns: one function writes it and, from what was read, proves it.

Which arcs a program can say: a circular motion is one statement through three positions, at one speed.

    9:C P[4]
     :  P[5] 100mm/sec CNT100    ;

drives from where the tool is through the via P[4] to P[5]. A controller stops at an arc of more than half a turn
("circle angle too large") and at three positions that determine no circle.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arcs import arcs_through
from compgen.core.arrays import BoolArray, IntArray, norm
from compgen.core.decimals import WHOLE, Column, consecutive, digit_counts, fixed_columns, join_columns, text_column
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.program.program import Program

PAD = 4  # characters of a line number, at least
_BEFORE = (b"X = ", b"  mm,\tY = ", b"  mm,\tZ = ", b"  mm,\r\n\tW = ", b" deg,\tP = ", b" deg,\tR = ")
_OPEN, _LINEAR, _TO = b"P[", b":L P[", b"] "
_CLOSE, _DONE = b"',\r\n\t", b" deg\r\n};\r\n"
MARK = b"}"  # stands once in a position, this far before its end:
MARK_BACK = len(_DONE) - _DONE.index(MARK)
LARGEST = np.pi + 1e-9  # rad; "max 180 degrees between the three points" (users of the controller, none of its makers)


@dataclass(frozen=True, slots=True)
class Frame:
    """Frame, tool and decimals that all positions of a program share."""

    uframe: int
    utool: int
    decimals: int

    @property
    def head(self) -> bytes:
        """The text between a position's number and its CONFIG."""
        return f"]{{\r\n   GP1:\r\n\tUF : {self.uframe}, UT : {self.utool},\t\tCONFIG : '".encode("ascii")

    @property
    def places(self) -> list[int]:
        """Where the six numbers begin behind CONFIG."""
        width = WHOLE + 1 + self.decimals
        ends = np.cumsum([len(text) + width for text in _BEFORE])
        return [len(_CLOSE) + int(end) - width for end in ends]

    @property
    def tail(self) -> int:
        """Length of a position behind its CONFIG."""
        return self.places[-1] + WHOLE + 1 + self.decimals + len(_DONE)


def motions(line: int, first: int, last: int, tails: list[bytes], which: IntArray) -> bytes | memoryview:
    """The lines from ``line`` on of linear motions to positions first to before last, each with its tail."""
    rows = last - first
    return join_columns(
        rows, [consecutive(line, line + rows, PAD), _LINEAR, consecutive(first, last), _TO, text_column(tails, which)]
    )


def motion_tail(line: int, first: int, last: int) -> IntArray:
    """Where the tail begins in each of these lines, (last - first,)."""
    number = np.maximum(digit_counts(line, line + last - first), PAD)
    return number + digit_counts(first, last) + len(_LINEAR + _TO)


def positions(frame: Frame, first: int, units: IntArray, configs: list[bytes], which: IntArray) -> bytes | memoryview:
    """The blocks of positions from number ``first`` on, from units of the last digit, (6, N), and their CONFIGs."""
    rows = units.shape[1]
    parts: list[bytes | Column] = [
        _OPEN,
        consecutive(first, first + rows),
        frame.head,
        text_column(configs, which),
        _CLOSE,
    ]
    for before, column in zip(_BEFORE, fixed_columns(units, frame.decimals), strict=True):
        parts += [before, column]
    return join_columns(rows, [*parts, _DONE])


def position_config(frame: Frame, first: int, last: int) -> IntArray:
    """Where CONFIG begins in each of these blocks, (last - first,)."""
    return digit_counts(first, last) + len(_OPEN + frame.head)


def check_circles(program: Program, place: Callable[[int], str] = lambda n: "") -> None:
    """Refuse arcs that a controller could not drive.

    Args:
        program: Any.
        place: The words for where the statement with the via P[n] stands, "line 12: " for instance.

    Raises:
        InputError: A via without start or end, at a stop, beside another via, doubled or in line with its neighbours;
            an arc of over 180 deg, of two speeds or of two turns of CONFIG. Names the via.
    """
    via = np.flatnonzero(program.via)
    if not len(via):
        return
    N = len(program.position)

    def refuse(bad: BoolArray, words: Callable[[int], str]) -> None:
        if bad.any():
            k = int(np.argmax(bad))
            n = int(via[k]) + 1
            raise InputError(f"program: {place(n)}P[{n}] {words(k)}")

    refuse((via == 0) | (via == N - 1), lambda k: "is the via of an arc without start or end")
    refuse(program.via[via + 1], lambda k: "is a via, and so is the next position: an arc has one")
    refuse(program.fine[via], lambda k: "is the via of an arc: the robot cannot stop there")
    refuse(program.speed[via] != program.speed[via - 1], lambda k: "is the via of an arc that has two speeds")
    a, b, c = (program.position[via + k] for k in (-1, 0, 1))
    least = MM / 10**program.decimals
    chord = norm(c - a)
    refuse((norm(b - a) < least) | (norm(c - b) < least), lambda k: "is the via of an arc and its start or end as well")
    refuse(chord < least, lambda k: "is the via of an arc that ends where it began: drive a full circle in two arcs")
    height = norm(np.cross(b - a, c - a)) / np.maximum(chord, least)
    refuse(
        height < least,
        lambda k: (
            f"is the via of an arc, {height[k] / MM:.4f} mm beside the line from its start to its end: no circle; use L"
        ),
    )
    swept = arcs_through(a, b, c).angle[:, 1]
    refuse(swept > LARGEST, lambda k: f"is the via of an arc of {swept[k] / DEG:.1f} deg, more than 180; part it")
    turns = program.turns
    refuse(
        (turns[via] != turns[via - 1]).any(axis=1) | (turns[via] != turns[via + 1]).any(axis=1),
        lambda k: "is the via of an arc whose positions differ in CONFIG's turns; use L there",
    )
