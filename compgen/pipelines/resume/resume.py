r"""The rest of a job in pages for what the robot is now: planned as ever, corrected, written and proven anew.

Where the way goes and where it stops is the plan's and stays; what changes is the correction. The join is a stop: the
page before holds the tool at a place x_old that was right for another warmth, the new page begins at the same target
with another correction, which brings it to x_new,

    step = x_new - x_old = (target - x_old) + (x_new - target)

The first part is what has drifted: the part demands it. The second is what the new page leaves, and is at most ``JOIN``
where the join lies on the part.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, row_norms
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.stages import Progress
from compgen.core.units import UM
from compgen.error_model.direction_memory import reversal_widths
from compgen.pipelines.files.twin_of_job import deviation_of
from compgen.pipelines.findings import job_findings
from compgen.pipelines.planned.delivery import PageStart, page_facts
from compgen.pipelines.planned.generate import final_timing, find_correction, start_windows
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import compose_program
from compgen.pipelines.resume.beginning import Begin, known_state, state_findings
from compgen.pipelines.resume.pages_anew import (
    page_steps,
    prove_pages,
    read_written,
    with_manifest,
    write_pages,
)
from compgen.pipelines.resume.rest import prepared_rest, rest_of_plan, tool_at_end
from compgen.pipelines.resume.result import Join, PageResult, Resumed, Size, page_results, size_of
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.pipelines.uncertainty.band_columns import band_along
from compgen.pipelines.uncertainty.draws import fly_program_draws
from compgen.planning.retiming.trajectory import Trajectory
from compgen.program.digits import as_written
from compgen.program.pages import excerpt, gap_between, join_programs
from compgen.program.program import Program
from compgen.thermal.model import extrapolations
from compgen.verification.deviation import Deviation
from compgen.verification.twin import PreparedProgram
from compgen.verification.verdict import judge
from compgen.verification.written_motion import read_motion

JOIN = 1.0 * UM  # that a step on the part may be beyond what has drifted
SEEN = 1.0 * UM  # from which on a step on the part is worth a warning


def resume(  # noqa: PLR0913  what a user may say of a job in pages
    written: WrittenJob,
    whole: Planned,
    from_page: int,
    begin: Begin,
    date: str,
    progress: Progress,
    loaded: int = 0,
    done: int = 0,
) -> Resumed:
    """The pages of a job from one on, for what the robot is when it starts.

    Args:
        written: The job in its folder.
        whole: Its plan.
        from_page: The first page to write anew, from 1.
        begin: How the robot begins there, given what the plan says.
        date: For the record.
        progress: Called with the stage and the share done.
        loaded: The last page that the controller has; 0 where nobody says.
        done: The last page that has run.

    Raises:
        InputError: Such a page is not there, has run or is loaded, or a file is another than was written.
        ImpossibleError: No legal correction exists.
        JoinError: The new pages, read back, are not the program.
        TwinError: The twin cannot drive the old text or the new.
    """
    require_free(written, from_page, loaded, done)
    require_unedited(written)
    programs = read_written(written, whole)
    page = written.pages[from_page - 1]
    known = known_state(whole, written.resumed, from_page, page.first)
    begun = begin(known)
    lead = programs[from_page - 2] if from_page > 1 else None
    old, _ = join_programs(programs[from_page - 1 :], page_steps(written))
    planned = rest_of_plan(whole, page.first, begun, old, lead)
    planned, problem, solution, limited = find_correction(planned, progress)
    job, path, commanded = planned.job, planned.path, problem.commanded(solution.correction)
    trajectory = final_timing(planned, problem, solution, progress)
    progress(stages.TEXT, 0.0)
    starts = _page_starts(planned, solution.theta, written, from_page, begun.clock - whole.job.clock)
    meant, _ = compose_program(job, commanded, solution.theta, trajectory, path, programs[0].date, starts[0].window)
    pages = write_pages(written, job, meant, from_page, starts)
    gap = gap_between(lead, as_written(meant)) if lead is not None else 0.0
    text = prove_pages(lead, pages, meant, gap)
    prepared = prepared_rest(job, text, lead)
    deviation = deviation_of(path, prepared, partial(progress, stages.TWIN_AFTER))
    join = _join(planned, page.name, gap, lead, deviation) if lead is not None else None
    driven = planned.driven(solution.theta, problem.direction_state)
    draws = fly_program_draws(driven, prepared, deviation, 0.0, partial(progress, stages.DRAWS))
    resumed = Resumed(
        written=written,
        from_page=from_page,
        begun=begun,
        planned_rise=whole.job.heat.outputs @ known.state,
        planned=planned,
        program=text,
        files=pages,
        starts=starts,
        deviation=deviation,
        band=band_along(driven),
        pages=judged_pages(written, from_page, planned, pages, deviation, prepared),
        join=join,
        findings=(),
    )
    findings = (
        *judge(deviation, job.bounds),
        *(draws.findings() if draws is not None else ()),
        *_join_findings(join, written, whole),
        *job_findings.of_knowledge(job),
        *limited,
        *job_findings.solver(solution, job.settings),
        *_text_findings(planned, trajectory, text, prepared),
        *_warmth_findings(planned),
        *state_findings(begun),
    )
    return _with_manifest(replace(resumed, findings=findings), date, {"loaded": loaded, "done": done})


def _text_findings(
    planned: Planned, trajectory: Trajectory, text: Program, prepared: PreparedProgram
) -> Iterator[Finding]:
    """How the new text's speeds and times differ from what was planned."""
    path = planned.path
    yield from job_findings.below_feed(planned.job, planned.feed, path, trajectory)
    yield from job_findings.words_off(trajectory, text)
    written = read_motion(prepared, np.diff(path.arc), planned.feed * path.pace)
    yield from job_findings.clocks_apart(trajectory, written)


def _with_manifest(resumed: Resumed, date: str, known_pages: Mapping[str, int]) -> Resumed:
    """With the manifest, which says what was replaced, and how the robot began."""
    planned, begun, job = resumed.planned, resumed.begun, resumed.planned.job
    start = {
        "first_waypoint": resumed.written.pages[resumed.from_page - 1].first,
        "clock_s": begun.clock,
        **({} if begun.air is None else {"air_K": begun.air}),
        "state": begun.state.tolist(),
        "rise_K": {n: round(float(r), 4) for n, r in zip(job.heat.names, planned.rise[0], strict=True)},
    }
    facts = {page.file: page_facts(job, begins) for page, begins in zip(resumed.pages, resumed.starts, strict=True)}
    return with_manifest(resumed, date, known_pages, start, facts)


def _page_starts(
    planned: Planned, theta: Array, written: WrittenJob, from_page: int, since: float
) -> tuple[PageStart, ...]:
    """When each page from one on starts, how warm the robot is then, and how long it may wait.

    Args:
        planned: The rest of the job.
        theta: Its commanded joints, (N, 6) [rad].
        written: The job in its folder.
        from_page: The first of them, from 1.
        since: From the job's planned start to the rest's [s].
    """
    pages = written.pages[from_page - 1 :]
    firsts = np.array([p.first - pages[0].first for p in pages], dtype=np.int64)
    windows = start_windows(planned, theta, firsts)
    times = since + planned.trajectory.time[firsts]
    return tuple(PageStart(*now) for now in zip(times.tolist(), planned.rise[firsts], windows.tolist(), strict=True))


def require_free(written: WrittenJob, from_page: int, loaded: int, done: int) -> None:
    """Raises InputError unless a page is there, has not run, was not handed over, and all before it are as written."""
    count = len(written.pages)
    for option, value in (("--from-page", from_page), ("--loaded", loaded), ("--done", done)):
        if not (1 if option == "--from-page" else 0) <= value <= count:
            raise InputError(f"{option} {value}: {written.manifest_file} has pages 1 to {count}")
    if 0 < done < written.done:
        raise InputError(
            f"--done {done}: {written.manifest_file} says that page {written.done} has run already; give --done "
            f"{written.done} or more"
        )
    if loaded and loaded < done:
        raise InputError(f"--loaded {loaded}: page {done} has run (--done), so it was loaded; give {done} or more")
    last_done, last_loaded = max(done, written.done), max(loaded, written.loaded)
    if from_page <= last_done:
        raise InputError(f"--from-page {from_page}: pages up to {last_done} have run; give {last_done + 1} or more")
    if from_page <= last_loaded:
        raise InputError(
            f"--from-page {from_page}: pages up to {last_loaded} were handed to the controller; give "
            f"{last_loaded + 1} or more"
        )


def require_unedited(written: WrittenJob) -> None:
    """Raises InputError for a page that is not what the manifest says."""
    for page in written.pages:
        if not page.is_as_written:
            raise InputError(
                f"{written.folder}/{page.file}: it is not the page that {written.manifest_file} names (edited by "
                "hand?); put it back, or generate the job anew"
            )


def _join(planned: Planned, page: str, gap: float, lead: Program, deviation: Deviation) -> Join:
    """What the tool does at the stop before the first new page, by the twin."""
    job, path = planned.job, planned.path
    remembers_nothing = not reversal_widths(job.sources)
    last = len(lead.position) - 1
    line = excerpt(lead, last - 1, last)
    end = replace(line, fine=np.ones(2, dtype=bool)) if remembers_nothing else lead
    held = tool_at_end(job, end, planned.rise[0])
    target = path.target.position[0]
    beyond = deviation.error[0]  # of the new page's first position
    step = target + beyond - held
    touching = bool(path.contact[0] and path.contact[1])
    step_size, demanded, left = (float(np.linalg.norm(v)) for v in (step, target - held, beyond))
    return Join(page=page, gap=gap, step=step_size, demanded=demanded, beyond=left, on_the_part=touching)


def _join_findings(join: Join | None, written: WrittenJob, whole: Planned) -> Iterator[Finding]:
    """A step on the part that is more than what has drifted, or worth knowing."""
    if join is None or not join.on_the_part:
        return
    contact = whole.path.contact
    off = [str(p.number) for p in written.pages if not contact[p.first] and p.name != join.page]
    mend = f"pages that begin off the part: {', '.join(off[:8])}" if off else "no page begins off the part"
    sizes = f"page {join.page} begins on the part: the tool steps by {join.step / UM:.1f} um at the stop there"
    if join.beyond > JOIN:
        message = f"{sizes}, {join.beyond / UM:.2f} um of it beyond what has drifted (at most {JOIN / UM:g}); {mend}"
        yield Finding(Level.OUTSIDE, Code.RESUME_JOIN, message)
    elif join.step > SEEN:
        message = f"{sizes}, which is what has drifted, to {join.beyond / UM:.2f} um; {mend}"
        yield Finding(Level.WARNING, Code.RESUME_JOIN, message)


def _warmth_findings(planned: Planned) -> list[Finding]:
    """Where the heat model is asked for more than was measured."""
    job = planned.job
    texts = extrapolations(job.cell.heat, (), job.feed, planned.trajectory.time[-1], planned.rise)
    return [Finding.of(Code.THERMAL_BOX, text) for text in texts]


def judged_pages(
    written: WrittenJob, from_page: int, planned: Planned, files: dict[str, bytes], after: Deviation,
    prepared: PreparedProgram,
) -> tuple[PageResult, ...]:  # fmt: skip
    """Each page's error on the part, with the old text and with the new one."""
    before, path = planned.deviation(), planned.path
    pages, results = written.pages[from_page - 1 :], list[tuple[Size, Size]]()
    edges = np.array([p.first - pages[0].first for p in pages] + [len(path.arc) - 1], dtype=np.int64)
    on_part = path.segments_on_part()
    samples = prepared.first_samples()
    touching = prepared.touching_samples(on_part)
    old_samples = np.searchsorted(before.arc, path.arc)  # the old text has other lengths, so other samples
    sides = [np.searchsorted(path.arc, before.arc, side=side) - 1 for side in ("left", "right")]
    old_touching = np.asarray(on_part[np.clip(sides, 0, len(on_part) - 1)].any(axis=0))
    for begin, end in pairwise(edges):
        sizes = []
        for deviation, at, mask in ((before, old_samples, old_touching), (after, samples, touching)):
            rows = slice(int(at[begin]), int(at[end]) + 1)
            chosen = mask[rows]
            length = np.gradient(deviation.arc[rows]) if rows.stop - rows.start > 1 else np.ones(1)
            sizes.append(size_of(row_norms(deviation.error[rows])[chosen], length[chosen]))
        results.append((sizes[0], sizes[1]))
    return page_results(pages, results, files)
