"""The files of a corrected program that existed, by their names; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from pathlib import PurePath

from compgen.core.files import PROVENANCE
from compgen.core.json_text import json_text
from compgen.pipelines.correct import Correction
from compgen.report.correction import correction_csv, correction_html, correction_summary
from compgen.report.page import PLAIN, PageOptions
from compgen.report.provenance import provenance_json


def correction_files(
    correction: Correction, name: str, options: PageOptions = PLAIN, *, with_program: bool
) -> dict[str, bytes]:
    """The reports of a program that existed, and the program with its provenance.

    Args:
        correction: Of the program.
        name: The program's file.
        with_program: Whether it may be loaded.
        options: Of the page.
    """
    files = {
        "report.json": json_text(correction_summary(correction) | options.labelled()),
        "positions.csv": correction_csv(correction),
        "report.html": correction_html(correction, options, with_program=with_program),
    }
    if with_program:
        files[PurePath(name).stem + PROVENANCE] = provenance_json(correction)
        files[name] = correction.text
    return files
