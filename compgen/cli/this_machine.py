"""What this machine offers to a long run: its cores and a C compiler."""

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from compgen.cli.screen.messages import print_note_once
from compgen.core.exceptions import InputError

if TYPE_CHECKING:
    from compgen.core.evaluation import Compiler


def use_machine(workers: int = 0) -> None:
    """Compile what is evaluated over many rows where there is a compiler, and share rows out over the cores."""
    from compgen.core import evaluation

    evaluation.configure(*find_machine(workers), print_note_once)


def use_cores(workers: int = 0) -> None:
    """Share rows out over so many cores (0: all), and compile nothing."""
    from compgen.core import evaluation

    evaluation.configure(None, workers or core_count())


def core_count() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def find_machine(workers: int | None) -> tuple["Compiler | None", int]:
    """The compiler, or None where there is none, and how many threads: all cores where the number is 0 or None.

    Compiled functions are kept in ``$XDG_CACHE_HOME/compgen`` (``~/.cache/compgen``); ``$CC`` names another compiler.

    Raises:
        InputError: A variable of the environment is no folder or no command, or others can write into the folder.
    """
    from compgen.core import evaluation

    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    if not os.path.isabs(cache):
        raise InputError(f"XDG_CACHE_HOME: '{cache:.80}' is not an absolute path; give one, or unset it")
    command = os.environ.get("CC")
    try:
        shlex.split(command or "")
    except ValueError as failure:
        raise InputError(f"CC: '{command}' is no command: {failure}; mend the variable, or unset it") from None
    return evaluation.find_compiler(Path(cache) / "compgen", command), workers or core_count()
