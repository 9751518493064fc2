"""Commands that read programs and write nothing: inspect says what one is, check-backup whether two are the same."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.commands.check import begin_files, judge_all, outcome_of_all
from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs, complete_robots
from compgen.cli.screen.messages import print_lines
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file

if TYPE_CHECKING:
    from compgen.fanuc.comparison.backup import ComparedProgram
    from compgen.program.frames import Frames
    from compgen.program.registers import Register


def inspect(
    programs: opt.ProgramFiles,
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            autocompletion=complete_robots,
            help="Robot name or file, for reach and limits; default: the one that the program names.",
        ),
    ] = None,
    tables: opt.ProgramTables,
    sarif: opt.Sarif = None,
    screen: opt.Screen,
) -> Outcome:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing.

    Examples:
        cgen inspect JOB.LS --frames SYSFRAME.VA
        cgen inspect JOB.LS --robot m20ia --json
        cgen inspect programs --sarif results.sarif
    """
    from compgen.cli.screen.program_table import show_program

    names = begin_files(programs, None, sarif, Command.INSPECT)
    frames, registers = tables.read()

    def judge(program: str) -> tuple[dict[str, Any], str]:
        return _report(program, robot, frames, registers), ""

    judged = judge_all(names, judge, None, sarif)

    def show() -> None:
        for one in judged:
            if len(programs) > 1:
                print_lines([f"{one.path}:"])
            if one.summary is not None:
                show_program(one.summary)

    return outcome_of_all(judged, show, alone=len(programs) == 1)


def _report(program: str, robot: str | None, frames: "Frames", registers: "dict[int, Register]") -> dict[str, Any]:
    """What a program is, as ``--json`` has it."""
    from compgen import fanuc
    from compgen.fanuc.analysis import inspection
    from compgen.fanuc.analysis.watermark import Mark
    from compgen.pipelines.correct.program_file import programs_beside, provenance_beside, read_program
    from compgen.pipelines.files.robot_file import load_robot, robot_named

    content = read_program(program)
    with naming_file(program):
        whole = fanuc.loads(content)
        name = robot if robot is not None else robot_named(content)
        arm = load_robot(name) if name is not None else None
        report = inspection.inspect(whole, arm, frames, registers, programs_beside(Path(program)))
    if report["mark"] == Mark.NONE and provenance_beside(Path(program), content):
        report["mark"] = Mark.RECORD.value
    return {"command": Command.INSPECT, **report}


def check_backup(
    written: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_programs, help="The program that was loaded, or its folder.", show_default=False
        ),
    ],
    backup: Annotated[
        str, typer.Argument(help="What the controller saved as ASCII: NAME.LS, or the folder.", show_default=False)
    ],
    *,
    first: Annotated[int, typer.Option("--first", min=0, help="Differences that are printed of each program.")] = 20,
    screen: opt.Screen,
) -> Outcome:
    """Check that a controller's ASCII backup is the program that was written, to the last digit; else exit 1.

    Examples:
        cgen check-backup out/SPIRAL_1300.LS backup/SPIRAL_1300.LS
        cgen check-backup outputs/optic_spiral backup --json
    """
    from compgen.pipelines.compare_backup.backup_files import verify_backup as compare

    programs = compare(written, backup)
    count = sum(len(program.differences) for program in programs)
    record = {
        "command": Command.CHECK_BACKUP,
        "same": count == 0,
        "programs": [program.record() for program in programs],
    }
    lines = [line for program in programs for line in _lines(program, first)]
    errors = []
    if count:
        worst = next(program for program in programs if program.differences)
        message = f"{worst.name}: {worst.differences[0]}; {count} in all: load it again, and compare again"
        errors.append(f"the backup differs: {message}")
    return Outcome(record=record, show=partial(print_lines, lines), errors=errors)


def _lines(program: "ComparedProgram", first: int) -> list[str]:
    """What is said of a program: that it is the same, or its first differences."""
    how = f"the same: {program.statements} statements, {program.positions} positions, to {program.step:g}"
    ending = "s" if len(program.differences) > 1 else ""
    how = f"{len(program.differences)} difference{ending}" if program.differences else how
    lines = [f"{program.name}: {how}", *(f"  {difference}" for difference in program.differences[:first])]
    if len(program.differences) > first:
        lines.append(f"  and {len(program.differences) - first} more (--first N, or --json)")
    lines += [f"  note: {note}" for note in program.notes]
    return [line.encode("ascii", "backslashreplace").decode() for line in lines]
