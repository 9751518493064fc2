"""Where a long program is parted: as few pages as possible, each as long as the controller allows."""

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import ImpossibleError
from compgen.fanuc.analysis.control_flow import Flow
from compgen.fanuc.analysis.modal_state import InForce, read_settings
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.memory import MEMORY_CALL, MEMORY_MOTION, MEMORY_POSITION, MEMORY_PROGRAM, MEMORY_REMARK
from compgen.fanuc.paging.capacity import Costs, Size, Store, costs
from compgen.fanuc.paging.names import page_names

P = TypeVar("P")

_LOCAL = re.compile(r"(?<![A-Z_])(AR|LR)\[", re.IGNORECASE)
#: options of a motion that ends elsewhere than at its position
MOVED = re.compile(r"(?<![A-Z_])(?:TOOL_OFFSET|V?OFFSET|INC|SKIP|SKIPJUMP|COORD|RTCP)\b", re.IGNORECASE)
_CALLED = re.compile(r"(?:CALL|RUN)\s+([^\s(;]+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Part:
    """What a page takes from the program: units ``first`` up to ``last``, and what it says before them."""

    first: int
    last: int
    again: tuple[int, ...]  # units of settings to say again
    entry: int  # the motion that ends the page before, to be said again; NO_NUMBER for none
    notes: tuple[str, ...]  # what it leaves to the page before, and why


@dataclass(frozen=True, slots=True)
class PagePlan:
    """The parts of a program, their names, and in which load each comes."""

    parts: tuple[Part, ...]
    names: tuple[str, ...]
    load: tuple[int, ...]  # from 1


def plan(program: LsProgram, flow: Flow, store: Store, taken: Collection[str] = (), head_lines: int = 1) -> PagePlan:
    """Where to part a program.

    Args:
        program: Any program.
        flow: Of the program.
        store: What the controller holds.
        taken: Names of programs that exist; pages get others.
        head_lines: Remarks that each page will have at its head.

    Raises:
        ImpossibleError: No place to part within what a page holds, or the program uses arguments or registers of its
            own, which its pages would not have; names the line.
    """
    _refuse_local(program, flow)
    settings = read_settings(program, flow)
    each = costs(program, flow)
    called = [name for text in flow.text.values() for name in _CALLED.findall(text)]

    def parts_in(room: Store) -> tuple[list[Part], list[float]]:
        return _parts(program, flow, settings, each, room, head_lines)

    parts, names, load = settled(program.name, store, [*taken, *called], parts_in)
    return PagePlan(tuple(parts), names, load)


def settled(
    name: str, store: Store, taken: Collection[str], parts_in: Callable[[Store], tuple[list[P], list[float]]]
) -> tuple[list[P], tuple[str, ...], tuple[int, ...]]:
    """Parts that leave room for the main program, their names, and in which load each comes.

    Args:
        name: Of the program.
        store: What the controller holds.
        taken: Names that no page may have.
        parts_in: The parts of the program, and the memory of each, when a page may be as large as a store.
    """
    main = MEMORY_PROGRAM + MEMORY_CALL
    while True:
        parts, memory = parts_in(replace(store, memory=store.memory - main))
        names = page_names(name, len(parts), store.name_length, taken)
        need = MEMORY_PROGRAM + sum(len(n) + MEMORY_CALL for n in names)
        if need <= main:
            break
        main = need
    load, used, loads = 1, 0.0, []
    for bytes_ in memory:
        if used + bytes_ > store.memory - main and used > 0:
            load, used = load + 1, 0.0
        used += bytes_
        loads.append(load)
    return parts, names, tuple(loads)


def numbers_of(program: LsProgram, flow: Flow, part: Part) -> list[int]:
    """The positions that travel with a page, in the order in which it names them."""
    a, b = np.searchsorted(flow.mention_unit, [part.first, part.last])
    named = flow.mention[a:b]
    if np.any(named == NO_NUMBER):
        return list(dict.fromkeys(program.positions.number.tolist()))
    start = [program.motions.position[part.entry][-1]] if part.entry != NO_NUMBER else []
    return list(dict.fromkeys([*start, *named.tolist()]))


def _parts(
    program: LsProgram,
    flow: Flow,
    settings: InForce,
    each: Costs,
    store: Store,
    head_lines: int,
) -> tuple[list[Part], list[float]]:
    """The parts, and the memory of each."""
    may = flow.may_part & ~settings.forbidden
    before = _mentioned_before(flow)
    S, first = len(flow.line), 0
    parts: list[Part] = []
    memory: list[float] = []
    while first < S or not parts:
        again, left = settings.at(first - 1) if first else ([], [])
        entry, why = _entry(program, flow, first) if first else (NO_NUMBER, "")
        head = _head(each, again, entry, head_lines)
        end = min(S, first + store.max_lines + 1)
        places = _places(program, flow, first, end, entry, before)
        lines = head.lines + np.cumsum(each.lines[first:end])
        bytes_ = head.memory + np.cumsum(each.memory[first:end]) + MEMORY_POSITION * places
        fits = (lines <= store.max_lines) & (places <= store.max_positions) & (bytes_ <= store.memory)
        last = S
        if not (end == S and fits.all()):
            room = int(np.argmin(fits)) if not fits.all() else len(fits)  # sums only rise: all before it fit
            ends = np.flatnonzero(may[first : first + room])
            if not len(ends):
                raise _nowhere(program, flow, settings, first, room, store)
            last = first + int(ends[-1]) + 1
        parts.append(Part(first, last, tuple(again), entry, (*left, why) if why else tuple(left)))
        memory.append(float(bytes_[last - first - 1]) if last > first else head.memory)
        first = last
    return parts, memory


def _nowhere(program: LsProgram, flow: Flow, settings: InForce, first: int, room: int, store: Store) -> ImpossibleError:
    """Why a program cannot be parted within what a page holds."""
    holds = f"{store.max_lines} lines, {store.max_positions} positions, {max(store.memory, 0) / 1000:.1f} kB"
    if room == 0:
        return ImpossibleError(
            f"program {program.name}: line {flow.line[first]} alone is more than a page holds ({holds}): raise "
            "controller.max_lines, max_positions or memory_kB"
        )
    until = min(first + room, len(flow.line) - 1)
    stop = flow.stop[first : first + room]
    if not stop.any():
        why = "no motion between them stops (FINE); let the robot stop on the way, or raise the controller's limits"
    elif not flow.locked[first : first + room][stop].all() and settings.forbidden[first : first + room][stop].any():
        why = "a condition in force there cannot be said again; end it before a stop (FINE)"
    else:
        why = "each stop lies inside IF, FOR, a jump, an arc or a bracket; put a stop (FINE) outside"
    return ImpossibleError(
        f"program {program.name}: line {flow.line[first]} to line {flow.line[until]} is more than a page holds "
        f"({holds}): {why}"
    )


def _refuse_local(program: LsProgram, flow: Flow) -> None:
    """Raises ImpossibleError for what a program is given or keeps for itself: a page would not have it."""
    m = program.motions
    said = [(int(flow.line[s]), text) for s, text in flow.text.items()]
    if any(_LOCAL.search(f"{speed} {options}") for speed, options in set(zip(m.speed, m.options))):
        said += [(int(m.line[i]), f"{m.speed[i]} {m.options[i]}") for i in np.flatnonzero(~m.disabled).tolist()]
    for line, text in said:
        if found := _LOCAL.search(text):
            raise ImpossibleError(
                f"program {program.name}: line {line}: {found.group(1).upper()}[] is known to this program only, its "
                "pages would not have it; hand it over in a register R[]"
            )


def _entry(program: LsProgram, flow: Flow, first: int) -> tuple[int, str]:
    """The motion that brings a page to its start, and why there is none."""
    m, i = program.motions, int(flow.motion[first - 1])
    if not m.position[i] or not np.any(program.positions.number == m.position[i][-1]):
        return NO_NUMBER, f"line {m.line[i]}: where it starts is not in the file"
    if MOVED.search(m.options[i]):
        return NO_NUMBER, f"line {m.line[i]}: where it starts is found at run time ({m.options[i]})"
    return i, ""


def _head(each: Costs, again: list[int], entry: int, head_lines: int) -> Size:
    """What a page says before its own units; its first position is counted with the others."""
    moves = int(entry != NO_NUMBER)
    return Size(
        head_lines + int(each.lines[again].sum()) + moves,
        moves,
        MEMORY_PROGRAM + MEMORY_REMARK * head_lines + float(each.memory[again].sum()) + moves * MEMORY_MOTION,
    )


def _mentioned_before(flow: Flow) -> IntArray:
    """The unit that named the same position before each mention, -1 for none."""
    order = np.lexsort((flow.mention_unit, flow.mention))
    number, unit = flow.mention[order], flow.mention_unit[order]
    before = np.full(len(order), -1, dtype=np.int64)
    same = np.flatnonzero(number[1:] == number[:-1]) + 1
    before[order[same]] = unit[same - 1]
    return before


def _places(program: LsProgram, flow: Flow, first: int, end: int, entry: int, before: IntArray) -> IntArray:
    """How many different positions a page needs up to each of its units."""
    a, b = np.searchsorted(flow.mention_unit, [first, end])
    unit, number = flow.mention_unit[a:b], flow.mention[a:b]
    start = program.motions.position[entry][-1] if entry != NO_NUMBER else NO_NUMBER
    new = (before[a:b] < first) & (number != start) & (number != NO_NUMBER)
    count = np.bincount(unit[new] - first, minlength=end - first).cumsum() + int(start != NO_NUMBER)
    if np.any(number == NO_NUMBER):  # a position that is found at run time may be any of them
        count[int(unit[number == NO_NUMBER][0]) - first :] = len(np.unique(program.positions.number))
    return np.asarray(count, dtype=np.int64)
