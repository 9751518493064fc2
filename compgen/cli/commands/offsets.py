"""The command for shops that do not exchange programs: the one offset to type in, and what it leaves."""

from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_jobs
from compgen.cli.screen.console import print_findings, stdout_console
from compgen.cli.screen.messages import print_error, print_record
from compgen.core.exceptions import InputError, naming_file
from compgen.core.findings import beyond_text


def offsets(
    path: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_jobs, help="A path file, or a FANUC program, NAME.LS", show_default=False
        ),
    ],
    robot: opt.JobRobot = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    log: Annotated[str | None, typer.Option("--log", help="Of a path: temperature log in place of [[before]].")] = None,
    reference: opt.LogReference = None,
    frames: opt.FramesFile = None,
    registers: opt.RegistersFile = None,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", help="Of a program: what went before, as cgen correct takes it; repeatable."),
    ] = None,
    overrides: opt.Overrides = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Find the one position register or user frame that does best in place of a corrected program."""
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.files.path_file import load_job
    from compgen.report.offset_record import offsets_record

    opt.checked_bound(max_um)
    use_cores(workers)
    with show_progress(quiet or as_json) as progress:
        if log is not None and state is not None:
            raise InputError("--log: a state stands in place of history and log; leave --log or --state out")
        if path.lower().endswith(".ls"):
            if log is not None:
                raise InputError("--log: is of a path file; for a program anchor with it, and give --state")
            result = _of_program(
                path,
                robot,
                state,
                state_age=state_age,
                frames=frames,
                registers=registers,
                before=before,
                overrides=overrides,
                progress=progress,
            )
        else:
            given = [n for n, v in (("--frames", frames), ("--registers", registers), ("--before", before)) if v]
            if given:
                raise InputError(f"{given[0]}: is of a program (.LS); a path file says it itself; leave it out")
            from compgen.pipelines.anchor.files import log_overrides
            from compgen.pipelines.planned.offsets import offsets_of_job

            changed = [*opt.with_state(path, overrides, state, state_age), *log_overrides(path, log, reference)]
            result = offsets_of_job(load_job(path, robot, changed), progress)
    record = offsets_record(result)
    if as_json:
        print_record(record)
    elif not quiet:
        _show(record)
    best = min((way for way in record["ways"] if way["type_in"] is not None), key=lambda way: way["leaves"]["max_um"])
    left = best["leaves"]["max_um"]
    if max_um is not None and left > max_um:
        raise typer.Exit(
            print_error(
                f"the best offset ({best['kind']}) leaves {beyond_text(left, max_um)} um, --max-um {max_um:g}", 1
            )
        )


def _of_program(
    program: str,
    robot: str | None,
    state: str | None,
    state_age: str | None,
    frames: str | None,
    registers: str | None,
    before: list[str] | None,
    overrides: list[str] | None,
    progress: Any,
) -> Any:
    """Offsets of a program that exists."""
    from compgen.job.anchored_start import begin
    from compgen.pipelines.correct.program_file import (
        read_frames,
        read_program,
        read_registers,
        refuse_any_corrected,
    )
    from compgen.pipelines.correct.program_offsets import offsets_of_program
    from compgen.pipelines.correct.programs_beside import programs_beside
    from compgen.pipelines.files.history_words import load_before
    from compgen.pipelines.files.robot_choice import robot_of_program
    from compgen.pipelines.files.robot_file import load_cell

    source, content = Path(program), read_program(program)
    with naming_file(program):
        robot = robot_of_program(content) if robot is None else robot
    cell, history = begin(load_cell(robot, overrides or ()), load_before(before or ()), state, state_age)
    with naming_file(program):
        refuse_any_corrected(source, content, cell.robot)
        return offsets_of_program(
            content, cell, read_frames(frames), history, progress, programs_beside(source), read_registers(registers)
        )


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
