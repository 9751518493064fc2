"""The files of a planned program by their names, whole or in parts; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from collections.abc import Iterable

from compgen.core.json_text import json_text
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report.job_page import job_html
from compgen.report.job_summary import job_summary
from compgen.report.page import PLAIN, PageOptions
from compgen.report.waypoints_csv import waypoints_blocks


def job_reports(
    planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN, *, with_program: bool = True
) -> dict[str, bytes | Iterable[bytes]]:
    """The reports of a planned program, or of a corrected one.

    Args:
        planned: The program without its correction.
        corrected: With it; None: it was only predicted.
        options: Of the page.
        with_program: Whether the program is written; the page says of one that is not.
    """
    return {
        "report.json": json_text(job_summary(planned, corrected) | options.labelled()),
        "report.html": job_html(planned, corrected, options, with_program=with_program),
        "waypoints.csv": waypoints_blocks(planned, corrected),
    }
