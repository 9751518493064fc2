"""The command that writes the program whose log tells how the controller smooths."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import Headed, check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import print_lines
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError
from compgen.core.units import MINUTE, MM

SHARE = 0.6  # of the reach, where the figures stand
FARTHEST_MM = 1e4  # of a centre, in World


def plan_motion_log(
    robot: opt.RobotArgument,
    *,
    centre: Annotated[
        str | None,
        typer.Option(
            "--centre", help="Of its figures, World 'x y z' in mm; default in front of J2, at 0.6 of the reach."
        ),
    ] = None,
    size: Annotated[float, typer.Option("--size", callback=opt.in_range(20, 2000), help="Of its figures, mm.")] = 300.0,
    speed: Annotated[
        float, typer.Option("--speed", callback=opt.in_range(2, 1500), help="The higher of its two speeds, mm/s.")
    ] = 200.0,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_motion_log.")
    ] = None,
    date: opt.Date = DEFAULT_DATE,
    screen: opt.Screen,
) -> Outcome:
    """Write a program of three minutes whose log tells identify-motion all that it fits.

    Examples:
        cgen plan-motion-log m710ic50 --centre '1300 0 600' -o motion_log
    """
    import numpy as np

    from compgen.identification.motion.log_program import least_size, motion_log_program
    from compgen.pipelines.files.robot_file import load_robot
    from compgen.pipelines.planned.delivery import deliver_file
    from compgen.program.program import program_name

    arm = load_robot(robot)
    folder, run = opt.output_folder(f"{arm.name}_motion_log", output), Run(Command.PLAN_MOTION_LOG, arm.name)
    name = program_name(f"{arm.name}_motion", arm.controller.name_length)
    file = f"{name}.LS"
    check_folder(folder, run, headed=[Headed(program=file, header='= "motion log"')])
    least = least_size(speed * MM) / MM
    if size < least:
        raise InputError(
            f"--size {size:g}: corners would run into each other at {speed:g} mm/s; give --size "
            f"{np.ceil(least):.0f} or more, or a lower --speed"
        )
    place = np.array([SHARE * float(np.abs(arm.a).sum() + np.abs(arm.d).sum()), 0.0, 0.0])
    if centre is not None:
        place = opt.typed_numbers("--centre", centre, 3, FARTHEST_MM) * MM
    program = motion_log_program(arm, name, checked_date(date), place, size * MM, speed * MM)
    minutes = float((program.lengths() / program.speed).sum()) / MINUTE
    publish(folder, dict(deliver_file(program).files), {}, run=run)
    record = {
        "command": Command.PLAN_MOTION_LOG,
        "positions": len(program.position),
        "size_mm": size,
        "centre_mm": np.round(place / MM, 3).tolist(),
        "minutes": round(minutes, 1),
        "files": [file],
    }
    return Outcome(record=record, show=partial(print_lines, _lines(record, folder / file, robot)))


def _lines(record: dict[str, Any], program: Path, robot: str) -> list[str]:
    """What was written, and what to do with it."""
    x, y, z = record["centre_mm"]
    return [
        f"{record['positions']} positions, some {record['minutes']:.1f} minutes at 100 % override, "
        f"{record['size_mm']:g} mm around X {x:.0f} Y {y:.0f} Z {z:.0f} mm in World, the flange down, tool 0: drive it "
        "slowly first",
        "log positions every 8 ms while it runs at 100 %, then:",
        f"  cgen identify-motion {program} --log LOG.csv --robot {robot}",
        f"wrote {program.name} to {program.parent}",
    ]
