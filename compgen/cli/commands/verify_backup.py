"""The command that compares what a controller gives back with what was written."""

from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs
from compgen.cli.screen.messages import print_lines
from compgen.core.commands import Command

if TYPE_CHECKING:
    from compgen.fanuc.comparison.backup import ComparedProgram


def verify_backup(
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
    """Compare a controller's ASCII backup with the written program, to the last digit; exit 1 where they differ.

    Examples:
        cgen verify-backup out/SPIRAL_1300.LS backup/SPIRAL_1300.LS
        cgen verify-backup outputs/optic_spiral backup --json
    """
    from compgen.pipelines.compare_backup.backup_files import verify_backup as compare

    programs = compare(written, backup)
    count = sum(len(program.differences) for program in programs)
    record = {
        "command": Command.VERIFY_BACKUP,
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
