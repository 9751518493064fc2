"""Commands on measurements of the arm itself: identify, validate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_references
from compgen.cli.options.page_options import PageChoice, PageDate, page_files, page_options
from compgen.cli.output_files.ownership import IDENTIFIED, check_robot_files
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import print_lines
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.files import POSTERIOR, file_hash
from compgen.core.findings import first_message
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.identification.identify import Identification
    from compgen.pipelines.files.robot_file import Arm
    from compgen.pipelines.measure.identification_files import MeasurementFiles
    from compgen.report.page import PageOptions

Temperatures = Annotated[str | None, typer.Option("--temperatures", help="CSV log of the air and any of the nodes.")]
ReferenceOption = Annotated[
    str,
    typer.Option(
        "--reference",
        autocompletion=complete_references,
        help="What rises in the log count from: start (cold), ambient, or degC.",
    ),
]
UserFrames = Annotated[
    str | None, typer.Option("--frames", help="Frames table or SYSFRAME.VA, for touches in a user frame.")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What was measured of an arm, whatever it is taken for."""

    poses: Annotated[
        list[str] | None, typer.Option("--poses", help="CSV of joints and measured places; repeatable.")
    ] = None
    distances: Annotated[
        list[str] | None,
        typer.Option("--distances", help="CSV of distances between measured places, or to a fixed one; repeatable."),
    ] = None
    touches: Annotated[list[str] | None, typer.Option("--touches", help="CSV of touched spheres; repeatable.")] = None
    artefact: opt.ArtefactFile = None
    frames: UserFrames = None
    temperatures: Temperatures = None
    reference: ReferenceOption = "start"

    def files(self, warm: Sequence[str] | None, lines: Sequence[str] | None = None) -> "MeasurementFiles":
        """The files by kind, with those of warming, or warm, poses and of axis tests.

        Raises:
            InputError: There are none, or an option has nothing to act on.
        """
        from compgen.pipelines.measure.identification_files import MeasurementFiles

        if not (self.poses or warm or self.distances or self.touches):
            raise InputError("--poses: missing; give at least one CSV of measured poses, or --distances, or --touches")
        for option, value in (("--artefact", self.artefact), ("--frames", self.frames)):
            if value is not None and not self.touches:
                raise InputError(f"{option} {value}: is for touches; give their CSV with --touches, or leave it out")
        return MeasurementFiles(
            poses=self.poses or [],
            lines=lines or [],
            warm_up=warm or [],
            distances=self.distances or [],
            touches=self.touches or [],
            artefact=self.artefact,
            frames=self.frames,
            log=self.temperatures,
        )


def identify(
    robot: opt.RobotArgument,
    *,
    measured: Measured,
    lines: Annotated[list[str] | None, typer.Option("--lines", help="CSV of axis tests; repeatable.")] = None,
    warm_up: Annotated[
        list[str] | None, typer.Option("--warm-up", help="CSV of poses measured while warming; repeatable.")
    ] = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/identify/<robot>.toml.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Write the robot file even if the verdict is no.")] = False,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Fit the error sources of a robot to measurements, and judge the fit.

    Examples:
        cgen identify m710ic50 --poses poses.csv -o mine.toml
        cgen identify m710ic50 --touches touches.csv --artefact artefact.toml -o mine.toml
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure import identification_files as pipeline

    files = measured.files(warm_up, lines)
    arm = load_arm(robot)
    target = opt.toml_file(output, Path("outputs") / "identify" / f"{arm.robot.name}.toml", "robot")
    check_names(target.parent, [target.with_suffix(suffix).name for suffix in (".html", ".json", POSTERIOR)])
    check_robot_files(target, Command.IDENTIFY, IDENTIFIED)
    use_cores(workers)
    options = page_options(target.parent, page, date)
    with show_progress(quiet=screen.is_silent) as progress:
        identified = pipeline.identify_files(arm, files, measured.reference, progress, force=force)
    return _publish(arm, identified, files.names, target, force=force, page=page, options=options)


def _publish(
    arm: "Arm",
    identified: "Identification",
    sources: Sequence[str],
    target: Path,
    *,
    force: bool,
    page: PageChoice,
    options: "PageOptions",
) -> Outcome:
    """Write the robot file, unless the fit is refused, and its reports."""
    from compgen.pipelines.measure import identification_files as pipeline
    from compgen.report.identification import identification_html, identification_summary
    from compgen.report.inputs import measured_inputs

    is_written = not identified.refused or force
    files = [("measured", file, file_hash(file)) for file in sources]
    inputs = measured_inputs(arm.robot.name, (arm.source, file_hash(arm.source)), files)
    names = ReportNames.beside(target, is_written=is_written)
    record = json_text(identification_summary(identified))
    reports = {names.record: record, names.page: identification_html(identified, inputs, options)}
    robot_files = {}
    if is_written:
        posterior = target.with_suffix(POSTERIOR).name
        text, of_posterior = pipeline.identified_texts(arm, identified, sources, posterior)
        robot_files = pipeline.robot_files_of(target, text)
        reports[posterior] = of_posterior.encode()  # a report: gone before its robot file goes, there after it
    publish(target.parent, robot_files, page_files(target.parent, reports, page, options))
    errors = []
    if identified.refused:
        ending = "written all the same (--force)" if force else f"{target.name} not written; --force writes it"
        errors.append(f"refused: {first_message(Level.REFUSED, identified.findings)}; {ending}")
    show = partial(_show, identified, names.words(target, is_written=is_written))
    return Outcome(record=record, show=show, errors=errors)


def _show(identified: "Identification", words: str) -> None:
    """Print the fit, and what was written."""
    from compgen.cli.screen.identification_table import show_identification

    show_identification(identified)
    print_lines([words])


@dataclass(frozen=True, slots=True)
class ReportNames:
    """The files that say what a robot file was identified from."""

    record: str
    page: str

    @classmethod
    def beside(cls, target: Path, *, is_written: bool) -> "ReportNames":
        """Those of a robot file; one that stands, where none is written, stays with its own."""
        stem = target.stem if is_written or not target.exists() else f"{target.stem}_refused"
        return cls(f"{stem}.json", f"{stem}.html")

    def words(self, target: Path, *, is_written: bool) -> str:
        """What was written."""
        files = [target.with_name(self.page), target.with_name(self.record), *([target] if is_written else [])]
        return f"wrote {', '.join(map(str, files))}"


def validate(
    robot: opt.RobotArgument,
    *,
    measured: Measured,
    hot: Annotated[
        list[str] | None, typer.Option("--hot", help="CSV of poses of the warm arm, with --temperatures; repeatable.")
    ] = None,
    refit: Annotated[
        bool, typer.Option("--refit-frames", help="Fit where the instrument stands and the reflectors sit.")
    ] = False,
    max_um: opt.MaxUm = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Compare an identified robot with measurements it has not seen. Fits nothing but frames, and those when asked.

    Examples:
        cgen validate mine.toml --poses other_poses.csv
        cgen validate mine.toml --poses other_poses.csv --hot warm.csv --temperatures log.csv --max-um 150
    """
    from compgen.cli.screen.identification_table import show_validation
    from compgen.identification import validation
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure.identification_files import identified_frames, read_measurements
    from compgen.report.identification import validation_summary

    files = measured.files(hot)
    bound = opt.checked_bound(max_um)
    use_cores(workers)
    if hot and files.log is None:
        raise InputError("--hot: how warm the arm was must be known: give the log with --temperatures")
    arm = load_arm(robot)
    measurements, of_log = read_measurements(
        arm, files, force=True, reference=measured.reference, frames_known=not refit
    )
    known_frames = None if refit else identified_frames(arm, measurements)
    result = validation.validate(arm.robot, arm.known, measurements, len(arm.nodes), known_frames, bound)
    result = replace(result, findings=(*result.findings, *of_log))
    summary = validation_summary(result)
    outside = first_message(Level.OUTSIDE, result.findings)
    return Outcome(
        record=summary, show=partial(show_validation, summary), errors=[f"outside: {outside}"] if outside else []
    )
