"""The command that says which poses to measure."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from compgen.cli import publish
from compgen.cli.app import Date, Quiet, app, checked_date, output_folder
from compgen.cli.progress_bar import stages
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM, UM
from compgen.fanuc import program_name
from compgen.fanuc.measuring_program import visit
from compgen.identification.model import Term, build_model
from compgen.identification.parameters import parts_of
from compgen.identification.pose_planning import PosePlan, Site
from compgen.identification.pose_planning import plan as plan_arm
from compgen.pipelines.program_text import DATE
from compgen.pipelines.robot_file import load_arm


@app.command("plan-poses")
def plan_poses(
    robot: Annotated[str, typer.Argument(help="Robot name or file.", show_default=False)],
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
    wait: Annotated[float, typer.Option("--wait", help="Seconds at each pose.")] = 3.0,
    output: Annotated[str | None, typer.Option("-o", "--output", help="Folder; default outputs/<robot>_poses.")] = None,
    date: Date = DATE,
    quiet: Quiet = False,
) -> None:
    """Choose the poses that tell most of a robot's errors: a CSV, and a program that visits them."""
    arm = load_arm(robot)
    folder = output_folder(f"{arm.robot.name}_poses", output)
    reach = float(np.abs(arm.robot.a).sum() + np.abs(arm.robot.d).sum()) / MM
    corners = _numbers("--box", box, 6) if box is not None else np.array([-reach, -reach, -reach, reach, reach, reach])
    low, high = corners[:3], corners[3:]
    if not (low < high).all():
        raise InputError(f"--box '{box}': each low corner must be below the high one: x0 y0 z0 x1 y1 z1")
    for name, value, least, most in (
        ("--noise", noise, 0.1, 1e4),
        ("--range", share, 0.01, 1.0),
        ("--view", view, 1, 180),
    ):
        if not least <= value <= most:
            raise InputError(f"{name} {value:g}: must be {least:g} to {most:g}")
    places = np.array([_numbers("--reflector", r, 3) for r in reflectors or ["60 0 100"]])
    site = Site(
        np.array([low, high]) * MM, places * MM,
        None if instrument is None else _numbers("--instrument", instrument, 3) * MM, view * DEG, noise * UM, share,
    )  # fmt: skip
    parts = [
        p for p in parts_of(arm.robot, arm.known, np.ones(6, dtype=bool), False) if p.before.NAME != "joint_ripple"
    ]
    model = build_model(arm.robot, parts, len(arm.nodes))
    with stages(quiet) as progress:
        found = plan_arm(arm.robot, model, len(arm.nodes), site, count, progress)
    pendant = np.round(arm.robot.to_pendant(found.theta) / DEG, 3)
    name = program_name(f"{arm.robot.name}_poses", arm.robot.controller.name_length)
    files = {
        "poses.csv": _csv(pendant, len(places)),
        "expected.csv": _expected(model.terms, found),
        f"{name}.LS": visit(name, "poses to measure", checked_date(date), pendant, wait),
    }
    publish.publish(folder, files, set(files))
    if not quiet:
        _show(model.terms, found, folder, sorted(files))


def _numbers(option: str, text: str, count: int) -> np.ndarray:
    try:
        found = np.array([float(v) for v in text.replace(",", " ").split()])
    except ValueError:
        found = np.zeros(0)
    if len(found) != count or not np.isfinite(found).all():
        raise InputError(f"{option} '{text}': expected {count} numbers in mm")
    return found


def _csv(pendant: np.ndarray, reflectors: int) -> bytes:
    """The poses as identify reads them, the measured columns left to fill in."""
    lines = ["order,target,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm"]
    for n, row in enumerate(pendant):
        joints = ",".join(f"{v:.3f}" for v in row)
        lines += [f"{n},r{r + 1},{joints},,," for r in range(reflectors)]
    return ("\n".join(lines) + "\n").encode()


def _expected(terms: Sequence[Term], found: PosePlan) -> bytes:
    lines = ["parameter,prior_sigma,expected_sigma"]
    for term, prior, sigma in zip(terms, found.prior, found.sigma):
        name = f'"{term.name}"' if "," in term.name else term.name
        lines.append(f"{name},{prior / term.unit:.6g},{sigma / term.unit:.6g}")
    return ("\n".join(lines) + "\n").encode()


def _show(terms: Sequence[Term], found: PosePlan, folder: Path, files: list[str]) -> None:
    console = Console(width=None if sys.stdout.isatty() else 100, highlight=False, markup=False)
    table = Table("parameter", "sigma before", "expected after", "known")
    for term, prior, sigma in zip(terms, found.prior, found.sigma):
        known = 100 * (1 - (sigma / prior) ** 2)
        table.add_row(term.name, f"{prior / term.unit:.4g}", f"{sigma / term.unit:.4g}", f"{known:.0f} %")
    console.print(table)
    console.print(f"{len(found.theta)} poses; wrote {', '.join(files)} to {folder}")
