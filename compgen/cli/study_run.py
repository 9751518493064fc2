"""The scenarios and the questions of a study: computed, kept on disk as they come, shown on a bar."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from compgen.cli import study_journal
from compgen.core import interrupts
from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.pipelines.job import Job
from compgen.pipelines.path_file import load_job
from compgen.pipelines.study import Answer, Row, Study, ask, run
from compgen.pipelines.study.questions import passes


def answer_questions(
    path: str,
    robot: str | None,
    overrides: list[str],
    questions: list[str],
    limit: float,
    pass_paths: list[str],
    feeds: str | None,
) -> list[Answer]:
    """The answer to each question, asked once.

    Args:
        path: The path file in question.
        robot: Robot name or file; None for what the path file says.
        overrides: ``key=value`` for the path in question.
        questions: Their names.
        limit: The X of the questions [m].
        pass_paths: Path files of the passes; the path in question when empty.
        feeds: Feeds for the passes, as typed [mm/s].
    """
    answers = []
    for question in dict.fromkeys(questions):
        if question == "passes":
            answers.append(_answer_passes(path, robot, overrides, limit, pass_paths or [path], feeds))
        else:
            answers.append(ask(question, load_job(path, robot, overrides), limit))
    return answers


def _answer_passes(
    path: str, robot: str | None, overrides: list[str], limit: float, pass_paths: list[str], feeds: str | None
) -> Answer:
    def overrides_of(file: str) -> list[str]:
        return overrides if file == path else []

    def at_feed(job: Job, feed: float) -> Job:
        file = files[job.source]
        return load_job(file, robot, [*overrides_of(file), f"process.feed_mm_s={feed / MM!r}"])

    jobs = [load_job(file, robot, overrides_of(file)) for file in pass_paths]
    files = {job.source: file for job, file in zip(jobs, pass_paths)}
    try:
        speeds = [float(feed) * MM for feed in feeds.split(",")] if feeds else []
    except ValueError:
        raise InputError(f"--feeds {feeds}: not numbers; give mm/s as in 20,100,200") from None
    return passes(jobs, speeds or [jobs[0].feed * share for share in (0.25, 0.5, 1)], at_feed, limit)


def run_scenarios(study: Study, folder: Path, workers: int, cluster: str | None, fresh: bool, quiet: bool) -> list[Row]:
    """The rows of all scenarios; those of an earlier run of the same study are taken as they are, unless ``fresh``."""
    rows = [] if fresh else study_journal.read_finished(folder, study.identity)
    rows = [row for row in rows if row["index"] < len(study.scenarios)]
    if len(rows) < len(study.scenarios):
        interrupts.raise_on_signal()
        journal = study_journal.Journal(folder, study.identity, rows)
        interrupts.set_outcome("finished scenarios are kept")
        try:
            with _scenario_bar(len(study.scenarios), len(rows), quiet) as advance:

                def keep(new: list[Row]) -> None:
                    journal.add(new)
                    rows.extend(new)
                    advance(len(new))

                run(study, {row["index"] for row in rows}, keep, workers, cluster)
        finally:
            journal.close()
    return sorted(rows, key=lambda row: row["index"])


@contextmanager
def _scenario_bar(total: int, done: int, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Scenarios done and the time left, on a terminal only."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        task = bar.add_task("scenarios", total=total, completed=done)
        yield lambda count: bar.advance(task, count)
