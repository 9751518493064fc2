"""The files of a study by their names; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from collections.abc import Sequence
from pathlib import PurePath

from compgen.report.live import NONE, LiveSection
from compgen.report.page import PLAIN, PageOptions
from compgen.report.study_page import study_html
from compgen.report.study_tables import StudyOutcome, answer_csv, band_caveat, headline, study_csv, study_json


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
