"""Pages of a program of compgen's own, written from its columns: the bytes that ``pages.split`` makes of its text.

Such a program is regular: two frames, then one motion to each position in turn. So how long a page may be is one
number, and each page is the text of a stretch of the program, numbered from 1. The whole is never text at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compgen.core.evaluation import blocks_of
from compgen.core.exceptions import ImpossibleError
from compgen.fanuc.canonical.writer import compose
from compgen.fanuc.memory import MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM, MEMORY_REMARK
from compgen.fanuc.paging.capacity import Size, Store
from compgen.fanuc.paging.plan import settled
from compgen.fanuc.paging.split import Page, Paged, main_program
from compgen.fanuc.program import Program

FRAMES = 2  # lines: UFRAME_NUM and UTOOL_NUM

#: Remarks of all pages, from the numbers of the positions (from 0) that each starts at.
Headings = Callable[[Sequence[int]], Sequence[Sequence[str]]]


def split_own(
    program: Program, store: Store, headings: Headings, head_lines: int, main_heading: Sequence[str] = ()
) -> Paged:
    """A program of compgen's own in pages.

    Args:
        program: The undivided program; its remarks are left out.
        store: What the controller holds.
        headings: Remarks of the pages.
        head_lines: How many remarks a page gets at most.
        main_heading: Remarks of the main program.

    Raises:
        ImpossibleError: It cannot be parted so that each page fits; names the positions.
        InputError: A remark, a speed or a position that the format cannot say.
    """
    head = compose(replace(stretch(program, 0, 0), remarks=()))
    said = _said(head)

    def parts_in(room: Store) -> tuple[list[tuple[int, int]], list[float]]:
        bare = MEMORY_PROGRAM + MEMORY_REMARK * head_lines + said
        fits = int((room.memory - bare) // (MEMORY_POSITION + MEMORY_MOTION))
        parts = _parts(program, min(room.max_lines - head_lines - FRAMES, room.max_positions, fits))
        return parts, [bare + (last + 1 - first) * (MEMORY_POSITION + MEMORY_MOTION) for first, last in parts]

    parts, names, loads = settled(program.name, store, (), parts_in)
    told = [tuple(lines) for lines in headings([first for first, _ in parts])]

    def page(k: int, _: int) -> Page:
        first, last = parts[k]
        data = compose(replace(stretch(program, first, last), name=names[k], remarks=told[k]))
        count = last + 1 - first
        memory = MEMORY_PROGRAM + count * (MEMORY_POSITION + MEMORY_MOTION) + float(_said(data))
        motions = (first + 1 if first else 0, last + 1)
        return Page(names[k], data, loads[k], motions, Size(len(told[k]) + FRAMES + count, count, memory), ())

    pages = tuple(blocks_of(len(parts), page, 1))
    name = program.name[: store.name_length]
    return Paged(name, main_program(head, name, pages, main_heading), pages)


def stretch(program: Program, first: int, last: int) -> Program:
    """A program from one position to another, both from 0 and both in it."""
    here = slice(first, last + 1)
    return replace(
        program,
        position=program.position[here],
        rotation=program.rotation[here],
        turns=program.turns[here],
        speed=program.speed[first:last],
        fine=program.fine[here],
    )


def _parts(program: Program, holds: int) -> list[tuple[int, int]]:
    """First and last position of each page; each starts where the one before stopped, and is as long as can be."""
    N = len(program.position)
    stops = np.flatnonzero(program.fine)
    parts = []
    first = 0
    while N - first > holds:
        behind = int(np.searchsorted(stops, first + holds))
        last = int(stops[behind - 1]) if behind else 0
        if last <= first:
            raise ImpossibleError(
                f"program {program.name}: P[{first + 1}] to P[{min(first + max(holds, 1) + 1, N)}] is more than a page "
                "holds: no motion between them stops (FINE); let the robot stop on the way, or raise the "
                "controller's limits"
            )
        parts.append((first, last))
        first = last
    return [*parts, (first, N - 1)]


def _said(data: bytes) -> int:
    """Bytes of the lines before the first motion."""
    return data.index(b":J P[1] ") - 4 - (data.index(b"/MN\r\n") + 5)
