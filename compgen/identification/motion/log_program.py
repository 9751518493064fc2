r"""A program whose log tells how a controller smooths: to and fro, corners, a curve, and lines of broken periods.

All figures stand around a centre c, of size s, in the plane of World's x and y and upright in that of x and z:

    to and fro   a straight way between two stops (FINE), at two speeds: its ramps are the filters' sum
    squares      corners at CNT100, flat and upright, at two speeds: they part two filters, and joints from Cartesian;
                 in lines as short as a job's, some runs begun with one of them and some with a whole way across
    circle       in quarter arcs: its pull is v^2 sigma^2 / (2 R), R = s / 2
    short lines  each 3.15 interpolation periods long: rounded up they take 4, and the speed falls by 21 %
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array
from compgen.core.pose import Pose
from compgen.program.program import Program
from compgen.robot.configuration import turn_digits
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.joint_path import follow_branch
from compgen.robot.robot import Robot

DOWN = np.diag([1.0, -1.0, -1.0])  # the flange looks down
POSTURE = Posture()
ROUNDS = 2  # of each square at full speed, for each way to begin, and of the way to and fro
SLOW_ROUNDS = 1  # at half of it
CIRCLES = 3
BROKEN = 3.15  # periods of a short line
SIDE_LINE = 9.9  # periods of a line of a square's sides at most: shorter than all filters that were seen
LONGEST = 0.65  # [s] of both filters, that sides leave room for
SQUARE = ((0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5), (0.5, 0.5), (0.5, 0.0))  # from (0.5, 0) on
REMARKS = ("log positions while this runs:", "cgen identify-motion reads them", "UTOOL 0, UFRAME 0: free space?")


class _Position(NamedTuple):
    """A position in sizes from the centre, the speed to it, whether it stops, and whether it is a via."""

    place: tuple[float, float, float]
    speed: float
    fine: bool
    via: bool


def _run(places: Sequence[tuple[float, float, float]], speed: float, *, arcs: bool = False) -> list[_Position]:
    """To places one after the other without a stop but at the last; of arcs every second one is the end."""
    return [_Position(place, speed, n == len(places), arcs and n % 2 == 1) for n, place in enumerate(places, 1)]


def _square(rounds: int, line: float) -> list[tuple[float, float]]:
    """The ends of lines round a square from (0.5, 0) on, in sizes, all alike and of a length at most."""
    x, y, ends = 0.5, 0.0, list[tuple[float, float]]()
    for corner in SQUARE * rounds:
        count = int(np.ceil(0.5 / line)) * round(2 * max(abs(corner[0] - x), abs(corner[1] - y)))
        shares = (np.arange(1, count + 1) / count).tolist()
        ends += [(x + share * (corner[0] - x), y + share * (corner[1] - y)) for share in shares]
        x, y = corner
    return ends


def least_size(speed: float) -> float:
    """The smallest size whose sides are longer than what two filters reach at a speed [m]."""
    return 2 * speed * LONGEST


def motion_log_program(robot: Robot, name: str, date: str, centre: Array, size: float, speed: float) -> Program:
    """The program, in World and of the flange, which looks down.

    Args:
        robot: Its arm and interpolation period.
        name: As the controller takes it.
        date: "YY-MM-DD".
        centre: Of the figures in World, (3,) [m].
        size: Of each [m], ``least_size`` or more.
        speed: The higher one [m/s].

    Raises:
        ImpossibleError: The robot cannot drive it; names the position.
    """
    over, back = (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0)
    way = _run([back], speed)  # begins there: no move has this speed
    for driven, rounds in ((speed, ROUNDS), (speed / 2, SLOW_ROUNDS)):
        way += (_run([over], driven) + _run([back], driven)) * rounds
        round_it = _square(rounds, SIDE_LINE * robot.controller.period * speed / size)
        for square in ([(x, y, 0.0) for x, y in round_it], [(x, 0.0, z) for x, z in round_it]):
            way += _run([over, *square], driven) + _run(square, driven) + _run([back], driven)
    angle = np.pi - np.arange(1, 8 * CIRCLES + 1) * np.pi / 4
    way += _run([(float(np.cos(a)) / 2, float(np.sin(a)) / 2, 0.0) for a in angle], speed, arcs=True)
    short = BROKEN * robot.controller.period * speed / size
    way += _run([(x, 0.0, 0.0) for x in np.arange(-0.5 + short, 0.5, short).tolist()], speed)
    position = centre + size * np.array([at.place for at in way])
    rotation = np.tile(DOWN, (len(position), 1, 1))
    theta = follow_branch(robot, Pose(position, rotation), POSTURE)
    return Program(
        name=name,
        comment="motion log",
        date=date,
        remarks=REMARKS,
        uframe=0,
        utool=0,
        position=position,
        rotation=rotation,
        posture=POSTURE,
        turns=turn_digits(robot, theta),
        speed=np.array([at.speed for at in way[1:]]),
        fine=np.array([at.fine for at in way]),
        via=np.array([at.via for at in way]),
    )
