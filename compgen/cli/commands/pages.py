"""The command that parts a program that exists into pages."""

import json
import sys
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_pages_folder
from compgen.cli.output_files.publish import files_of_earlier_run, publish
from compgen.cli.screen.messages import print_record
from compgen.core.commands import Command
from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import read_regular


def pages(
    program: opt.ProgramFile,
    robot: opt.ProgramRobot = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the pages; default outputs/<program>.")
    ] = None,
    overrides: opt.Overrides = None,
    taken: Annotated[
        list[str] | None, typer.Option("--taken", help="A program's name that pages must not get; repeatable.")
    ] = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
) -> None:
    """Part an existing program into pages that the controller holds, with a main program and a manifest."""
    from compgen import fanuc
    from compgen.cli.screen.pages_text import pages_text, unparted_text
    from compgen.core.version import __version__
    from compgen.fanuc.analysis.watermark import carries_mark
    from compgen.fanuc.editing.insertion import marking_remark
    from compgen.fanuc.paging.capacity import program_size
    from compgen.fanuc.paging.join_check import check_join
    from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX, check_manifest, manifest_json
    from compgen.fanuc.paging.split import split_program
    from compgen.fanuc.paging.stops import controller_capacity
    from compgen.pipelines.correct.program_file import provenance_beside, read_program
    from compgen.pipelines.files.robot_choice import robot_of_program
    from compgen.pipelines.files.robot_file import load_cell
    from compgen.pipelines.resume.written_job import CORRECTED

    folder = opt.output_folder(program, output)
    content = read_program(program)
    with naming_file(program):
        whole = fanuc.loads(content)
        arm = load_cell(robot if robot is not None else robot_of_program(content), overrides or ()).robot
    capacity = controller_capacity(arm)
    if program_size(whole).within(capacity):
        if as_json:
            print_record({"command": Command.PAGES, "name": whole.name, "pages": []})
        elif not quiet:
            sys.stdout.write(unparted_text(whole))
        return
    marked = carries_mark(whole, arm) or provenance_beside(Path(program), content) is not None
    with naming_file(program):
        paged = split_program(whole, capacity, taken or (), common=(marking_remark(__version__),) if marked else ())
    check_join(whole, paged.main, {p.name: p.data for p in paged.pages})
    manifest_name = f"{paged.name}{MANIFEST_SUFFIX}"
    provenance = provenance_beside(Path(program), content)
    made = {} if provenance is None else {CORRECTED: json.loads(read_regular(provenance))}
    manifest = manifest_json(
        paged, capacity, {"command": Command.PAGES, "planned_sha256": sha256(content).hexdigest(), **made}
    )
    files = {manifest_name: manifest, **paged.files()}
    check_manifest(manifest, files)
    if (main := folder / f"{paged.name}.LS").exists() and main.samefile(program):
        raise InputError(f"{program}: the main program would replace it; give another folder with -o")
    own_names = files_of_earlier_run(folder / manifest_name)
    check_pages_folder(folder, {*files}, own_names)
    publish(folder, files, {}, own_names, manifest_name)
    if as_json:
        print_record(manifest)
    elif not quiet:
        sys.stdout.write(pages_text(whole, paged, folder))
