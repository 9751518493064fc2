"""A long program as pages that each fit the controller, and a main program that calls them in order.

A pure function on any program's text; ``flow`` and ``parting`` say where it is parted. A page is a program of its own,
with the positions that it drives to, and the frames, payload and conditions in force where it begins. It starts by
going to where the page before stopped: no motion when the robot stands there, a defined start when it does not. The
main program keeps the program's name, so that whoever calls it still does.

When all pages together are beyond the controller's store they come in loads: the main program pauses before each load
but the first, for the pages of the load before to be deleted and its own to be loaded (drip feed).
"""

import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.listing.lines import line_ends
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.memory import MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM
from compgen.fanuc.paging.capacity import USUAL_MOTION, Size, Store
from compgen.fanuc.paging.plan import Part, numbers_of, plan

#: Remarks at a page's head, from its number (from 0), the count of pages, and how many motions come before it.
Heading = Callable[[int, int, int], Sequence[str]]

_BEGIN = rb"(?:\A|(?<=[\r\n]))"
_TAG = re.compile(_BEGIN + rb"/(?:APPL|MN)\b[^\r\n]*(?:\r\n|\n|\r)?", re.IGNORECASE)
_MN = re.compile(_BEGIN + rb"/MN\b[^\r\n]*(?:\r\n|\n|\r)?", re.IGNORECASE)
_NAME = re.compile(_BEGIN + rb"(/PROG[ \t]+)([^\s]+)([^\r\n]*)", re.IGNORECASE)
_COUNT = re.compile(_BEGIN + rb"(LINE_COUNT[ \t]*=[ \t]*)\d+", re.IGNORECASE)
_MASK = re.compile(_BEGIN + rb"(DEFAULT_GROUP[ \t]*=)([^;\r\n]*)", re.IGNORECASE)
_NUMBER = re.compile(rb"([ \t]*)(\d+)(?=[ \t]*:)")
_P = re.compile(rb"([Pp]\[(?<![A-Za-z_$]..)[ \t]*)(\d+)")  # its first letter first: found four times as fast


@dataclass(frozen=True, eq=False, slots=True)
class Page:
    """One part of a program, as it is loaded."""

    name: str
    data: bytes
    load: int  # from 1
    motions: tuple[int, int]  # active ones of the undivided program, first and behind the last; without its start
    size: Size
    notes: tuple[str, ...]  # what it leaves to the page before, and why


@dataclass(frozen=True, eq=False, slots=True)
class Paged:
    """A program in pages."""

    name: str
    main: bytes
    pages: tuple[Page, ...]

    @property
    def loads(self) -> int:
        """In how many loads the pages come; more than one is a drip feed."""
        return self.pages[-1].load

    def files(self) -> dict[str, bytes]:
        """File name to content, pages in their order, the main program last."""
        return {**{f"{p.name}.LS": p.data for p in self.pages}, f"{self.name}.LS": self.main}


def split(
    program: LsProgram,
    store: Store,
    taken: Collection[str] = (),
    heading: Heading | None = None,
    head_lines: int = 1,
    main_heading: Sequence[str] = (),
    renumber: bool = False,
    joint_entry: int | None = None,
) -> Paged:
    """A program in pages.

    Args:
        program: Any program.
        store: What the controller holds.
        taken: Names of programs that exist; those it calls are known.
        heading: Remarks for each page; default which page it is.
        head_lines: How many remarks a page gets at most.
        main_heading: Remarks of the main program.
        renumber: Number the positions of each page from 1. Otherwise numbers are kept, as long as the controller has
            such numbers. Never done where a position is found at run time (P[R[1]]).
        joint_entry: Let each page go to its start by a joint motion at this percentage; by default it repeats the
            motion that ended the page before, without its options.

    Returns:
        Pages and main program; line numbers start anew in each, and LINE_COUNT follows.

    Raises:
        ImpossibleError: It cannot be parted so that each page fits; names the lines.
    """
    flow = read_flow(program)
    parts = plan(program, flow, store, taken, head_lines)
    place = dict(zip(program.positions.number.tolist(), map(tuple, program.positions.block.tolist())))
    largest = max(place, default=0)
    anew = (renumber or largest > store.max_positions) and not bool(np.any(flow.mention == NO_NUMBER))
    count = len(parts.parts)
    pages = []
    for k, (part, name, load) in enumerate(zip(parts.parts, parts.names, parts.load)):
        first, behind = np.searchsorted(flow.move_unit, [part.first, part.last]).tolist()
        told = heading(k, count, first) if heading else (f"page {k + 1} of {count}",)
        used = [n for n in numbers_of(program, flow, part) if n in place]
        new = {n: i for i, n in enumerate(used, 1)} if anew else {}
        body = _body(program, flow, part, told, new, joint_entry)
        blocks = [place[n] for n in used] if anew else sorted(place[n] for n in used)
        data = _text(program, name, body, blocks, new)
        asks = Size(_lines(body), len(used), _memory(flow, part, body, len(used)))
        pages.append(Page(name, data, load, (first, behind), asks, part.notes))
    name = program.name[: store.name_length]
    return Paged(name, main_program(program.data, name, pages, main_heading), tuple(pages))


def _body(
    program: LsProgram, flow: Flow, part: Part, told: Sequence[str], new: dict[int, int], joint_entry: int | None
) -> list[bytes]:
    """The statements of a page, numbered from 1."""
    end = _line_end(program.data)
    texts = [b"   0:  !" + remark.encode("ascii", "replace") + b" ;" + end for remark in told]
    units = [*part.again, *range(part.first, part.last)]
    said = [program.data[start:stop] for start, stop in flow.span[units].tolist()]
    if new:  # remarks and what is disabled stay as they are
        drives = [k for k, s in enumerate(units) if flow.motion[s] != NO_NUMBER or s in flow.text]
        for k, text in zip(drives, _each_renumbered([said[k] for k in drives], new)):
            said[k] = text
    texts += said[: len(part.again)]
    if part.entry != NO_NUMBER:
        texts.append(b"   0:" + _renumbered(_entry(program, part.entry, joint_entry), new) + b"    ;" + end)
    return _numbered(texts + said[len(part.again) :])


def _entry(program: LsProgram, i: int, joint_entry: int | None) -> bytes:
    """The motion that brings a page to its start."""
    m = program.motions
    target = m.target[i][-1]
    if joint_entry is not None:
        return f"J {target} {joint_entry}% FINE".encode("latin-1")
    joint = m.letter[i] == "J"
    speed = m.speed[i]
    if re.search(r"(?:sec|WELD_SPEED)$", speed, re.IGNORECASE) and not re.search(r"/sec$", speed, re.IGNORECASE):
        speed = "10%" if joint else "100mm/sec"  # a motion of no length takes no time
    return f"{'J' if joint else 'L'} {target} {speed} FINE".encode("latin-1")


def _each_renumbered(texts: list[bytes], new: dict[int, int]) -> list[bytes]:
    """Texts with new numbers of positions, all at once where a zero byte can part them."""
    whole = b"\0".join(texts)
    if whole.count(b"\0") == len(texts) - 1:
        return _renumbered(whole, new).split(b"\0")
    return [_renumbered(text, new) for text in texts]


def _renumbered(text: bytes, new: dict[int, int]) -> bytes:
    """Text with new numbers of positions."""
    if not new:
        return text
    pieces = _P.split(text)
    old = [int(digits) for digits in pieces[2::3]]
    pieces[2::3] = [b"%d" % new.get(n, n) for n in old]
    return b"".join(pieces)


def _numbered(texts: list[bytes]) -> list[bytes]:
    """Units with line numbers from 1; what has no number gets none."""
    found = [_NUMBER.match(text) for text in texts]
    return [
        text if number is None else b"%*d" % (min(number.end(), 4), n) + text[number.end() :]
        for n, (text, number) in enumerate(zip(texts, found), 1)
    ]


def _text(
    program: LsProgram, name: str, body: list[bytes], blocks: list[tuple[int, int]], new: dict[int, int]
) -> bytes:
    """A page's file; positions by their places in the program's."""
    end = _line_end(program.data)
    mn = _MN.search(program.data)
    head = _headed(program.data[: mn.end() if mn else 0], name, len(body), keep_subtype=False)
    places = b"".join([program.data[start:stop] + end for start, stop in blocks])
    return b"".join([head, *_whole(body, end), b"/POS" + end, _renumbered(places, new), b"/END" + end])


def main_program(data: bytes, name: str, pages: Sequence[Page], told: Sequence[str]) -> bytes:
    """The program that calls the pages, with the head of a program's text; between loads it waits for the next."""
    end = _line_end(data)
    loads = pages[-1].load
    said = [f"!{remark}" for remark in told]
    for before, page in zip([None, *pages[:-1]], pages):
        if before is not None and before.load != page.load:
            said += [f"MESSAGE[LOAD {page.load} OF {loads}]", "PAUSE"]
        said.append(f"CALL {page.name}")
    body = [f"{n:4d}:  {text} ;".encode("ascii", "replace") + end for n, text in enumerate(said, 1)]
    tag = _TAG.search(data)
    head = _headed(data[: tag.start() if tag else 0], name, len(body), keep_subtype=True)
    head = _MASK.sub(lambda m: m.group(1) + re.sub(rb"\d", b"*", m.group(2)), head, count=1)
    return b"".join([head, b"/MN" + end, *body, b"/POS" + end, b"/END" + end])


def _headed(head: bytes, name: str, lines: int, keep_subtype: bool) -> bytes:
    """The program's head with another name and another count of lines."""
    head = _NAME.sub(
        lambda m: m.group(1) + name.encode("latin-1") + (m.group(3) if keep_subtype else b""), head, count=1
    )
    return _COUNT.sub(lambda m: m.group(1) + str(lines).encode(), head, count=1)


def _whole(body: list[bytes], end: bytes) -> list[bytes]:
    """The last unit of a section without a line end gets one."""
    if body and not body[-1].endswith((b"\n", b"\r")):
        return [*body[:-1], body[-1] + end]
    return body


def _lines(body: list[bytes]) -> int:
    whole = b"".join(body)  # each ends with its line; only the last may lack the end
    return line_ends(whole, 0, len(whole)) + (bool(body) and not body[-1].endswith((b"\n", b"\r")))


def _memory(flow: Flow, part: Part, body: list[bytes], positions: int) -> float:
    """Estimated memory of a page [bytes]: see ``store.costs``."""
    own = len(body) - (part.last - part.first)
    moves = np.concatenate([np.zeros(own, dtype=bool), flow.motion[part.first : part.last] != NO_NUMBER])
    if part.entry != NO_NUMBER:
        moves[own - 1] = True
    length = np.array([len(text) for text in body], dtype=float)
    memory = np.where(moves, MEMORY_MOTION + np.maximum(length - USUAL_MOTION, 0.0), length)
    return MEMORY_PROGRAM + positions * MEMORY_POSITION + float(memory.sum())


def _line_end(data: bytes) -> bytes:
    """The line end that the file begins with."""
    found = re.search(rb"\r\n|\n|\r", data)
    return found.group() if found else b"\r\n"
