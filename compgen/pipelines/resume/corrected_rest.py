r"""The rest of a corrected program in pages, corrected anew: a program that existed, planned by somebody else.

Its provenance says what it was made from. The planned program is corrected again, whole, on an arm whose heat begins so
that it is as warm as wanted when the page starts: with z the state there by the day so far and z' the wanted one,

    start' = start + (z' - z) exp(rate t)

for every mode that remembers so long (one that has died away over ``FORGOTTEN`` time constants says nothing). Only the
pages from that one on are taken; those before stay. Source: superposition, the heat models are linear.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code
from compgen.core.stages import Progress
from compgen.core.units import KB
from compgen.job.job import Cell
from compgen.pipelines.correct import Correction
from compgen.pipelines.correct import correct as correct_program
from compgen.pipelines.correct.program_pages import part_listing
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.resume.beginning import Begin, Logged, PromptStart, past_until, state_findings
from compgen.pipelines.resume.corrected_job import ANEW, CorrectedJob, with_state_text
from compgen.pipelines.resume.pages_anew import with_manifest
from compgen.pipelines.resume.result import Join, PagesAnew, Size, page_results, size_of
from compgen.pipelines.resume.resume import require_free, require_unedited
from compgen.program.ways import interpolate_poses
from compgen.robot.robot import Capacity
from compgen.thermal import Duty, JointMotion, state_after, states_at
from compgen.thermal.ambient import still_air
from compgen.thermal.model import with_losses
from compgen.thermal.schedule import STANDING, History
from compgen.thermal.tables.schema import AmbientTable
from compgen.thermal.uncertainty import Past, grown_back
from compgen.verification.band import Band
from compgen.verification.flight import Flight, PoseErrors, fly, pose_errors

Earlier = Sequence[Mapping[str, Any]]  # what was replaced before, as the manifest has it


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class ResumedProgram(PagesAnew):
    """The rest of a corrected program, written anew."""

    correction: Correction  # of the whole program; only the pages from that one on are taken

    @property
    def is_usable(self) -> bool:
        """Whether the pages are written unasked: nowhere worse, and no bound broken that is given."""
        return self.correction.is_usable

    @property
    def band(self) -> Band | None:
        """What the files and the log leave open on the program; None: nothing is corrected."""
        return self.correction.band


def resume_corrected(  # noqa: PLR0913  what a user may say of a job in pages
    job: CorrectedJob,
    from_page: int,
    begin: Begin,
    date: str,
    progress: Progress,
    loaded: int,
    done: int,
    first: Correction | None = None,
) -> ResumedProgram:
    """The pages of a corrected program from one on, for what the robot is when it starts.

    Args:
        job: What they were made from.
        from_page: The first page to write anew, from 1.
        begin: How the robot begins there.
        date: For the record.
        progress: Called with the stage and the share done.
        loaded: The last page that the controller has; 0 where nobody says.
        done: The last page that has run.
        first: The correction that the pages were parted of; default it is made again.

    Raises:
        InputError: Such a page is not there, has run or is loaded, a file is another than was written, or the new
            correction needs another program.
    """
    written = job.written
    require_free(written, from_page, loaded, done)
    require_unedited(written)
    first = first or corrected_first(job, progress)
    # a start that is known is not averaged over others
    job = replace(job, options=replace(job.options, ensemble=None))
    earlier = [entry for entry in written.resumed if int(entry["from_page"]) < from_page]
    as_written = _as_written(job, first, earlier, progress)
    old = as_written.correction
    stations = page_stations(old, job)
    at = stations[from_page - 1]
    reached = first.plan.drive.reached[stations[:from_page]]
    known = _known_at(reached, as_written, job, first.plan.drive.joint_motion(), earlier)
    begun = begin(known)
    known_since = begun.past or Past(begun.cell.heat.starting(begun.state), History(), known.past.feed)
    past = replace(known_since, passed=float(known.motion().time[reached[-1]]))
    air, heat = old.options.air if begun.air is None else begun.air, begun.cell.heat
    passed = heat.rate * past.passed
    by_air = heat.ambient * (air - old.options.air) * -np.expm1(-passed)
    started = as_written.start + grown_back(begun.state - known.state - by_air, passed)
    rest = replace(job, options=replace(job.options, air=air, judged_from=at))
    new = _corrected(rest, replace(_beginning(begun.cell, started), past=past), (), progress)
    if not np.array_equal(new.written.positions.number, old.written.positions.number):
        raise InputError(
            f"{written.manifest_file}: the new correction needs other positions than the pages have (--split, "
            f"--insert); {ANEW}"
        )
    pages = _pages_of(job, new)
    files = {page.file: pages[page.name] for page in written.pages[from_page - 1 :]}
    in_folder = _in_folder(job, first, as_written, from_page, progress)
    flown = {text: _fly(new, text) for text in (old, *in_folder)}
    sizes = _sizes(from_page, stations, new, [flown[text] for text in in_folder])
    results = page_results(written.pages[from_page - 1 :], sizes, files)
    join = _join(written.pages[from_page - 1].name, at, new, flown[old], old) if at else None
    resumed = ResumedProgram(
        written=written,
        from_page=from_page,
        correction=new,
        files=files,
        pages=results,
        join=join,
        begun=begun,
        findings=(
            *(f for f in new.findings if f.code is not Code.CONTROLLER_SIZE),  # of one file, not of pages
            *state_findings(begun),
        ),
    )
    start = {"start_state": started.tolist(), "air_K": air}
    return with_manifest(resumed, date, {"loaded": loaded, "done": done}, start)


class _AsWritten(NamedTuple):
    """What the pages in the folder were corrected for."""

    cell: Cell
    start: Array  # (S,) thermal state when the program began
    correction: Correction  # its options say how warm the air was since then


def _as_written(job: CorrectedJob, first: Correction, earlier: Earlier, progress: Progress) -> _AsWritten:
    """What the pages were corrected for at last: the day so far, or what an earlier call has found."""
    cell, heat, air = job.cell, job.cell.heat, job.options.air
    if not earlier:
        duties = with_losses(heat, job.before, first.plan.drive.joint_motion())
        return _AsWritten(cell, state_after(heat, duties, air=still_air(air)), first)
    where, start = job.written.manifest_file, np.array(earlier[-1]["start_state"])
    if len(start) != len(heat.rate):
        raise InputError(f"{where}: resumed: start_state is of another thermal model; {ANEW}")
    if anchored := next((entry["state_toml"] for entry in reversed(earlier) if entry.get("state_toml")), ""):
        cell = with_state_text(job.plain, anchored, f"{where}: resumed.state_toml")
    in_air = replace(job, options=replace(job.options, air=float(earlier[-1].get("air_K", air))))
    again = _corrected(_unjudged(in_air), _beginning(cell, start), (), progress)
    return _AsWritten(cell, start, again)


def _in_folder(
    job: CorrectedJob, first: Correction, as_written: _AsWritten, from_page: int, progress: Progress
) -> list[Correction]:
    """Of each page from one on, the correction that stands in the folder: an earlier call may have written it anew."""
    calls = job.written.resumed
    writers = [last_writer(calls, page.number) for page in job.written.pages[from_page - 1 :]]
    by_writer = {last_writer(calls, from_page - 1): as_written.correction}
    for writer in set(writers) - set(by_writer):
        up_to = [entry for entry in calls[:writer] if int(entry["from_page"]) <= int(calls[writer - 1]["from_page"])]
        by_writer[writer] = _as_written(job, first, up_to, progress).correction
    return [by_writer[writer] for writer in writers]


def last_writer(calls: Earlier, page: int) -> int:
    """Which call wrote a page last; 0: the first, that parted the program."""
    return max((k for k, entry in enumerate(calls, 1) if int(entry["from_page"]) <= page), default=0)


def _known_at(
    reached: IntArray, written: _AsWritten, job: CorrectedJob, motion: JointMotion, earlier: Earlier
) -> PromptStart:
    """The robot by the day so far, where the last of some pages begins, each at a row of the motion, (P,)."""
    heat, start, options = written.cell.heat, written.start, written.correction.options
    air, usual = still_air(options.air), AmbientTable()
    zero = usual if options.reference == usual.reference_degC else AmbientTable(reference_degC=options.reference)
    (standing,) = with_losses(heat, [STANDING], motion)
    way = motion.time[reached].tolist()
    day = Past(job.cell.heat, History(before=job.before, air=still_air(job.options.air)), motion.mean_feed)
    pages = [(way[int(entry["from_page"]) - 1], entry) for entry in earlier]
    return PromptStart(
        cell=written.cell,
        plain=lambda: job.plain,
        heat=heat,
        state=states_at(heat, start, motion, reached[-1:], air)[0],
        past=past_until(way[-1], pages, day),
        clock=0.0,
        air=air,
        standing=standing,
        motion=lambda: motion,
        logged=lambda: Logged(zero, None),
        earlier=tuple(earlier),
        measured_air=options.air,
    )


def _beginning(cell: Cell, start: Array) -> Cell:
    return replace(cell, heat=cell.heat.starting(start))


def _corrected(job: CorrectedJob, cell: Cell, before: tuple[Duty, ...], progress: Progress) -> Correction:
    return correct_program(
        job.planned, cell, job.frames, before, job.options, progress, job.called.get, registers=job.registers
    )


def _unjudged(job: CorrectedJob) -> CorrectedJob:
    """What was written, to go on from: no draws of it are flown again."""
    return replace(job, options=replace(job.options, guaranteed=None))


def corrected_first(job: CorrectedJob, progress: Progress) -> Correction:
    """The correction that a program's pages were parted of.

    Raises:
        InputError: The files make another program than it was.
    """
    first = _corrected(_unjudged(job), job.cell, job.before, progress)
    if sha256(first.text).hexdigest() != job.corrected_sha256:
        raise InputError(f"{job.written.manifest_file}: another version or input corrected this program; {ANEW}")
    return first


def active_motions(correction: Correction) -> IntArray:
    """Motions of a corrected program that its pages count, as rows of its table."""
    if correction.added == 0:
        return np.flatnonzero(~correction.plan.program.motions.disabled)
    return np.unique(correction.plan.drive.motion)


def page_stations(correction: Correction, job: CorrectedJob) -> list[int]:
    """The first station of each page.

    Raises:
        InputError: The pages have other motions than the program.
    """
    moves, written = active_motions(correction), job.written
    if written.pages[-1].last >= len(moves):
        raise InputError(
            f"{written.manifest_file}: its pages have {written.pages[-1].last + 1} motions, the corrected program "
            f"{len(moves)}; {ANEW}"
        )
    return [int(np.searchsorted(correction.plan.drive.motion, moves[page.first])) for page in written.pages]


def _pages_of(job: CorrectedJob, correction: Correction) -> dict[str, bytes]:
    """Pages of a corrected program by name, parted as those in the folder were."""
    written, limits = job.written, job.written.record["controller"]
    capacity = Capacity(
        int(limits["max_lines"]), int(limits["max_positions"]), float(limits["memory_kB"]) * KB,
        int(limits["name_length"]),
    )  # fmt: skip
    corrected = correction.text != job.planned
    paged = part_listing(correction.written, job.cell.robot, capacity, corrected=corrected)
    pages = {page.name: page.data for page in paged.pages}
    if list(pages) != [page.name for page in written.pages]:
        raise InputError(f"{written.manifest_file}: the program is parted in other pages now; {ANEW}")
    return pages


def _fly(new: Correction, old: Correction) -> tuple[Flight, PoseErrors]:
    """What the twin does with the old text of the same program, as warm as with the new one."""
    _, drive = new.around.drive(old.written, new.cell.robot)
    drive = replace(drive, beyond=np.maximum(new.plan.drive.beyond, drive.beyond))
    execution = fly(twin_of_cell(new.cell), drive, (), air=new.options.air)
    target = interpolate_poses(new.meant, execution.station, execution.fraction)
    return execution, pose_errors(execution, target)


def _sizes(
    from_page: int, stations: list[int], new: Correction, before: Sequence[tuple[Flight, PoseErrors]]
) -> list[tuple[Size, Size]]:
    """Each page's error at and between corrected stations, with the old text and with the new one."""
    edges = [*stations, len(new.plan.drive.pose)][from_page - 1 :]

    def size(execution: Flight, errors: PoseErrors, low: int, high: int) -> Size:
        samples = (execution.station >= low) & (execution.station < high)
        if len(samples) == len(new.judged):
            samples &= new.judged
        return size_of(errors.distance[samples], np.ones(int(samples.sum())))

    after = new.execution, new.residual
    return [(size(*old, *ends), size(*after, *ends)) for old, ends in zip(before, pairwise(edges), strict=True)]


def _join(page: str, station: int, new: Correction, before: tuple[Flight, PoseErrors], old: Correction) -> Join | None:
    """What the tool does at the stop before the first new page; whether that is on a part nobody knows."""
    places, sizes = [], []
    for execution, errors in (before, (new.execution, new.residual)):
        samples = np.flatnonzero((execution.station == station - 1) & (execution.fraction == 1))
        if not len(samples):
            return None
        places.append(execution.actual.position[samples[0]])
        sizes.append(float(errors.distance[samples[0]]))
    robot, pose = new.cell.robot, int(new.plan.drive.pose[station - 1])
    was, now = (new.around.poses(one.written, robot).tcp.position[pose] for one in (old, new))
    gap = float(np.abs(now - was).max())
    step = float(np.linalg.norm(places[1] - places[0]))
    return Join(
        page=page,
        gap=gap,
        step=step,
        demanded=sizes[0],
        beyond=sizes[1],
        on_the_part=False,
    )


def resumed_words(resumed: ResumedProgram) -> list[str]:
    """What became of the pages, line by line."""
    join = resumed.join
    lines = [f"because {resumed.begun.why}"]
    if join is not None:
        lines.append(f"{join.words()}; the program does not say whether it is on a part there")
    return lines
