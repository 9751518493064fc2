"""The command that identifies a controller's motion from a log of positions."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.commands.identify import ReportNames
from compgen.cli.frame import Outcome
from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_robots
from compgen.cli.options.page_options import PageChoice, PageDate, page_files, page_options
from compgen.cli.output_files.ownership import IDENTIFIED_MOTION, check_robot_files
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.files import file_hash
from compgen.core.findings import first_message
from compgen.core.json_text import json_text


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
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/motion/<robot>.toml.")
    ] = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Fit how the controller smooths its commands to a log of a run, with a verdict on stretches held out.

    Examples:
        cgen identify-motion out/SPIRAL_1300.LS --log run.csv --robot mine.toml -o smooth.toml
    """
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.correct.program_file import programs_beside, read_program
    from compgen.pipelines.executed.executed import Situation, read_text
    from compgen.pipelines.files.robot_file import load_arm, load_robot, robot_of_program
    from compgen.pipelines.measure import identify_motion as identification
    from compgen.report import motion_report
    from compgen.report.inputs import measured_inputs
    from compgen.verification.executed.position_log import read_position_log

    log = opt.position_log(log)
    content = read_program(program)
    with naming_file(program):
        name = robot if robot is not None else robot_of_program(content)
    nominal, arm = load_robot(name), load_arm(name)
    target = opt.toml_file(output, Path("outputs") / "motion" / f"{nominal.name}.toml", "robot")
    check_names(target.parent, [target.with_suffix(suffix).name for suffix in (".html", ".json")])
    check_robot_files(target, Command.IDENTIFY_MOTION, IDENTIFIED_MOTION)
    options = page_options(target.parent, page, date)
    with naming_file(program):
        text = read_text(program, content)
    situation = Situation(nominal, *tables.read(), programs_beside(Path(program)), in_world)
    positions = read_position_log(log)
    use_cores(workers)
    with show_progress(quiet=screen.is_silent) as progress:
        run, identified = identification.identify_motion(text, positions, situation, partial(progress, stages.MOTION))
    summary = motion_report.motion_summary(run, text, identified, nominal)
    sources = [(kind, file, file_hash(file)) for kind, file in (("program", program), ("log", log))]
    inputs = measured_inputs(nominal.name, (arm.source, file_hash(arm.source)), sources)
    names = ReportNames.beside(target, is_written=identified.accepted)
    record = json_text(summary)
    reports = {names.record: record, names.page: motion_report.motion_html(summary, inputs, options)}
    written = identification.motion_text(arm.text, nominal, run, text, identified) if identified.accepted else None
    robot_files = {} if written is None else {target.name: written.encode()}
    publish(target.parent, robot_files, page_files(target.parent, reports, page, options))
    lines = [*motion_report.motion_sentences(summary), *finding_lines((*identified.findings, *run.findings))]
    lines.append(names.words(target, is_written=identified.accepted))
    refused = first_message(Level.REFUSED, identified.findings)
    errors = [f"refused: {refused}; {target.name} not written"] if refused else []
    return Outcome(record=record, show=partial(print_lines, lines), errors=errors)
