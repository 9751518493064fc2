"""The closed form of a path file, walked by the waypoints of an output."""

import numpy as np

from audit import curves, poses
from audit.checks import below, count
from audit.surface import Surface, tool_axes

ON_PATH_UM, EDGE_MM = 0.002, 1e-5
HIGH_MM = 0.2  # to which a lead-in is laid out


class ClosedForm:
    """Where the tool shall be at N waypoints and between them."""

    has_own_feeds = False

    def __init__(self, path, written, leads_in=None):
        """Finds each waypoint on the curve.

        Args:
            path: The path file's tables.
            written: Targets in World as the output has them, (N, 3) [mm].
            leads_in: How the tool really is turned (3, 3) where a lead-in begins: wherever it comes from is taken as
                it is, but for its height; None: the approach is along the tool's axis.

        Raises:
            OffCurveError: They are not a walk along the curve.
        """
        self.frame = poses.of_table(path.get("frame", {}))
        self._spin = np.radians(path.get("tool", {}).get("spin_deg", 0.0))
        self._surface = _surface(path)
        boundary = _boundary(path)
        pieces = curves.with_lift(curves.pattern(path["path"], boundary), path["process"].get("lift_mm", 20.0))
        local = self._surface.local((written - self.frame[0]) @ self.frame[1])
        if leads_in is not None:
            if local[0, 2] < path["process"].get("lift_mm", 20.0) - HIGH_MM:
                raise curves.OffCurveError("the lead-in begins lower than process.lift_mm")
            pieces = [curves.Straight(local[0], pieces[0].b, False), *pieces[1:]]
        self._pieces, self._tilt = pieces, np.zeros(3)
        self._piece, self._span = curves.walk(pieces, local)
        self._written = written
        #: how far waypoints lie inside the part's edge, (N,) [mm]
        if leads_in is not None:
            self._tilt = _gibbs(self._at(self._piece[:1], self._span[:1, 0])[1][0].T @ leads_in)
        self.inside_by = np.full(len(local), np.inf) if boundary is None else boundary.inside(local[:, :2])

    def at_waypoints(self):
        """Poses at N waypoints, in World."""
        first, last = self._at(self._piece, self._span[:, 0]), self._at(self._piece[-1:], self._span[-1:, 1])
        return tuple(np.concatenate(pair) for pair in zip(first, last, strict=True))

    def halfway(self):
        """Poses in the middle of N - 1 segments, in World."""
        t = np.empty(len(self._piece))
        for k in np.unique(self._piece):
            rows = self._piece == k
            t[rows] = curves.middle(self._pieces[k], self._span[rows])
        return self._at(self._piece, t)

    def contact(self):
        """Whether waypoints are on the part, (N,)."""
        working = self._working()
        either = np.concatenate([working[:1], working[:-1] | working[1:], working[-1:]])
        return either & (self.inside_by >= -1e-6)

    def touching(self):
        """Whether the tool touches somewhere on segments, (N - 1,)."""
        contact = self.contact()
        return self._working() & (contact[:-1] | contact[1:])

    def path_checks(self, contact):
        """Whether the waypoints are on the path, and on the part where it says so."""
        off = np.linalg.norm(self.at_waypoints()[0] - self._written, axis=1).max() * 1e3
        edge = np.abs(self.inside_by) < EDGE_MM  # rounding decides there
        return [
            below("waypoints off the closed form, um", off, 0.0, ON_PATH_UM),
            count("waypoints wrongly on or off the part", np.sum((self.contact() != contact) & ~edge)),
        ]

    def flown_checks(self, _there, _between, _left_um):
        """None: the errors after are from the path itself."""
        return []

    def unsure_um(self):
        """The path between waypoints is known, (N - 1,) [um]."""
        return np.zeros(len(self._piece))

    def feed(self, process):
        """Wanted of segments, (N - 1,) [mm/s]."""
        return np.full(len(self._piece), process)

    def _working(self):
        return np.array([p.touching for p in self._pieces])[self._piece]

    def _at(self, piece, t):
        xyh = np.empty((len(t), 3))
        for k in np.unique(piece):
            rows = piece == k
            xyh[rows] = self._pieces[k].at(t[rows])
        position, normal = self._surface.point_and_normal(xyh)
        lying = np.where(piece == 0, 1 - t, 0.0)[:, None] * self._tilt
        return poses.in_world(self.frame, position, tool_axes(normal, self._spin) @ _turns(lying))


def _surface(path):
    centre, optic = np.array([path["path"][f"{a}_mm"] for a in "xyz"]), path.get("surface", {})
    if optic.get("kind", "plane") == "plane":
        return Surface(centre)
    return Surface(centre, optic["radius_of_curvature_m"] * 1e3, optic["conic_constant"], optic["off_axis_m"] * 1e3)


def _gibbs(rotation):
    """tan(angle / 2) along the axis of a rotation, (3,)."""
    sine = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return sine / (1 + np.trace(rotation))


def _turns(gibbs):
    """Rotations (M, 3, 3) of Gibbs vectors (M, 3), by Cayley: (I + K) (I - K)^-1."""
    x, y, z = gibbs.T
    zero = 0 * x
    K = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    return (np.eye(3) + K) @ np.linalg.inv(np.eye(3) - K)


def _hexagon(edge):
    """Corners (6, 2) [mm], the first on x."""
    angle = np.arange(6) * np.pi / 3
    return edge["corner_to_corner_mm"] / 2 * np.column_stack([np.cos(angle), np.sin(angle)])


def _rectangle(edge):
    """Corners (4, 2) [mm]."""
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(edge["size_mm"]) / 2


_CORNERS = {"hexagon": _hexagon, "rectangle": _rectangle}


def _boundary(path):
    """The part's edge; a raster without one is clipped to its own circle."""
    edge = path.get("boundary")
    if edge and edge["shape"] != "circle":
        corners = _CORNERS[edge["shape"]](edge)
        return curves.Boundary.polygon(corners, edge.get("rotation_deg", 0.0))
    if edge:
        return curves.Boundary(edge["diameter_mm"] / 2)
    return curves.Boundary(path["path"]["diameter_mm"] / 2) if path["path"]["pattern"] == "raster" else None
