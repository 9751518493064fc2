r"""A watermark in the numbers of a corrected program, so that it is never corrected twice.

Nothing but numbers may change in a program that is not ours, so the mark is in them: the last digits of W, P and R
of the first corrected places are moved by at most one unit each, so that

    h(X, Y, Z) + 9 W + P + 3 R = 0   modulo 27          all in units of the last digit

Balanced ternary reaches each remainder in exactly one way, and a whole turn of W or R changes nothing. It costs one
unit of tilt (0.001 deg) at a few places and does not move the TCP. Joint-form positions, whose digits are chosen among
many neighbours anyway, carry a hash of all six angles that is zero modulo 3.

A place without the mark fits by chance once in 27, or 3. A program is marked when so many of its first places fit that
chance is out of the question. The mark survives a copy, another name, an edited header and the controller; a
touched-up position loses only its own part. ``mark_of`` alone decides: what reads a program asks it, and what has
written the mark asks it whether the mark can be read.
"""

from enum import StrEnum
from zlib import crc32

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.fanuc.analysis.correctable import LONGEST_NUMBER, longest_numbers, read_scope
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.positions import decimal_places, position_rows
from compgen.program.driven import DrivenProgram
from compgen.program.frames import default_frames
from compgen.robot.robot import Robot

MARKED_PLACES = 24  # of a program
MIN_SHARE = 0.75  # of them that fit, with MIN_WEIGHT
MIN_WEIGHT = 13  # 3 for each Cartesian place that fits and 1 for each in joint form: 3^-13 is below one in a million
MAX_ODDS = 1e-7  # that as much weight fits by chance, where the share is smaller
CORRECTED = " corrected"  # how a remark ends that stands for the mark


class Mark(StrEnum):
    """Where a program says that compgen has corrected it."""

    REMARK = "remark"
    DIGITS = "digits"
    RECORD = "record"  # the provenance file beside it
    NONE = "none"


def remark_of(program: LsProgram) -> str | None:
    """The remark that says that compgen wrote a corrected program, or None."""
    remarks = [r for r in program.remarks if r.startswith("compgen ")]
    if any(r.startswith("planned, not corrected") for r in program.remarks):
        remarks = [r for r in remarks if r.endswith(CORRECTED)]
    return remarks[0] if remarks else None


def planned_source(program: LsProgram) -> str:
    """How the planned program is had of a marked one: ``correct`` keeps it, ``generate`` does not."""
    remark = remark_of(program)
    if remark is None or remark.endswith(CORRECTED):
        return "cgen correct --restore gives it back"
    return "cgen predict PATH --program writes it"


def mark_of(program: LsProgram, poses: Poses, traversal: DrivenProgram, free: BoolArray) -> Mark:
    """Where a program carries the mark.

    Args:
        program: As read.
        poses: Those of its positions.
        traversal: Its stations.
        free: Stations that may be corrected, (S,).
    """
    if remark_of(program) is not None:
        return Mark.REMARK
    # what may be corrected depends on frames, robot and version; so all that is driven to counts as well
    for rows in (listed_rows(poses, traversal, free), driven_rows(program)):
        if is_marked(*last_digit_units(program, legible_rows(program, rows))):
            return Mark.DIGITS
    return Mark.NONE


def listed_rows(poses: Poses, traversal: DrivenProgram, free: BoolArray) -> IntArray:
    """Rows in the table of positions that free stations drive to, in the order listed, each once."""
    stations = np.flatnonzero(free)
    stations = stations[np.argsort(traversal.motion[stations], kind="stable")]
    return _first_of_each(poses.row[traversal.pose[stations]] if len(poses.row) else stations)


def driven_rows(program: LsProgram) -> IntArray:
    """Rows in the table of positions, group 1, that active motions drive to, in the order listed, each once."""
    first = program.positions.first_group
    active = np.flatnonzero(~program.motions.disabled).tolist()
    numbers = np.array([n for i in active for n in program.motions.position[i]], dtype=np.int64)
    row = position_rows(numbers, program.positions.number[first])
    return _first_of_each(first[row[row >= 0]])


def _first_of_each(rows: IntArray) -> IntArray:
    _, first = np.unique(rows, return_index=True)
    return np.asarray(rows[np.sort(first)])


def legible_rows(program: LsProgram, rows: IntArray) -> IntArray:
    """Those of some positions that have all six numbers, none with more digits than a controller writes."""
    p = program.positions
    complete = np.isfinite(p.value[p.six_of(rows)]).all(axis=1)
    return np.asarray(rows[complete & (longest_numbers(program, rows) <= LONGEST_NUMBER)])


def last_digit_units(program: LsProgram, rows: IntArray) -> tuple[IntArray, BoolArray]:
    """Numbers of legible positions in units of their last digit (n, 6), and which are in joint form (n,)."""
    p = program.positions
    units = p.value[p.six_of(rows)] * 10.0 ** decimals_of(program, rows)
    return np.rint(units).astype(np.int64), p.joint_form[rows]


def decimals_of(program: LsProgram, rows: IntArray) -> IntArray:
    """Decimals of each of the six numbers of positions, rows of the program's table, (n, 6)."""
    return decimal_places(program.data, program.positions.span[program.positions.six_of(rows)])


def first_places(units: IntArray, joint_form: BoolArray) -> tuple[IntArray, IntArray]:
    """The first position at each place, those of the first places of all (m,), and the place of each position (n,).

    A place is X, Y and Z, or six joint angles: positions at one place fit together, and count once.
    """
    keys = np.column_stack([np.where(joint_form[:, None], units, np.pad(units[:, :3], ((0, 0), (0, 3)))), joint_form])
    _, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return np.sort(first)[:MARKED_PLACES], first[place.ravel()]


def is_marked(units: IntArray, joint_form: BoolArray) -> bool:
    """Whether positions, (n, 6) in units of the last digit, carry the mark."""
    by_three = np.zeros_like(joint_form)  # version 0.1.0 took three joint angles for a place as well
    return any(
        _fits(units[rows], joint_form[rows])
        for rows, _ in (first_places(units, joint_form), first_places(units, by_three))
    )


def _fits(units: IntArray, joint_form: BoolArray) -> bool:
    """Whether positions at different places fit more than chance can explain."""
    fits = np.where(joint_form, joint_remainder(units), remainder(units)) == 0
    weight = int(np.where(joint_form, 1, 3)[fits].sum())
    if weight < MIN_WEIGHT:
        return False
    return bool(fits.mean() >= MIN_SHARE) or chance_of(weight, joint_form) <= MAX_ODDS


def chance_of(weight: int, joint_form: BoolArray) -> float:
    """Odds that places without the mark fit with so much weight, ``joint_form`` of each, (n,)."""
    odds = np.ones(1)
    for one in joint_form.tolist():
        odds = np.convolve(odds, [2 / 3, 1 / 3] if one else [26 / 27, 0, 0, 1 / 27])
    return float(odds[weight:].sum())


def remainder(units: IntArray) -> IntArray:
    """h(X, Y, Z) + 9 W + P + 3 R modulo 27 of positions in units of the last digit, (n, 6) to (n,)."""
    hashed = np.array([crc32(",".join(map(str, row)).encode("ascii")) for row in units[:, :3].tolist()], dtype=np.int64)
    return np.asarray((hashed + units[:, 3:] @ np.array([9, 1, 3])) % 27)


def joint_remainder(units: IntArray) -> IntArray:
    """Hash modulo 3, zero for a joint-form position with the mark, (n, 6) in units of the last digit to (n,)."""
    return np.array([crc32(",".join(map(str, row)).encode("ascii")) % 3 for row in units.tolist()], dtype=np.int64)


def nudges(units: IntArray) -> IntArray:
    """What to add to W, P, R of each position so that it carries the mark, (n, 6) to (n, 3), each -1, 0 or 1."""
    needed = (-remainder(units) + 13) % 27  # 13 = 111 in base three: digits 0 1 2 stand for -1 0 1
    return np.column_stack([needed // 9, needed % 3, needed // 3 % 3]) - 1


def carries_mark(program: LsProgram, robot: Robot) -> bool:
    """Whether a remark or the digits of a program say that compgen has written or corrected it."""
    poses = ProgramContext(default_frames()).poses(program, robot)
    traversal = read_traversal(program, poses, robot)
    return mark_of(program, poses, traversal, read_scope(program, poses, traversal, robot).free) is not Mark.NONE
