"""Commands on a robot file: inspect-robot says what it holds, export-robot writes its arm for other software."""

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder, check_own_file
from compgen.cli.output_files.publish import publish, write_file
from compgen.cli.screen.messages import finding_rows, print_record, table_of
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text

RECORD, PICTURE = "robot.json", "zero.svg"


def inspect_robot(
    robot: opt.RobotArgument,
    *,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_inspect.")
    ] = None,
    screen: opt.FindingScreen,
) -> Outcome:
    """Show a robot file's reach, limits and poses, to compare with the data sheet and the pendant.

    Examples:
        cgen inspect-robot m20ia -o sheet
    """
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.files.robot_sheet import robot_sheet
    from compgen.report.robot_files import sheet_record, zero_svg

    arm = load_arm(robot)
    folder = opt.output_folder(f"{arm.robot.name}_inspect", output)
    run = Run(Command.INSPECT_ROBOT)
    check_folder(folder, run, record=RECORD, others=[PICTURE])
    sheet = robot_sheet(arm)
    record = sheet_record(sheet)
    files = {RECORD: json_text(record), PICTURE: zero_svg(sheet).encode()}
    publish(folder, {}, files, run=run)
    return Outcome(record=files[RECORD], shown=_shown(record, folder, list(files), verbose=screen.verbose))


def _shown(record: dict[str, Any], folder: Path, files: list[str], *, verbose: bool) -> Iterator[object]:
    """Lengths, reach, limits, the table to compare, and the files."""
    from compgen.core.pose import POSE_KEYS

    reach = record["wrist_reach_mm"]
    keys = ("lower_deg", "upper_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
    joints = [[joint["name"], *(f"{joint[k]:g}" for k in keys)] for joint in record["joints"]]
    poses = [
        [" ".join(f"{v:g}" for v in pose["joints_deg"]), *(f"{pose[k]:.3f}" for k in POSE_KEYS), pose["config"]]
        for pose in record["poses"]
    ]
    yield from (
        f"{record['inspected_robot']} ({record['file']})",
        f"wrist centre: {reach['inward']:.0f} to {reach['outward']:.0f} mm before the J1 axis, {reach['low']:.0f} to "
        f"{reach['high']:.0f} mm above World's origin; the pendant's J3 counts {record['pendant_J3']}",
        f"programs: {record['programs']}",
        table_of(("joint", "lower", "upper", "speed deg/s", "acceleration", "jerk"), joints),
        "drive there with tool 0 and World, and compare the position screen:",
        table_of(("J1 J2 J3 J4 J5 J6", *"XYZWPR", "CONFIG"), poses),
    )
    if any(abs(abs(pose["p_deg"]) - 90) < 0.01 for pose in record["poses"]):
        yield "at P = 90 or -90 only the sum of W and R is fixed: the pendant may share it out otherwise"
    yield from finding_rows(record["findings"], verbose=verbose)
    yield f"wrote {', '.join(files)} to {folder}"


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
    from compgen.pipelines.files.robot_sheet import export_arm
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
    return Outcome(record=record, lines=[*exported.words(), f"wrote {output}"])
