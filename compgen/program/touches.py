"""The positions of a program that touches spheres, and the signal that ends a search."""

from dataclasses import dataclass

from compgen.core.arrays import IntArray
from compgen.core.pose import Pose
from compgen.robot.configuration import config_letters
from compgen.robot.inverse_kinematics import Posture


@dataclass(frozen=True, slots=True)
class Signal:
    """What ends a search, and where places are kept."""

    condition: str  # as SKIP CONDITION has it, e.g. "DI[1]=ON"
    register: int  # the first PR[n]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class TouchPositions:
    """The 3 n positions of n touches, in a user frame."""

    name: tuple[str, ...]  # (n,) of the spheres
    begin: int  # above which of them the program begins, from 0
    pose: Pose  # 3 n
    posture: Posture
    turns: IntArray  # (3 n, 3)
    uframe: int
    utool: int
    decimals: int

    def config(self, n: int) -> str:
        """The text of CONFIG at a position, from 0."""
        a, b, c = self.turns[n].tolist()
        return f"{config_letters(self.posture)}, {a}, {b}, {c}"
