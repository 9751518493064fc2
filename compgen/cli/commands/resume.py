"""The command that writes the rest of a job in pages anew, for what the robot is now."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.options import options as opt
from compgen.cli.options.completion import complete_page_folders
from compgen.cli.options.page_options import PageChoice, PagePlace, page_place
from compgen.cli.output_files.marker import Run, command_in
from compgen.cli.output_files.ownership import RESUME_FILES
from compgen.cli.screen.messages import finding_lines, outside_words, sizes_table, titled
from compgen.core import stages
from compgen.core.commands import Command
from compgen.core.dates import duration
from compgen.core.exceptions import InputError
from compgen.core.json_text import json_text
from compgen.core.units import UM, limit_words

if TYPE_CHECKING:
    from rich.table import Table

    from compgen.job.job import Job
    from compgen.pipelines.resume.beginning import Begun, PromptStart
    from compgen.pipelines.resume.corrected_rest import ResumedProgram
    from compgen.pipelines.resume.result import PageResult, Resumed

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
class ResumeCause:
    """What the robot is when the first new page starts: one of three ways to say it."""

    state: opt.StateFile = None
    state_age: opt.StateAge = None
    log: Annotated[str | None, typer.Option("--log", help="Thermocouple log so far; the page starts at its end.")] = (
        None
    )
    late: Annotated[
        str | None, typer.Option("--late", help="How long the page waits after the one before, servo on: 35min.")
    ] = None

    def check(self) -> None:
        """Raises InputError where none of the three, or both a state and a log are given, or a value is none."""
        from compgen.job.anchored_start import seconds_of_age

        causes = (("--state", self.state), ("--log", self.log), ("--late", self.late))
        given = [option for option, value in causes if value is not None]
        if not given or {"--state", "--log"} <= {*given}:
            raise InputError(
                f"resume: {' and '.join(given) or 'nothing'} given; say with one of --state, --log and --late what the "
                "robot is"
            )
        if self.late is not None:
            duration(self.late, "--late")
        if self.state_age is not None and seconds_of_age(self.state_age) >= 0 and self.state is None:
            raise InputError("--state-age: is of a state; name its file with --state")

    def begin(self, known: "PromptStart") -> "Begun":
        """How the first new page begins."""
        from compgen.job.anchored_start import seconds_of_age
        from compgen.pipelines.resume.beginning import begin_late, begin_with_log, begin_with_state

        late = None if self.late is None else duration(self.late, "--late")
        if self.state is not None:
            return begin_with_state(known, self.state, seconds_of_age(self.state_age), late)
        if self.log is not None:
            return begin_with_log(known, self.log, late)
        return begin_late(known, late or 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progressed:
    """How far a job is."""

    loaded: LoadedPages = 0
    done: Annotated[int, typer.Option("--done", help="The last page that has run.")] = 0


def resume(
    folder: PagesFolder,
    *,
    from_page: Annotated[int, typer.Option("--from-page", help="The first page to write anew, from 1.")],
    cause: ResumeCause,
    at: Progressed,
    max_um: opt.MaxUm = None,
    path: JobPath = None,
    robot: opt.JobRobot = None,
    date: RecordDate = None,
    force: Annotated[bool, typer.Option("--force", help="Write the pages even outside their bounds.")] = False,
    page: PageChoice,
    screen: opt.FindingScreen,
    cores: opt.CompiledCores,
) -> Outcome:
    """Write the remaining pages of a job anew, under their names, for what the robot is when the next one starts.

    Examples:
        cgen resume outputs/optic_raster --from-page 5 --late 35min
        cgen resume outputs/optic_raster --from-page 5 --log temperatures.csv --max-um 5
    """
    from compgen.cli.output_files.replace_together import finish_replacing
    from compgen.cli.screen.progress_bar import CORRECT, RESUME, show_progress
    from compgen.pipelines.resume.corrected_job import read_corrected
    from compgen.pipelines.resume.corrected_rest import resume_corrected
    from compgen.pipelines.resume.rest import plan_whole
    from compgen.pipelines.resume.resume import require_free
    from compgen.pipelines.resume.resume import resume as pipeline
    from compgen.pipelines.resume.written_job import job_of_pages, read_written_job

    cause.check()
    when = checked_moment(date)
    place = page_place(Path(folder), page, date)
    finish_replacing(place.folder)
    written = read_written_job(place.folder)
    require_free(written, from_page, at.loaded, at.done)
    resumed: Resumed | ResumedProgram
    with show_progress(CORRECT if written.is_corrected else RESUME, quiet=screen.is_silent) as progress:
        if written.is_corrected:
            program = read_corrected(written, robot, max_um)
            resumed = resume_corrected(program, from_page, cause.begin, when, progress, at.loaded, at.done)
        else:
            job = within(job_of_pages(written, path, robot), opt.bound_of(max_um))
            whole = plan_whole(job, progress)
            resumed = pipeline(written, whole, from_page, cause.begin, when, progress, loaded=at.loaded, done=at.done)
        progress(stages.REPORT, 0.0)
        is_written = bool(resumed.replaced) and (resumed.is_usable or force)
        if is_written:
            put_anew(place, resumed)
    return _outcome(resumed, place.folder, is_written=is_written, verbose=screen.verbose)


def _outcome(resumed: "Resumed | ResumedProgram", folder: Path, *, is_written: bool, verbose: bool) -> Outcome:
    """What became of the pages, and why they are not inside."""
    from compgen.report.resume import unwritten
    from compgen.verification.verdict import Verdict

    errors = []
    if resumed.verdict is not Verdict.INSIDE:
        ending = "nothing was written; --force writes the pages"
        if is_written or resumed.is_usable:
            ending = "written all the same" + ("" if resumed.is_usable else " (--force)")
        errors.append(f"{outside_words(resumed.findings)}; {ending}")
    shown = _shown(resumed, folder, is_written=is_written, verbose=verbose)
    record = record_of(resumed) if is_written else unwritten(record_of(resumed))
    return Outcome(record=record, shown=shown, errors=errors)


def _shown(resumed: "Resumed | ResumedProgram", folder: Path, *, is_written: bool, verbose: bool) -> Iterator[object]:
    """The pages, why, and what became of them."""
    from compgen.pipelines.resume.corrected_rest import resumed_words
    from compgen.pipelines.resume.result import Resumed

    if isinstance(resumed, Resumed):
        name, where, words = resumed.planned.job.name, "on the part", _words_of_job(resumed, verbose=verbose)
    else:
        name, where = resumed.correction.name, "error"
        words = chain(resumed_words(resumed), _words_of_band(resumed, verbose=verbose))
    yield from titled(f"{name} from page {resumed.from_page} on", pages_table(f"{where}, um", resumed.pages))
    yield from words
    yield from finding_lines(resumed.findings, verbose=verbose)
    if is_written:
        count = len(resumed.replaced)
        names = resumed.replaced[0] if count == 1 else f"{resumed.replaced[0]} to {resumed.replaced[-1]}"
        yield f"wrote {names} anew, {resumed.written.manifest_file}, resume.html, resume.json in {folder}"
    elif not resumed.replaced:
        yield "nothing to do: the pages in the folder are these already"


def put_anew(place: PagePlace, resumed: "Resumed | ResumedProgram") -> None:
    """Put new pages and their manifest with their report and its figures into the folder, all of them or none.

    Raises:
        InputError: A report of another stands there, or the folder cannot be written.
    """
    from compgen.cli.output_files.replace_together import replace_together
    from compgen.pipelines.resume.result import Resumed
    from compgen.report.resume import program_html, resume_html

    is_own = command_in(place.folder / RESUME_FILES[0]) is Command.RESUME
    foreign = next((name for name in RESUME_FILES if (place.folder / name).exists() and not is_own), None)
    if foreign:
        file = place.folder / foreign
        raise InputError(f"{file}: it is there and not what cgen resume or follow wrote; move it away")
    html = resume_html(resumed, place.options) if isinstance(resumed, Resumed) else program_html(resumed, place.options)
    contents = json_text(record_of(resumed)), html
    reports = place.files(dict(zip(RESUME_FILES, contents, strict=True)))
    changed = {name: data for name, data in resumed.files.items() if name not in resumed.unchanged}
    replace_together(place.folder, {**reports, **changed}, Run(Command.RESUME))


def record_of(resumed: "Resumed | ResumedProgram") -> dict[str, Any]:
    """What became of the pages, for the folder and for ``--json``."""
    from compgen.pipelines.resume.result import Resumed
    from compgen.report.resume import program_summary, resume_summary

    return resume_summary(resumed) if isinstance(resumed, Resumed) else program_summary(resumed)


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


def pages_table(head: str, pages: Sequence["PageResult"]) -> "Table":
    """Each page before and after."""
    rows = (
        [
            page.file,
            *(f"{getattr(side, k) / UM:.2f}" for side in (page.before, page.after) for k in ("max", "p99", "rms")),
        ]
        for page in pages
    )
    return sizes_table(head, ("before", "after"), rows)


def _words_of_band(resumed: "ResumedProgram", *, verbose: bool) -> Iterator[str]:
    """What the robot file leaves open on a program's pages."""
    from compgen.report.band_words import not_known_words
    from compgen.report.correction import band_of_correction

    record = band_of_correction(resumed.correction)
    if record is not None:
        yield not_known_words(record, verbose=verbose)


def _words_of_job(resumed: "Resumed", *, verbose: bool) -> Iterator[str]:
    """What became of a planned job's pages, line by line."""
    from compgen.report.band_words import not_known_words, rounded
    from compgen.report.resume import band_of_resumed

    planned, begun = resumed.planned, resumed.begun
    rises = ", ".join(
        f"{name} {now:.2f} ({now - then:+.2f})"
        for name, now, then in zip(
            planned.job.heat.names, planned.rise[0].tolist(), resumed.planned_rise.tolist(), strict=True
        )
    )
    yield f"because {begun.why}; warmer than the reference by [K], and against the plan: {rises}"
    if resumed.join is not None:
        join = resumed.join
        place = " on the part" if join.on_the_part else " off the part"
        yield f"{join.words(place)}; start within {limit_words(resumed.starts[0].window)}"
    largest = resumed.deviation.on_part["total"].max / UM
    yield f"with the new pages: {rounded(largest)} um left by calculation"
    yield not_known_words(band_of_resumed(resumed), verbose=verbose)
