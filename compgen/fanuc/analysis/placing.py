r"""The pose that a Cartesian position's six numbers come to where a motion drives to it, and back.

T = T_uframe T(numbers + Offset) T_Tool_Offset
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.placements import Placement
from compgen.fanuc.pose_table import pose_of


def placed_poses(values: Array, base: Pose, table: tuple[Placement, ...], placement: IntArray) -> Pose:
    """TCP poses of the numbers of Cartesian positions: with their offset, in their user frame, with their tool offset.

    Args:
        values: X Y Z [mm] and W P R [deg], (n, 6).
        base: User frames, n of them.
        table: Placements.
        placement: That of each, (n,).
    """
    shifted = values + _offsets(table, placement)
    return base @ Pose(shifted[:, :3] * MM, from_wpr(*(shifted[:, 3:] * DEG).T)) @ _tool_offsets(table, placement)


class PlacedNumbers(NamedTuple):
    """What n Cartesian positions say, their angles still as a rotation."""

    xyz: Array  # (n, 3) [mm] X Y Z
    rotation: Array  # (n, 3, 3) in the user frame, with the offset in it
    wpr_offset: Array  # (n, 3) [deg] of the offset, to be taken off W P R


def placed_numbers(tcp: Pose, base: Pose, table: tuple[Placement, ...], placement: IntArray) -> PlacedNumbers:
    """What Cartesian positions say at TCP poses: the inverse of ``placed_poses``."""
    placed = tcp @ _tool_offsets(table, placement).inverse()
    offset = _offsets(table, placement)
    xyz = np.einsum("nji,nj->ni", base.rotation, placed.position - base.position) / MM - offset[:, :3]
    return PlacedNumbers(xyz, np.swapaxes(base.rotation, 1, 2) @ placed.rotation, offset[:, 3:])


def _offsets(table: tuple[Placement, ...], placement: IntArray) -> Array:
    return np.array([t.offset or (0.0,) * 6 for t in table])[placement]


def _tool_offsets(table: tuple[Placement, ...], placement: IntArray) -> Pose:
    """The tool offset of each position, none where it has none."""
    return Pose.stack([IDENTITY if t.tool_offset is None else pose_of(t.tool_offset) for t in table])[placement]
