"""The files for the controller: one program, or pages with their main program and manifest, read back from text."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen import fanuc
from compgen.core.arrays import Array, IntArray, owns
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import KB, counted
from compgen.core.version import __version__
from compgen.fanuc.paging.join_check import check_manifest, interpret_pages
from compgen.fanuc.paging.split import split_canonical
from compgen.job.job import Job
from compgen.pipelines.planned.program_text import COMMON_REMARKS, rise_remarks, start_remarks
from compgen.program.digits import as_written
from compgen.program.page_stops import PageStops, canonical_size, head_line_count
from compgen.program.pages import MANIFEST_SUFFIX, JoinError, Page, PagedProgram, excerpt, manifest_json
from compgen.program.program import REMARK_LENGTH, Program

BLOCK_ROWS = 16384  # positions compared at a time


@dataclass(frozen=True, eq=False, slots=True)
@owns(rise=("K",))
class PageStart:
    """When a page begins and how warm the robot is then, if nobody waits before it."""

    time: float  # [s] since the program began
    rise: Array  # (K,) [K]
    window: float  # [s] how long all waits before it may be in sum


@dataclass(frozen=True, eq=False, slots=True)
class Delivery:
    """The files that the controller gets, and the program read back from them."""

    files: tuple[tuple[str, bytes], ...]  # name and content; the last one must appear last
    program: Program
    paged: PagedProgram | None = None
    starts: tuple[PageStart, ...] = ()  # of the pages

    @property
    def text(self) -> bytes:
        """The file that the operator starts."""
        return self.files[-1][1]


def deliver_file(program: Program) -> Delivery:
    """A program as one file."""
    text = fanuc.compose(program)
    return Delivery(((f"{program.name}.LS", text),), fanuc.interpret(text))


def deliver_pages(job: Job, program: Program, starts_at: Callable[[IntArray], Sequence[PageStart]]) -> Delivery:
    """A program as pages, main program and manifest, proven to be the program.

    Args:
        job: What it was made from.
        program: The undivided program; its first remarks say what it is, and each page repeats them.
        starts_at: The start of a page at each of some positions, numbered from 0.

    Raises:
        ImpossibleError: It cannot be split so that each page fits.
        JoinError: The pages, read back from their text, are not the program.
    """
    starts: list[PageStart] = []

    def headings(first: Sequence[int]) -> list[list[str]]:
        starts.extend(starts_at(np.array(first, dtype=np.int64)))
        return [page_remarks(job, program, k, len(first), start) for k, start in enumerate(starts)]

    paged = part_program(job, program, headings, _ascii(program.remarks[:COMMON_REMARKS]))
    facts = [{**_place_of(page), **page_facts(job, start)} for page, start in zip(paged.pages, starts, strict=True)]
    head = {
        "command": Command.GENERATE,
        "compgen": __version__,
        "inputs_sha256": job.inputs_hash,
        "robot": job.robot.name,
        "job": {"path_file": job.source, "robot_file": job.cell.robot_file, "overrides": list(job.overrides)},
    }
    return replace(deliver_parted(job, program, paged, head, facts), starts=tuple(starts))


def part_program(
    job: Job, program: Program, headings: Callable[[Sequence[int]], list[list[str]]], common: Sequence[str]
) -> PagedProgram:
    """A job's program as pages.

    Args:
        job: What it was made from.
        program: The undivided program.
        headings: The remarks of each page, given the positions at which they begin, from 0.
        common: The remarks of the main program.

    Raises:
        ImpossibleError: It cannot be split so that each page fits.
    """
    with naming_file(job.source):
        return split_canonical(
            program, job.robot.controller.capacity, headings, head_line_count(len(job.heat.names)), common
        )


def deliver_parted(
    job: Job, program: Program, paged: PagedProgram, head: Mapping[str, Any], facts: Sequence[Mapping[str, Any]] = ()
) -> Delivery:
    """Pages with their main program and manifest, proven to be the program; the manifest has ``head`` and ``facts``.

    Raises:
        JoinError: The pages, read back from their text, are not the program.
    """
    manifest = manifest_json(paged, job.robot.controller.capacity, head, facts)
    files = {f"{paged.name}{MANIFEST_SUFFIX}": manifest, **paged.files()}
    whole, _ = interpret_pages(*check_manifest(manifest, files))
    require_equal(whole, program)
    return Delivery(tuple(files.items()), replace(whole, name=paged.name), paged)


def size_findings(job: Job, delivery: Delivery, stops: PageStops | None) -> list[Finding]:
    """What was done with a program that one file does not hold, or why nothing was done."""
    capacity, program, paged = job.robot.controller.capacity, delivery.program, delivery.paged
    size = canonical_size(len(program.position), len(program.remarks) + (program.payload is not None))
    checks = [
        ("max_positions", size.positions, capacity.max_positions, "positions"),
        ("max_lines", size.lines, capacity.max_lines, "lines"),
        ("memory_kB", size.memory / KB, capacity.memory / KB, "kB estimated"),
    ]
    over = [f"{value:.0f} {unit} (controller.{key} = {limit:g})" for key, value, limit, unit in checks if value > limit]
    message = f"{', '.join(over)}: more than this controller holds in one file"
    if paged is not None and stops is not None:
        added = int(stops.added.sum())
        pages = f"written as {len(paged.pages)} pages and a main program"
        count = paged.load_count
        loads = f", to be loaded in {count} loads, one after another (drip feed)" if count > 1 else ""
        were = counted(added, "stop was", "stops were")
        stopped = f"; {were} put in for them, {stops.on_the_part} of them on the part" if added else ""
        level = Level.WARNING if stops.on_the_part else Level.NOTE
        return [Finding(level, Code.CONTROLLER_SIZE, f"{message}; {pages}{loads}{stopped}")]
    if not over:
        return []
    fewer = "raise process.chord_um"
    if job.own_file is not None:  # each of its points, or corners of lines, is a waypoint otherwise
        fewer = "path.through = 'tolerance' with more tolerance_um"
    if stops is None:
        remedy = f"leave --no-pages out, or {fewer}"
        return [Finding(Level.OUTSIDE, Code.CONTROLLER_SIZE, f"{message}: it cannot be loaded; {remedy}")]
    remedy = f"set process.page_stops = 'anywhere', or {fewer}"
    message = f"{message}, and it cannot be parted: {stops.obstacle}; {remedy}"
    return [Finding(Level.OUTSIDE, Code.CONTROLLER_SIZE, message)]


def _place_of(page: Page) -> dict[str, object]:
    """Which positions of the undivided program a page has; it starts at the first."""
    return {"first_position": max(page.motions[0], 1), "last_position": page.motions[1]}


def page_facts(job: Job, start: PageStart) -> dict[str, object]:
    """What the manifest says of how a page starts."""
    return {
        "start_s": round(start.time, 3),
        "start_window_s": round(start.window, 1),
        "rise_K": {name: round(float(r), 4) for name, r in zip(job.heat.names, start.rise, strict=True)},
    }


def page_remarks(job: Job, program: Program, k: int, count: int, start: PageStart, *, anew: bool = False) -> list[str]:
    """Remarks at the head of a page, k from 0; ``anew`` where it replaces another of that name."""
    when = f"anew, {start.time:.0f} s" if anew else f"after {start.time:.0f} s"
    page = f"page {k + 1} of {count}, {when}"
    remarks = [*program.remarks[:COMMON_REMARKS], page, *rise_remarks(job, start.rise)]
    wait = "start within" if k == 0 else "wait before it at most"
    if k == 0 and job.ensemble is not None:
        return _ascii(line[:REMARK_LENGTH] for line in [*remarks, start_remarks(job, start.window)[0]])
    return _ascii(line[:REMARK_LENGTH] for line in [*remarks, f"{wait} {int(start.window)} s"])


def _ascii(lines: Iterable[str]) -> list[str]:
    return [line.encode("ascii", "replace").decode() for line in lines]


def require_equal(whole: Program, undivided: Program, block_rows: int = BLOCK_ROWS) -> None:
    """Raises JoinError unless a program read back equals the undivided one as it would be written."""
    N = len(undivided.position)
    for first in range(0, N, block_rows):
        last = min(first + block_rows, N) - 1
        read, meant = excerpt(whole, first, last), as_written(excerpt(undivided, first, last))
        for field in ("position", "rotation", "turns", "speed", "fine", "via"):
            if not np.array_equal(getattr(read, field), getattr(meant, field)):
                raise JoinError(f"pages: read back together, their {field} differs from the undivided program's")
    sizes = [
        (len(p.position), len(p.speed), p.posture, p.uframe, p.utool, p.payload, p.acc) for p in (whole, undivided)
    ]
    if sizes[0] != sizes[1]:
        what = "length, posture, frames, payload or ACC"
        raise JoinError(f"pages: read back together, {what} differ from the undivided program's")
