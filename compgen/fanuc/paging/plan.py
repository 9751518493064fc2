"""Where a long program is split: as few pages as possible, each as long as the controller allows."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import ImpossibleError, InputError
from compgen.core.units import KB
from compgen.fanuc.analysis.control_flow import Flow
from compgen.fanuc.analysis.modal_state import ModalState, read_modal_state
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import ends_elsewhere
from compgen.fanuc.paging.capacity import UnitSizes, unit_sizes
from compgen.fanuc.vocabulary import CALL, LOCAL_REGISTER, PALLETIZING
from compgen.program.pages import (
    MEMORY_CALL,
    MEMORY_MOTION,
    MEMORY_POSITION,
    MEMORY_PROGRAM,
    MEMORY_REMARK,
    ProgramSize,
)
from compgen.robot.robot import Capacity

RangeT = TypeVar("RangeT")


@dataclass(frozen=True, slots=True)
class PageRange:
    """What a page takes from the program: units ``first`` up to ``last``, and what it repeats before them."""

    first: int
    last: int
    settings: tuple[int, ...]  # units of settings to repeat
    entry: int  # the motion that ends the page before, to be repeated; NO_NUMBER for none
    notes: tuple[str, ...]  # what it relies on the page before for, and why


@dataclass(frozen=True, slots=True)
class PagePlan:
    """The pages of a program, their names, and in which load each comes."""

    ranges: tuple[PageRange, ...]
    names: tuple[str, ...]
    load: tuple[int, ...]  # from 1


def plan_pages(
    program: LsProgram, flow: Flow, capacity: Capacity, taken: Collection[str] = (), head_lines: int = 1
) -> PagePlan:
    """Where to split a program.

    Args:
        program: Any program.
        flow: Its control flow.
        capacity: What the controller holds.
        taken: Names of programs that exist; pages get others.
        head_lines: Remarks that each page will have at its head.

    Raises:
        ImpossibleError: No place to split within what a page holds, or the program uses arguments or local registers,
            which its pages would not have; names the line.
    """
    _refuse_local_registers(program, flow)
    _refuse_palletizing(program, flow)
    settings = read_modal_state(program, flow)
    sizes = unit_sizes(program, flow)
    called = [name for text in [*flow.text.values(), *flow.options.values()] for name in CALL.findall(text)]

    def ranges_within(page_capacity: Capacity) -> tuple[list[PageRange], list[float]]:
        return _page_ranges(program, flow, settings, sizes, page_capacity, head_lines)

    ranges, names, load = allocate_pages(program.name, capacity, [*taken, *called], ranges_within)
    return PagePlan(tuple(ranges), names, load)


def allocate_pages(
    name: str,
    capacity: Capacity,
    taken: Collection[str],
    ranges_within: Callable[[Capacity], tuple[list[RangeT], list[float]]],
) -> tuple[list[RangeT], tuple[str, ...], tuple[int, ...]]:
    """Pages that leave room for the main program, their names, and in which load each comes.

    Args:
        name: Of the program.
        capacity: What the controller holds.
        taken: Names that no page may have.
        ranges_within: The pages of the program, and the memory of each [bytes], when one page may fill a capacity.
    """
    main = MEMORY_PROGRAM + MEMORY_CALL
    while True:
        ranges, memory = ranges_within(replace(capacity, memory=capacity.memory - main))
        names = page_names(name, len(ranges), capacity.name_length, taken)
        needed = MEMORY_PROGRAM + sum(len(n) + MEMORY_CALL for n in names)
        if needed <= main:
            break
        main = needed
    load, used, loads = 1, 0.0, []
    for page_memory in memory:
        if used + page_memory > capacity.memory - main and used > 0:
            load, used = load + 1, 0.0
        used += page_memory
        loads.append(load)
    return ranges, names, tuple(loads)


def page_positions(program: LsProgram, flow: Flow, page: PageRange) -> list[int]:
    """Numbers of the positions that a page holds, in the order in which it names them."""
    a, b = np.searchsorted(flow.mention_unit, [page.first, page.last])
    named = flow.mention[a:b]
    if np.any(named == NO_NUMBER):
        return list(dict.fromkeys(program.positions.number.tolist()))
    start = [program.motions.position[page.entry][-1]] if page.entry != NO_NUMBER else []
    return list(dict.fromkeys([*start, *named.tolist()]))


def _page_ranges(
    program: LsProgram,
    flow: Flow,
    settings: ModalState,
    sizes: UnitSizes,
    capacity: Capacity,
    head_lines: int,
) -> tuple[list[PageRange], list[float]]:
    """The pages, and the memory of each [bytes]."""
    splittable = flow.may_split_after & ~settings.forbidden
    previous = _previous_mention(flow)
    S, first = len(flow.line), 0
    ranges: list[PageRange] = []
    memory: list[float] = []
    while first < S or not ranges:
        repeated, notes = settings.at(first - 1) if first else ([], [])
        entry, reason = _entry_motion(program, flow, first) if first else (NO_NUMBER, "")
        head = _head_size(sizes, repeated, entry, head_lines)
        end = min(S, first + capacity.max_lines + 1)
        positions = _position_counts(program, flow, first, end, entry, previous)
        lines = head.lines + np.cumsum(sizes.lines[first:end])
        total = head.memory + np.cumsum(sizes.memory[first:end]) + MEMORY_POSITION * positions
        fits = (lines <= capacity.max_lines) & (positions <= capacity.max_positions) & (total <= capacity.memory)
        last = S
        if not (end == S and fits.all()):
            count = int(np.argmin(fits)) if not fits.all() else len(fits)  # sums only rise: all before it fit
            ends = np.flatnonzero(splittable[first : first + count])
            if not len(ends):
                raise _no_split_point(program, flow, settings, first, count, capacity)
            last = first + int(ends[-1]) + 1
        ranges.append(PageRange(first, last, tuple(repeated), entry, (*notes, reason) if reason else tuple(notes)))
        memory.append(float(total[last - first - 1]) if last > first else head.memory)
        first = last
    return ranges, memory


def _no_split_point(
    program: LsProgram, flow: Flow, settings: ModalState, first: int, count: int, capacity: Capacity
) -> ImpossibleError:
    """Why a program cannot be split within what a page holds: its next ``count`` units."""
    holds = f"{capacity.max_lines} lines, {capacity.max_positions} positions, {max(capacity.memory, 0) / KB:.1f} kB"
    if count == 0:
        return ImpossibleError(
            f"program {program.name}: line {flow.line[first]} alone is more than a page holds ({holds}): raise "
            "controller.max_lines, max_positions or memory_kB"
        )
    until = min(first + count, len(flow.line) - 1)
    stop = flow.stop[first : first + count]
    if not stop.any():
        reason = "no motion between them stops (FINE); let the robot stop on the way, or raise the controller's limits"
    elif not flow.locked[first : first + count][stop].all() and settings.forbidden[first : first + count][stop].any():
        reason = "a condition in force there cannot be said again; end it before a stop (FINE)"
    else:
        reason = "each stop lies inside IF, FOR, a jump, an arc or a bracket; put a stop (FINE) outside"
    return ImpossibleError(
        f"program {program.name}: line {flow.line[first]} to line {flow.line[until]} is more than a page holds "
        f"({holds}): {reason}"
    )


def _refuse_local_registers(program: LsProgram, flow: Flow) -> None:
    """Raises ImpossibleError for arguments and local registers of a program: a page would not have them."""
    m = program.motions
    texts = [(int(flow.line[s]), text) for s, text in flow.text.items()]
    if any(LOCAL_REGISTER.search(f"{speed} {options}") for speed, options in set(zip(m.speed, m.options, strict=True))):
        texts += [(int(m.line[i]), f"{m.speed[i]} {m.options[i]}") for i in np.flatnonzero(~m.disabled).tolist()]
    for line, text in texts:
        if local := LOCAL_REGISTER.search(text):
            raise ImpossibleError(
                f"program {program.name}: line {line}: {local.group(1).upper()}[] is known to this program only, its "
                "pages would not have it; hand it over in a register R[]"
            )


def _refuse_palletizing(program: LsProgram, flow: Flow) -> None:
    """Raises ImpossibleError for a palletizing program: its pages would not have the pattern that it keeps."""
    m = program.motions
    lines = [int(flow.line[s]) for s, text in flow.text.items() if PALLETIZING.match(text)]
    pallets = [i for i, targets in enumerate(m.target) if not m.disabled[i] and any(t[:4] == "PAL_" for t in targets)]
    if lines := sorted([*lines, *(int(m.line[i]) for i in pallets)]):
        raise ImpossibleError(
            f"program {program.name}: line {lines[0]}: palletizing keeps its pattern with the program, its pages would "
            "not have it; move it to a program of its own and call that"
        )


def _entry_motion(program: LsProgram, flow: Flow, first: int) -> tuple[int, str]:
    """The motion that brings a page to its start, and why there is none."""
    m, i = program.motions, int(flow.motion[first - 1])
    if not m.position[i] or not np.any(program.positions.number == m.position[i][-1]):
        return NO_NUMBER, f"line {m.line[i]}: where it starts is not in the file"
    if ends_elsewhere(m.options[i]):
        return NO_NUMBER, f"line {m.line[i]}: where it starts is found at run time ({m.options[i]})"
    return i, ""


def _head_size(sizes: UnitSizes, settings: list[int], entry: int, head_lines: int) -> ProgramSize:
    """Size of what stands before a page's own units; its first position is counted with the others."""
    motions = int(entry != NO_NUMBER)
    return ProgramSize(
        head_lines + int(sizes.lines[settings].sum()) + motions,
        motions,
        MEMORY_PROGRAM + MEMORY_REMARK * head_lines + float(sizes.memory[settings].sum()) + motions * MEMORY_MOTION,
    )


def _previous_mention(flow: Flow) -> IntArray:
    """The unit that named the same position before each mention, -1 for none."""
    order = np.lexsort((flow.mention_unit, flow.mention))
    number, unit = flow.mention[order], flow.mention_unit[order]
    previous = np.full(len(order), -1, dtype=np.int64)
    same = np.flatnonzero(number[1:] == number[:-1]) + 1
    previous[order[same]] = unit[same - 1]
    return previous


def _position_counts(program: LsProgram, flow: Flow, first: int, end: int, entry: int, previous: IntArray) -> IntArray:
    """How many different positions a page holds up to each of its units."""
    a, b = np.searchsorted(flow.mention_unit, [first, end])
    unit, number = flow.mention_unit[a:b], flow.mention[a:b]
    start = program.motions.position[entry][-1] if entry != NO_NUMBER else NO_NUMBER
    new = (previous[a:b] < first) & (number != start) & (number != NO_NUMBER)
    count = np.bincount(unit[new] - first, minlength=end - first).cumsum() + int(start != NO_NUMBER)
    if np.any(number == NO_NUMBER):  # a position that is found at run time may be any of them
        count[int(unit[number == NO_NUMBER][0]) - first :] = len(np.unique(program.positions.number))
    return np.asarray(count, dtype=np.int64)


def page_names(name: str, count: int, length: int, taken: Collection[str]) -> tuple[str, ...]:
    """NAME_01, NAME_02, ...: as much of the name as keeps them apart from each other and from all taken ones.

    Args:
        name: The program's.
        count: Number of pages.
        length: Characters of a name that the controller takes.
        taken: Names of other programs, in any case.

    Raises:
        InputError: No name is left.
    """
    digits = max(2, len(str(count)))
    used = {n.upper() for n in taken} | {name.upper(), name[:length].upper()}
    for keep in range(min(len(name), length - digits - 1), 0, -1):
        stem = name[:keep].rstrip("_") or name[:keep]
        names = tuple(f"{stem}_{n:0{digits}d}" for n in range(1, count + 1))
        if not used & {n.upper() for n in names}:
            return names
    raise InputError(f"program {name}: {count} pages get no name of their own within {length} characters; rename it")
