"""Meaning to text: canonical .LS, CR LF, three decimals (or up to six)."""

from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO

import numpy as np

from compgen.core.arrays import Array, IntArray, frozen
from compgen.core.decimals import DECIMALS, fits_fixed
from compgen.core.evaluation import map_blocks, parallel_for
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import fill_rotation_matrices, to_wpr
from compgen.core.units import DEG, INCH, MINUTE, MM
from compgen.fanuc.canonical.layout import BLOCK, Frame, motions, positions
from compgen.fanuc.circular import check_circles
from compgen.fanuc.listing.templates import unique_rows
from compgen.program.configuration import config_letters
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import Posture

FEED_TOLERANCE = 0.005  # a unit is fine enough when it meets the speed this nearly
EXACT = 1e-6  # so near, a unit says the speed itself
APPROACH_PERCENT = 10  # of full joint speed, for the way to the first position
REMARK_LENGTH = 32

#: unit, m/s of one step, decimals, highest value
UNITS = (("mm/sec", MM, 0, 2000), ("cm/min", 10 * MM / MINUTE, 0, 12000), ("inch/min", 0.1 * INCH / MINUTE, 1, 47244))

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
    frame = Frame(program.uframe, program.utool, program.decimals)
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


def position_blocks(frame: Frame, pose: Pose, posture: Posture, turns: IntArray) -> Iterator[bytes | memoryview]:
    """The blocks of N positions, numbered from 1; their turns are (N, 3)."""
    rows, which = unique_rows(turns)
    configs = [f"{config_letters(posture)}, {a}, {b}, {c}".encode("ascii") for a, b, c in turns[rows].tolist()]
    angles = to_wpr(pose.rotation)

    def block(first: int, last: int) -> bytes | memoryview:
        units = pose_units(pose.position, angles, slice(first, last), frame.decimals)
        return positions(frame, first + 1, units, configs, which[first:last])

    return map_blocks(len(which), block, BLOCK)


def pose_units(position: Array, angles: tuple[Array, Array, Array], rows: slice, decimals: int) -> IntArray:
    """X Y Z and W P R of some rows as printed, in units of the last digit, (6, n).

    Raises:
        InputError: A value too large for the format.
    """
    numbers = np.empty((6, len(position[rows])))
    np.divide(position[rows].T, MM, out=numbers[:3])
    for number, angle in zip(numbers[3:], angles, strict=True):
        np.divide(angle[rows], DEG, out=number)
    numbers *= 10.0**decimals
    np.rint(numbers, out=numbers)
    angle = numbers[3:]
    angle[angle == -180 * 10.0**decimals] *= -1  # the same turn: noise must not choose between two texts
    if not fits_fixed(numbers, decimals):
        raise InputError("program: a position is beyond what nine characters hold (9999 mm) or not a number")
    return numbers.astype(np.int64 if decimals > DECIMALS else np.int32)


def pose_numbers(position: Array, rotation: Array, decimals: int = DECIMALS) -> Array:
    """X Y Z [mm] and W P R [deg] as printed, (N, 6); no negative zero.

    Raises:
        InputError: A value too large for the format.
    """
    return numbers_of(pose_units(position, to_wpr(rotation), slice(None), decimals), decimals).T


def numbers_of(units: IntArray, decimals: int) -> Array:
    """The numbers that units of the last digit say; they are the nearest to what is printed."""
    return np.asarray(units / 10.0**decimals)


def printed_poses(pose: Pose, decimals: int = DECIMALS) -> Pose:
    """The poses that the text of N poses says.

    Raises:
        InputError: A value too large for the format.
    """
    angles = to_wpr(pose.rotation)
    position, rotation = np.empty((len(pose), 3)), np.empty((len(pose), 3, 3))

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            fill_poses(pose_units(pose.position, angles, rows, decimals), decimals, position[rows], rotation[rows])

    parallel_for(len(pose), part)
    return Pose(frozen(position), frozen(rotation))


def fill_poses(units: IntArray, decimals: int, position: Array, rotation: Array) -> None:
    """Positions (n, 3) [m] and rotations (n, 3, 3) that units of the last digit (6, n) say."""
    numbers = numbers_of(units, decimals)
    np.multiply(numbers[:3], MM, out=position.T)
    fill_rotation_matrices([_cosine_and_sine(angle, decimals) for angle in units[3:]], rotation.reshape(-1, 9))


def _cosine_and_sine(units: IntArray, decimals: int) -> tuple[Array, Array]:
    """Of angles in units of the last digit, (n,) each; poses next to each other mostly share theirs."""
    size = np.abs(units)
    low, high = int(size.min()), int(size.max())
    if 2 * (high - low) >= len(size):
        angle = numbers_of(units, decimals) * DEG
        return np.cos(angle), np.sin(angle)
    angle = numbers_of(np.arange(low, high + 1), decimals) * DEG
    size -= low
    sine = np.sin(angle).take(size)
    return np.cos(angle).take(size), np.where(units < 0, -sine, sine)


def resolution(decimals: int = DECIMALS) -> tuple[float, float]:
    """Between two numbers of a position that the text can say: coordinates [m] and angles [rad]."""
    return MM / 10**decimals, DEG / 10**decimals


def as_written(program: Program, printed: Pose | None = None) -> Program:
    """The program that its own text says: what ``interpret(compose(program))`` gives, without the text.

    Args:
        program: Any.
        printed: Its ``printed_poses``, where they are known.
    """
    if printed is None:
        printed = printed_poses(Pose(program.position, program.rotation), program.decimals)
    rows, which = unique_rows(program.speed)
    speeds = np.array([writable_speed(v) for v in program.speed[rows].tolist()])
    return replace(program, position=printed.position, rotation=printed.rotation, speed=frozen(speeds[which]))


def acc_text(percent: int | None) -> str:
    """The option of a motion that scales its accelerations; nothing where it is not said."""
    return "" if percent is None else f" ACC{percent}"


def speed_text(speed: float) -> str:
    """The coarsest unit that says a speed [m/s] well enough, never faster than asked.

    Raises:
        InputError: Slower or faster than any unit says.
    """
    choices = [
        (unit, step, decimals, min(int(speed / step + 1e-6), highest)) for unit, step, decimals, highest in UNITS
    ]
    texts = [(f"{n * 10.0**-decimals:.{decimals}f}{unit}", n * step) for unit, step, decimals, n in choices]
    best = max(texts, key=lambda s: s[1])
    for tolerance in (FEED_TOLERANCE, EXACT):  # an exact unit comes before a fine enough one
        best = next((s for s in texts if abs(s[1] - speed) <= tolerance * speed), best)
    if best[1] < 0.5 * speed:
        raise InputError(f"program: a speed of {speed / MM:g} mm/s cannot be written; use 0.05 to 2000 mm/s")
    return best[0]


def parse_speed(text: str) -> float:
    """m/s of a speed's text."""
    for unit, step, decimals, _ in UNITS:
        if text.endswith(unit):
            return float(text[: -len(unit)]) * step * 10.0**decimals
    raise ValueError(text)


def writable_speed(speed: float) -> float:
    """The speed that a program says for a wanted one [m/s].

    Raises:
        InputError: Slower or faster than any unit says.
    """
    return parse_speed(speed_text(speed))
