"""Run the command line: every refusal is one line and an exit code.

Exit codes: 0 inside the bounds, 1 outside, 2 bad input, 3 the job cannot be done, 130 interrupted,
70 a fault of compgen.
"""

import os
import sys
from typing import Any

import typer

import compgen.cli.blas_threads  # noqa: F401  (before numpy is loaded)
from compgen.cli.app import app, options_of_commands
from compgen.cli.options.usage import usage_words
from compgen.cli.screen.console import UNWRAPPED
from compgen.cli.screen.messages import print_error, print_refusal, reason_of
from compgen.cli.screen.streams import let_readers_leave
from compgen.core import interrupts

#: a wrong call, as typer and click name it; typer has a name of its own for it only from 0.28 on
WrongCall: type[Any] = typer.BadParameter.__bases__[0]


def main() -> None:
    """Run what the arguments ask for, and exit."""
    let_readers_leave()
    try:
        code = _exit_code()
        interrupts.block_interrupts()
    except BaseException:  # also what a lock says that was left half way
        stop = interrupts.pending_interrupt()
        if stop is None:
            raise
        # within the clause: its frames, and the arrays that threads still write to, live until the end
        _exit(print_refusal(str(stop), stop.code))
    _exit(code)


def _exit_code() -> int:
    """What the command asked for ends with."""
    try:
        width = None if sys.stdout.isatty() else UNWRAPPED
        arguments = sys.argv[1:] or ["--help"]
        code = app(arguments, prog_name="cgen", standalone_mode=False, terminal_width=width) or 0
        sys.stdout.flush()
        return int(code)
    except (KeyboardInterrupt, typer.Abort):
        return print_refusal("interrupted; nothing was written", 130)
    except WrongCall as failure:
        return print_refusal(usage_words(failure, sys.argv[1:], options_of_commands()), 2)
    except OSError as failure:
        return print_error(f"output: cannot be written: {failure.strerror}; see where it goes", 2)
    except Exception as failure:  # noqa: BLE001  a fault of compgen must not end with the code of a verdict
        code, message = reason_of(failure)
        return print_refusal(message, code)


def _exit(code: int) -> None:
    """Exit without Python flushing a stream that is gone."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
