"""The command for shops that do not exchange programs: the one offset to type in, and what it leaves."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.frame import Outcome
from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_jobs
from compgen.cli.screen.messages import print_findings, stdout_console
from compgen.core.exceptions import InputError, naming_file
from compgen.core.findings import beyond_text

if TYPE_CHECKING:
    from compgen.core.stages import Progress
    from compgen.pipelines.planned.offsets import Offsets


def offsets(
    path: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_jobs, help="A path file, or a FANUC program, NAME.LS", show_default=False
        ),
    ],
    *,
    job: opt.JobChoice,
    log: Annotated[str | None, typer.Option("--log", help="Of a path: temperature log in place of [[before]].")] = None,
    reference: opt.LogReference = None,
    tables: opt.ProgramTables,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", help="Of a program: what went before, as cgen correct takes it; repeatable."),
    ] = None,
    max_um: opt.MaxUm = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Find the one position register or user frame that does best in place of a corrected program.

    Examples:
        cgen offsets paths/spiral_1300.toml --state state.toml
        cgen offsets JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 50
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.planned.offsets import offsets_of_job
    from compgen.report.offset_record import offsets_record

    opt.checked_bound(max_um)
    use_cores(workers)
    with show_progress(quiet=screen.is_silent) as progress:
        if not path.lower().endswith(".ls"):
            options = (("--frames", tables.frames), ("--registers", tables.registers), ("--before", before))
            given = [option for option, value in options if value]
            if given:
                raise InputError(f"{given[0]}: is of a program (.LS); a path file says it itself; leave it out")
            result = offsets_of_job(job.load_with_log(path, log, reference), progress)
        else:
            if log is not None:
                raise InputError("--log: is of a path file; for a program anchor with it, and give --state")
            choice = opt.ProgramChoice(
                robot=job.robot, before=before, state=job.state, state_age=job.state_age, overrides=job.overrides
            )
            result = _of_program(path, choice, tables, progress)
    record = offsets_record(result)
    best = min((way for way in record["ways"] if way["type_in"] is not None), key=lambda way: way["leaves"]["max_um"])
    left = best["leaves"]["max_um"]
    errors = []
    if max_um is not None and left > max_um:
        size = beyond_text(left, max_um)
        errors.append(f"the best offset ({best['kind']}) leaves {size} um, --max-um {max_um:g}")
    return Outcome(record=record, show=partial(_show, record), errors=errors)


def _of_program(program: str, choice: opt.ProgramChoice, tables: opt.ProgramTables, progress: "Progress") -> "Offsets":
    """Offsets of a program that exists."""
    from compgen.pipelines.correct.program_file import programs_beside, read_program, refuse_any_corrected
    from compgen.pipelines.correct.program_offsets import offsets_of_program

    source, content = Path(program), read_program(program)
    cell, history = choice.begin(program, content)
    with naming_file(program):
        refuse_any_corrected(source, content, cell.robot)
        frames, registers = tables.read()
        return offsets_of_program(content, cell, frames, history, progress, programs_beside(source), registers)


def _show(record: dict[str, Any]) -> None:
    """Print what to type in, and what each way leaves."""
    from rich.table import Table

    console = stdout_console()
    console.print(f"{record['name']}, positions in user frame {record['uframe']}; on the part, um:")
    table = Table("what is done", *"XYZWPR", "leaves rms", "p99", "max")
    for way in record["ways"]:
        numbers = way["type_in"]
        cells = [""] * 6 if numbers is None else [f"{v:.3f}" for v in numbers.values()]
        table.add_row(way["kind"], *cells, *(f"{way['leaves'][k]:.1f}" for k in ("rms_um", "p99_um", "max_um")))
    console.print(table)
    console.print(
        "X Y Z in mm, W P R in deg. PR offset: type them into a position register, and put Offset,PR[n] on the motions "
        "(the controller adds them in the user frame). User frame: type them in place of the frame's own."
    )
    print_findings(console, record["findings"])
