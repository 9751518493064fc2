"""One position, several uses: one correction for all of them, or a position for each."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.fanuc.analysis.traversal import Traversal

SAME_POSITION = 0.5e-6  # [m] what three decimals cannot tell apart
SAME_ANGLE = 1e-5  # [rad]


@dataclass(frozen=True, eq=False, slots=True)
class SharedCorrections:
    """The one correction that each of K positions takes for all its uses."""

    correction: Array  # (K, 6) the mean over the stations that use it
    theta: Array  # (K, 6) [rad]
    changed: BoolArray  # (K,) it takes its correction
    spread: Array  # (K,) [m] largest distance of the correction of one use from the mean
    mixed: BoolArray  # (K,) also used by a station that must not change: kept as it is


def average_shared(drive: Traversal, free: BoolArray, correction: Array, theta: Array, count: int) -> SharedCorrections:
    """Mean of the corrections of all stations that use a position, for each of ``count`` positions."""
    used = np.bincount(drive.pose[free], minlength=count)
    fixed = np.bincount(drive.pose[~free & (drive.pose >= 0)], minlength=count) > 0
    total, joints = np.zeros((count, 6)), np.zeros((count, 6))
    np.add.at(total, drive.pose[free], correction[free])
    np.add.at(joints, drive.pose[free], theta[free])
    mean = total / np.maximum(used, 1)[:, None]
    distance = np.linalg.norm(correction[free] - mean[drive.pose[free]], axis=1)
    spread = np.zeros(count)
    np.maximum.at(spread, drive.pose[free], distance)
    theta_mean = joints / np.maximum(used, 1)[:, None]
    return SharedCorrections(mean, theta_mean, (used > 0) & ~fixed, spread, (used > 0) & fixed)


def assign_new_positions(drive: Traversal, free: BoolArray, correction: Array, first: int) -> list[tuple[int, int]]:
    """Stations that need a position of their own, and its number, counted from ``first``.

    Uses of a position with equal corrections stay together; the first group keeps the old number, unless a station that
    must not change uses it as well.
    """
    fixed = set(drive.pose[~free].tolist())
    groups: dict[int, list[tuple[Array, int | None]]] = {}  # of each position: correction, and its new number
    assigned = []
    _, inverse, uses = np.unique(drive.pose, return_inverse=True, return_counts=True)
    for s in np.flatnonzero(free & (uses[inverse] > 1)).tolist():
        pose = int(drive.pose[s])
        position_groups = groups.setdefault(pose, [(np.zeros(6), None)] if pose in fixed else [])
        group = next((g for g in position_groups if _equal(g[0], correction[s])), None)
        if group is None:
            number = first if position_groups else None
            first += number is not None
            group = (correction[s], number)
            position_groups.append(group)
        if group[1] is not None:
            assigned.append((s, group[1]))
    return assigned


def _equal(a: Array, b: Array) -> bool:
    return bool(np.linalg.norm(a[:3] - b[:3]) <= SAME_POSITION and np.linalg.norm(a[3:] - b[3:]) <= SAME_ANGLE)


def midway_deviation(correction: Array, midway: Array, stations: IntArray, origins: IntArray) -> Array:
    """Distance of the correction wanted midway from the mean of those of the two ends, (n,) [m]."""
    line = (correction[stations] + correction[origins])[:, :3] / 2
    return np.asarray(np.linalg.norm(midway[:, :3] - line, axis=1))
