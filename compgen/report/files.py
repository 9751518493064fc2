"""The files of a run by their names, whole or in parts; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from collections.abc import Iterable, Sequence
from pathlib import PurePath

from compgen.core.files import PROVENANCE
from compgen.core.json_text import json_text
from compgen.pipelines.correct import Correction
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report.correction import correction_csv, correction_html, correction_summary
from compgen.report.job_page import job_html
from compgen.report.job_summary import job_summary
from compgen.report.live import NONE, LiveSection
from compgen.report.page import PLAIN, PageOptions
from compgen.report.provenance import provenance_json
from compgen.report.study_page import study_html
from compgen.report.study_tables import StudyOutcome, answer_csv, band_caveat, headline, study_csv, study_json
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
        "report.json": json_text(job_summary(planned, corrected) | _labelled(options)),
        "report.html": job_html(planned, corrected, options, with_program=with_program),
        "waypoints.csv": waypoints_blocks(planned, corrected),
    }


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
        "report.json": json_text(correction_summary(correction) | _labelled(options)),
        "positions.csv": correction_csv(correction),
        "report.html": correction_html(correction, options, with_program=with_program),
    }
    if with_program:
        files[PurePath(name).stem + PROVENANCE] = provenance_json(correction)
        files[name] = correction.text
    return files


def _labelled(options: PageOptions) -> dict[str, dict[str, str]]:
    """Part, order and operator for a record; nothing where none is named."""
    return {"labels": dict(options.labels)} if options.labels else {}


def study_files(
    path: str,
    overrides: Sequence[str],
    outcome: StudyOutcome,
    options: PageOptions = PLAIN,
    live: LiveSection = NONE,
) -> dict[str, bytes]:
    """The tables and the page of a study of a path file, and of the answers to its questions."""
    study, rows = outcome.study, outcome.rows
    sentences = study_sentences(outcome)
    return {
        "whatif.json": study_json(path, overrides, study, rows, sentences, outcome.base, live.record),
        **({"whatif.csv": study_csv(study, rows)} if study is not None else {}),
        **{f"{answer.key}.csv": answer_csv(answer) for answer in outcome.answers},
        "whatif.html": study_html(f"What if: {PurePath(path).stem}", outcome, options=options, live=live.html),
    }


def study_sentences(outcome: StudyOutcome) -> list[str]:
    """What a study comes to: a headline, a sentence for each question, and what none of the numbers says."""
    study, rows = outcome.study, outcome.rows
    of_scenarios = [headline(study, rows)] if study is not None else []
    return [*of_scenarios, *(answer.sentence for answer in outcome.answers), band_caveat(rows)]
