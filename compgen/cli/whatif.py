"""The command that varies anything, and answers what people ask of a path's warmth."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from compgen.cli import publish, study_journal
from compgen.cli.app import OutDir, PathFile, Quiet, RobotName, Set, app, output_folder, say_error
from compgen.core import interrupts
from compgen.core.exceptions import InputError
from compgen.core.units import MM, UM
from compgen.pipelines.job import Job
from compgen.pipelines.path_file import load_job
from compgen.pipelines.study import ASKS, Answer, Row, Study, ask, build, run
from compgen.pipelines.study.questions import passes
from compgen.report.study_page import study_html
from compgen.report.study_tables import answer_csv, headline, study_csv, study_json

QUESTIONS = [*ASKS, "passes"]


@app.command()
def whatif(
    path: PathFile,
    vary: Annotated[
        list[str] | None, typer.Option("--vary", help="KEY=V1,V2,... or KEY=FROM:TO:COUNT; repeat for a grid.")
    ] = None,
    listed: Annotated[str | None, typer.Option("--list", help="CSV with keys as header, a scenario a row.")] = None,
    correct: Annotated[bool, typer.Option("--correct", help="Correct and prove each scenario as well.")] = False,
    asks: Annotated[list[str] | None, typer.Option("--ask", help=f"{', '.join(QUESTIONS)}; repeatable.")] = None,
    within_um: Annotated[float, typer.Option("--within-um", help="The X of the questions [um].")] = 5.0,
    pass_: Annotated[list[str] | None, typer.Option("--pass", help="Path files of the passes, for passes.")] = None,
    feeds: Annotated[str | None, typer.Option("--feeds", help="Feeds for passes, mm/s: 20,100,200.")] = None,
    workers: Annotated[int, typer.Option("--workers", help="Processes; 0: all cores.", min=0)] = 0,
    cluster: Annotated[str | None, typer.Option("--cluster", help="Address of a Dask scheduler.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished scenarios of an earlier run.")] = False,
    robot: RobotName = None,
    output: OutDir = None,
    set_: Set = None,
    quiet: Quiet = False,
) -> None:
    """Vary any key, predict (and correct) every scenario, answer questions. Finished scenarios are kept."""
    folder = output_folder(path, output, "_whatif")
    _check(asks or [], within_um, bool(vary or listed))
    study = build(path, robot, set_ or (), vary or (), listed, correct) if vary or listed else None
    answers = _answers(path, robot, set_ or [], asks or [], within_um * UM, pass_ or [], feeds)
    rows = _rows(study, folder, workers, cluster, fresh, quiet) if study else []
    files = {f"{a.key}.csv": answer_csv(a) for a in answers}
    sentences = [a.sentence for a in answers]
    if study:
        sentences.insert(0, headline(study, rows))
        files |= {
            study_journal.NAME: study_journal.content(study.identity, rows),
            "whatif.csv": study_csv(study, rows),
            "whatif.json": study_json(study, rows, sentences),
        }
    title = f"What if: {Path(path).stem}"
    files["whatif.html"] = study_html(title, study, rows, answers)
    ours = {study_journal.NAME, "whatif.csv", "whatif.json", "whatif.html", *(f"{q}.csv" for q in QUESTIONS)}
    publish.publish(folder, files, ours)
    if not quiet:
        sys.stdout.write("".join(f"{s}\n" for s in sentences))
        for row in [r for r in rows if r["state"] == "failed"][:10]:
            sys.stdout.write(f"failed: scenario {row['index']}: {row['reason']}\n")
        sys.stdout.write(f"wrote {', '.join(sorted(files))} to {folder}\n")
    if rows and all(r["state"] == "failed" for r in rows):
        raise typer.Exit(say_error(f"every scenario failed: {rows[0]['reason']}", 1))


def _check(asks: list[str], within: float, varied: bool) -> None:
    for question in asks:
        if question not in QUESTIONS:
            raise InputError(f"--ask {question}: unknown; known: {', '.join(QUESTIONS)}")
    if not 0 < within < 1e6:
        raise InputError(f"--within-um {within:g}: must be above 0; give micrometres")
    if not (asks or varied):
        raise InputError("nothing to study; give --vary KEY=V1,V2, --list FILE.csv or --ask QUESTION")


def _answers(
    path: str, robot: str | None, set_: list[str], asks: list[str], limit: float, others: list[str], feeds: str | None
) -> list[Answer]:
    found = []
    for question in dict.fromkeys(asks):
        if question != "passes":
            found.append(ask(question, load_job(path, robot, set_), limit))
            continue
        jobs = [load_job(p, robot, set_ if p == path else ()) for p in (others or [path])]
        try:
            speeds = [float(f) * MM for f in feeds.split(",")] if feeds else [jobs[0].feed * s for s in (0.25, 0.5, 1)]
        except ValueError:
            raise InputError(f"--feeds {feeds}: not numbers; give mm/s as in 20,100,200") from None
        found.append(passes(jobs, speeds, _paced(others or [path], path, robot, set_), limit))
    return found


def _paced(paths: list[str], path: str, robot: str | None, set_: list[str]) -> Callable[[Job, float], Job]:
    files = {load_job(p, robot).source: p for p in paths}

    def at(job: Job, feed: float) -> Job:
        file = files[job.source]
        own = set_ if file == path else []
        return load_job(file, robot, [*own, f"process.feed_mm_s={feed / MM!r}"])

    return at


def _rows(study: Study, folder: Path, workers: int, cluster: str | None, fresh: bool, quiet: bool) -> list[Row]:
    rows = [] if fresh else study_journal.finished(folder, study.identity)
    rows = [r for r in rows if r["index"] < len(study.scenarios)]
    if len(rows) < len(study.scenarios):
        book = study_journal.Journal(folder, study.identity, rows)
        interrupts.set_outcome("finished scenarios are kept")
        try:
            with _bar(len(study.scenarios), len(rows), quiet) as advance:

                def take(new: list[Row]) -> None:
                    book.add(new)
                    rows.extend(new)
                    advance(len(new))

                run(study, {r["index"] for r in rows}, take, workers, cluster)
        finally:
            book.close()
    return sorted(rows, key=lambda r: r["index"])


@contextmanager
def _bar(total: int, done: int, quiet: bool) -> Iterator[Callable[[int], None]]:
    """Scenarios done and the time left, on a terminal only."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as bar:
        task = bar.add_task("scenarios", total=total, completed=done)
        yield lambda n: bar.advance(task, n)
