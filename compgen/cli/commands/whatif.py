"""Commands on a job's warmth: whatif varies anything and answers what people ask of it, heat follows its day."""

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_keys, complete_paths, one_of
from compgen.cli.options.page_options import PageChoice, PageDate, PagePlace, page_place
from compgen.cli.output_files import study_files as files_of_study
from compgen.cli.output_files.marker import Run
from compgen.cli.output_files.ownership import check_folder
from compgen.cli.output_files.publish import publish
from compgen.cli.output_files.study_files import QUESTIONS, RECORD, own_files, study_folder
from compgen.cli.screen.messages import finding_lines
from compgen.core import interrupts
from compgen.core.commands import Command
from compgen.core.exceptions import CompgenError, InputError
from compgen.core.findings import beyond_text
from compgen.core.units import UM

if TYPE_CHECKING:
    from compgen.pipelines.study import Study, StudyRow
    from compgen.report.live import LiveSection
    from compgen.report.study_tables import StudyOutcome

MOST_FAILED = 10  # scenarios that are named
HEAT_RECORD, HEAT_TABLES = "heat.json", ("heat.csv", "heat.html", "runs.csv")


@dataclass(frozen=True, slots=True, kw_only=True)
class Questions:
    """What is asked of a path's warmth."""

    asked: Annotated[
        list[str] | None,
        typer.Option("--ask", autocompletion=one_of(*QUESTIONS), help=f"{', '.join(QUESTIONS)}; repeatable."),
    ] = None
    within_um: Annotated[float, typer.Option("--within-um", help="The X of the questions [um].")] = 5.0
    pass_paths: Annotated[
        list[str] | None,
        typer.Option("--pass", autocompletion=complete_paths, help="Path files, for passes."),
    ] = None
    feeds: Annotated[str | None, typer.Option("--feeds", help="Feeds for passes, mm/s: 20,100,200.")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenarios:
    """What is varied, and how it is computed."""

    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary", autocompletion=complete_keys, help="KEY=V1,V2,... or KEY=FROM:TO:COUNT; repeat for a grid."
        ),
    ] = None
    listed: Annotated[str | None, typer.Option("--list", help="CSV with keys as header, a scenario a row.")] = None
    correct: Annotated[bool, typer.Option("--correct", help="Correct and prove each scenario as well.")] = False
    cluster: Annotated[
        str | None,
        typer.Option(
            "--cluster",
            help="A Dask scheduler's address; it is trusted (pickles go both ways); tls:// by Dask's settings.",
        ),
    ] = None
    fresh: Annotated[bool, typer.Option("--fresh", help="Forget finished scenarios of an earlier run.")] = False
    workers: opt.Workers = 0


Sliders = Annotated[
    bool, typer.Option("--live/--no-live", help="Sliders on the page; they take one corrected program.")
]
StudyFolder = Annotated[
    str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_whatif.")
]


def whatif(
    path: opt.PathFile,
    *,
    scenarios: Scenarios,
    questions: Questions,
    live: Sliders = True,
    job: opt.JobChoice,
    output: StudyFolder = None,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
) -> Outcome:
    """Move the day with sliders; vary any key, predict (and correct) every scenario, answer questions.

    Examples:
        cgen whatif paths/spiral_1300.toml --vary process.feed_mm_s=20:200:7 -o out
        cgen whatif paths/spiral_1300.toml --vary before.0.duty=0.25,0.5,1 --correct --max-um 5
        cgen whatif paths/spiral_1300.toml --ask warmup --ask validity --within-um 5
    """
    from compgen.pipelines.study import build
    from compgen.pipelines.study.questions import answer_questions, base_job, check_study
    from compgen.report.live import NONE
    from compgen.report.study_tables import StudyOutcome

    robot, vary, listed, asked = job.robot, scenarios.vary or (), scenarios.listed, questions.asked or []
    changes = job.changes(path, max_um if scenarios.correct else None)
    varied = bool(vary or listed)
    if max_um is not None and not varied:
        raise InputError(f"--max-um {max_um:g}: no scenario to judge; give --vary KEY=V1,V2 or --list FILE.csv")
    check_study(asked, questions.within_um, varied=varied or live)
    study = build(path, robot, changes, vary, listed, correct=scenarios.correct) if varied else None
    folder, identity = opt.output_folder(path, output, "_whatif"), study.identity if study else None
    folder = study_folder(folder, path, identity, {*asked}, is_chosen=output is not None, fresh=scenarios.fresh)
    place = page_place(folder, page, date)
    within, passes = questions.within_um * UM, questions.pass_paths or []
    answers = answer_questions(path, robot, changes, asked, within, passes, questions.feeds)
    rows = _run_scenarios(study, folder, scenarios, silent=screen.is_silent) if study else []
    alone = study is None and not answers
    living = _sliders(path, robot, changes, silent=screen.is_silent, alone=alone) if live else NONE
    base = base_job(path, robot, changes)
    outcome = StudyOutcome(study=study, rows=rows, answers=answers, base=base, max_um=max_um)
    return _publish(path, changes, outcome, living, place, fresh=scenarios.fresh, verbose=screen.verbose)


def _publish(
    path: str,
    changes: Sequence[str],
    outcome: "StudyOutcome",
    living: "LiveSection",
    place: PagePlace,
    *,
    fresh: bool,
    verbose: bool,
) -> Outcome:
    """Put the journal and the reports of a study, and of what was asked, into their folder."""
    from compgen.report.study_page import study_files, study_sentences

    study, rows, base = outcome.study, outcome.rows, outcome.base
    journal = {files_of_study.JOURNAL: files_of_study.journal_text(study.identity, rows)} if study else {}
    files = study_files(path, changes, outcome, place.options, living)
    reports, run = place.files(files), Run(Command.WHATIF, Path(path).stem)
    publish(place.folder, journal, reports, own_files() if fresh else (), run=run)
    failed = [row for row in rows if row["state"] == "failed"]
    inputs = (*(base.input_findings if base is not None else ()), *(study.questions if study else ()))
    lines = [
        *study_sentences(outcome),
        *([living.sentence] if living.sentence else []),
        *finding_lines({finding.message: finding for finding in inputs}.values(), verbose=verbose),
        *(f"failed: scenario {row['index']}: {row['reason']}" for row in failed[:MOST_FAILED]),
        f"wrote {', '.join(sorted([*journal, *files]))} to {place.folder}",
    ]
    return Outcome(record=files[RECORD], lines=lines, errors=_reasons(rows, outcome.max_um))


def _reasons(rows: "list[StudyRow]", max_um: float | None) -> list[str]:
    """Why scenarios are not inside: all failed, one did, or its error, corrected where it was, is too large."""
    failed = [row for row in rows if row["state"] == "failed"]
    if failed and len(failed) == len(rows):
        return [f"every scenario failed: {rows[0]['reason']}"]
    if max_um is None or not rows:
        return []
    if failed:
        return [f"scenario {failed[0]['index']} failed: {failed[0]['reason']}"]
    outside = next((row for row in rows if not row.get("inside", True)), None)
    if outside is not None:
        return [f"scenario {outside['index']}: {outside['reason']}"]
    worst = max(rows, key=lambda row: row["before_on_part_max_um"])
    if "inside" in worst or worst["before_on_part_max_um"] <= max_um:
        return []
    size = beyond_text(worst["before_on_part_max_um"], max_um)
    return [f"scenario {worst['index']}: {size} um uncorrected, --max-um {max_um:g}"]


def _sliders(path: str, robot: str | None, overrides: Sequence[str], *, silent: bool, alone: bool) -> "LiveSection":
    """The living section of a path's page, checked against the full computation; or what a path without one misses.

    Args:
        path: The path file.
        robot: Robot name or file; None for what the path file says.
        overrides: Of both files.
        silent: No progress.
        alone: Whether nothing else is on the page.

    Raises:
        CompgenError: The path cannot be read, driven or corrected, and there is nothing else on the page.
    """
    from compgen.cli.screen.progress_bar import GENERATE, show_progress
    from compgen.pipelines.study.live_build import build_live, check_agreement
    from compgen.report.live import live_section, without_sliders

    try:
        with show_progress(GENERATE, quiet=silent) as progress:
            live_job = build_live(path, robot, overrides, progress)
            agreement = check_agreement(live_job)
    except CompgenError as failure:
        if alone:
            raise
        return without_sliders(" ".join(str(failure).split()))
    section = live_section(live_job, agreement, path, robot, overrides)
    if section.warning:
        sys.stderr.write(f"warning: {section.warning}\n")
    return section


def _run_scenarios(study: "Study", folder: Path, choice: Scenarios, *, silent: bool) -> "list[StudyRow]":
    """The rows of all scenarios, kept on disk as they come; those of an earlier run are taken, unless ``fresh``."""
    from compgen.pipelines.study import run

    rows: list[dict[str, Any]] = [] if choice.fresh else files_of_study.read_finished(folder, study.identity)
    rows = [row for row in rows if row["index"] < len(study.scenarios)]
    if len(rows) < len(study.scenarios):
        interrupts.set_outcome("finished scenarios are kept")
        interrupts.raise_on_signal()
        journal = files_of_study.Journal(folder, study.identity, rows)
        try:
            with _scenario_bar(len(study.scenarios), len(rows), silent=silent) as advance:

                def keep(new: "list[StudyRow]") -> None:
                    journal.add(new)
                    rows.extend(new)
                    advance(len(new))

                run(study, {row["index"] for row in rows}, keep, choice.workers, choice.cluster)
        except CompgenError:
            journal.discard_empty()
            raise
        finally:
            journal.close()
    return sorted(rows, key=lambda row: row["index"])


@contextmanager
def _scenario_bar(total: int, done: int, *, silent: bool) -> Iterator[Callable[[int], None]]:
    """Scenarios done and the time left, on a terminal only."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True, force_terminal=sys.stderr.isatty())
    if silent or not console.is_terminal:  # a bar that is disabled still ends its line before rich 14.3
        yield lambda count: None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("scenarios", total=total, completed=done)
        yield lambda count: bar.advance(task, count)


def heat(
    path: opt.PathFile,
    *,
    job: opt.JobChoice,
    output: Annotated[
        str | None, typer.Option("-o", "--output", help="Folder for the results; default outputs/<path name>_heat.")
    ] = None,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    date: PageDate = None,
    screen: opt.FindingScreen,
    cores: opt.Cores,
) -> Outcome:
    """Follow the warmth over [[before]], [[cycle]] and [[after]], and what one corrected file is worth in each run.

    Examples:
        cgen heat paths/spiral_1300.toml
        cgen heat paths/spiral_1300.toml --json --max-um 20
    """
    from compgen.pipelines.study import timeline
    from compgen.report.heat_page import heat_csv, heat_html, heat_json, heat_sentences, runs_csv

    folder = opt.output_folder(path, output, "_heat")
    planned = job.load(path)
    run = Run(Command.HEAT, planned.name)
    check_folder(folder, run, record=HEAT_RECORD, others=HEAT_TABLES)
    place = page_place(folder, page, date)
    day = timeline(planned)
    contents = (heat_csv(planned, day), heat_html(planned, day, place.options, max_um), runs_csv(planned, day))
    files = {HEAT_RECORD: heat_json(planned, day), **dict(zip(HEAT_TABLES, contents, strict=True))}
    publish(folder, {}, place.files(files), run=run)
    lines = [
        *heat_sentences(planned, day, verbose=screen.verbose),
        *finding_lines(day.findings, verbose=screen.verbose),
    ]
    lines.append(f"wrote {', '.join(sorted(files))} to {folder}")
    where = f" in run {int(day.residual.argmax()) + 1}"
    errors = opt.beyond_bound("one file is off by {}", float(day.residual.max()), max_um, where)
    return Outcome(record=files[HEAT_RECORD], lines=lines, errors=errors)
