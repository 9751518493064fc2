"""Which positions a program names that says its path in arcs and lines, and where the tool goes between them."""

from dataclasses import replace

import numpy as np

from compgen.compensation.arc_fit import DensePath, FittedMoves, fit_moves
from compgen.core.arcs import arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, frozen
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation
from compgen.core.units import MDEG
from compgen.job.job import Process
from compgen.planning.toolpath import ToolPath
from compgen.program.digits import printed_poses, resolution
from compgen.program.page_stops import PageStops, place_page_stops
from compgen.robot.configuration import turn_digits
from compgen.robot.robot import Robot

AXES = 1 * MDEG  # by which the orientation between two positions may be off: a digit of three decimals
SPEED_STEP = 1.1  # a statement has one speed: what it covers differs by no more
LEAST_PERIODS = 10  # between ends of statements that only the speed asks for
WIDER = 2  # waypoints on either side that a slow stretch is taken to be wider
GROWTH = 1.15  # times the positions of the planned path that the corrected one may need


def fit_planned_moves(
    process: Process, robot: Robot, path: ToolPath, commanded: Pose, printed: Pose, theta: Array, speed: Array
) -> FittedMoves:
    """The arcs and lines of a path.

    Args:
        process: Its chord, or what it may be thinned by.
        robot: Its digits and turns.
        path: Of N waypoints.
        commanded: Poses there in World.
        printed: As the text rounds them.
        theta: Joints there, (N, 6) [rad].
        speed: Along the segments, (N - 1,) [m/s].
    """
    digit, _ = resolution(robot.controller.decimals)
    tolerance = process.chord if process.thin is None else process.thin
    dense = DensePath(arc=path.arc, commanded=commanded, printed=printed, digit=digit, chord=tolerance, angle=AXES)
    ends = statement_ends(path, turn_digits(robot, theta))
    return fit_moves(dense, with_changes_of_speed(ends, path.arc, speed, LEAST_PERIODS * robot.controller.period))


def with_changes_of_speed(ends: BoolArray, arc: Array, speed: Array, least: float) -> BoolArray:
    """Ends of statements, and where the speed along the path passes a tenth more or less, or as near as may be.

    Args:
        ends: Given, (N,).
        arc: Of the waypoints, (N,) [m].
        speed: Along the segments, (N - 1,) [m/s].
        least: How long a statement then lasts at least [s].
    """
    level = np.floor(np.log(speed / speed.max()) / np.log(SPEED_STEP) + 1e-6)
    for _ in range(WIDER):  # once corrected, a slow stretch may begin a waypoint sooner
        level = np.minimum(level, np.minimum(np.append(level[1:], level[-1]), np.append(level[0], level[:-1])))
    time = cumulated(np.diff(arc) / speed)
    more = np.array(ends)
    given = np.flatnonzero(ends)
    changes = np.flatnonzero(level[1:] != level[:-1]) + 1
    before = np.searchsorted(given, changes, side="right") - 1
    begin, end = time[given[before]], time[given[np.minimum(before + 1, len(given) - 1)]]
    at = np.clip(time[changes], begin + least, np.maximum(end - least, begin + least))
    last = -np.inf
    for now, start, stop in zip(at.tolist(), begin.tolist(), end.tolist(), strict=True):
        if now - max(last, start) >= least and stop - now >= least:
            more[np.searchsorted(time, now)], last = True, now
    return more


def statement_ends(path: ToolPath, turns: IntArray) -> BoolArray:
    """Where no arc or long line may lead across, (N,): ends of pieces, stops, the part's edge, a turn of CONFIG."""
    ends = path.stop.copy()
    ends[1:-1] |= path.piece[1:] != path.piece[:-1]
    for flag in (path.contact[:, None], turns):
        changes = np.flatnonzero((flag[1:] != flag[:-1]).any(axis=1))
        ends[changes] = ends[changes + 1] = True
    return np.asarray(ends)


def flown_at_waypoints(arc: Array, printed: Pose, moves: FittedMoves) -> Pose:
    """Where the controller commands the tool at the N dense waypoints, by arcs and lines through some of their poses.

    Args:
        arc: Of the waypoints along the path, (N,) [m].
        printed: Their poses as the text would say them.
        moves: The rows that it does say.
    """
    rows, via = moves
    segment = np.clip(np.searchsorted(rows, np.arange(len(arc)), side="right") - 1, 0, len(rows) - 2)
    first, last = rows[segment], rows[segment + 1]
    fraction = (arc - arc[first]) / (arc[last] - arc[first])
    p = printed.position
    position = p[first] + fraction[:, None] * (p[last] - p[first])
    middle = np.flatnonzero(via)
    arcs = arcs_through(*(p[rows[middle + k]] for k in (-1, 0, 1)))
    of_segment = np.full(len(rows) - 1, -1)
    of_segment[middle - 1] = of_segment[middle] = np.arange(len(middle))
    on = np.flatnonzero(of_segment[segment] >= 0)
    position[on] = arcs.on_halves(of_segment[segment[on]], via[segment[on]], fraction[on])
    rotation = interpolate_rotation(printed.rotation[first], printed.rotation[last], fraction)
    return Pose(frozen(position), frozen(rotation))


def page_stops_of_arcs(
    robot: Robot, process: Process, path: ToolPath, theta: Array, feed: float, nodes: int, *, payload: bool
) -> PageStops | None:
    """The stops of a path whose program of arcs and lines is more than one file holds; None for any other.

    Args:
        robot: What its controller holds.
        process: Of the program.
        path: Of N waypoints, uncorrected.
        theta: Its joints, (N, 6) [rad].
        feed: [m/s].
        nodes: How many temperature rises the remarks at the head name.
        payload: Whether the program says its payload.
    """
    printed = printed_poses(path.target, robot.controller.decimals)
    rows, via = fit_planned_moves(process, robot, path, path.target, printed, theta, feed * path.pace)
    some, on_the_part = path.subset(rows, via), process.stop_on_the_part
    stops = place_page_stops(robot, some, theta[rows], nodes, on_the_part=on_the_part, payload=payload, growth=GROWTH)
    if stops is None:
        return None
    stop, added = path.stop.copy(), np.zeros(len(path.arc), dtype=bool)
    stop[rows], added[rows] = stops.stop, stops.added
    return replace(stops, stop=stop, added=added)


def without_period(robot: Robot) -> Robot:
    """A robot whose controller follows segments of any length: what it must follow are statements."""
    return replace(robot, controller=replace(robot.controller, period=1e-9))
