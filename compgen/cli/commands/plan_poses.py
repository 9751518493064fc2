"""The command that says which poses to measure."""

from typing import Annotated

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_planned_poses
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import print_record
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError

FARTHEST_MM = 1e5  # of what stands in a cell


def plan_poses(
    robot: opt.RobotArgument,
    count: Annotated[int, typer.Option("-n", help="How many poses.")] = 50,
    box: Annotated[
        str | None,
        typer.Option("--box", help="World box of the reflectors, 'x0 y0 z0 x1 y1 z1' in mm; default the reach."),
    ] = None,
    reflectors: Annotated[
        list[str] | None,
        typer.Option(
            "--reflector",
            help="In the flange, 'x y z' in mm, off the last axis; default '60 0 100'; repeatable.",
        ),
    ] = None,
    instrument: Annotated[
        str | None, typer.Option("--instrument", help="Where the instrument stands, World 'x y z' in mm.")
    ] = None,
    view: Annotated[float, typer.Option("--view", help="Widest angle at which reflectors are seen, deg.")] = 60.0,
    noise: Annotated[float, typer.Option("--noise", help="Of one measured coordinate, um.")] = 30.0,
    share: Annotated[float, typer.Option("--range", help="Share of each joint's range to use.")] = 0.9,
    reversals: Annotated[
        bool,
        typer.Option("--reversals/--no-reversals", help="Runs of small steps that tell how far play reaches."),
    ] = True,
    wait: Annotated[float, typer.Option("--wait", help="Seconds at each pose.")] = 3.0,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_poses.")] = None,
    date: opt.Date = DEFAULT_DATE,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Choose the poses that tell most of a robot's errors: a CSV, and a program that visits them."""
    import numpy as np

    from compgen.cli.commands.pose_plan_files import expected_csv, pose_plan_record, poses_csv, show_pose_plan
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.core.other_units import lengths_in_other_units
    from compgen.core.units import DEG, MM, UM
    from compgen.fanuc import program_name
    from compgen.fanuc.measuring_programs import measuring_program
    from compgen.identification import pose_planning
    from compgen.identification.model import build_model
    from compgen.identification.parameters import symbolic_sources
    from compgen.pipelines.files.robot_file import load_arm

    arm = load_arm(robot)
    folder = opt.output_folder(f"{arm.robot.name}_poses", output)
    program = program_name(f"{arm.robot.name}_poses", arm.robot.controller.name_length)
    turning = program_name(f"{arm.robot.name}_reversals", arm.robot.controller.name_length)
    check_planned_poses(folder, f"{program}.LS", f"{turning}.LS")
    reach = float(np.abs(arm.robot.a).sum() + np.abs(arm.robot.d).sum()) / MM
    box_mm = _numbers("--box", box, 6) if box is not None else [-reach] * 3 + [reach] * 3
    low, high = np.array(box_mm[:3]), np.array(box_mm[3:])
    if not (low < high).all():
        raise InputError(f"--box '{box}': each low corner must be below the high one: x0 y0 z0 x1 y1 z1")
    for name, value, smallest, largest in (
        ("--noise", noise, 0.1, 1e4),
        ("--range", share, 0.01, 1.0),
        ("--view", view, 1, 180),
    ):
        if not smallest <= value <= largest:
            raise InputError(f"{name} {value:g}: must be {smallest:g} to {largest:g}")
    reflectors_mm = np.array([_numbers("--reflector", r, 3) for r in reflectors or ["60 0 100"]])
    stand = None if instrument is None else np.array(_numbers("--instrument", instrument, 3)) * MM
    lengths = [("--reflector", r, _numbers("--reflector", r, 3)) for r in reflectors or []]
    lengths += [("--instrument", instrument, _numbers("--instrument", instrument, 3))] if instrument else []
    lengths += [("--box", box, box_mm)] if box else []
    corners, reflector = np.array([low, high]) * MM, reflectors_mm * MM
    site = pose_planning.Site(
        box=corners, reflector=reflector, instrument=stand, view=view * DEG, noise=noise * UM, share=share
    )
    parts = [
        p
        for p in symbolic_sources(arm.robot, arm.known, np.ones(6, dtype=bool), warm=False, facts=arm.facts)
        if p.original.NAME != "joint_ripple"
    ]
    model = build_model(arm.robot, parts, len(arm.nodes))
    use_cores(workers)
    with show_progress(quiet or as_json) as progress:
        plan = pose_planning.plan_poses(arm.robot, model, len(arm.nodes), site, count, progress)
    runs = pose_planning.plan_reversals(arm.robot, model, len(arm.nodes), site, plan) if reversals else []
    pendant = np.round(arm.robot.to_pendant(plan.theta) / DEG, 3)
    measuring = {f"{program}.LS": measuring_program(program, "poses to measure", checked_date(date), pendant, wait)}
    tables = {
        "poses.csv": poses_csv(pendant, [range(len(reflectors_mm))] * count),
        "expected.csv": expected_csv(model.parameters, plan),
    }
    if runs:
        turned = np.round(arm.robot.to_pendant(np.vstack([poses for poses, _ in runs])) / DEG, 3)
        targets = [[target] for poses, target in runs for _ in poses]
        text = measuring_program(turning, "reversal runs", checked_date(date), turned, wait)
        measuring[f"{turning}.LS"], tables["reversals.csv"] = text, poses_csv(turned, targets)
    files = {**measuring, **tables}
    publish(folder, measuring, tables, (f"{turning}.LS", "reversals.csv"))
    input_findings = [*arm.input_findings, *(f for given in lengths for f in lengths_in_other_units(*given))]
    if as_json:
        print_record(pose_plan_record(model.parameters, plan, len(runs), sorted(files), input_findings))
    elif not quiet:
        show_pose_plan(model.parameters, plan, len(runs), folder, sorted(files), input_findings)


def _numbers(option: str, text: str, count: int) -> list[float]:
    try:
        numbers = [float(v) for v in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(abs(v) <= FARTHEST_MM for v in numbers):
        raise InputError(f"{option} '{text}': expected {count} numbers in mm, none beyond {FARTHEST_MM:g}")
    return numbers
