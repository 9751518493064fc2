"""A program that drives to joint positions and waits at each, for measuring."""

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError

SPEED_PERCENT = 20  # of full joint speed


def measuring_program(name: str, comment: str, date: str, pendant_deg: Array, wait_s: float, utool: int = 1) -> bytes:
    """Text of the program, CR LF.

    Args:
        name: As the controller takes it.
        comment: At most 16 ASCII characters.
        date: "YY-MM-DD".
        pendant_deg: Joints as the pendant shows them, (N, 6) [deg].
        wait_s: At each position, for the instrument.
        utool: Tool number.

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
        f"  UTOOL_NUM={utool} ;",
    ]
    for n in range(1, len(pendant_deg) + 1):
        body += [f"J P[{n}] {SPEED_PERCENT}% FINE    ;", f"  WAIT {wait_s:6.2f}(sec) ;"]
    lines = program_lines(name, comment, date, body)
    for n, row in enumerate(pendant_deg.tolist(), 1):
        a = [f"J{k}= {v:9.3f} deg" for k, v in enumerate(row, 1)]
        lines += [f"P[{n}]{{", "   GP1:", f"\tUF : 0, UT : {utool},\t"]
        lines += [f"\t{a[0]},\t{a[1]},\t{a[2]},", f"\t{a[3]},\t{a[4]},\t{a[5]}", "};"]
    return "\r\n".join([*lines, "/END", ""]).encode("ascii")


def program_lines(name: str, comment: str, date: str, body: list[str]) -> list[str]:
    """The lines of a program down to /POS: its header, and its statements numbered."""
    head = [
        f"/PROG  {name}", "/ATTR", "OWNER\t\t= MNEDITOR;", f'COMMENT\t\t= "{comment}";', "PROG_SIZE\t= 0;",
        f"CREATE\t\t= DATE {date}  TIME 00:00:00;", f"MODIFIED\t= DATE {date}  TIME 00:00:00;", "FILE_NAME\t= ;",
        "VERSION\t\t= 0;", f"LINE_COUNT\t= {len(body)};", "MEMORY_SIZE\t= 0;", "PROTECT\t\t= READ_WRITE;",
        "TCD:  STACK_SIZE\t= 0,", "      TASK_PRIORITY\t= 50,", "      TIME_SLICE\t= 0,", "      BUSY_LAMP_OFF\t= 0,",
        "      ABORT_REQUEST\t= 0,", "      PAUSE_REQUEST\t= 0;", "DEFAULT_GROUP\t= 1,*,*,*,*;",
        "CONTROL_CODE\t= 00000000 00000000;", "/MN",
    ]  # fmt: skip
    return [*head, *(f"{i:4d}:{text}" for i, text in enumerate(body, 1)), "/POS"]
