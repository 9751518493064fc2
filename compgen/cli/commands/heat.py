"""The command that follows the warmth of a job's day."""

import sys
from typing import Annotated

import typer

from compgen.cli.machine import use_cores
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import Assets, AssetsOption, PageDate, page_files, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.output_files.ownership import HEAT, check_heat_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.console import finding_lines
from compgen.cli.screen.messages import print_error, print_record
from compgen.core.findings import beyond_text
from compgen.core.units import UM


def heat(
    path: opt.PathFile,
    robot: opt.JobRobot = None,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_heat.")
    ] = None,
    overrides: opt.Overrides = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    date: PageDate = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Follow the warmth over [[before]], [[cycle]] and [[after]], and what one corrected file is worth in each run."""
    from compgen.pipelines.files.path_file import load_job
    from compgen.pipelines.study import timeline
    from compgen.report.heat_page import heat_csv, heat_html, heat_json, heat_sentences, runs_csv

    folder = opt.output_folder(path, output, "_heat")
    bound = opt.checked_bound(max_um)
    use_cores(workers)
    job = load_job(path, robot, opt.with_state(path, overrides, state, state_age))
    check_heat_folder(folder, job.name)
    options = page_options(folder, assets, date)
    day = timeline(job)
    files = {
        HEAT: heat_json(job, day),
        "heat.csv": heat_csv(job, day),
        "heat.html": heat_html(job, day, options, max_um),
        "runs.csv": runs_csv(job, day),
    }
    reports = page_files(folder, files, figures, options)
    publish(folder, {}, reports)
    if as_json:
        print_record(files[HEAT])
    elif not quiet:
        sys.stdout.write("".join(f"{sentence}\n" for sentence in heat_sentences(job, day)))
        sys.stdout.write("".join(f"{line}\n" for line in finding_lines(job.input_findings)))
        sys.stdout.write(f"wrote {', '.join(sorted(files))} to {folder}\n")
    largest = float(day.residual.max())
    if bound is not None and largest > bound:
        run = int(day.residual.argmax()) + 1
        raise typer.Exit(
            print_error(
                f"one file is off by {beyond_text(largest / UM, bound / UM)} um in run {run}, --max-um {max_um:g}", 1
            )
        )
