"""What is put into a program and keeps its meaning: points in long straight lines, own numbers for shared positions, a
remark."""

import re
from collections.abc import Callable, Sequence

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.watermark import CORRECTED
from compgen.fanuc.editing.numbers import Edits, NewPoses, number_edits
from compgen.fanuc.listing.lines import line_end
from compgen.fanuc.listing.listing import LsProgram, edited
from compgen.fanuc.motion_options import TIMED_BEFORE_END, options_on_parts
from compgen.fanuc.vocabulary import SPEED_OF_WHOLE_MOTION
from compgen.program.driven import DrivenProgram
from compgen.program.ways import commanded_joints, interpolate_poses
from compgen.robot.robot import Robot


def allowed_pieces(program: LsProgram, poses: Poses, drive: DrivenProgram, pieces: IntArray) -> IntArray:
    """Into how many pieces each straight way may be cut, (S,): 1 where its statement does not allow it.

    Only where nothing between its ends may move the robot or jump, and where each option of its statement is carried or
    stays with its end; not where its speed is the time of the whole line, not where another group moves along; and
    the last piece keeps the length that its DB, TB or TA reaches back.
    """
    m, p = program.motions, program.positions
    definitions = np.bincount(p.number, minlength=int(p.number.max(initial=0)) + 1)
    flow = np.array(drive.flow, dtype=np.int64)
    allowed = np.ones(len(pieces), dtype=np.int64)
    for s in np.flatnonzero(pieces > 1).tolist():
        i, j = int(drive.motion[s]), int(drive.motion[s - 1])
        is_duration = SPEED_OF_WHOLE_MOTION.search(m.speed[i])
        jump_target = bool(((flow > m.line[j]) & (flow < m.line[i])).any()) or int(drive.origin[s]) != s - 1
        single_group = definitions[poses.number[drive.pose[s]]] == 1
        if jump_target or not single_group or is_duration or poses.joint_form[drive.pose[s]]:
            continue
        if options_on_parts(m.options[i]) is None:
            continue
        reach = 0.0
        for distance, time in TIMED_BEFORE_END.findall(m.options[i]):
            speed = drive.length[s] / max(float(drive.duration[s]), 1e-9)
            reach = max(reach, float(distance) * MM if distance else float(time) * speed)
        limit = int(drive.length[s] / reach) if reach > 0 else int(pieces[s])
        allowed[s] = max(1, min(int(pieces[s]), limit))
    return allowed


def insert_points(
    program: LsProgram,
    poses: Poses,
    drive: DrivenProgram,
    pieces: IntArray,
    robot: Robot,
    read: Callable[[LsProgram], Poses],
) -> LsProgram:
    """The program with each straight way cut into equal pieces; each statement keeps its target and all its options.

    New points are CNT100 at the speed of their line; new lines carry no number, which a controller gives them. ``read``
    gives the poses of a program.
    """
    ways = np.flatnonzero(pieces > 1)
    if not len(ways):
        return program
    station = np.repeat(ways, pieces[ways] - 1)
    part = np.concatenate([np.arange(1, k) for k in pieces[ways].tolist()])
    fraction = part / pieces[station]
    tcp = interpolate_poses(drive, station, fraction)
    first = int(program.positions.number.max()) + 1
    numbers = np.arange(first, first + len(station))
    eol = line_end(program.data)
    edits: Edits = {}
    m = program.motions
    for s in ways.tolist():
        i = int(drive.motion[s])
        start = int(m.span[i, 0])
        line_start = max(program.data.rfind(b"\n", 0, start), program.data.rfind(b"\r", 0, start)) + 1
        prefix = re.sub(rb"\d", b" ", program.source[line_start:start])
        carried = options_on_parts(m.options[i])
        tail = f"{m.speed[i]} CNT100{f' {carried}' if carried else ''}    ;".encode("latin-1")
        lines = [prefix + b"L P[%d] " % n + program.own_words(tail) + eol for n in numbers[station == s].tolist()]
        edits[line_start, line_start] = b"".join(lines)
    copies = [(int(poses.row[drive.pose[s]]), int(n)) for s, n in zip(station, numbers, strict=True)]
    _append_positions(program, copies, edits, eol)
    extended = edited(program, edits)
    new_poses = read(extended)
    rows = np.flatnonzero(new_poses.number >= first)
    theta = commanded_joints(robot, drive, station, fraction, tcp)
    nudge = np.zeros((len(rows), 3), dtype=np.int64)
    new = NewPoses(rows=rows, tcp=tcp, theta=theta, nudge=nudge, marked=nudge[:, 0] > 0)
    return edited(extended, number_edits(extended, new_poses, robot, new))


def split_positions(
    program: LsProgram, poses: Poses, drive: DrivenProgram, assigned: Sequence[tuple[int, int]]
) -> LsProgram:
    """The program with some stations on positions of their own, ``assigned`` as pairs of station and new number."""
    edits: Edits = {}
    copied: dict[int, int] = {}  # new number to the row that it copies
    for s, number in assigned:
        copied.setdefault(number, int(poses.row[drive.pose[s]]))
        edits[target_number_span(program, drive, s)] = b"%d" % number
    _append_positions(program, [(row, number) for number, row in copied.items()], edits, line_end(program.data))
    return edited(program, edits)


def target_number_span(program: LsProgram, drive: DrivenProgram, station: int) -> tuple[int, int]:
    """Where the number of a station's P[n] stands in the text.

    Raises:
        InputError: It is not there; names the line.
    """
    m = program.motions
    i = int(drive.motion[station])
    start, end = m.span[i].tolist()
    # the via point comes first; the end of a C is its second target
    order = 0 if drive.via[station] or len(m.position[i]) == 1 else 1
    targets = list(re.finditer(rb"(?<![A-Za-z])P\[\s*(\d+)", program.data[start:end], re.IGNORECASE))
    if len(targets) <= order:
        raise InputError(f"program {program.name}: line {m.line[i]}: its target cannot be changed; part it by hand")
    return start + targets[order].start(1), start + targets[order].end(1)


def _append_positions(program: LsProgram, copies: Sequence[tuple[int, int]], edits: Edits, eol: bytes) -> None:
    """Copies of positions under new numbers, after the last one."""
    p = program.positions
    texts = []
    for row, number in copies:
        start, end = p.block[row].tolist()
        texts.append(re.sub(rb"P\[[ \t]*\d+", b"P[%d" % number, program.source[start:end], count=1))
    last = int(p.block[:, 1].max())
    edits[last, last] = b"".join(eol + text for text in texts)


def marking_remark(version: str) -> str:
    """What a remark says that stands for the mark."""
    return f"compgen {version}{CORRECTED}"


def insert_remark(program: LsProgram, words: str) -> LsProgram:
    """The program with a remark as its first line; as all new lines it carries no number."""
    at = int(program.place[0])
    number = re.sub(rb"\d", b" ", program.data[at : program.data.index(b":", at)])
    remark = f":  !{words} ;".encode("ascii")
    return edited(program, {(at, at): number + remark + line_end(program.data)})


def says_override(program: LsProgram) -> bool:
    """Whether a remark or a statement of a program says an override already."""
    at = int(program.place[0]) if len(program.place) else len(program.data)
    return b"OVERRIDE" in program.data[at:].upper()
