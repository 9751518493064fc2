"""Commands that write the files of a path: generate, predict."""

from typing import Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_date, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.screen.messages import outcome_words, print_error, print_record
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE, checked_date
from compgen.core.findings import beyond_text, first_message
from compgen.core.units import MM, UM


def generate(
    path: opt.PathFile,
    robot: opt.JobRobot = None,
    output: opt.OutputFolder = None,
    overrides: opt.Overrides = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    date: Annotated[
        str | None,
        typer.Option("--date", help="Date, YY-MM-DD, of the header (else 26-01-01) and of the page (else none)."),
    ] = None,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    force: opt.ForceProgram = False,
    pages: Annotated[
        bool, typer.Option("--pages/--no-pages", help="Part a program that is more than the controller holds.")
    ] = True,
    strict: opt.Strict = False,
    lift_all: Annotated[
        float | None,
        typer.Option("--lift-all", help="Write a dry run instead: the whole program lifted by so much [mm]."),
    ] = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Write the corrected program and its proof."""
    from compgen.cli.commands.job_files import check_folder, publish_job
    from compgen.cli.machine import use_machine
    from compgen.cli.screen.job_table import show_job
    from compgen.cli.screen.progress_bar import GENERATE, show_progress
    from compgen.pipelines.files.path_file import load_job
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.assumed_ramps import judge_ramps
    from compgen.pipelines.planned.dry_run import lifted, naming_lift
    from compgen.report.files import job_reports

    use_machine(workers)
    folder = opt.output_folder(path, output, "" if lift_all is None else "_dry")
    lift = None if lift_all is None else lift_all * MM
    changes = opt.with_state(path, opt.with_bound(overrides, max_um), state, state_age)
    with show_progress(quiet or as_json, GENERATE) as progress, naming_lift(lift):
        job = load_job(path, robot, changes)
        job = job if lift is None else lifted(job, lift)
        check_folder(folder, Command.GENERATE, job)
        of_page = page_options(folder, assets, date)
        in_header = DEFAULT_DATE if date is None else checked_date(date)
        planned, corrected = pipeline.generate(job, progress, in_header, pages)
        corrected = judge_ramps(planned, corrected) if strict else corrected
        progress(stages.REPORT, 0.0)
        written = corrected.is_usable or force
        reports = page_files(folder, job_reports(planned, corrected, of_page, with_program=written), figures, of_page)
        programs = dict(corrected.delivery.files) if written else {}
        publish_job(folder, programs, reports, job, progress)
    if as_json:
        print_record(reports["report.json"])
    elif not quiet:
        show_job(planned, corrected, folder, [*programs, *reports])
    if not corrected.inside:
        program = f"{corrected.program.name}.LS"
        ending = f"{program} not written; --force writes it"
        if corrected.is_as_planned:
            ending = f"{program} is written as planned"
        elif force:
            ending = "written all the same (--force)"
        broken = first_message(Level.OUTSIDE, corrected.findings)
        raise typer.Exit(print_error(f"{outcome_words(corrected.verdict)}: {broken}; {ending}", 1))


def predict(
    path: opt.PathFile,
    robot: opt.JobRobot = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_predict.")
    ] = None,
    overrides: opt.Overrides = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    program: Annotated[
        bool, typer.Option("--program", help="Write the planned program as well, named ..._PLAN: not corrected.")
    ] = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Predict the error of the planned program, without correcting it."""
    from compgen.cli.commands.job_files import check_folder, publish_job
    from compgen.cli.machine import use_machine
    from compgen.cli.screen.job_table import show_job
    from compgen.cli.screen.progress_bar import PREDICT, show_progress
    from compgen.pipelines.files.path_file import load_job
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.planned_delivery import deliver_planned, planned_name_of
    from compgen.report.files import job_reports

    use_machine(workers)
    folder = opt.output_folder(path, output, "_predict")
    bound = opt.checked_bound(max_um)
    changes = opt.with_state(path, opt.with_bound(overrides, max_um), state, state_age)
    with show_progress(quiet or as_json, PREDICT) as progress:
        job = load_job(path, robot, changes)
        check_folder(folder, Command.PREDICT, job)
        of_page = page_options(folder, assets, date)
        planned = pipeline.predict(job, progress)
        programs: dict[str, bytes] = {}
        if program:
            planned, delivered = deliver_planned(planned, DEFAULT_DATE if date is None else page_date(date)[2:])
            programs = {} if first_message(Level.OUTSIDE, planned.findings) else dict(delivered.files)
        progress(stages.REPORT, 0.0)
        reports = page_files(folder, job_reports(planned, None, of_page), figures, of_page)
        publish_job(folder, programs, reports, job, progress, is_planned=True)
    if as_json:
        print_record(reports["report.json"])
    elif not quiet:
        show_job(planned, None, folder, [*programs, *reports])
    if program and not programs:
        broken = first_message(Level.OUTSIDE, planned.findings)
        raise typer.Exit(print_error(f"{broken}; {planned_name_of(job)}.LS not written", 1))
    largest = planned.deviation().on_part["total"].max
    if bound is not None and largest > bound:
        raise typer.Exit(
            print_error(f"predicted: error of {beyond_text(largest / UM, bound / UM)} um, --max-um {max_um:g}", 1)
        )
