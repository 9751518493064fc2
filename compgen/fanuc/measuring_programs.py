"""Programs that measure: one waits at joint positions, one touches spheres.

At each touch a signal ends a search, or the program stops and the shop reads by hand. Each touch has three positions:
where the arm may turn, where the search begins, and how far it may go (with stops: the touch itself). Where the signal
comes, the motion ends, the place is kept in a position register, and the next line follows; where none comes, the
program goes to its last label and aborts. It begins above one of the other touches: play in the joints at the first
touch then comes from a way that is known, too.
"""

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.fanuc.canonical.layout import SharedFrame
from compgen.fanuc.canonical.writer import head_and_body, position_blocks
from compgen.program.program import REMARK_LENGTH, Signal, TouchPositions

SPEED_PERCENT = 20  # of full joint speed
UTOOL = 1  # number of the tool while joints are measured


def measuring_program(name: str, comment: str, date: str, pendant_deg: Array, wait_s: float) -> bytes:
    """Text of the program, CR LF.

    Args:
        name: As the controller takes it.
        comment: At most 16 ASCII characters.
        date: "YY-MM-DD".
        pendant_deg: Joints as the pendant shows them, (N, 6) [deg].
        wait_s: At each position, for the instrument.

    Raises:
        InputError: A comment or a wait that the format cannot say.
    """
    if not comment.isascii() or len(comment) > 16:
        raise InputError(f"program {name}: comment '{comment}' is over 16 ASCII characters")
    if not 0 <= wait_s <= 327:
        raise InputError(f"--wait {wait_s:g}: must be 0 to 327 s")
    body = [
        "  !drives joint positions: check ;",
        "  !the way between them first ;",
        "  UFRAME_NUM=0 ;",
        f"  UTOOL_NUM={UTOOL} ;",
    ]
    for n in range(1, len(pendant_deg) + 1):
        body += [f"J P[{n}] {SPEED_PERCENT}% FINE    ;", f"  WAIT {wait_s:6.2f}(sec) ;"]
    lines = ["/POS"]
    for n, row in enumerate(pendant_deg.tolist(), 1):
        a = [f"J{k}= {v:9.3f} deg" for k, v in enumerate(row, 1)]
        lines += [f"P[{n}]{{", "   GP1:", f"\tUF : 0, UT : {UTOOL},\t"]
        lines += [f"\t{a[0]},\t{a[1]},\t{a[2]},", f"\t{a[3]},\t{a[4]},\t{a[5]}", "};"]
    return head_and_body(name, comment, date, body, len(body)) + "\r\n".join([*lines, "/END", ""]).encode("ascii")


WAY_SPEED, SEARCH_SPEED = 50, 5  # mm/s
MISSED = 99  # the label where no signal came


def touch_program(name: str, date: str, touches: TouchPositions, signal: Signal | None) -> bytes:
    """Text of the program, CR LF.

    Args:
        name: As the controller takes it.
        date: "YY-MM-DD".
        touches: Where.
        signal: That ends a search; None: the program pauses at each touch.
    """
    by_hand, by_signal = "at each pause: fill in the CSV", "time of each PR[{}..] in the CSV"
    body = [
        "  !touch spheres: check the ways ;",
        "  !between them at low speed first ;",
        f"  !{by_hand if signal is None else by_signal.format(signal.register)} ;",
        f"  UFRAME_NUM={touches.uframe} ;",
        f"  UTOOL_NUM={touches.utool} ;",
    ]
    if signal is not None:
        body.append(f"  SKIP CONDITION {signal.condition} ;")
    body += ["  !play at touch 1 comes from here ;", f"J P[{3 * touches.begin + 1}] {SPEED_PERCENT}% FINE    ;"]
    for n, sphere in enumerate(touches.name):
        turn, begin, end = (3 * n + k for k in (1, 2, 3))
        body += [f"  !{f'touch {n + 1}: {sphere}'[:REMARK_LENGTH]} ;", f"J P[{turn}] {SPEED_PERCENT}% FINE    ;"]
        kept = "" if signal is None else f" Skip,LBL[{MISSED}],PR[{signal.register + n}]=LPOS"
        body += [f"L P[{begin}] {WAY_SPEED}mm/sec FINE    ;", f"L P[{end}] {SEARCH_SPEED}mm/sec FINE{kept}    ;"]
        if signal is None:
            body.append("  PAUSE ;")
        body += [f"L P[{begin}] {WAY_SPEED}mm/sec FINE    ;", f"L P[{turn}] {WAY_SPEED}mm/sec FINE    ;"]
    body.append("  END ;")
    if signal is not None:
        body += [f"  LBL[{MISSED}] ;", "  !no touch where one was planned ;", "  ABORT ;"]
    frame = SharedFrame(touches.uframe, touches.utool, touches.decimals)
    blocks = position_blocks(frame, touches.pose, touches.posture, touches.turns)
    return b"".join([head_and_body(name, "touches", date, body, len(body)), b"/POS\r\n", *blocks, b"/END\r\n"])
