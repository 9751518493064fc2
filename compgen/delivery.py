"""What is delivered: one file, or pages with their main program and manifest, and what a controller reads from them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from compgen import __version__
from compgen.arrays import Array, own
from compgen.dialects import fanuc_ls
from compgen.dialects.fanuc_ls import Program
from compgen.dialects.fanuc_ls.names import ENDING
from compgen.dialects.fanuc_ls.write import APPROACH_PERCENT, REMARK_LENGTH
from compgen.job import Job
from compgen.paging import Stops, head_lines, size, store_of
from compgen.units import KB
from compgen.verify import Finding

if TYPE_CHECKING:  # a program in one file is written without what parts, reads and joins pages
    from compgen.dialects.fanuc_ls.pages import Page, Paged


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
    paged: "Paged | None" = None
    starts: tuple[Start, ...] = ()  # of the pages

    @property
    def text(self) -> bytes:
        """The file that the operator starts."""
        return self.files[-1][1]


def one_file(program: Program) -> Delivery:
    """A program as one file."""
    text = fanuc_ls.compose(program)
    return Delivery(((f"{program.name}.LS", text),), fanuc_ls.interpret(text))


def in_pages(job: Job, program: Program, start_at: Callable[[int], Start]) -> Delivery:
    """A program as pages, main program and manifest, proven to be the program.

    Args:
        job: What it was made from.
        program: The undivided program; its first two remarks say what it is, and stand on each page.
        start_at: The robot at a position, from 0.

    Raises:
        ImpossibleError: It cannot be parted so that each page fits.
        JoinError: The pages, read back from their text, are not the program.
    """
    from compgen.dialects.fanuc_ls.adjoin import interpret_pages
    from compgen.dialects.fanuc_ls.manifest import check_manifest, manifest
    from compgen.dialects.fanuc_ls.pages import split

    starts: list[Start] = []

    def heading(k: int, count: int, first: int) -> list[str]:
        starts.append(start_at(max(first - 1, 0)))
        now = starts[-1]
        state = [f"{n} {r:.1f}" for n, r in zip(job.heat.names, now.rise)]
        told = [*program.remarks[:2], f"page {k + 1} of {count}, after {now.time:.0f} s"]
        told += [f"rise K {' '.join(state[i : i + 2])}" for i in range(0, len(state), 2)]
        wait = "start within" if k == 0 else "wait before it at most"
        return [line[:REMARK_LENGTH] for line in [*told, f"{wait} {now.window:.0f} s"]]

    store = store_of(job.robot)
    bare = replace(program, remarks=())
    undivided = fanuc_ls.compose(bare)
    paged = split(
        fanuc_ls.loads(undivided),
        store,
        heading=heading,
        head_lines=head_lines(job),
        main_heading=program.remarks[:2],
        renumber=True,
        joint_entry=APPROACH_PERCENT,
    )
    more = [_known(job, page, start) for page, start in zip(paged.pages, starts)]
    head = {"compgen": __version__, "inputs_sha256": job.inputs_hash, "robot": job.robot.name}
    told = manifest(paged, store, head, more)
    files = {f"{paged.name}{ENDING}": told, **paged.files()}
    whole, _ = interpret_pages(*check_manifest(told, files))
    _same(whole, fanuc_ls.interpret(undivided))
    whole = replace(whole, name=paged.name)
    return Delivery(tuple(files.items()), whole, paged, tuple(starts))


def findings(job: Job, delivered: Delivery, stops: Stops | None) -> list[Finding]:
    """What was done with a program that one file does not hold, or why nothing was."""
    store, program, paged = store_of(job.robot), delivered.program, delivered.paged
    asked = size(len(program.position), len(program.remarks))
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
        drip = f", to be loaded in {paged.loads} loads, one after another (drip feed)" if paged.loads > 1 else ""
        more = f"; {added} stops were put in for them, {stops.on_the_part} of them on the part" if added else ""
        level = "warning" if stops.on_the_part else "note"
        return [Finding(level, "controller.size", f"{told}; {made}{drip}{more}")]
    if not over:
        return []
    if stops is None:
        return [Finding("warning", "controller.size", f"{told}; raise process.chord_um, or leave --no-pages out")]
    mend = "allow stops on the part with process.page_stops = 'anywhere', or raise process.chord_um"
    return [Finding("warning", "controller.size", f"{told}, and it cannot be parted: {stops.why_not}; {mend}")]


def _known(job: Job, page: "Page", start: Start) -> dict[str, object]:
    """What the manifest says of a page besides its file."""
    return {
        "first_position": max(page.motions[0], 1),  # of the undivided program; the page starts there
        "last_position": page.motions[1],
        "start_s": round(start.time, 3),
        "start_window_s": round(start.window, 1),
        "rise_K": {name: round(float(r), 4) for name, r in zip(job.heat.names, start.rise)},
    }


def _same(whole: Program, undivided: Program) -> None:
    """Raises JoinError unless two programs drive the same."""
    from compgen.dialects.fanuc_ls.adjoin import JoinError

    for field in ("position", "rotation", "turns", "speed", "fine"):
        a, b = getattr(whole, field), getattr(undivided, field)
        if a.shape != b.shape or not np.array_equal(a, b):
            raise JoinError(f"pages: read back together, their {field} differs from the undivided program's")
    if (whole.posture, whole.uframe, whole.utool) != (undivided.posture, undivided.uframe, undivided.utool):
        raise JoinError("pages: read back together, posture or frames differ from the undivided program's")
