"""Which robot an existing program is for, where the user does not say: the one that the program names."""

from compgen.core.exceptions import InputError
from compgen.fanuc import loads
from compgen.fanuc.analysis.robot_evidence import robots_named
from compgen.pipelines.files.robot_file import known_robots


def robot_named(data: bytes) -> str | None:
    """The one known robot that a program's remarks or comment name; None where it names none, or several.

    Raises:
        InputError: Not a program.
    """
    named = robots_named(loads(data), known_robots())
    return named[0] if len(named) == 1 else None


def robot_of_program(data: bytes) -> str:
    """The known robot that a program's remarks or comment name.

    Raises:
        InputError: Not a program, or it names no known robot, or several.
    """
    program, known = loads(data), known_robots()
    named = robots_named(program, known)
    if len(named) != 1:
        says = f"it names {' and '.join(named)}" if named else "it names none that is known"
        raise InputError(
            f"program {program.name}: which robot is it for? {says}; say --robot NAME, known: {', '.join(known)[:120]}"
        )
    return named[0]
