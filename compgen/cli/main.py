"""Run the command line: every refusal is one line and an exit code.

Exit codes: 0 inside the bounds, 1 outside, 2 bad input, 3 the job cannot be done.
"""

import os
import sys
from io import TextIOWrapper

import typer

import compgen.cli.blas_threads  # noqa: F401  (before numpy is loaded)
from compgen.cli.app import app
from compgen.cli.messages import print_error
from compgen.core import interrupts
from compgen.core.exceptions import CompgenError


def main() -> None:
    """Run what the arguments ask for, and exit."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        code = _exit_code()
        interrupts.block_interrupts()
    except BaseException:  # also what a lock says that was left half way
        stop = interrupts.pending_interrupt()
        if stop is None:
            raise
        # within the clause: its frames, and the arrays that threads still write to, live until the end
        _exit(print_error(str(stop), stop.code))
    _exit(code)


def _exit_code() -> int:
    """What the command asked for ends with."""
    try:
        code = app(sys.argv[1:] or ["--help"], prog_name="cgen", standalone_mode=False) or 0
        sys.stdout.flush()
        return int(code)
    except CompgenError as failure:
        return print_error(str(failure), failure.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return print_error("interrupted; nothing was written", 130)
    except typer.TyperException as failure:
        return print_error(f"{failure.format_message().rstrip('.')}; see cgen --help", 2)
    except MemoryError:
        return print_error("not enough memory; make the path smaller, or raise process.chord_um", 2)
    except BrokenPipeError:  # whoever read the output has seen enough
        return 0
    except SystemExit as exit_request:  # typer's answer to the same is 1, which says "outside"
        if isinstance(exit_request.__context__, BrokenPipeError):
            return 0
        raise
    except OSError as failure:
        return print_error(f"output: cannot be written: {failure.strerror}; see where it goes", 2)


def _exit(code: int) -> None:
    """Exit without Python flushing a stream that is gone."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
