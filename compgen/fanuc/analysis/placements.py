r"""Where motions really lead whose frame, tool or offset is written at run time, as far as the program's text tells it.

    Offset,PR[n]        X Y Z W P R of P[] and of PR[n] are added number by number, in the user frame
    Tool_Offset,PR[n]   T_world_tcp = T_uframe T_position T_PR[n]
    UFRAME[n]=PR[m]     T_uframe = T_PR[m] from there on, UTOOL[n]=PR[m] alike

(sources in docs/correct.md). Registers are followed from the program's start along every way through it: constants,
copies, sums of known ones; where two ways meet that differ, behind a call that may write them, behind a macro, or where
a statement is not understood, they are not known, and the motion is left as it is.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms
from compgen.fanuc.analysis.control_flow import read_flow
from compgen.fanuc.analysis.flow_graph import Node, arrivals, link_nodes, read_nodes
from compgen.fanuc.analysis.register_arithmetic import (
    ANY,
    UNKNOWN,
    Key,
    Values,
    bracketed,
    element,
    evaluate_number,
    evaluate_register,
    with_component,
)
from compgen.fanuc.frames import Frames
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES, NO_NUMBER
from compgen.fanuc.motion_options import POINT_LOGIC, offsets_of
from compgen.fanuc.pose_table import LARGEST
from compgen.fanuc.registers import CARTESIAN, EITHER, JOINT, Register
from compgen.fanuc.vocabulary import (
    CALL,
    FOR,
    FRAME_WRITTEN,
    IF_THEN,
    MOVERS,
    conditional_action,
    may_move_arm,
)

MOST_STATEMENTS = 5000  # that write registers; a program with more of them is not followed
Numbers = tuple[float, ...]  # X Y Z [mm], W P R [deg]
State = Mapping[Key, Register | float | None]
_KINDS = ("UFRAME", "UTOOL")
_NAMES = {"OFFSET": "Offset", "TOOL_OFFSET": "Tool_Offset"}
_CONDITION = re.compile(r"^(OFFSET|TOOL_OFFSET)\s+CONDITION\s+PR(?=\[)", re.IGNORECASE)
_ANY_CONDITION = re.compile(r"^(OFFSET|TOOL_OFFSET)\s+CONDITION\b", re.IGNORECASE)
_MENTIONED = re.compile(r"(?<![A-Z_$])PR\[\s*(\d*)", re.IGNORECASE)
_FRAME = re.compile(rb"(?:FRAME|TOOL)[ \t]*\[", re.IGNORECASE)  # before any statement is looked at
_BESIDE = re.compile(r"^(?:.*,)?\s*(?:RUN\s|MONITOR\b)", re.IGNORECASE)  # another program runs at the same time
_ACTS = re.compile(
    r"(?:PR|(?<![A-Z])R|UFRAME|UTOOL)\[.*=|\$MNU|CONDITION\b|\b(?:Search|Touch|VISION)\b|P-SPS", re.IGNORECASE
)


@dataclass(frozen=True, slots=True)
class Placement:
    """How a motion places the positions that it drives to; all empty: as frames and tools of the table have them."""

    offset: Numbers | None = None  # added number by number
    tool_offset: Numbers | None = None
    uframe: tuple[tuple[int, Numbers], ...] = ()  # those of its positions that the program has written
    utool: tuple[tuple[int, Numbers], ...] = ()


PLAIN = Placement()


@dataclass(frozen=True, eq=False, slots=True)
class Placements:
    """The placement of each motion."""

    table: tuple[Placement, ...] = (PLAIN,)  # the first is the plain one
    of_motion: Mapping[int, int] = field(default_factory=dict)  # index in the table; a motion that is missing is plain
    shifted: frozenset[int] = frozenset()  # motions whose Offset or Tool_Offset is known
    unknown: Mapping[int, str] = field(default_factory=dict)  # motions of which run time tells the place, and why
    settled: frozenset[int] = frozenset()  # lines of statements that write a frame whose value is known
    assumed: tuple[int, ...] = ()  # registers taken for Cartesian because a program assigns their six numbers


def read_placements(
    program: LsProgram,
    frames: Frames,
    registers: Mapping[int, Register] | None = None,
    called: CalledPrograms = UNKNOWN_PROGRAMS,
) -> Placements:
    """The placements of a program's motions.

    Args:
        program: Any program.
        frames: What UF and UT numbers mean where the program does not write them.
        registers: Position registers when it starts.
        called: What is known of the programs that it calls.
    """
    m = program.motions
    active = np.flatnonzero(~m.disabled)
    with_offset = {o for o in set(m.options) if o and offsets_of(o)}
    if not with_offset and not _FRAME.search(program.data):
        return Placements()
    flow = read_flow(program)
    written = _written_frames(set(flow.text.values()))
    if not written and not any(m.options[i] in with_offset for i in active.tolist()):
        return Placements()
    nodes = read_nodes(program, flow, active, called.motionless, _acts)
    reader = _Reader(program, frames, called, frozenset(registers or ()))
    followed = link_nodes(nodes) and sum(_acts(node.text or node.options) for node in nodes) <= MOST_STATEMENTS
    beside = any(_BESIDE.match(text) for text in set(flow.text.values()))
    why = "the program's order is not understood" if not followed else "it runs in point logic, or no way leads there"
    why = "another program may run beside this one (RUN, MONITOR)" if beside else why
    followed &= not beside
    start: State = {("PR", n): register for n, register in (registers or {}).items()}
    states = arrivals(nodes, start, reader.leave, _meet) if followed else [None] * len(nodes)
    of_station: dict[int, State] = {}
    for node, state in zip(nodes, states):
        if node.stations and state is not None:
            of_station |= dict.fromkeys(range(node.stations[0], node.stations[1] + 1), state)
    table: dict[Placement, int] = {PLAIN: 0}
    of_motion: dict[int, int] = {}
    unknown: dict[int, str] = {}
    for station, i in enumerate(active.tolist()):
        if m.options[i] not in with_offset and not reader.in_written_frame(i, written):
            continue
        state = of_station.get(station)
        placement = reader.placement(i, state, written) if state is not None else _not_followed(m.options[i], why)
        if isinstance(placement, str):
            unknown[i] = placement
        elif placement != PLAIN:
            of_motion[i] = table.setdefault(placement, len(table))
    settled = frozenset(
        int(flow.line[node.unit])
        for node, state in zip(nodes, states)
        if state is not None and node.text and FRAME_WRITTEN.search(node.text) and reader.settles(node, state)
    )
    shifted = frozenset(i for i in active.tolist() if m.options[i] in with_offset and i not in unknown)
    return Placements(tuple(table), of_motion, shifted, unknown, settled, tuple(sorted(reader.assumed)))


def _acts(text: str) -> bool:
    """Whether a statement, or the options of a motion, may write a register, a frame or a condition."""
    return bool(_ACTS.search(text) or CALL.search(text))


def _not_followed(options: str, why: str) -> str:
    word = next((word for word, _ in offsets_of(options)), "")
    return f"{_NAMES.get(word, 'its frame')} is {'added' if word else 'written'} at run time: {why}"


def _written_frames(texts: set[str]) -> dict[str, set[int]]:
    """Numbers of user frames and tools that statements write; ANY among them for one that is found at run time."""
    written: dict[str, set[int]] = {}
    for text in texts:
        for match in FRAME_WRITTEN.finditer(text):
            index = match[2].partition(":")[0].strip()
            written.setdefault(f"U{match[1].upper()}", set()).add(int(index) if index.isdigit() else ANY)
    return written


@dataclass(eq=False, slots=True)
class _Reader:
    """What a program's statements make of registers."""

    program: LsProgram
    frames: Frames
    called: CalledPrograms
    given: frozenset[int] = frozenset()  # registers that are known when the program starts
    assumed: set[int] = field(default_factory=set)
    row_of: dict[int, int] = field(init=False)  # of each P in the table of positions, group 1

    def __post_init__(self) -> None:
        p = self.program.positions
        first = np.flatnonzero(p.group <= 1)
        self.row_of = dict(zip(p.number[first].tolist(), first.tolist()))

    def values(self, state: State) -> Values:
        return Values(state, self.position, self.frame)

    def position(self, number: int) -> Register:
        """The numbers of P[n]."""
        row = self.row_of.get(number)
        if row is None:
            return UNKNOWN
        p = self.program.positions
        if p.span[row, AXES.index("J1"), 1] > 0:
            return Register(JOINT)
        if p.remote[row] or (p.span[row, AXES.index("E1") :, 1] > 0).any():
            return UNKNOWN
        return Register(CARTESIAN, tuple(None if np.isnan(v) else float(v) for v in p.value[row, :6]))

    def frame(self, kind: str, number: int) -> Register:
        """A frame or tool of the table."""
        pose = (self.frames.uframe if kind == "UFRAME" else self.frames.utool).get(number)
        if pose is None:
            return UNKNOWN
        wpr = [float(angle[0] / DEG) for angle in to_wpr(pose.rotation[None])]
        return Register(CARTESIAN, (*(float(v / MM) for v in pose.position), *wpr))

    # ---- what statements do ---------------------------------------------------------------------------------------

    def leave(self, node: Node, state: State) -> State:
        if node.options:
            return self._after_options(node.options, state)
        return self._after(node.text, state) if node.text else state

    def _after(self, text: str, state: State) -> State:
        action = conditional_action(text)
        if action is not None:
            return state if IF_THEN.match(text) else _meet(state, self._after_plain(action, state))
        return self._after_plain(text, state)

    def _after_plain(self, text: str, state: State) -> State:
        names = [name.upper() for name in CALL.findall(text)]
        if names or (may_move_arm(text) and not (_ANY_CONDITION.match(text) or MOVERS.match(text))):
            kept = bool(names) and all(name in self.called.settled for name in names)
            return {k: v for k, v in state.items() if k[0] != "R"} if kept else _behind_a_call(state)
        if condition := _ANY_CONDITION.match(text):
            return self._after_condition(condition[1].upper(), text, state)
        target = element(text)
        if target is not None and text[target[3] :].lstrip().startswith("="):
            return self._after_assignment(target, text, state)
        new = dict(state)
        for match in FRAME_WRITTEN.finditer(text):  # a system variable, or a component of it
            index = match[2].partition(":")[0].strip()
            new[f"U{match[1].upper()}", int(index) if index.isdigit() else ANY] = None
        if FOR.match(text) or "R[" in text.upper().replace("PR[", ""):
            new = {k: v for k, v in new.items() if k[0] != "R"}
        return _without_mentioned(text, new)

    def _after_assignment(self, target: tuple[str, int | None, int | None, int], text: str, state: State) -> State:
        kind, number, component, end = target
        right = text[end:].lstrip()[1:]
        values, new = self.values(state), dict(state)
        if kind == "R":
            value = evaluate_number(right, values) if component is None and number is not None else None
            if number is None:
                return {k: v for k, v in state.items() if k[0] != "R"}
            new.pop(("R", number), None)
            if value is not None and abs(value) < LARGEST:
                new["R", number] = value
        elif kind == "PR":
            if number is None:
                return _without_all(state, self._may_be_joint(right, state))
            if component is None:
                register = evaluate_register(right, values)
                joint = register == UNKNOWN and self._may_be_joint(right, state)
                new["PR", number] = Register(JOINT) if joint else register
            else:
                new["PR", number] = with_component(values.register(number), component, evaluate_number(right, values))
        elif kind in _KINDS:
            if number is None or component is not None:
                new = {k: v for k, v in new.items() if k[0] != kind}
                new[kind, ANY] = None
            else:
                register = evaluate_register(right, values)
                new[kind, number] = register if self.numbers(register, right) else None
        return new

    def _may_be_joint(self, text: str, state: State) -> bool:
        """Whether an expression that is not known may be in joint form: its registers are, or the robot's joints."""
        values, named = self.values(state), _MENTIONED.findall(text)
        registers = [v for k, v in state.items() if k[0] == "PR"] if "" in named else []
        registers += [values.register(int(n)) for n in named if n]
        return "JPOS" in text.upper() or any(isinstance(v, Register) and v.form == JOINT for v in registers)

    def _after_condition(self, kind: str, text: str, state: State) -> State:
        new = {k: v for k, v in state.items() if k[0] != kind}
        match = _CONDITION.match(text)
        inside = bracketed(text, match.end()) if match else None
        if inside and re.fullmatch(r"\s*\d{1,4}\s*(?::.*)?", inside[0]) and not text[inside[1] :].strip():
            number = int(inside[0].partition(":")[0])
            new[kind, 0] = float(number)
            new[kind, 1] = self.values(state).register(number)
        return new

    def _after_options(self, options: str, state: State) -> State:
        names = [name.upper() for name in CALL.findall(options)]
        if POINT_LOGIC.search(options) or not all(name in self.called.settled for name in names):
            return _behind_a_call(state)
        if names or re.search(r"(?<![A-Z])R\[[^\]]*\]\s*=", options, re.IGNORECASE):
            state = {k: v for k, v in state.items() if k[0] != "R"}
        written = re.findall(r"(?<![A-Z_$])PR\[[^\]=]*\]\s*=", options, re.IGNORECASE)
        return _without_mentioned(" ".join(written), state) if written else state

    def settles(self, node: Node, state: State) -> bool:
        """Whether a statement writes frames to known values only."""
        after = self.leave(node, state)
        for match in FRAME_WRITTEN.finditer(node.text):
            index = match[2].partition(":")[0].strip()
            if not index.isdigit() or after.get((f"U{match[1].upper()}", int(index))) is None:
                return False
        return True

    # ---- what motions see -----------------------------------------------------------------------------------------

    def numbers(self, register: Register, text: str = "") -> Numbers | None:
        """The six numbers of a register, when it is told in Cartesian form and they are known."""
        if register.form == JOINT or any(v is None or not abs(v) < LARGEST for v in register.values):
            return None
        if register.form == EITHER:
            self.assumed |= {int(n) for n in _MENTIONED.findall(text) if n}
        return tuple(float(v) for v in register.values if v is not None)

    def in_written_frame(self, motion: int, written: Mapping[str, set[int]]) -> bool:
        """Whether a motion drives to a position in a frame or with a tool that the program writes."""
        return any(self._numbers_used(kind, motion, written) for kind in written)

    def _numbers_used(self, kind: str, motion: int, written: Mapping[str, set[int]]) -> list[int]:
        p, column = self.program.positions, "uframe" if kind == "UFRAME" else "utool"
        rows = [self.row_of[n] for n in self.program.motions.position[motion] if n in self.row_of]
        used = {int(getattr(p, column)[row]) for row in rows}
        if kind == "UFRAME":  # a joint-form position has no frame
            used = {int(p.uframe[row]) for row in rows if not p.span[row, AXES.index("J1"), 1] > 0}
        numbers = written.get(kind, set())
        return sorted(n for n in used if n != NO_NUMBER and (n in numbers or ANY in numbers))

    def placement(self, motion: int, state: State, written: Mapping[str, set[int]]) -> Placement | str:
        """The placement of a motion, or why it is not known."""
        frames: dict[str, list[tuple[int, Numbers]]] = {kind: [] for kind in _KINDS}
        for kind in _KINDS:
            for number in self._numbers_used(kind, motion, written):
                if (kind, number) not in state and (kind, ANY) not in state:
                    continue  # not written yet
                values = state.get((kind, number))
                numbers = self.numbers(values) if isinstance(values, Register) else None
                if numbers is None:
                    return f"{kind}[{number}] is written before it, and its value is known at run time only"
                frames[kind].append((number, numbers))
        offsets = self._offsets(motion, state)
        if isinstance(offsets, str):
            return offsets
        return Placement(
            offsets.get("OFFSET"), offsets.get("TOOL_OFFSET"), tuple(frames["UFRAME"]), tuple(frames["UTOOL"])
        )

    def _offsets(self, motion: int, state: State) -> dict[str, Numbers] | str:
        """The offsets of a motion, or why they are not known."""
        m = self.program.motions
        parts = offsets_of(m.options[motion])
        if not parts:
            return {}
        if len(m.target[motion]) > 1 or m.letter[motion] in "CAS":
            return f"{_NAMES[parts[0][0]]} is added at run time: to which points of an arc is not known to cgen"
        if len(parts) > 1:
            return "Offset and Tool_Offset are added at run time: how they add up is not known to cgen"
        ((word, text),) = parts
        name = _NAMES[word]
        start = text.find("[")
        if start >= 0:
            inside = bracketed(text, start)
            index = re.fullmatch(r"\s*(\d{1,4})\s*(?::.*)?", inside[0], re.DOTALL) if inside else None
            if index is None or text[start - 2 : start].upper() != "PR" or (text[start - 3 : start - 2].isalpha()):
                return f"{name} is added at run time: which register it takes is found there"
            number = int(index[1])
            register = self.values(state).register(number)
        else:
            given, now = state.get((word, 0)), state.get((word, 1))
            if not isinstance(given, float) or not isinstance(now, Register):
                return f"{name} is added at run time: its {word} CONDITION is not known, or names a frame"
            number = int(given)
            register = self.values(state).register(number)
            if register != now:
                return f"{name} is added at run time: PR[{number}] is written behind its {word} CONDITION"
        numbers = self.numbers(register, f"PR[{number}]")
        if numbers is None:
            form = "is in joint form" if register.form == JOINT else "is not known: give it with --registers"
            if register.form != JOINT and number in self.given:
                form = "may have been written before it (a call, a macro, ways that differ)"
            return f"{name} is added at run time: PR[{number}] {form}"
        if any(self._in_joint_form(n) for n in m.position[motion]):
            return f"{name} is added at run time: to a position in joint form it is not followed"
        return {word: numbers}

    def _in_joint_form(self, number: int) -> bool:
        row = self.row_of.get(number)
        return row is not None and bool(self.program.positions.span[row, AXES.index("J1"), 1] > 0)


def _without_mentioned(text: str, state: State) -> State:
    """A state without the position registers that a text names; without all where it names one found at run time."""
    named = _MENTIONED.findall(text)
    if "" in named or re.search(r"\bSearch\b", text, re.IGNORECASE):
        return _without_all(state)
    lost = {("PR", int(n)) for n in named}
    return {k: _lost(v) if k in lost else v for k, v in state.items()} if lost & set(state) else state


def _without_all(state: State, joint: bool = False) -> State:
    """A state that knows no position register; ``joint``: any of them may be in joint form now."""
    new = {k: _lost(v) if k[0] == "PR" else v for k, v in state.items()}
    if not joint:
        return new
    return {k: v for k, v in new.items() if k[0] != "PR"} | {("PR", ANY): Register(JOINT)}


def _lost(value: Register | float | None) -> Register:
    """What is left of a register whose numbers are not known any more: it may still be in joint form."""
    return Register(JOINT) if isinstance(value, Register) and value.form == JOINT else UNKNOWN


def _behind_a_call(state: State) -> State:
    """What is left behind a program that may write all registers, and the frames that are written here as well."""
    kept = {k: (None if k[0] in _KINDS else v) for k, v in state.items() if k[0] != "R"}
    return _without_all(kept)


def _meet(a: State, b: State) -> State:
    """What two ways that meet both know."""
    if a is b or a == b:
        return a
    met: dict[Key, Register | float | None] = {}
    for key in set(a) | set(b):
        kind = key[0]
        if key in a and key in b and a[key] == b[key]:
            met[key] = a[key]
        elif kind in _KINDS:
            met[key] = None
        elif kind == "PR":
            x, y = (s.get(key, s.get(("PR", ANY), UNKNOWN)) for s in (a, b))
            if isinstance(x, Register) and isinstance(y, Register):
                form = x.form if x.form == y.form else (JOINT if JOINT in (x.form, y.form) else EITHER)
                met[key] = Register(form, tuple(v if v == w else None for v, w in zip(x.values, y.values)))
    return met
