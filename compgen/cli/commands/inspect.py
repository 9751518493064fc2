"""The command that says what a program is."""

from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_robots
from compgen.cli.screen.messages import print_record
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file


def inspect(
    program: opt.ProgramFile,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            autocompletion=complete_robots,
            help="Robot name or file, for reach and limits; default: the one that the program names.",
        ),
    ] = None,
    frames: opt.FramesFile = None,
    registers: opt.RegistersFile = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
) -> None:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing."""
    from compgen import fanuc
    from compgen.cli.screen.program_table import show_program
    from compgen.fanuc.analysis import inspection
    from compgen.fanuc.analysis.watermark import Mark
    from compgen.pipelines.correct.program_file import (
        provenance_beside,
        read_frames,
        read_program,
        read_registers,
    )
    from compgen.pipelines.correct.programs_beside import programs_beside
    from compgen.pipelines.files.robot_choice import robot_named
    from compgen.pipelines.files.robot_file import load_robot

    frames_table, register_table = read_frames(frames), read_registers(registers)
    content = read_program(program)
    with naming_file(program):
        whole = fanuc.loads(content)
        name = robot if robot is not None else robot_named(content)
        arm = load_robot(name) if name is not None else None
        report = inspection.inspect(whole, arm, frames_table, register_table, programs_beside(Path(program)))
    if report["mark"] == Mark.NONE and provenance_beside(Path(program), content):
        report["mark"] = Mark.RECORD.value
    if as_json:
        print_record({"command": Command.INSPECT, **report})
    elif not quiet:
        show_program(report)
