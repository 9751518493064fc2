"""The command that identifies a controller's motion from a log of positions."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_robots
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.ownership import check_identified_motion
from compgen.cli.output_files.publish import check_names, publish
from compgen.cli.screen.console import finding_lines
from compgen.cli.screen.messages import print_error, print_record
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.exceptions import naming_file
from compgen.core.files import file_hash
from compgen.core.findings import first_message
from compgen.core.json_text import json_text


def identify_motion(
    program: opt.ProgramFile,
    log: opt.PositionLog = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", autocompletion=complete_robots, help="Robot name or file; [motion] goes into a copy."),
    ] = None,
    frames: opt.FramesFile = None,
    registers: opt.RegistersFile = None,
    in_world: opt.InWorld = False,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="The new robot file; default outputs/motion/<robot>.toml.")
    ] = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Fit how the controller smooths its commands to a log of a run, with a verdict on stretches held out."""
    from compgen.cli.screen.progress_bar import show_progress
    from compgen.pipelines.correct.program_file import read_frames, read_program, read_registers
    from compgen.pipelines.correct.programs_beside import programs_beside
    from compgen.pipelines.executed.executed import Situation, read_text
    from compgen.pipelines.files.robot_choice import robot_of_program
    from compgen.pipelines.files.robot_file import load_arm, load_robot
    from compgen.pipelines.measure.identify_motion import identify_motion as identification
    from compgen.pipelines.measure.identify_motion import motion_text
    from compgen.report.inputs import measured_inputs
    from compgen.report.motion_report import motion_html, motion_sentences, motion_summary
    from compgen.verification.executed.position_log import read_position_log

    log = opt.position_log(log)
    content = read_program(program)
    with naming_file(program):
        name = robot if robot is not None else robot_of_program(content)
    nominal, arm = load_robot(name), load_arm(name)
    target = opt.toml_file(output, Path("outputs") / "motion" / f"{nominal.name}.toml", "robot")
    check_names(target.parent, [target.with_suffix(suffix).name for suffix in (".html", ".json")])
    check_identified_motion(target)
    options = page_options(target.parent, assets, date)
    with naming_file(program):
        text = read_text(program, content)
    situation = Situation(
        nominal, read_frames(frames), read_registers(registers), programs_beside(Path(program)), in_world
    )
    positions = read_position_log(log)
    use_cores(workers)
    with show_progress(quiet or as_json) as progress:
        run, identified = identification(text, positions, situation, lambda share: progress(stages.MOTION, share))
    summary = motion_summary(run, text, identified, nominal)
    # a robot file that stands stays with its own reports
    stem = target.stem if identified.accepted or not target.exists() else f"{target.stem}_refused"
    page, report = target.with_name(f"{stem}.html"), target.with_name(f"{stem}.json")
    inputs = measured_inputs(
        nominal.name,
        (arm.source, file_hash(arm.source)),
        [("program", program, file_hash(program)), ("log", log, file_hash(log))],
    )
    reports = {report.name: json_text(summary), page.name: motion_html(summary, inputs, options)}
    robot_files = {}
    if identified.accepted:
        robot_files = {target.name: motion_text(arm.text, nominal, run, text, identified).encode()}
    described = page_files(target.parent, reports, figures, options)
    publish(target.parent, robot_files, described)
    if as_json:
        print_record(reports[report.name])
    elif not quiet:
        lines = [
            *motion_sentences(summary),
            *finding_lines((*identified.findings, *run.findings)),
        ]
        sys.stdout.write("".join(f"{line}\n" for line in lines))
        written = f", {target}" if identified.accepted else ""
        sys.stdout.write(f"wrote {page}, {report}{written}\n")
    if refused := first_message(Level.REFUSED, identified.findings):
        raise typer.Exit(print_error(f"refused: {refused}; {target.name} not written", 1))
