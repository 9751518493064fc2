"""What is delivered: one file, or pages with their main program and manifest, and what a controller reads from them."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compgen import __version__, fanuc
from compgen.core.arrays import Array, IntArray, own
from compgen.core.findings import Finding, Level
from compgen.core.units import KB
from compgen.fanuc import Program
from compgen.fanuc.canonical.writer import REMARK_LENGTH
from compgen.fanuc.paging.canonical_split import excerpt, split_canonical
from compgen.fanuc.paging.join_check import JoinError, interpret_pages
from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX, check_manifest, manifest_json
from compgen.fanuc.paging.split import Page, PagedProgram
from compgen.fanuc.paging.stops import PageStops, canonical_size, controller_capacity, head_line_count
from compgen.pipelines.job import Job

ROWS = 16384  # positions compared at a time


@dataclass(frozen=True, eq=False, slots=True)
class Start:
    """The robot as a page begins, when nobody waits before it."""

    time: float  # [s] since the program began
    rise: Array  # (K,) [K]
    window: float  # [s] how long all waits before it may be together

    def __post_init__(self) -> None:
        own(self, rise=("K",))


@dataclass(frozen=True, eq=False, slots=True)
class Delivery:
    """The files that the controller gets, and the program that they mean when read back."""

    files: tuple[tuple[str, bytes], ...]  # name and content; what must appear last stands last
    program: Program
    paged: PagedProgram | None = None
    starts: tuple[Start, ...] = ()  # of the pages

    @property
    def text(self) -> bytes:
        """The file that the operator starts."""
        return self.files[-1][1]


def one_file(program: Program) -> Delivery:
    """A program as one file."""
    text = fanuc.compose(program)
    return Delivery(((f"{program.name}.LS", text),), fanuc.interpret(text))


def in_pages(job: Job, program: Program, starts_at: Callable[[IntArray], Sequence[Start]]) -> Delivery:
    """A program as pages, main program and manifest, proven to be the program.

    Args:
        job: What it was made from.
        program: The undivided program; its first two remarks say what it is, and stand on each page.
        starts_at: The robot at positions, numbered from 0.

    Raises:
        ImpossibleError: It cannot be parted so that each page fits.
        JoinError: The pages, read back from their text, are not the program.
    """
    starts: list[Start] = []

    def headings(first: Sequence[int]) -> list[list[str]]:
        starts.extend(starts_at(np.array(first, dtype=np.int64)))
        return [_heading(job, program, k, len(first), now) for k, now in enumerate(starts)]

    store = controller_capacity(job.robot)
    paged = split_canonical(program, store, headings, head_line_count(len(job.heat.names)), _ascii(program.remarks[:2]))
    more = [_known(job, page, start) for page, start in zip(paged.pages, starts)]
    head = {"compgen": __version__, "inputs_sha256": job.inputs_hash, "robot": job.robot.name}
    told = manifest_json(paged, store, head, more)
    files = {f"{paged.name}{MANIFEST_SUFFIX}": told, **paged.files()}
    whole, _ = interpret_pages(*check_manifest(told, files))
    _same(whole, program)
    whole = replace(whole, name=paged.name)
    return Delivery(tuple(files.items()), whole, paged, tuple(starts))


def findings(job: Job, delivered: Delivery, stops: PageStops | None) -> list[Finding]:
    """What was done with a program that one file does not hold, or why nothing was."""
    store, program, paged = controller_capacity(job.robot), delivered.program, delivered.paged
    asked = canonical_size(len(program.position), len(program.remarks))
    checks = [
        ("max_positions", asked.positions, store.max_positions, "positions"),
        ("max_lines", asked.lines, store.max_lines, "lines"),
        ("memory_kB", asked.memory / KB, store.memory / KB, "kB estimated"),
    ]
    over = [f"{value:.0f} {what} (controller.{key} = {limit:g})" for key, value, limit, what in checks if value > limit]
    told = f"{', '.join(over)}: more than this controller holds in one file"
    if paged is not None and stops is not None:
        added = int(stops.added.sum())
        made = f"written as {len(paged.pages)} pages and a main program"
        drip = (
            f", to be loaded in {paged.load_count} loads, one after another (drip feed)" if paged.load_count > 1 else ""
        )
        more = f"; {added} stops were put in for them, {stops.on_the_part} of them on the part" if added else ""
        level = Level.WARNING if stops.on_the_part else Level.NOTE
        return [Finding(level, "controller.size", f"{told}; {made}{drip}{more}")]
    if not over:
        return []
    if stops is None:
        return [Finding(Level.WARNING, "controller.size", f"{told}; raise process.chord_um, or leave --no-pages out")]
    mend = "allow stops on the part with process.page_stops = 'anywhere', or raise process.chord_um"
    return [Finding(Level.WARNING, "controller.size", f"{told}, and it cannot be parted: {stops.obstacle}; {mend}")]


def _known(job: Job, page: Page, start: Start) -> dict[str, object]:
    """What the manifest says of a page besides its file."""
    return {
        "first_position": max(page.motions[0], 1),  # of the undivided program; the page starts there
        "last_position": page.motions[1],
        "start_s": round(start.time, 3),
        "start_window_s": round(start.window, 1),
        "rise_K": {name: round(float(r), 4) for name, r in zip(job.heat.names, start.rise)},
    }


def _heading(job: Job, program: Program, k: int, count: int, now: Start) -> list[str]:
    """Remarks at the head of a page, k from 0."""
    state = [f"{n} {r:.1f}" for n, r in zip(job.heat.names, now.rise)]
    told = [*program.remarks[:2], f"page {k + 1} of {count}, after {now.time:.0f} s"]
    told += [f"rise K {' '.join(state[i : i + 2])}" for i in range(0, len(state), 2)]
    wait = "start within" if k == 0 else "wait before it at most"
    return _ascii(line[:REMARK_LENGTH] for line in [*told, f"{wait} {now.window:.0f} s"])


def _ascii(lines: Iterable[str]) -> list[str]:
    return [line.encode("ascii", "replace").decode() for line in lines]


def _same(whole: Program, undivided: Program) -> None:
    """Raises JoinError unless a program is what another, not yet written, would drive."""
    N = len(undivided.position)
    for first in range(0, N, ROWS):
        last = min(first + ROWS, N) - 1
        a, b = excerpt(whole, first, last), fanuc.as_written(excerpt(undivided, first, last))
        for field in ("position", "rotation", "turns", "speed", "fine"):
            if not np.array_equal(getattr(a, field), getattr(b, field)):
                raise JoinError(f"pages: read back together, their {field} differs from the undivided program's")
    sizes = [(len(p.position), len(p.speed), p.posture, p.uframe, p.utool) for p in (whole, undivided)]
    if sizes[0] != sizes[1]:
        raise JoinError("pages: read back together, length, posture or frames differ from the undivided program's")
