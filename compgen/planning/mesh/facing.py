"""Meshes whose triangles face the wrong way: from the tool, they are not there."""

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.planning.mesh.mesh import Mesh

LEAST = 0.01  # of the path, over triangles that face down: less is an edge's rounding
_MEND = "turn its normals (flip, or reorient faces) where it was made, and export it again"


def refuse_facing_down(mesh: Mesh, bare: Array, count: int, source: str) -> None:
    """Refuse a mesh that faces away from the tool: nothing else says why it would not be under the path.

    Args:
        mesh: In the frame of the part.
        bare: Places over which no triangle faces up, (M, 2) [m].
        count: Places in all.
        source: The mesh's file, for the message.

    Raises:
        InputError: Triangles face into the body that they enclose, or down where none above faces up.
    """
    if mesh.is_inside_out():
        raise InputError(f"{source}: it is inside out: its triangles face into the body; {_MEND}")
    share = float((mesh.turned().over(bare).facet >= 0).sum() / count) if len(bare) else 0.0
    if share > LEAST and len(mesh.open_edges()):
        raise InputError(
            f"{source}: {100 * share:.0f} % of the path lie over triangles that face down, off the tool; {_MEND}, "
            "or turn the part over"
        )
