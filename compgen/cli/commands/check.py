"""The command for CI: path files judged in memory, an outcome for each, and one exit code."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli.commands.check_written import judge_written, refuse_several, show_written
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import write_file
from compgen.cli.screen.junit import INTERRUPTED, Outcome, junit_xml
from compgen.cli.screen.messages import (
    outcome_words,
    print_error,
    print_note_once,
    print_record,
    print_refusal,
    reason_of,
)
from compgen.core import interrupts
from compgen.core.commands import Command

Judge = Callable[[str], tuple[dict[str, Any], str]]  # the report of a path, and why it is not inside


def check(
    paths: opt.PathFiles,
    robot: opt.JobRobot = None,
    overrides: opt.Overrides = None,
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    junit: Annotated[str | None, typer.Option("--junit", help="Write a JUnit XML file, whatever the outcome.")] = None,
    written: Annotated[
        str | None,
        typer.Option("--written", help="Judge this program, written earlier, in the state of PATH; generate none."),
    ] = None,
    strict: opt.Strict = False,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Generate in memory and verify; exit 1 outside the bounds. Writes no program."""
    refuse_several(written, paths)
    bounded = opt.with_bound(overrides, max_um)
    if junit is not None:
        check_own_file("--junit", junit, b"<testsuite", "check --junit")
    names = _distinct(paths)
    alone = len(paths) == 1
    _write(junit, _stopped([], names, 0.0))  # a run that is killed leaves no older file behind

    from compgen.cli.machine import use_machine
    from compgen.cli.screen.job_table import show_job, show_outcomes
    from compgen.cli.screen.progress_bar import CHECK, show_progress
    from compgen.core.codes import Level
    from compgen.core.findings import first_message
    from compgen.pipelines.files.path_file import load_job
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.assumed_ramps import judge_ramps
    from compgen.report import job_summary

    use_machine(workers)

    judged: list[tuple[Any, Any]] = []  # to be shown; of many paths their reports are enough

    def judge(path: str) -> tuple[dict[str, Any], str]:
        if written is not None:
            changes = opt.with_state(path, bounded, state, state_age)
            return judge_written(path, robot, changes, written, strict, quiet or as_json)
        with show_progress(quiet or as_json, CHECK) as progress:
            job = load_job(path, robot, opt.with_state(path, bounded, state, state_age))
            planned, corrected = pipeline.generate(job, progress)
            corrected = judge_ramps(planned, corrected) if strict else corrected
        if alone:
            judged.append((planned, corrected))
        broken = first_message(Level.OUTSIDE, corrected.findings)
        summary = job_summary(planned, corrected) | {"command": Command.CHECK}
        return summary, f"{outcome_words(corrected.verdict)}: {broken}" if broken else ""

    outcomes = judge_all(names, judge, junit)
    worst = max(outcome.code or 0 for outcome in outcomes)
    if alone and outcomes[0].summary is None:
        raise typer.Exit(print_refusal(outcomes[0].message, worst))
    if as_json:
        print_record(outcomes[0].summary if alone else [_record(outcome) for outcome in outcomes])
    elif alone and not quiet and judged:
        show_job(*judged[0], None, {})
    elif alone and not quiet:
        show_written(outcomes[0].summary or {})
    elif not quiet:
        show_outcomes(outcomes)
    for outcome in outcomes:
        if outcome.code:
            named = alone or outcome.message.startswith(outcome.path)
            print_error(outcome.message if named else f"{outcome.path}: {outcome.message}", outcome.code)
    if worst:
        raise typer.Exit(worst)


def judge_all(paths: list[str], judge: Judge, junit: str | None) -> list[Outcome]:
    """The outcome of each path, one after the other; the JUnit file is written also when the run is stopped.

    Args:
        paths: Each once.
        judge: Returns a path's report, and why it is not inside.
        junit: The file, or None.

    Raises:
        Interrupted: The run was stopped.
    """
    interrupts.raise_on_signal()
    outcomes: list[Outcome] = []
    begun = time.monotonic()
    try:
        for path in paths:
            begun = time.monotonic()
            outcomes.append(_outcome(path, judge, begun))
            interrupts.raise_if_interrupted()
    except (interrupts.Interrupted, KeyboardInterrupt):
        _write(junit, _stopped(outcomes, paths, time.monotonic() - begun))
        interrupts.set_outcome(
            f"{len(outcomes)} of {len(paths)} paths were checked" + (f", see {junit}" if junit else "")
        )
        raise
    _write(junit, outcomes)
    return outcomes


def _write(junit: str | None, outcomes: list[Outcome]) -> None:
    if junit is not None:
        write_file(Path(junit), junit_xml(outcomes))


def _stopped(outcomes: list[Outcome], paths: list[str], seconds: float) -> list[Outcome]:
    """What a run that ends in the middle of a path leaves: that one as an error, those after it as not begun."""
    at_work = [
        Outcome(path, INTERRUPTED, seconds, message="the run did not end") for path in paths[len(outcomes) :][:1]
    ]
    return [*outcomes, *at_work, *(Outcome(path, None, 0.0) for path in paths[len(outcomes) + 1 :])]


def _outcome(path: str, judge: Judge, begun: float) -> Outcome:
    """What becomes of a path; what one of them does wrong stops no other."""
    from compgen.core.evaluation import stop_background

    summary = None
    try:
        summary, message = judge(path)
        code = 1 if message else 0
    except Exception as failure:  # noqa: BLE001  also of a fault of compgen: the other paths are judged all the same
        code, message = reason_of(failure)
    stop_background()
    return Outcome(path, code, time.monotonic() - begun, summary, message)


def _distinct(paths: list[str]) -> list[str]:
    """Each file once, by its first name."""
    by_file: dict[str, str] = {}
    for path in paths:
        first = by_file.setdefault(os.path.realpath(path), path)
        if first is not path:
            print_note_once(f"{path}: given twice; it is checked once")
    return list(by_file.values())


def _record(outcome: Outcome) -> dict[str, Any]:
    """One of several paths under ``--json``; without its time, so that the same inputs give the same bytes."""
    record: dict[str, Any] = {"path": outcome.path, "exit_code": outcome.code}
    return record | ({"error": outcome.message} if outcome.summary is None else {"report": outcome.summary})
