"""The command that judges a run by a log of its positions."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.frame import Outcome
from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_programs
from compgen.cli.options.page_options import PageChoice, PageDate, page_files, page_options
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.files import file_hash
from compgen.core.findings import first_message
from compgen.core.json_text import json_text

RECORD, PAGE, TABLE = "executed.json", "executed.html", "executed.csv"


def executed(
    program: opt.ProgramFile,
    *,
    log: opt.PositionLog = None,
    robot: opt.ProgramRobot = None,
    tables: opt.ProgramTables,
    in_world: opt.InWorld = False,
    also: Annotated[
        list[str] | None,
        typer.Option(
            "--also", autocompletion=complete_programs, help="A program that may have been run instead; repeatable."
        ),
    ] = None,
    max_um: opt.MaxUm = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<program>_executed.")
    ] = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Say whether a log of positions is of this program, at which override, in which time, and how true to the path.

    Examples:
        cgen executed out/SPIRAL_1300.LS --log run.csv --max-um 200
    """
    from compgen.pipelines.correct.program_file import programs_beside, read_program
    from compgen.pipelines.executed.executed import Situation, judge_log, read_text
    from compgen.pipelines.files.robot_file import find_robot, load_robot, robot_of_program
    from compgen.report.executed import executed_csv, executed_html, executed_summary
    from compgen.report.inputs import measured_inputs
    from compgen.verification.executed.position_log import read_position_log

    log = opt.position_log(log)
    bound = opt.checked_bound(max_um)
    folder = opt.output_folder(program, output, "_executed")
    content = read_program(program)
    with naming_file(program):
        robot_file = str(find_robot(robot if robot is not None else robot_of_program(content)))
        arm = load_robot(robot_file)
        text = read_text(program, content)
    ours = Run(Command.EXECUTED, text.name)
    check_folder(folder, ours, record=RECORD, others=[PAGE, TABLE])
    options = page_options(folder, page, date)
    others = [(name, read_program(name)) for name in also or []]
    situation = Situation(arm, *tables.read(), programs_beside(Path(program)), in_world)
    with naming_file(program):
        situation.course(content)  # what is wrong with the program is named before the log is read
    positions = read_position_log(log)
    use_cores(workers)
    run = judge_log(text, positions, situation, others, bound)
    summary = executed_summary(run, text, arm, bound)
    sources = [("program", program, file_hash(program)), ("log", log, file_hash(log))]
    inputs = measured_inputs(arm.name, (robot_file, file_hash(robot_file)), sources)
    record = json_text(summary)
    files = {RECORD: record, PAGE: executed_html(run, summary, inputs, options), TABLE: executed_csv(run)}
    publish(folder, {}, page_files(folder, files, page, options), run=ours)
    lines = [*_lines(summary), f"wrote {', '.join(files)} to {folder}"]
    outside = first_message(Level.OUTSIDE, run.findings)
    return Outcome(record=record, show=partial(print_lines, lines), errors=[f"outside: {outside}"] if outside else [])


def _lines(summary: dict[str, Any]) -> list[str]:
    """What the command prints."""
    log, time, covered = summary["log"], summary["time"], summary["covered"]
    off = "" if time["off_percent"] is None else f" ({time['off_percent']:+.2f} %)"
    overrides = ", then ".join(f"{s['percent']:.0f} %" for s in summary["override"]) or "not known"
    lines = [
        f"{summary['name']}: {log['rows']} rows every {log['period_ms']:.3g} ms, {100 * covered['share']:.1f} % of the "
        f"path ({covered['from']} to {covered['to']})",
        f"override {overrides}; {time['took_s']:.2f} s between its first and last steady row, planned "
        f"{time['expected_s']:.2f} s{off}; the program began at {time['start_s']:.3f} s of the log's clock",
    ]
    lines += [
        f"{name}: max {d['max_um']:.1f}, p99 {d['p99_um']:.1f}, rms {d['rms_um']:.1f} um; largest at {d['at']}"
        for name, d in summary["deviation"].items()
    ]
    lines.append(f"verdict: {summary['verdict']}")
    return [*lines, *finding_lines(summary["findings"])]
