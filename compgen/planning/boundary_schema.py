"""Table of a path file for the edge of the part and its holes, and the boundary made from it."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from compgen.core.exceptions import InputError
from compgen.core.toml import Angle, Coordinate, Length, Table
from compgen.core.units import DEG, MM
from compgen.planning import boundaries
from compgen.planning.boundaries import Boundary, moved_hole, pierced, ring_hole, slot_hole

Corner = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
Corners = Annotated[list[Corner], Field(min_length=3, max_length=200)]
TwoLengths = Annotated[list[Length], Field(min_length=2, max_length=2)]
#: the keys that each kind of hole needs
OF_HOLE = {
    "polygon": {"corners_mm"},
    "circle": {"x_mm", "y_mm", "diameter_mm"},
    "slot": {"x_mm", "y_mm", "length_mm", "width_mm"},
    "rectangle": {"x_mm", "y_mm", "size_mm"},
}
#: the key that each shape of an edge needs
NEEDED = {"circle": "diameter_mm", "hexagon": "corner_to_corner_mm", "rectangle": "size_mm", "polygon": "corners_mm"}


class HoleTable(Table):
    """A hole in the part."""

    kind: Literal["polygon", "circle", "slot", "rectangle"] = "polygon"
    """Shape of the hole; a slot is round at both ends."""
    corners_mm: Corners | None = None
    """Corners [x, y] in order round the hole; a polygon needs them."""
    x_mm: Coordinate | None = None
    """Middle of the hole from the part's, x; all but a polygon need it."""
    y_mm: Coordinate | None = None
    """Middle of the hole from the part's, y; all but a polygon need it."""
    diameter_mm: Length | None = None
    """Diameter; a circle needs it."""
    length_mm: Length | None = None
    """Length from end to end; a slot needs it."""
    width_mm: Length | None = None
    """Width; a slot needs it."""
    size_mm: TwoLengths | None = None
    """Sizes along x and y; a rectangle needs them."""
    rotation_deg: Angle | None = None
    """Turn of a slot or a rectangle about its middle; default 0: length, and first size, along x."""


class BoundaryTable(Table):
    """The edge of the part, around the centre of the pattern; outside there is no contact."""

    shape: Literal["circle", "hexagon", "rectangle", "polygon"]
    """Shape of the edge."""
    diameter_mm: Length | None = None
    """Diameter; a circle needs it."""
    corner_to_corner_mm: Length | None = None
    """Distance of opposite corners; a hexagon needs it."""
    size_mm: TwoLengths | None = None
    """Sizes along x and y; a rectangle needs them."""
    corners_mm: Corners | None = None
    """Corners [x, y] in order round the part; a polygon needs them."""
    holes: list[HoleTable] = []
    """Holes, in any shape of the edge; sweeps and turns run on over them at the height of the part, without contact."""
    rotation_deg: Angle | None = None
    """Turn about z; default 0: two corners of a hexagon lie on x, the sides of a rectangle along x and y."""


def boundary_from_table(table: BoundaryTable | None, file: str) -> Boundary | None:
    """The part's edge; None without one.

    Raises:
        InputError: Sizes that miss or contradict the shape.
    """
    if table is None:
        return None
    needed, rotation = NEEDED[table.shape], (table.rotation_deg or 0.0) * DEG
    others = [key for key in NEEDED.values() if key != needed]
    others += ["rotation_deg"] if table.shape == "circle" else []
    for key in others:
        if key in table.model_fields_set and getattr(table, key) is not None:
            raise InputError(f"{file}: boundary.{key}: conflicts with shape = '{table.shape}'; remove one of them")
    size = getattr(table, needed)
    if size is None:
        raise InputError(f"{file}: boundary.{needed}: missing; add it, a {table.shape} needs it")
    try:
        holes = [_hole(hole, f"holes.{n}").turned(rotation) for n, hole in enumerate(table.holes)]
        return pierced(_outline(table.shape, size, rotation), holes)
    except InputError as exception:
        raise InputError(f"{file}: boundary.{exception}") from exception


def _outline(shape: str, size: Any, rotation: float) -> Boundary:
    """The edge without its holes."""
    if shape == "circle":
        return boundaries.round_part(size * MM)
    if shape == "hexagon":
        return boundaries.hexagon(size * MM, rotation)
    if shape == "rectangle":
        return boundaries.rectangle(size[0] * MM, size[1] * MM, rotation)
    return boundaries.polygon(np.array(size) * MM).turned(rotation)


def _hole(table: HoleTable, name: str) -> Boundary:
    given = {key for key in table.model_fields_set if getattr(table, key) is not None} - {"kind"}
    needed = OF_HOLE[table.kind]
    if missing := sorted(needed - given):
        raise InputError(f"{name}.{missing[0]}: missing; add it, a {table.kind} needs it")
    turns = {"rotation_deg"} if table.kind in ("slot", "rectangle") else set()
    if others := sorted(given - needed - turns):
        raise InputError(f"{name}.{others[0]}: a {table.kind} has none; remove it, or set its kind")
    angle = (table.rotation_deg or 0.0) * DEG
    if table.kind == "polygon":
        return ring_hole(np.array(table.corners_mm) * MM, name)
    centre = np.array([table.x_mm, table.y_mm]) * MM
    if table.kind == "rectangle":
        x, y = np.array(table.size_mm) / 2 * MM
        return moved_hole(ring_hole(np.array([(-x, -y), (x, -y), (x, y), (-x, y)]), name).turned(angle), centre)
    length, width = table.length_mm or table.diameter_mm or 0.0, table.width_mm or table.diameter_mm or 0.0
    if length < width:
        raise InputError(
            f"{name}.length_mm: {length:g} is less than width_mm = {width:g}; turn it by rotation_deg = 90"
        )
    return moved_hole(slot_hole(length * MM, width * MM).turned(angle), centre)
