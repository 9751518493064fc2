"""The command for CI: path files judged in memory, an outcome for each, and one exit code."""

import os
import time
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.output_files.ownership import check_own_file
from compgen.cli.output_files.publish import write_file
from compgen.cli.screen.ci_reports import SCHEMA, JudgedPath, junit_xml, sarif_text
from compgen.cli.screen.messages import outside_words, print_note_once, print_refusal, reason_of
from compgen.core import interrupts
from compgen.core.commands import Command
from compgen.core.exceptions import InputError, naming_file
from compgen.core.exit_codes import ExitCode

if TYPE_CHECKING:
    from compgen.job.job import Job

Judge = Callable[[str], tuple[dict[str, Any], str]]  # the report of a path, and why it is not inside


def check(
    paths: opt.PathFiles,
    *,
    job: opt.JobChoice,
    junit: Annotated[str | None, typer.Option("--junit", help="Write a JUnit XML file, whatever the outcome.")] = None,
    sarif: opt.Sarif = None,
    written: Annotated[
        str | None,
        typer.Option("--written", help="Judge this program, written earlier, in the state of PATH; generate none."),
    ] = None,
    strict: opt.Strict = False,
    max_um: opt.MaxUm = None,
    screen: opt.FindingScreen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Check path files: generate in memory, prove, write no program; exit 1 outside the bounds.

    Examples:
        cgen check paths/*.toml --junit results.xml
        cgen check paths --sarif results.sarif
        cgen check paths/spiral_1300.toml --json --max-um 5
    """
    if written is not None and len(paths) > 1:
        raise InputError(f"--written {written}: it is the program of one path; give that path alone")
    names = begin_files(paths, junit, sarif, Command.CHECK)

    from compgen.cli.this_machine import use_machine

    use_machine(workers)
    alone = len(paths) == 1
    shown: list[Iterable[object]] = []  # of many paths their reports are enough

    def judge(path: str) -> tuple[dict[str, Any], str]:
        judge_one = _judge_path if written is None else partial(_judge_written, program=written)
        summary, broken, seen = judge_one(job.load(path, max_um), strict=strict, screen=screen)
        shown.extend([seen] if alone else [])
        return summary, broken

    from compgen.cli.screen.job_table import outcomes_shown

    judged = judge_all(names, judge, junit, sarif)
    return outcome_of_all(judged, chain(*shown) if alone else outcomes_shown(judged), alone=alone)


def outcome_of_all(judged: Sequence[JudgedPath], shown: Iterable[object], *, alone: bool) -> Outcome:
    """What becomes of all files together: the worst of any. Of one that stands alone a refusal is the command's."""
    if alone and judged[0].summary is None:
        raise typer.Exit(print_refusal(judged[0].message, judged[0].code or 0))
    messages = [
        one.message if alone or one.message.startswith(one.path) else f"{one.path}: {one.message}"
        for one in judged
        if one.code
    ]
    return Outcome(
        record=judged[0].summary if alone else [_record(one) for one in judged],
        shown=shown,
        errors=messages,
        code=max(one.code or 0 for one in judged),
    )


def _judge_path(job: "Job", *, strict: bool, screen: opt.FindingScreen) -> tuple[dict[str, Any], str, Iterable[object]]:
    """The report of a path whose program is generated, why it is not inside, and what is shown of it."""
    from compgen.cli.screen.job_table import job_shown
    from compgen.cli.screen.progress_bar import CHECK, show_progress
    from compgen.pipelines.planned import generate as pipeline
    from compgen.pipelines.planned.assumed_ramps import judge_ramps
    from compgen.report import job_summary

    with show_progress(CHECK, quiet=screen.is_silent) as progress:
        planned, corrected = pipeline.generate(job, progress)
        corrected = judge_ramps(planned, corrected) if strict else corrected
    summary = job_summary(planned, corrected) | {"command": Command.CHECK}
    shown = job_shown(planned, corrected, None, (), verbose=screen.verbose)
    return summary, outside_words(corrected.findings), shown


def _judge_written(
    job: "Job", *, program: str, strict: bool, screen: opt.FindingScreen
) -> tuple[dict[str, Any], str, Iterable[object]]:
    """The same of a program that was written earlier, in the state that the files say now."""
    from compgen.cli.screen.progress_bar import PREDICT, show_progress
    from compgen.pipelines.correct.program_file import programs_beside, read_program
    from compgen.pipelines.planned.written_program import fly_written
    from compgen.report.job_summary import written_summary

    data = read_program(program)
    with show_progress(PREDICT, quiet=screen.is_silent) as progress, naming_file(f"--written {program}"):
        flight = fly_written(job, data, programs_beside(Path(program)), progress, with_other_ramps=strict)
    summary = written_summary(flight, program)
    return summary, outside_words(flight.findings), _written_shown(summary, verbose=screen.verbose)


def _written_shown(summary: dict[str, Any], *, verbose: bool) -> list[str]:
    """What the program leaves, and the findings."""
    from compgen.cli.screen.messages import finding_rows
    from compgen.report.band_words import guaranteed_text, not_known_words

    written, rises = summary["written"], summary["thermal"]["start_K"]
    before, after = (summary["on_part"][side]["total"] for side in ("before", "after"))
    return [
        f"{written['name']}, {written['positions']} positions, in this state: largest error on the part "
        f"{after['max_um']:.2f} um (p99 {after['p99_um']:.2f}, rms {after['rms_um']:.2f}); planned, not corrected: "
        f"{before['max_um']:.2f} um",
        *([f"rise at the start [K]: {', '.join(f'{n} {rise:.2f}' for n, rise in rises.items())}"] if verbose else []),
        *([guaranteed_text(summary["guaranteed"])] if summary["guaranteed"] else []),
        not_known_words(summary["band"], verbose=verbose),
        *finding_rows(summary["findings"], verbose=verbose),
    ]


def begin_files(paths: list[str], junit: str | None, sarif: str | None, command: Command) -> list[str]:
    """Each path once; the files of what they come to stand from now on, so that a killed run leaves no older ones.

    Raises:
        InputError: A file that is somebody else's.
    """
    if junit is not None:
        check_own_file("--junit", junit, "<testsuite", f"{command} --junit")
    if sarif is not None:
        check_own_file("--sarif", sarif, SCHEMA, f"{command} --sarif")
    names = _distinct(paths)
    _write(junit, sarif, _stopped([], names, 0.0))
    return names


def judge_all(paths: list[str], judge: Judge, junit: str | None, sarif: str | None = None) -> list[JudgedPath]:
    """The outcome of each path, one after the other; its files are written also when the run is stopped.

    Args:
        paths: Each once.
        judge: Returns a path's report, and why it is not inside.
        junit: The file, or None.
        sarif: The same.

    Raises:
        Interrupted: The run was stopped.
    """
    interrupts.raise_on_signal()
    judged: list[JudgedPath] = []
    begun = time.monotonic()
    try:
        for path in paths:
            begun = time.monotonic()
            judged.append(_judge_one(path, judge, begun))
            interrupts.raise_if_interrupted()
    except (interrupts.Interrupted, KeyboardInterrupt):
        _write(junit, sarif, _stopped(judged, paths, time.monotonic() - begun))
        interrupts.set_outcome(
            f"{len(judged)} of {len(paths)} paths were checked" + (f", see {junit}" if junit else "")
        )
        raise
    _write(junit, sarif, judged)
    return judged


def _write(junit: str | None, sarif: str | None, judged: list[JudgedPath]) -> None:
    if junit is not None:
        write_file(Path(junit), junit_xml(judged))
    if sarif is not None:
        write_file(Path(sarif), sarif_text(judged))


def _stopped(judged: list[JudgedPath], paths: list[str], seconds: float) -> list[JudgedPath]:
    """What a run that ends in the middle of a path leaves: that one as an error, those after it as not begun."""
    left = paths[len(judged) :]
    at_work = [JudgedPath(path, ExitCode.INTERRUPTED, seconds, message="the run did not end") for path in left[:1]]
    return [*judged, *at_work, *(JudgedPath(path, None, 0.0) for path in left[1:])]


def _judge_one(path: str, judge: Judge, begun: float) -> JudgedPath:
    """What becomes of a path; what one of them does wrong stops no other."""
    from compgen.core.evaluation import stop_background

    summary = None
    try:
        summary, message = judge(path)
        code = ExitCode.OUTSIDE if message else ExitCode.INSIDE
    except Exception as failure:  # noqa: BLE001  also of a fault of compgen: the other paths are judged all the same
        code, message = reason_of(failure)
    stop_background()
    return JudgedPath(path, code, time.monotonic() - begun, summary, message)


def _distinct(paths: list[str]) -> list[str]:
    """Each file once, by its first name."""
    by_file: dict[str, str] = {}
    for path in paths:
        if by_file.setdefault(os.path.realpath(path), path) is not path:
            print_note_once(f"{path}: given twice; it is checked once")
    return list(by_file.values())


def _record(one: JudgedPath) -> dict[str, Any]:
    """One of several paths under ``--json``; without its time, so that the same inputs give the same bytes."""
    record: dict[str, Any] = {"path": one.path, "exit_code": one.code}
    return record | ({"error": one.message} if one.summary is None else {"report": one.summary})
