"""Directions of a command that makes up for the play of joints: they are not those of the path itself."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.error_model.source import Source

ROUNDS = 12  # of directions by Dahl
STEEPEST = 0.02  # of a width: what is left of it where a joint loses as much as it turns


def command_directions(
    sources: Sequence[Source], theta: Array, position: Array, made_up: DirectionState, before: DirectionState
) -> DirectionState:
    """Directions of a command that makes up for the play, as they are where it makes up for them.

    A joint that shall be at a is commanded c = a + b u, and u follows c. By the play operator, while u changes,

        w du = dc = da + b du,    so    du = da / (w - b)

    u follows a as it follows c, over the width w - b. By Dahl this is where some rounds begin, each a share of the way
    from u to the u of a + b u. Of joints that move by little more than their play the command turns round where a does
    not: the directions of a first command are not those of the next.

    Args:
        sources: Of the arm, one or more of which have a direction.
        theta: Joints c of a first command, (N, 6) [rad].
        position: Of its TCP, (N, 3) [m].
        made_up: Directions that it makes up for.
        before: What the way to it has made of them.
    """
    widths = reversal_widths(sources)
    half = sum((getattr(s, "backlash", 0.0) for s in sources), np.zeros(6))
    if widths is None:
        return made_up
    wanted, least = theta - half * made_up.direction, STEEPEST * widths.joint
    state = direction_states(replace(widths, joint=np.maximum(widths.joint - half, least)), wanted, position, before)
    for _ in range(ROUNDS if widths.law == "dahl" else 0):
        followed = direction_states(widths, wanted + half * state.direction, position, before)
        moved = (followed.direction - state.direction) / (1 + np.abs(half) / widths.joint)
        state = replace(followed, direction=state.direction + moved)
    return state
