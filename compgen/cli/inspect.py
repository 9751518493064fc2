"""The command that says what a program is."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.options import DEFAULT_ROBOT, FramesFile, ProgramFile, Robot


def inspect(
    program: ProgramFile,
    robot: Robot = DEFAULT_ROBOT,
    frames: FramesFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print as JSON.")] = False,
) -> None:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing."""
    from compgen import fanuc
    from compgen.cli.program_table import show_program
    from compgen.fanuc.analysis import inspection
    from compgen.fanuc.analysis.watermark import Mark
    from compgen.pipelines.program_file import naming_program, provenance_beside, read_frames, read_program
    from compgen.pipelines.robot_file import load_robot

    frames_table = read_frames(frames)
    arm = load_robot(robot)
    content = read_program(program)
    with naming_program(program):
        report = inspection.inspect(fanuc.loads(content), arm, frames_table)
    if report["mark"] == Mark.NONE and provenance_beside(Path(program), content):
        report["mark"] = Mark.RECORD.value
    if as_json:
        sys.stdout.write(json.dumps(report, indent=2, allow_nan=False) + "\n")
    else:
        show_program(report)
