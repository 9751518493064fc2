"""From which station the robot surely comes to each station of a program, whatever happens at run time.

The statements are a graph: each leads to the next, a jump to its label, IF past its THEN, ENDFOR back to its FOR. Along
every way through it the robot stands at the last station driven to. A station that all ways reach from the same one has
an origin; where they differ, after a statement that may move the arm, or where no way arrives, it has none. What is not
understood adds ways or moves the arm: the order is then unknown, never wrong.
"""

from collections.abc import Collection

import numpy as np

from compgen.core.arrays import IntArray
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.analysis.flow_graph import Node, arrivals, link_nodes, read_nodes
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.motion_options import ends_elsewhere, without_offsets

NO_ORIGIN = -1  # the robot may be anywhere


def station_origins(
    program: LsProgram, motion: IntArray, motionless: Collection[str] = (), shifted: Collection[int] = ()
) -> IntArray:
    """The station from which the robot surely comes to each, (S,); NO_ORIGIN where run time decides.

    Args:
        program: Any program.
        motion: Motion of each station, (S,), rising.
        motionless: Programs, in capitals, of which it is known that they do not move the arm.
        shifted: Motions whose offset is known: their options alone tell whether they end elsewhere.
    """
    nodes = read_nodes(program, read_flow(program), motion, motionless)
    origin = np.arange(len(motion)) - 1
    states = arrivals(nodes, NO_ORIGIN, _leave, _meet) if link_nodes(nodes) else [None] * len(nodes)
    heads = {node.stations[0]: state for node, state in zip(nodes, states, strict=True) if node.stations}
    for station, state in heads.items():
        origin[station] = NO_ORIGIN if state is None else state
    if len(motion):
        options = program.motions.options
        modifying = {o for o in set(options) if ends_elsewhere(o)}
        still_modifying = {o for o in modifying if ends_elsewhere(without_offsets(o))}
        modified = np.array([o in (still_modifying if i in shifted else modifying) for i, o in enumerate(options)])[
            motion
        ]
        origin[modified | ((origin != NO_ORIGIN) & modified[origin])] = NO_ORIGIN
    followed = np.zeros(len(motion), dtype=bool)
    for node in nodes:
        if node.stations:
            followed[node.stations[0] : node.stations[1] + 1] = True
    origin[~followed] = NO_ORIGIN  # driven by point logic
    return np.asarray(origin)


def _leave(node: Node, station: int) -> int:
    """Where the robot stands behind a node."""
    if node.moves:
        return NO_ORIGIN
    return node.stations[1] if node.stations else station


def _meet(a: int, b: int) -> int:
    return a if a == b else NO_ORIGIN
