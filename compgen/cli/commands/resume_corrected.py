"""``resume`` for the pages of a corrected program: what it reads, writes and says."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from compgen.cli.output_files.figure_files import FigureFormat
from compgen.cli.screen.console import finding_lines, print_table, stdout_console
from compgen.cli.screen.messages import print_error, print_record
from compgen.cli.screen.progress_bar import CORRECT, show_progress
from compgen.cli.screen.resume_table import pages_table
from compgen.core.codes import Level
from compgen.core.findings import first_message
from compgen.core.json_text import json_text
from compgen.pipelines.resume.written_job import WrittenJob

if TYPE_CHECKING:
    from compgen.pipelines.resume.corrected import ResumedProgram
    from compgen.report.page import PageOptions


def resume_corrected_program(
    written: WrittenJob, folder: Path, from_page: int, state: str | None, age: float, late: float | None,
    log: str | None, date: str,
    loaded: int, done: int, robot: str | None, max_um: float | None, force: bool, as_json: bool, quiet: bool,
    options: "PageOptions", figures: FigureFormat | None,
) -> None:  # fmt: skip
    """Write the remaining pages of a corrected program anew; the options are those of ``resume``."""
    from compgen.cli.commands.resume_files import put_files
    from compgen.pipelines.resume.corrected import (
        begin_late_anew,
        begin_with_log_anew,
        begin_with_state_anew,
        resume_corrected,
    )
    from compgen.pipelines.resume.corrected_job import read_corrected
    from compgen.report.resume import program_html, program_summary

    job = read_corrected(written, robot, max_um)
    if state is not None:
        begin = begin_with_state_anew(job.plain, state, age)
    else:
        begin = begin_late_anew(late) if late is not None else begin_with_log_anew(log or "")
    with show_progress(quiet or as_json, CORRECT) as progress:
        resumed = resume_corrected(job, from_page, begin, date, progress, loaded, done)
        usable = resumed.correction.is_usable
        is_written = bool(resumed.replaced) and (usable or force)
        report = json_text(program_summary(resumed))
        if is_written:
            changed = {name: data for name, data in resumed.files.items() if name not in resumed.unchanged}
            put_files(folder, changed, report, program_html(resumed, options), options, figures)
    if as_json:
        print_record(report)
    elif not quiet:
        _show(resumed, folder, is_written)
    if not resumed.correction.inside:
        broken = first_message(Level.OUTSIDE, resumed.findings)
        ending = "written all the same" if is_written or usable else "nothing was written; --force writes the pages"
        raise typer.Exit(print_error(f"{resumed.verdict}: {broken}; {ending}", 1))


def _show(resumed: "ResumedProgram", folder: Path, is_written: bool) -> None:
    from compgen.pipelines.resume.corrected import words_of

    console = stdout_console()
    print_table(console, f"{resumed.correction.name} from page {resumed.from_page} on", pages_table(resumed.pages))
    lines = [*words_of(resumed), *finding_lines(resumed.findings)]
    if is_written:
        lines.append(f"wrote {', '.join(resumed.replaced)} anew, {resumed.written.manifest_file} in {folder}")
    elif not resumed.replaced:
        lines.append("nothing to do: the pages in the folder are these already")
    for line in lines:
        console.print(line)
