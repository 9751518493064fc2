"""Where ``resume`` and ``follow`` put new pages: with their manifest and report, all of them or none."""

from pathlib import Path
from typing import TYPE_CHECKING

from compgen.cli.options.page_options import page_files
from compgen.cli.output_files.figure_files import FigureFormat
from compgen.cli.output_files.ownership import RESUME_FILES, command_in
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.pipelines.resume.result import Resumed
    from compgen.report.page import PageOptions


def put_pages(folder: Path, resumed: "Resumed", options: "PageOptions", figures: FigureFormat | None) -> None:
    """Put the new pages, the manifest and the report into their folder, all of them or none."""
    from compgen.report.resume import resume_html, resume_summary

    changed = {name: data for name, data in resumed.files.items() if name not in resumed.unchanged}
    put_files(folder, changed, json_text(resume_summary(resumed)), resume_html(resumed, options), options, figures)


def put_files(
    folder: Path,
    changed: dict[str, bytes],
    report: bytes,
    page: bytes,
    options: "PageOptions",
    figures: FigureFormat | None,
) -> None:
    """Put pages and manifest with their report and its figures into a folder, all of them or none.

    Raises:
        InputError: A report of another stands there, or the folder cannot be written.
    """
    from compgen.cli.output_files.replace_together import replace_together

    record = folder / RESUME_FILES[0]
    is_own = command_in(record) is Command.RESUME
    foreign = [name for name in RESUME_FILES if (folder / name).exists() and not is_own]
    if foreign:
        raise InputError(f"{folder / foreign[0]}: it is there and not what cgen resume or follow wrote; move it away")
    reports = page_files(folder, dict(zip(RESUME_FILES, (report, page), strict=True)), figures, options)
    replace_together(folder, {**reports, **changed})
