"""The command that watches a running job's log, and writes the next page anew when its forecast leaves a bound."""

import json
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compgen.cli.commands.resume import JobPath, LoadedPages, PagesFolder, RecordDate, checked_moment, within
from compgen.cli.commands.resume_files import put_pages
from compgen.cli.options import options as opt
from compgen.cli.options.durations import duration
from compgen.cli.options.page_options import Assets, AssetsOption, page_options
from compgen.cli.output_files.figure_files import FiguresOption
from compgen.cli.screen.messages import print_error, print_note_once
from compgen.cli.screen.streams import reader_has_left
from compgen.core import interrupts
from compgen.core.exceptions import InputError
from compgen.core.findings import beyond_text
from compgen.core.units import UM

if TYPE_CHECKING:
    from compgen.pipelines.resume.follow import Look
    from compgen.pipelines.resume.result import Resumed

LONGEST_POLL = 3600.0  # s
WITHIN_UM = 5.0  # that a page may leave where nobody says


def follow(
    folder: PagesFolder,
    log: Annotated[str, typer.Option("--log", help="Thermocouple log that grows while the job runs.")],
    within_um: Annotated[
        float | None,
        typer.Option(
            "--within-um", help="Error that a page may leave by its forecast [um]; default --max-um, or 5 without one."
        ),
    ] = None,
    poll: Annotated[str, typer.Option("--poll", help="How often to look: 10s.")] = "10s",
    pages: Annotated[
        str | None, typer.Option("--pages", help="CSV that the cell writes: time_s, page (0: stands), loaded.")
    ] = None,
    started: Annotated[
        str | None, typer.Option("--started", help="Without --pages: when page 1 started, on the log's clock: 0s.")
    ] = None,
    planned: Annotated[
        str, typer.Option("--planned", help="When the job was planned to start, on the log's clock: 0s.")
    ] = "0s",
    loaded: LoadedPages = 0,
    lead: Annotated[
        str, typer.Option("--lead", help="How long before the page that runs ends the next one is taken as loaded.")
    ] = "1min",
    state: opt.StateFile = None,
    once: Annotated[
        bool, typer.Option("--once", help="Look once and end; exit 1 when a page leaves the bound.")
    ] = False,
    path: JobPath = None,
    robot: opt.JobRobot = None,
    date: RecordDate = None,
    force: Annotated[bool, typer.Option("--force", help="Write pages even outside the job's own bounds.")] = False,
    max_um: opt.MaxUm = None,
    as_json: opt.Json = False,
    assets: AssetsOption = Assets.INLINE,
    figures: FiguresOption = None,
    quiet: opt.Quiet = False,
    workers: opt.Workers = 0,
) -> None:
    """Follow a running job by its log: forecast the pages to come, and write the next one anew when it is due."""
    from compgen.cli.machine import use_machine
    from compgen.cli.output_files.replace_together import finish_replacing
    from compgen.job.anchored_start import load_state
    from compgen.pipelines.resume.follow import durations, look_at
    from compgen.pipelines.resume.page_times import planned_times, read_page_times
    from compgen.pipelines.resume.pages_anew import read_written
    from compgen.pipelines.resume.resume import require_unedited, resume
    from compgen.pipelines.resume.whole import plan_whole
    from compgen.pipelines.resume.written_job import CORRECTED, job_of, read_written_job
    from compgen.thermal.temperature_log import read_growing_log

    bound = opt.checked_bound(max_um)
    within_um = (max_um or WITHIN_UM) if within_um is None else within_um
    if not 0 < within_um < 1e4:
        raise InputError(f"--within-um {within_um:g}: outside 0 to 1e4; give micrometres, as 5")
    pause, first, ahead = duration(poll, "--poll"), duration(planned, "--planned"), duration(lead, "--lead")
    if not 0 < pause <= LONGEST_POLL:
        raise InputError(f"--poll {poll}: outside 0 s to {LONGEST_POLL:g} s; give how often to look, as 10s")
    if pages is not None and started is not None:
        raise InputError("--pages, --started: both say when pages began; give one of them")
    begun = duration(started, "--started") if started is not None else first
    checked_moment(date)
    place = Path(folder)
    options = page_options(place, assets, date)
    finish_replacing(place)
    written = read_written_job(place)
    if not 0 <= loaded <= len(written.pages):
        raise InputError(f"--loaded {loaded}: {written.manifest_file} has pages 1 to {len(written.pages)}")
    require_unedited(written)
    if CORRECTED in written.record:
        raise InputError(f"{folder}: a corrected program's pages are not followed; resume them with --log or --late")
    use_machine(workers)
    whole = plan_whole(
        within(job_of(written, path, robot), bound), lambda stage, share: interrupts.raise_if_interrupted()
    )
    job, spans, programs = whole.job, durations(written, whole), read_written(written, whole)
    anchored = load_state(state, job.cell) if state is not None else None
    if pages is not None and not Path(pages).exists():
        print_note_once(f"--pages {pages}: not there yet, so that no page counts as begun; check its name")
    interrupts.raise_on_signal()
    interrupts.set_outcome("the pages are as last written")
    before, looked = b"", None
    while True:
        seen = _fingerprint(log, pages)
        if seen != before or once:
            before, looked, readings = seen, None, None
            try:
                times = planned_times(spans, first, begun) if pages is None else read_page_times(pages, spans, first)
                if once or Path(log).exists():
                    readings = read_growing_log(log, job.heat.names, job.cell.sensors)
            except InputError as failure:  # whoever writes the files may be in the middle of it
                if once:
                    raise
                print_error(str(failure), 2)
            if readings is not None:
                looked = look_at(
                    written,
                    whole,
                    programs,
                    log=readings,
                    source=log,
                    times=times,
                    within=within_um * UM,
                    loaded=loaded,
                    lead=ahead,
                    anchored=anchored,
                )
            resumed = None
            if looked is not None and looked.due and looked.beginning is not None:
                beginning = looked.beginning
                resumed = resume(
                    written,
                    whole,
                    looked.due,
                    begin=lambda known, b=beginning: b,  # type: ignore[misc]
                    date=checked_moment(date),
                    progress=_silent,
                    loaded=looked.loaded,
                    done=max(written.done, times.last(looked.time) - bool(looked.running)),
                )
                if resumed.replaced and (resumed.inside or force):
                    put_pages(place, resumed, options, figures)
                    written = read_written_job(place)
                    programs = read_written(written, whole)
            if not quiet or as_json:
                _say(looked, resumed, within_um, as_json, force)
        if once or (looked is not None and looked.over) or reader_has_left():
            break
        interrupts.raise_if_interrupted()
        time.sleep(pause)
    if once and looked is None and readings is not None and readings.readings is None and readings.gaps:
        message = f"{log}: none of its {readings.gaps} readings is a temperature of a cell; are they kelvin? give degC"
        raise typer.Exit(print_error(f"{message}; the pages stay as they are", 1))
    if once:
        _end(looked, resumed, within_um, force, log)


def _silent(stage: str, share: float) -> None:
    interrupts.raise_if_interrupted()


def _fingerprint(*files: str | None) -> bytes:
    """What tells whether a file has changed."""
    facts: list[Any] = []
    for name in files:
        try:
            status = Path(name).stat() if name is not None else None
        except OSError:
            status = None
        facts.append(status and (status.st_size, status.st_mtime_ns, status.st_ino))
    return repr(facts).encode()


def _say(looked: "Look | None", resumed: "Resumed | None", within: float, as_json: bool, force: bool) -> None:
    """One line for a look."""
    from compgen.report.resume import look_record, look_words

    if as_json:
        sys.stdout.write(json.dumps(look_record(looked, resumed, within, force=force), allow_nan=False) + "\n")
    else:
        sys.stdout.write(look_words(looked, resumed, within, force=force) + "\n")
    sys.stdout.flush()


def _end(looked: "Look | None", resumed: "Resumed | None", within: float, force: bool, log: str) -> None:
    """The exit of a single look: 1 where a page to come leaves the bound and was not mended."""
    if looked is None:
        return
    if looked.doubt:
        raise typer.Exit(print_error(f"{log}: {looked.doubt}; the pages stay as they are", 1))
    mended = looked.due if resumed is not None and (resumed.inside or force) else 0
    bad = [f for f in looked.forecasts if f.max > within * UM and not 0 < mended <= f.page]
    if bad:
        reason = "it runs" if bad[0].page == looked.running else "the controller has it"
        if bad[0].page > looked.loaded:
            reason = "its correction is outside the job's bounds (--force)"
        size = beyond_text(bad[0].max / UM, within, 1)
        message = f"page {bad[0].page}: {size} um by its forecast, --within-um {within:g}; {reason}"
        raise typer.Exit(print_error(message, 1))
