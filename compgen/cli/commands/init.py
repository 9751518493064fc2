"""Commands for files to begin with: init lays down robots and paths, schema prints what they may say."""

import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import check_writable, write_file
from compgen.cli.screen.messages import print_record
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text

KINDS = ("robots", "paths")
TUTORIALS = "docs/tutorials/data"


def init(
    folder: Annotated[str, typer.Argument(help="Where to; default here.")] = ".",
    *,
    urdf: Annotated[
        str | None, typer.Option("--urdf", help="Write robots/<its name>.toml from this URDF file instead.")
    ] = None,
    j3: Annotated[
        Literal["coupled", "alone"],
        typer.Option("--j3", help="Whether the URDF's joint 3 is the pendant's J2 + J3, as in ROS-Industrial's."),
    ] = "coupled",
    tutorial: Annotated[
        str | None, typer.Option("--tutorial", help="Lay down the files that this tutorial begins with, too.")
    ] = None,
    screen: opt.Screen,
) -> Outcome:
    """Lay down the robots, paths and schemas that come with compgen, or a robot file from a URDF file.

    Examples:
        cgen init my_cell
        cgen init --urdf arm.urdf
    """
    from compgen.core.toml import shipped

    if urdf is not None:
        target = _from_urdf(Path(folder), urdf, coupled=j3 == "coupled")
        return _outcome([str(target)], [], [f"wrote {target}; what is [assumed] in it you know better"])
    of_tutorial = [] if tutorial is None else _of_tutorial(shipped() / TUTORIALS, tutorial)
    for kind in KINDS:
        check_writable((Path(folder) / kind).absolute())
    written: list[str] = []
    kept: list[str] = []
    for kind in KINDS:
        of_kind = (f for suffix in ("*.toml", "*.schema.json") for f in (shipped() / kind).glob(suffix))
        _lay_down(sorted(of_kind), Path(folder) / kind, written, kept)
    count = len(written)
    _lay_down(of_tutorial, Path(folder), written, kept)
    robots, paths = (Path(folder) / kind for kind in KINDS)
    lines = [f"{count} files laid down in {robots} and {paths}; files already there are kept"]
    if of_tutorial:
        names = ", ".join(file.name for file in of_tutorial)
        lines.append(f"{len(written) - count} files of the tutorial in {folder}: {names}")
    return _outcome(written, kept, lines)


def _outcome(written: list[str], kept: list[str], lines: list[str]) -> Outcome:
    record = {"command": Command.INIT, "written": written, "kept": kept}
    return Outcome(record=record, lines=lines)


def _lay_down(files: list[Path], target: Path, written: list[str], kept: list[str]) -> None:
    """Copy the files that the target does not have yet."""
    try:
        target.mkdir(parents=True, exist_ok=True)
        for source in files:
            if os.path.lexists(target / source.name):
                kept.append(str(target / source.name))
                continue
            write_file(target / source.name, source.read_bytes())
            written.append(str(target / source.name))
    except OSError as failure:
        raise InputError(f"{target}: cannot be written: {failure.strerror}; give another folder") from failure


def _of_tutorial(folder: Path, tutorial: str) -> list[Path]:
    """The files that a tutorial begins with, by name."""
    known = sorted(entry.name for entry in folder.iterdir())
    if tutorial not in known:
        raise InputError(f"--tutorial {tutorial}: no tutorial has files of that name; give one of {', '.join(known)}")
    return sorted((folder / tutorial).iterdir())


def _from_urdf(folder: Path, urdf: str, *, coupled: bool) -> Path:
    """Write the robot file of a URDF file into ``robots/``; what is there is kept."""
    from compgen.pipelines.files.robot_from_urdf import robot_from_urdf

    check_writable((folder / "robots").absolute())
    name, text = robot_from_urdf(urdf, coupled=coupled)
    target = folder / "robots" / f"{name}.toml"
    if os.path.lexists(target):
        raise InputError(f"{target}: it is there; move it away, or rename {urdf}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise InputError(f"{target.parent}: cannot be written: {failure.strerror}; give another folder") from failure
    write_file(target, text.encode())
    return target


def schema(
    kind: Annotated[Literal["path", "robot"], typer.Argument(help="Which kind of file.", show_default=False)],
    *,
    output: Annotated[str | None, typer.Option("-o", "--output", help="A file to write it to.")] = None,
    screen: opt.Screen,
) -> Outcome:
    """Print the JSON Schema of path or robot files.

    Examples:
        cgen schema path -o path.schema.json
        cgen schema robot
    """
    from compgen.pipelines.files.schema import path_schema, robot_schema

    if output is not None:
        check_own_file("-o", output, '"$schema"', "schema")
    record = path_schema() if kind == "path" else robot_schema()
    if output is None:
        print_record(record)
        return Outcome()
    write_file(Path(output), json_text(record))
    return Outcome(record=record)
