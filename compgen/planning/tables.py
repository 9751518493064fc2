"""Tables of a path file for pattern, surface, boundary, process and frame, and the objects made from them."""

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, FiniteFloat

from compgen.core.exceptions import InputError, naming_file
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.toml import Angle, Coordinate, Length, NotNegative, Table
from compgen.core.units import DEG, MM
from compgen.planning import boundaries, patterns, surfaces
from compgen.planning.boundaries import Boundary
from compgen.planning.boundary_schema import BoundaryTable
from compgen.planning.curves import PiecewiseCurve
from compgen.planning.exact_path import ExactPath
from compgen.planning.leaning import leaned
from compgen.planning.own_points.tables import MeshTable, OwnPoints
from compgen.robot.tables import AccPercent

MAX_SWEEPS = 1e4
ROUNDING = 1e-9  # of sizes that are equal
RIGHT_ANGLE = 90 * DEG
MAX_LEAD = 50.0  # mm
Rise = Annotated[FiniteFloat, Field(ge=-100, le=200)]
Unit = Annotated[FiniteFloat, Field(ge=-1, le=1)]
Three = Annotated[list[NotNegative], Field(min_length=3, max_length=3)]


class PatternTable(Table):
    """What every pattern has: where its centre stands."""

    x_mm: Coordinate
    """Centre of the pattern, x in the frame, else in World."""
    y_mm: Coordinate
    """Centre of the pattern, y in the frame, else in World."""
    z_mm: Coordinate
    """Centre of the pattern, z in the frame, else in World."""


class LineTable(PatternTable):
    """A straight line along an axis of the frame, else of World."""

    pattern: Literal["line"]
    """A straight line along an axis of the frame, else of World."""
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
    """Parallel sweeps, clipped to a circle or to the boundary."""

    pattern: Literal["raster"]
    """Parallel sweeps, along x or at an angle to it."""
    stepover_mm: Length
    """Distance between neighbouring sweeps."""
    diameter_mm: Length | None = None
    """Diameter of the circle that clips the sweeps; without it a boundary must be given."""
    lead_mm: Annotated[FiniteFloat, Field(ge=0, le=MAX_LEAD)] = 5.0
    """How far each sweep runs past the edge; farther where process.lead_in has play to run through."""
    turn: Literal["square", "smooth"] = "square"
    """Way to the next sweep: square stops at both corners, smooth runs on."""
    sweeps: Literal["both ways", "one way"] = "both ways"
    """Whether sweeps go there and back, or all one way, with the tool lifted by process.lift_mm in between."""
    angle_deg: Angle = 0.0
    """Turn of the sweeps about z."""
    cross_hatch: bool = False
    """A second raster across the first one, in the same program."""


class Iso9283Table(PatternTable):
    """Test path after ISO 9283: lines, circles and corners in a square plane."""

    pattern: Literal["iso9283"]
    """Test path after ISO 9283: lines, circles and corners in a square plane."""
    size_mm: Length
    """Side of the square."""


Shape = LineTable | CircleTable | SpiralTable | RasterTable | Iso9283Table
AnyPattern = Annotated[Shape | OwnPoints, Field(discriminator="pattern")]


class SurfaceTable(MeshTable):
    """The surface that the path lies on."""

    kind: Literal["plane", "conic", "stl"] = "plane"
    """Horizontal plane, concave conic with its local x pointing away from the parent's axis, or a mesh of triangles."""
    radius_of_curvature_m: Annotated[FiniteFloat, Field(ge=0.1, le=1e6)] | None = None
    """Vertex radius of curvature of the parent conic; a conic needs it."""
    conic_constant: Annotated[FiniteFloat, Field(ge=-1e3, le=1e3)] | None = None
    """Conic constant: 0 sphere, -1 paraboloid; a conic needs it."""
    off_axis_m: Annotated[FiniteFloat, Field(ge=0, le=1e4)] | None = None
    """Distance of the pattern's centre from the parent's axis; a conic needs it."""


class ProcessTable(Table):
    """Feed, and how the path is cut into waypoints."""

    feed_mm_s: Annotated[FiniteFloat, Field(ge=0.05, le=2000)]
    """Speed of the tool centre point along the path."""
    chord_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] = 1.5
    """Largest distance between the path and the line from one waypoint to the next."""
    spacing_mm: Annotated[FiniteFloat, Field(ge=1e-3, le=10)] = 10.0
    """Largest distance between two waypoints."""
    moves: Literal["lines", "arcs"] = "lines"
    """Whether the program says the path in lines alone, or in circular motions (C) where it curves."""
    thin_um: Annotated[FiniteFloat, Field(ge=0.01, le=1000)] | None = None
    """Leaves waypoints out of the program while lines stay this near the path; with arcs in place of chord_um."""
    lift_mm: Annotated[FiniteFloat, Field(ge=0, le=1e4)] = 20.0
    """Length of approach and retract along the tool axis."""
    lead_in: bool | None = None
    """Approach on a line that turns every joint through its play; default on for a robot with play."""
    lead_deg: Annotated[FiniteFloat, Field(ge=-60, le=60)] = 0.0
    """Angle by which the tool leans ahead of the surface's normal, along the feed; below 0: it trails."""
    lean_deg: Annotated[FiniteFloat, Field(ge=-60, le=60)] = 0.0
    """Angle by which the tool leans to the left of the way, across the feed."""
    acc_percent: AccPercent | None = None
    """ACC of every motion: the share of the robot's accelerations that ramps use; default the robot file's."""
    page_stops: Literal["off the part", "anywhere"] = "off the part"
    """Where the robot may stop when a long program is split into pages."""


def pattern_from_table(
    table: Shape, boundary: Boundary | None, file: str, lift: float
) -> tuple[PiecewiseCurve, Boundary]:
    """The pattern's pieces and the edge that marks contact.

    Args:
        table: The pattern's.
        boundary: Of the part, where one is given.
        file: The path file.
        lift: Height at which the tool goes over the part [m].

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
            return _raster(table, boundary, file, lift)


def _raster(table: RasterTable, boundary: Boundary | None, file: str, lift: float) -> tuple[PiecewiseCurve, Boundary]:
    if boundary is not None and table.diameter_mm is not None:
        raise InputError(f"{file}: path.diameter_mm: conflicts with [boundary]; remove one")
    clip = boundary
    if clip is None:
        if table.diameter_mm is None:
            raise InputError(f"{file}: path.diameter_mm: missing; give it, or a [boundary]")
        clip = boundaries.round_part(table.diameter_mm * MM)
    if table.sweeps == "one way" and table.turn == "smooth":
        raise InputError(f"{file}: path.turn: sweeps that go one way have no turns; remove it, or path.sweeps")

    def sweeps_at(angle: float) -> PiecewiseCurve:
        part = clip.turned(-angle) if angle else clip
        low, high = part.y_range()
        if (high - low) / (table.stepover_mm * MM) > MAX_SWEEPS:
            raise InputError(f"path.stepover_mm: over {MAX_SWEEPS:.0f} sweeps; make it larger")
        step, lead = table.stepover_mm * MM, table.lead_mm * MM
        if table.sweeps == "one way":
            sweeps = patterns.one_way_raster(part, step, lead, lift)
        else:
            sweeps = patterns.raster(part, step, lead, smooth=table.turn == "smooth")
        return sweeps.turned(angle) if angle else sweeps

    angle = table.angle_deg * DEG
    with naming_file(file):
        first = sweeps_at(angle)
        if not table.cross_hatch:
            return first, clip
        return patterns.cross_hatch(first, sweeps_at(angle + RIGHT_ANGLE), lift), clip


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


def pattern_findings(table: Shape, edge: Boundary, boundary: BoundaryTable | None) -> tuple[Finding, ...]:
    """Where sweeps or turns lie further apart than the part is wide, or run on over holes; ``edge`` marks contact."""
    return (*_crossed_holes(boundary), *_questioned_stepover(table, edge))


def _crossed_holes(boundary: BoundaryTable | None) -> Iterator[Finding]:
    if boundary is not None and boundary.holes:
        count = len(boundary.holes)
        yield Finding.of(
            Code.PATH_HOLES,
            f"boundary.holes: over {'a hole' if count == 1 else f'{count} holes'} the tool runs on at the part's "
            "height and feed, out of contact; where it may not, give your own points",
        )


def _questioned_stepover(table: Shape, edge: Boundary) -> Iterator[Finding]:
    if not isinstance(table, RasterTable | SpiralTable) or table.stepover_mm is None:
        return
    if isinstance(table, SpiralTable):
        kind, wide = "turn", table.diameter_mm / 2 if table.diameter_mm else edge.circumradius() / MM
    else:
        angles = [table.angle_deg * DEG + quarter for quarter in (0.0, RIGHT_ANGLE)[: 1 + table.cross_hatch]]
        low, high = np.transpose([edge.turned(-angle).y_range() for angle in angles])
        kind, wide = "sweep", float((high - low).min()) / MM
    if table.stepover_mm > wide * (1 + ROUNDING):
        yield Finding.of(
            Code.PATH_STEPOVER,
            f"path.stepover_mm: {table.stepover_mm:g} is more than the part is wide there ({wide:.4g} mm): between "
            f"two {kind}s some of the part is left out; make it smaller, or mend the part's size",
        )


def leaning_pattern(table: ProcessTable, path: ExactPath, file: str, *, standing: bool = False) -> PiecewiseCurve:
    """The pattern of a path with the tool leaning as the process says; ``standing``: its points say how it stands.

    Raises:
        InputError: As ``leaned`` says, or angles for points that say how the tool stands.
    """
    if not (table.lead_deg or table.lean_deg):
        return path.curve
    if standing:
        raise InputError(f"{file}: process.lead_deg: your own points say how the tool stands; put it into them")
    with naming_file(file):
        return leaned(path, table.lead_deg * DEG, table.lean_deg * DEG)


def surface_from_table(table: SurfaceTable, pattern: AnyPattern, file: str) -> surfaces.Quadric:
    """The surface that the path lies on.

    Raises:
        InputError: Numbers that miss, or that a plane has none of.
    """
    origin = np.array([pattern.x_mm, pattern.y_mm, pattern.z_mm]) * MM
    numbers = {k: getattr(table, k) for k in ("radius_of_curvature_m", "conic_constant", "off_axis_m")}
    for kind, keys in (("conic", numbers), ("stl", MeshTable.model_fields)):
        for key in keys if table.kind != kind else ():
            if getattr(table, key) is not None:
                raise InputError(
                    f"{file}: surface.{key}: a {table.kind} has none; set surface.kind = '{kind}' or remove it"
                )
    if table.kind == "stl":  # a pattern's curve has the mesh's heights, and so have points of the user's own
        return surfaces.plane(origin if isinstance(pattern, OwnPoints) else np.zeros(3))
    if table.kind == "plane":
        return surfaces.plane(origin)
    for key, value in numbers.items():
        if value is None:
            raise InputError(f"{file}: surface.{key}: missing; a conic needs it")
    with naming_file(file):
        return surfaces.conic(origin, *(float(v or 0.0) for v in numbers.values()))


class TaughtTouchTable(Table):
    """A touch by which a frame was taught."""

    joints_deg: Annotated[list[Coordinate], Field(min_length=6, max_length=6)]
    """Pendant angles at which the probe touched."""
    noise_um: Length
    """Standard deviation of one coordinate: the touch's, and of what touches of one sphere share."""
    probing: Annotated[list[Unit], Field(min_length=3, max_length=3)] | None = None
    """Unit vector in World in which the probe moved; left out: the sphere's centre was located."""
    direction: Annotated[list[Unit], Field(min_length=6, max_length=6)] = [0.0] * 6
    """Sides from which the joints came, -1 to 1; 0: not known."""


class TaughtTable(Table):
    """How a frame was taught: by which arm, how warm it was, and how well its place is known."""

    through: Literal["model", "pendant"]
    """By the robot file's model of the warm arm (cgen teach-frame), or as the pendant shows positions."""
    robot_file: str = ""
    """Name and hash of the robot file whose model it was."""
    rise_K: dict[str, Rise] = {}
    """Largest rise of each node of the arm while it was taught; none: cold."""
    sigma_um: Three = [0.0, 0.0, 0.0]
    """Standard deviation of the part's place along World's axes, in the middle of what was touched, by that probe."""
    sigma_mdeg: Three = [0.0, 0.0, 0.0]
    """Standard deviation of the part's orientation about World's axes."""
    probe_mm: Annotated[list[Coordinate], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]
    """The probe in the flange, as the touches say."""
    touches: list[TaughtTouchTable] = []
    """What touched: with them the band knows what the frame has taken up of the robot's errors."""


class FrameTable(Table):
    """Frame that the part stands in: the path is given in it, and the program is written in this user frame."""

    number: Annotated[int, Field(ge=1, le=9)] | None = None
    """UFRAME number on the controller; default 1, or the file's."""
    file: str | None = None
    """File beside this one with the frame, instead of numbers: of cgen teach-frame, or SYSFRAME.VA."""
    x_mm: Coordinate = 0.0
    """Origin in World, x."""
    y_mm: Coordinate = 0.0
    """Origin in World, y."""
    z_mm: Coordinate = 0.0
    """Origin in World, z."""
    w_deg: Angle = 0.0
    """Rotation about World's x."""
    p_deg: Angle = 0.0
    """Rotation about World's y."""
    r_deg: Angle = 0.0
    """Rotation about World's z."""
    taught: TaughtTable | None = None
    """How it was taught."""


class TaughtToolTable(Table):
    """Tool that a frame was taught with: the probe's centre in the flange."""

    x_mm: Coordinate
    """Place in the flange, x."""
    y_mm: Coordinate
    """Place in the flange, y."""
    z_mm: Coordinate
    """Place in the flange, z."""
    sigma_um: Three = [0.0, 0.0, 0.0]
    """Its standard deviation."""


class FrameFile(Table):
    """What cgen teach-frame writes."""

    frame: FrameTable
    tool: TaughtToolTable | None = None
    """Probe that touched, as the touches say."""
