"""One position, several uses: one correction for all of them, or a position for each."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_vector, to_wpr
from compgen.core.units import DEG
from compgen.fanuc.analysis.placements import placed_numbers, placed_poses
from compgen.fanuc.analysis.poses import Poses
from compgen.program.driven import NONE, DrivenProgram

SAME_POSITION = 0.5e-6  # [m] what three decimals cannot tell apart
SAME_ANGLE = 1e-5  # [rad]


@dataclass(frozen=True, eq=False, slots=True)
class SharedCorrections:
    """The one correction that each of K positions takes for all its uses."""

    correction: Array  # (K, 6) the mean over the stations that use it
    theta: Array  # (K, 6) [rad]
    changed: BoolArray  # (K,) it takes its correction
    spread: Array  # (K,) [m] largest distance of the correction of one use from the mean
    mixed: BoolArray  # (K,) also used where nothing may change: kept as it is


def average_shared(
    poses: Poses, drive: DrivenProgram, free: BoolArray, correction: Array, theta: Array
) -> SharedCorrections:
    """Mean of the corrections of all stations that use a position; where they place it differently, as its first row.

    Args:
        poses: Of the program, K rows.
        drive: Its stations.
        free: Stations that take a correction, (S,).
        correction: Of each station, (S, 6).
        theta: Joints of the commanded pose of each station, (S, 6).
    """
    count = len(poses.row)
    first = poses.first[drive.pose] if count else drive.pose
    used = np.bincount(first[free], minlength=count)
    fixed = fixed_positions(poses, drive, free)
    total, joints, own = np.zeros((count, 6)), np.zeros((count, 6)), free & (first == drive.pose)
    correction = as_first_row(poses, drive.pose, correction, free)
    np.add.at(total, first[free], correction[free])
    np.add.at(joints, first[own], theta[own])
    mean = total / np.maximum(used, 1)[:, None]
    distance = np.linalg.norm(correction[free] - mean[first[free]], axis=1)
    spread = np.zeros(count)
    np.maximum.at(spread, first[free], distance)
    theta_mean = joints / np.maximum(np.bincount(first[own], minlength=count), 1)[:, None]
    return SharedCorrections(mean, theta_mean, (used > 0) & ~fixed, spread, (used > 0) & fixed)


def fixed_positions(poses: Poses, drive: DrivenProgram, free: BoolArray) -> BoolArray:
    """Positions that keep their numbers, first rows of them, (K,): for a station that must not change, or a step."""
    stations = ~free & (drive.pose != NONE)
    return np.asarray(np.isin(np.arange(len(poses.row)), poses.first[drive.pose[stations]]) | poses.step)


def as_first_row(poses: Poses, pose: IntArray, correction: Array, free: BoolArray) -> Array:
    """Corrections of stations as those of the first row of their position, which change its numbers alike, (S, 6)."""
    correction = correction.copy()
    s = np.flatnonzero(free & (pose >= 0))
    s = s[poses.first[pose[s]] != pose[s]]
    if len(s):
        rows, table = pose[s], poses.placements.table
        commanded, base = poses.tcp[rows].moved(correction[s]), poses.bases[poses.base[rows]]
        numbers = placed_numbers(commanded, base, table, poses.placement[rows])
        wpr = np.column_stack(to_wpr(numbers.rotation)) / DEG - numbers.wpr_offset
        to = poses.first[rows]
        there = placed_poses(np.hstack([numbers.xyz, wpr]), poses.bases[poses.base[to]], table, poses.placement[to])
        correction[s, :3] = there.position - poses.tcp.position[to]
        correction[s, 3:] = rotation_vector((poses.tcp[to].inverse() @ there).rotation)
    return correction


def assign_new_positions(
    poses: Poses, drive: DrivenProgram, free: BoolArray, correction: Array, first: int
) -> list[tuple[int, int]]:
    """Stations that need a position of their own, and its number, counted from ``first``.

    Uses of a position with equal corrections stay together; the first group keeps the old number, unless a station that
    must not change, or a step, uses it as well.
    """
    position = poses.first[drive.pose] if len(poses.row) else drive.pose
    position = np.where(drive.pose >= 0, position, -1)
    correction = as_first_row(poses, drive.pose, correction, free)
    held = np.append(fixed_positions(poses, drive, free), False)[position]  # of a station without one: -1
    groups: dict[int, list[tuple[Array, int | None]]] = {}  # of each position: correction, and its new number
    assigned = []
    _, inverse, uses = np.unique(position, return_inverse=True, return_counts=True)
    for s in np.flatnonzero(free & ((uses[inverse] > 1) | held)).tolist():
        pose = int(position[s])
        position_groups = groups.setdefault(pose, [(np.zeros(6), None)] if held[s] else [])
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
