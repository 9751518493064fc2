"""Tables of a path file for the user's own points and for a mesh, and the curves made from them."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.arrays import Array
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.recorded.layout import DialectTable
from compgen.core.recorded.table import read_findings
from compgen.core.toml import Coordinate, Length, NotNegative, Table
from compgen.core.units import DEG, MDEG, MM, UM, counted
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.mesh import Mesh, read_stl
from compgen.planning.own_points.apt import read_apt
from compgen.planning.own_points.csv_points import read_points
from compgen.planning.own_points.gcode import read_gcode
from compgen.planning.own_points.given_points import GivenPoints, check_points
from compgen.planning.own_points.line_path import line_path
from compgen.planning.own_points.pattern_on_mesh import Laid, lay
from compgen.planning.own_points.space_curve import LocalPoints, SpaceCurve, Tolerance, space_curve
from compgen.planning.own_points.tool_stands import place_points, stand_on_mesh, stand_on_surface
from compgen.planning.surfaces import Quadric, plane

FileName = Annotated[str, Field(min_length=1, max_length=1000)]
READERS = {"apt": read_apt, "gcode": read_gcode}
CORNER = 25 * DEG  # of a curve, from where a turn is a corner
STANDING_STEP = 10 * MM  # of points with the surface's normal on a line over it
MOSTLY = 0.5  # share of the path that a part is under; less is a mistake as likely as a wish
TOLERANCE_UM, TOLERANCE_MDEG = 10.0, 200.0
OFF_SURFACE = 0.1 * MM  # of points that are to lie on it
PER_PIECE = 9  # places of a curve that are compared with the mesh


class OwnPointsTable(Table):
    """What every path of own points has."""

    through: Literal["tolerance", "points", "lines"] | None = None
    """Curve within a tolerance of points or exactly through them, or the lines; default: CSV tolerance, else lines."""
    tolerance_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 2.0
    """Largest distance of a point, or of a rounded corner, from the path."""
    tolerance_mdeg: Annotated[FiniteFloat, Field(ge=0.01, le=5000)] = 10.0
    """Largest angle between the tool at a point and on the path."""
    corner_deg: Annotated[FiniteFloat, Field(ge=1, le=180)] | None = None
    """Turn between points from which on it is a corner, where the robot stops; default: 25 of a curve, lines none."""
    bulge_um: Annotated[FiniteFloat, Field(ge=0, le=1e6)] = 50.0
    """Largest distance of a curve from the lines between points, beyond what the points' own curvature explains."""
    x_mm: Coordinate = 0.0
    """Shift of all points, x."""
    y_mm: Coordinate = 0.0
    """Shift of all points, y."""
    z_mm: Coordinate = 0.0
    """Shift of all points, z."""


class PointsTable(OwnPointsTable, DialectTable):
    """The user's own points, driven in their order."""

    pattern: Literal["points"]
    """The user's own points, from a CSV file."""
    file: FileName
    """File beside this one: x_mm, y_mm, z_mm; i, j, k or w_deg, p_deg, r_deg or neither; feed_mm_s, contact, stop."""
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


class PlacedPath(NamedTuple):
    """The path of a table's file."""

    curve: PiecewiseCurve
    surface: Quadric  # that the curve lies on
    findings: tuple[Finding, ...]
    standing: bool  # whether the points say how the tool stands, not what they lie on


def own_points_path(
    table: OwnPoints, surface: Quadric, spin: float, feed: float, where: str, mesh: Mesh | None
) -> PlacedPath:
    """The path along the points, lines or arcs of a table's file.

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
    file = Path(where).parent / table.file
    points = read_points(file, table) if isinstance(table, PointsTable) else READERS[table.pattern](file)
    check_points(points, table.jump_mm * MM if isinstance(table, PointsTable) else np.inf)
    free = points.normal is None and points.rotation is None  # what they lie on says how the tool stands
    if surface.A.any() and not free:
        raise InputError(
            f"{where}: surface.kind: the points of {points.source} say themselves how the tool stands; remove [surface]"
        )
    notes = tuple(Finding.of(Code.PATH_END, f"{table.file}: {text}") for text in points.notes)
    notes += tuple(read_findings(points.read_as))
    lines = through(table) == "lines"
    if not lines:
        points = points.as_points()
    elif free and (mesh is not None or surface.A.any()):
        points = points.divided(STANDING_STEP)
    if mesh is not None and free:
        points, off = stand_on_mesh(points, mesh, surface.origin)
        notes = (*notes, *_off_surface(points, off, "mesh", "unit, height and frame of both files"))
    elif free and surface.A.any():
        off = surface.local(points.position + surface.origin)[:, 2]
        notes = (*notes, *_off_surface(points, off, "conic", "unit, height and frame with [surface]"))
        if lines:  # a line is one in the part's frame, over whatever surface
            points, surface = stand_on_surface(points, surface), plane(surface.origin)
    local = place_points(points, surface, spin, feed)
    corner = CORNER if table.corner_deg is None else table.corner_deg * DEG
    tolerance = Tolerance(table.tolerance_um * UM, table.tolerance_mdeg * MDEG, corner, through(table) == "points")
    if lines:
        tolerance = replace(tolerance, corner=np.pi if table.corner_deg is None else corner)
        path = line_path(local, points.arcs, tolerance)
        return PlacedPath(path.curve, surface, (*notes, _of_lines(path, len(local.place) - 1)), not free)
    path = space_curve(local, tolerance)
    return PlacedPath(path.curve, surface, (*notes, *_of_curve(path, points, local, table)), not free)


def _off_surface(points: GivenPoints, off: Array, kind: str, what: str) -> Iterator[Finding]:
    """How far (M,) [m] points on the part are from a surface that only says how the tool stands on them."""
    off = off[points.contact]
    if np.abs(off).max(initial=0.0) <= OFF_SURFACE:
        return
    yield Finding(
        Level.WARNING if off.min() < -OFF_SURFACE else Level.NOTE,
        Code.SURFACE_MESH,
        f"on the part the points of {points.source} are {off.min() / MM:.2f} to {off.max() / MM:.2f} mm from the "
        f"{kind} (below 0: in it), and the tool goes where they are: compare {what}",
    )


def through(table: OwnPoints) -> str:
    """What becomes of a table's points: as it says, else as its file means them."""
    return table.through or ("tolerance" if table.pattern == "points" else "lines")


def _of_lines(path: SpaceCurve, ways: int) -> Finding:
    some = counted(path.corners, "stop at a corner", "stops at corners")
    stops = f"{some} that no rounding can hold" if path.corners else "no stop at a corner"
    given = counted(ways, "line or arc", "lines and arcs")
    return Finding.of(Code.PATH_LINES, f"{given}, corners rounded within path.tolerance_um; {stops}")


def _of_curve(path: SpaceCurve, points: GivenPoints, local: LocalPoints, table: OwnPoints) -> list[Finding]:
    """What the curve through a user's points does that the points do not say."""
    bulge, allowed = path.bulge, table.bulge_um * UM
    corners = counted(path.corners, "corner", "corners")
    stops = f"; it stops at {corners} (path.corner_deg)" if path.corners else ""
    message = f"the curve leaves the lines between points by up to {round(bulge.size / MM, 6):.3g} mm{stops}"
    findings = [Finding.of(Code.PATH_POINTS, message)]
    if bulge.beyond > allowed:
        message = (
            f"{points.where(bulge.row)}: behind it the curve leaves the line to the next point by "
            f"{bulge.beyond / MM:.3g} mm more than the points' curvature explains, path.bulge_um allows "
            f"{table.bulge_um:g} um; give more points, or path.through = 'lines'"
        )
        findings.append(Finding.of(Code.PATH_BULGE, message))
    below = float(local.place[:, 2].min()) - bulge.lowest
    if below > table.tolerance_um * UM:
        message = (
            f"the curve goes {below / MM:.3g} mm below the lowest point of {table.file}; give more points there, or "
            "path.through = 'lines'"
        )
        findings.append(Finding.of(Code.PATH_BELOW, message))
    return findings


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
    place, tilt = table.tolerance_um or TOLERANCE_UM, table.tolerance_mdeg or TOLERANCE_MDEG
    laid = lay(pattern, boundary, mesh, shift, source, place * UM, (table.tool_radius_mm or 0.0) * MM)
    local = place_points(laid.points, plane(np.zeros(3)), spin, 1.0)
    curve = space_curve(local, Tolerance(place * UM, tilt * MDEG, CORNER, exact=False)).curve
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
    notes += _cut_in(curve, mesh, shift[2], place * UM + laid.facets)
    return OnMesh(curve, tuple(notes))


def _cut_in(curve: PiecewiseCurve, mesh: Mesh, above: float, allowed: float) -> Iterator[Finding]:
    """Where a curve is lower than it shall be ``above`` the mesh [m], by more than ``allowed`` [m]."""
    K = len(curve.poly)
    piece, t = np.repeat(np.arange(K), PER_PIECE), np.tile(np.linspace(0, 1, PER_PIECE), K)
    xy = curve.derivatives(piece, t)[0]
    over = mesh.over(xy)
    depth = np.nan_to_num((over.height + above - curve.height(piece, t)[0]) * over.normal[:, 2])
    worst = int(np.argmax(depth))
    if depth[worst] <= allowed:
        return
    x, y = xy[worst] / MM
    yield Finding(
        Level.WARNING,
        Code.SURFACE_MESH,
        f"the path cuts {depth[worst] / UM:.0f} um into the mesh at x {x:.1f}, y {y:.1f} mm, which bends there "
        "more than points on it show; export it finer, or keep off that place (path.lead_mm, [boundary])",
    )


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
