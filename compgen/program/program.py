"""What a program means: poses in SI, and the motion that leads to each; of one that touches spheres, its positions."""

import re
from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from compgen.core.arcs import segment_lengths
from compgen.core.arrays import Array, BoolArray, IntArray, own
from compgen.core.pose import Pose
from compgen.robot.configuration import config_letters
from compgen.robot.inverse_kinematics import Posture

REMARK_LENGTH = 32  # characters
DRY = "_DRY"  # behind the name of a dry run
_FIGURES = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Program:
    """N positions in user frame ``uframe`` and tool ``utool``, driven in order.

    The first is reached by a joint motion, the others by straight lines, or three at a time by a circular motion: where
    position n is a ``via`` the tool drives the arc from n - 1 through n to n + 1, in one statement at one speed.
    """

    name: str
    comment: str
    date: str  # "YY-MM-DD"
    remarks: tuple[str, ...]
    uframe: int
    utool: int
    position: Array  # (N, 3) [m]
    rotation: Array  # (N, 3, 3)
    posture: Posture
    turns: IntArray  # (N, 3) the three digits of CONFIG
    speed: Array  # (N - 1,) [m/s] of the line or arc that leads to position n + 1
    fine: BoolArray  # (N,) stops there
    decimals: int = 3  # of each number, 3 to 6
    payload: int | None = None  # PAYLOAD[n]; None: as the controller has it
    acc: int | None = None  # [%] ACC of every motion; None: not said, 100
    via: BoolArray = None  # type: ignore[assignment]  # (N,) the middle of an arc; nowhere where it is not given

    def __post_init__(self) -> None:
        if self.via is None:
            object.__setattr__(self, "via", np.zeros(len(self.position), dtype=bool))
        own(self, position=("N", 3), rotation=("N", 3, 3), turns=("N", 3), speed=("S",), fine=("N",), via=("N",))

    def lengths(self) -> Array:
        """Of the lines, and of each arc's two parts, (N - 1,) [m]."""
        return segment_lengths(self.position, self.via)


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


def program_name(text: str, length: int) -> str:
    """A name the controller takes: capitals, digits and _, a letter first, no longer than ``length``.

    A text that loses letters or digits, being too long or of another alphabet, ends in three figures of its hash:
    two texts that differ there only do not become one program.
    """
    name = re.sub(r"[^A-Z0-9_]", "_", text.upper())
    name = (name if name[:1].isalpha() else f"P{name}").rstrip("_") or "P"
    if len(name) <= length and not any(c.isalnum() and not c.isascii() for c in text.upper()):
        return name
    number = int(sha256(text.encode(errors="surrogatepass")).hexdigest(), 16)
    figures = "".join(_FIGURES[number // 36**k % 36] for k in range(3))
    return f"{name[: length - 4].rstrip('_')}_{figures}"


def dry_name(name: str, length: int) -> str:
    """The name of a program's dry run, of at most so many characters."""
    return f"{name[: length - len(DRY)]}{DRY}"
