"""The proof that pages are the program: what a controller would drive, page after page, read from their texts.

Each page is read on its own, in the order in which the main program calls it. Where two pages meet, the start of the
second must be the very place at which the first stopped, to the last digit of the text.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from compgen.arrays import Array, frozen
from compgen.dialects.fanuc_ls.flow import read_flow
from compgen.dialects.fanuc_ls.listing import LsProgram, loads
from compgen.dialects.fanuc_ls.moves import NO_NUMBER
from compgen.dialects.fanuc_ls.parting import MOVED
from compgen.dialects.fanuc_ls.places import Positions
from compgen.dialects.fanuc_ls.program import Program
from compgen.dialects.fanuc_ls.read import interpret
from compgen.exceptions import CompgenError

_CALL = re.compile(r"^CALL\s+([^\s(;]+)$", re.IGNORECASE)
_WAITS = re.compile(r"^(?:MESSAGE\[[^\]]*\]|PAUSE)$", re.IGNORECASE)
_FRAME = re.compile(r"^(UFRAME_NUM|UTOOL_NUM)\s*=\s*(.*?)\s*$", re.IGNORECASE)


class JoinError(CompgenError):
    """Pages that are not the program they were made from: they must not be used."""

    exit_code = 1


@dataclass(frozen=True, slots=True)
class Driven:
    """One motion as the controller would drive it."""

    letter: str
    goal: tuple[str, ...]  # what its targets say, position for position: every number of every group
    speed: str
    termination: str
    options: str
    frames: tuple[tuple[str, str], ...]  # UFRAME_NUM and UTOOL_NUM as last said


def order_of(main: bytes) -> tuple[str, ...]:
    """The programs that a main program calls, in order.

    Raises:
        JoinError: It does anything but call, tell and wait.
    """
    flow = read_flow(loads(main))
    names = []
    for s, text in flow.text.items():
        if call := _CALL.match(text):
            names.append(call.group(1))
        elif not _WAITS.match(text):
            raise JoinError(f"main program: line {flow.line[s]}: '{text}' is not a call of a page")
    if len(set(names)) != len(names):
        raise JoinError("main program: it calls a page twice")
    return tuple(names)


def driven(program: LsProgram, frames: Mapping[str, str] | None = None) -> tuple[list[Driven], dict[str, str]]:
    """Active motions of a program as listed, and the frames in force behind them.

    Args:
        program: Any program.
        frames: UFRAME_NUM and UTOOL_NUM as they were before it.
    """
    flow, m = read_flow(program), program.motions
    said = _said(program)
    force = dict(frames or {})
    settings = [(s, frame) for s, text in flow.text.items() if (frame := _FRAME.match(text))]
    rows = []
    for i, s in zip(flow.moves.tolist(), flow.move_unit.tolist()):
        while settings and settings[0][0] < s:
            frame = settings.pop(0)[1]
            force[frame.group(1).upper()] = frame.group(2)
        goal = tuple(said.get(n, t) if n != NO_NUMBER else t for n, t in zip(m.position[i], m.target[i]))
        rows.append(Driven(m.letter[i], goal, m.speed[i], m.termination[i], m.options[i], tuple(sorted(force.items()))))
    force.update({frame.group(1).upper(): frame.group(2) for _, frame in settings})
    return rows, force


def check_join(program: LsProgram, main: bytes, pages: Mapping[str, bytes]) -> int:
    """Compare what pages drive with what the undivided program drives.

    Args:
        program: The undivided program.
        main: The main program's file.
        pages: The pages' files, by program name.

    Returns:
        The number of motions compared; all are the same, and each page starts where the one before stopped.

    Raises:
        JoinError: They differ; names the page and the motion.
    """
    whole, _ = driven(program)
    at, force = 0, dict[str, str]()
    for k, name in enumerate(order_of(main)):
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
        rows, force = driven(loads(pages[name]), force)
        if k and at and _stands_at(whole[at - 1]):
            if not rows or not _is_entry(rows[0], whole[at - 1]):
                raise JoinError(f"page {name}: it does not start where the page before stopped")
            rows = rows[1:]
        for i, (row, wanted) in enumerate(zip(rows, whole[at:]), 1):
            if row != wanted:
                raise JoinError(f"page {name}: motion {i}: {row} instead of {wanted}")
        at += len(rows)
        if at > len(whole):
            raise JoinError(f"page {name}: it drives more than the undivided program")
    if at != len(whole):
        raise JoinError(f"pages: {at} motions of {len(whole)} are driven")
    return at


def _stands_at(row: Driven) -> bool:
    """Whether the file says where the robot stands after a motion."""
    return not row.goal[-1].upper().startswith(("P[", "PR[")) and not MOVED.search(row.options)


def _is_entry(row: Driven, before: Driven) -> bool:
    """Whether a motion goes where the robot already stands, and stops there."""
    return row.goal == before.goal[-1:] and row.termination.upper() == "FINE" and not row.options


def _said(program: LsProgram) -> dict[int, str]:
    """What each position says, its number left out."""
    p: Positions = program.positions
    found = {}
    for number, (start, end) in zip(p.number.tolist(), p.block.tolist()):
        found[number] = program.data[start:end].partition(b"{")[2].decode("latin-1")
    return found


def interpret_pages(main: bytes, pages: Mapping[str, bytes]) -> tuple[Program, Array]:
    """The program that pages of compgen's own mean together, and where each begins in it.

    Args:
        main: The main program's file.
        pages: The pages' files, by program name; each starts with a joint motion to where the one before stopped.

    Returns:
        The program with the first page's head, and the number of the position that each page starts at, (K,).

    Raises:
        JoinError: A page is missing, or two pages do not meet; names the page and the gap.
        InputError: A page is not of the form that ``interpret`` reads.
    """
    parts: list[Program] = []
    for name in order_of(main):
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
        part = interpret(pages[name])
        if part.name != name:
            raise JoinError(f"page {name}: it calls itself {part.name}")
        if parts:
            _meet(parts[-1], part)
        parts.append(part)
    if not parts:
        raise JoinError("main program: it calls no page")
    starts = np.cumsum([0] + [len(p.position) - 1 for p in parts[:-1]])
    first, rest = parts[0], parts[1:]
    whole = replace(
        first,
        position=frozen(np.concatenate([first.position, *(p.position[1:] for p in rest)])),
        rotation=frozen(np.concatenate([first.rotation, *(p.rotation[1:] for p in rest)])),
        turns=frozen(np.concatenate([first.turns, *(p.turns[1:] for p in rest)])),
        speed=frozen(np.concatenate([p.speed for p in parts])),
        fine=frozen(np.concatenate([first.fine, *(p.fine[1:] for p in rest)])),
    )
    return whole, starts


def _meet(before: Program, after: Program) -> None:
    """Raises JoinError when a page does not start where the one before stopped."""
    gap = float(np.abs(after.position[0] - before.position[-1]).max())
    turn = float(np.abs(after.rotation[0] - before.rotation[-1]).max())
    if gap > 0 or turn > 0:
        raise JoinError(
            f"page {after.name}: it starts {gap * 1e3:.3f} mm from where {before.name} stopped; load matching pages"
        )
    if not before.fine[-1]:
        raise JoinError(f"page {before.name}: it does not stop (FINE) at its end")
    same = ("uframe", "utool", "posture", "comment", "date")
    other = next((n for n in same if getattr(before, n) != getattr(after, n)), None)
    if other or not np.array_equal(before.turns[-1], after.turns[0]):
        raise JoinError(f"page {after.name}: its {other or 'turns'} differ from that of {before.name}")
