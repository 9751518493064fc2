"""The command that follows the warmth of a job's day."""

from functools import partial
from typing import Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PageDate, page_place
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.screen.messages import finding_lines, print_lines
from compgen.core.commands import Command

RECORD, TABLES = "heat.json", ("heat.csv", "heat.html", "runs.csv")


def heat(
    path: opt.PathFile,
    *,
    job: opt.JobChoice,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_heat.")
    ] = None,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Follow the warmth over [[before]], [[cycle]] and [[after]], and what one corrected file is worth in each run.

    Examples:
        cgen heat paths/spiral_1300.toml
        cgen heat paths/spiral_1300.toml --json --max-um 20
    """
    from compgen.pipelines.study import timeline
    from compgen.report.heat_page import heat_csv, heat_html, heat_json, heat_sentences, runs_csv

    folder = opt.output_folder(path, output, "_heat")
    planned = job.load(path)
    run = Run(Command.HEAT, planned.name)
    check_folder(folder, run, record=RECORD, others=TABLES)
    place = page_place(folder, page, date)
    day = timeline(planned)
    contents = (heat_csv(planned, day), heat_html(planned, day, place.options, max_um), runs_csv(planned, day))
    files = {RECORD: heat_json(planned, day), **dict(zip(TABLES, contents, strict=True))}
    publish(folder, {}, place.files(files), run=run)
    lines = [
        *heat_sentences(planned, day, verbose=screen.verbose),
        *finding_lines(planned.input_findings, verbose=screen.verbose),
    ]
    lines.append(f"wrote {', '.join(sorted(files))} to {folder}")
    where = f" in run {int(day.residual.argmax()) + 1}"
    errors = opt.beyond_bound("one file is off by {}", float(day.residual.max()), max_um, where)
    return Outcome(record=files[RECORD], show=partial(print_lines, lines), errors=errors)
