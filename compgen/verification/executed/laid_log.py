"""A log laid along a course: its positions in World, and what is wrong with them where they do not fit.

A log is taken as it says. Where it does not fit the course, it is tried in other units and frames, and last as the same
shape anywhere: what fits then is named, and nothing is judged.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from compgen.core.arrays import Array, dot, frozen, own
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_vector
from compgen.core.units import DEG, INCH, MM
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot
from compgen.verification.executed.course import Course
from compgen.verification.executed.offset import motion_words, shape_elsewhere
from compgen.verification.executed.position_log import PositionLog
from compgen.verification.executed.projection import Projection, project
from compgen.verification.executed.tracking import Track, fits, follow, travelled_way

TURNED = 10 * DEG  # orientations that are farther off are of another unit or tool
SEVERAL = 400  # rows that orientations and shapes are compared at


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class LaidLog:
    """M rows of a log along a course."""

    log: PositionLog
    time: Array  # (M,) [s]
    position: Array  # (M, 3) [m] of the TCP in World
    travelled: Array  # (M,) [m]
    noise: float  # [m] of one coordinate, from row to row
    track: Track
    projection: Projection

    def __post_init__(self) -> None:
        own(self, time=("M",), position=("M", 3), travelled=("M",))


def lay(log: PositionLog, course: Course, robot: Robot, world: bool) -> LaidLog:
    """Lay a log along a course.

    Args:
        log: As read.
        course: Of the program.
        robot: Whose joints.
        world: Whether Cartesian positions are in World; else in the user frame that the program runs in.

    Raises:
        InputError: The log is not of this course: another program, other units, another frame or tool.
    """
    readings = _readings(log, course, robot, world)
    followed = _followed(course, readings[0][1]())
    if followed is None:
        _refuse(log, course, readings)
    position, travelled, noise, track = followed
    if not log.is_joints:
        _check_orientation(log, course, travelled, track, world)
    return LaidLog(
        log=log,
        time=log.time,
        position=position,
        travelled=travelled,
        noise=noise,
        track=track,
        projection=project(course, position, travelled, track),
    )


_Followed = tuple[Array, Array, float, Track]


def _followed(course: Course, position: Array) -> _Followed | None:
    """Positions, travelled way, noise and track of a log that fits; None where it does not."""
    noise = row_noise(position)
    travelled = travelled_way(position, noise)
    if travelled[-1] - travelled[0] < 1e-3:
        return None
    track = follow(course, position, travelled)
    return (frozen(position), frozen(travelled), noise, track) if fits(course, track) else None


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


_Reading = tuple[str, Callable[[], Array]]


def _readings(log: PositionLog, course: Course, robot: Robot, world: bool) -> list[_Reading]:
    """What positions may mean, the plain meaning first; each with the words that name it."""
    if log.is_joints:

        def reached(pendant: Array) -> Array:
            return (flange_pose(robot, robot.to_theta(pendant)) @ course.tool).position

        from_upper_arm = "J3 counted from J2, a DH angle; give the pendant's J3, against the horizontal"
        return [
            ("", lambda: reached(log.numbers)),
            ("joints in radians; give j1_deg to j6_deg in degrees", lambda: reached(log.numbers / DEG)),
            (from_upper_arm, lambda: reached(log.numbers - log.numbers[:, 1:2] * np.eye(6)[2])),
        ]
    number, tool = course.numbers
    inside, as_it_is = course.frame.act, np.asarray
    plain, other = (as_it_is, inside) if world else (inside, as_it_is)
    readings: list[_Reading] = [("", lambda: plain(log.place))]
    if number:
        words = f"positions in UFRAME {number}; leave --in-world out" if world else "positions in World; say --in-world"
        readings.append((words, lambda: other(log.place)))
    mend = "give x_mm, y_mm, z_mm in mm"
    readings.append((f"metres, not millimetres; {mend}", lambda: plain(log.place / MM)))
    readings.append((f"inches, not millimetres; {mend}", lambda: plain(log.place * INCH / MM)))
    if tool:
        words = f"positions of the flange (UTOOL 0); log with UTOOL {tool}, the program's"
        readings.append(
            (words, lambda: (Pose(plain(log.place), _rotations(log, course, world)) @ course.tool).position)
        )
    return readings


def _rotations(log: PositionLog, course: Course, world: bool, rows: Any = slice(None), factor: float = 1.0) -> Array:
    """Orientations of a Cartesian log in World, (m, 3, 3)."""
    rotation = from_wpr(*(factor * log.numbers[rows, 3:]).T)
    return rotation if world else np.asarray(course.frame.rotation @ rotation)


def _refuse(log: PositionLog, course: Course, readings: list[_Reading]) -> NoReturn:
    """Raises InputError with what would make a log fit, or that nothing does."""
    source = log.table.source
    for words, position in readings[1:]:
        if _followed(course, position()) is not None:
            raise InputError(f"{source}: columns {log.columns[0]} to {log.columns[-1]}: they fit as {words}")
    place = readings[0][1]()
    travelled = travelled_way(place, row_noise(place))
    if travelled[-1] - travelled[0] < 1e-3:
        raise InputError(
            f"{source}: the robot moves by {(travelled[-1] - travelled[0]) / MM:.3f} mm in all {len(log.time)} rows; "
            "log while the program runs"
        )
    moved = shape_elsewhere(course, place, travelled)
    if moved is not None:
        raise InputError(f"{source}: {motion_words(moved, course)}")
    track = follow(course, place, travelled)
    where = "no row is within 5 mm of it"
    if track.on.any():
        first = int(np.argmax(track.on))
        where = (
            f"only {100 * track.share:.0f} % of it follows the path within 5 mm, from line "
            f"{log.table.line[int(log.row[track.row[first]])]}"
        )
    raise InputError(
        f"{source}: it is of another program: {where}; give the log of one run of this program, or the program that ran"
    )


def _check_orientation(log: PositionLog, course: Course, travelled: Array, track: Track, world: bool) -> None:
    """Raises InputError where W, P and R are not those of the program while the places are."""
    on = track.row[track.on]
    some = on[np.unique(np.linspace(0, len(on) - 1, SEVERAL).astype(int))]
    arc = np.interp(travelled[some], *_rising(track.travelled[track.on], track.arc[track.on]))
    meant = course.rotation[course.way(arc)]

    def off(factor: float) -> float:
        turned = _rotations(log, course, world, some, factor)
        vector = rotation_vector(np.swapaxes(meant, -1, -2) @ turned)
        return float(np.median(np.sqrt(dot(vector, vector))))

    away = off(1.0)
    if away <= TURNED:
        return
    columns = f"{log.table.source}: columns w_deg to r_deg"
    if off(1 / DEG) <= TURNED:
        raise InputError(f"{columns}: they fit as radians; give W, P, R in degrees")
    raise InputError(
        f"{columns}: the tool is turned by {away / DEG:.1f} deg against the program all along: another user frame than "
        f"UFRAME {course.numbers[0]}, or another tool than UTOOL {course.numbers[1]}; log with the program's own"
    )


def _rising(x: Array, y: Array) -> tuple[Array, Array]:
    keep = np.append(True, np.diff(x) > 0)
    return x[keep], y[keep]
