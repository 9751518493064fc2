"""Arcs of an existing program that a correction widens beyond what a controller drives."""

import numpy as np

from compgen.core.findings import Finding, Level
from compgen.core.units import DEG, MDEG
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.stations import swept_angles
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
    return [Finding(Level.WARNING, "correction.arc", message)]
