"""A program that touches spheres: a search that a signal ends, or a stop at each touch where the shop reads by hand.

Each touch has three positions: where the arm may turn, where the search begins, and how far it may go (with stops: the
touch itself). Where the signal comes, the motion ends, the place is kept in a position register, and the next line
follows; where none comes, the program goes to its last label and aborts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from compgen.core.arrays import IntArray
from compgen.core.pose import Pose
from compgen.fanuc.canonical.writer import REMARK_LENGTH, pose_numbers
from compgen.fanuc.configuration import config_letters
from compgen.fanuc.measuring_program import SPEED_PERCENT, program_lines
from compgen.robot.inverse_kinematics import Posture

WAY_SPEED, SEARCH_SPEED = 50, 5  # mm/s
MISSED = 99  # the label where no signal came


@dataclass(frozen=True, slots=True)
class Signal:
    """What ends a search, and where places are kept."""

    condition: str  # as SKIP CONDITION has it, e.g. "DI[1]=ON"
    register: int  # the first PR[n]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class TouchPositions:
    """The 3 n positions of n touches, in a user frame."""

    name: tuple[str, ...]  # (n,) of the spheres
    pose: Pose  # 3 n
    posture: Posture
    turns: IntArray  # (3 n, 3)
    uframe: int
    utool: int
    decimals: int

    def config(self, n: int) -> str:
        """The text of CONFIG at a position, from 0."""
        a, b, c = self.turns[n].tolist()
        return f"{config_letters(self.posture)}, {a}, {b}, {c}"


def touch_program(name: str, date: str, touches: TouchPositions, signal: Signal | None) -> bytes:
    """Text of the program, CR LF.

    Args:
        name: As the controller takes it.
        date: "YY-MM-DD".
        touches: Where.
        signal: That ends a search; None: the program pauses at each touch.
    """
    body = [*_remarks(signal), f"  UFRAME_NUM={touches.uframe} ;", f"  UTOOL_NUM={touches.utool} ;"]
    if signal is not None:
        body.append(f"  SKIP CONDITION {signal.condition} ;")
    for n, sphere in enumerate(touches.name):
        turn, begin, end = (3 * n + k for k in (1, 2, 3))
        body += [f"  !{f'touch {n + 1}: {sphere}'[:REMARK_LENGTH]} ;", f"J P[{turn}] {SPEED_PERCENT}% FINE    ;"]
        body.append(f"L P[{begin}] {WAY_SPEED}mm/sec FINE    ;")
        if signal is None:
            body += [f"L P[{end}] {SEARCH_SPEED}mm/sec FINE    ;", "  PAUSE ;"]
        else:
            kept = f"Skip,LBL[{MISSED}],PR[{signal.register + n}]=LPOS"
            body.append(f"L P[{end}] {SEARCH_SPEED}mm/sec FINE {kept}    ;")
        body += [f"L P[{begin}] {WAY_SPEED}mm/sec FINE    ;", f"L P[{turn}] {WAY_SPEED}mm/sec FINE    ;"]
    body.append("  END ;")
    if signal is not None:
        body += [f"  LBL[{MISSED}] ;", "  !no touch where one was planned ;", "  ABORT ;"]
    lines = program_lines(name, "touches", date, body)
    return "\r\n".join([*lines, *_positions(touches), "/END", ""]).encode("ascii")


def _remarks(signal: Signal | None) -> Sequence[str]:
    remarks = ["touch spheres: check the ways", "between them at low speed first"]
    if signal is None:
        remarks.append("at each pause: time, deflection")
    else:
        remarks.append(f"time of each PR[{signal.register}..] in the CSV")
    return [f"  !{text} ;" for text in remarks]


def _positions(touches: TouchPositions) -> list[str]:
    """The blocks of all positions."""
    numbers = pose_numbers(touches.pose.position, touches.pose.rotation, touches.decimals)
    width, lines = touches.decimals + 6, list[str]()
    for n, row in enumerate(numbers.tolist(), 1):
        x, y, z, w, p, r = (f"{v:{width}.{touches.decimals}f}" for v in row)
        config = touches.config(n - 1)
        lines += [f"P[{n}]{{", "   GP1:", f"\tUF : {touches.uframe}, UT : {touches.utool},\t\tCONFIG : '{config}',"]
        lines += [f"\tX = {x}  mm,\tY = {y}  mm,\tZ = {z}  mm,", f"\tW = {w} deg,\tP = {p} deg,\tR = {r} deg", "};"]
    return lines
