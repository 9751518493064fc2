"""Arcs of an existing program that a controller may not drive: in one line, or too wide once corrected."""

from dataclasses import replace

import numpy as np

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import DEG, MDEG
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.ways import arcs_in_line, swept_angles

SLACK = 1 * MDEG  # the last digits of a half circle


def wide_arcs(planned: DrivenProgram, corrected: DrivenProgram) -> list[Finding]:
    """That arcs sweep more than half a turn in the corrected text, and did not in the planned one."""
    via = np.flatnonzero(corrected.circular & corrected.via)
    swept = swept_angles(corrected, via)
    over = (swept > np.pi + SLACK) & (swept_angles(planned, via) <= np.pi + SLACK)
    if not over.any():
        return []
    worst = int(np.argmax(np.where(over, swept, 0.0)))
    number = int(corrected.at.number[corrected.pose[via[worst]]])
    message = (
        f"{int(over.sum())} arcs sweep more than 180 deg once corrected, by P[{number}] {swept[worst] / DEG:.4f}: "
        "a controller may refuse them (circle angle too large); part them in two"
    )
    return [Finding(Level.WARNING, Code.CORRECTION_ARC, message)]


def flat_arcs(planned: DrivenProgram, corrected: DrivenProgram) -> list[Finding]:
    """That the three places of arcs lie in one line, in the planned or in the corrected text."""
    drive = planned
    via = np.flatnonzero(drive.via & ~drive.line & ~drive.joint & (drive.origin != NONE))
    via = via[(drive.pose[via] != NONE) & (drive.pose[np.minimum(via + 1, len(drive.pose) - 1)] != NONE)]
    flat = via[arcs_in_line(drive, via) | arcs_in_line(replace(drive, at=corrected.at), via)]
    if not len(flat):
        return []
    names = ", ".join(f"P[{n}]" for n in corrected.at.number[drive.pose[flat[:8]]].tolist())
    message = (
        f"{len(flat)} arcs have their three places in one line (by {names}): a controller may refuse them; their "
        "places are judged, not the way between them"
    )
    return [Finding(Level.WARNING, Code.CORRECTION_FLAT_ARC, message)]
