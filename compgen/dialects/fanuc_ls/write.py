"""Meaning to text: canonical .LS, CR LF, three decimals (or up to six)."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from compgen.arrays import Array
from compgen.dialects.fanuc_ls.digits import (
    DECIMALS,
    Bytes,
    chosen,
    different,
    fits,
    fixed,
    integers,
    ragged,
    units,
)
from compgen.dialects.fanuc_ls.program import Program
from compgen.evaluation import blocks_of
from compgen.exceptions import InputError
from compgen.ik import Posture
from compgen.rotations import from_wpr, to_wpr
from compgen.units import DEG, INCH, MINUTE, MM

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
    return b"".join(_parts(program, pose_numbers(program.position, program.rotation, program.decimals)))


def says(program: Program, numbers: Array, data: bytes) -> bool:
    """Whether ``data`` is the program's text with a table of positions, without the whole of it a second time.

    Args:
        program: What ``data`` may say.
        numbers: X Y Z [mm] and W P R [deg], (N, 6).
        data: A text.
    """
    at = 0
    try:
        for part in _parts(program, numbers):
            if not data.startswith(part, at):
                return False
            at += len(part)
    except (InputError, UnicodeEncodeError):  # what the format cannot say is not what it says
        return False
    return at == len(data)


def _parts(program: Program, numbers: Array) -> Iterator[bytes]:
    """The text, a block of rows at a time."""
    for remark in program.remarks:
        if len(remark) > REMARK_LENGTH or not remark.isascii():
            raise InputError(f"program {program.name}: remark '{remark}' is over {REMARK_LENGTH} ASCII characters")
    body = [f"  !{remark} ;" for remark in program.remarks]
    body += [f"  UFRAME_NUM={program.uframe} ;", f"  UTOOL_NUM={program.utool} ;"]
    body.append(f"J P[1] {APPROACH_PERCENT}% FINE    ;")
    count = len(body) + len(program.speed)
    header = _HEADER.format(name=program.name, comment=program.comment, date=program.date, lines=count)
    first = "".join([f"{n:4d}:{text}\n" for n, text in enumerate(body, 1)])
    start = f"{header}{first}".replace("\n", "\r\n").encode("ascii")
    yield start
    yield from _moves(program, len(body) + 1)
    yield b"/POS\r\n"
    yield from _places(program, numbers)
    yield b"/END\r\n"


def _moves(program: Program, line: int) -> Iterator[bytes]:
    """The lines of all linear motions."""
    N = len(program.speed)
    if N == 0:
        return iter(())
    rows, which = different(program.speed)
    said = [speed_text(v).encode("ascii") for v in program.speed[rows].tolist()]
    ends = chosen([b" CNT100    ;\r\n", b" FINE    ;\r\n"], program.fine[1:].astype(np.int64))

    def block(first: int, last: int) -> bytes:
        numbers, lines = np.arange(first + 2, last + 2), np.arange(line + first, line + last)
        tails = [chosen(said, which[first:last]), ends[first:last]]
        return ragged(last - first, [integers(lines, 4), b":L P[", integers(numbers), b"] ", *tails])

    return blocks_of(N, block)


def _places(program: Program, numbers: Array) -> Iterator[bytes]:
    """The blocks of all positions."""
    N = len(numbers)
    rows, which = different(program.turns)
    configs = [f"{letters(program.posture)}, {a}, {b}, {c}".encode("ascii") for a, b, c in program.turns[rows].tolist()]
    d = program.decimals
    head = f"]{{\r\n   GP1:\r\n\tUF : {program.uframe}, UT : {program.utool},\t\tCONFIG : '".encode("ascii")

    def block(first: int, last: int) -> bytes:
        X, Y, Z, W, P, R = (fixed(units(column, d), d) for column in numbers[first:last].T)
        number = integers(np.arange(first + 1, last + 1))
        parts: list[bytes | Bytes] = [b"P[", number, head, chosen(configs, which[first:last])]
        parts += [b"',\r\n\tX = ", X, b"  mm,\tY = ", Y, b"  mm,\tZ = ", Z]
        parts += [b"  mm,\r\n\tW = ", W, b" deg,\tP = ", P, b" deg,\tR = ", R, b" deg\r\n};\r\n"]
        return ragged(last - first, parts)

    return blocks_of(N, block)


def pose_numbers(position: Array, rotation: Array, decimals: int = DECIMALS) -> Array:
    """X Y Z [mm] and W P R [deg] as printed, (N, 6); no negative zero.

    Raises:
        InputError: A value too large for the format.
    """
    numbers = np.column_stack([position / MM, *(angle / DEG for angle in to_wpr(rotation))])
    if not np.all(np.isfinite(numbers)) or not fits(units(numbers.ravel(), decimals), decimals):
        raise InputError("program: a position is beyond what nine characters hold (9999 mm) or not a number")
    return np.asarray(np.round(numbers, decimals) + 0.0)


def printed(position: Array, rotation: Array, decimals: int = DECIMALS) -> tuple[Array, Array]:
    """The poses that the text says, (N, 3) [m] and (N, 3, 3)."""
    numbers = pose_numbers(position, rotation, decimals)
    return numbers[:, :3] * MM, from_wpr(*(numbers[:, 3:] * DEG).T)


def steps(decimals: int = DECIMALS) -> tuple[float, float]:
    """Between two numbers of a position that the text can say: coordinates [m] and angles [rad]."""
    return MM / 10**decimals, DEG / 10**decimals


def as_written(program: Program) -> Program:
    """The program that its own text says: what ``interpret(compose(program))`` gives, without the text."""
    position, rotation = printed(program.position, program.rotation, program.decimals)
    rows, which = different(program.speed)
    said = np.array([writable_speed(v) for v in program.speed[rows].tolist()])
    return replace(program, position=position, rotation=rotation, speed=said[which])


def letters(posture: Posture) -> str:
    """CONFIG's letters: wrist, elbow, arm."""
    return f"{'F' if posture.flip else 'N'} {'U' if posture.up else 'D'} {'T' if posture.front else 'B'}"


def speed_text(speed: float) -> str:
    """The coarsest unit that says a speed [m/s] well enough, never faster than asked.

    Raises:
        InputError: Slower or faster than any unit says.
    """
    steps = [(unit, step, decimals, min(int(speed / step + 1e-6), highest)) for unit, step, decimals, highest in UNITS]
    said = [(f"{n * 10.0**-decimals:.{decimals}f}{unit}", n * step) for unit, step, decimals, n in steps]
    best = max(said, key=lambda s: s[1])
    for tolerance in (FEED_TOLERANCE, EXACT):  # an exact unit comes before a fine enough one
        best = next((s for s in said if abs(s[1] - speed) <= tolerance * speed), best)
    if best[1] < 0.5 * speed:
        raise InputError(f"program: a speed of {speed / MM:g} mm/s cannot be written; use 0.05 to 2000 mm/s")
    return best[0]


def speed_said(text: str) -> float:
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
    return speed_said(speed_text(speed))
