"""Meaning to text: canonical .LS, CR LF, three decimals (or up to six)."""

from collections.abc import Iterator
from io import BytesIO

from compgen.core.arrays import IntArray
from compgen.core.evaluation import BLOCK, map_blocks
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import to_wpr
from compgen.core.unique_rows import unique_rows
from compgen.fanuc.canonical.layout import SharedFrame, motions, positions
from compgen.fanuc.circular import check_circles
from compgen.program.digits import pose_units
from compgen.program.program import REMARK_LENGTH, Program
from compgen.program.speeds import speed_text
from compgen.robot.configuration import config_letters
from compgen.robot.inverse_kinematics import Posture

APPROACH_PERCENT = 10  # of full joint speed, for the way to the first position

_HEADER = """/PROG  {name}
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "{comment}";
PROG_SIZE\t= 0;
CREATE\t\t= DATE {date}  TIME 00:00:00;
MODIFIED\t= DATE {date}  TIME 00:00:00;
FILE_NAME\t= ;
VERSION\t\t= 0;
LINE_COUNT\t= {lines};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;
/MN
"""


def compose(program: Program) -> bytes:
    """The program's text.

    Raises:
        InputError: A remark, a speed or a position that the format cannot say.
    """
    text = BytesIO()
    for part in _parts(program):
        text.write(part)
    return text.getvalue()


def _parts(program: Program) -> Iterator[bytes | memoryview]:
    """The text, a block of rows at a time."""
    for remark in program.remarks:
        if len(remark) > REMARK_LENGTH or not remark.isascii():
            raise InputError(f"program {program.name}: remark '{remark}' is over {REMARK_LENGTH} ASCII characters")
    body = [f"  !{remark} ;" for remark in program.remarks]
    body += [f"  UFRAME_NUM={program.uframe} ;", f"  UTOOL_NUM={program.utool} ;"]
    if program.payload is not None:
        body.append(f"  PAYLOAD[{program.payload}] ;")
    body.append(f"J P[1] {APPROACH_PERCENT}% FINE{acc_text(program.acc)}    ;")
    count = len(body) + len(program.speed) - int(program.via.sum())
    yield head_and_body(program.name, program.comment, program.date, body, count)
    yield from _motions(program, len(body) + 1)
    yield b"/POS\r\n"
    frame = SharedFrame(program.uframe, program.utool, program.decimals)
    yield from position_blocks(frame, Pose(program.position, program.rotation), program.posture, program.turns)
    yield b"/END\r\n"


def head_and_body(name: str, comment: str, date: str, body: list[str], count: int) -> bytes:
    """The header of a program that has a count of lines, and the first of them, numbered."""
    header = _HEADER.format(name=name, comment=comment, date=date, lines=count)
    lines = "".join([f"{n:4d}:{text}\n" for n, text in enumerate(body, 1)])
    return f"{header}{lines}".replace("\n", "\r\n").encode("ascii")


def _motions(program: Program, line: int) -> Iterator[bytes | memoryview]:
    """The lines of all motions but the first."""
    if program.via.any():
        return iter([_lines_and_arcs(program, line)])
    rows, which = unique_rows(program.speed)
    speeds = [speed_text(v).encode("ascii") for v in program.speed[rows].tolist()]
    acc = acc_text(program.acc)
    ends = [f" {word}{acc}    ;\r\n".encode("ascii") for word in ("CNT100", "FINE")]
    tails = [speed + end for end in ends for speed in speeds]
    which = which + len(speeds) * program.fine[1:]

    def block(first: int, last: int) -> bytes | memoryview:
        return motions(line + first, first + 2, last + 2, tails, which[first:last])

    return map_blocks(len(which), block, BLOCK)


def _lines_and_arcs(program: Program, line: int) -> bytes:
    """The same where some motions are circular: the via on the numbered line, the end on a line of its own."""
    check_circles(program)
    speeds = {v: speed_text(v) for v in set(program.speed.tolist())}
    text, acc = [], acc_text(program.acc)
    rows = zip(
        program.via[1:].tolist(),
        program.via[:-1].tolist(),
        program.speed.tolist(),
        program.fine[1:].tolist(),
        strict=True,
    )
    for n, (via, arc, speed, fine) in enumerate(rows, 2):
        if via:
            text.append(f"{line:4d}:C P[{n}]    \r\n")
            continue
        head = "    :  " if arc else f"{line:4d}:L "
        text.append(f"{head}P[{n}] {speeds[speed]} {'FINE' if fine else 'CNT100'}{acc}    ;\r\n")
        line += 1
    return "".join(text).encode("ascii")


def position_blocks(frame: SharedFrame, pose: Pose, posture: Posture, turns: IntArray) -> Iterator[bytes | memoryview]:
    """The blocks of N positions, numbered from 1; their turns are (N, 3)."""
    rows, which = unique_rows(turns)
    configs = [f"{config_letters(posture)}, {a}, {b}, {c}".encode("ascii") for a, b, c in turns[rows].tolist()]
    angles = to_wpr(pose.rotation)

    def block(first: int, last: int) -> bytes | memoryview:
        units = pose_units(pose.position, angles, slice(first, last), frame.decimals)
        return positions(frame, first + 1, units, configs, which[first:last])

    return map_blocks(len(which), block, BLOCK)


def acc_text(percent: int | None) -> str:
    """The option of a motion that scales its accelerations; nothing where it is not said."""
    return "" if percent is None else f" ACC{percent}"
