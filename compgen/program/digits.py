"""What the digits of a program say: poses in mm and degrees, of three decimals or up to six, and speeds."""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, IntArray, frozen
from compgen.core.decimals import DECIMALS, fits_fixed
from compgen.core.evaluation import BLOCK, parallel_for
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.rotations import fill_rotation_matrices, to_wpr
from compgen.core.unique_rows import unique_rows
from compgen.core.units import DEG, MM
from compgen.program.program import Program
from compgen.program.speeds import writable_speed


def pose_units(position: Array, angles: tuple[Array, Array, Array], rows: slice, decimals: int) -> IntArray:
    """X Y Z and W P R of some rows as printed, in units of the last digit, (6, n).

    Raises:
        InputError: A value too large for the format.
    """
    numbers = np.empty((6, len(position[rows])))
    np.divide(position[rows].T, MM, out=numbers[:3])
    for number, angle in zip(numbers[3:], angles, strict=True):
        np.divide(angle[rows], DEG, out=number)
    numbers *= 10.0**decimals
    np.rint(numbers, out=numbers)
    angle = numbers[3:]
    angle[angle == -180 * 10.0**decimals] *= -1  # the same turn: noise must not choose between two texts
    if not fits_fixed(numbers, decimals):
        raise InputError("program: a position is beyond what nine characters hold (9999 mm) or not a number")
    return numbers.astype(np.int64 if decimals > DECIMALS else np.int32)


def pose_numbers(position: Array, rotation: Array, decimals: int = DECIMALS) -> Array:
    """X Y Z [mm] and W P R [deg] as printed, (N, 6); no negative zero.

    Raises:
        InputError: A value too large for the format.
    """
    return numbers_of(pose_units(position, to_wpr(rotation), slice(None), decimals), decimals).T


def numbers_of(units: IntArray, decimals: int) -> Array:
    """The numbers that units of the last digit say; they are the nearest to what is printed."""
    return np.asarray(units / 10.0**decimals)


def printed_poses(pose: Pose, decimals: int = DECIMALS) -> Pose:
    """The poses that the text of N poses says.

    Raises:
        InputError: A value too large for the format.
    """
    angles = to_wpr(pose.rotation)
    position, rotation = np.empty((len(pose), 3)), np.empty((len(pose), 3, 3))

    def part(start: int, stop: int) -> None:
        for at in range(start, stop, BLOCK):
            rows = slice(at, min(at + BLOCK, stop))
            fill_poses(pose_units(pose.position, angles, rows, decimals), decimals, position[rows], rotation[rows])

    parallel_for(len(pose), part)
    return Pose(frozen(position), frozen(rotation))


def fill_poses(units: IntArray, decimals: int, position: Array, rotation: Array) -> None:
    """Positions (n, 3) [m] and rotations (n, 3, 3) that units of the last digit (6, n) say."""
    numbers = numbers_of(units, decimals)
    np.multiply(numbers[:3], MM, out=position.T)
    fill_rotation_matrices([_cosine_and_sine(angle, decimals) for angle in units[3:]], rotation.reshape(-1, 9))


def _cosine_and_sine(units: IntArray, decimals: int) -> tuple[Array, Array]:
    """Of angles in units of the last digit, (n,) each; poses next to each other mostly share theirs."""
    size = np.abs(units)
    low, high = int(size.min()), int(size.max())
    if 2 * (high - low) >= len(size):
        angle = numbers_of(units, decimals) * DEG
        return np.cos(angle), np.sin(angle)
    angle = numbers_of(np.arange(low, high + 1), decimals) * DEG
    size -= low
    sine = np.sin(angle).take(size)
    return np.cos(angle).take(size), np.where(units < 0, -sine, sine)


def resolution(decimals: int) -> tuple[float, float]:
    """Between two numbers of a position that the text can say: coordinates [m] and angles [rad]."""
    return MM / 10**decimals, DEG / 10**decimals


def as_written(program: Program, printed: Pose | None = None) -> Program:
    """The program that its own text says: what ``interpret(compose(program))`` gives, without the text.

    Args:
        program: Any.
        printed: Its ``printed_poses``, where they are known.
    """
    if printed is None:
        printed = printed_poses(Pose(program.position, program.rotation), program.decimals)
    rows, which = unique_rows(program.speed)
    speeds = np.array([writable_speed(v) for v in program.speed[rows].tolist()])
    return replace(program, position=printed.position, rotation=printed.rotation, speed=frozen(speeds[which]))
