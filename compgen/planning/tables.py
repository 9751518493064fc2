"""What a path file says of patterns, surfaces, edges and the process, and the objects made of it."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError
from compgen.core.quantities import Angle, Length, Place
from compgen.core.toml import Table
from compgen.core.units import DEG, MM
from compgen.planning import boundaries, patterns, surfaces
from compgen.planning.boundaries import Boundary
from compgen.planning.curves import PiecewiseCurve

MAX_SWEEPS = 1e4


class PatternTable(Table):
    """What every pattern has: its name and where its centre stands."""

    x_mm: Place
    y_mm: Place
    z_mm: Place


class LineTable(PatternTable):
    """A line along an axis; along z it starts at the centre."""

    pattern: Literal["line"]
    axis: Literal["x", "y", "z"]
    length_mm: Length


class CircleTable(PatternTable):
    """A full circle."""

    pattern: Literal["circle"]
    diameter_mm: Length


class SpiralTable(PatternTable):
    """A spiral from the centre; its pitch as a number of turns or as a stepover."""

    pattern: Literal["spiral"]
    diameter_mm: Length | None = None
    turns: Annotated[FiniteFloat, Field(gt=0, le=1e4)] | None = None
    stepover_mm: Length | None = None


class RasterTable(PatternTable):
    """Sweeps along x, clipped to a circle of ``diameter_mm`` or to the boundary."""

    pattern: Literal["raster"]
    stepover_mm: Length
    diameter_mm: Length | None = None
    lead_mm: Annotated[FiniteFloat, Field(ge=0, le=50)] = 5.0
    turn: Literal["square", "smooth"] = "square"


class Iso9283Table(PatternTable):
    """Test path after ISO 9283 in a square plane."""

    pattern: Literal["iso9283"]
    size_mm: Length


PATTERNS: dict[str, type[PatternTable]] = {
    "line": LineTable,
    "circle": CircleTable,
    "spiral": SpiralTable,
    "raster": RasterTable,
    "iso9283": Iso9283Table,
}


class SurfaceTable(Table):
    """What the path lies on; a conic needs its three numbers."""

    kind: Literal["plane", "conic"] = "plane"
    radius_of_curvature_m: Annotated[FiniteFloat, Field(ge=0.1, le=1e6)] | None = None
    conic_constant: Annotated[FiniteFloat, Field(ge=-1e3, le=1e3)] | None = None
    off_axis_m: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None


class BoundaryTable(Table):
    """The part's edge."""

    shape: Literal["circle", "hexagon"]
    diameter_mm: Length | None = None
    corner_to_corner_mm: Length | None = None
    rotation_deg: Angle | None = None


class ProcessTable(Table):
    """How the path is driven and cut into waypoints."""

    feed_mm_s: Annotated[FiniteFloat, Field(ge=0.05, le=2000)]
    chord_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 1.5
    spacing_mm: Annotated[FiniteFloat, Field(ge=1e-3, le=10)] = 10.0
    thin_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] | None = None
    lift_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 20.0
    page_stops: Literal["off the part", "anywhere"] = "off the part"


def boundary_from_table(table: BoundaryTable | None, where: str) -> Boundary | None:
    """The part's edge; None without one.

    Raises:
        InputError: Sizes that miss or contradict the shape.
    """
    if table is None:
        return None
    round_ = table.shape == "circle"
    need, other = ("diameter_mm", "corner_to_corner_mm") if round_ else ("corner_to_corner_mm", "diameter_mm")
    if getattr(table, other) is not None or (round_ and table.rotation_deg is not None):
        extra = other if getattr(table, other) is not None else "rotation_deg"
        raise InputError(f"{where}: boundary.{extra}: conflicts with shape = '{table.shape}'; remove one of them")
    size = getattr(table, need)
    if size is None:
        raise InputError(f"{where}: boundary.{need}: missing; add it, a {table.shape} needs it")
    if round_:
        return boundaries.circle(size * MM)
    return boundaries.hexagon(size * MM, (table.rotation_deg or 0.0) * DEG)


def pattern_from_table(table: PatternTable, boundary: Boundary | None, where: str) -> tuple[PiecewiseCurve, Boundary]:
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
            return _spiral(table, boundary, where), edge
        case RasterTable():
            if (table.diameter_mm is None) == (boundary is None):
                raise InputError(
                    f"{where}: path.diameter_mm: "
                    + (
                        "missing; give it, or a [boundary]"
                        if boundary is None
                        else "conflicts with [boundary]; remove one"
                    )
                )
            clip = boundary or boundaries.circle((table.diameter_mm or 0.0) * MM)
            smooth = table.turn == "smooth"
            if clip.half_height() * 2 / (table.stepover_mm * MM) > MAX_SWEEPS:
                raise InputError(f"{where}: path.stepover_mm: over {MAX_SWEEPS:.0f} sweeps; make it larger")
            try:
                return patterns.raster(clip, table.stepover_mm * MM, table.lead_mm * MM, smooth), clip
            except InputError as failure:
                raise InputError(f"{where}: {failure}") from failure
    raise InputError(f"{where}: path.pattern: not known to the reader")


def _spiral(table: SpiralTable, boundary: Boundary | None, where: str) -> PiecewiseCurve:
    if (table.turns is None) == (table.stepover_mm is None):
        raise InputError(f"{where}: path.turns: give turns or stepover_mm, one of them")
    whole = 2 * boundary.circumradius() if boundary else None
    diameter = table.diameter_mm * MM if table.diameter_mm is not None else whole
    if diameter is None:
        raise InputError(f"{where}: path.diameter_mm: missing; give it, or a [boundary]")
    if whole is not None and diameter < whole * (1 - 1e-9):
        raise InputError(
            f"{where}: path.diameter_mm: {diameter / MM:g} conflicts with [boundary], whose circumscribed circle is "
            f"{whole / MM:g} mm; remove one or make the spiral larger"
        )
    turns = table.turns if table.turns is not None else diameter / 2 / ((table.stepover_mm or 1.0) * MM)
    if turns > MAX_SWEEPS:
        raise InputError(f"{where}: path.stepover_mm: over {MAX_SWEEPS:.0f} turns; make it larger")
    return patterns.spiral(diameter, turns)


def surface_from_table(table: SurfaceTable, pattern: PatternTable, where: str) -> surfaces.Quadric:
    """What the path lies on.

    Raises:
        InputError: Numbers that miss, or that a plane has none of.
    """
    origin = np.array([pattern.x_mm, pattern.y_mm, pattern.z_mm]) * MM
    numbers = {k: getattr(table, k) for k in ("radius_of_curvature_m", "conic_constant", "off_axis_m")}
    if table.kind == "plane":
        for key, value in numbers.items():
            if value is not None:
                raise InputError(f"{where}: surface.{key}: a plane has none; set surface.kind = 'conic' or remove it")
        return surfaces.plane(origin)
    for key, value in numbers.items():
        if value is None:
            raise InputError(f"{where}: surface.{key}: missing; a conic needs it")
    try:
        return surfaces.conic(origin, *(float(v or 0.0) for v in numbers.values()))
    except InputError as failure:
        raise InputError(f"{where}: {failure}") from failure
