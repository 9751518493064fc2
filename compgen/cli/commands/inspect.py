"""Commands that say what a file holds: inspect a program, inspect-robot a robot file."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_robots
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import print_findings, stdout_console
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.json_text import json_text

RECORD, PICTURE = "robot.json", "zero.svg"


def inspect(
    program: opt.ProgramFile,
    *,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            autocompletion=complete_robots,
            help="Robot name or file, for reach and limits; default: the one that the program names.",
        ),
    ] = None,
    tables: opt.ProgramTables,
    screen: opt.Screen,
) -> Outcome:
    """Say what a program is, and what makes correcting it unsafe. Changes nothing.

    Examples:
        cgen inspect JOB.LS --frames SYSFRAME.VA
        cgen inspect JOB.LS --robot m20ia --json
    """
    from compgen import fanuc
    from compgen.cli.screen.program_table import show_program
    from compgen.fanuc.analysis import inspection
    from compgen.fanuc.analysis.watermark import Mark
    from compgen.pipelines.correct.program_file import programs_beside, provenance_beside, read_program
    from compgen.pipelines.files.robot_file import load_robot, robot_named

    frames, registers = tables.read()
    content = read_program(program)
    with naming_file(program):
        whole = fanuc.loads(content)
        name = robot if robot is not None else robot_named(content)
        arm = load_robot(name) if name is not None else None
        report = inspection.inspect(whole, arm, frames, registers, programs_beside(Path(program)))
    if report["mark"] == Mark.NONE and provenance_beside(Path(program), content):
        report["mark"] = Mark.RECORD.value
    return Outcome(record={"command": Command.INSPECT, **report}, show=partial(show_program, report))


def inspect_robot(
    robot: opt.RobotArgument,
    *,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_inspect.")
    ] = None,
    screen: opt.Screen,
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
    return Outcome(record=files[RECORD], show=partial(_show, record, folder, list(files)))


def _show(record: dict[str, Any], folder: Path, files: list[str]) -> None:
    """Print lengths, reach, limits, the table to compare, and the files."""
    from rich.table import Table

    console = stdout_console()
    reach = record["wrist_reach_mm"]
    console.print(f"{record['inspected_robot']} ({record['file']})")
    console.print(
        f"wrist centre: {reach['inward']:.0f} to {reach['outward']:.0f} mm before the J1 axis, {reach['low']:.0f} to "
        f"{reach['high']:.0f} mm above World's origin; the pendant's J3 counts {record['pendant_J3']}"
    )
    console.print(f"programs: {record['programs']}")
    table = Table("joint", "lower", "upper", "speed deg/s", "acceleration", "jerk")
    for joint in record["joints"]:
        numbers = [joint[k] for k in ("lower_deg", "upper_deg", "speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")]
        table.add_row(joint["name"], *(f"{v:g}" for v in numbers))
    console.print(table)
    console.print("drive there with tool 0 and World, and compare the position screen:")
    table = Table("J1 J2 J3 J4 J5 J6", "X", "Y", "Z", "W", "P", "R", "CONFIG")
    for pose in record["poses"]:
        joints = " ".join(f"{v:g}" for v in pose["joints_deg"])
        cells = [f"{pose[k]:.3f}" for k in ("x_mm", "y_mm", "z_mm", "w_deg", "p_deg", "r_deg")]
        table.add_row(joints, *cells, pose["config"])
    console.print(table)
    if any(abs(abs(pose["p_deg"]) - 90) < 0.01 for pose in record["poses"]):
        console.print("at P = 90 or -90 only the sum of W and R is fixed: the pendant may share it out otherwise")
    print_findings(console, record["findings"])
    console.print(f"wrote {', '.join(files)} to {folder}")
