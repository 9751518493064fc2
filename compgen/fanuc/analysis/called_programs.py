"""Programs that a program calls: whether and how each moves the arm, and what it writes of registers and frames."""

from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass, replace

import numpy as np

from compgen.core.exceptions import InputError
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.listing.listing import LsProgram, loads, other_statements
from compgen.fanuc.vocabulary import (
    CALL,
    CALL_ALWAYS,
    FLOW,
    FRAME_MENTIONED,
    LABEL_ALONE,
    WAIT,
    may_move_arm,
    may_write_registers,
    written_frames,
)
from compgen.program.driven import NONE, DrivenProgram

MOST_PLACES = 1_000_000  # of what a program calls, that are counted


@dataclass(frozen=True, slots=True, kw_only=True)
class CalledPrograms:
    """Names, in capitals, of programs of which something is known."""

    motionless: frozenset[str] = frozenset()  # they do not move the arm
    moving: frozenset[str] = frozenset()  # they may move it, as their listings say
    settled: frozenset[str] = frozenset()  # they write no position register, user frame or tool
    in_frames: frozenset[str] = frozenset()  # they leave the numbers of user frame and tool as they are set
    frames: frozenset[tuple[str, int | None]] = frozenset()  # that any of them writes, as ``written_frames``
    missing: frozenset[str] = frozenset()  # called here or beneath, and no listing of theirs was there to read
    branching: frozenset[str] = frozenset()  # with jumps or loops, here or beneath: not all runs once as listed
    listings: tuple[tuple[str, bytes], ...] = ()  # that were there to read, by name


UNKNOWN_PROGRAMS = CalledPrograms()


@dataclass(frozen=True, slots=True)
class _Effects:
    motionless: bool = False
    settled: bool = False
    in_frames: bool = False


def called_programs(program: LsProgram, find: Callable[[str], bytes | None]) -> CalledPrograms:
    """What is known of the programs that a program calls, and of those that they call.

    Args:
        program: Any program.
        find: The listing of a program by its name in capitals; None for one that is not there.
    """
    known: dict[str, _Effects] = {}
    frames: set[tuple[str, int | None]] = set()
    missing: set[str] = set()
    branching: set[str] = set()
    listings: dict[str, bytes] = {}

    def look_up(name: str) -> _Effects:
        if name not in known:
            known[name] = _Effects()  # of one that calls itself nothing is known
            listing = find(name)
            try:
                called = None if listing is None else loads(listing)
            except InputError:
                called = None
            if called is None or called.name.upper() != name:
                missing.add(name)
            else:
                listings[name] = called.source
                texts = {text for _, text in other_statements(called)}
                frames.update(*map(written_frames, texts))
                if any(map(_branches, texts)):
                    branching.add(name)
                known[name] = _effects_of(called, {beneath: look_up(beneath) for beneath in _names(called)})
        return known[name]

    effects = {name: look_up(name) for name in _names(program)}
    return CalledPrograms(
        motionless=frozenset(name for name, its in effects.items() if its.motionless),
        moving=frozenset(name for name, its in effects.items() if not its.motionless) - missing,
        settled=frozenset(name for name, its in effects.items() if its.settled),
        in_frames=frozenset(name for name, its in effects.items() if its.in_frames),
        frames=frozenset(frames),
        missing=frozenset(missing),
        branching=frozenset(branching),
        listings=tuple(sorted(listings.items())),
    )


def _effects_of(called: LsProgram, beneath: Mapping[str, _Effects]) -> _Effects:
    """What a program does, given what those do that it calls."""
    texts = set(read_flow(called).text.values())
    motionless = {name for name, its in beneath.items() if its.motionless}
    settled = {name for name, its in beneath.items() if its.settled}
    in_frames = all(its.in_frames for its in beneath.values()) and not any(map(FRAME_MENTIONED.search, texts))
    moves = not called.motions.disabled.all() or any(may_move_arm(text, motionless) for text in texts)
    writes = any(may_write_registers(text, settled) for text in texts)
    writes |= any(may_write_registers(text, settled, options=True) for text in set(called.motions.options))
    return _Effects(motionless=not moves, settled=not writes, in_frames=in_frames)


def _branches(text: str) -> bool:
    """Whether a statement may let others run more or less than once."""
    return bool(FLOW.match(text)) and not CALL_ALWAYS.match(text) and not LABEL_ALONE.match(text)


def _names(program: LsProgram) -> set[str]:
    texts = {*read_flow(program).text.values(), *program.motions.options}
    return {name.upper() for text in texts for name in CALL.findall(text)}


def with_called_motion(
    program: LsProgram, drive: DrivenProgram, known: CalledPrograms, drive_of: Callable[[str], DrivenProgram | None]
) -> DrivenProgram:
    """A program with what called ones do before it leaves for each of its stations: each as it is listed, once a CALL.

    Args:
        program: Any program.
        drive: Its stations.
        known: What is known of the programs that it calls.
        drive_of: One of them as it is driven; None for one that calls this one.
    """
    statements = other_statements(program)
    calls = {line: match[1].upper() for line, text in statements if (match := CALL_ALWAYS.match(text))}
    drives = {name: drive_of(name) for name in sorted(known.moving)}
    moving = {name: its for name, its in drives.items() if its is not None}
    count = {name: len(its.motion_when_called().time) for name, its in moving.items()}
    called = {name: drive_of(name) for name in sorted(known.motionless & set(calls.values()))}
    still = {name: its for name, its in called.items() if its is not None}
    own = {line: float(wait[1]) for line, text in statements if (wait := WAIT.match(text))}
    untold = sorted(name for name, its in (moving | still).items() if its.untimed or its.untold)
    uncounted = _uncounted(program, drive, set(calls), drives)
    counted, places, pause = dict[int, tuple[DrivenProgram, ...]](), 0, np.zeros(len(drive.pose) + 1)
    lines = sorted({*calls, *own})
    at = np.searchsorted(program.motions.line[drive.motion], lines)
    for station, line in zip(at.tolist(), lines, strict=True):
        name = calls.get(line, "")
        waits = own.get(line, 0.0) + (still[name].rest if name in still else 0.0)
        if waits and station in counted:  # behind the called program that moved the arm last
            *others, last = counted[station]
            counted[station] = (*others, replace(last, rest=np.nan_to_num(last.rest) + waits))
        else:
            pause[station] += waits
        if name in drives and station == len(drive.pose):
            pause[station] = np.nan
        elif name in moving:
            places += count[name]
            if places > MOST_PLACES:
                uncounted.add(name)
            else:
                counted[station] = (*counted.get(station, ()), moving[name])
    return replace(
        drive,
        called=counted,
        uncounted=tuple(sorted(uncounted)),
        untold=tuple(untold),
        pause=pause[:-1],
        rest=float(pause[-1]),
    )


def _uncounted(
    program: LsProgram, drive: DrivenProgram, calls: Set[int], drives: Mapping[str, DrivenProgram | None]
) -> set[str]:
    """Those of called programs that may move the arm otherwise than once at each of some lines, as they are listed."""
    if set(drive.flow) - calls:
        return set(drives)
    otherwise = {*(text for line, text in other_statements(program) if line not in calls), *program.motions.options}
    uncounted = {name for name, its in drives.items() if its is None or not _is_told(its)}
    return uncounted | {name.upper() for text in otherwise for name in CALL.findall(text)} & set(drives)


def _is_told(drive: DrivenProgram) -> bool:
    """Whether all ways of a program are known, but for that to its first station."""
    return (
        bool((drive.pose != NONE).all() and np.isfinite([*drive.length[1:], drive.rest]).all()) and not drive.uncounted
    )
