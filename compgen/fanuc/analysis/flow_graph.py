"""A program as a graph: runs of motions, and the statements between them that may change the order.

Each node leads to the next, a jump to its label, IF past its THEN, ENDFOR back to its FOR. What is not understood adds
ways or moves the arm. ``arrivals`` follows what is known along all of them at once.

So ``station_origins`` tells from which station the robot surely comes, whatever happens at run time: along every way
through the program it stands at the last station driven to. A station that all ways reach from the same one has an
origin; where they differ, after a statement that may move the arm, or where no way arrives, it has none: the order is
then unknown, never wrong.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import TypeVar

import numpy as np

from compgen.core.arrays import IntArray
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import ends_elsewhere, without_offsets
from compgen.fanuc.vocabulary import (
    ABORT,
    CONSTANT_FOR,
    ELSE_ALONE,
    ENDFOR,
    ENDIF,
    FOR,
    IF_THEN,
    JUMP,
    LABEL,
    LABEL_ALONE,
    may_move_arm,
)

_ANY_LABEL = ""  # LBL[R[n]]
FlowState = TypeVar("FlowState")


@dataclass(eq=False, slots=True, kw_only=True)
class Node:
    """A run of motions, or a statement that may change the order."""

    stations: tuple[int, int] | None = None  # first and last of a run
    moves: bool = False  # after it the robot may be anywhere
    falls_through: bool = True
    label: str | None = None
    jumps: list[str] = field(default_factory=list)
    leads_to: list[int] = field(default_factory=list)  # nodes, beside the next one
    text: str = ""
    unit: int = NO_NUMBER  # of the flow, NO_NUMBER for a run of motions and where ways meet
    options: str = ""  # of the motion before it, which do something themselves


def arrivals(
    nodes: list[Node],
    start: FlowState,
    leave: Callable[[Node, FlowState], FlowState],
    meet: Callable[[FlowState, FlowState], FlowState],
) -> list[FlowState | None]:
    """What is known where each node begins, over all ways from the first; None where no way arrives.

    Args:
        nodes: Linked.
        start: Known where the program begins.
        leave: What is known behind a node, from what is known before it.
        meet: What two ways that meet both know; repeated, it must come to an end.
    """
    arrival: dict[int, FlowState] = {0: start}
    pending = [0] if nodes else []  # the first of the text is next: what is behind it waits for all that leads there
    while pending:
        k = heappop(pending)
        if pending[:1] == [k]:
            continue  # it stands there once more
        after = leave(nodes[k], arrival[k])
        for j in [*([k + 1] if nodes[k].falls_through else []), *nodes[k].leads_to]:
            known = arrival.get(j)
            met = after if known is None else meet(known, after)
            if known is None or met != known:
                arrival[j] = met
                heappush(pending, j)
    return [arrival.get(k) for k in range(len(nodes))]


def read_nodes(
    program: LsProgram,
    flow: Flow,
    motion: IntArray,
    motionless: Collection[str],
    matters: Callable[[str], bool] = lambda text: False,
) -> list[Node]:
    """The program as runs of motions and the statements between them that matter.

    Args:
        program: Any program.
        flow: Its units.
        motion: Motion of each station, (S,), rising.
        motionless: Programs, in capitals, of which it is known that they do not move the arm.
        matters: Which other statements, and options of motions, shall be nodes as well.
    """
    m = program.motions
    first = np.searchsorted(motion, np.arange(len(m.line) + 1))  # of each motion's stations, and where they end
    jumping = {option for option in set(m.options) if option and LABEL.search(option)}
    inner = set(np.flatnonzero(np.bincount(flow.move_unit) > 1).tolist())  # with motions in point logic
    statements = ((text, _statement(text, motionless, matters)) for text in set(flow.text.values()))
    meaning = {text: template for text, template in statements if template is not None}
    acting = {option for option in set(m.options) if option and matters(option)}
    nodes: list[Node] = []
    run: tuple[int, int] | None = None
    breaks = {s for s, text in flow.text.items() if text in meaning}
    for s in sorted(breaks | set(np.flatnonzero(flow.motion != NO_NUMBER).tolist())):
        i = int(flow.motion[s])
        if i != NO_NUMBER:
            run = (run[0] if run else int(first[i]), int(first[i + 1]) - 1)
            if m.options[i] not in jumping and s not in inner and m.options[i] not in acting:
                continue
        if run:
            nodes.append(Node(stations=run))
            run = None
        if i == NO_NUMBER:
            nodes.append(meaning[flow.text[s]](s))
        else:  # a skip with its label, point logic that moves
            moves = m.options[i] in jumping or s in inner
            nodes.append(Node(moves=moves, jumps=LABEL.findall(m.options[i]), unit=s, options=m.options[i]))
    return [*nodes, Node(stations=run)] if run else nodes


def _statement(text: str, motionless: Collection[str], matters: Callable[[str], bool]) -> Callable[[int], Node] | None:
    """What makes the node of a statement from its unit; None for one that changes neither order nor place."""
    moves = may_move_arm(text, motionless)
    label = match.group(1) if (match := LABEL_ALONE.match(text)) else None
    jumps = LABEL.findall(text) if label is None else []
    ends = bool(ABORT.match(text) or JUMP.match(text))
    bracket = any(pattern.match(text) for pattern in (IF_THEN, ELSE_ALONE, ENDIF, FOR, ENDFOR))
    if not (moves or jumps or ends or bracket or label is not None or matters(text)):
        return None
    return lambda unit: Node(moves=moves, falls_through=not ends, label=label, jumps=list(jumps), text=text, unit=unit)


def link_nodes(nodes: list[Node]) -> bool:
    """Sets where each node leads to, and adds the places where jumps meet.

    Returns:
        False where IF or FOR are not closed as they are opened.
    """
    count = len(nodes)
    labels: dict[str, Node] = {_ANY_LABEL: Node(falls_through=False)}  # where jumps to each label meet, and to any
    for k, node in enumerate(nodes):
        if node.label is not None:
            meeting = labels.setdefault(node.label, Node(falls_through=False))
            meeting.leads_to.append(k)
            if meeting is not labels[_ANY_LABEL]:
                labels[_ANY_LABEL].leads_to.append(k)
    places = {name: count + 1 + i for i, name in enumerate(labels)}
    any_fits = any(node.label == _ANY_LABEL for node in nodes)  # a label without a number
    stack: list[int] = []
    for k, node in enumerate(nodes):
        names = [_ANY_LABEL if any_fits else name for name in node.jumps]
        node.leads_to += [places[name] for name in names if name in places]
        if not _link_bracket(nodes, k, stack):
            return False
    nodes += [Node(falls_through=False), *labels.values()]  # the program's end, then where jumps meet
    return not stack


def _link_bracket(nodes: list[Node], k: int, stack: list[int]) -> bool:
    """Link a node that opens or closes IF or FOR; ``stack`` holds those that are open. False where it closes none."""
    node = nodes[k]
    if IF_THEN.match(node.text) or FOR.match(node.text):
        stack.append(k)
        return True
    if not (ELSE_ALONE.match(node.text) or ENDIF.match(node.text) or ENDFOR.match(node.text)):
        return True
    if not stack:
        return False
    opening = stack.pop()
    begun = nodes[opening]
    if ELSE_ALONE.match(node.text):
        begun.leads_to.append(k + 1)
        node.falls_through = False
        stack.append(k)
        return bool(IF_THEN.match(begun.text))
    if ENDIF.match(node.text):
        begun.leads_to.append(k)
        return not FOR.match(begun.text)
    node.leads_to.append(opening + 1)
    if not _surely_runs(begun.text):
        begun.leads_to.append(k + 1)
    return bool(FOR.match(begun.text))


def _surely_runs(text: str) -> bool:
    """Whether the body of a FOR runs at least once, as constants tell."""
    match = CONSTANT_FOR.match(text)
    if not match:
        return False
    first, last = int(match[1]), int(match[3])
    return first <= last if match[2].upper() == "TO" else first >= last


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
