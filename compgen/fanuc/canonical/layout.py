"""The rows of a canonical program: one line of text for each motion, one block for each position.

A text is a function of a few columns: one function writes it and, from what was read, proves it.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.decimals import WHOLE, Column, consecutive, digit_counts, fixed_columns, join_columns, text_column

PAD = 4  # characters of a line number, at least
_BEFORE = (b"X = ", b"  mm,\tY = ", b"  mm,\tZ = ", b"  mm,\r\n\tW = ", b" deg,\tP = ", b" deg,\tR = ")
_OPEN, _LINEAR, _TO = b"P[", b":L P[", b"] "
_CLOSE, _DONE = b"',\r\n\t", b" deg\r\n};\r\n"
MARK = b"}"  # stands once in a position, this far before its end:
MARK_BACK = len(_DONE) - _DONE.index(MARK)


@dataclass(frozen=True, slots=True)
class SharedFrame:
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


def positions(
    frame: SharedFrame, first: int, units: IntArray, configs: list[bytes], which: IntArray
) -> bytes | memoryview:
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


def position_config(frame: SharedFrame, first: int, last: int) -> IntArray:
    """Where CONFIG begins in each of these blocks, (last - first,)."""
    return digit_counts(first, last) + len(_OPEN + frame.head)
