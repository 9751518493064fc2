r"""The pose that a Cartesian position's six numbers come to where a motion drives to it, and back.

T = T_uframe T(numbers + Offset) T_Tool_Offset
"""

from collections.abc import Iterator

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.placements import Placement
from compgen.fanuc.pose_table import Pose, pose_of


def placed_poses(
    values: Array, base: tuple[Array, Array], table: tuple[Placement, ...], placement: IntArray
) -> tuple[Array, Array]:
    """TCP poses of the numbers of Cartesian positions: with their offset, in their user frame, with their tool offset.

    Args:
        values: X Y Z [mm] and W P R [deg], (n, 6).
        base: User frames, (n, 3) [m] and (n, 3, 3).
        table: Placements.
        placement: That of each, (n,).

    Returns:
        Positions (n, 3) [m] and rotations (n, 3, 3).
    """
    origin, axes = base
    shifted = values + _offsets(table, placement)
    position = origin + np.einsum("nij,nj->ni", axes, shifted[:, :3] * MM)
    rotation = axes @ from_wpr(*(shifted[:, 3:] * DEG).T)
    for k, (tcp, turn) in _tool_offsets(table, placement):
        position[k] += rotation[k] @ tcp
        rotation[k] = rotation[k] @ turn
    return position, rotation


def placed_numbers(
    position: Array, rotation: Array, base: tuple[Array, Array], table: tuple[Placement, ...], placement: IntArray
) -> tuple[Array, Array, Array]:
    """What Cartesian positions say at TCP poses: the inverse of ``placed_poses``, with the rotation in the user frame.

    Returns:
        X Y Z (n, 3) [mm]; rotations (n, 3, 3) with the offset in them; its W P R, to be taken off (n, 3) [deg].
    """
    origin, axes = base
    position, rotation = position.copy(), rotation.copy()
    for k, (tcp, turn) in _tool_offsets(table, placement):
        rotation[k] = rotation[k] @ turn.T
        position[k] -= rotation[k] @ tcp
    offset = _offsets(table, placement)
    xyz = np.einsum("nji,nj->ni", axes, position - origin) / MM - offset[:, :3]
    return xyz, np.swapaxes(axes, 1, 2) @ rotation, offset[:, 3:]


def _offsets(table: tuple[Placement, ...], placement: IntArray) -> Array:
    return np.array([t.offset or (0.0,) * 6 for t in table])[placement]


def _tool_offsets(table: tuple[Placement, ...], placement: IntArray) -> Iterator[tuple[int, Pose]]:
    """Rows with a tool offset, and its pose."""
    for t, shift in enumerate(table):
        if shift.tool_offset is not None:
            pose = pose_of(shift.tool_offset)
            yield from ((k, pose) for k in np.flatnonzero(placement == t).tolist())
