"""The pages of a rest, under their old names, and the proof that they go on where the page before stops.

The manifest of pages that were written anew: the same pages by name, and what was replaced when and why.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any, TypeVar

from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.canonical.writer import compose
from compgen.fanuc.paging.join_check import read_pages
from compgen.job.job import Job
from compgen.pipelines.planned.delivery import PageStart, page_remarks, require_equal
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.resume.result import PagesAnew
from compgen.pipelines.resume.written_job import WrittenJob
from compgen.program.pages import JoinError, excerpt, join_programs, require_meeting, with_checksum
from compgen.program.program import Program

Anew = TypeVar("Anew", bound=PagesAnew)


def read_written(written: WrittenJob, whole: Planned) -> list[Program]:
    """The pages in the folder, each as the controller reads it.

    Raises:
        InputError: They are not the pages of this plan.
    """
    try:
        programs = read_pages(written.main, {page.name: page.data for page in written.pages})
    except JoinError as failure:
        raise InputError(f"{written.folder}: {failure}; put the page back, or generate the job anew") from failure
    ends = [(page.first, page.last - page.first + 1) for page in written.pages]
    lengths = [len(program.position) for program in programs]
    stops = whole.path.stop
    fits = written.pages[-1].last == len(stops) - 1 and all(stops[first] for first, _ in ends)
    if lengths != [length for _, length in ends] or not fits:
        raise InputError(
            f"{written.folder}: its pages have {sum(lengths)} positions, where the plan of {whole.job.source} has "
            f"others ({len(stops)}): another version or setting wrote them; generate the job anew"
        )
    return programs


def page_steps(written: WrittenJob) -> dict[str, float]:
    """How far each page that was written anew starts from where the page before stops, as its record says [m]."""
    steps: dict[str, float] = {}
    for entry in written.resumed:
        later = [page.name for page in written.pages[int(entry["from_page"]) - 1 :]]
        steps = {name: step for name, step in steps.items() if name not in later}
        if entry.get("join"):
            steps[later[0]] = float(entry["join"]["gap_mm"]) * MM
    return steps


def write_pages(
    written: WrittenJob, job: Job, program: Program, from_page: int, starts: Sequence[PageStart]
) -> dict[str, bytes]:
    """The pages of a rest by file, in order.

    Args:
        written: The job's pages so far.
        job: The rest.
        program: Its program, from the first position of the page on.
        from_page: Number of the page, from 1.
        starts: Of the page and those after it.
    """
    pages, count, begin = written.pages[from_page - 1 :], len(written.pages), written.pages[from_page - 1].first
    files = {}
    for page, start in zip(pages, starts, strict=True):
        remarks = tuple(page_remarks(job, program, page.number - 1, count, start, anew=True))
        part = excerpt(program, page.first - begin, page.last - begin)
        files[page.file] = compose(replace(part, name=page.name, remarks=remarks))
    return files


def prove_pages(before: Program | None, files: Mapping[str, bytes], program: Program, gap: float) -> Program:
    """The rest read back from its pages, which are its program and go on behind the page before.

    Args:
        before: The page before, untouched; None: there is none.
        files: The new ones, in order.
        program: What they must be.
        gap: How far the first of them starts from where the page before stops [m].

    Raises:
        JoinError: They are not the program, or do not meet.
    """
    pages = [interpret(data) for data in files.values()]
    if before is not None:
        require_meeting(before, pages[0], gap)
    rest, _ = join_programs(pages)
    require_equal(rest, program)
    return rest


def with_manifest(
    anew: Anew,
    date: str,
    known_pages: Mapping[str, int],
    start: Mapping[str, Any],
    facts: Mapping[str, Mapping[str, Any]] | None = None,
) -> Anew:
    """Pages that were written anew, with their manifest beside them, which says when and why.

    Args:
        anew: The pages, without it.
        date: When.
        known_pages: The last page that the controller has, and the last that has run; 0 where nobody says.
        start: How the robot begins, to go on from.
        facts: What the manifest says of each page beside its bytes, by the file's name.
    """
    record: dict[str, Any] = json.loads(json.dumps(dict(anew.written.record)))
    by_name = {str(entry["name"]): entry for entry in record["pages"]}
    replaced = []
    for page in anew.pages:
        data, entry = anew.files[page.file], by_name[page.name]
        checksum = sha256(data).hexdigest()
        sums = {"old_sha256": entry["sha256"], "new_sha256": checksum}
        replaced.append({"name": page.name, **sums, "before": page.before.record(), "after": page.after.record()})
        entry.update(sha256=checksum, bytes=len(data), **(facts or {}).get(page.file, {}))
    entry = {
        "from_page": anew.from_page,
        "date": date,
        "why": anew.begun.why,
        **anew.begun.cause,
        **{key: page for key, page in known_pages.items() if page},
        **start,
        "join": None if anew.join is None else anew.join.record(),
        "pages": replaced,
    }
    record["resumed"] = [*record.get("resumed", []), entry]
    return replace(anew, files={**anew.files, anew.written.manifest_file: with_checksum(record)})
