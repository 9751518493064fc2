"""Commands on a program that exists: inspect."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from compgen import inspection
from compgen.cli.app import app
from compgen.cli.tables import show_program
from compgen.config import load_robot
from compgen.dialects import fanuc_ls
from compgen.dialects.fanuc_ls.frames import known_without_a_table, load_frames
from compgen.exceptions import InputError


@app.command()
def inspect(
    program: Annotated[str, typer.Argument(help="A FANUC program, NAME.LS", show_default=False)],
    robot: Annotated[str, typer.Option("--robot", help="Robot name or file, for limits.")] = "m710ic50",
    frames: Annotated[str | None, typer.Option("--frames", help="Frames table (.toml) or SYSFRAME.VA.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing."""
    table = load_frames(frames) if frames is not None else known_without_a_table()
    arm = load_robot(robot)
    try:
        data = Path(program).read_bytes()
    except OSError as failure:
        raise InputError(f"{program}: cannot be read: {failure.strerror}; give a program listing (.LS)") from None
    try:
        found = inspection.inspect(fanuc_ls.loads(data), arm, table)
    except InputError as failure:
        raise InputError(f"{program}: {failure}") from failure
    if as_json:
        sys.stdout.write(json.dumps(found, indent=2, allow_nan=False) + "\n")
    else:
        show_program(found)
