"""The command that splits an existing program into pages that the controller holds."""

import sys
from hashlib import sha256
from typing import Annotated

import typer

from compgen import fanuc
from compgen.cli import publish
from compgen.cli.app import Quiet, Set, app, output_folder
from compgen.cli.inspect import ProgramFile, RobotFile, naming_program, read_program
from compgen.core.exceptions import InputError
from compgen.core.units import KB
from compgen.fanuc.paging.capacity import ProgramSize, program_size
from compgen.fanuc.paging.join_check import check_join
from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX, check_manifest, manifest_json
from compgen.fanuc.paging.split import split_program
from compgen.fanuc.paging.stops import controller_capacity
from compgen.pipelines.robot_file import load_cell


@app.command()
def pages(
    program: ProgramFile,
    robot: RobotFile = "m710ic50",
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the pages; default outputs/<program>.")
    ] = None,
    set_: Set = None,
    taken: Annotated[
        list[str] | None, typer.Option("--taken", help="A program's name that pages must not get; repeatable.")
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Part an existing program into pages that the controller holds, with a main program and a manifest."""
    folder = output_folder(program, output)
    store = controller_capacity(load_cell(robot, set_ or ()).robot)
    data = read_program(program)
    with naming_program(program):
        whole = fanuc.loads(data)
    asked = program_size(whole)
    fits = asked.within(store)
    if fits:
        told = f"{whole.name}: {_says(asked)}: the controller holds it in one file; nothing was written\n"
    else:
        paged = split_program(whole, store, taken or ())
        check_join(whole, paged.main, {p.name: p.data for p in paged.pages})
        made = manifest_json(paged, store, {"planned_sha256": sha256(data).hexdigest()})
        name = f"{paged.name}{MANIFEST_SUFFIX}"
        files = {name: made, **paged.files()}
        check_manifest(made, files)
        if (clash := folder / f"{paged.name}.LS").exists() and clash.samefile(program):
            raise InputError(f"{program}: the main program would replace it; give another folder with -o")
        publish.publish(folder, files, {*files} | publish.files_of_earlier_run(folder / name))
        lines = [f"{whole.name}: {_says(asked)}: {len(paged.pages)} pages in {paged.load_count} loads, in {folder}"]
        for page in paged.pages:
            lines.append(f"  {page.name}: load {page.load}, {_says(page.size)}")
            lines += [f"    relies on the page before: {note}" for note in page.notes]
        told = "\n".join(lines) + "\n"
    if not quiet:
        sys.stdout.write(told)


def _says(asked: ProgramSize) -> str:
    return f"{asked.lines} lines, {asked.positions} positions, {asked.memory / KB:.1f} kB estimated"
