"""Commands on a log of positions: executed judges the run, identify-motion fits the controller's motion to it.

Plan-motion-log writes the program whose log tells most of that.
"""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.commands.identify import RobotFilePlace, robot_file_place
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs, complete_robots
from compgen.cli.options.page_options import PageChoice, PageDate, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import IDENTIFIED_MOTION, Headed, check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import finding_lines, outside_words
from compgen.core import stages
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.exceptions import InputError, naming_file
from compgen.core.files import file_hash
from compgen.core.finding_codes import Level
from compgen.core.findings import first_message
from compgen.core.json_text import json_text
from compgen.core.units import MINUTE, MM

if TYPE_CHECKING:
    from compgen.identification.motion.identify import IdentifiedMotion
    from compgen.pipelines.executed.executed import ProgramText, Situation
    from compgen.report.inputs import Inputs
    from compgen.verification.executed.course import ProgramCourse
    from compgen.verification.executed.judgement import ExecutedRun

RECORD, PAGE, TABLE = "executed.json", "executed.html", "executed.csv"

OtherPrograms = Annotated[
    list[str] | None,
    typer.Option(
        "--also", autocompletion=complete_programs, help="A program that may have been run instead; repeatable."
    ),
]
SHARE = 0.6  # of the reach, where the figures stand
FARTHEST_MM = 1e4  # of a centre, in World


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggedProgram:
    """A program of which a log is given, with the robot that drove it."""

    file: str
    log: str
    text: "ProgramText"
    course: "ProgramCourse"
    robot_file: str
    situation: "Situation"

    def inputs(self) -> "Inputs":
        """What a page names as its inputs."""
        from compgen.report.inputs import measured_inputs

        sources = [(kind, file, file_hash(file)) for kind, file in (("program", self.file), ("log", self.log))]
        return measured_inputs(self.situation.robot.name, (self.robot_file, file_hash(self.robot_file)), sources)


def _logged_program(
    program: str, log: str | None, robot: str | None, tables: opt.ProgramTables, *, in_world: bool
) -> LoggedProgram:
    """The program with what lies beside it; the log is not read yet."""
    from compgen.pipelines.correct.program_file import programs_beside, read_program, robot_of_program
    from compgen.pipelines.executed.executed import Situation, read_program_text
    from compgen.pipelines.files.robot_file import find_robot, load_robot

    log = opt.given("--log", log, "the CSV of positions that was logged while the program ran")
    content = read_program(program)
    with naming_file(program):
        robot_file = str(find_robot(robot if robot is not None else robot_of_program(content)))
        text = read_program_text(program, content)
    situation = Situation(load_robot(robot_file), *tables.read(), programs_beside(Path(program)), in_world)
    with naming_file(program):
        course = situation.course(content)  # what is wrong with the program is named before the log is read
    return LoggedProgram(file=program, log=log, text=text, course=course, robot_file=robot_file, situation=situation)


def _other_course(program: str, situation: "Situation") -> "ProgramCourse":
    """The course of a program that may have been run instead, with the programs beside it."""
    from compgen.pipelines.correct.program_file import programs_beside, read_program

    content = read_program(program)
    with naming_file(program):
        return replace(situation, find_program=programs_beside(Path(program))).course(content)


def executed(
    program: opt.ProgramFile,
    *,
    log: opt.PositionLog = None,
    robot: opt.ProgramRobot = None,
    tables: opt.ProgramTables,
    in_world: opt.InWorld = False,
    j3: opt.JointThree = opt.J3.HORIZONTAL,
    also: OtherPrograms = None,
    max_um: opt.MaxUm = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<program>_executed.")
    ] = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Say whether a log of positions is of this program, at which override, in which time, and how true to the path.

    Examples:
        cgen executed out/SPIRAL_1300.LS --log run.csv --max-um 200
    """
    from compgen.pipelines.executed.executed import judge_log
    from compgen.report.executed import executed_csv, executed_html, executed_summary
    from compgen.verification.executed.position_log import read_position_log

    folder = opt.output_folder(program, output, "_executed")
    logged = _logged_program(program, log, robot, tables, in_world=in_world)
    text, own, bound = logged.text, Run(Command.EXECUTED, logged.text.name), opt.bound_of(max_um)
    check_folder(folder, own, record=RECORD, others=[PAGE, TABLE])
    place = page_place(folder, page, date)
    others = [(name, _other_course(name, logged.situation)) for name in also or []]
    positions = read_position_log(logged.log, third_on_link2=j3 is opt.J3.LINK2)
    run = judge_log(text, logged.course, positions, logged.situation, others, bound)
    summary = executed_summary(run, text, logged.situation.robot, bound)
    record, html = json_text(summary), executed_html(run, summary, logged.inputs(), place.options)
    files = {RECORD: record, PAGE: html, TABLE: executed_csv(run)}
    publish(folder, {}, place.files(files), run=own)
    findings = finding_lines(summary["findings"], verbose=screen.verbose)
    lines = [*_lines(summary), *findings, f"wrote {', '.join(files)} to {folder}"]
    return Outcome(record=record, lines=lines, errors=[outside_words(run.findings)])


def _lines(summary: dict[str, Any]) -> list[str]:
    """What the command prints."""
    from compgen.report.executed import LABELS

    log, time, covered = summary["log"], summary["time"], summary["covered"]
    off = "" if time["off_percent"] is None else f" ({time['off_percent']:+.2f} %)"
    overrides = ", then ".join(s["words"] for s in summary["override"]) or "not known"
    took = "time not known"
    if time["from_s"] is not None:
        span = f"from {time['from_s']:.2f} to {time['to_s']:.2f} s of the log, less stands, joint motions as planned,"
        took = f"{span} {time['took_s']:.2f} s, planned {time['expected_s']:.2f} s{off}"
    start = time["start_s"]
    begun = "" if start is None else f"; the program began at {start:.3f} s of the log's clock"
    lines = [
        f"{summary['name']}: the log has {log['rows']} rows, one every {log['period_ms']:.3g} ms, of "
        f"{100 * covered['share']:.1f} % of the path ({covered['from']} to {covered['to']})",
        f"override {overrides}; {took}{begun}",
    ]
    lines += [
        f"{LABELS[name]}: at most {d['max_um']:.1f} um, at {d['at']}; 99 % of the rows below {d['p99_um']:.1f}, rms "
        f"{d['rms_um']:.1f}"
        for name, d in summary["deviation"].items()
    ]
    unjudged = "" if summary["bounds"] or summary["verdict"] != "inside" else ": no bound was given; give --max-um"
    return [*lines, f"verdict: {summary['verdict']}{unjudged}"]


def identify_motion(
    program: opt.ProgramFile,
    *,
    log: opt.PositionLog = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", autocompletion=complete_robots, help="Robot name or file; [motion] goes into a copy."),
    ] = None,
    tables: opt.ProgramTables,
    in_world: opt.InWorld = False,
    j3: opt.JointThree = opt.J3.HORIZONTAL,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/motion/<robot>.toml.")
    ] = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Fit how the controller smooths its commands to a log of a run, with a verdict on stretches held out.

    Examples:
        cgen identify-motion out/SPIRAL_1300.LS --log run.csv --robot mine.toml -o smooth.toml
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.files.robot_file import load_arm
    from compgen.pipelines.measure.identify_motion import identify_motion as identify
    from compgen.verification.executed.position_log import read_position_log

    logged = _logged_program(program, log, robot, tables, in_world=in_world)
    arm = load_arm(logged.robot_file)
    default = Path("outputs") / "motion" / f"{arm.robot.name}.toml"
    target = robot_file_place(output, default, Command.IDENTIFY_MOTION, IDENTIFIED_MOTION, page, date)
    positions = read_position_log(logged.log, third_on_link2=j3 is opt.J3.LINK2)
    with show_progress(quiet=screen.is_silent) as progress:
        run, identified = identify(
            logged.text, logged.course, positions, logged.situation, partial(progress, stages.MOTION)
        )
    return _publish_motion(logged, arm.text, run, identified, target, verbose=screen.verbose)


def _publish_motion(
    logged: LoggedProgram,
    robot_text: str,
    run: "ExecutedRun",
    identified: "IdentifiedMotion",
    target: RobotFilePlace,
    *,
    verbose: bool,
) -> Outcome:
    """Write a copy of the robot file with the motion, unless the fit is refused, and the reports."""
    from compgen.pipelines.measure.identify_motion import motion_text
    from compgen.report.motion_report import motion_html, motion_sentences, motion_summary
    from compgen.robot.motion import MotionVerdict

    robot, text = logged.situation.robot, logged.text
    summary = motion_summary(run, text, identified, robot)
    written = {}
    if identified.verdict is not MotionVerdict.REJECTED:
        written = {target.file.name: motion_text(robot_text, robot, run, text, identified).encode()}
    record = json_text(summary)
    words = target.put(written, record, motion_html(summary, logged.inputs(), target.place.options))
    findings = finding_lines((*identified.findings, *run.findings), verbose=verbose)
    lines = [*motion_sentences(summary), *findings, words]
    refused = first_message(Level.REFUSED, identified.findings)
    errors = [f"refused: {refused}; {target.file.name} not written"] if refused else []
    return Outcome(record=record, lines=lines, errors=errors)


def plan_motion_log(
    robot: opt.RobotArgument,
    *,
    centre: Annotated[
        str | None,
        typer.Option(
            "--centre", help="Middle of its figures, World 'x y z' in mm; default in front of J2, at 0.6 of the reach."
        ),
    ] = None,
    size: Annotated[
        float, typer.Option("--size", callback=opt.in_range(20, 2000), help="Size of its figures, mm.")
    ] = 300.0,
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
    name = program_name(f"{arm.name}_motion", arm.controller.capacity.name_length)
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
    return Outcome(record=record, lines=_lines_of_plan(record, folder / file, robot))


def _lines_of_plan(record: dict[str, Any], program: Path, robot: str) -> list[str]:
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
