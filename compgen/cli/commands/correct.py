"""The command that corrects a program that exists."""

import sys
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_marks
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.ownership import check_correction_folder, check_restored
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import outcome_words, print_error, print_record
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import PROVENANCE, read_regular
from compgen.core.findings import first_message


def correct(
    program: opt.ProgramFile,
    robot: opt.ProgramRobot = None,
    frames: opt.FramesFile = None,
    registers: opt.RegistersFile = None,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", help="What went before: 'moving 200mm/s 5h', 'idle 30min', or a .toml; repeatable."),
    ] = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<program>.")
    ] = None,
    split: Annotated[
        bool, typer.Option("--split", help="Part positions whose uses need different corrections.")
    ] = False,
    insert: Annotated[
        float | None, typer.Option("--insert", help="Put points into straight lines that stray by more [um].")
    ] = None,
    max_um: opt.MaxUm = None,
    average_over: Annotated[
        str | None,
        typer.Option("--average-over", help="One file for many starts: 'delay_s=[0, 1200]', override_percent."),
    ] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse a program with unsafe statements.")] = False,
    again: Annotated[bool, typer.Option("--again", help="Take a program that is corrected already.")] = False,
    mark: Annotated[
        str,
        typer.Option(
            "--mark",
            autocompletion=complete_marks,
            help="digits, or remark: a remark line where the digits cannot carry the mark.",
        ),
    ] = "digits",
    restore: Annotated[bool, typer.Option("--restore", help="Give the planned program back instead.")] = False,
    force: opt.ForceProgram = False,
    lift_all: Annotated[
        float | None, typer.Option("--lift-all", help="Correct a dry run instead: NAME_DRY.LS, lifted by so much [mm].")
    ] = None,
    overrides: opt.Overrides = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Correct an existing program in place: only the numbers of its positions change."""
    from compgen.cli.screen.correction_table import show_correction
    from compgen.cli.screen.progress_bar import CORRECT, show_progress
    from compgen.fanuc.editing.lift import DRY, renamed
    from compgen.job.anchored_start import begin
    from compgen.pipelines import correct as pipeline
    from compgen.pipelines.correct.program_file import (
        read_frames,
        read_program,
        read_registers,
        refuse_corrected,
    )
    from compgen.pipelines.correct.programs_beside import programs_beside
    from compgen.pipelines.correct.result import options_of
    from compgen.pipelines.files.history_words import load_before
    from compgen.pipelines.files.robot_choice import robot_of_program
    from compgen.pipelines.files.robot_file import load_cell
    from compgen.report.files import correction_files

    use_cores(workers)
    options = options_of(
        split, insert, strict, again=again, mark=mark, max_um=max_um, average_over=average_over, lift_all=lift_all
    )
    source = Path(program)
    folder = opt.output_folder(program, output, "_dry" if options.raised else "")
    content = read_program(program)
    if (folder / source.name).exists() and source.exists() and (folder / source.name).samefile(source):
        raise InputError(f"{program}: the result would replace it; give another folder with -o")
    of_page = page_options(folder, assets, date)
    if restore:
        _restore(source, content, folder, as_json, quiet)
        return
    file = source.name if not options.raised else f"{source.stem}{DRY}{source.suffix}"
    provenance = Path(file).stem + PROVENANCE
    if not options.raised:
        check_correction_folder(folder, content, file, provenance)
    if not again:
        refuse_corrected(source, content)
    if robot is None:
        with naming_file(program):
            robot = robot_of_program(content)
    cell, history = begin(load_cell(robot, overrides or ()), load_before(before or ()), state, state_age)
    if options.raised:  # under the name that it gets on this controller
        check_correction_folder(folder, renamed(content, cell.robot.controller.name_length), file, provenance)
    frames_table, register_table = read_frames(frames), read_registers(registers)
    with show_progress(quiet or as_json, CORRECT) as progress:
        with naming_file(program):
            correction = pipeline.correct(
                content,
                cell,
                frames_table,
                before=history,
                options=options,
                progress=progress,
                find_program=programs_beside(source),
                registers=register_table,
            )
        progress(stages.REPORT, 0.0)
        written = correction.is_usable or force
        files = correction_files(correction, file, of_page, with_program=written)
        programs = {name: files[name] for name in (provenance, file) if name in files}
        reports = {name: files[name] for name in ("report.json", "report.html", "positions.csv")}
        described = page_files(folder, reports, figures, of_page)
        publish(folder, programs, described, (provenance, file))
    if as_json:
        print_record(files["report.json"])
    elif not quiet:
        show_correction(correction, folder, files)
    if not correction.inside:
        broken = first_message(Level.OUTSIDE, correction.findings)
        ending = "written all the same" + ("" if correction.is_usable else " (--force)")
        ending = ending if written else f"{file} not written; --force writes it"
        raise typer.Exit(print_error(f"{outcome_words(correction.verdict)}: {broken}; {ending}", 1))


def _restore(source: Path, content: bytes, folder: Path, as_json: bool, quiet: bool) -> None:
    """Write the planned program that a corrected one was made from."""
    from compgen.report.provenance import restore_planned

    provenance = source.with_name(source.stem + PROVENANCE)
    try:
        record = read_regular(provenance)
    except OSError:
        raise InputError(
            f"{source}: {provenance.name} is not beside it; put it back, it holds the planned program"
        ) from None
    planned = restore_planned(record, content, str(provenance))
    check_restored(folder, source.name, planned)
    publish(folder, {source.name: planned}, {})
    if as_json:
        print_record(
            {
                "command": Command.CORRECT,
                "restored": source.name,
                "folder": str(folder),
                "sha256": sha256(planned).hexdigest(),
            }
        )
    elif not quiet:
        sys.stdout.write(f"wrote the planned {source.name} to {folder}\n")
