"""The command line: the only place that prints, writes files, catches exceptions and sets exit codes.

Exit codes: 0 inside the bounds, 1 outside, 2 bad input, 3 the job cannot be done.
"""

import gc
import os
import sys
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated

import typer

import compgen.cli.blas_threads  # noqa: F401  (before numpy is loaded)
from compgen import __version__
from compgen.cli.app import app, say_error
from compgen.cli.words import command
from compgen.core import interrupts
from compgen.core.exceptions import CompgenError

__all__ = ["main"]

#: the module of each command, in the order of the help: a command starts without the libraries of the others
_MODULES = {
    "inspect": "inspect",
    "init": "init",
    "schema": "schema",
    "pages": "pages",
    "generate": "jobs",
    "predict": "jobs",
    "check": "jobs",
    "correct": "correct",
    "heat": "heat",
    "whatif": "whatif",
    "identify": "identify",
    "validate": "identify",
    "plan-poses": "plan_poses",
}


@app.callback(invoke_without_command=True)
def _version(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        sys.stdout.write(f"compgen {__version__}\n")
        raise typer.Exit()


def main() -> None:
    """Run, and turn every refusal into one line and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        code = _outcome()
        interrupts.block_interrupts()
    except BaseException:  # also what a lock says that was left half way
        stop = interrupts.pending_interrupt()
        if stop is None:
            raise
        # within the clause: its frames, and the arrays that threads still write to, live until the end
        _leave(say_error(str(stop), stop.code))
    _leave(code)


def _outcome() -> int:
    """What the command asked for ends with: the exit code."""
    try:
        asked = _MODULES.get(next(iter(sys.argv[1:]), ""))
        gc.disable()  # what is loaded stays: looking through it again and again takes a tenth of a short job
        for module in [asked] if asked else dict.fromkeys(_MODULES.values()):
            import_module(f"compgen.cli.{module}")
        gc.freeze()
        gc.enable()
        interrupts.loading_finished()
        code = command(app)(sys.argv[1:] or ["--help"], prog_name="cgen", standalone_mode=False) or 0
        sys.stdout.flush()
        return int(code)
    except CompgenError as failure:
        return say_error(str(failure), failure.exit_code)
    except (KeyboardInterrupt, typer.Abort):
        return say_error("interrupted; nothing was written", 130)
    except typer.TyperException as failure:
        return say_error(f"{getattr(failure, 'format_message', failure.__str__)().rstrip('.')}; see cgen --help", 2)
    except MemoryError:
        return say_error("not enough memory; make the path smaller, or raise process.chord_um", 2)
    except BrokenPipeError:  # whoever read the output has seen enough
        return 0
    except OSError as failure:
        return say_error(f"output: cannot be written: {failure.strerror}; see where it goes", 2)


def _leave(code: int) -> None:
    """Exit without Python flushing a stream that is gone."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(code)
