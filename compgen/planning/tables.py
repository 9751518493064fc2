"""Tables of a path file for pattern, surface, boundary and process, and the objects made from them."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.quantities import Angle, Coordinate, Length
from compgen.core.toml import Table
from compgen.core.units import DEG, MM
from compgen.planning import boundaries, patterns, surfaces
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.own_points.tables import OwnPoints

MAX_SWEEPS = 1e4
MAX_LEAD = 50.0  # mm


class PatternTable(Table):
    """What every pattern has: where its centre stands."""

    x_mm: Coordinate
    """Centre of the pattern, World x."""
    y_mm: Coordinate
    """Centre of the pattern, World y."""
    z_mm: Coordinate
    """Centre of the pattern, World z."""


class LineTable(PatternTable):
    """A straight line along an axis of World."""

    pattern: Literal["line"]
    """A straight line along an axis of World."""
    axis: Literal["x", "y", "z"]
    """Direction: x or y through the centre, z upwards from it."""
    length_mm: Length
    """Length of the line."""


class CircleTable(PatternTable):
    """A full circle."""

    pattern: Literal["circle"]
    """A full circle."""
    diameter_mm: Length
    """Diameter of the circle."""


class SpiralTable(PatternTable):
    """A spiral from the centre outwards; give turns or stepover_mm."""

    pattern: Literal["spiral"]
    """A spiral from the centre outwards."""
    diameter_mm: Length | None = None
    """Outer diameter; default the circumscribed circle of the boundary."""
    turns: Annotated[FiniteFloat, Field(gt=0, le=1e4)] | None = None
    """Number of turns; this or stepover_mm."""
    stepover_mm: Length | None = None
    """Distance between neighbouring turns; this or turns."""


class RasterTable(PatternTable):
    """Parallel sweeps along x, clipped to a circle or to the boundary."""

    pattern: Literal["raster"]
    """Parallel sweeps along x."""
    stepover_mm: Length
    """Distance between neighbouring sweeps."""
    diameter_mm: Length | None = None
    """Diameter of the circle that clips the sweeps; without it a boundary must be given."""
    lead_mm: Annotated[FiniteFloat, Field(ge=0, le=MAX_LEAD)] = 5.0
    """How far each sweep runs past the edge; farther where process.lead_in has play to run through."""
    turn: Literal["square", "smooth"] = "square"
    """Way to the next sweep: square stops at both corners, smooth runs on."""


class Iso9283Table(PatternTable):
    """Test path after ISO 9283: lines, circles and corners in a square plane."""

    pattern: Literal["iso9283"]
    """Test path after ISO 9283: lines, circles and corners in a square plane."""
    size_mm: Length
    """Side of the square."""


Shape = LineTable | CircleTable | SpiralTable | RasterTable | Iso9283Table
AnyPattern = Annotated[Shape | OwnPoints, Field(discriminator="pattern")]


class SurfaceTable(Table):
    """The surface that the path lies on."""

    kind: Literal["plane", "conic"] = "plane"
    """Horizontal plane, or concave conic with its local x pointing away from the parent's axis."""
    radius_of_curvature_m: Annotated[FiniteFloat, Field(ge=0.1, le=1e6)] | None = None
    """Vertex radius of curvature of the parent conic; a conic needs it."""
    conic_constant: Annotated[FiniteFloat, Field(ge=-1e3, le=1e3)] | None = None
    """Conic constant: 0 sphere, -1 paraboloid; a conic needs it."""
    off_axis_m: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None
    """Distance of the pattern's centre from the parent's axis; a conic needs it."""


class BoundaryTable(Table):
    """The edge of the part, around the centre of the pattern; outside there is no contact."""

    shape: Literal["circle", "hexagon"]
    """Shape of the edge."""
    diameter_mm: Length | None = None
    """Diameter; a circle needs it."""
    corner_to_corner_mm: Length | None = None
    """Distance of opposite corners; a hexagon needs it."""
    rotation_deg: Angle | None = None
    """Turn of a hexagon about z; default 0: two corners lie on x."""


class ProcessTable(Table):
    """Feed, and how the path is cut into waypoints."""

    feed_mm_s: Annotated[FiniteFloat, Field(ge=0.05, le=2000)]
    """Speed of the tool centre point along the path."""
    chord_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 1.5
    """Largest distance between the path and the line from one waypoint to the next."""
    spacing_mm: Annotated[FiniteFloat, Field(ge=1e-3, le=10)] = 10.0
    """Largest distance between two waypoints."""
    thin_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] | None = None
    """Leaves waypoints out of the program while lines stay this near the path; default off."""
    lift_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 20.0
    """Length of approach and retract along the tool axis."""
    lead_in: bool | None = None
    """Approach on a line that turns every joint through its play; default on for a robot with play."""
    page_stops: Literal["off the part", "anywhere"] = "off the part"
    """Where the robot may stop when a long program is split into pages."""


def boundary_from_table(table: BoundaryTable | None, file: str) -> Boundary | None:
    """The part's edge; None without one.

    Raises:
        InputError: Sizes that miss or contradict the shape.
    """
    if table is None:
        return None
    is_circle = table.shape == "circle"
    needed, other = ("diameter_mm", "corner_to_corner_mm") if is_circle else ("corner_to_corner_mm", "diameter_mm")
    for key in (other, *(["rotation_deg"] if is_circle else [])):
        if getattr(table, key) is not None:
            raise InputError(f"{file}: boundary.{key}: conflicts with shape = '{table.shape}'; remove one of them")
    size = getattr(table, needed)
    if size is None:
        raise InputError(f"{file}: boundary.{needed}: missing; add it, a {table.shape} needs it")
    if is_circle:
        return boundaries.circle(size * MM)
    return boundaries.hexagon(size * MM, (table.rotation_deg or 0.0) * DEG)


def pattern_from_table(table: Shape, boundary: Boundary | None, file: str) -> tuple[PiecewiseCurve, Boundary]:
    """The pattern's pieces and the edge that marks contact.

    Raises:
        InputError: Sizes that miss, contradict each other or ask for too many sweeps.
    """
    edge = boundary or boundaries.unbounded()
    match table:
        case LineTable(axis=axis, length_mm=length):
            return patterns.line(axis, length * MM), edge
        case CircleTable(diameter_mm=diameter):
            return patterns.circle(diameter * MM), edge
        case Iso9283Table(size_mm=size):
            return patterns.iso9283(size * MM), edge
        case SpiralTable():
            return _spiral(table, boundary, file), edge
        case RasterTable():
            return _raster(table, boundary, file)


def _raster(table: RasterTable, boundary: Boundary | None, file: str) -> tuple[PiecewiseCurve, Boundary]:
    if boundary is not None and table.diameter_mm is not None:
        raise InputError(f"{file}: path.diameter_mm: conflicts with [boundary]; remove one")
    clip = boundary
    if clip is None:
        if table.diameter_mm is None:
            raise InputError(f"{file}: path.diameter_mm: missing; give it, or a [boundary]")
        clip = boundaries.circle(table.diameter_mm * MM)
    if clip.half_height() * 2 / (table.stepover_mm * MM) > MAX_SWEEPS:
        raise InputError(f"{file}: path.stepover_mm: over {MAX_SWEEPS:.0f} sweeps; make it larger")
    try:
        return patterns.raster(clip, table.stepover_mm * MM, table.lead_mm * MM, table.turn == "smooth"), clip
    except InputError as exception:
        raise InputError(f"{file}: {exception}") from exception


def _spiral(table: SpiralTable, boundary: Boundary | None, file: str) -> PiecewiseCurve:
    if (table.turns is None) == (table.stepover_mm is None):
        raise InputError(f"{file}: path.turns: give turns or stepover_mm, one of them")
    circumscribed = 2 * boundary.circumradius() if boundary else None
    diameter = table.diameter_mm * MM if table.diameter_mm is not None else circumscribed
    if diameter is None:
        raise InputError(f"{file}: path.diameter_mm: missing; give it, or a [boundary]")
    if circumscribed is not None and diameter < circumscribed * (1 - 1e-9):
        raise InputError(
            f"{file}: path.diameter_mm: {diameter / MM:g} conflicts with [boundary], whose circumscribed circle is "
            f"{circumscribed / MM:g} mm; remove one or make the spiral larger"
        )
    turns = table.turns if table.turns is not None else diameter / 2 / ((table.stepover_mm or 1.0) * MM)
    if turns > MAX_SWEEPS:
        raise InputError(f"{file}: path.stepover_mm: over {MAX_SWEEPS:.0f} turns; make it larger")
    return patterns.spiral(diameter, turns)


def surface_from_table(table: SurfaceTable, pattern: AnyPattern, file: str) -> surfaces.Quadric:
    """The surface that the path lies on.

    Raises:
        InputError: Numbers that miss, or that a plane has none of.
    """
    origin = np.array([pattern.x_mm, pattern.y_mm, pattern.z_mm]) * MM
    numbers = {k: getattr(table, k) for k in ("radius_of_curvature_m", "conic_constant", "off_axis_m")}
    if table.kind == "plane":
        for key, value in numbers.items():
            if value is not None:
                raise InputError(f"{file}: surface.{key}: a plane has none; set surface.kind = 'conic' or remove it")
        return surfaces.plane(origin)
    for key, value in numbers.items():
        if value is None:
            raise InputError(f"{file}: surface.{key}: missing; a conic needs it")
    try:
        return surfaces.conic(origin, *(float(v or 0.0) for v in numbers.values()))
    except InputError as exception:
        raise InputError(f"{file}: {exception}") from exception
