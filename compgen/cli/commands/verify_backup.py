"""The command that compares what a controller gives back with what was written."""

import sys
from typing import Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs
from compgen.cli.screen.messages import print_error, print_record
from compgen.core.commands import Command


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
    first: Annotated[int, typer.Option("--first", min=0, help="Differences that are printed of each program.")] = 20,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
) -> None:
    """Compare a controller's ASCII backup with the written program, to the last digit; exit 1 where they differ."""
    from compgen.pipelines.compare_backup.backup_files import verify_backup as compare

    programs = compare(written, backup)
    count = sum(len(program.differences) for program in programs)
    if as_json:
        print_record(
            {
                "command": Command.VERIFY_BACKUP,
                "same": count == 0,
                "programs": [program.record() for program in programs],
            }
        )
    elif not quiet:
        for program in programs:
            how = f"the same: {program.statements} statements, {program.positions} positions, to {program.step:g}"
            ending = "s" if len(program.differences) > 1 else ""
            how = f"{len(program.differences)} difference{ending}" if program.differences else how
            lines = [f"{program.name}: {how}", *(f"  {difference}" for difference in program.differences[:first])]
            if len(program.differences) > first:
                lines.append(f"  and {len(program.differences) - first} more (--first N, or --json)")
            lines += [f"  note: {note}" for note in program.notes]
            sys.stdout.write("\n".join(lines).encode("ascii", "backslashreplace").decode() + "\n")
    if count:
        worst = next(program for program in programs if program.differences)
        message = f"{worst.name}: {worst.differences[0]}; {count} in all: load it again, and compare again"
        raise typer.Exit(print_error(f"the backup differs: {message}", 1))
