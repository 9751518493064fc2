"""The proof that pages are the program: the motions that a controller executes, page after page, read from their texts.

Each page is read on its own, in the order in which the main program calls it. Where two pages meet, the second must
start at the position where the first stopped, to the last digit of the text.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from itertools import chain
from typing import Any, TypeVar

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.evaluation import map_blocks
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.listing.listing import LsProgram, loads
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.listing.positions import ListedPositions, position_rows
from compgen.fanuc.listing.templates import find_places
from compgen.fanuc.motion_options import ACC_OR_NOTHING, ends_elsewhere
from compgen.fanuc.vocabulary import CALL_ALONE, FRAME_NUMBER, MESSAGE_OR_PAUSE
from compgen.program.pages import JoinError, join_programs
from compgen.program.program import Program

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutedMotion:
    """One motion as the controller executes it."""

    letter: str
    targets: tuple[str, ...]  # text of each target position without its number: every number of every group
    speed: str
    termination: str
    options: str
    frames: tuple[tuple[str, str], ...]  # UFRAME_NUM and UTOOL_NUM as last set


def called_pages(main: bytes) -> tuple[str, ...]:
    """The programs that a main program calls, in order.

    Raises:
        JoinError: It has a statement other than CALL, MESSAGE and PAUSE, or calls a program twice.
    """
    flow = read_flow(loads(main))
    names = []
    for s, text in flow.text.items():
        if call := CALL_ALONE.match(text):
            names.append(call.group(1))
        elif not MESSAGE_OR_PAUSE.match(text):
            raise JoinError(f"main program: line {flow.line[s]}: '{text}' is not a call of a page")
    if len(set(names)) != len(names):
        raise JoinError("main program: it calls a page twice")
    return tuple(names)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class MotionSequence:
    """A active motions of a program as listed, by columns; ``motion`` gives one of them."""

    program: LsProgram
    columns: tuple[tuple[Any, ...], ...]  # (A,) each: letter, speed, termination, options, frames, count of targets
    first: IntArray  # (A + 1,) row of each motion's first target in ``span``
    span: IntArray  # (T, 2) where in the file a target's position stands, without its number; zero when not in the file
    target: tuple[str, ...]  # (T,) as written in the motion
    frames: dict[str, str]  # in force behind the last motion

    def motion(self, i: int) -> ExecutedMotion:
        """One motion."""
        letter, speed, termination, options, frames, _ = (column[i] for column in self.columns)
        rows = range(self.first[i], self.first[i + 1])
        targets = tuple(self.program.text(self.span[k]) if self.span[k, 1] else self.target[k] for k in rows)
        return ExecutedMotion(
            letter=letter, targets=targets, speed=speed, termination=termination, options=options, frames=frames
        )


def motion_sequence(program: LsProgram, frames: Mapping[str, str] | None = None) -> MotionSequence:
    """The motions of a program.

    Args:
        program: Any program.
        frames: UFRAME_NUM and UTOOL_NUM as they were before it.
    """
    flow, m = read_flow(program), program.motions
    in_force, count, motion_frames = dict(frames or {}), 0, list[tuple[tuple[str, str], ...]]()
    for s, text in flow.text.items():
        if frame := FRAME_NUMBER.match(text):
            before = int(np.searchsorted(flow.move_unit, s, side="right"))
            motion_frames += [tuple(sorted(in_force.items()))] * (before - count)
            in_force[frame.group(1).upper()], count = frame.group(2), before
    motion_frames += [tuple(sorted(in_force.items()))] * (len(flow.moves) - count)
    position, target = _select(m.position, flow.moves), _select(m.target, flow.moves)
    targets = tuple(map(len, position))
    number = np.fromiter(chain.from_iterable(position), dtype=np.int64, count=sum(targets))
    columns = tuple(_select(column, flow.moves) for column in (m.letter, m.speed, m.termination, m.options))
    return MotionSequence(
        program=program,
        columns=(*columns, tuple(motion_frames), targets),
        first=np.concatenate([[0], np.cumsum(targets, dtype=np.int64)]),
        span=_target_spans(program, number),
        target=tuple(chain.from_iterable(target)),
        frames=in_force,
    )


def _select(column: tuple[T, ...], rows: IntArray) -> tuple[T, ...]:
    """Some rows of a column."""
    return column if len(rows) == len(column) else tuple([column[i] for i in rows.tolist()])


def check_join(program: LsProgram, main: bytes, pages: Mapping[str, bytes]) -> int:
    """Compare the motions of pages with those of the undivided program.

    Args:
        program: The undivided program.
        main: The main program's file.
        pages: The pages' files, by program name.

    Returns:
        The number of motions compared; all are the same, and each page starts where the one before stopped.

    Raises:
        JoinError: They differ; names the page and the motion.
    """
    whole = motion_sequence(program)
    N = len(whole.first) - 1
    compared, frames = 0, dict[str, str]()
    for k, name in enumerate(called_pages(main)):
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
        page = motion_sequence(loads(pages[name]), frames)
        first, count, frames = 0, len(page.first) - 1, page.frames
        if k and compared and _stands_at_target(before := whole.motion(compared - 1)):
            if not count or not _is_entry(page.motion(0), before):
                raise JoinError(f"page {name}: it does not start where the page before stopped")
            first, count = 1, count - 1
        if (i := _first_difference(page, first, whole, compared, min(count, N - compared))) is not None:
            motion, wanted = page.motion(first + i), whole.motion(compared + i)
            raise JoinError(f"page {name}: motion {i + 1}: {motion} instead of {wanted}")
        compared += count
        if compared > N:
            raise JoinError(f"page {name}: it drives more than the undivided program")
    if compared != N:
        raise JoinError(f"pages: {compared} motions of {N} are driven")
    return compared


def _first_difference(a: MotionSequence, i: int, b: MotionSequence, k: int, count: int) -> int | None:
    """The first that differs of ``count`` motions, of ``a`` from i on and of ``b`` from k on."""
    equal = all(x[i : i + count] == y[k : k + count] for x, y in zip(a.columns, b.columns, strict=True))
    if equal and _target_texts(a, i, count) == _target_texts(b, k, count):
        return None
    return next((n for n in range(count) if a.motion(i + n) != b.motion(k + n)), None)


def _target_texts(motions: MotionSequence, first: int, count: int) -> list[bytes | str]:
    """Text of the targets of some motions."""
    rows = slice(motions.first[first], motions.first[first + count])
    data, target = motions.program.data, motions.target[rows]
    return [
        data[start:end] if end else text for (start, end), text in zip(motions.span[rows].tolist(), target, strict=True)
    ]


def _stands_at_target(motion: ExecutedMotion) -> bool:
    """Whether the file says where the robot stands after a motion."""
    in_file = not motion.targets[-1].upper().startswith(("P[", "PR[", "PAL_"))
    return in_file and not ends_elsewhere(motion.options)


def _is_entry(motion: ExecutedMotion, before: ExecutedMotion) -> bool:
    """Whether a motion goes where the robot already stands, and stops there."""
    same_target = motion.targets == before.targets[-1:]
    return same_target and motion.termination.upper() == "FINE" and ACC_OR_NOTHING.fullmatch(motion.options) is not None


def _target_spans(program: LsProgram, number: IntArray) -> IntArray:
    """Where positions stand in the file, without their numbers; zero for one that is not there, (T, 2)."""
    p: ListedPositions = program.positions
    span = np.zeros((len(number), 2), dtype=np.int64)
    if not len(p.number) or not len(number):
        return span
    row = position_rows(number, p.number)
    known = row != NO_NUMBER
    block = p.block[row[known]]
    view = np.frombuffer(program.data, dtype=np.uint8)
    first, last = int(block[:, 0].min(initial=len(view))), int(block[:, 1].max(initial=0))
    brace = find_places(view, first, last, lambda part: part[:-1] == ord("{")) + 1
    span[known] = np.column_stack([brace[np.searchsorted(brace, block[:, 0])], block[:, 1]])
    return span


def interpret_pages(main: bytes, pages: Mapping[str, bytes]) -> tuple[Program, Array]:
    """The program that canonical pages make together, and where each begins in it.

    Args:
        main: The main program's file.
        pages: The pages' files, by program name; each starts with a joint motion to where the one before stopped.

    Returns:
        The program with the first page's head, and the number of the position that each page starts at, (K,).

    Raises:
        JoinError: A page is missing, or two pages do not meet; names the page and the gap.
        InputError: A page is not of the canonical form that ``interpret`` reads.
    """
    return join_programs(read_pages(main, pages))


def read_pages(main: bytes, pages: Mapping[str, bytes]) -> list[Program]:
    """Each of canonical pages, in the order in which a main program calls them.

    Args:
        main: The main program's file.
        pages: The pages' files, by program name.

    Raises:
        JoinError: A page is missing, or is another program.
        InputError: A page is not of the canonical form that ``interpret`` reads.
    """
    order = called_pages(main)
    if not order:
        raise JoinError("main program: it calls no page")
    for name in order:
        if name not in pages:
            raise JoinError(f"page {name}: the main program calls it, but it is not there")
    programs = list(map_blocks(len(order), lambda k, _: interpret(pages[order[k]]), 1))
    for name, page in zip(order, programs, strict=True):
        if page.name != name:
            raise JoinError(f"page {name}: it calls itself {page.name}")
    return programs


def check_manifest(data: bytes, files: Mapping[str, bytes]) -> tuple[bytes, dict[str, bytes]]:
    """The main program, and the pages by program name, that a manifest lists.

    Args:
        data: The manifest.
        files: File name to content.

    Raises:
        JoinError: A file is missing or another than was written, or the main program calls in another order.
    """
    record = json.loads(data)
    for entry in [record["main"], *record["pages"]]:
        content = files.get(entry["file"])
        if content is None:
            raise JoinError(f"{entry['file']}: the manifest names it, but it is not there")
        if sha256(content).hexdigest() != entry["sha256"]:
            raise JoinError(
                f"{entry['file']}: it is not the file that the manifest names; load the one written with it"
            )
    main = files[record["main"]["file"]]
    order = tuple(page["name"] for page in sorted(record["pages"], key=lambda page: page["order"]))
    if (called := called_pages(main)) != order:
        raise JoinError(f"{record['main']['file']}: it calls {', '.join(called)}; the manifest says {order}")
    return main, {page["name"]: files[page["file"]] for page in record["pages"]}
