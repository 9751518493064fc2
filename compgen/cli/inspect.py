"""The command that says what a program is; and how any command takes a program. It starts with few libraries."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from compgen import fanuc
from compgen.cli.app import app
from compgen.cli.program_table import show_program
from compgen.core.exceptions import InputError
from compgen.fanuc.analysis import inspection
from compgen.fanuc.frames import Frames, known_without_a_table, load_frames
from compgen.pipelines.robot_file import load_robot

ProgramFile = Annotated[str, typer.Argument(help="A FANUC program, NAME.LS", show_default=False)]
RobotFile = Annotated[str, typer.Option("--robot", help="Robot name or file.")]
FramesFile = Annotated[str | None, typer.Option("--frames", help="Frames table (.toml) or SYSFRAME.VA.")]


@app.command()
def inspect(
    program: ProgramFile,
    robot: RobotFile = "m710ic50",
    frames: FramesFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing."""
    table = frames_table(frames)
    arm = load_robot(robot)
    data = read_program(program)
    with naming_program(program):
        found = inspection.inspect(fanuc.loads(data), arm, table)
    if as_json:
        sys.stdout.write(json.dumps(found, indent=2, allow_nan=False) + "\n")
    else:
        show_program(found)


@contextmanager
def naming_program(program: str) -> Iterator[None]:
    """Put the file's name before what is wrong in it."""
    try:
        yield
    except InputError as failure:
        raise InputError(f"{program}: {failure}") from failure


def read_program(program: str) -> bytes:
    """A program file's bytes."""
    try:
        return Path(program).read_bytes()
    except (OSError, ValueError) as failure:
        why = getattr(failure, "strerror", None) or str(failure)
        raise InputError(f"{program}: cannot be read: {why}; give a program listing (.LS)") from None


def frames_table(path: str | None) -> Frames:
    """What UF and UT numbers mean."""
    return load_frames(path) if path is not None else known_without_a_table()
