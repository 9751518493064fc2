"""Pages of a canonical program, written from its columns: the bytes that ``split_program`` makes of its text.

A canonical program is regular: two frames, then one motion to each position in turn. So one number says how long a
page may be, and each page is the text of an excerpt, numbered from 1. The whole program is never held as text.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compgen.core.evaluation import map_blocks
from compgen.core.exceptions import ImpossibleError
from compgen.fanuc.canonical.writer import compose
from compgen.fanuc.memory import MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM, MEMORY_REMARK
from compgen.fanuc.paging.capacity import Capacity, ProgramSize
from compgen.fanuc.paging.plan import allocate_pages
from compgen.fanuc.paging.split import Page, PagedProgram, main_program_text
from compgen.fanuc.paging.stops import FRAME_LINES
from compgen.program.program import Program

#: Remarks of all pages, from the numbers of the positions (from 0) that each starts at.
Headings = Callable[[Sequence[int]], Sequence[Sequence[str]]]


def split_canonical(
    program: Program, capacity: Capacity, headings: Headings, head_lines: int, main_heading: Sequence[str] = ()
) -> PagedProgram:
    """A canonical program in pages.

    Args:
        program: The undivided program; its remarks are left out.
        capacity: What the controller holds.
        headings: Remarks of the pages.
        head_lines: How many remarks a page gets at most.
        main_heading: Remarks of the main program.

    Raises:
        ImpossibleError: It cannot be split so that each page fits; names the positions.
        InputError: A remark, a speed or a position that the format cannot say.
    """
    head = compose(replace(excerpt(program, 0, 0), remarks=()))
    head_size, settings = _head_size(head), FRAME_LINES + (program.payload is not None)

    def ranges_within(page_capacity: Capacity) -> tuple[list[tuple[int, int]], list[float]]:
        bare = MEMORY_PROGRAM + MEMORY_REMARK * head_lines + head_size
        fits = int((page_capacity.memory - bare) // (MEMORY_POSITION + MEMORY_MOTION))
        max_lines = page_capacity.max_lines - head_lines - settings
        ranges = _page_ranges(program, min(max_lines, page_capacity.max_positions, fits))
        return ranges, [bare + (last + 1 - first) * (MEMORY_POSITION + MEMORY_MOTION) for first, last in ranges]

    ranges, names, loads = allocate_pages(program.name, capacity, (), ranges_within)
    remarks = [tuple(lines) for lines in headings([first for first, _ in ranges])]

    def page(k: int, _: int) -> Page:
        first, last = ranges[k]
        data = compose(replace(excerpt(program, first, last), name=names[k], remarks=remarks[k]))
        count = last + 1 - first
        memory = MEMORY_PROGRAM + count * (MEMORY_POSITION + MEMORY_MOTION) + float(_head_size(data))
        motions = (first + 1 if first else 0, last + 1)
        size = ProgramSize(len(remarks[k]) + settings + count, count, memory)
        return Page(name=names[k], data=data, load=loads[k], motions=motions, size=size, notes=())

    pages = tuple(map_blocks(len(ranges), page, 1))
    name = program.name[: capacity.name_length]
    return PagedProgram(name, main_program_text(head, name, pages, main_heading), pages)


def excerpt(program: Program, first: int, last: int) -> Program:
    """The program from position ``first`` to ``last``, both included and numbered from 0."""
    rows = slice(first, last + 1)
    return replace(
        program,
        position=program.position[rows],
        rotation=program.rotation[rows],
        turns=program.turns[rows],
        speed=program.speed[first:last],
        fine=program.fine[rows],
        via=program.via[rows],
    )


def _page_ranges(program: Program, per_page: int) -> list[tuple[int, int]]:
    """First and last position of each page; each starts where the one before stopped, and is as long as possible."""
    N = len(program.position)
    stops = np.flatnonzero(program.fine)
    ranges = []
    first = 0
    while N - first > per_page:
        behind = int(np.searchsorted(stops, first + per_page))
        last = int(stops[behind - 1]) if behind else 0
        if last <= first:
            raise ImpossibleError(
                f"program {program.name}: P[{first + 1}] to P[{min(first + max(per_page, 1) + 1, N)}] is more than a "
                "page holds: no motion between them stops (FINE); let the robot stop on the way, or raise the "
                "controller's limits"
            )
        ranges.append((first, last))
        first = last
    return [*ranges, (first, N - 1)]


def _head_size(data: bytes) -> int:
    """Bytes of the lines before the first motion."""
    return data.index(b":J P[1] ") - 4 - (data.index(b"/MN\r\n") + 5)
