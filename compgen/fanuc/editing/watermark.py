r"""A watermark in the numbers of a corrected program, so that it is never corrected twice.

Nothing but numbers may change in a program that is not ours, so the mark is in them: the last digits of W, P and R
of the first corrected positions are moved by at most one unit each, so that

    h(X, Y, Z) + 9 W + P + 3 R = 0   modulo 27          all in units of the last digit

Balanced ternary reaches each remainder in exactly one way, and a whole turn of W or R changes nothing. It costs one
unit of tilt (0.001 deg) at a few places and does not move the TCP. Joint-form positions, whose digits are chosen among
many neighbours anyway, carry a hash of all six angles that is zero modulo 3.

A position without the mark fits by chance once in 27, or 3. A program is marked when three in four of its first
positions fit, and the odds of that by chance are below one in a million. The mark survives a copy, another name, an
edited header and the controller; a touched-up position loses only its own part.
"""

from math import log
from zlib import crc32

import numpy as np

from compgen.core.arrays import BoolArray, IntArray

MARKED_POSITIONS = 24  # of a program
MIN_SHARE = 0.75  # of them that must fit
MAX_ODDS = 1e-6  # that they fit by chance


def remainder(units: IntArray) -> IntArray:
    """h(X, Y, Z) + 9 W + P + 3 R modulo 27 of positions in units of the last digit, (n, 6) to (n,)."""
    hashed = np.array([crc32(",".join(map(str, row)).encode("ascii")) for row in units[:, :3].tolist()], dtype=np.int64)
    return np.asarray((hashed + units[:, 3:] @ np.array([9, 1, 3])) % 27)


def nudges(units: IntArray) -> IntArray:
    """What to add to W, P, R of each position so that it carries the mark, (n, 6) to (n, 3), each -1, 0 or 1."""
    needed = (-remainder(units) + 13) % 27  # 13 = 111 in base three: digits 0 1 2 stand for -1 0 1
    return np.column_stack([needed // 9, needed % 3, needed // 3 % 3]) - 1


def joint_remainder(units: IntArray) -> IntArray:
    """Hash modulo 3, zero for a joint-form position with the mark, (n, 6) in units of the last digit to (n,)."""
    return np.array([crc32(",".join(map(str, row)).encode("ascii")) % 3 for row in units.tolist()], dtype=np.int64)


def is_detectable(joint_form: BoolArray) -> bool:
    """Whether so many positions can carry a mark that is no chance, ``joint_form`` of each, (n,)."""
    return bool(np.where(joint_form, log(3), log(27)).sum() >= -log(MAX_ODDS))


def is_marked(units: IntArray, joint_form: BoolArray) -> bool:
    """Whether positions, (n, 6) in units of the last digit, carry the mark; equal X, Y, Z count once."""
    _, first = np.unique(units[:, :3], axis=0, return_index=True)
    rows = np.sort(first)[:MARKED_POSITIONS]
    fits = np.where(joint_form[rows], joint_remainder(units[rows]), remainder(units[rows])) == 0
    return is_detectable(joint_form[rows][fits]) and bool(fits.mean() >= MIN_SHARE)
