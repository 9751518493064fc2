"""The command that parts a program that exists into pages."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import REPORT, check_folder, refusal
from compgen.cli.output_files.publish import files_of_earlier_run, publish
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.units import KB

if TYPE_CHECKING:
    from compgen.program.pages import PagedProgram, ProgramSize


def pages(
    program: opt.ProgramFile,
    *,
    robot: opt.ProgramRobot = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the pages; default outputs/<program>.")
    ] = None,
    overrides: opt.Overrides = None,
    taken: Annotated[
        list[str] | None, typer.Option("--taken", help="A program's name that pages must not get; repeatable.")
    ] = None,
    screen: opt.Screen,
) -> Outcome:
    """Cut a program that is too long for the controller into pages, with a main program and a manifest.

    Examples:
        cgen pages JOB.LS -o out
    """
    from compgen.pipelines.correct.program_file import read_program, robot_of_program
    from compgen.pipelines.correct.program_pages import pages_of_program
    from compgen.pipelines.files.robot_file import load_cell

    folder = opt.output_folder(program, output)
    content = read_program(program)
    with naming_file(program):
        arm = load_cell(robot if robot is not None else robot_of_program(content), overrides or ()).robot
    parted = pages_of_program(program, content, arm, taken or ())
    if parted.paged is None:
        line = f"{parted.name}: {_size_text(parted.size)}: the controller holds it in one file; nothing was written"
        record = {"command": Command.PAGES, "name": parted.name, "pages": []}
        return Outcome(record=record, lines=[line])
    opt.check_elsewhere(program, folder / f"{parted.paged.name}.LS", "the main program")
    _put(folder, parted.files, parted.manifest, Run(Command.PAGES, parted.paged.name))
    loads = f"{len(parted.paged.pages)} pages in {parted.paged.load_count} loads"
    lines = [f"{parted.name}: {_size_text(parted.size)}: {loads}, in {folder}", *_lines(parted.paged)]
    if parted.why_unknown:
        lines.append(f"warning: cgen resume cannot write these pages anew: {parted.why_unknown}")
    return Outcome(record=parted.files[parted.manifest], lines=lines)


def _put(folder: Path, files: dict[str, bytes], manifest: str, run: Run) -> None:
    """Put pages into a folder, in place of those that an earlier manifest names, and of nothing else."""
    own_names = files_of_earlier_run(folder / manifest)
    if os.path.lexists(folder / REPORT):
        raise refusal(folder, f"it holds the {REPORT} of another command;")
    check_folder(folder, run, others=sorted(files.keys() - own_names))
    publish(folder, files, {}, own_names, manifest, run)


def _lines(paged: "PagedProgram") -> Iterator[str]:
    """Each page, its load and what it relies on."""
    for page in paged.pages:
        yield f"  {page.name}: load {page.load}, {_size_text(page.size)}"
        yield from [f"    relies on the page before: {note}" for note in page.notes]


def _size_text(size: "ProgramSize") -> str:
    return f"{size.lines} lines, {size.positions} positions, {size.memory / KB:.1f} kB estimated"
