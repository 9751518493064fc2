"""The command for shops that do not exchange programs: the one offset to type in, and what it leaves."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_jobs
from compgen.cli.screen.messages import finding_rows, table_of
from compgen.core.exceptions import InputError, naming_file
from compgen.core.units import UM

if TYPE_CHECKING:
    from compgen.core.stages import Progress
    from compgen.pipelines.planned.offsets import Offsets

PathOrProgram = Annotated[
    str,
    typer.Argument(autocompletion=complete_jobs, help="A path file, or a FANUC program, NAME.LS", show_default=False),
]
LogOfPath = Annotated[str | None, typer.Option("--log", help="Of a path: temperature log in place of [[before]].")]


def offsets(
    path: PathOrProgram,
    *,
    job: opt.JobChoice,
    log: LogOfPath = None,
    reference: opt.LogReference = None,
    tables: opt.ProgramTables,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", help="Of a program: what went before, as cgen correct takes it; repeatable."),
    ] = None,
    max_um: opt.MaxUm = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Find the one position register or user frame that does best in place of a corrected program.

    Examples:
        cgen offsets paths/spiral_1300.toml --state state.toml
        cgen offsets JOB.LS --robot m710ic50 --before 'moving 200mm/s 5h' --max-um 50
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.planned.offsets import offsets_of_job

    with show_progress(quiet=screen.is_silent) as progress:
        if path.lower().endswith(".ls"):
            if log is not None:
                raise InputError("--log: is of a path file; for a program anchor with it, and give --state")
            choice = opt.ProgramChoice(
                robot=job.robot, before=before, state=job.state, state_age=job.state_age, overrides=job.overrides
            )
            result = _of_program(path, choice, tables, progress)
        else:
            _refuse_options_of_programs(tables, before)
            result = offsets_of_job(job.load_with_log(path, log, reference), progress)
    record = result.record()
    best = min((way for way in record["ways"] if way["type_in"] is not None), key=lambda way: way["leaves"]["max_um"])
    errors = opt.beyond_bound(f"the best offset ({best['kind']}) leaves {{}}", best["leaves"]["max_um"] * UM, max_um)
    return Outcome(record=record, shown=_shown(record, verbose=screen.verbose), errors=errors)


def _refuse_options_of_programs(tables: opt.ProgramTables, before: list[str] | None) -> None:
    """Raises InputError for an option of programs that is given with a path file."""
    for option, value in (("--frames", tables.frames), ("--registers", tables.registers), ("--before", before)):
        if value:
            raise InputError(f"{option}: is of a program (.LS); a path file says it itself; leave it out")


def _of_program(program: str, choice: opt.ProgramChoice, tables: opt.ProgramTables, progress: "Progress") -> "Offsets":
    """Offsets of a program that exists."""
    from compgen.pipelines.correct.program_file import programs_beside, read_program, refuse_any_corrected
    from compgen.pipelines.correct.program_offsets import offsets_of_program

    source, content = Path(program), read_program(program)
    cell, history, air, _ = choice.begin(program, content)
    with naming_file(program):
        refuse_any_corrected(source, content, cell.robot)
        frames, registers = tables.read()
        return offsets_of_program(content, cell, frames, history, progress, programs_beside(source), registers, air=air)


def _shown(record: dict[str, Any], *, verbose: bool) -> list[object]:
    """What to type in, and what each way leaves."""
    rows = []
    for way in record["ways"]:
        numbers = way["type_in"]
        cells = [""] * 6 if numbers is None else [f"{v:.3f}" for v in numbers.values()]
        rows.append([way["kind"], *cells, *(f"{way['leaves'][k]:.1f}" for k in ("rms_um", "p99_um", "max_um"))])
    return [
        f"{record['name']}, positions in user frame {record['uframe']}; on the part, um:",
        table_of(("what is done", *"XYZWPR", "leaves rms", "p99", "max"), rows),
        "X Y Z in mm, W P R in deg. PR offset: type them into a position register, and put Offset,PR[n] on the motions "
        "(the controller adds them in the user frame). User frame: type them in place of the frame's own.",
        *finding_rows(record["findings"], verbose=verbose),
    ]
