"""From which station the robot surely comes to each station of a program, whatever happens at run time.

The statements are a graph: each leads to the next, a jump to its label, IF past its THEN, ENDFOR back to its FOR. Along
every way through it the robot stands at the last station driven to. A station that all ways reach from the same one has
an origin; where they differ, after a statement that may move the arm, or where no way arrives, it has none. What is not
understood adds ways or moves the arm: the order is then unknown, never wrong.
"""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import numpy as np

from compgen.core.arrays import IntArray
from compgen.core.exceptions import InputError
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.listing.listing import LsProgram, loads
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import ends_elsewhere
from compgen.fanuc.vocabulary import (
    ABORT,
    CALL,
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

NO_ORIGIN = -1  # the robot may be anywhere
_UNREACHED = -2  # no way arrives
_ANY_LABEL = ""  # LBL[R[n]]


@dataclass(eq=False, slots=True)
class _Node:
    """A run of motions, or a statement that may change the order."""

    stations: tuple[int, int] | None = None  # first and last of a run
    moves: bool = False  # after it the robot may be anywhere
    falls_through: bool = True
    label: str | None = None
    jumps: list[str] = field(default_factory=list)
    leads_to: list[int] = field(default_factory=list)  # nodes, beside the next one
    text: str = ""


def station_origins(program: LsProgram, motion: IntArray, motionless: Collection[str] = ()) -> IntArray:
    """The station from which the robot surely comes to each, (S,); NO_ORIGIN where run time decides.

    Args:
        program: Any program.
        motion: Motion of each station, (S,), rising.
        motionless: Programs, in capitals, of which it is known that they do not move the arm.
    """
    nodes = _nodes(program, read_flow(program), motion, motionless)
    origin = np.arange(len(motion)) - 1
    arrivals = _arrivals(nodes) if _link(nodes) else [NO_ORIGIN] * len(nodes)
    heads = {node.stations[0]: state for node, state in zip(nodes, arrivals) if node.stations}
    for station, state in heads.items():
        origin[station] = max(state, NO_ORIGIN)
    if len(motion):
        options = program.motions.options
        modifying = {o for o in set(options) if ends_elsewhere(o)}
        modified = np.array([o in modifying for o in options])[motion]
        origin[modified | ((origin != NO_ORIGIN) & modified[origin])] = NO_ORIGIN
    followed = np.zeros(len(motion), dtype=bool)
    for node in nodes:
        if node.stations:
            followed[node.stations[0] : node.stations[1] + 1] = True
    origin[~followed] = NO_ORIGIN  # driven by point logic
    return np.asarray(origin)


def motionless_programs(program: LsProgram, find: Callable[[str], bytes | None]) -> frozenset[str]:
    """Names, in capitals, of the programs that a program calls and of which it is known that they do not move the arm.

    Args:
        program: Any program.
        find: The listing of a program by its name in capitals; None for one that is not there.
    """
    still: dict[str, bool] = {}

    def is_still(name: str) -> bool:
        if name not in still:
            still[name] = False  # of one that calls itself nothing is known
            listing = find(name)
            if listing is None:
                return False
            try:
                called = loads(listing)
            except InputError:
                return False
            still[name] = called.name.upper() == name and not _moves(called)
        return still[name]

    def _moves(called: LsProgram) -> bool:
        texts = set(read_flow(called).text.values())
        names = {name.upper() for text in texts for name in CALL.findall(text)}
        quiet = {name for name in names if is_still(name)}
        return not called.motions.disabled.all() or any(may_move_arm(text, quiet) for text in texts)

    names = {name.upper() for text in set(read_flow(program).text.values()) for name in CALL.findall(text)}
    return frozenset(name for name in names if is_still(name))


def _nodes(program: LsProgram, flow: Flow, motion: IntArray, motionless: Collection[str]) -> list[_Node]:
    """The program as runs of motions and the statements between them that matter."""
    m = program.motions
    first = np.searchsorted(motion, np.arange(len(m.line) + 1))  # of each motion's stations, and where they end
    jumping = {option for option in set(m.options) if option and LABEL.search(option)}
    inner = set(np.flatnonzero(np.bincount(flow.move_unit, minlength=1) > 1).tolist())  # with motions in point logic
    meaning = {text: _statement(text, motionless) for text in set(flow.text.values())}
    nodes: list[_Node] = []
    run: tuple[int, int] | None = None
    breaks = {s for s, text in flow.text.items() if meaning[text] is not None}
    for s in sorted(breaks | set(np.flatnonzero(flow.motion != NO_NUMBER).tolist())):
        i = int(flow.motion[s])
        begin, end = (int(first[i]), int(first[i + 1])) if i != NO_NUMBER else (0, 0)
        if begin < end:
            run = (run[0] if run else begin, end - 1)
            if m.options[i] not in jumping and s not in inner:
                continue
        if run:
            nodes.append(_Node(stations=run))
            run = None
        if i == NO_NUMBER:
            template = meaning[flow.text[s]]
            assert template is not None
            nodes.append(template())
        else:  # a target that is not understood, a skip with its label, point logic that moves
            nodes.append(_Node(moves=True, jumps=LABEL.findall(m.options[i])))
    return [*nodes, _Node(stations=run)] if run else nodes


def _statement(text: str, motionless: Collection[str]) -> Callable[[], _Node] | None:
    """What makes the node of a statement; None for one that changes neither order nor place."""
    moves = may_move_arm(text, motionless)
    label = match.group(1) if (match := LABEL_ALONE.match(text)) else None
    jumps = LABEL.findall(text) if label is None else []
    ends = bool(ABORT.match(text) or JUMP.match(text))
    bracket = any(pattern.match(text) for pattern in (IF_THEN, ELSE_ALONE, ENDIF, FOR, ENDFOR))
    if not (moves or jumps or ends or bracket or label is not None):
        return None
    return lambda: _Node(moves=moves, falls_through=not ends, label=label, jumps=list(jumps), text=text)


def _link(nodes: list[_Node]) -> bool:
    """Sets where each node leads to, and adds the places where jumps meet.

    Returns:
        False where IF or FOR are not closed as they are opened.
    """
    count = len(nodes)
    labels: dict[str, _Node] = {_ANY_LABEL: _Node(falls_through=False)}  # where jumps to each label meet, and to any
    for k, node in enumerate(nodes):
        if node.label is not None:
            meeting = labels.setdefault(node.label, _Node(falls_through=False))
            meeting.leads_to.append(k)
            if meeting is not labels[_ANY_LABEL]:
                labels[_ANY_LABEL].leads_to.append(k)
    places = {name: count + 1 + i for i, name in enumerate(labels)}
    any_fits = any(node.label == _ANY_LABEL for node in nodes)  # a label without a number
    stack: list[int] = []
    for k, node in enumerate(nodes):
        names = [_ANY_LABEL if any_fits else name for name in node.jumps]
        node.leads_to += [places[name] for name in names if name in places]
        if IF_THEN.match(node.text) or FOR.match(node.text):
            stack.append(k)
        elif ELSE_ALONE.match(node.text):
            if not stack or not IF_THEN.match(nodes[stack[-1]].text):
                return False
            nodes[stack.pop()].leads_to.append(k + 1)
            node.falls_through = False
            stack.append(k)
        elif ENDIF.match(node.text):
            if not stack or FOR.match(nodes[stack[-1]].text):
                return False
            nodes[stack.pop()].leads_to.append(k)
        elif ENDFOR.match(node.text):
            if not stack or not FOR.match(nodes[stack[-1]].text):
                return False
            opening = stack.pop()
            node.leads_to.append(opening + 1)
            if not _surely_runs(nodes[opening].text):
                nodes[opening].leads_to.append(k + 1)
    nodes += [_Node(falls_through=False), *labels.values()]  # the program's end, then where jumps meet
    return not stack


def _surely_runs(text: str) -> bool:
    """Whether the body of a FOR runs at least once, as constants tell."""
    match = CONSTANT_FOR.match(text)
    if not match:
        return False
    first, last = int(match[1]), int(match[3])
    return first <= last if match[2].upper() == "TO" else first >= last


def _arrivals(nodes: list[_Node]) -> list[int]:
    """The station at which the robot stands where each node begins; NO_ORIGIN, or _UNREACHED."""
    arrival = [_UNREACHED] * len(nodes)
    arrival[0] = NO_ORIGIN
    pending = [0]
    while pending:
        k = pending.pop()
        node = nodes[k]
        leaves = NO_ORIGIN if node.moves else (node.stations[1] if node.stations else arrival[k])
        for j in [*([k + 1] if node.falls_through else []), *node.leads_to]:
            met = leaves if arrival[j] in (_UNREACHED, leaves) else NO_ORIGIN
            if met != arrival[j]:
                arrival[j] = met
                pending.append(j)
    return arrival
