"""The command that watches a running job's log, and writes the next page anew when its forecast leaves a bound."""

import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compgen.cli.command_frame import Outcome
from compgen.cli.commands.resume import (
    JobPath,
    LoadedPages,
    PagesFolder,
    RecordDate,
    checked_moment,
    put_anew,
    within,
)
from compgen.cli.options import options as opt
from compgen.cli.options.page_options import PageChoice, PagePlace, page_place
from compgen.cli.screen.messages import print_error, print_note, print_note_once
from compgen.cli.screen.streams import reader_has_left
from compgen.core import interrupts
from compgen.core.dates import duration
from compgen.core.exceptions import InputError
from compgen.core.exit_codes import ExitCode
from compgen.core.findings import beyond_text
from compgen.core.units import MINUTE, UM

if TYPE_CHECKING:
    from compgen.error_model.anchored_state import AnchoredState
    from compgen.pipelines.resume.corrected_rest import ResumedProgram
    from compgen.pipelines.resume.follow import Look
    from compgen.pipelines.resume.page_times import PageTimes
    from compgen.pipelines.resume.paged_run import PagedRun
    from compgen.pipelines.resume.result import Resumed
    from compgen.pipelines.resume.written_job import WrittenJob
    from compgen.thermal.temperature_log import GrowingLog

LONGEST_POLL = 3600.0  # s
QUIET = 600.0  # s without a change of the log, and three times its usual step, from which on that is told
WITHIN_UM = 5.0  # that a page may leave where nobody says


@dataclass(frozen=True, slots=True, kw_only=True)
class Watch:
    """What is watched, how often, and what is told of it."""

    log: Annotated[str, typer.Option("--log", help="Thermocouple log that grows while the job runs.")]
    within_um: Annotated[
        float | None,
        typer.Option(
            "--within-um", help="Error that a page may leave by its forecast [um]; default --max-um, or 5 without one."
        ),
    ] = None
    poll: Annotated[str, typer.Option("--poll", help="How often to look: 10s.")] = "10s"
    pages: Annotated[
        str | None, typer.Option("--pages", help="CSV that the cell writes: time_s, page (0: stands), loaded.")
    ] = None
    started: Annotated[
        str | None, typer.Option("--started", help="Without --pages: when page 1 started, on the log's clock: 0s.")
    ] = None
    planned: Annotated[
        str, typer.Option("--planned", help="When the job was planned to start, on the log's clock: 0s.")
    ] = "0s"
    loaded: LoadedPages = 0
    lead: Annotated[
        str, typer.Option("--lead", help="So long before the running page ends the next one counts as loaded.")
    ] = "1min"
    once: Annotated[bool, typer.Option("--once", help="Look once and end; exit 1 when a page leaves the bound.")] = (
        False
    )

    def limits(self, max_um: float | None) -> "Limits":
        """The same as numbers; raises InputError."""
        within_um = (max_um or WITHIN_UM) if self.within_um is None else self.within_um
        if not 0 < within_um < 1e4:
            raise InputError(f"--within-um {within_um:g}: outside 0 to 1e4; give micrometres, as 5")
        pause, first = duration(self.poll, "--poll"), duration(self.planned, "--planned")
        if not 0 < pause <= LONGEST_POLL:
            raise InputError(f"--poll {self.poll}: outside 0 s to {LONGEST_POLL:g} s; give how often to look, as 10s")
        if self.pages is not None and self.started is not None:
            raise InputError("--pages, --started: both say when pages began; give one of them")
        begun = duration(self.started, "--started") if self.started is not None else first
        lead = duration(self.lead, "--lead")
        return Limits(within_um=within_um, pause=pause, planned=first, started=begun, lead=lead)

    def fingerprint(self) -> bytes:
        """What tells whether a watched file has changed."""
        return repr([_facts(name) for name in (self.log, self.pages) if name is not None]).encode()


def _facts(name: str | Path) -> tuple[int, ...] | None:
    """What tells whether a file has changed; None where it is not there."""
    try:
        status = Path(name).stat()
    except OSError:
        return None
    return status.st_size, status.st_mtime_ns, status.st_ino


@dataclass(slots=True)
class Stillness:
    """Since when a log has not changed, and whether a note has named it."""

    facts: tuple[int, ...] | None = ()
    since: float = 0.0  # [s]
    is_noted: bool = False

    def tell(self, log: str, step: float) -> None:
        """Say once a stop that a log whose rows are so far apart [s] has not changed for long."""
        now, facts, most = time.monotonic(), _facts(log), max(QUIET, 3 * step)
        if facts != self.facts:
            self.facts, self.since, self.is_noted = facts, now, False
        elif not self.is_noted and now - self.since > most:
            self.is_noted = True
            print_note(f"--log {log}: has not changed for {most / MINUTE:.0f} min; mend the logger")


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a page may leave, and times [s]."""

    within_um: float
    pause: float  # between two looks
    planned: float  # start of the job, on the log's clock
    started: float  # start of its first page
    lead: float  # before the end of a page in which the next one counts as loaded


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowedJob:
    """A job that runs, and its pages as they were last written."""

    run: "PagedRun"
    anchored: "AnchoredState | None"
    manifest: tuple[int, ...] | None  # what tells whether somebody has written them since


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """What a look has found: the log's readings, the forecast, and the page that was worked out anew for it."""

    readings: "GrowingLog | None" = None
    look: "Look | None" = None
    resumed: "Resumed | ResumedProgram | None" = None


def follow(
    folder: PagesFolder,
    *,
    watch: Watch,
    state: opt.StateFile = None,
    path: JobPath = None,
    robot: opt.JobRobot = None,
    date: RecordDate = None,
    force: Annotated[bool, typer.Option("--force", help="Write pages even outside the job's own bounds.")] = False,
    max_um: opt.MaxUm = None,
    page: PageChoice,
    screen: opt.Screen,
    cores: opt.CompiledCores,
) -> Outcome:
    """Follow a running job by its log: forecast the pages to come, and write the next one anew when it is due.

    Examples:
        cgen follow outputs/optic_raster --log temperatures.csv --within-um 5
        cgen follow outputs/optic_raster --log temperatures.csv --started 0s --once --json
    """
    limits = watch.limits(max_um)
    checked_moment(date)
    place = page_place(Path(folder), page, date)
    job = _load(place.folder, watch, path=path, robot=robot, max_um=max_um, state=state)
    if watch.pages is not None and not Path(watch.pages).exists():
        print_note_once(f"--pages {watch.pages}: not there yet, so that no page counts as begun; check its name")
    interrupts.raise_on_signal()
    interrupts.set_outcome("the pages are as last written")
    before, sight, still = b"", Sight(), Stillness()
    while True:
        if (seen := watch.fingerprint()) != before or watch.once:
            before = seen
            job, sight = _keep_right(place, job, watch, limits, date=date, force=force)
            if not screen.quiet or screen.as_json:
                _say(sight, watch.log, limits.within_um, as_json=screen.as_json, force=force)
        still.tell(watch.log, sight.readings.step if sight.readings is not None else 0.0)
        if watch.once or (sight.look is not None and sight.look.over) or reader_has_left():
            break
        interrupts.raise_if_interrupted()
        time.sleep(limits.pause)
    return Outcome(errors=_reasons(sight, watch.log, limits.within_um, force=force) if watch.once else [])


def _load(
    folder: Path, watch: Watch, *, path: str | None, robot: str | None, max_um: float | None, state: str | None
) -> FollowedJob:
    """The job of a folder of pages; raises InputError for one that cannot be followed."""
    from compgen.cli.output_files.replace_together import finish_replacing
    from compgen.job.anchored_start import load_state
    from compgen.pipelines.resume.corrected_job import read_corrected
    from compgen.pipelines.resume.corrected_run import corrected_run
    from compgen.pipelines.resume.paged_run import planned_run
    from compgen.pipelines.resume.rest import plan_whole
    from compgen.pipelines.resume.resume import require_unedited
    from compgen.pipelines.resume.written_job import job_of_pages, read_written_job

    finish_replacing(folder)
    written = read_written_job(folder)
    manifest = _manifest_facts(folder, written)
    if not 0 <= watch.loaded <= len(written.pages):
        raise InputError(f"--loaded {watch.loaded}: {written.manifest_file} has pages 1 to {len(written.pages)}")
    require_unedited(written)
    run: PagedRun
    if written.is_corrected:
        run = corrected_run(read_corrected(written, robot, max_um), _silent)
    else:
        job = within(job_of_pages(written, path, robot), opt.bound_of(max_um))
        run = planned_run(written, plan_whole(job, _silent))
    zero = run.zero.reference
    reference = None if isinstance(zero, str) else zero
    anchored = None if state is None else load_state(state, run.cell, reference=reference)
    return FollowedJob(run=run, anchored=anchored, manifest=manifest)


def _keep_right(
    place: PagePlace, job: FollowedJob, watch: Watch, limits: Limits, *, date: str | None, force: bool
) -> tuple[FollowedJob, Sight]:
    """A look, with the page that is due put into the folder, and the job as its pages are then.

    Where the page begins, or somebody writes pages, while it is worked out, it is looked at anew.
    """
    while True:
        if _manifest_facts(place.folder, job.run.written) != job.manifest:
            job = _reread(place.folder, job)
        sight = _look(job, watch, limits, date=date)
        look, resumed = sight.look, sight.resumed
        if look is None or resumed is None or not resumed.replaced or not (resumed.is_usable or force):
            return job, sight
        times, log = _read(job, watch, limits)
        now = look.time if log is None or log.readings is None else float(log.readings.time[-1])
        is_free = times is not None and times.loaded(now) < look.due
        if is_free and _manifest_facts(place.folder, job.run.written) == job.manifest:
            put_anew(place, resumed)
            return _reread(place.folder, job), sight


def _manifest_facts(folder: Path, written: "WrittenJob") -> tuple[int, ...] | None:
    """What tells whether somebody has written pages since; its own file says it of all."""
    return _facts(folder / written.manifest_file)


def _reread(folder: Path, job: FollowedJob) -> FollowedJob:
    from compgen.pipelines.resume.written_job import read_written_job

    manifest = _manifest_facts(folder, job.run.written)
    return replace(job, run=job.run.reread(read_written_job(folder)), manifest=manifest)


def _look(job: FollowedJob, watch: Watch, limits: Limits, *, date: str | None) -> Sight:
    """The job at its log's last reading, and the page that is due then, worked out anew."""
    from compgen.pipelines.resume.follow import look_at

    times, readings = _read(job, watch, limits)
    if times is None or readings is None:
        return Sight()
    for note in readings.readings.notes if readings.readings is not None else ():
        print_note_once(note)
    look = look_at(
        job.run,
        log=readings,
        source=watch.log,
        times=times,
        within=limits.within_um * UM,
        loaded=watch.loaded,
        lead=limits.lead,
        anchored=job.anchored,
    )
    if look is None or not look.due or look.beginning is None:
        return Sight(readings=readings, look=look)
    ran = times.last(look.time) - bool(look.running)
    resumed = job.run.rewrite(
        look.due,
        look.beginning,
        date=checked_moment(date),
        progress=_silent,
        loaded=look.loaded,
        done=max(job.run.written.done, ran),
    )
    return Sight(readings=readings, look=look, resumed=resumed)


def _read(job: FollowedJob, watch: Watch, limits: Limits) -> "tuple[PageTimes | None, GrowingLog | None]":
    """When pages began, and the readings of the log; None where they cannot be read now."""
    from compgen.pipelines.resume.page_times import planned_times, read_page_times
    from compgen.thermal.temperature_log import read_growing_log

    try:
        if watch.pages is None:
            times = planned_times(job.run.spans, limits.planned, limits.started)
        else:
            times = read_page_times(watch.pages, job.run.spans, limits.planned)
        cell = job.run.cell
        if watch.once or Path(watch.log).exists():
            return times, read_growing_log(watch.log, cell.heat.names, cell.sensors, job.run.zero.dialect)
    except InputError as failure:  # whoever writes the files may be in the middle of it
        if watch.once:
            raise
        print_error(str(failure), ExitCode.BAD_INPUT)
    return None, None


def _silent(stage: object, share: float) -> None:
    interrupts.raise_if_interrupted()


def _say(sight: Sight, log: str, within: float, *, as_json: bool, force: bool) -> None:
    """One line for a look."""
    from compgen.report.resume import look_record, look_words

    doubt = {"doubt": unread} if (unread := _unread(sight.readings, log)) else {}
    if as_json:
        record = look_record(sight.look, sight.resumed, within, force=force)
        line = json.dumps({**record, **doubt}, allow_nan=False)
    else:
        line = unread or look_words(sight.look, sight.resumed, within, force=force)
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def _unread(log: "GrowingLog | None", source: str) -> str:
    """Why a log has no reading, though it has rows; empty where it has one."""
    if log is None or log.readings is not None or not (log.gaps or (log.left_out and not log.rows)):
        return ""
    if log.gaps:
        why = f"none of its {log.gaps} readings is a temperature of a cell; are they kelvin? give degC"
    else:
        rows = f"none of its {log.left_out} rows has a time_s and a cell for each column"
        why = f"{rows}; part cells by commas, and decimals by points"
    return f"{source}: {why}; the pages stay as they are"


def _reasons(sight: Sight, log: str, within: float, *, force: bool) -> list[str]:
    """Why a single look is not inside: a page to come leaves the bound and was not mended, or the log is no log."""
    look, resumed, readings = sight.look, sight.resumed, sight.readings
    if look is None:
        return [unread] if (unread := _unread(readings, log)) else []
    if look.doubt:
        return [f"{log}: {look.doubt}; the pages stay as they are"]
    is_put = resumed is not None and (resumed.is_usable or force)
    left = {p.number: p.after.max for p in resumed.pages} if resumed is not None and is_put else {}
    bad = next((f for f in look.forecasts if left.get(f.page, f.max) > within * UM), None)
    if bad is None:
        return []
    reason = "it runs" if bad.page == look.running else "the controller has it"
    if bad.page > look.loaded:
        reason = "corrected anew" if is_put else "its correction is outside the job's bounds (--force)"
    size = beyond_text(left.get(bad.page, bad.max) / UM, within, 1)
    return [f"page {bad.page}: {size} um by its forecast, --within-um {within:g}; {reason}"]
