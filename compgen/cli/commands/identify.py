"""Commands on measurements of the arm itself: identify, check-robot."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import one_of
from compgen.cli.options.page_options import PageChoice, PageDate, PagePlace, page_place
from compgen.cli.output_files.figure_files import Content
from compgen.cli.output_files.ownership import IDENTIFIED, check_robot_files
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import finding_rows, outside_words, table_of
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.files import POSTERIOR, file_hash
from compgen.core.finding_codes import Level
from compgen.core.findings import first_message
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.identification.identify import Identification
    from compgen.pipelines.files.robot_file import Arm
    from compgen.pipelines.measure.identification_files import MeasurementFiles

MOST_PARAMETERS = 20  # that are printed, those that move the tool most first

Temperatures = Annotated[str | None, typer.Option("--temperatures", help="CSV log of the air and any of the nodes.")]
ReferenceOption = Annotated[
    str,
    typer.Option(
        "--reference",
        autocompletion=one_of("start", "ambient"),
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


@dataclass(frozen=True, slots=True)
class RobotFilePlace:
    """Where a robot file goes, and the reports that say what it was identified from."""

    file: Path
    place: PagePlace

    def put(
        self, robot_files: Mapping[str, bytes], record: bytes, html: Content, beside: Mapping[str, bytes] | None = None
    ) -> str:
        """Write a robot file with its reports, or the reports alone where there is none; returns what was written.

        Reports of none do not take the place of those of a robot file that stands.
        """
        stem = self.file.stem if robot_files or not self.file.exists() else f"{self.file.stem}_refused"
        reports = {f"{stem}.json": record, f"{stem}.html": html, **(beside or {})}
        publish(self.file.parent, robot_files, self.place.files(reports))
        names = [f"{stem}.html", f"{stem}.json", *([self.file.name] if robot_files else [])]
        return f"wrote {', '.join(str(self.file.with_name(name)) for name in names)}"


def robot_file_place(
    output: str | None, default: Path, command: Command, markers: Mapping[str, str], page: PageChoice, date: str | None
) -> RobotFilePlace:
    """Where a command's robot file goes; refused before any work where somebody else's file stands there.

    Args:
        output: As typed.
        default: Where it goes else.
        command: That writes it.
        markers: What tells its files, as ``check_robot_files`` takes it.
        page: What the page beside it is made with.
        date: Of that page.
    """
    file = opt.toml_file(output, default, "robot")
    check_names(file.parent, [file.with_suffix(suffix).name for suffix in (".html", ".json", *markers)])
    check_robot_files(file, command, markers)
    return RobotFilePlace(file, page_place(file.parent, page, date))


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
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Fit the error sources of a robot to measurements, and judge the fit.

    Examples:
        cgen identify m710ic50 --poses poses.csv -o mine.toml
        cgen identify m710ic50 --touches touches.csv --artefact artefact.toml -o mine.toml
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.measure import identification_files as pipeline

    files = measured.files(warm_up, lines)
    arm = pipeline.arm_to_identify(robot, files.log, measured.reference)
    default = Path("outputs") / "identify" / f"{arm.robot.name}.toml"
    target = robot_file_place(output, default, Command.IDENTIFY, IDENTIFIED, page, date)
    with show_progress(quiet=screen.is_silent) as progress:
        identified = pipeline.identify_files(arm, files, measured.reference, progress, force=force)
    return _publish(arm, identified, files.names, target, force=force, verbose=screen.verbose)


def _publish(
    arm: "Arm",
    identified: "Identification",
    sources: Sequence[str],
    target: RobotFilePlace,
    *,
    force: bool,
    verbose: bool,
) -> Outcome:
    """Write the robot file, unless the fit is refused, and its reports."""
    from compgen.pipelines.measure import identification_files as pipeline
    from compgen.report.identification import identification_html, identification_summary
    from compgen.report.inputs import measured_inputs

    files = [("measured", file, file_hash(file)) for file in sources]
    inputs = measured_inputs(arm.robot.name, (arm.source, file_hash(arm.source)), files)
    record = json_text(identification_summary(identified))
    html, robot_files, beside = identification_html(identified, inputs, target.place.options), {}, {}
    if not identified.refused or force:
        posterior = target.file.with_suffix(POSTERIOR).name
        text, of_posterior = pipeline.identified_texts(arm, identified, sources, posterior)
        robot_files = pipeline.robot_files_of(target.file, text)
        beside = {posterior: of_posterior.encode()}  # a report: gone before its robot file goes, there after it
    words = target.put(robot_files, record, html, beside)
    errors = []
    if identified.refused:
        ending = "written all the same (--force)" if force else f"{target.file.name} not written; --force writes it"
        errors.append(f"refused: {first_message(Level.REFUSED, identified.findings)}; {ending}")
    return Outcome(record=record, shown=identification_shown(identified, verbose=verbose), lines=[words], errors=errors)


def check_robot(
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
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Check an identified robot against measurements it has not seen. Fits nothing but frames, and those when asked.

    Examples:
        cgen check-robot mine.toml --poses other_poses.csv
        cgen check-robot mine.toml --poses other_poses.csv --hot warm.csv --temperatures log.csv --max-um 150
    """
    from compgen.identification import validation
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure.identification_files import identified_frames, read_measurements
    from compgen.report.identification import validation_summary

    files = measured.files(hot)
    bound = opt.bound_of(max_um)
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
    shown = validation_shown(summary, verbose=screen.verbose)
    return Outcome(record=summary, shown=shown, errors=[outside_words(result.findings)])


def identification_shown(identified: "Identification", *, verbose: bool) -> Iterator[object]:
    """The models tried, how well the joints were covered, the parameters, the findings and the verdict."""
    from compgen.report.identification import identification_summary, ladder_cells, limits_sentence

    summary = identification_summary(identified)
    ladder = [
        [f"{s['model']}{' <-' if s['model'] == summary['model'] else ''}", str(s["parameters"]), *ladder_cells(s)]
        for s in summary["ladder"]
    ]
    yield table_of(("model", "parameters", "effective", "held-out um", "95 %", "noise um"), ladder)
    if list(summary["kinds"]) != ["places"]:
        rows = (f"{k['rows']} {kind}, noise {k['noise_um']:.1f} um" for kind, k in summary["kinds"].items())
        yield f"measured: {'; '.join(rows)}"
    coverage = ", ".join(f"{joint} {100 * c['share']:.0f} %" for joint, c in summary["coverage"].items())
    known = sorted((p for p in summary["parameters"] if not p["held_by_prior"]), key=lambda p: -p["moves_um"])
    yield from (
        f"of each joint's range the poses use: {coverage}; condition of the fit {summary['condition']:.0f}",
        limits_sentence(summary),
        *(
            f"{p['name']} = {p['value']:.4g} +- {p['sigma']:.2g}, moves the tool by {p['moves_um']:.0f} um"
            for p in known[:MOST_PARAMETERS]
        ),
    )
    if len(known) > MOST_PARAMETERS:
        yield f"and {len(known) - MOST_PARAMETERS} more, see the report"
    yield from finding_rows(summary["findings"], verbose=verbose)
    yield f"verdict: {summary['verdict']}"


def validation_shown(summary: dict[str, Any], *, verbose: bool) -> list[object]:
    """The errors at each target, of the nominal and of the identified arm."""
    kinds = [*summary["targets"].items(), *summary["states"].items(), ("overall", summary["overall"])]
    if summary["set_aside"]:
        kinds.append(("all rows", summary["all_rows"]))
    rows = [
        [target, arm, str(errors["count"]), *(f"{errors[k]:.4f}" for k in ("mean", "rms", "p99", "max"))]
        for target, arms in kinds
        for arm, errors in arms.items()
    ]
    table = table_of(("target", "arm", "places", "mean mm", "rms mm", "p99 mm", "max mm"), rows)
    return [table, *finding_rows(summary["findings"], verbose=verbose)]
