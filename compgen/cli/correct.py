"""The command that corrects a program that exists."""

import json
import sys
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli import publish
from compgen.cli.app import Quiet, Set, app, output_folder, say_error
from compgen.cli.correction_table import show_correction
from compgen.cli.inspect import FramesFile, ProgramFile, RobotFile, frames_table, naming_program, read_program
from compgen.cli.progress_bar import CORRECT, stages
from compgen.core.exceptions import InputError
from compgen.core.findings import Level
from compgen.core.units import UM
from compgen.pipelines import correct as pipeline
from compgen.pipelines.history_words import load_before
from compgen.pipelines.robot_file import load_cell
from compgen.report.correction_page import correction_html
from compgen.report.correction_summary import correction_csv, correction_json
from compgen.report.provenance import planned_of, provenance_json

PROVENANCE = ".compgen.json"  # beside a corrected program


@app.command()
def correct(
    program: ProgramFile,
    robot: RobotFile = "m710ic50",
    frames: FramesFile = None,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", help="What went before: 'moving 200mm/s 5h', 'idle 30min', or a .toml; repeatable."),
    ] = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<program>.")
    ] = None,
    split: Annotated[
        bool, typer.Option("--split", help="Part positions whose uses need different corrections.")
    ] = False,
    insert: Annotated[
        float | None, typer.Option("--insert", help="Put points into straight lines that stray by more [um].")
    ] = None,
    max_um: Annotated[float | None, typer.Option("--max-um", help="Largest error allowed after correction.")] = None,
    strict: Annotated[bool, typer.Option("--strict", help="Refuse a program with unsafe statements.")] = False,
    again: Annotated[bool, typer.Option("--again", help="Take a program that is corrected already.")] = False,
    restore: Annotated[bool, typer.Option("--restore", help="Give the planned program back instead.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Write the program even outside its bounds.")] = False,
    set_: Set = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    quiet: Quiet = False,
) -> None:
    """Correct an existing program in place: only the numbers of its positions change."""
    for name, value, most in (("--insert", insert, 1e4), ("--max-um", max_um, 1e6)):
        if value is not None and not 0.1 <= value <= most:
            raise InputError(f"{name} {value:g}: must be 0.1 to {most:g} um")
    source = Path(program)
    folder = output_folder(program, output)
    data = read_program(program)
    if (folder / source.name).exists() and source.exists() and (folder / source.name).samefile(source):
        raise InputError(f"{program}: the result would replace it; give another folder with -o")
    if restore:
        _restore(source, data, folder, quiet)
        return
    if not again:
        _refuse_known(source, data)
    options = pipeline.Options(
        split=split,
        insert=None if insert is None else insert * UM,
        strict=strict,
        again=again,
        bound=None if max_um is None else max_um * UM,
    )
    cell, table, past = load_cell(robot, set_ or ()), frames_table(frames), load_before(before or ())
    with stages(quiet or as_json, CORRECT) as progress:
        with naming_program(program):
            result = pipeline.correct(data, cell, table, past, options, progress)
        progress("report", 0.0)
        files = {
            "report.json": correction_json(result),
            "positions.csv": correction_csv(result),
            "report.html": correction_html(result),
        }
        if result.inside or force:
            files[source.stem + PROVENANCE] = provenance_json(result)
            files[source.name] = result.text
        ours = {"report.json", "positions.csv", "report.html", source.stem + PROVENANCE, source.name}
        publish.publish(folder, files, ours)
    if as_json:
        sys.stdout.write(files["report.json"].decode())
    elif not quiet:
        show_correction(result, folder, files)
    if not result.inside:
        worst = next(f.message for f in result.findings if f.level is Level.OUTSIDE)
        told = "written all the same (--force)" if force else f"{source.name} not written; --force writes it"
        raise typer.Exit(say_error(f"outside bounds: {worst}; {told}", 1))


def _restore(source: Path, data: bytes, folder: Path, quiet: bool) -> None:
    """Write the planned program that a corrected one was made from."""
    beside = source.with_name(source.stem + PROVENANCE)
    try:
        provenance = beside.read_bytes()
    except OSError:
        raise InputError(
            f"{source}: {beside.name} is not beside it; put it back, it holds the planned program"
        ) from None
    publish.publish(folder, {source.name: planned_of(provenance, data, str(beside))}, {source.name})
    if not quiet:
        sys.stdout.write(f"wrote the planned {source.name} to {folder}\n")


def _refuse_known(source: Path, data: bytes) -> None:
    """Raises InputError when a provenance file beside a program says that it is a corrected one."""
    mine = sha256(data).hexdigest()
    for beside in sorted(source.parent.glob(f"*{PROVENANCE}")):
        try:
            made = json.loads(beside.read_bytes())
            known = made["corrected_sha256"] == mine != made["planned_sha256"]
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            continue
        if known:
            raise InputError(
                f"{source}: it carries compgen's mark ({beside.name} says so): it would be corrected twice; start from "
                "the planned program, get it back with --restore, or say --again"
            )
