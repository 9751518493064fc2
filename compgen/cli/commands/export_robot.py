"""Command export-robot: an arm for other software, as URDF or JSON."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import write_file
from compgen.cli.screen.messages import print_lines, print_record
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text


def export_robot(
    robot: opt.RobotArgument,
    *,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="File to write, .urdf or .json; default: print a URDF.")
    ] = None,
    rises: Annotated[
        str | None, typer.Option("--rise-K", help="Rises of its nodes, j2=11,j3=13; default: a cold arm.")
    ] = None,
    screen: opt.Screen,
) -> Outcome:
    """Write an arm, identified or not, cold or hot, as URDF or JSON for other software.

    Examples:
        cgen export-robot m710ic50 --rise-K j2=11,j3=13 -o hot.urdf
    """
    from compgen.pipelines.files.robot_export import export_arm
    from compgen.report.robot_files import export_record, urdf_text

    kind = Path(output).suffix if output is not None else ".urdf"
    if kind not in (".urdf", ".json"):
        raise InputError(f"-o {output}: ends in neither .urdf nor .json; name the file so")
    if output is not None:
        check_own_file("-o", output, None if kind == ".json" else "as its robot file knows it", Command.EXPORT_ROBOT)
    exported = export_arm(robot, rises)
    facts = exported.arm.robot
    record = json_text(export_record(facts, exported.chain, exported.rise_K, Path(exported.arm.source).name))
    text = record if kind == ".json" else urdf_text(facts, exported.chain, exported.words()).encode()
    if output is None:
        print_record(record if screen.as_json else text)
        return Outcome()
    write_file(Path(output), text)
    return Outcome(record=record, show=partial(print_lines, [*exported.words(), f"wrote {output}"]))
