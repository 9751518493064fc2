"""The command that writes the rest of a job in pages anew, for what the robot is now."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_page_folders
from compgen.cli.options.durations import duration
from compgen.cli.options.page_options import Assets, AssetsOption, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.screen.messages import print_error, print_record
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.exceptions import InputError
from compgen.core.findings import first_message

if TYPE_CHECKING:
    from compgen.job.job import Job

PagesFolder = Annotated[
    str,
    typer.Argument(
        autocompletion=complete_page_folders, help="The folder that cgen generate wrote pages into.", show_default=False
    ),
]
JobPath = Annotated[
    str | None, typer.Option("--path", help="Where the path file is now; default where it was, seen from here.")
]
LoadedPages = Annotated[int, typer.Option("--loaded", help="The last page that the controller has.")]
RecordDate = Annotated[
    str | None, typer.Option("--date", help="When, for the record, default now (UTC); on the page if given.")
]


def resume(
    folder: PagesFolder,
    from_page: Annotated[int, typer.Option("--from-page", help="The first page to write anew, from 1.")],
    state: opt.StateFile = None,
    state_age: opt.StateAge = None,
    log: Annotated[
        str | None, typer.Option("--log", help="Thermocouple log so far; the page starts at its end.")
    ] = None,
    late: Annotated[
        str | None, typer.Option("--late", help="How long the page waits after the one before, servo on: 35min.")
    ] = None,
    loaded: LoadedPages = 0,
    done: Annotated[int, typer.Option("--done", help="The last page that has run.")] = 0,
    max_um: opt.MaxUm = None,
    path: JobPath = None,
    robot: opt.JobRobot = None,
    date: RecordDate = None,
    force: Annotated[bool, typer.Option("--force", help="Write the pages even outside their bounds.")] = False,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Write the remaining pages of a job anew, under their names, for what the robot is when the next one starts."""
    from compgen.cli.commands.resume_corrected import resume_corrected_program
    from compgen.cli.commands.resume_files import put_pages
    from compgen.cli.machine import use_machine
    from compgen.cli.output_files.replace_together import finish_replacing
    from compgen.cli.screen.progress_bar import RESUME, show_progress
    from compgen.cli.screen.resume_table import show_resumed
    from compgen.job.anchored_start import seconds_of_age
    from compgen.pipelines.resume.beginning import Beginning, Known, begin_late
    from compgen.pipelines.resume.from_log import begin_with_log
    from compgen.pipelines.resume.from_state import begin_with_state
    from compgen.pipelines.resume.resume import require_free
    from compgen.pipelines.resume.resume import resume as pipeline
    from compgen.pipelines.resume.whole import plan_whole
    from compgen.pipelines.resume.written_job import CORRECTED, job_of, read_written_job
    from compgen.report.resume import resume_summary

    causes = (("--state", state), ("--log", log), ("--late", late))
    given = [option for option, value in causes if value is not None]
    if len(given) != 1:
        raise InputError(
            f"resume: {' and '.join(given) or 'nothing'} given; say with one of --state, --log and --late what the "
            "robot is"
        )
    waits = duration(late, "--late") if late is not None else 0.0
    age = seconds_of_age(state_age) if state_age is not None else 0.0
    if state_age is not None and state is None:
        raise InputError("--state-age: is of a state; name its file with --state")
    when = checked_moment(date)
    place = Path(folder)
    options = page_options(place, assets, date)
    finish_replacing(place)
    written = read_written_job(place)
    require_free(written, from_page, loaded, done)
    bound = opt.checked_bound(max_um)
    use_machine(workers)
    if CORRECTED in written.record:
        resume_corrected_program(
            written,
            place,
            from_page,
            state=state,
            age=age,
            late=waits if late is not None else None,
            log=log,
            date=when,
            loaded=loaded,
            done=done,
            robot=robot,
            max_um=max_um,
            force=force,
            as_json=as_json,
            quiet=quiet,
            options=options,
            figures=figures,
        )
        return
    with show_progress(quiet or as_json, RESUME) as progress:
        whole = plan_whole(within(job_of(written, path, robot), bound), progress)

        def begin(known: Known) -> Beginning:
            if state is not None:
                return begin_with_state(whole, known, state, age)
            return begin_with_log(whole, known, log) if log is not None else begin_late(whole, known, waits)

        resumed = pipeline(
            written, whole, from_page, begin=begin, date=when, progress=progress, loaded=loaded, done=done
        )
        progress(stages.REPORT, 0.0)
        is_written = bool(resumed.replaced) and (resumed.inside or force)
        if is_written:
            put_pages(place, resumed, options, figures)
    if as_json:
        print_record(resume_summary(resumed))
    elif not quiet:
        show_resumed(resumed, place, is_written=is_written)
    if not resumed.inside:
        broken = first_message(Level.OUTSIDE, resumed.findings)
        ending = "written all the same (--force)" if force else "nothing was written; --force writes the pages"
        raise typer.Exit(print_error(f"{resumed.verdict}: {broken}; {ending}", 1))


def within(job: "Job", bound: float | None) -> "Job":
    """A job whose error on the part may be so large [m], in place of what its path file says; None: as it says."""
    return job if bound is None else replace(job, bounds=replace(job.bounds, max=bound))


def checked_moment(date: str | None) -> str:
    """A date for a record as it was given, or the clock's.

    Raises:
        InputError: Not a date.
    """
    if date is None:
        return datetime.now(UTC).isoformat(timespec="seconds")
    try:
        datetime.fromisoformat(date)
    except ValueError:
        raise InputError(f"--date {date!r:.40}: not a date; write it as 2026-01-31 or 2026-01-31T14:05") from None
    return date
