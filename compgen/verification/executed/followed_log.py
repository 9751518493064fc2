r"""A log followed along a course: its positions in World, and what is wrong with them where they do not fit.

A log is taken as it says. Where it does not fit the course, it is tried in other units and frames, and last as the same
shape anywhere: what fits then is named, and nothing is judged.

A nearest point shows of a constant offset d, of a user frame or of a tool, only what is square to the path,
off = (I - t t^T) d, or (I - t t^T) R d where it is constant in the tool's axes R. Over rows with several directions of
travel least squares give all of d.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, NoReturn

import numpy as np

from compgen.core.arrays import Array, IntArray, dot, frozen, owns, rms, thinned
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_vector
from compgen.core.units import DEG, INCH, MM
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.executed.position_log import PositionLog
from compgen.verification.executed.tracking import (
    SAME_WAY,
    Projection,
    Track,
    fits,
    follow,
    project,
    rising,
    travelled_way,
)

TURNED = 2 * DEG  # orientations that are farther off are of another unit or tool: corrections are clamped at 0.5
SHAPE_ROWS = 2000  # rows or marks that shapes are compared at
WIDE = 20e-3  # [m] off the course, while a shape is brought to it
SHAPE = 2e-3  # [m] rms at which another place is the same shape
SHAPE_TURNED = 0.02 * DEG  # of a shape that is more than moved
STRAIGHT = 1e-6  # of a shape's length: what is thinner is a straight line
SHOWN_DIGITS = 6  # of an offset [m]: the micrometre
SHOWN = 1e-3  # of the rows: an offset of which the path shows less is not known
LEAST_WAY = 1e-3  # [m] that a robot has moved which runs a program
WHOLLY = 0.995  # of a log on the path, that would be said as 100 %
SEVERAL = 400  # rows that orientations and shapes are compared at


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("M",), position=("M", 3), travelled=("M",))
class FollowedLog:
    """M rows of a log along a course."""

    log: PositionLog
    time: Array  # (M,) [s]
    position: Array  # (M, 3) [m] of the TCP in World
    travelled: Array  # (M,) [m]
    track: Track
    projection: Projection


def follow_log(log: PositionLog, course: ProgramCourse, robot: Robot, *, world: bool) -> FollowedLog:
    """Follow a log along a course.

    Args:
        log: As read.
        course: Of the program.
        robot: Whose joints.
        world: Whether Cartesian positions are in World; else in the user frame that the program runs in.

    Raises:
        InputError: The log is not of this course: another program, other units, another frame or tool.
    """
    readings = _readings(log, course, robot, world=world)
    followed = _followed(log, course, readings[0].position())
    if followed is None:
        _refuse(log, course, readings)
    _check_orientation(course, followed, robot, world=world)
    return followed


def _followed(log: PositionLog, course: ProgramCourse, position: Array) -> FollowedLog | None:
    """A log at positions in World that fit; None where they do not."""
    travelled = travelled_way(position, row_noise(position))
    if travelled[-1] - travelled[0] < LEAST_WAY:
        return None
    track = follow(course, position, travelled)
    if not fits(course, track):
        return None
    return FollowedLog(
        log=log,
        time=log.time,
        position=frozen(position),
        travelled=frozen(travelled),
        track=track,
        projection=project(course, position, travelled, track),
    )


def row_noise(values: Array) -> float:
    """How much rows (M, k) scatter from one to the next, one standard deviation [m]: third differences' median."""
    if len(values) < 8:
        return 0.0
    every = max(1, len(values) // 200_000)
    third = np.diff(values[: len(values) // every * every], n=3, axis=0)[::every]
    moving = (np.abs(third) > 0).any(axis=1)
    if not moving.any():
        return 0.0
    return float(np.median([1.4826 * np.median(np.abs(c)) for c in third[moving].T]) / np.sqrt(20))


class LogReading(NamedTuple):
    """What a log's numbers may mean."""

    words: str  # that name it; none of the plain meaning
    position: Callable[[], Array]  # (M, 3) [m] in World


def _readings(log: PositionLog, course: ProgramCourse, robot: Robot, *, world: bool) -> list[LogReading]:
    """What positions may mean, the plain meaning first."""
    if log.is_joints:

        def reached(pendant: Array) -> Array:
            return (flange_pose(robot, robot.to_theta(pendant)) @ course.tool).position

        from_link = "J3 counted against link 2; say --j3 link2, or give the pendant's, against the horizontal"
        return [
            LogReading("", lambda: reached(log.numbers)),
            LogReading("joints in radians; give j1_deg to j6_deg in degrees", lambda: reached(log.numbers / DEG)),
            LogReading(from_link, lambda: reached(log.numbers - log.numbers[:, 1:2] * np.eye(6)[2])),
            LogReading(
                "J3 counted against the horizontal; leave --j3 link2 out",
                lambda: reached(log.numbers + log.numbers[:, 1:2] * np.eye(6)[2]),
            ),
        ]
    number, tool = course.numbers
    inside, as_it_is = course.frame.act, np.asarray
    plain, other = (as_it_is, inside) if world else (inside, as_it_is)
    framed = f"positions in UFRAME {number}; leave --in-world out" if world else "positions in World; say --in-world"
    mend = "give x_mm, y_mm, z_mm in mm"
    of_flange = f"positions of the flange (UTOOL 0); log with UTOOL {tool}, the program's"
    rotation = partial(_rotations, log, course, robot, world=world)
    return [
        LogReading("", lambda: plain(log.place)),
        *([LogReading(framed, lambda: other(log.place))] if number else []),
        LogReading(f"metres, not millimetres; {mend}", lambda: plain(log.place / MM)),
        LogReading(f"inches, not millimetres; {mend}", lambda: plain(log.place * INCH / MM)),
        *([LogReading(of_flange, lambda: (Pose(plain(log.place), rotation()) @ course.tool).position)] if tool else []),
    ]


def _rotations(
    log: PositionLog,
    course: ProgramCourse,
    robot: Robot,
    rows: Any = slice(None),
    factor: float = 1.0,
    *,
    world: bool,
) -> Array:
    """Orientations of a log in World, (m, 3, 3)."""
    if log.is_joints:
        return np.asarray((flange_pose(robot, robot.to_theta(log.numbers[rows])) @ course.tool).rotation)
    rotation = from_wpr(*(factor * log.numbers[rows, 3:]).T)
    return rotation if world else np.asarray(course.frame.rotation @ rotation)


def _refuse(log: PositionLog, course: ProgramCourse, readings: list[LogReading]) -> NoReturn:
    """Raises InputError with what would make a log fit, or that nothing does."""
    source = log.table.source
    others = [(_followed(log, course, reading.position()), reading.words) for reading in readings[1:]]
    fitting = [(followed.track.covered, words) for followed, words in others if followed is not None]
    if fitting:
        raise InputError(f"{source}: columns {log.columns[0]} to {log.columns[-1]}: they fit as {max(fitting)[1]}")
    place = readings[0].position()
    travelled = travelled_way(place, row_noise(place))
    if travelled[-1] - travelled[0] < LEAST_WAY:
        raise InputError(
            f"{source}: the robot moves by {(travelled[-1] - travelled[0]) / MM:.3f} mm in all {len(log.time)} rows; "
            "log while the program runs"
        )
    moved = shape_elsewhere(course, place, travelled)
    if moved is not None:
        raise InputError(f"{source}: {moved_words(moved, course)}{course.places_hint}")
    track = follow(course, place, travelled)
    where = "no row is within 5 mm of it"
    way = float(travelled[-1] - travelled[0])
    if track.share > WHOLLY and track.covered > max(WHOLLY * course.length, SAME_WAY[1] * way):
        shorter = 1 - way / track.covered
        raise InputError(
            f"{source}: the robot travels {100 * shorter:.0f} % less than the program: its lines are too short for "
            "their speed to be told apart; log the program at a lower override, or give the program that ran"
        )
    if track.share > WHOLLY:
        where = "its rows are on the path, and not in the order of the program"
    elif track.on.any():
        first = int(np.argmax(track.on))
        where = (
            f"only {100 * track.share:.0f} % of it follows the path within 5 mm, from line "
            f"{log.table.line[int(log.row[track.row[first]])]}"
        )
    other = "program, or arm (--robot)" if log.is_joints else "program"
    raise InputError(
        f"{source}: it is of another {other}: {where}; give the log of one run of this program, or the program that ran"
        + course.order_hint
        + course.places_hint
    )


def _check_orientation(course: ProgramCourse, followed: FollowedLog, robot: Robot, *, world: bool) -> None:
    """Raises InputError where the tool does not stand as the program has it while its places are the program's."""
    log, track, travelled = followed.log, followed.track, followed.travelled
    on = track.row[track.on]
    on = on[course.judged[course.way(track.arc[track.on])]]
    if not len(on):
        return
    some = on[np.unique(np.linspace(0, len(on) - 1, SEVERAL).astype(int))]
    arc = np.interp(travelled[some], *rising(track.travelled[track.on], track.arc[track.on]))
    meant = course.rotation_at(arc)

    def off(factor: float) -> float:
        turned = _rotations(log, course, robot, some, factor, world=world)
        vector = rotation_vector(np.swapaxes(meant, -1, -2) @ turned)
        return float(np.median(np.sqrt(dot(vector, vector))))

    away = off(1.0)
    if away <= TURNED:
        return
    columns = f"{log.table.source}: columns {'j1_deg' if log.is_joints else 'w_deg'} to {log.columns[-1]}"
    if not log.is_joints and off(1 / DEG) <= TURNED:
        raise InputError(f"{columns}: they fit as radians; give W, P, R in degrees")
    raise InputError(
        f"{columns}: the tool is turned by {away / DEG:.1f} deg against the program all along: another user frame than "
        f"UFRAME {course.numbers[0]}, or another tool than UTOOL {course.numbers[1]}; log with the program's own"
    )


class ConstantOffset(NamedTuple):
    """An offset that is the same in all rows."""

    vector: Array  # (3,) [m]
    explained: float  # share of the squares of all deviation
    in_tool: bool  # constant in the tool's axes, else in World


def constant_offset(course: ProgramCourse, way: IntArray, off: Array) -> ConstantOffset | None:
    """The constant vector that explains most of rows' deviations (m, 3) [m] on ways (m,); None where none is known."""
    t = course.tangents()[way]
    square = np.eye(3) - t[:, :, None] * t[:, None, :]
    total, best = float((off**2).sum()), None
    for in_tool, matrix in ((False, square), (True, square @ course.rotation[way])):
        normal = np.einsum("mij,mik->jk", matrix, matrix)
        if np.linalg.eigvalsh(normal)[0] < SHOWN * len(way):
            continue
        vector = np.linalg.solve(normal, np.einsum("mij,mi->j", matrix, off))
        explained = 1 - float(((off - np.einsum("mij,j->mi", matrix, vector)) ** 2).sum()) / max(total, 1e-30)
        if best is None or explained > best.explained + 1e-6:
            best = ConstantOffset(vector, explained, in_tool)
    return best


def shape_elsewhere(course: ProgramCourse, position: Array, travelled: Array) -> Pose | None:
    """The motion that brings a log of the whole course from where it is to where it belongs, or None.

    Rows and places of the course at the same share of the way are brought together, then places at the same marks,
    then, where nothing is turned, nearest points.
    """
    goal = np.linspace(0.0, 1.0, SHAPE_ROWS)
    share = (travelled - travelled[0]) / max(float(travelled[-1] - travelled[0]), 1e-9)
    rows = np.minimum(np.searchsorted(share, goal), len(position) - 1)
    moved = best_motion(position[rows], course.place(goal * course.length))
    for _ in range(4):
        track = follow(course, moved.act(position), travelled, gate=WIDE)
        if not track.on.any():
            return None
        moved = best_motion(position[track.row[track.on]], course.place(track.arc[track.on]))
    if turn_of(moved) < 10 * SHAPE_TURNED:
        moved = _moved_only(course, position, travelled, moved)
    track = follow(course, moved.act(position), travelled)
    return moved if fits(course, track) and track.share > 0.9 and _rms(track) < SHAPE else None


def _moved_only(course: ProgramCourse, position: Array, travelled: Array, moved: Pose) -> Pose:
    """A motion without a turn, brought to the nearest points; the one given where that is worse."""
    centre = position.mean(axis=0)
    shift = moved.act(centre) - centre
    for _ in range(4):
        track = follow(course, position + shift, travelled, gate=WIDE)
        if not track.on.any():
            return moved
        rows = thinned(track.row[track.on], SHAPE_ROWS)
        beside = project(course, position[rows] + shift, travelled[rows], track)
        offset = constant_offset(course, beside.way, beside.off)
        if offset is None or offset.in_tool:
            break
        shift = shift - offset.vector
    return Pose(shift, np.eye(3)) if _rms(track) <= 2 * _rms(follow(course, moved.act(position), travelled)) else moved


def _rms(track: Track) -> float:
    return rms(track.distance[track.on]) if track.on.any() else np.inf


def best_motion(start: Array, end: Array) -> Pose:
    """The rigid motion that brings points (m, 3) nearest to others, by least squares."""
    a, b = start.mean(axis=0), end.mean(axis=0)
    u, sizes, v = np.linalg.svd((start - a).T @ (end - b))
    sign = np.sign(np.linalg.det(u @ v))
    rotation = (v.T * [1, 1, sign]) @ u.T
    if sizes[1] < STRAIGHT * sizes[0]:
        rotation = np.eye(3)  # a straight line does not tell a turn about itself
    return Pose(b - rotation @ a, rotation)


def turn_of(moved: Pose) -> float:
    """How far a motion turns [rad]."""
    return float(np.linalg.norm(rotation_vector(moved.rotation)))


def moved_words(moved: Pose, course: ProgramCourse) -> str:
    """Where a log is against its course, and what that may come from; ``moved`` brings it there."""
    at = _millimetres(moved.inverse().position)
    where = f"at a constant offset of {at}"
    if turn_of(moved) > SHAPE_TURNED:
        where = f"moved by {at} and turned by {turn_of(moved) / DEG:.3f} deg"
    return f"it has this program's shape, {where} {_in_world(course)}; log with the program's own, or give --frames"


def offset_words(offset: ConstantOffset, course: ProgramCourse) -> str:
    """An offset, and what it may come from."""
    origin = f"in the tool's axes: another tool than UTOOL {course.numbers[1]}" if offset.in_tool else _in_world(course)
    return f"a constant offset of {_millimetres(offset.vector)} {origin}"


def _millimetres(vector: Array) -> str:
    x, y, z = (v / MM + 0.0 for v in np.round(vector, SHOWN_DIGITS).tolist())
    return f"X {x:.3f} Y {y:.3f} Z {z:.3f} mm"


def _in_world(course: ProgramCourse) -> str:
    frame, tool = course.numbers
    return f"in World: another user frame than UFRAME {frame}, or another tool than UTOOL {tool}"
