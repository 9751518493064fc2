"""Keys of a path file for a surface of triangles, and what lies on it."""

from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
from compgen.core.exceptions import InputError
from compgen.core.findings import Finding
from compgen.core.toml import NotNegative, Table
from compgen.core.units import DEG, MDEG, MM, UM
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.mesh.mesh import Mesh
from compgen.planning.mesh.stl import read_stl
from compgen.planning.own_points.pattern_on_mesh import Laid, lay
from compgen.planning.own_points.placing import place_points
from compgen.planning.own_points.space_curve import Tolerance, space_curve
from compgen.planning.surfaces import plane

CORNER = 25 * DEG  # from where a turn of the path is a corner
MOSTLY = 0.5  # share of the path that a part is under; less is a mistake as likely as a wish
TOLERANCE_UM, TOLERANCE_MDEG = 10.0, 200.0


class MeshTable(Table):
    """Keys of [surface] that a mesh alone has."""

    file: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    """STL file beside this one, in mm, in the frame of the part, z towards the tool; a mesh needs it."""
    open: bool | None = None
    """Whether the mesh may be a skin with open edges; default false: a closed part."""
    tolerance_um: Annotated[FiniteFloat, Field(ge=0.1, le=1000)] | None = None
    """Largest distance of the smooth path from the mesh; default 10."""
    tolerance_mdeg: Annotated[FiniteFloat, Field(ge=1, le=5000)] | None = None
    """Largest angle between the tool and the mesh's normal; default 200."""
    tool_radius_mm: NotNegative | None = None
    """Radius of the tool's working face: a sharper hollow under the path is refused; default: not looked at."""


class OnMesh(NamedTuple):
    """A pattern's curve on a mesh, over the plane z = 0 of the part's frame."""

    curve: PiecewiseCurve
    notes: tuple[Finding, ...]


def mesh_of(table: MeshTable, where: str) -> Mesh:
    """The mesh that a table names.

    Args:
        table: Names the file, beside the path file.
        where: The path file.

    Raises:
        InputError: No file, a bad one, or one with open edges that are not allowed for.
    """
    if table.file is None:
        raise InputError(f"{where}: surface.file: missing; kind = 'stl' needs the name of an STL file")
    source = Path(where).parent / table.file
    mesh = Mesh.of_corners(read_stl(source))
    if not len(mesh.facet):
        raise InputError(f"{source}: no facet has an area; export it again")
    edges = np.zeros((0, 2), dtype=np.int64) if table.open else mesh.open_edges()
    if len(edges):
        x, y, z = mesh.vertex[edges[0]].mean(axis=0) / MM
        raise InputError(
            f"{source}: open: {len(edges)} edges have no second facet, one at x {x:.1f}, y {y:.1f}, z {z:.1f} mm; "
            "close the part, or set surface.open = true for a skin"
        )
    return mesh


def pattern_on_mesh(
    table: MeshTable, mesh: Mesh, pattern: PiecewiseCurve, boundary: Boundary, shift: Array, spin: float, where: str
) -> OnMesh:
    """A smooth curve of a pattern on a mesh.

    Args:
        table: Tolerances.
        mesh: In the frame of the part.
        pattern: About the shift.
        boundary: About the shift; outside there is no contact.
        shift: Of the pattern in the frame, its z above the mesh, (3,) [m].
        spin: The tool's x axis against the frame's [rad].
        where: The path file.

    Raises:
        InputError: What ``lay`` refuses, or a tool tilted too far.
    """
    source = str(Path(where).parent / str(table.file))
    laid = lay(pattern, boundary, mesh, shift, source, (table.tool_radius_mm or 0.0) * MM)
    place, tilt = table.tolerance_um or TOLERANCE_UM, table.tolerance_mdeg or TOLERANCE_MDEG
    local = place_points(laid.points, plane(np.zeros(3)), spin, 1.0)
    curve = space_curve(local, Tolerance(place * UM, tilt * MDEG, CORNER, False)).curve
    notes = [Finding(Level.NOTE, Code.SURFACE_MESH, text) for text in (_size(mesh, laid), *_words(table, laid, place))]
    if laid.on_mesh < 1:
        level = Level.NOTE if laid.on_mesh > MOSTLY else Level.WARNING
        off = 100 * (1 - laid.on_mesh)
        notes.append(
            Finding(
                level,
                Code.SURFACE_MESH,
                f"{off:.2g} % of the path inside the edge is not over the mesh: no contact there",
            )
        )
    return OnMesh(curve, tuple(notes))


def _size(mesh: Mesh, laid: Laid) -> str:
    """How large the mesh is and where the tool meets it: no file says its unit, nor which way is up."""
    low, high = mesh.vertex.min(axis=0) / MM, mesh.vertex.max(axis=0) / MM
    x, y, _ = high - low
    met = laid.points.position[laid.points.contact, 2] / MM
    return (
        f"the mesh is {x:.1f} x {y:.1f} mm, z {low[2]:.1f} to {high[2]:.1f}; the tool is on it at z {met.min():.1f} to "
        f"{met.max():.1f}, from above: compare with the drawing"
    )


def _words(table: MeshTable, laid: Laid, tolerance_um: float) -> list[str]:
    """What a user should know of the mesh under the path."""
    words = []
    if laid.facets > tolerance_um * UM:
        words.append(
            f"the mesh's facets stand some {laid.facets / UM:.0f} um off a smooth surface, and the path follows them "
            f"to {tolerance_um:g} um: export it finer, or raise surface.tolerance_um"
        )
    if not table.tool_radius_mm and np.isfinite(laid.hollow):
        words.append(
            f"the sharpest hollow under the path has a radius of {laid.hollow / MM:.0f} mm; surface.tool_radius_mm "
            "compares it with the tool's"
        )
    return words
