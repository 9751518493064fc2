"""Commands on measurements of the arm itself: identify, validate."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_references
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.ownership import check_identified
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import print_error, print_record
from compgen.core.codes import Level
from compgen.core.exceptions import InputError
from compgen.core.files import POSTERIOR, file_hash
from compgen.core.findings import first_message
from compgen.core.json_text import json_text

Poses = Annotated[list[str] | None, typer.Option("--poses", help="CSV of joints and measured places; repeatable.")]
Temperatures = Annotated[str | None, typer.Option("--temperatures", help="CSV log of the air and any of the nodes.")]
ReferenceOption = Annotated[
    str,
    typer.Option(
        "--reference",
        autocompletion=complete_references,
        help="What rises in the log count from: start (cold), ambient, or degC.",
    ),
]
Distances = Annotated[
    list[str] | None,
    typer.Option("--distances", help="CSV of distances between measured places, or to a fixed one; repeatable."),
]
Touches = Annotated[list[str] | None, typer.Option("--touches", help="CSV of touched spheres; repeatable.")]
UserFrames = Annotated[
    str | None, typer.Option("--frames", help="Frames table or SYSFRAME.VA, for touches in a user frame.")
]
NOTHING = "--poses: missing; give at least one CSV of measured poses, or --distances, or --touches"


def identify(
    robot: opt.RobotArgument,
    poses: Poses = None,
    lines: Annotated[list[str] | None, typer.Option("--lines", help="CSV of axis tests; repeatable.")] = None,
    warm_up: Annotated[
        list[str] | None, typer.Option("--warm-up", help="CSV of poses measured while warming; repeatable.")
    ] = None,
    distances: Distances = None,
    touches: Touches = None,
    artefact: opt.ArtefactFile = None,
    frames: UserFrames = None,
    temperatures: Temperatures = None,
    reference: ReferenceOption = "start",
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/identify/<robot>.toml.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write the robot file even if the verdict is no.")] = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Fit the error sources of a robot to measurements, and judge the fit."""
    from compgen.cli.screen.identification_table import show_identification
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.identification import identify as identification
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure.identification_files import (
        MeasurementFiles,
        identified_texts,
        log_findings,
        read_measurements,
        robot_files_of,
    )
    from compgen.report.identification import identification_html, identification_summary
    from compgen.report.inputs import measured_inputs

    if not (poses or warm_up or distances or touches):
        raise InputError(NOTHING)
    check_options_used(touches, artefact, frames)
    files = MeasurementFiles(
        poses=poses or [],
        lines=lines or [],
        warm_up=warm_up or [],
        distances=distances or [],
        touches=touches or [],
        artefact=artefact,
        frames=frames,
        log=temperatures,
    )
    arm = load_arm(robot)
    target = opt.toml_file(output, Path("outputs") / "identify" / f"{arm.robot.name}.toml", "robot")
    check_names(target.parent, [target.with_suffix(suffix).name for suffix in (".html", ".json", POSTERIOR)])
    check_identified(target)
    use_cores(workers)
    options = page_options(target.parent, assets, date)
    measurements, of_log = read_measurements(arm, files, force=force, reference=reference)
    with show_progress(quiet or as_json) as progress:
        identified = identification.identify(
            arm.robot,
            arm.known,
            measurements,
            len(arm.nodes),
            progress,
            temperatures=temperatures is not None,
            facts=arm.facts,
        )
    identified = replace(
        identified, findings=(*identified.findings, *of_log, *log_findings(arm, identified), *arm.input_findings)
    )
    is_written = not identified.refused or force
    # a robot file that stands stays with its own reports
    stem = target.stem if is_written or not target.exists() else f"{target.stem}_refused"
    page, report = target.with_name(f"{stem}.html"), target.with_name(f"{stem}.json")
    inputs = measured_inputs(
        arm.robot.name,
        (arm.source, file_hash(arm.source)),
        [("measured", file, file_hash(file)) for file in files.names],
    )
    html = identification_html(identified, inputs, options)
    reports = {report.name: json_text(identification_summary(identified)), page.name: html}
    robot_files = {}
    if is_written:
        posterior = target.with_suffix(POSTERIOR).name
        text, of_posterior = identified_texts(arm, identified, files.names, posterior)
        robot_files = robot_files_of(target, text)
        reports[posterior] = of_posterior.encode()  # a report: gone before its robot file goes, there after it
    described = page_files(target.parent, reports, figures, options)
    publish(target.parent, robot_files, described)
    if as_json:
        print_record(reports[report.name])
    elif not quiet:
        show_identification(identified)
        robot_file = f", {target}" if is_written else ""
        sys.stdout.write(f"wrote {page}, {report}{robot_file}\n")
    if identified.refused:
        reason = first_message(Level.REFUSED, identified.findings)
        ending = "written all the same (--force)" if force else f"{target.name} not written; --force writes it"
        raise typer.Exit(print_error(f"refused: {reason}; {ending}", 1))


def validate(
    robot: opt.RobotArgument,
    poses: Poses = None,
    hot: Annotated[
        list[str] | None, typer.Option("--hot", help="CSV of poses of the warm arm, with --temperatures; repeatable.")
    ] = None,
    distances: Distances = None,
    touches: Touches = None,
    artefact: opt.ArtefactFile = None,
    frames: UserFrames = None,
    temperatures: Temperatures = None,
    reference: ReferenceOption = "start",
    refit: Annotated[
        bool, typer.Option("--refit-frames", help="Fit where the instrument stands and the reflectors sit.")
    ] = False,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Compare an identified robot with measurements it has not seen. Fits nothing but frames, and those when asked."""
    from compgen.cli.screen.identification_table import show_validation
    from compgen.identification import validation
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure.identification_files import MeasurementFiles, identified_frames, read_measurements
    from compgen.report.identification import validation_summary

    if not (poses or hot or distances or touches):
        raise InputError(NOTHING)
    check_options_used(touches, artefact, frames)
    bound = opt.checked_bound(max_um)
    use_cores(workers)
    if hot and temperatures is None:
        raise InputError("--hot: how warm the arm was must be known: give the log with --temperatures")
    arm = load_arm(robot)
    files = MeasurementFiles(
        poses=poses or [],
        lines=[],
        warm_up=hot or [],
        distances=distances or [],
        touches=touches or [],
        artefact=artefact,
        frames=frames,
        log=temperatures,
    )
    measurements, of_log = read_measurements(arm, files, force=True, reference=reference, frames_known=not refit)
    known_frames = None if refit else identified_frames(arm, measurements)
    result = validation.validate(arm.robot, arm.known, measurements, len(arm.nodes), known_frames, bound)
    result = replace(result, findings=(*result.findings, *of_log))
    summary = validation_summary(result)
    if as_json:
        print_record(summary)
    elif not quiet:
        show_validation(summary)
    if outside := first_message(Level.OUTSIDE, result.findings):
        raise typer.Exit(print_error(f"outside: {outside}", 1))


def check_options_used(touches: list[str] | None, artefact: str | None, frames: str | None) -> None:
    """Raises InputError where an option has nothing to act on."""
    for option, value in (("--artefact", artefact), ("--frames", frames)):
        if value is not None and not touches:
            raise InputError(f"{option} {value}: is for touches; give their CSV with --touches, or leave it out")
