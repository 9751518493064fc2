"""Remarks that a corrected program gets where lines may be added to it."""

import re

from compgen.fanuc.analysis.watermark import CORRECTED
from compgen.fanuc.listing.lines import line_end
from compgen.fanuc.listing.listing import LsProgram, edited


def marking_remark(version: str) -> str:
    """What a remark says that stands for the mark."""
    return f"compgen {version}{CORRECTED}"


def insert_remark(program: LsProgram, words: str) -> LsProgram:
    """The program with a remark as its first line; as all new lines it carries no number."""
    at = int(program.place[0])
    number = re.sub(rb"\d", b" ", program.data[at : program.data.index(b":", at)])
    remark = f":  !{words} ;".encode("ascii")
    return edited(program, {(at, at): number + remark + line_end(program.data)})


def says_override(program: LsProgram) -> bool:
    """Whether a remark or a statement of a program says an override already."""
    at = int(program.place[0]) if len(program.place) else len(program.data)
    return b"OVERRIDE" in program.data[at:].upper()
