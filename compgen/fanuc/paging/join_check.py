"""The proof that pages are the program: what a controller would drive, page after page, read from their texts.

Each page is read on its own, in the order in which the main program calls it. Where two pages meet, the start of the
second must be the very place at which the first stopped, to the last digit of the text.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, TypeVar

import numpy as np

from compgen.core.arrays import Array, IntArray, frozen
from compgen.core.evaluation import blocks_of
from compgen.core.exceptions import CompgenError
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.listing.listing import LsProgram, loads
from compgen.fanuc.listing.positions import Positions
from compgen.fanuc.listing.templates import found
from compgen.fanuc.paging.plan import MOVED
from compgen.fanuc.program import Program

T = TypeVar("T")
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


@dataclass(frozen=True, eq=False, slots=True)
class Way:
    """A active motions of a program as listed, by columns; ``driven`` tells one of them."""

    program: LsProgram
    columns: tuple[tuple[Any, ...], ...]  # (A,) each: letter, speed, termination, options, frames, number of goals
    goals: IntArray  # (A + 1,) from which row of ``goal`` on each motion has its own
    goal: IntArray  # (T, 2) where in the file what a goal says stands, its number left out; nowhere: another target
    target: tuple[str, ...]  # (T,) as written, for those
    force: dict[str, str]  # frames behind the last

    def driven(self, i: int) -> Driven:
        """One motion."""
        letter, speed, termination, options, frames, _ = (column[i] for column in self.columns)
        rows = range(self.goals[i], self.goals[i + 1])
        goal = tuple(self.program.text(self.goal[k]) if self.goal[k, 1] else self.target[k] for k in rows)
        return Driven(letter, goal, speed, termination, options, frames)


def way(program: LsProgram, frames: Mapping[str, str] | None = None) -> Way:
    """What a program drives.

    Args:
        program: Any program.
        frames: UFRAME_NUM and UTOOL_NUM as they were before it.
    """
    flow, m = read_flow(program), program.motions
    force, at, said = dict(frames or {}), 0, list[tuple[tuple[str, str], ...]]()
    for s, text in flow.text.items():
        if frame := _FRAME.match(text):
            behind = int(np.searchsorted(flow.move_unit, s, side="right"))
            said += [tuple(sorted(force.items()))] * (behind - at)
            force[frame.group(1).upper()], at = frame.group(2), behind
    said += [tuple(sorted(force.items()))] * (len(flow.moves) - at)
    position, target = _only(m.position, flow.moves), _only(m.target, flow.moves)
    count = tuple(map(len, position))
    number = np.fromiter(chain.from_iterable(position), dtype=np.int64, count=sum(count))
    same = tuple(_only(column, flow.moves) for column in (m.letter, m.speed, m.termination, m.options))
    return Way(
        program=program,
        columns=(*same, tuple(said), count),
        goals=np.concatenate([[0], np.cumsum(count, dtype=np.int64)]),
        goal=_said(program, number),
        target=tuple(chain.from_iterable(target)),
        force=force,
    )


def _only(column: tuple[T, ...], rows: IntArray) -> tuple[T, ...]:
    """Some of a column, in order."""
    return column if len(rows) == len(column) else tuple([column[i] for i in rows.tolist()])


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
    whole = way(program)
    N = len(whole.goals) - 1
    at, force = 0, dict[str, str]()
    for k, name in enumerate(order_of(main)):
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
        page = way(loads(pages[name]), force)
        first, count, force = 0, len(page.goals) - 1, page.force
        if k and at and _stands_at(before := whole.driven(at - 1)):
            if not count or not _is_entry(page.driven(0), before):
                raise JoinError(f"page {name}: it does not start where the page before stopped")
            first, count = 1, count - 1
        if (i := _difference(page, first, whole, at, min(count, N - at))) is not None:
            found, wanted = page.driven(first + i), whole.driven(at + i)
            raise JoinError(f"page {name}: motion {i + 1}: {found} instead of {wanted}")
        at += count
        if at > N:
            raise JoinError(f"page {name}: it drives more than the undivided program")
    if at != N:
        raise JoinError(f"pages: {at} motions of {N} are driven")
    return at


def _difference(a: Way, i: int, b: Way, k: int, count: int) -> int | None:
    """The first of some motions, i on and k on, that differs."""
    alike = all(x[i : i + count] == y[k : k + count] for x, y in zip(a.columns, b.columns))
    if alike and _goals(a, i, count) == _goals(b, k, count):
        return None
    return next((n for n in range(count) if a.driven(i + n) != b.driven(k + n)), None)


def _goals(way: Way, first: int, count: int) -> list[bytes | str]:
    """What the goals of some motions say."""
    rows = slice(way.goals[first], way.goals[first + count])
    data, target = way.program.data, way.target[rows]
    return [data[start:end] if end else text for (start, end), text in zip(way.goal[rows].tolist(), target)]


def _stands_at(row: Driven) -> bool:
    """Whether the file says where the robot stands after a motion."""
    return not row.goal[-1].upper().startswith(("P[", "PR[")) and not MOVED.search(row.options)


def _is_entry(row: Driven, before: Driven) -> bool:
    """Whether a motion goes where the robot already stands, and stops there."""
    return row.goal == before.goal[-1:] and row.termination.upper() == "FINE" and not row.options


def _said(program: LsProgram, number: IntArray) -> IntArray:
    """Where what positions of some numbers say stands, their own number left out; zero where there is none, (T, 2)."""
    p: Positions = program.positions
    place = np.zeros((len(number), 2), dtype=np.int64)
    if not len(p.number) or not len(number):
        return place
    order = np.argsort(p.number, kind="stable")
    row = np.clip(np.searchsorted(p.number[order], number), 0, len(order) - 1)
    known = p.number[order][row] == number
    block = p.block[order[row[known]]]
    view = np.frombuffer(program.data, dtype=np.uint8)
    first, last = int(block[:, 0].min(initial=len(view))), int(block[:, 1].max(initial=0))
    brace = found(view, first, last, lambda part: part[:-1] == ord("{")) + 1
    place[known] = np.column_stack([brace[np.searchsorted(brace, block[:, 0])], block[:, 1]])
    return place


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
    order = order_of(main)
    if not order:
        raise JoinError("main program: it calls no page")
    for name in order:
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
    parts = list(blocks_of(len(order), lambda k, _: interpret(pages[order[k]]), 1))
    for name, part in zip(order, parts):
        if part.name != name:
            raise JoinError(f"page {name}: it calls itself {part.name}")
    for before, after in zip(parts, parts[1:]):
        _meet(before, after)
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
