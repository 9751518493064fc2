"""The lengths of an arm by name, and which DH parameter each of them is."""

from typing import Literal

from compgen.robot.robot import Robot

LengthName = Literal["d1", "a1", "a2", "a3", "d4", "d6"]

#: the parameter, and its row from 0
DH_LENGTHS: dict[LengthName, tuple[Literal["a", "d"], int]] = {
    "d1": ("d", 0),
    "a1": ("a", 0),
    "a2": ("a", 1),
    "a3": ("a", 2),
    "d4": ("d", 3),
    "d6": ("d", 5),
}


def dh_length(robot: Robot, name: LengthName) -> float:
    """The nominal length with its sign, negative where the link points against its axis [m]."""
    parameter, row = DH_LENGTHS[name]
    return float((robot.a if parameter == "a" else robot.d)[row])
