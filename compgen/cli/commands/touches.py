"""Commands on touches: anchor says what the robot is now, teach-frame where a part stands.

Plan-touches says which spheres to touch, and from where, to know best where a path will be.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.commands.identify import ReferenceOption, Temperatures, UserFrames
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PageDate, PagePlace, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder, check_own_file, check_unfilled
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import finding_lines, finding_rows, table_of
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text
from compgen.core.units import MM, UM, counted

if TYPE_CHECKING:
    from compgen.identification.touch_candidates import Search
    from compgen.pipelines.anchor import Anchored
    from compgen.program.program import Signal

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
CONDITION = re.compile(r"(?:DI|RI|UI|SI|WI|F|M)\[[1-9][0-9]{0,4}\]=(?:ON|OFF)")
PLAN_RECORD, PLAN_TABLE = "plan.json", "touches.csv"

TouchesFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder; default outputs/<path name>_touches.")
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
    return Outcome(record=record, lines=_lines_of(result, files, verbose=verbose), errors=errors)


def _lines_of(result: "Anchored", files: list[str], *, verbose: bool) -> list[str]:
    """The verdict, the state, and what a user must know."""
    from compgen.core.units import UM, limit_words
    from compgen.pipelines.anchor.verdict import path_known_words

    state, (before, after) = result.state, result.rms
    K, sigma = len(state.nodes), state.sigma
    rises = ", ".join(
        f"{name} {rise:.1f} +- {2 * s:.1f} (forecast {was:.1f})"
        for name, rise, s, was in zip(
            state.nodes, state.rise.tolist(), sigma[:K].tolist(), result.forecast.rise.tolist(), strict=True
        )
    )
    known = path_known_words(before, after, base_moved=bool(result.judged[0].hypothesis.base))
    base = ", ".join(f"{a} {v / UM:.0f}" for a, v in zip("xyz", state.base[:3].tolist(), strict=True))
    return [
        f"{state.verdict}: {result.reason}",
        *(line for line in (known,) if result.verdict != "anchored"),  # that is its reason
        f"warmer than the reference by [K], +- at 95 %: {rises}",
        f"base moved in World by {base} um",
        f"the state holds for {limit_words(state.window)}, the robot standing",
        *finding_lines(result.findings[1:], verbose=verbose),
        *([f"wrote {', '.join(files)}"] if files else []),
    ]


def teach_frame(
    robot: opt.RobotArgument,
    *,
    touches: opt.TouchesFile = None,
    artefact: opt.ArtefactFile = None,
    temperatures: Temperatures = None,
    reference: ReferenceOption = "start",
    number: Annotated[int, typer.Option("--number", help="UFRAME number.", min=1, max=9)] = 1,
    frames: UserFrames = None,
    nominal: Annotated[bool, typer.Option("--nominal", help="Teach as the pendant would: without the model.")] = False,
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
    return Outcome(record=reports[report.name], lines=lines)


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
    aside = f", {len(record['set_aside'])} set aside" * bool(record["set_aside"])
    lines = [
        f"UFRAME[{record['uframe']}]  {figures}   (mm, deg; type these in)",
        f"known to {k2} um and {turn} mdeg (k = 2, World x, y, z) where it was touched, with this probe for a tool",
        f"from {record['touches_used']} touches with {record['noise_um']:.0f} um noise{aside}",
        f"probe in the flange: {probe[0]:.3f}, {probe[1]:.3f}, {probe[2]:.3f} mm, known to {probe_k2} um (k = 2)",
        f"taught through {'the model of ' if record['through'] == 'model' else 'the nominal arm of '}"
        f"{record['robot_file']}, rise K {warm}",
    ]
    differs = record["pendant_would_differ"]
    if differs is not None:
        away = ", ".join(f"{v:.0f}" for v in differs["place_um"])
        lines.append(f"the pendant would have taught it {away} um away")
    return lines


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchChoice:
    """How the program touches."""

    centres: Annotated[
        bool, typer.Option("--centres", help="Each touch locates a sphere's centre (a nest, a centring probe).")
    ] = False
    stops: Annotated[bool, typer.Option("--stops", help="The program pauses at each touch, for reading by hand.")] = (
        False
    )
    skip: Annotated[str, typer.Option("--skip", help="Signal that ends a search, as SKIP CONDITION has it.")] = (
        "DI[1]=ON"
    )
    register: Annotated[
        int, typer.Option("--pr", callback=opt.in_range(1, 9999), help="First position register that keeps a touch.")
    ] = 1
    utool: Annotated[
        int, typer.Option("--utool", callback=opt.in_range(1, 29), help="Number of the probe's tool on the controller.")
    ] = 9
    sigma: Annotated[
        float,
        typer.Option(
            "--sigma", callback=opt.in_range(0.1, 1e4), help="Standard deviation of a touch's coordinate, um."
        ),
    ] = 12.0
    clearance: Annotated[
        float,
        typer.Option(
            "--clearance", callback=opt.in_range(1, 500), help="How far before the touch a search begins, mm."
        ),
    ] = 20.0
    beyond: Annotated[
        float,
        typer.Option(
            "--beyond", callback=opt.in_range(0.1, 50), help="How far a search may go behind the planned touch, mm."
        ),
    ] = 3.0

    def signal(self) -> "Signal | None":
        """What ends a search, None where the program stops instead; raises InputError for a condition that is none."""
        from compgen.program.program import Signal

        return None if self.stops or self.centres else Signal(_condition(self.skip), self.register)

    def search(self) -> "Search":
        """How the probe comes to a sphere."""
        from compgen.identification.touch_candidates import Search

        return Search(self.clearance * MM, self.beyond * MM, centres=self.centres)


def plan_touches(
    path: opt.PathFile,
    *,
    artefact: Annotated[str | None, typer.Option("--artefact", help="TOML of spheres and probe.")] = None,
    count: Annotated[int, typer.Option("-n", help="How many touches.")] = 8,
    choice: SearchChoice,
    job: opt.JobChoice,
    log: Annotated[str | None, typer.Option("--log", help="Temperature log in place of [[before]].")] = None,
    reference: opt.LogReference = None,
    frames: opt.FramesFile = None,
    output: TouchesFolder = None,
    date: opt.Date = DEFAULT_DATE,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Choose the touches that tell most of where a path will be: a CSV to fill in, and a program that touches.

    Examples:
        cgen plan-touches paths/spiral_1300.toml --artefact artefact.toml -n 8 -o touches
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.identification.touches import read_artefact
    from compgen.pipelines.anchor.touch_model import frame_of_artefact
    from compgen.pipelines.anchor.touch_plan import plan_path_touches, positions_of, write_touches
    from compgen.program.program import program_name
    from compgen.report.touch_plan import touch_record, touches_csv

    artefact, signal = opt.given("--artefact", artefact, "the TOML of spheres and probe"), choice.signal()
    folder, run = opt.output_folder(path, output, "_touches"), Run(Command.PLAN_TOUCHES)
    chosen = job.load_with_log(path, log, reference)
    name = program_name(f"{chosen.name}_touches", chosen.robot.controller.capacity.name_length)
    check_folder(folder, run, record=PLAN_RECORD, others=[f"{name}.LS", PLAN_TABLE])
    check_unfilled(folder, PLAN_TABLE, "touches that were made")
    spheres, sigma, search = read_artefact(artefact), choice.sigma * UM, choice.search()
    frame = frame_of_artefact(spheres, chosen.frame, frames)
    with show_progress(quiet=screen.is_silent) as progress:
        planned = plan_path_touches(chosen, spheres, frame, count=count, sigma=sigma, search=search, progress=progress)
    touches = positions_of(planned, choice.utool, stops=signal is None)
    record = touch_record(planned, touches, signal)
    reports = {PLAN_RECORD: json_text(record), PLAN_TABLE: touches_csv(planned, touches, stops=signal is None)}
    program = {f"{name}.LS": write_touches(planned, name, checked_date(date), choice.utool, signal)}
    publish(folder, program, reports, run=run)
    shown = _plan_shown(record, folder, [*program, *reports], verbose=screen.verbose)
    return Outcome(record=reports[PLAN_RECORD], shown=shown)


def _condition(text: str) -> str:
    plain = text.replace(" ", "").upper()
    if not CONDITION.fullmatch(plain):
        raise InputError(f"--skip {text[:40]!r}: no condition of a signal; give one such as 'DI[1]=ON' or 'RI[2]=OFF'")
    return plain


def _plan_shown(record: dict[str, Any], folder: Path, files: list[str], *, verbose: bool) -> list[object]:
    """The touches, what each gains, and the files."""
    rows = []
    for n, touch in enumerate(record["touches"], 1):
        normal = touch["normal"]
        along = "to its centre" if normal is None else "  ".join(f"{round(v, 2) + 0.0:5.2f}" for v in normal)
        rows.append([str(n), touch["target"], along, f"{touch['rms_um']:.1f}", f"{100 * touch['gain']:.0f} %"])
    before, after, n = record["before"], record["after"], record["planned_touches"]
    by_anchoring = record["by_anchoring_rms_um"]
    expected = "" if by_anchoring is None else f" (cgen anchor will leave {by_anchoring:.1f} um rms)"
    touches = counted(n, "touch", "touches")
    return [
        table_of(("touch", "target", "probe moves along (World)", "leaves rms, um", "gain"), rows),
        f"what is not known of the path's place (standard deviation): {before['rms_um']:.1f} um rms, "
        f"{before['p99_um']:.1f} um p99; after {touches} {after['rms_um']:.1f} and {after['p99_um']:.1f} um"
        f"{expected}; one more gains {100 * record['one_more']['gain']:.0f} %",
        *finding_rows(record["findings"], verbose=verbose),
        f"wrote {', '.join(files)} to {folder}",
    ]
