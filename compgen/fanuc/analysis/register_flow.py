"""What is known of registers, frames and offset conditions at each statement of a program, along every way to it.

Registers are followed from the program's start: constants, copies, sums of known ones. Where two ways meet that differ,
behind a call that may write them, behind a macro, or where a statement is not understood, they are not known.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from compgen.core.rotations import to_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.called_programs import CalledPrograms
from compgen.fanuc.analysis.flow_graph import Node
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
from compgen.fanuc.listing.position_parser import AXES
from compgen.fanuc.motion_options import POINT_LOGIC
from compgen.fanuc.pose_table import LARGEST
from compgen.fanuc.registers import CARTESIAN, EITHER, JOINT, Register
from compgen.fanuc.vocabulary import CALL, FOR, FRAME_WRITTEN, IF_THEN, MOVERS, conditional_action, may_move_arm

Numbers = tuple[float, ...]  # X Y Z [mm], W P R [deg]
State = Mapping[Key, Register | float | None]
KINDS = ("UFRAME", "UTOOL")
_CONDITION = re.compile(r"^(OFFSET|TOOL_OFFSET)\s+CONDITION\s+PR(?=\[)", re.IGNORECASE)
_ANY_CONDITION = re.compile(r"^(OFFSET|TOOL_OFFSET)\s+CONDITION\b", re.IGNORECASE)
_MENTIONED = re.compile(r"(?<![A-Z_$])PR\[\s*(\d*)", re.IGNORECASE)
_ACTS = re.compile(
    r"(?:PR|(?<![A-Z])R|UFRAME|UTOOL)\[.*=|\$MNU|CONDITION\b|\b(?:Search|Touch|VISION)\b|P-SPS", re.IGNORECASE
)


def acts(text: str) -> bool:
    """Whether a statement, or the options of a motion, may write a register, a frame or a condition."""
    return bool(_ACTS.search(text) or CALL.search(text))


@dataclass(eq=False, slots=True)
class RegisterFlow:
    """What a program's statements make of registers."""

    program: LsProgram
    frames: Frames
    called: CalledPrograms
    assumed: set[int] = field(default_factory=set)  # registers taken for Cartesian; see ``numbers``
    row_of: dict[int, int] = field(init=False)  # of each P in the table of positions, group 1

    def __post_init__(self) -> None:
        p = self.program.positions
        first = np.flatnonzero(p.group <= 1)
        self.row_of = dict(zip(p.number[first].tolist(), first.tolist(), strict=True))

    def values(self, state: State) -> Values:
        """A state with what the program's positions and the table of frames say."""
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

    def leave(self, node: Node, state: State) -> State:
        """What is known behind a node, from what is known before it."""
        if node.options:
            return self._after_options(node.options, state)
        return self._after(node.text, state) if node.text else state

    def _after(self, text: str, state: State) -> State:
        action = conditional_action(text)
        if action is not None:
            return state if IF_THEN.match(text) else meet(state, self._after_plain(action, state))
        return self._after_plain(text, state)

    def _after_plain(self, text: str, state: State) -> State:
        names = [name.upper() for name in CALL.findall(text)]
        if names or (may_move_arm(text) and not (_ANY_CONDITION.match(text) or MOVERS.match(text))):
            kept = bool(names) and all(name in self.called.settled for name in names)
            return {k: v for k, v in state.items() if k[0] != "R"} if kept else after_unknown_call(state)
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
        elif kind in KINDS:
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
            return after_unknown_call(state)
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

    def numbers(self, register: Register, text: str = "") -> Numbers | None:
        """The six numbers of a register, when it is told in Cartesian form and they are known."""
        if register.form == JOINT or any(v is None or not abs(v) < LARGEST for v in register.values):
            return None
        if register.form == EITHER:
            self.assumed |= {int(n) for n in _MENTIONED.findall(text) if n}
        return tuple(float(v) for v in register.values if v is not None)


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


def after_unknown_call(state: State) -> State:
    """What is left behind a program that may write all registers, and the frames that are written here as well."""
    kept = {k: (None if k[0] in KINDS else v) for k, v in state.items() if k[0] != "R"}
    return _without_all(kept)


def meet(a: State, b: State) -> State:
    """What two ways that meet both know."""
    if a is b or a == b:
        return a
    met: dict[Key, Register | float | None] = {}
    for key in set(a) | set(b):
        kind = key[0]
        if key in a and key in b and a[key] == b[key]:
            met[key] = a[key]
        elif kind in KINDS:
            met[key] = None
        elif kind == "PR":
            x, y = (s.get(key, s.get(("PR", ANY), UNKNOWN)) for s in (a, b))
            if isinstance(x, Register) and isinstance(y, Register):
                form = x.form if x.form == y.form else (JOINT if JOINT in (x.form, y.form) else EITHER)
                met[key] = Register(form, tuple(v if v == w else None for v, w in zip(x.values, y.values, strict=True)))
    return met
