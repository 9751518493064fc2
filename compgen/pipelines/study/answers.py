"""The questions of a study, checked and answered by name."""

from collections.abc import Sequence

from compgen.core.exceptions import CompgenError, InputError
from compgen.core.units import MM
from compgen.job.job import Job
from compgen.pipelines.files.path_file import load_job
from compgen.pipelines.study.questions import ASKS, Answer, ask, passes

QUESTIONS = (*ASKS, "passes")


def check_study(questions: Sequence[str], within_um: float, varied: bool) -> None:
    """Raises InputError for a study of nothing, an unknown question, or a limit [um] that is none."""
    for question in questions:
        if question not in QUESTIONS:
            raise InputError(f"--ask {question}: unknown; known: {', '.join(QUESTIONS)}")
    if not 0 < within_um < 1e6:
        raise InputError(f"--within-um {within_um:g}: must be above 0; give micrometres")
    if not (questions or varied):
        raise InputError("nothing to study; give --vary KEY=V1,V2, --list FILE.csv or --ask QUESTION")


def base_job(path: str, robot: str | None, overrides: Sequence[str]) -> Job | None:
    """The job that all scenarios share; None where only scenarios can be read."""
    try:
        return load_job(path, robot, overrides)
    except CompgenError:
        return None


def answer_questions(
    path: str,
    robot: str | None,
    overrides: Sequence[str],
    questions: Sequence[str],
    limit: float,
    pass_paths: Sequence[str],
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
    path: str, robot: str | None, overrides: Sequence[str], limit: float, pass_paths: Sequence[str], feeds: str | None
) -> Answer:
    def overrides_of(file: str) -> Sequence[str]:
        return overrides if file == path else []

    def at_feed(job: Job, feed: float) -> Job:
        file = files[job.source]
        return load_job(file, robot, [*overrides_of(file), f"process.feed_mm_s={feed / MM!r}"])

    jobs = [load_job(file, robot, overrides_of(file)) for file in pass_paths]
    files = {job.source: file for job, file in zip(jobs, pass_paths, strict=True)}
    try:
        speeds = [float(feed) * MM for feed in feeds.split(",")] if feeds else []
    except ValueError:
        raise InputError(f"--feeds {feeds}: not numbers; give mm/s as in 20,100,200") from None
    return passes(jobs, speeds or [jobs[0].feed * share for share in (0.25, 0.5, 1)], at_feed, limit)
