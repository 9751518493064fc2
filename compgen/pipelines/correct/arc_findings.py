"""Arcs of an existing program that a controller may not drive: in one line, or too wide once corrected."""

import numpy as np

from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.units import DEG, MDEG
from compgen.fanuc.analysis.poses import NONE, Poses
from compgen.fanuc.analysis.stations import arcs_in_line, swept_angles
from compgen.fanuc.analysis.traversal import Traversal

SLACK = 1 * MDEG  # the last digits of a half circle


def wide_arcs(drive: Traversal, before: Poses, after: Poses) -> list[Finding]:
    """That arcs sweep more than half a turn in the corrected text, and did not in the planned one.

    Args:
        drive: Of both.
        before: Its planned positions.
        after: Its corrected ones.
    """
    via = np.flatnonzero(drive.circular & drive.via)
    planned, corrected = (swept_angles(poses, drive, via) for poses in (before, after))
    over = (corrected > np.pi + SLACK) & (planned <= np.pi + SLACK)
    if not over.any():
        return []
    worst = int(np.argmax(np.where(over, corrected, 0.0)))
    number = int(after.number[drive.pose[via[worst]]])
    message = (
        f"{int(over.sum())} arcs sweep more than 180 deg once corrected, by P[{number}] {corrected[worst] / DEG:.4f}: "
        "a controller may refuse them (circle angle too large); part them in two"
    )
    return [Finding(Level.WARNING, Code.CORRECTION_ARC, message)]


def flat_arcs(drive: Traversal, before: Poses, after: Poses) -> list[Finding]:
    """That the three places of arcs lie in one line, in the planned or in the corrected text.

    Args:
        drive: Of either.
        before: Its planned positions.
        after: Its corrected ones.
    """
    via = np.flatnonzero(drive.via & ~drive.line & ~drive.joint & (drive.origin != NONE))
    via = via[(drive.pose[via] != NONE) & (drive.pose[np.minimum(via + 1, len(drive.pose) - 1)] != NONE)]
    flat = via[arcs_in_line(before, drive, via) | arcs_in_line(after, drive, via)]
    if not len(flat):
        return []
    names = ", ".join(f"P[{n}]" for n in after.number[drive.pose[flat[:8]]].tolist())
    message = (
        f"{len(flat)} arcs have their three places in one line (by {names}): a controller may refuse them; their "
        "places are judged, not the way between them"
    )
    return [Finding(Level.WARNING, Code.CORRECTION_FLAT_ARC, message)]
