"""Commands on measurements of the arm itself: identify, validate."""

import json
import sys
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from compgen.cli import publish
from compgen.cli.app import Quiet, app, say_error, write_file
from compgen.cli.progress_bar import stages
from compgen.core.csv_table import quote_cell
from compgen.core.exceptions import InputError
from compgen.core.findings import Level
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM
from compgen.identification.axis_tests import read_lines
from compgen.identification.frames import InstrumentFrames
from compgen.identification.identify import Identified
from compgen.identification.identify import identify as identify_arm
from compgen.identification.measurements import Measurements, joined
from compgen.identification.pose_files import read_poses
from compgen.identification.robot_file import robot_text
from compgen.identification.validation import validate as validate_arm
from compgen.identification.warm_up import as_warm_up, with_temperatures
from compgen.pipelines.robot_file import Arm, arm_of, load_arm
from compgen.report.identification_page import identification_html
from compgen.report.identification_summary import identification_json, identification_summary, validation_summary

RobotArgument = Annotated[str, typer.Argument(help="Robot name or file.", show_default=False)]
Poses = Annotated[list[str] | None, typer.Option("--poses", help="CSV of joints and measured places; repeatable.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


@app.command(context_settings={"allow_extra_args": False})
def identify(
    robot: RobotArgument,
    poses: Poses = None,
    lines: Annotated[list[str] | None, typer.Option("--lines", help="CSV of axis tests; repeatable.")] = None,
    warm_up: Annotated[
        list[str] | None, typer.Option("--warm-up", help="CSV of poses measured while warming; repeatable.")
    ] = None,
    temperatures: Annotated[str | None, typer.Option("--temperatures", help="CSV log of the nodes.")] = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/identify/<robot>.toml.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write the robot file even if the verdict is no.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the error sources of a robot to measurements, and judge the fit."""
    if not poses and not warm_up:
        raise InputError("--poses: missing; give at least one CSV of measured poses")
    arm = load_arm(robot)
    target = Path(output) if output is not None else Path("outputs") / "identify" / f"{arm.robot.name}.toml"
    if target.suffix != ".toml" or target.is_dir():
        raise InputError(f"-o {target}: not the name of a robot file; give one that ends in .toml")
    publish.check_writable(target.absolute().parent)
    data = _measurements(arm, poses or [], lines or [], warm_up or [], temperatures, force)
    with stages(quiet or as_json) as progress:
        found = identify_arm(arm.robot, arm.known, data, len(arm.nodes), temperatures is not None, progress)
    files = [*(poses or []), *(lines or []), *(warm_up or []), *([temperatures] if temperatures else [])]
    page, report = target.with_suffix(".html"), target.with_suffix(".json")
    target.parent.mkdir(parents=True, exist_ok=True)
    write_file(page, identification_html(found))
    write_file(report, identification_json(found))
    if not found.refused or force:
        write_file(target, _text(arm, found, files).encode())
    if as_json:
        sys.stdout.write(identification_json(found).decode())
    elif not quiet:
        _show(found)
        sys.stdout.write(f"wrote {page}, {report}" + ("" if found.refused and not force else f", {target}") + "\n")
    if found.refused:
        worst = next(f.message for f in found.findings if f.level is Level.REFUSED)
        told = "written all the same (--force)" if force else f"{target.name} not written; --force writes it"
        raise typer.Exit(say_error(f"refused: {worst}; {told}", 1))


@app.command()
def validate(
    robot: RobotArgument,
    poses: Poses = None,
    refit: Annotated[
        bool, typer.Option("--refit-frames", help="Fit where the instrument stands and the reflectors sit.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Compare an identified robot with measurements it has not seen. Fits nothing but frames, and those when asked."""
    if not poses:
        raise InputError("--poses: missing; give at least one CSV of measured poses")
    arm = load_arm(robot)
    parts = [read_poses(p, arm.robot, len(arm.nodes), force=True) for p in poses]
    data = joined(parts)
    found = validate_arm(arm.robot, arm.known, data, len(arm.nodes), None if refit else _frames(arm, data))
    told = validation_summary(found)
    if as_json:
        sys.stdout.write(json.dumps(told, indent=2, allow_nan=False) + "\n")
        return
    console = Console(width=None if sys.stdout.isatty() else 100)
    table = Table("target", "arm", "places", "mean mm", "rms mm", "p99 mm", "max mm")
    for name, sides in (*told["targets"].items(), ("overall", told["overall"])):
        for side, s in sides.items():
            table.add_row(name, side, str(s["count"]), *(f"{s[k]:.4f}" for k in ("mean", "rms", "p99", "max")))
    console.print(table)


def _measurements(
    arm: Arm, poses: Sequence[str], lines: Sequence[str], warm_up: Sequence[str], log: str | None, force: bool
) -> Measurements:
    nodes = len(arm.nodes)
    parts = [read_poses(p, arm.robot, nodes, force or len(poses) + len(warm_up) > 1) for p in poses]
    warm = [read_poses(p, arm.robot, nodes, True) for p in warm_up]
    if log is not None:
        timed = warm or parts
        timed = [with_temperatures(p, log, arm.nodes) for p in timed]
        parts, warm = (parts, timed) if warm else (timed, [])
    elif warm:
        warm = [as_warm_up(p) for p in warm]
    return joined([*parts, *warm, *(read_lines(f, arm.robot, nodes) for f in lines)])


def _frames(arm: Arm, data: Measurements) -> InstrumentFrames:
    """Frames as the robot file has them."""
    told = arm.identified
    if told is None:
        raise InputError(
            f"{arm.source}: identified: missing, it says where instrument and reflectors are; --refit-frames fits them"
        )
    lost = next((r for r in data.reflectors if r not in told.reflector_mm), None)
    if lost is not None:
        known = ", ".join(told.reflector_mm)
        raise InputError(
            f"{data.instruments[0]}: target {quote_cell(lost, 'of a row')} is not in {arm.source} (known: {known}); "
            "--refit-frames fits its place"
        )
    count = len(data.instruments)
    rotation = rotation_matrix(np.array([told.instrument_deg]) * DEG)
    return InstrumentFrames(
        np.repeat(rotation, count, axis=0),
        np.tile(np.array(told.instrument_mm) * MM, (count, 1)),
        np.array([told.reflector_mm[r] for r in data.reflectors]) * MM,
    )


def _text(arm: Arm, found: Identified, files: Sequence[str]) -> str:
    marks = ", ".join(f"{Path(f).name} ({sha256(Path(f).read_bytes()).hexdigest()[:12]})" for f in files)
    told = f"{len(found.data.theta)} poses, model '{found.chosen.candidate.name}', from {marks}"
    known = [replace(k, provenance=told) if k.sigma else k for k in found.known]
    text = robot_text(arm.text, arm.robot, known, found.box, told[:380], found.record())
    arm_of(tomllib.loads(text), text, arm.source)  # a file that would not load is refused here
    return text


def _show(found: Identified) -> None:
    told = identification_summary(found)
    console = Console(width=None if sys.stdout.isatty() else 100, highlight=False, markup=False)
    table = Table("model", "parameters", "effective", "held-out um", "95 %", "noise um")
    for s in told["ladder"]:
        h = s["held_out_um"]
        mark = " <-" if s["model"] == told["model"] else ""
        table.add_row(
            s["model"] + mark, str(s["parameters"]), f"{s['effective']:.1f}", f"{h['mean']:.1f}",
            f"{h['low']:.1f} to {h['high']:.1f}", f"{s['noise_um']:.1f}",
        )  # fmt: skip
    console.print(table)
    share = ", ".join(f"{k} {100 * v['share']:.0f} %" for k, v in told["coverage"].items())
    console.print(f"condition {told['condition']}; coverage of the joints: {share}")
    known = sorted((p for p in told["parameters"] if not p["held_by_prior"]), key=lambda p: -p["told"])
    for p in known[:20]:
        console.print(f"{p['name']} = {p['value']:.4g} +- {p['sigma']:.2g}")
    if len(known) > 20:
        console.print(f"and {len(known) - 20} more, see the report")
    for f in told["findings"]:
        console.print(f"{f['level']}: {f['message']}")
    console.print(f"verdict: {told['verdict']}")
