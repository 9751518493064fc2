"""Meshes whose triangles face the wrong way: the tool would go through what is on top, or find nothing under it."""

from collections.abc import Callable

from compgen.core.arrays import Array, IntArray
from compgen.core.exceptions import InputError
from compgen.core.units import MM
from compgen.planning.mesh.mesh import Mesh, Over


def refuse_facing_down(mesh: Mesh, xy: Array, over: Over, rows: IntArray, where: Callable[[int], str]) -> None:
    """Refuse a mesh that is inside out, or upside down, under a path.

    Args:
        mesh: In the frame of the part.
        xy: Places, (M, 2) [m].
        over: The mesh over them.
        rows: Of those that the tool touches.
        where: Names the file, and the line where it has one, of a row.

    Raises:
        InputError: What is on top at one of them faces down.
    """
    bad = rows[mesh.faces_down(xy[rows], over.height[rows])]
    if len(bad):
        x, y = xy[bad[0]] / MM
        raise InputError(
            f"{where(int(bad[0]))}: inside out: the triangle on top at x {x:.1f}, y {y:.1f} mm faces down (mirrored, "
            "or upside down?); turn its normals (flip, or reorient faces) and export it again, or turn the part over"
        )
