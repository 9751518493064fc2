"""Meaning to text: canonical .LS, CR LF, three decimals."""

import numpy as np

from compgen.arrays import Array
from compgen.dialects.fanuc_ls.program import Program
from compgen.exceptions import InputError
from compgen.ik import Posture
from compgen.rotations import to_wpr
from compgen.units import DEG, INCH, MINUTE, MM

DECIMALS = 3
FEED_TOLERANCE = 0.005  # a unit is fine enough when it meets the speed this nearly
APPROACH_PERCENT = 10  # of full joint speed, for the way to the first position
REMARK_LENGTH = 32

#: unit, m/s of one step, decimals, highest value
_UNITS = (("mm/sec", MM, 0, 2000), ("cm/min", 10 * MM / MINUTE, 0, 12000), ("inch/min", 0.1 * INCH / MINUTE, 1, 47244))

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

_POSITION = (
    "P[%d]{{\n   GP1:\n\tUF : {uf}, UT : {ut},\t\tCONFIG : '{letters}, %d, %d, %d',\n"
    "\tX = %9.3f  mm,\tY = %9.3f  mm,\tZ = %9.3f  mm,\n"
    "\tW = %9.3f deg,\tP = %9.3f deg,\tR = %9.3f deg\n}};\n"
)


def compose(program: Program) -> bytes:
    """The program's text.

    Raises:
        InputError: A remark, a speed or a position that the format cannot say.
    """
    for remark in program.remarks:
        if len(remark) > REMARK_LENGTH or not remark.isascii():
            raise InputError(f"program {program.name}: remark '{remark}' is over {REMARK_LENGTH} ASCII characters")
    body = [f"  !{remark} ;" for remark in program.remarks]
    body += [f"  UFRAME_NUM={program.uframe} ;", f"  UTOOL_NUM={program.utool} ;"]
    body.append(f"J P[1] {APPROACH_PERCENT}% FINE    ;")
    said = {v: speed_text(v) for v in np.unique(program.speed).tolist()}
    ends = [" FINE    ;" if f else " CNT100    ;" for f in program.fine[1:].tolist()]
    speeds = [said[v] for v in program.speed.tolist()]
    body += [f"L P[{n}] {speed}{end}" for n, speed, end in zip(range(2, len(ends) + 2), speeds, ends)]
    header = _HEADER.format(name=program.name, comment=program.comment, date=program.date, lines=len(body))
    lines = "".join([f"{n:4d}:{text}\n" for n, text in enumerate(body, 1)])
    template = _POSITION.format(uf=program.uframe, ut=program.utool, letters=letters(program.posture))
    numbers = pose_numbers(program.position, program.rotation)
    rows = zip(range(1, len(numbers) + 1), *program.turns.T.tolist(), *numbers.T.tolist())
    positions = "".join(map(template.__mod__, rows))
    text = f"{header}{lines}/POS\n{positions}/END\n"
    return text.replace("\n", "\r\n").encode("ascii")


def pose_numbers(position: Array, rotation: Array) -> Array:
    """X Y Z [mm] and W P R [deg] as printed, (N, 6); no negative zero.

    Raises:
        InputError: A value too large for the format.
    """
    numbers = np.column_stack([position / MM, *(angle / DEG for angle in to_wpr(rotation))])
    numbers = np.round(numbers, DECIMALS) + 0.0
    if not np.all(np.abs(numbers) < 1e5):
        raise InputError("program: a position is beyond 99999 mm or not a number")
    return np.asarray(numbers)


def letters(posture: Posture) -> str:
    """CONFIG's letters: wrist, elbow, arm."""
    return f"{'F' if posture.flip else 'N'} {'U' if posture.up else 'D'} {'T' if posture.front else 'B'}"


def speed_text(speed: float) -> str:
    """The coarsest unit that says a speed [m/s] well enough, never faster than asked.

    Raises:
        InputError: Slower or faster than any unit says.
    """
    steps = [(unit, step, decimals, min(int(speed / step + 1e-6), highest)) for unit, step, decimals, highest in _UNITS]
    said = [(f"{n * 10.0**-decimals:.{decimals}f}{unit}", n * step) for unit, step, decimals, n in steps]
    best = max(said, key=lambda s: s[1])
    for tolerance in (FEED_TOLERANCE, 1e-6):  # an exact unit comes before a fine enough one
        best = next((s for s in said if abs(s[1] - speed) <= tolerance * speed), best)
    if best[1] < 0.5 * speed:
        raise InputError(f"program: a speed of {speed / MM:g} mm/s cannot be written; use 0.05 to 2000 mm/s")
    return best[0]


def speed_said(text: str) -> float:
    """m/s of a speed's text."""
    for unit, step, decimals, _ in _UNITS:
        if text.endswith(unit):
            return float(text[: -len(unit)]) * step * 10.0**decimals
    raise ValueError(text)


def writable_speed(speed: float) -> float:
    """The speed that a program says for a wanted one [m/s].

    Raises:
        InputError: Slower or faster than any unit says.
    """
    return speed_said(speed_text(speed))


def largest_feed_error(speed: Array) -> float:
    """Largest relative difference between wanted and written speeds."""
    return max((abs(speed_said(speed_text(v)) / v - 1) for v in np.unique(speed).tolist()), default=0.0)
