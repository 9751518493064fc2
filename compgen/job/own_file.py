"""A user's own file as the judge has read it: what a result is held against."""

from dataclasses import dataclass

from compgen.core.arrays import Array, BoolArray, IntArray, owns


@dataclass(frozen=True, eq=False, slots=True)
@owns(corner=("V", 3), line=("V",), given=("V",))
class OwnFile:
    """V corners in the order they are driven, in the frame of the part."""

    source: str
    corner: Array  # (V, 3) [m]
    line: IntArray  # (V,) of the file that each belongs to
    given: BoolArray  # (V,) a place that the file names; the others stand on its arcs
    joined: bool  # whether what lies between them is lines; a curve through them is free there
