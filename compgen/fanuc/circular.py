"""Which arcs a program can say: a circular motion is one statement through three positions, at one speed.

    9:C P[4]
     :  P[5] 100mm/sec CNT100    ;

drives from where the tool is through the via P[4] to P[5]. A controller stops at an arc of more than half a turn
("circle angle too large") and at three positions that determine no circle.
"""

from collections.abc import Callable

import numpy as np

from compgen.core.arcs import arcs_through
from compgen.core.arrays import BoolArray, norm
from compgen.core.exceptions import InputError
from compgen.core.units import DEG, MM
from compgen.program.program import Program

LARGEST = np.pi + 1e-9  # rad; "max 180 degrees between the three points" (users of the controller, none of its makers)


def check_circles(program: Program, place: Callable[[int], str] = lambda n: "") -> None:
    """Refuse arcs that a controller could not drive.

    Args:
        program: Any.
        place: The words for where the statement with the via P[n] stands, "line 12: " for instance.

    Raises:
        InputError: A via without start or end, at a stop, beside another via, doubled or in line with its neighbours;
            an arc of over 180 deg, of two speeds or of two turns of CONFIG. Names the via.
    """
    via = np.flatnonzero(program.via)
    if not len(via):
        return
    N = len(program.position)

    def refuse(bad: BoolArray, words: Callable[[int], str]) -> None:
        if bad.any():
            k = int(np.argmax(bad))
            n = int(via[k]) + 1
            raise InputError(f"program: {place(n)}P[{n}] {words(k)}")

    refuse((via == 0) | (via == N - 1), lambda k: "is the via of an arc without start or end")
    refuse(program.via[via + 1], lambda k: "is a via, and so is the next position: an arc has one")
    refuse(program.fine[via], lambda k: "is the via of an arc: the robot cannot stop there")
    refuse(program.speed[via] != program.speed[via - 1], lambda k: "is the via of an arc that has two speeds")
    a, b, c = (program.position[via + k] for k in (-1, 0, 1))
    least = MM / 10**program.decimals
    chord = norm(c - a)
    refuse((norm(b - a) < least) | (norm(c - b) < least), lambda k: "is the via of an arc and its start or end as well")
    refuse(chord < least, lambda k: "is the via of an arc that ends where it began: drive a full circle in two arcs")
    height = norm(np.cross(b - a, c - a)) / np.maximum(chord, least)
    refuse(
        height < least,
        lambda k: (
            f"is the via of an arc, {height[k] / MM:.4f} mm beside the line from its start to its end: no circle; use L"
        ),
    )
    swept = arcs_through(a, b, c).angle[:, 1]
    refuse(swept > LARGEST, lambda k: f"is the via of an arc of {swept[k] / DEG:.1f} deg, more than 180; part it")
    turns = program.turns
    refuse(
        (turns[via] != turns[via - 1]).any(axis=1) | (turns[via] != turns[via + 1]).any(axis=1),
        lambda k: "is the via of an arc whose positions differ in CONFIG's turns; use L there",
    )
