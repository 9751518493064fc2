"""What the exit code of a command means: here and nowhere else."""

from enum import IntEnum


class ExitCode(IntEnum):
    """How a command ends."""

    INSIDE = 0
    OUTSIDE = 1
    BAD_INPUT = 2
    IMPOSSIBLE = 3
    CRASHED = 70
    INTERRUPTED = 130
    TERMINATED = 143

    @property
    def kind(self) -> str:
        """The code in two words."""
        return _MEANINGS[self][0]

    @property
    def sentence(self) -> str:
        """What the code tells a user."""
        return _MEANINGS[self][1]


_MEANINGS = {
    ExitCode.INSIDE: ("inside", "inside its bounds, or nothing was to be judged"),
    ExitCode.OUTSIDE: (
        "outside",
        "outside: a bound is broken, a fit is refused, a backup differs, a program was not corrected; the record and "
        "the reason are printed",
    ),
    ExitCode.BAD_INPUT: (
        "bad input",
        "bad input, wrong use, or an output that cannot be written: one line on stderr names file, key, value, limit "
        "and mend",
    ),
    ExitCode.IMPOSSIBLE: (
        "cannot be done",
        "the job cannot be done: unreachable, a joint limit, a singularity; the waypoint and the joint are named",
    ),
    ExitCode.CRASHED: ("crash", "a fault of compgen, with a traceback: no verdict"),
    ExitCode.INTERRUPTED: ("interrupted", "interrupted"),
    ExitCode.TERMINATED: ("terminated", "terminated"),
}
