"""One position, several uses: one correction for all of them, or a position for each."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.fanuc.analysis.traversal import Drive

SAME = 0.5e-6  # m: what three decimals cannot tell apart
SAME_ANGLE = 1e-5  # rad


@dataclass(frozen=True, eq=False, slots=True)
class Shared:
    """What each of K positions gets."""

    correction: Array  # (K, 6) the mean over the stations that use it
    theta: Array  # (K, 6) [rad]
    changed: BoolArray  # (K,) takes its correction
    spread: Array  # (K,) [m] largest distance of a use's own correction from the mean
    mixed: BoolArray  # (K,) used by a station that is passed through as well: kept as it is


def shared(drive: Drive, free: BoolArray, correction: Array, theta: Array, count: int) -> Shared:
    """Mean of the corrections of all stations that use a position."""
    used = np.bincount(drive.pose[free], minlength=count)
    barred = np.bincount(drive.pose[~free & (drive.pose >= 0)], minlength=count) > 0
    total, joints = np.zeros((count, 6)), np.zeros((count, 6))
    np.add.at(total, drive.pose[free], correction[free])
    np.add.at(joints, drive.pose[free], theta[free])
    mean = total / np.maximum(used, 1)[:, None]
    off = np.linalg.norm(correction[free] - mean[drive.pose[free]], axis=1)
    spread = np.zeros(count)
    np.maximum.at(spread, drive.pose[free], off)
    return Shared(mean, joints / np.maximum(used, 1)[:, None], (used > 0) & ~barred, spread, (used > 0) & barred)


def parting(drive: Drive, free: BoolArray, correction: Array, first: int) -> list[tuple[int, int]]:
    """Stations that need a position of their own, and its number, counted from ``first``.

    Uses of a position whose corrections cannot be told apart stay together; the first of them keeps the old number
    unless a station that is passed through, whose correction is none, uses it as well.
    """
    barred = set(drive.pose[~free].tolist())
    groups: dict[int, list[tuple[Array, int | None]]] = {}
    found = []
    _, back, uses = np.unique(drive.pose, return_inverse=True, return_counts=True)
    for s in np.flatnonzero(free & (uses[back] > 1)).tolist():
        pose, c = int(drive.pose[s]), correction[s]
        kin = groups.setdefault(pose, [(np.zeros(6), None)] if pose in barred else [])
        near = next((k for k in kin if _same(k[0], c)), None)
        if near is None:
            number = first if kin else None
            first += number is not None
            near = (c, number)
            kin.append(near)
        if near[1] is not None:
            found.append((s, near[1]))
    return found


def _same(a: Array, b: Array) -> bool:
    return bool(np.linalg.norm(a[:3] - b[:3]) <= SAME and np.linalg.norm(a[3:] - b[3:]) <= SAME_ANGLE)


def straightness(correction: Array, middle: Array, stations: IntArray) -> Array:
    """How far the correction wanted midway is from the line between those of the ends, (n,) [m]."""
    line = (correction[stations] + correction[stations - 1])[:, :3] / 2
    return np.asarray(np.linalg.norm(middle[:, :3] - line, axis=1))
