"""The command that says which spheres to touch, and from where, to know best where a path will be."""

import re
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_planned_touches
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.console import print_findings, stdout_console
from compgen.cli.screen.messages import print_record
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text

CONDITION = re.compile(r"(?:DI|RI|UI|SI|WI|F|M)\[[1-9][0-9]{0,4}\]=(?:ON|OFF)")
RECORD, TABLE = "plan.json", "touches.csv"


def plan_touches(
    path: opt.PathFile,
    artefact: Annotated[str | None, typer.Option("--artefact", help="TOML of spheres and probe.")] = None,
    count: Annotated[int, typer.Option("-n", help="How many touches.")] = 8,
    centres: Annotated[
        bool, typer.Option("--centres", help="Each touch locates a sphere's centre (a nest, a centring probe).")
    ] = False,
    stops: Annotated[
        bool, typer.Option("--stops", help="The program pauses at each touch, for reading by hand.")
    ] = False,
    skip: Annotated[
        str, typer.Option("--skip", help="Signal that ends a search, as SKIP CONDITION has it.")
    ] = "DI[1]=ON",
    register: Annotated[int, typer.Option("--pr", help="First position register that keeps a touch.")] = 1,
    utool: Annotated[int, typer.Option("--utool", help="Number of the probe's tool on the controller.")] = 9,
    sigma: Annotated[float, typer.Option("--sigma", help="Of one coordinate of a touch, um.")] = 12.0,
    clearance: Annotated[float, typer.Option("--clearance", help="From where a search begins, mm before it.")] = 20.0,
    beyond: Annotated[
        float, typer.Option("--beyond", help="How far a search may go behind the planned touch, mm.")
    ] = 3.0,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    log: Annotated[str | None, typer.Option("--log", help="Temperature log in place of [[before]].")] = None,
    reference: opt.LogReference = None,
    frames: opt.FramesFile = None,
    robot: opt.JobRobot = None,
    overrides: opt.Overrides = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder; default outputs/<path name>_touches.")
    ] = None,
    as_json: opt.Json = False,
    date: opt.Date = DEFAULT_DATE,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Choose the touches that tell most of where a path will be: a CSV to fill in, and a program that touches."""
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.core.units import MM, UM
    from compgen.fanuc import program_name
    from compgen.fanuc.measuring_programs import Signal
    from compgen.identification.touch_candidates import Search
    from compgen.identification.touches import read_artefact
    from compgen.pipelines.anchor.files import log_overrides
    from compgen.pipelines.anchor.touch_model import frame_of_artefact
    from compgen.pipelines.anchor.touch_plan import plan_path_touches, positions_of, write_touches
    from compgen.pipelines.files.path_file import load_job
    from compgen.report.touch_plan import touch_record, touches_csv

    if artefact is None:
        raise InputError("--artefact: missing; give the TOML of spheres and probe")
    _check_numbers(
        ("--sigma", sigma, 0.1, 1e4), ("--clearance", clearance, 1, 500), ("--beyond", beyond, 0.1, 50),
        ("--utool", utool, 1, 29), ("--pr", register, 1, 9999),
    )  # fmt: skip
    signal = None if stops or centres else Signal(_condition(skip), register)
    folder = opt.output_folder(path, output, "_touches")
    if log is not None and state is not None:
        raise InputError("--log: a state stands in place of history and log; leave --log or --state out")
    given = [*opt.with_state(path, overrides, state, state_age), *log_overrides(path, log, reference)]
    job = load_job(path, robot, given)
    name = program_name(f"{job.name}_touches", job.robot.controller.name_length)
    check_planned_touches(folder, f"{name}.LS", RECORD, TABLE)
    spheres = read_artefact(artefact)
    frame = frame_of_artefact(spheres, job.frame, frames)
    use_cores(workers)
    with show_progress(quiet or as_json) as progress:
        search = Search(clearance * MM, beyond * MM, centres=centres)
        planned = plan_path_touches(
            job, spheres, frame, count=count, sigma=sigma * UM, search=search, progress=progress
        )
    text = write_touches(planned, name, checked_date(date), utool, signal)
    touches = positions_of(planned, utool, stops=signal is None)
    record = touch_record(planned, touches, signal)
    reports = {RECORD: json_text(record), TABLE: touches_csv(planned, touches, stops=signal is None)}
    publish(folder, {f"{name}.LS": text}, reports)
    if as_json:
        print_record(reports[RECORD])
    elif not quiet:
        _show(record, folder, [f"{name}.LS", *reports])


def _check_numbers(*given: tuple[str, float, float, float]) -> None:
    for option, value, least, most in given:
        if not least <= value <= most:
            raise InputError(f"{option} {value:g}: must be {least:g} to {most:g}")


def _condition(text: str) -> str:
    plain = text.replace(" ", "").upper()
    if not CONDITION.fullmatch(plain):
        raise InputError(f"--skip {text[:40]!r}: no condition of a signal; give one such as 'DI[1]=ON' or 'RI[2]=OFF'")
    return plain


def _show(record: dict[str, Any], folder: Path, files: list[str]) -> None:
    """Print the touches, what each gains, and the files."""
    from rich.table import Table

    console = stdout_console()
    table = Table("touch", "target", "probe moves along (World)", "leaves rms, um", "gain")
    for n, touch in enumerate(record["touches"], 1):
        normal = touch["normal"]
        along = "to its centre" if normal is None else "  ".join(f"{round(v, 2) + 0.0:5.2f}" for v in normal)
        table.add_row(str(n), touch["target"], along, f"{touch['rms_um']:.1f}", f"{100 * touch['gain']:.0f} %")
    console.print(table)
    before, after, n = record["before"], record["after"], record["planned_touches"]
    by_anchoring = record["by_anchoring_rms_um"]
    expected = "" if by_anchoring is None else f" (cgen anchor will leave {by_anchoring:.1f} um rms)"
    console.print(
        f"what is not known of the path's place (standard deviation): {before['rms_um']:.1f} um rms, "
        f"{before['p99_um']:.1f} um p99; after {n} touches {after['rms_um']:.1f} and {after['p99_um']:.1f} um"
        f"{expected}; one more gains {100 * record['one_more']['gain']:.0f} %"
    )
    print_findings(console, record["findings"])
    console.print(f"wrote {', '.join(files)} to {folder}")
