"""The kinds of offset that an operator can type in, and what each leaves."""

from dataclasses import dataclass

import numpy as np

from compgen.compensation.rigid_offset import best_frame, register_shift, register_turn
from compgen.core.arrays import Array
from compgen.core.codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import Pose

NOTHING = "nothing"
SHIFT = "PR offset X Y Z"
REGISTER = "PR offset X Y Z W P R"
FRAME = "user frame"
FULL = "full correction"
USELESS = 0.95  # of what nothing leaves


@dataclass(frozen=True, slots=True)
class Left:
    """What is left of a path on the part."""

    rms: float  # [m]
    p99: float  # [m]
    largest: float  # [m]
    turn: float  # [rad] largest, of the tool


@dataclass(frozen=True, eq=False, slots=True)
class Offset:
    """What an operator types in, and what it leaves."""

    kind: str
    numbers: Array | None  # X Y Z [mm], W P R [deg]; None: nothing is typed
    left: Left


@dataclass(frozen=True, eq=False, slots=True)
class Offsets:
    """All ways of doing with a program what a state asks for."""

    name: str
    uframe: int  # of the program's positions
    frame: Array  # X Y Z [mm], W P R [deg] of it as it is
    ways: tuple[Offset, ...]  # nothing, the three offsets, the correction
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False, slots=True)
class Errors:
    """Where M points of a program are, and how it errs there, in its user frame."""

    position: Array  # (M, 3) [m] programmed
    rotation: Array  # (M, 3, 3) programmed
    error: Array  # (M, 3) [m] actual less target
    turn: Array  # (M, 3) [rad] rotation vector, in the frame's axes
    weight: Array  # (M,) length on the part that each stands for


def best_offsets(errors: Errors, uframe: Pose) -> list[tuple[str, Array]]:
    """What to type in: of each kind its numbers, X Y Z [mm] and W P R [deg]."""
    shift = register_shift(errors.error, errors.weight)
    turn = register_turn(errors.turn, errors.rotation, errors.weight)
    frame = best_frame(uframe, errors.position, errors.error, errors.weight)
    return [(SHIFT, np.append(shift, np.zeros(3))), (REGISTER, np.append(shift, turn)), (FRAME, frame)]


def offset_findings(uframe: int, ways: tuple[Offset, ...]) -> list[Finding]:
    """What an operator must know before typing in."""
    findings = []
    if uframe == 0:
        message = (
            "the positions are in World (UFRAME 0), which takes no numbers: for the user frame teach them in a frame "
            "of their own, or use the position register"
        )
        findings.append(Finding(Level.NOTE, Code.OFFSETS_WORLD, message))
    nothing = ways[0].left.rms
    useless = [way.kind for way in ways[1:-1] if way.left.rms > USELESS * nothing]
    if useless:
        message = f"{', '.join(useless)}: leaves no less than nothing does: what errs is not one shift"
        findings.append(Finding(Level.WARNING, Code.OFFSETS_USELESS, message))
    return findings
