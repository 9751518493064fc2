"""Table of a path file for a path of the user's own points, and the curve made from it."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.quantities import Coordinate, Length
from compgen.core.toml import Table
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.planning.mesh.mesh import Mesh
from compgen.planning.own_points.apt import read_apt
from compgen.planning.own_points.csv_points import read_points
from compgen.planning.own_points.gcode import read_gcode
from compgen.planning.own_points.given import check_points
from compgen.planning.own_points.placing import place_points, stand_on_mesh
from compgen.planning.own_points.space_curve import SpaceCurve, Tolerance, space_curve
from compgen.planning.surfaces import Quadric

FileName = Annotated[str, Field(min_length=1, max_length=1000)]


class OwnPointsTable(Table):
    """What every path of own points has."""

    through: Literal["tolerance", "points"] = "tolerance"
    """Smooth curve within the tolerance of every point, or exactly through every one."""
    tolerance_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 2.0
    """Largest distance of a point from the curve."""
    tolerance_mdeg: Annotated[FiniteFloat, Field(ge=0.01, le=5000)] = 10.0
    """Largest angle between the tool at a point and on the curve."""
    corner_deg: Annotated[FiniteFloat, Field(ge=1, le=180)] = 25.0
    """Turn between points from which on it is a corner, where the robot stops."""
    x_mm: Coordinate = 0.0
    """Shift of all points, x."""
    y_mm: Coordinate = 0.0
    """Shift of all points, y."""
    z_mm: Coordinate = 0.0
    """Shift of all points, z."""


class PointsTable(OwnPointsTable):
    """The user's own points, driven in their order."""

    pattern: Literal["points"]
    """The user's own points, from a CSV file."""
    file: FileName
    """CSV beside this file: x_mm, y_mm, z_mm; i, j, k or w_deg, p_deg, r_deg or neither; feed_mm_s, contact, stop."""
    jump_mm: Length = 100.0
    """A step on the part that is longer, and 20 times as long as is usual, is refused."""


class AptTable(OwnPointsTable):
    """Cutter locations of a CAM system."""

    pattern: Literal["apt"]
    """Cutter locations of a CAM system, from an APT file."""
    file: FileName
    """APT file beside this one: GOTO with x, y, z and i, j, k or without, FEDRAT, RAPID."""


class GcodeTable(OwnPointsTable):
    """G-code of three axes."""

    pattern: Literal["gcode"]
    """G-code of three axes, from its file."""
    file: FileName
    """File beside this one: G0, G1, G2, G3 in the XY plane, in mm; the tool stands on the surface."""


OwnPoints = PointsTable | AptTable | GcodeTable
READERS = {"points": read_points, "apt": read_apt, "gcode": read_gcode}


def own_points_curve(
    table: OwnPoints, surface: Quadric, spin: float, feed: float, where: str, mesh: Mesh | None = None
) -> SpaceCurve:
    """The curve along the points of a table's file.

    Args:
        table: Names the file, beside the path file.
        surface: That the points lie on where they do not say how the tool stands.
        spin: The tool's x axis against base x [rad].
        feed: Of the process [m/s].
        where: The path file.
        mesh: That they stand on instead, in the frame of the part.

    Raises:
        InputError: A bad file, or points that no path can be laid through.
    """
    points = READERS[table.pattern](Path(where).parent / table.file)
    check_points(points, table.jump_mm * MM if isinstance(table, PointsTable) else np.inf)
    if surface.A.any() and not (points.normal is None and points.rotation is None):
        raise InputError(
            f"{where}: surface.kind: the points of {points.source} say themselves how the tool stands; remove [surface]"
        )
    if mesh is not None and points.normal is None and points.rotation is None:
        points = stand_on_mesh(points, mesh, surface.origin)
    local = place_points(points, surface, spin, feed)
    tolerance = Tolerance(
        table.tolerance_um * UM, table.tolerance_mdeg * MDEG, table.corner_deg * DEG, table.through == "points"
    )
    return space_curve(local, tolerance)
