"""What the exit code of a command means: here and nowhere else."""

from enum import IntEnum
from typing import Self


class ExitCode(IntEnum):
    """How a command ends: its number, the kind in two words, and the sentence for a user."""

    kind: str
    sentence: str

    INSIDE = 0, "inside", "inside its bounds, or nothing was to be judged"
    OUTSIDE = (
        1,
        "outside",
        "outside: a bound is broken, a fit is refused, a backup differs, a program was not corrected; the record and the "
        "reason are printed",
    )
    BAD_INPUT = (
        2,
        "bad input",
        "bad input, wrong use, or an output that cannot be written: one line on stderr names file, key, value, limit and "
        "mend",
    )
    IMPOSSIBLE = (
        3,
        "cannot be done",
        "the job cannot be done: unreachable, a joint limit, a singularity; the waypoint and the joint are named",
    )
    CRASHED = 70, "crash", "a fault of compgen, with a traceback: no verdict"
    INTERRUPTED = 130, "interrupted", "interrupted"
    TERMINATED = 143, "terminated", "terminated"

    def __new__(cls, number: int, kind: str, sentence: str) -> Self:
        """A code with its words."""
        code = int.__new__(cls, number)
        code._value_ = number
        code.kind, code.sentence = kind, sentence
        return code
