"""A study in a notebook: scenarios over a grid of values, and the questions that people ask."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core import stages
from compgen.core.exceptions import RESULT, InputError, refuse_changes
from compgen.core.stages import Progress
from compgen.core.toml import brief_value
from compgen.core.units import UM
from compgen.job.job import Job
from compgen.pipelines.study import Answer, Study, StudyRow, build, run
from compgen.pipelines.study.questions import answer_questions, base_job, check_study
from compgen.report.answer_figures import TITLES, answer_figure
from compgen.report.key_words import words_of
from compgen.report.notebook.arguments import (
    File,
    Overrides,
    assignments,
    file_name,
    file_names,
    instance,
    key_of,
    number,
    numbers,
    optional_name,
    progress_of,
    value_of,
    whole_number,
)
from compgen.report.notebook.machine import data_frame, logger, numpy_alone, plotly_figure
from compgen.report.study_figures import error_against
from compgen.report.study_page import study_files, study_sentences
from compgen.report.study_tables import StudyOutcome, study_columns

MAX_PROCESSES = 1024
EXAMPLE = "{'duty': [0.2, 0.5]}"


@dataclass(frozen=True, eq=False, slots=True, repr=False, kw_only=True)
class StudyResult:
    """A row for each scenario, in the order of the grid, and the answers to the questions."""

    path: str
    overrides: tuple[str, ...]
    study: Study | None  # None where only questions were asked
    rows: tuple[StudyRow, ...]
    answers: tuple[Answer, ...]
    base: Job | None = None  # that all scenarios share; None where it cannot be read without their values

    @property
    def sentences(self) -> list[str]:
        """What the study comes to, and the answer to each question."""
        return study_sentences(self._outcome())

    def _outcome(self) -> StudyOutcome:
        return StudyOutcome(study=self.study, rows=list(self.rows), answers=list(self.answers), base=self.base)

    def columns(self) -> dict[str, list[Any]]:
        """Columns of ``whatif.csv`` by their names: what was varied as numbers where it is, NaN where there is none."""
        if self.study is None:
            return {}
        names = study_columns(self.study, list(self.rows))
        return {name: [_cell(row.get(name), name) for row in self.rows] for name in names}

    def array(self, column: str) -> np.ndarray[Any, Any]:
        """A column as an array, (S,): floats where it holds numbers.

        Raises:
            InputError: There is no such column.
        """
        columns = self.columns()
        if column not in columns:
            raise InputError(f"column: {brief_value(column)}: unknown; known: {', '.join(columns)[:200]}")
        return np.array(columns[column])

    def to_dataframe(self) -> Any:
        """A row for each scenario, as a pandas DataFrame.

        Raises:
            InputError: pandas is not installed.
        """
        return data_frame(self.columns())

    def plot(self, which: str | None = None) -> Any:
        """A plotly Figure: the largest error over the values of a key, or the curve behind an answer.

        Args:
            which: A key that was varied, or a question; by default the first there is.

        Raises:
            InputError: No such key or question.
        """
        keys = self.study.keys if self.study is not None else ()
        figures = {
            **{key: error_against(self.study, list(self.rows), key) for key in keys if self.study is not None},
            **{answer.key: answer_figure(answer) for answer in self.answers},
        }
        titles = {**{key: f"Largest error against {words_of(key)}" for key in keys}, **TITLES}
        return plotly_figure(figures, titles, next(iter(figures)) if which is None and figures else which)

    def files(self) -> dict[str, bytes]:
        """Name to content of what ``cgen whatif --no-live`` writes, but for its journal; nothing is written."""
        return study_files(self.path, self.overrides, self._outcome())

    def __repr__(self) -> str:
        return f"<StudyResult of {self.path}: {'; '.join(self.sentences)}>"


refuse_changes(StudyResult, *RESULT)


def study(
    path: File,
    vary: Mapping[str, Any] | Sequence[str] | None = None,
    scenarios: File | None = None,
    *,
    correct: bool = False,
    ask: str | Sequence[str] = (),
    within_um: float = 5.0,
    passes: File | Sequence[File] = (),
    feeds_mm_s: Sequence[float] = (),
    robot: File | None = None,
    overrides: Overrides | None = None,
    workers: int = 1,
    progress: Progress | None = None,
) -> StudyResult:
    """Vary any key, predict (and correct) every scenario, answer questions; as ``cgen whatif --no-live``.

    Args:
        path: A path file.
        vary: Keys and the values of each, as ``{"duty": [0.2, 0.5], "process.feed_mm_s": [20, 100]}``: all
            combinations. Or texts ``key=from:to:count``, as ``cgen whatif --vary`` takes them.
        scenarios: A CSV file with keys as header and a scenario in each row, multiplied with the grid.
        correct: Whether each scenario is corrected and proven as well.
        ask: Questions: ``warmup``, ``validity``, ``contributions``, ``steady``, ``passes``.
        within_um: The limit that the questions are about [um].
        passes: Path files of the passes, for ``passes``.
        feeds_mm_s: Feeds to choose from, for ``passes``.
        robot: Name or file of a robot; by default what the path file says.
        overrides: Keys that all scenarios share.
        workers: Processes; 0 for one a core. More than one asks a script to keep its own calls under
            ``if __name__ == "__main__":``.
        progress: Called with the stage and the share of it that is done, 0 to 1; what it raises ends the run.

    Returns:
        The rows; a scenario that cannot run is a row with the reason.

    Raises:
        InputError: An argument is wrong, a key is unknown, there is nothing to vary and no question.
    """
    name = file_name(path, "path", "a path file, as 'paths/spiral_1300.toml'")
    robot_name = optional_name(robot, "robot", "a robot's name, as 'm710ic50', or its file")
    base, axes = assignments(overrides), _axes(vary)
    listed = optional_name(scenarios, "scenarios", "a CSV file")
    questions = file_names(ask, "ask", "questions, as 'warmup'")
    pass_files = file_names(passes, "passes", "path files")
    feeds = ",".join(map(repr, numbers(feeds_mm_s, "feeds_mm_s"))) or None
    instance(correct, bool, "correct", "give True or False")
    limit_um, report_progress = number(within_um, "within_um"), progress_of(progress)
    processes = whole_number(workers, "workers", 0, MAX_PROCESSES)
    check_study(questions, limit_um, varied=bool(axes or listed))
    with numpy_alone():
        grid = build(name, robot_name, base, axes, listed, correct=correct) if axes or listed else None
        answers = answer_questions(name, robot_name, base, questions, limit_um * UM, pass_files, feeds)
        rows = _rows(grid, processes, report_progress) if grid is not None else []
    job = base_job(name, robot_name, base)
    result = StudyResult(
        path=name, overrides=tuple(base), study=grid, rows=tuple(rows), answers=tuple(answers), base=job
    )
    for sentence in result.sentences:
        logger.info("%s: %s", name, sentence)
    return result


def _rows(grid: Study, workers: int, progress: Progress) -> list[StudyRow]:
    """The rows of all scenarios, in their order."""
    rows: list[StudyRow] = []

    def keep(new: list[StudyRow]) -> None:
        rows.extend(new)
        progress(stages.SCENARIOS, len(rows) / len(grid.scenarios))

    progress(stages.SCENARIOS, 0.0)
    run(grid, set(), keep, workers)
    return sorted(rows, key=lambda row: row["index"])


def _axes(vary: object) -> list[str]:
    """What shall vary as the command line takes it."""
    if not isinstance(vary, Mapping):
        return assignments(vary, "vary", EXAMPLE)
    axes = []
    for key, values in vary.items():
        if isinstance(values, str | bytes | Mapping) or not hasattr(values, "__iter__"):
            raise InputError(f"vary: {key}: {brief_value(values)}: give a list of values, as in {EXAMPLE}")
        axes.append(f"{key_of(key, 'vary')}={','.join(value_of(value, f'vary: {key}') for value in values)}")
    return axes


def _cell(value: object, name: str) -> Any:
    """A cell as a number where it is one; NaN for none in a column of numbers, no text in one of texts."""
    if value is None:
        return "" if name in ("reason", "state") else float("nan")
    if isinstance(value, str) and name not in ("reason", "state"):
        try:
            return float(value)
        except ValueError:
            return value
    return value
