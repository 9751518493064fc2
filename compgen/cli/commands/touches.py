"""Commands on touches: anchor says what the robot is now, teach-frame where a part stands."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.commands.identify import ReferenceOption, Temperatures, UserFrames
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PageDate, PagePlace, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder, check_own_file
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core.commands import Command
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.pipelines.anchor import Anchored

PAGE, RECORD = "anchor.html", "anchor.json"

TouchesLog = Annotated[
    str | None, typer.Option("--log", help="Temperature log on the touches' clock, in place of [[before]].")
]
StateOutput = Annotated[
    str | None, typer.Option("-o", "--output", help="The state's file; default outputs/<path name>_anchor/state.toml.")
]
PageFolder = Annotated[str | None, typer.Option("--html", help="Folder for a page and its record.")]
FrameOutput = Annotated[
    str | None,
    typer.Option("-o", "--output", help="The frame's file; default outputs/frames/<robot>_<number>.toml."),
]


def anchor(
    path: opt.PathFile,
    *,
    touches: opt.TouchesFile = None,
    artefact: opt.ArtefactFile = None,
    log: TouchesLog = None,
    reference: opt.LogReference = None,
    output: StateOutput = None,
    html: PageFolder = None,
    frames: opt.FramesFile = None,
    robot: opt.JobRobot = None,
    overrides: opt.Overrides = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Say what the robot is now, from a few touches: a state for --state, with a verdict.

    Examples:
        cgen anchor paths/spiral_1300.toml --touches touches.csv --artefact artefact.toml -o state.toml
        cgen anchor paths/spiral_1300.toml --touches touches.csv --log temperatures.csv --json
    """
    from compgen.pipelines.anchor.anchor import anchor_files

    touches = opt.given("--touches", touches, "the CSV of touches")
    target = opt.toml_file(output, Path("outputs") / f"{Path(path).stem}_anchor" / "state.toml", "state's")
    check_own_file("-o", str(target), "as cgen anchor wrote it", Command.ANCHOR)
    place = None if html is None else page_place(opt.output_folder(path, html), page, date)
    if place is not None:
        check_folder(place.folder, Run(Command.ANCHOR), record=RECORD, others=[PAGE], option="--html")
    result = anchor_files(
        path, robot, overrides or (), touches=touches, artefact=artefact, log=log, reference=reference, frames=frames
    )
    return _publish(result, target, place, verbose=screen.verbose)


def _publish(result: "Anchored", target: Path, place: PagePlace | None, *, verbose: bool) -> Outcome:
    """Write the state, where it can be used, and the page that is asked for."""
    from compgen.error_model.anchored_state import ACCEPTED, state_text
    from compgen.report.anchor import anchor_html, anchor_record

    record, files = json_text(anchor_record(result)), []
    if result.verdict in ACCEPTED:
        publish(target.parent, {target.name: state_text(result.state).encode()}, {})
        files.append(str(target))
    if place is not None:
        reports = place.files({RECORD: record, PAGE: anchor_html(result, place.options)})
        publish(place.folder, {}, reports, run=Run(Command.ANCHOR))
        files.append(str(place.folder / PAGE))
    errors = []
    if result.verdict in ("cannot tell", "something moved"):
        ending = f"{target} written" if result.verdict in ACCEPTED else f"{target.name} not written"
        errors = [f"{result.findings[0].message}; {ending}"]
    return Outcome(record=record, show=partial(_show, result, files, verbose=verbose), errors=errors)


def _show(result: "Anchored", files: list[str], *, verbose: bool) -> None:
    """Print the verdict, the state, and what a user must know."""
    from compgen.core.units import UM, limit_words

    state, (before, after) = result.state, result.rms
    K, sigma = len(state.nodes), state.sigma
    rises = ", ".join(
        f"{name} {rise:.1f} +- {2 * s:.1f} (forecast {was:.1f})"
        for name, rise, s, was in zip(
            state.nodes, state.rise.tolist(), sigma[:K].tolist(), result.forecast.rise.tolist(), strict=True
        )
    )
    base = ", ".join(f"{a} {v / UM:.0f}" for a, v in zip("xyz", state.base[:3].tolist(), strict=True))
    print_lines(
        [
            f"{state.verdict}: {result.reason}",
            f"the path's place is open by {before / UM:.1f} um rms before the touches, {after / UM:.1f} um after",
            f"rise [K], k = 2: {rises}",
            f"base moved in World by {base} um; the state holds {limit_words(state.window)}, standing",
            *finding_lines(result.findings[1:], verbose=verbose),
            *([f"wrote {', '.join(files)}"] if files else []),
        ]
    )


def teach_frame(
    robot: opt.RobotArgument,
    *,
    touches: opt.TouchesFile = None,
    artefact: opt.ArtefactFile = None,
    temperatures: Temperatures = None,
    reference: ReferenceOption = "start",
    number: Annotated[int, typer.Option("--number", help="UFRAME number.", min=1, max=9)] = 1,
    frames: UserFrames = None,
    nominal: Annotated[bool, typer.Option("--nominal", help="As the pendant would: without the model.")] = False,
    output: FrameOutput = None,
    screen: opt.FindingScreen,
) -> Outcome:
    """Compute a part's user frame from spheres that the identified, warm arm has touched.

    Examples:
        cgen teach-frame mine.toml --touches touches.csv --artefact artefact.toml
    """
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure import teach_frame as teaching
    from compgen.pipelines.measure.fitted_law import rise_reference
    from compgen.pipelines.measure.identification_files import artefact_of_touches
    from compgen.program.frames import default_frames, load_frames

    touches = opt.given("--touches", touches, "the CSV of touches")
    arm = load_arm(robot)
    artefact = artefact_of_touches(touches, artefact)
    target, report = _frame_files(output, Path("outputs") / "frames" / f"{arm.robot.name}_{number}.toml")
    uframes = (load_frames(frames) if frames else default_frames()).uframe
    counted_from = rise_reference(reference)
    taught = teaching.teach_frame(arm, touches, artefact, number, temperatures, counted_from, uframes, nominal=nominal)
    record = teaching.frame_record(taught, arm.robot.controller.decimals)
    reports = {report.name: json_text(record)}
    publish(target.parent, {target.name: teaching.frame_text(taught).encode()}, reports)
    lines = [*_lines(record), *finding_lines(record["findings"], verbose=screen.verbose), f"wrote {target}, {report}"]
    return Outcome(record=reports[report.name], show=partial(print_lines, lines))


def _frame_files(output: str | None, default: Path) -> tuple[Path, Path]:
    """The files of a frame, and of its record; raises InputError where what stands there is somebody else's."""
    target = opt.toml_file(output, default, "frame's")
    report = target.with_suffix(".json")
    check_names(target.parent, [report.name])
    check_own_file("-o", str(target), "as cgen teach-frame wrote it", Command.TEACH_FRAME)
    check_own_file("-o", str(report), None, Command.TEACH_FRAME)
    return target, report


def _lines(record: dict[str, Any]) -> list[str]:
    """What the command prints."""
    figures = "  ".join(f"{key[0].upper()} {value}" for key, value in record["type_in"].items())
    warm = ", ".join(f"{name} {rise:.1f}" for name, rise in record["rise_K"].items()) or "none known"
    k2 = ", ".join(f"{2 * s:.0f}" for s in record["sigma_um"])
    turn = ", ".join(f"{2 * s:.1f}" for s in record["sigma_mdeg"])
    probe, probe_k2 = record["probe_mm"], ", ".join(f"{2 * s:.0f}" for s in record["probe_sigma_um"])
    lines = [
        f"UFRAME[{record['uframe']}]  {figures}   (mm, deg; type these in)",
        f"known to {k2} um and {turn} mdeg (k = 2, World x, y, z) where it was touched, with this probe for a tool",
        f"from {record['touches']} touches with {record['noise_um']:.0f} um noise",
        f"probe in the flange: {probe[0]:.3f}, {probe[1]:.3f}, {probe[2]:.3f} mm, known to {probe_k2} um (k = 2)",
        f"taught through {'the model of ' if record['through'] == 'model' else 'the nominal arm of '}"
        f"{record['robot_file']}, rise K {warm}",
    ]
    differs = record["pendant_would_differ"]
    if differs is not None:
        away = ", ".join(f"{v:.0f}" for v in differs["place_um"])
        lines.append(f"the pendant would have taught it {away} um away")
    return lines
