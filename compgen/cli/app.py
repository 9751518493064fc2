"""The command line's frame: the application, the options that commands share, progress, refusals."""

import os
import re
import sys
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli import publish
from compgen.core import interrupts
from compgen.core.exceptions import InputError

app = typer.Typer(
    help="Predict where a warming robot's tool will be, and write the program that cancels the error.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

PathFile = Annotated[str, typer.Argument(help="A path file, e.g. paths/spiral_1300.toml", show_default=False)]
RobotName = Annotated[str | None, typer.Option("--robot", help="Robot name or file; default: what the path file says.")]
OutDir = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>.")
]
Set = Annotated[
    list[str] | None, typer.Option("--set", help="Override a key of the path or robot file, key=value; repeatable.")
]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, max=64, help="Threads; the results are the same for any number.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no table; errors only.")]
Date = Annotated[str, typer.Option("--date", help="Date in the program's header, YY-MM-DD.")]


def use_machine(workers: int | None) -> None:
    """Compile what is evaluated over many rows where there is a compiler, and share rows out over the cores.

    Compiled functions are kept in ``$XDG_CACHE_HOME/compgen`` (``~/.cache/compgen``); ``$CC`` names another compiler.
    """
    from compgen.core import evaluation  # a command that needs no evaluation starts without it

    count = workers if workers is not None else len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 1
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    compiler = evaluation.find_compiler(Path(base) / "compgen", os.environ.get("CC"))
    evaluation.configure(compiler, count, _say_once)


_said: set[str] = set()


def _say_once(note: str) -> None:
    if note not in _said and not interrupts.pending_interrupt():  # a compiler that is stopped as well has not failed
        _said.add(note)
        sys.stderr.write(f"cgen: note: {note}\n")


def say_error(message: str, code: int) -> int:
    """One line on the error stream; the exit code to leave with."""
    sys.stderr.write(f"cgen: {' '.join(message.split())}\n")
    return code


def output_folder(path: str, output: str | None, ending: str = "") -> Path:
    """Where results go, by default outputs/<name><ending>; refused before any work when they cannot go there."""
    if output == "":
        raise InputError("-o: an empty name; give a folder")
    folder = Path(output) if output is not None else Path("outputs") / f"{Path(path).stem}{ending}"
    publish.check_writable(folder.absolute())
    return folder


def checked_date(date: str) -> str:
    """A date as a program's header has it."""
    try:
        if not re.fullmatch(r"\d\d-\d\d-\d\d", date):
            raise ValueError
        datetime.strptime(f"20{date}", "%Y-%m-%d")
    except ValueError:
        raise InputError(f"--date {date}: not a date YY-MM-DD, as in 26-01-31") from None
    return date


def write_file(path: Path, content: bytes) -> None:
    """One file, whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError as failure:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {failure.strerror}; give another file") from failure
