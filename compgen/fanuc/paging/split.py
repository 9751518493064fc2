"""A long program as pages that each fit the controller, and a main program that calls them in order.

``plan`` says where a program is split. A page is a program of its own, with the positions that it drives to, and the
frames, payload and conditions in force where it begins. It starts by going to where the page before stopped: no motion
when the robot stands there, a defined start when it does not. The main program keeps the program's name, so that
whoever calls it still does.

When all pages together are more than the controller holds they come in loads: the main program pauses before each load
but the first, for the pages of the load before to be deleted and its own to be loaded (drip feed).

A canonical program is regular: two frames, then one motion to each position in turn. So one number says how long a
page may be, and each page is the text of an excerpt, numbered from 1: the bytes that ``split_program`` makes of the
program's text, which is never held whole.
"""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

import numpy as np

from compgen.core.evaluation import map_blocks
from compgen.core.exceptions import ImpossibleError
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.canonical.writer import compose
from compgen.fanuc.listing.languages import in_german, is_german
from compgen.fanuc.listing.lines import line_end, line_ends
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.paging.capacity import units_memory
from compgen.fanuc.paging.plan import PageRange, allocate_pages, page_positions, plan_pages
from compgen.fanuc.vocabulary import SPEED_NEEDS_LENGTH
from compgen.program.page_stops import FRAME_LINES
from compgen.program.pages import (
    MEMORY_MOTION,
    MEMORY_POSITION,
    MEMORY_PROGRAM,
    MEMORY_REMARK,
    Page,
    PagedProgram,
    ProgramSize,
    estimated_memory,
    excerpt,
)
from compgen.program.program import Program
from compgen.robot.robot import Capacity

#: Remarks at a page's head, from its number (from 0), the count of pages, and how many motions come before it.
Heading = Callable[[int, int, int], Sequence[str]]

_BEGIN = rb"(?:\A|(?<=[\r\n]))"
_TAG = re.compile(_BEGIN + rb"/(?:APPL|MN)\b[^\r\n]*(?:\r\n|\n|\r)?", re.IGNORECASE)
_MN = re.compile(_BEGIN + rb"/MN\b[^\r\n]*(?:\r\n|\n|\r)?", re.IGNORECASE)
_NAME = re.compile(_BEGIN + rb"(/PROG[ \t]+)([^\s]+)([^\r\n]*)", re.IGNORECASE)
_COUNT = re.compile(_BEGIN + rb"((?:LINE_COUNT|ZEILEN)[ \t]*=[ \t]*)\d+", re.IGNORECASE)
_MASK = re.compile(_BEGIN + rb"(DEFAULT_GRO?UP[ \t]*=)([^;\r\n]*)", re.IGNORECASE)
_NUMBER = re.compile(rb"([ \t]*)(\d+)(?=[ \t]*:)")
_P = re.compile(rb"([Pp]\[(?<![A-Za-z_$]..)[ \t]*)(\d+)")  # its first letter first: four times as fast


def split_program(  # noqa: PLR0913 - what pages look like, each named by its caller
    program: LsProgram,
    capacity: Capacity,
    taken: Collection[str] = (),
    heading: Heading | None = None,
    head_lines: int = 1,
    main_heading: Sequence[str] = (),
    *,
    renumber: bool = False,
    joint_entry: int | None = None,
    common: Sequence[str] = (),
) -> PagedProgram:
    """A program in pages.

    Args:
        program: Any program.
        capacity: What the controller holds.
        taken: Names of programs that exist; those it calls are known.
        heading: Remarks for each page; by default which page it is.
        head_lines: How many remarks a page gets at most.
        main_heading: Remarks of the main program.
        renumber: Number the positions of each page from 1. Otherwise numbers are kept, as long as the controller has
            such numbers. Never done where a position is found at run time (P[R[1]]).
        joint_entry: Let each page go to its start by a joint motion at this percentage; by default it repeats the
            motion that ended the page before, without its options.
        common: Remarks at the head of each page.

    Returns:
        Pages and main program; line numbers start anew in each, and LINE_COUNT follows.

    Raises:
        ImpossibleError: It cannot be split so that each page fits; names the lines. A position that needs a new number
            is not in the file.
    """
    flow = read_flow(program)
    plan = plan_pages(program, flow, capacity, taken, head_lines + len(common))
    blocks = dict(zip(program.positions.number.tolist(), map(tuple, program.positions.block.tolist()), strict=True))
    too_large = max(blocks, default=0) > capacity.max_positions
    renumber = (renumber or too_large) and not bool(np.any(flow.mention == NO_NUMBER))
    if renumber and (gone := {*flow.mention.tolist()} - {*blocks}):
        raise ImpossibleError(
            f"program {program.name}: P[{min(gone)}] is not in /POS, and positions beyond P[{capacity.max_positions}] "
            "need new numbers; teach it, or raise controller.max_positions"
        )
    count = len(plan.ranges)
    pages = []
    for k, (page, name, load) in enumerate(zip(plan.ranges, plan.names, plan.load, strict=True)):
        first, behind = np.searchsorted(flow.move_unit, [page.first, page.last]).tolist()
        remarks = (*common, *(heading(k, count, first) if heading else (f"page {k + 1} of {count}",)))
        used = [n for n in page_positions(program, flow, page) if n in blocks]
        new = {n: i for i, n in enumerate(used, 1)} if renumber else {}
        body = _body(program, flow, page, remarks, new, joint_entry)
        page_blocks = [blocks[n] for n in used] if renumber else sorted(blocks[n] for n in used)
        data = _page_text(program, name, body, page_blocks, new)
        size = ProgramSize(line_count(body), len(used), _memory(flow, page, body, len(used)))
        pages.append(Page(name=name, data=data, load=load, motions=(first, behind), size=size, notes=page.notes))
    name = program.name[: capacity.name_length]
    return PagedProgram(name, main_program_text(program.source, name, pages, main_heading), tuple(pages))


def _body(
    program: LsProgram,
    flow: Flow,
    page: PageRange,
    remarks: Sequence[str],
    new: dict[int, int],
    joint_entry: int | None,
) -> list[bytes]:
    """The statements of a page, numbered from 1."""
    end = line_end(program.data)
    texts = [b"   0:  !" + remark.encode("ascii", "replace") + b" ;" + end for remark in remarks]
    units = [*page.settings, *range(page.first, page.last)]
    statements = [program.source[start:stop] for start, stop in flow.span[units].tolist()]
    if new:  # remarks and what is disabled stay as they are
        active = [k for k, s in enumerate(units) if flow.motion[s] != NO_NUMBER or s in flow.text]
        for k, text in zip(active, _renumber_each([statements[k] for k in active], new), strict=True):
            statements[k] = text
    texts += statements[: len(page.settings)]
    if page.entry != NO_NUMBER:
        texts.append(b"   0:" + _renumber(_entry_statement(program, page.entry, joint_entry), new) + b"    ;" + end)
    return _number_lines(texts + statements[len(page.settings) :])


def _entry_statement(program: LsProgram, i: int, joint_entry: int | None) -> bytes:
    """The motion that brings a page to its start."""
    m = program.motions
    target = m.target[i][-1]
    if joint_entry is not None:
        return program.own_words(f"J {target} {joint_entry}% FINE".encode("latin-1"))
    joint = m.letter[i] == "J"
    speed = m.speed[i]
    if SPEED_NEEDS_LENGTH.search(speed):
        speed = "10%" if joint else "100mm/sec"  # a motion of no length takes no time
    return program.own_words(f"{'J' if joint else 'L'} {target} {speed} FINE".encode("latin-1"))


def _renumber_each(texts: list[bytes], new: dict[int, int]) -> list[bytes]:
    """Texts with new numbers of positions, all at once where a zero byte can separate them."""
    whole = b"\0".join(texts)
    if whole.count(b"\0") == len(texts) - 1:
        return _renumber(whole, new).split(b"\0")
    return [_renumber(text, new) for text in texts]


def _renumber(text: bytes, new: dict[int, int]) -> bytes:
    """Text with new numbers of positions."""
    if not new:
        return text
    pieces = _P.split(text)
    old = [int(digits) for digits in pieces[2::3]]
    pieces[2::3] = [b"%d" % new.get(n, n) for n in old]
    return b"".join(pieces)


def _number_lines(texts: list[bytes]) -> list[bytes]:
    """Units with line numbers from 1; a unit without a number gets none."""
    numbers = [_NUMBER.match(text) for text in texts]
    return [
        text if number is None else b"%*d" % (min(number.end(), 4), n) + text[number.end() :]
        for n, (text, number) in enumerate(zip(texts, numbers, strict=True), 1)
    ]


def _page_text(
    program: LsProgram, name: str, body: list[bytes], blocks: list[tuple[int, int]], new: dict[int, int]
) -> bytes:
    """A page's file; ``blocks`` are the spans of its positions in the program's file."""
    end = line_end(program.data)
    mn = _MN.search(program.source)
    head = _rename_head(program.source[: mn.end() if mn else 0], name, len(body), keep_subtype=False)
    positions = b"".join([program.source[start:stop] + end for start, stop in blocks])
    return b"".join([head, *_complete_last_line(body, end), b"/POS" + end, _renumber(positions, new), b"/END" + end])


def main_program_text(data: bytes, name: str, pages: Sequence[Page], remarks: Sequence[str]) -> bytes:
    """The program that calls the pages, under the head of ``data``; between loads it waits for the next."""
    end = line_end(data)
    loads = pages[-1].load
    statements = [f"!{remark}" for remark in remarks]
    for before, page in zip([None, *pages[:-1]], pages, strict=True):
        if before is not None and before.load != page.load:
            statements += [f"MESSAGE[LOAD {page.load} OF {loads}]", "PAUSE"]
        statements.append(f"CALL {page.name}")
    body = [f"{n:4d}:  {text} ;".encode("ascii", "replace") + end for n, text in enumerate(statements, 1)]
    body = [in_german(line) for line in body] if is_german(data) else body
    tag = _TAG.search(data)
    head = _rename_head(data[: tag.start() if tag else 0], name, len(body), keep_subtype=True)
    head = _MASK.sub(lambda m: m.group(1) + re.sub(rb"\d", b"*", m.group(2)), head, count=1)
    return b"".join([head, b"/MN" + end, *body, b"/POS" + end, b"/END" + end])


def _rename_head(head: bytes, name: str, lines: int, *, keep_subtype: bool) -> bytes:
    """The program's head with another name and another count of lines."""
    head = _NAME.sub(
        lambda m: m.group(1) + name.encode("latin-1") + (m.group(3) if keep_subtype else b""), head, count=1
    )
    return _COUNT.sub(lambda m: m.group(1) + str(lines).encode(), head, count=1)


def _complete_last_line(body: list[bytes], end: bytes) -> list[bytes]:
    """The units of a section, the last one with a line end."""
    if body and not body[-1].endswith((b"\n", b"\r")):
        return [*body[:-1], body[-1] + end]
    return body


def line_count(body: list[bytes]) -> int:
    """Lines of statements, their continuations counted."""
    whole = b"".join(body)  # each ends with its line; only the last may lack the end
    return line_ends(whole, 0, len(whole)) + (bool(body) and not body[-1].endswith((b"\n", b"\r")))


def _memory(flow: Flow, page: PageRange, body: list[bytes], positions: int) -> float:
    """Estimated memory of a page [bytes]; see ``capacity.units_memory``."""
    added = len(body) - (page.last - page.first)
    is_motion = np.concatenate([np.zeros(added, dtype=bool), flow.motion[page.first : page.last] != NO_NUMBER])
    if page.entry != NO_NUMBER:
        is_motion[added - 1] = True
    length = np.array([len(text) for text in body], dtype=float)
    return MEMORY_PROGRAM + positions * MEMORY_POSITION + float(units_memory(length, is_motion).sum())


#: Remarks of all pages, from the numbers of the positions (from 0) that each starts at.
Headings = Callable[[Sequence[int]], Sequence[Sequence[str]]]


def split_canonical(
    program: Program, capacity: Capacity, headings: Headings, head_lines: int, main_heading: Sequence[str]
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
        bare = MEMORY_REMARK * head_lines + head_size
        fits = int((page_capacity.memory - bare - MEMORY_PROGRAM) // (MEMORY_POSITION + MEMORY_MOTION))
        max_lines = page_capacity.max_lines - head_lines - settings
        ranges = _page_ranges(program, min(max_lines, page_capacity.max_positions, fits))
        return ranges, [bare + estimated_memory(last + 1 - first) for first, last in ranges]

    ranges, names, loads = allocate_pages(program.name, capacity, (), ranges_within)
    remarks = [tuple(lines) for lines in headings([first for first, _ in ranges])]

    def page(k: int, _: int) -> Page:
        first, last = ranges[k]
        data = compose(replace(excerpt(program, first, last), name=names[k], remarks=remarks[k]))
        count = last + 1 - first
        motions = (first + 1 if first else 0, last + 1)
        size = ProgramSize(len(remarks[k]) + settings + count, count, estimated_memory(count) + _head_size(data))
        return Page(name=names[k], data=data, load=loads[k], motions=motions, size=size, notes=())

    pages = tuple(map_blocks(len(ranges), page, 1))
    name = program.name[: capacity.name_length]
    return PagedProgram(name, main_program_text(head, name, pages, main_heading), pages)


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
