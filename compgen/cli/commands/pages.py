"""The command that parts a program that exists into pages."""

import json
import os
from collections.abc import Sequence
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import REPORT, check_folder, refusal
from compgen.cli.output_files.publish import files_of_earlier_run, publish
from compgen.cli.screen.messages import print_lines
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.files import read_regular
from compgen.core.units import KB

if TYPE_CHECKING:
    from compgen.fanuc import LsProgram
    from compgen.program.pages import PagedProgram, ProgramSize
    from compgen.robot.robot import Robot


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
    from compgen import fanuc
    from compgen.fanuc.paging.capacity import program_size
    from compgen.pipelines.correct.program_file import read_program
    from compgen.pipelines.files.robot_file import load_cell, robot_of_program
    from compgen.program.page_stops import controller_capacity

    folder = opt.output_folder(program, output)
    content = read_program(program)
    with naming_file(program):
        whole = fanuc.loads(content)
        arm = load_cell(robot if robot is not None else robot_of_program(content), overrides or ()).robot
    size = program_size(whole)
    if size.within(controller_capacity(arm)):
        line = f"{whole.name}: {_size_text(size)}: the controller holds it in one file; nothing was written"
        record = {"command": Command.PAGES, "name": whole.name, "pages": []}
        return Outcome(record=record, show=partial(print_lines, [line]))
    paged, manifest_name, files = _parted(program, content, whole, arm, taken or ())
    opt.check_elsewhere(program, folder / f"{paged.name}.LS", "the main program")
    _put(folder, files, manifest_name, Run(Command.PAGES, paged.name))
    return Outcome(record=files[manifest_name], show=partial(print_lines, _lines(whole, paged, folder)))


def _parted(
    file: str, content: bytes, program: "LsProgram", robot: "Robot", taken: Sequence[str]
) -> "tuple[PagedProgram, str, dict[str, bytes]]":
    """The pages of a program, the name of their manifest, and all files; pages of a corrected one say so."""
    from compgen.core.version import __version__
    from compgen.fanuc.analysis.watermark import carries_mark
    from compgen.fanuc.editing.insertion import marking_remark
    from compgen.fanuc.paging.join_check import check_join, check_manifest
    from compgen.fanuc.paging.split import split_program
    from compgen.pipelines.correct.program_file import provenance_beside
    from compgen.pipelines.resume.written_job import CORRECTED
    from compgen.program.manifest import MANIFEST_SUFFIX, manifest_json
    from compgen.program.page_stops import controller_capacity

    capacity, provenance = controller_capacity(robot), provenance_beside(Path(file), content)
    marked = carries_mark(program, robot) or provenance is not None
    with naming_file(file):
        paged = split_program(program, capacity, taken, common=(marking_remark(__version__),) if marked else ())
    check_join(program, paged.main, {p.name: p.data for p in paged.pages})
    made = {} if provenance is None else {CORRECTED: json.loads(read_regular(provenance))}
    origin = {"command": Command.PAGES, "planned_sha256": sha256(content).hexdigest(), **made}
    name, manifest = f"{paged.name}{MANIFEST_SUFFIX}", manifest_json(paged, capacity, origin)
    files = {name: manifest, **paged.files()}
    check_manifest(manifest, files)
    return paged, name, files


def _put(folder: Path, files: dict[str, bytes], manifest: str, run: Run) -> None:
    """Put pages into a folder, in place of those that an earlier manifest names, and of nothing else."""
    own_names = files_of_earlier_run(folder / manifest)
    if os.path.lexists(folder / REPORT):
        raise refusal(folder, f"it holds the {REPORT} of another command;")
    check_folder(folder, run, others=sorted(files.keys() - own_names))
    publish(folder, files, {}, own_names, manifest, run)


def _lines(program: "LsProgram", paged: "PagedProgram", folder: Path) -> list[str]:
    """Each page, its load and what it relies on."""
    from compgen.fanuc.paging.capacity import program_size

    loads = f"{len(paged.pages)} pages in {paged.load_count} loads, in {folder}"
    lines = [f"{program.name}: {_size_text(program_size(program))}: {loads}"]
    for page in paged.pages:
        lines.append(f"  {page.name}: load {page.load}, {_size_text(page.size)}")
        lines += [f"    relies on the page before: {note}" for note in page.notes]
    return lines


def _size_text(size: "ProgramSize") -> str:
    return f"{size.lines} lines, {size.positions} positions, {size.memory / KB:.1f} kB estimated"
