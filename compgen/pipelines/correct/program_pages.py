"""A program that exists in pages, as the controller does not hold it in one file: parted, and put together again."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.commands import Command
from compgen.core.exceptions import naming_file
from compgen.core.files import read_regular
from compgen.core.version import __version__
from compgen.fanuc import LsProgram, edited, loads
from compgen.fanuc.analysis.watermark import carries_mark
from compgen.fanuc.editing.insertion import marking_remark
from compgen.fanuc.paging.capacity import program_size
from compgen.fanuc.paging.join_check import check_join, check_manifest
from compgen.fanuc.paging.split import split_program
from compgen.pipelines.correct.program_file import provenance_beside, why_unknown
from compgen.pipelines.files.program_course import listing_of
from compgen.program.pages import MANIFEST_SUFFIX, PagedProgram, ProgramSize, manifest_json
from compgen.robot.robot import Capacity, Robot

_NUMBER = re.compile(rb"\d+")  # in "P[12: name]": the first one
CORRECTED = "corrected_from"  # of a manifest: the provenance of a program that existed and was corrected
UNKNOWN = "corrected_unknown"  # of one whose provenance is not its own: why


@dataclass(frozen=True, eq=False, slots=True)
class ProgramPages:
    """A program, and its pages where the controller needs them."""

    name: str
    size: ProgramSize
    paged: PagedProgram | None  # None: it is held in one file
    files: dict[str, bytes]  # the manifest, the pages and the main program, by name
    why_unknown: str = ""  # of a corrected program that cannot be corrected anew

    @property
    def manifest(self) -> str:
        """The name of the manifest."""
        return f"{self.name if self.paged is None else self.paged.name}{MANIFEST_SUFFIX}"


def pages_of_program(file: str, content: bytes, robot: Robot, taken: Sequence[str]) -> ProgramPages:
    """A program in pages, proven to be the program; pages of a corrected one say so.

    Args:
        file: Its file; provenance may lie beside it.
        content: Of the file.
        robot: Whose controller shall hold it.
        taken: Names that pages must not get.

    Raises:
        ImpossibleError: It cannot be parted so that each page fits.
        InputError: Not a program.
        JoinError: The pages, read back, are not the program.
    """
    program = listing_of(content, file)
    size, capacity = program_size(program), robot.controller.capacity
    if size.within(capacity):
        return ProgramPages(program.name, size, None, {})
    provenance = provenance_beside(Path(file), content)
    with naming_file(file):
        paged = part_listing(program, robot, capacity, taken, corrected=provenance is not None)
    check_join(program, paged.main, {p.name: p.data for p in paged.pages})
    why = why_unknown(Path(file), program, robot) if provenance is None else ""
    made = {UNKNOWN: why} if why else {}
    if provenance is not None:
        made = {CORRECTED: json.loads(read_regular(provenance))}
    origin = {"command": Command.PAGES, "planned_sha256": sha256(content).hexdigest(), **made}
    pages = ProgramPages(program.name, size, paged, paged.files(), why)
    manifest = manifest_json(paged, capacity, origin)
    files = {pages.manifest: manifest, **paged.files()}
    check_manifest(manifest, files)
    return replace(pages, files=files)


def part_listing(
    program: LsProgram, robot: Robot, capacity: Capacity, taken: Sequence[str] = (), *, corrected: bool
) -> PagedProgram:
    """The pages of a program; those of one that is ``corrected``, or carries the mark, say it in a remark."""
    marked = corrected or carries_mark(program, robot)
    return split_program(program, capacity, taken, common=(marking_remark(__version__),) if marked else ())


def with_positions(program: LsProgram, pages: Sequence[tuple[bytes, IntArray]]) -> LsProgram:
    """The undivided program with the positions of some pages.

    Args:
        program: That was parted.
        pages: The text of each, and its motions as rows of the program's table; a page ends with these.
    """
    edits: dict[tuple[int, int], bytes] = {}
    for data, moves in pages:
        part = loads(data)
        of_page = np.flatnonzero(~part.motions.disabled)[-len(moves) :]
        numbers: Mapping[int, int] = {
            ours: its
            for whole, own in zip(moves.tolist(), of_page.tolist(), strict=True)
            for ours, its in zip(program.motions.position[whole], part.motions.position[own], strict=True)
        }
        blocks, own_blocks = _blocks(program), _blocks(part)
        for ours, its in numbers.items():
            if ours in blocks and its in own_blocks:
                start, end = own_blocks[its]
                edits[blocks[ours]] = _NUMBER.sub(b"%d" % ours, part.source[start:end], count=1)
    return edited(program, edits)


def _blocks(program: LsProgram) -> dict[int, tuple[int, int]]:
    """Where each position stands in a file, by its number."""
    rows = zip(program.positions.number.tolist(), program.positions.block.tolist(), strict=True)
    return {number: (start, end) for number, (start, end) in rows}
