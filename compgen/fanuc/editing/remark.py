"""The remark that marks a corrected program whose positions cannot carry the watermark."""

import re

from compgen.fanuc.analysis.watermark import CORRECTED
from compgen.fanuc.listing.lines import line_end
from compgen.fanuc.listing.listing import LsProgram, edited


def marking_remark(version: str) -> str:
    """What a remark says that stands for the mark."""
    return f"compgen {version}{CORRECTED}"


def insert_remark(program: LsProgram, version: str) -> LsProgram:
    """The program with a first line that says that compgen corrected it; as all new lines it carries no number."""
    at = int(program.place[0])
    number = re.sub(rb"\d", b" ", program.data[at : program.data.index(b":", at)])
    remark = f":  !{marking_remark(version)} ;".encode("ascii")
    return edited(program, {(at, at): number + remark + line_end(program.data)})
