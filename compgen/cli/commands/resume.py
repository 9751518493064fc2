"""The command that writes the rest of a job in pages anew, for what the robot is now."""

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_page_folders
from compgen.cli.options.page_options import PageChoice, page_files, page_options
from compgen.cli.output_files.marker import Run, command_in
from compgen.cli.output_files.ownership import RESUME_FILES
from compgen.cli.screen.messages import finding_lines, print_table, stdout_console
from compgen.core import stages
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.exceptions import InputError
from compgen.core.findings import first_message
from compgen.core.json_text import json_text

if TYPE_CHECKING:
    from compgen.job.job import Job
    from compgen.pipelines.resume.beginning import Beginning, Known
    from compgen.pipelines.resume.corrected import Begin, ResumedProgram
    from compgen.pipelines.resume.corrected_job import CorrectedJob
    from compgen.pipelines.resume.result import Resumed
    from compgen.pipelines.resume.whole import Whole
    from compgen.report.page import PageOptions

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """What the robot is when the first new page starts: one of three ways to say it."""

    state: opt.StateFile = None
    state_age: opt.StateAge = None
    log: Annotated[str | None, typer.Option("--log", help="Thermocouple log so far; the page starts at its end.")] = (
        None
    )
    late: Annotated[
        str | None, typer.Option("--late", help="How long the page waits after the one before, servo on: 35min.")
    ] = None

    @property
    def waits(self) -> float:
        """How long the page waits [s]."""
        return opt.duration(self.late, "--late") if self.late is not None else 0.0

    def check(self) -> None:
        """Raises InputError where not one of the three is given, or a value is none."""
        from compgen.job.anchored_start import seconds_of_age

        causes = (("--state", self.state), ("--log", self.log), ("--late", self.late))
        given = [option for option, value in causes if value is not None]
        if len(given) != 1:
            raise InputError(
                f"resume: {' and '.join(given) or 'nothing'} given; say with one of --state, --log and --late what the "
                "robot is"
            )
        if self.late is not None:
            opt.duration(self.late, "--late")
        if self.state_age is not None:
            seconds_of_age(self.state_age)
            if self.state is None:
                raise InputError("--state-age: is of a state; name its file with --state")

    @property
    def age(self) -> float:
        """How long before the start the state was [s]."""
        from compgen.job.anchored_start import seconds_of_age

        return seconds_of_age(self.state_age) if self.state_age is not None else 0.0

    def begin(self, whole: "Whole", known: "Known") -> "Beginning":
        """How the first new page of a job begins."""
        from compgen.pipelines.resume.beginning import begin_late
        from compgen.pipelines.resume.from_log import begin_with_log
        from compgen.pipelines.resume.from_state import begin_with_state

        if self.state is not None:
            return begin_with_state(whole, known, self.state, self.age)
        return begin_with_log(whole, known, self.log) if self.log is not None else begin_late(whole, known, self.waits)

    def begin_corrected(self, job: "CorrectedJob") -> "Begin":
        """The same of the pages of a corrected program."""
        from compgen.pipelines.resume.corrected import begin_late_anew, begin_with_log_anew, begin_with_state_anew

        if self.state is not None:
            return begin_with_state_anew(job.plain, self.state, self.age)
        return begin_with_log_anew(self.log) if self.log is not None else begin_late_anew(self.waits)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progressed:
    """How far a job is."""

    loaded: LoadedPages = 0
    done: Annotated[int, typer.Option("--done", help="The last page that has run.")] = 0


@dataclass(frozen=True, slots=True)
class Place:
    """A folder of pages, and what a page of its reports is made with."""

    folder: Path
    choice: PageChoice
    options: "PageOptions"

    def put_anew(self, resumed: "Resumed | ResumedProgram") -> None:
        """Put new pages, their manifest and their report into the folder, all of them or none."""
        from compgen.pipelines.resume.result import Resumed
        from compgen.report.resume import program_html, program_summary, resume_html, resume_summary

        if isinstance(resumed, Resumed):
            self._put(resumed, json_text(resume_summary(resumed)), resume_html(resumed, self.options))
        else:
            self._put(resumed, json_text(program_summary(resumed)), program_html(resumed, self.options))

    def _put(self, resumed: "Resumed | ResumedProgram", record: bytes, html: bytes) -> None:
        """Put new pages and their manifest with their report and its figures into the folder, all of them or none.

        Raises:
            InputError: A report of another stands there, or the folder cannot be written.
        """
        from compgen.cli.output_files.replace_together import replace_together

        is_own = command_in(self.folder / RESUME_FILES[0]) is Command.RESUME
        foreign = next((name for name in RESUME_FILES if (self.folder / name).exists() and not is_own), None)
        if foreign:
            file = self.folder / foreign
            raise InputError(f"{file}: it is there and not what cgen resume or follow wrote; move it away")
        reports = dict(zip(RESUME_FILES, (record, html), strict=True))
        changed = {name: data for name, data in resumed.files.items() if name not in resumed.unchanged}
        files = {**page_files(self.folder, reports, self.choice, self.options), **changed}
        replace_together(self.folder, files, Run(Command.RESUME))


def resume(
    folder: PagesFolder,
    *,
    from_page: Annotated[int, typer.Option("--from-page", help="The first page to write anew, from 1.")],
    cause: Cause,
    at: Progressed,
    max_um: opt.MaxUm = None,
    path: JobPath = None,
    robot: opt.JobRobot = None,
    date: RecordDate = None,
    force: Annotated[bool, typer.Option("--force", help="Write the pages even outside their bounds.")] = False,
    page: PageChoice,
    screen: opt.Screen,
    workers: opt.Workers = 0,
) -> Outcome:
    """Write the remaining pages of a job anew, under their names, for what the robot is when the next one starts.

    Examples:
        cgen resume outputs/optic_spiral --from-page 2 --late 35min
        cgen resume outputs/optic_spiral --from-page 2 --log temperatures.csv --max-um 5
    """
    from compgen.cli.machine import use_machine
    from compgen.cli.output_files.replace_together import finish_replacing
    from compgen.cli.screen.progress_bar import RESUME, show_progress
    from compgen.cli.screen.resume_table import show_resumed
    from compgen.pipelines.resume.corrected_job import read_corrected
    from compgen.pipelines.resume.resume import require_free
    from compgen.pipelines.resume.resume import resume as pipeline
    from compgen.pipelines.resume.whole import plan_whole
    from compgen.pipelines.resume.written_job import CORRECTED, job_of, read_written_job
    from compgen.report.resume import resume_summary

    cause.check()
    when = checked_moment(date)
    place = Place(Path(folder), page, page_options(Path(folder), page, date))
    finish_replacing(place.folder)
    written = read_written_job(place.folder)
    require_free(written, from_page, at.loaded, at.done)
    bound = opt.checked_bound(max_um)
    use_machine(workers)
    if CORRECTED in written.record:
        job = read_corrected(written, robot, max_um)
        return _resume_corrected(job, from_page, cause, at, when, place, force=force, silent=screen.is_silent)
    with show_progress(RESUME, quiet=screen.is_silent) as progress:
        whole = plan_whole(within(job_of(written, path, robot), bound), progress)
        resumed = pipeline(
            written, whole, from_page, partial(cause.begin, whole), when, progress, loaded=at.loaded, done=at.done
        )
        progress(stages.REPORT, 0.0)
        is_written = bool(resumed.replaced) and (resumed.inside or force)
        if is_written:
            place.put_anew(resumed)
    errors = []
    if not resumed.inside:
        broken = first_message(Level.OUTSIDE, resumed.findings)
        ending = "written all the same (--force)" if force else "nothing was written; --force writes the pages"
        errors.append(f"{resumed.verdict}: {broken}; {ending}")
    return Outcome(
        record=resume_summary(resumed),
        show=partial(show_resumed, resumed, place.folder, is_written=is_written),
        errors=errors,
    )


def _resume_corrected(
    job: "CorrectedJob",
    from_page: int,
    cause: Cause,
    at: Progressed,
    date: str,
    place: Place,
    *,
    force: bool,
    silent: bool,
) -> Outcome:
    """Write the remaining pages of a corrected program anew."""
    from compgen.cli.screen.progress_bar import CORRECT, show_progress
    from compgen.pipelines.resume.corrected import resume_corrected
    from compgen.report.resume import program_summary

    begin = cause.begin_corrected(job)
    with show_progress(CORRECT, quiet=silent) as progress:
        resumed = resume_corrected(job, from_page, begin, date, progress, at.loaded, at.done)
        usable = resumed.is_usable
        is_written = bool(resumed.replaced) and (usable or force)
        report = json_text(program_summary(resumed))
        if is_written:
            place.put_anew(resumed)
    errors = []
    if not resumed.correction.inside:
        broken = first_message(Level.OUTSIDE, resumed.findings)
        ending = "written all the same" if is_written or usable else "nothing was written; --force writes the pages"
        errors.append(f"{resumed.verdict}: {broken}; {ending}")
    show = partial(_show_corrected, resumed, place.folder, is_written=is_written)
    return Outcome(record=report, show=show, errors=errors)


def _show_corrected(resumed: "ResumedProgram", folder: Path, *, is_written: bool) -> None:
    from compgen.cli.screen.resume_table import pages_table
    from compgen.pipelines.resume.corrected import words_of

    console = stdout_console()
    print_table(console, f"{resumed.correction.name} from page {resumed.from_page} on", pages_table(resumed.pages))
    lines = [*words_of(resumed), *finding_lines(resumed.findings)]
    if is_written:
        lines.append(f"wrote {', '.join(resumed.replaced)} anew, {resumed.written.manifest_file} in {folder}")
    elif not resumed.replaced:
        lines.append("nothing to do: the pages in the folder are these already")
    for line in lines:
        console.print(line)


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
