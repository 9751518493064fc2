"""A program as a controller gives it back (an ASCII backup), against what was written.

Sizes, dates, owner, task data and write protection of the head are the controller's own. Its name, its comment and the
motion groups are compared, and what a controller adds under /APPL that may change the path is told.
"""

from dataclasses import dataclass
from typing import Any

from compgen.fanuc.comparison.difference import NOTHING, Difference
from compgen.fanuc.comparison.positions import compare_positions
from compgen.fanuc.comparison.statements import compare_statements
from compgen.fanuc.listing.listing import LsProgram, head_text
from compgen.fanuc.vocabulary import UNSAFE_HEADERS


@dataclass(frozen=True, slots=True, kw_only=True)
class ComparedProgram:
    """One program, written and given back."""

    name: str
    statements: int
    positions: int
    step: float  # mm or deg: the coarser of the last digits
    differences: tuple[Difference, ...]
    notes: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        """The comparison as JSON has it, every difference among it."""
        return {
            "name": self.name,
            "same": not self.differences,
            "statements": self.statements,
            "positions": self.positions,
            "compared_to": self.step,
            "differences": [difference.record() for difference in self.differences],
            "notes": list(self.notes),
        }


def compare_programs(written: LsProgram, backup: LsProgram) -> ComparedProgram:
    """What differs between a program and what a controller gives back of it."""
    positions = compare_positions(written, backup)
    notes = []
    if written.data == backup.data:
        notes.append(
            "byte for byte what was written: a controller prints dates and sizes of its own; is it its backup?"
        )
    heads = [head_text(program) for program in (written, backup)]
    notes += [h.reason for h in UNSAFE_HEADERS if h.pattern.search(heads[1]) and not h.pattern.search(heads[0])]
    return ComparedProgram(
        name=written.name,
        statements=len(written.statements),
        positions=positions.count,
        step=positions.step,
        differences=(*_head_differences(written, backup), *compare_statements(written, backup), *positions.differences),
        notes=tuple(notes),
    )


def not_there(name: str) -> ComparedProgram:
    """A program that was written and that the backup has not."""
    return ComparedProgram(
        name=name,
        statements=0,
        positions=0,
        step=0.0,
        differences=(Difference(name, "program", "there", NOTHING),),
        notes=(),
    )


def _head_differences(written: LsProgram, backup: LsProgram) -> list[Difference]:
    """Name, comment and motion groups."""
    facts = []
    for program in (written, backup):
        attributes = dict(program.attributes)
        comment = attributes.get("COMMENT", "").strip().strip('"').strip()
        groups = attributes.get("DEFAULT_GROUP", "").replace(" ", "").rstrip(",*")
        facts.append({"name": program.name, "COMMENT": comment, "DEFAULT_GROUP": groups})
    return [
        Difference("head", key, facts[0][key] or NOTHING, facts[1][key] or NOTHING)
        for key in facts[0]
        if facts[0][key].upper() != facts[1][key].upper()
    ]
