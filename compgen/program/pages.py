"""A long program in pages: what each takes of a controller, and how pages meet.

The main program calls the pages in order; where two meet, the second must start at the position where the first
stopped, to the last digit of the text.

The manifest of a program in pages: the order in which they are loaded, and the checksum of each.

JSON, so that whoever loads the pages, a person or a program, can check them before they run. What ``resume`` takes from
it (which pages have run, how warm the robot was) no other file says again: its last key is the checksum of the rest.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np

from compgen.core.arrays import Array, frozen, row_norms
from compgen.core.exceptions import CompgenError
from compgen.core.exit_codes import ExitCode
from compgen.core.json_text import json_text
from compgen.core.rotations import relative_rotation
from compgen.core.units import DEG, KB, MM
from compgen.program.program import Program
from compgen.robot.robot import Capacity

#: Bytes of a program, of a single-group position and of a motion line.
MEMORY_PROGRAM, MEMORY_POSITION, MEMORY_MOTION = 400, 35, 28

MEMORY_REMARK = 40.0  # bytes that a remark at a page's head takes at most

MEMORY_CALL = 50.0  # bytes of a call in the main program besides the name, its message and its pause included

SAME_STEP = 1e-6  # relative

MOST_TURN = 0.02  # [rad] from page to page, where one was written anew

NO_STEPS: Mapping[str, float] = {}
SCHEMA = 1
MANIFEST_SUFFIX = ".pages.json"  # behind the program's name
CHECKSUM = "record_sha256"  # of a manifest without this key


@dataclass(frozen=True, slots=True)
class ProgramSize:
    """What a program takes of a controller."""

    lines: int
    positions: int
    memory: float  # [bytes] estimated

    def within(self, capacity: Capacity) -> bool:
        """Whether one program of that size fits."""
        lines, positions = self.lines <= capacity.max_lines, self.positions <= capacity.max_positions
        return lines and positions and self.memory <= capacity.memory


def estimated_memory(positions: int) -> float:
    """Bytes of a program of compgen's own, each of whose positions has one motion."""
    return float(MEMORY_PROGRAM + positions * (MEMORY_POSITION + MEMORY_MOTION))


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Page:
    """One page of a program, as it is loaded."""

    name: str
    data: bytes
    load: int  # from 1
    motions: tuple[int, int]  # active ones of the undivided program, first and behind the last; without its start
    size: ProgramSize
    notes: tuple[str, ...]  # what it relies on the page before for, and why


@dataclass(frozen=True, eq=False, slots=True)
class PagedProgram:
    """A program in pages."""

    name: str
    main: bytes
    pages: tuple[Page, ...]

    @property
    def load_count(self) -> int:
        """In how many loads the pages come; more than one is a drip feed."""
        return self.pages[-1].load

    def files(self) -> dict[str, bytes]:
        """File name to content, pages in their order, the main program last."""
        return {**{f"{p.name}.LS": p.data for p in self.pages}, f"{self.name}.LS": self.main}


class JoinError(CompgenError):
    """Pages that are not the program they were made from: they must not be used."""

    exit_code = ExitCode.OUTSIDE


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


def join_programs(programs: Sequence[Program], steps: Mapping[str, float] = NO_STEPS) -> tuple[Program, Array]:
    """The program that pages make together, one behind the other, and where each begins in it.

    Args:
        programs: In order.
        steps: How far a page may start from where the one before stopped, along any axis [m], by name: one that was
            written anew for another warmth. Where it does, the joined program has the place of the stop.

    Raises:
        JoinError: Two pages do not meet; names the page and the gap.
    """
    for before, after in zip(programs, programs[1:], strict=False):
        require_meeting(before, after, steps.get(after.name, 0.0))
    starts = np.cumsum([0] + [len(p.position) - 1 for p in programs[:-1]])
    first, rest = programs[0], programs[1:]
    whole = replace(
        first,
        position=frozen(np.concatenate([first.position, *(p.position[1:] for p in rest)])),
        rotation=frozen(np.concatenate([first.rotation, *(p.rotation[1:] for p in rest)])),
        turns=frozen(np.concatenate([first.turns, *(p.turns[1:] for p in rest)])),
        speed=frozen(np.concatenate([p.speed for p in programs])),
        fine=frozen(np.concatenate([first.fine, *(p.fine[1:] for p in rest)])),
        via=frozen(np.concatenate([first.via, *(p.via[1:] for p in rest)])),
    )
    return whole, starts


def gap_between(before: Program, after: Program) -> float:
    """How far a page starts from where the one before it stops, along the axis where it is most [m]."""
    return float(np.abs(after.position[0] - before.position[-1]).max())


def require_meeting(before: Program, after: Program, step: float) -> None:
    """Raises JoinError when a page does not start where the one before stopped, or no farther than a step [m]."""
    gap = gap_between(before, after)
    turn = float(row_norms(relative_rotation(before.rotation[-1:], after.rotation[:1]))[0])
    apart = gap > step * (1 + SAME_STEP)
    if apart or turn > (MOST_TURN if step else 0.0):
        off = f"{gap / MM:.3f} mm from" if apart else f"turned by {turn / DEG:.4f} deg against"
        raise JoinError(f"page {after.name}: it starts {off} where {before.name} stopped; load matching pages")
    if not before.fine[-1]:
        raise JoinError(f"page {before.name}: it does not stop (FINE) at its end")
    fields = ("uframe", "utool", "posture", "comment", "date", "payload", "acc")
    different = next((name for name in fields if getattr(before, name) != getattr(after, name)), None)
    if different or not np.array_equal(before.turns[-1], after.turns[0]):
        raise JoinError(f"page {after.name}: its {different or 'turns'} differ from that of {before.name}")


def manifest_json(
    paged: PagedProgram, capacity: Capacity, head: Mapping[str, Any], page_facts: Sequence[Mapping[str, Any]] = ()
) -> bytes:
    """The manifest's text.

    Args:
        paged: The program in pages.
        capacity: What they were made to fit.
        head: What the program was made from, in plain types.
        page_facts: For each page what else is known of it: when it starts, how warm the robot is.
    """
    pages = [
        {
            "order": k,
            "load": page.load,
            "name": page.name,
            "file": f"{page.name}.LS",
            "sha256": sha256(page.data).hexdigest(),
            "bytes": len(page.data),
            "lines": page.size.lines,
            "positions": page.size.positions,
            "memory_kB": round(page.size.memory / KB, 3),
            "motions": [page.motions[0] + 1, page.motions[1]],
            **facts,
            "relies_on_the_page_before": list(page.notes),
        }
        for k, (page, facts) in enumerate(zip(paged.pages, page_facts or [{}] * len(paged.pages), strict=True), 1)
    ]
    memory = [sum(p.size.memory for p in paged.pages if p.load == n) for n in range(1, paged.load_count + 1)]
    data = {
        "schema": SCHEMA,
        "name": paged.name,
        **head,
        "main": {"file": f"{paged.name}.LS", "sha256": sha256(paged.main).hexdigest(), "bytes": len(paged.main)},
        "controller": {
            "max_lines": capacity.max_lines,
            "max_positions": capacity.max_positions,
            "memory_kB": capacity.memory / KB,
            "name_length": capacity.name_length,
        },
        "drip_feed": paged.load_count > 1,
        "loads": paged.load_count,
        "largest_load_kB": round(max(memory) / KB, 3),
        "pages": pages,
    }
    return with_checksum(data)


def with_checksum(record: Mapping[str, Any]) -> bytes:
    """The text of a manifest, with the checksum of everything in it."""
    rest = {key: value for key, value in record.items() if key != CHECKSUM}
    return json_text({**rest, CHECKSUM: sha256(json_text(rest)).hexdigest()})


def is_as_written(record: Mapping[str, Any]) -> bool:
    """Whether a manifest still says what it said when it was written; its layout is free."""
    return json_text(record) == with_checksum(record)
