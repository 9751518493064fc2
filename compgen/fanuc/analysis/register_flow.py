"""What is known of registers, frames and offset conditions at each statement of a program, along every way to it.

Registers are followed from the program's start: constants, copies, sums of known ones. Where two ways meet that differ,
behind a call that may write them, behind a macro, or where a statement is not understood, they are not known.
"""

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
    KnownValues,
    bracketed,
    element,
    evaluate_number,
    evaluate_register,
    with_component,
)
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES
from compgen.fanuc.motion_options import POINT_LOGIC
from compgen.fanuc.vocabulary import (
    CALL,
    CONDITION_OF_OFFSET,
    FOR,
    IF_THEN,
    MAY_SET,
    MOVERS,
    NUMBER_REGISTER_SET,
    POSITION_REGISTER,
    POSITION_REGISTER_SET,
    REGISTER_INDEX,
    SEARCH,
    conditional_action,
    may_move_arm,
    written_frames,
)
from compgen.program.frames import Frames
from compgen.program.pose_table import LARGEST
from compgen.program.registers import CARTESIAN, EITHER, JOINT, Register

Numbers = tuple[float, ...]  # X Y Z [mm], W P R [deg]
RegisterValues = Mapping[Key, Register | float | None]
KINDS = ("UFRAME", "UTOOL")


def acts(text: str) -> bool:
    """Whether a statement, or the options of a motion, may write a register, a frame or a condition."""
    return bool(MAY_SET.search(text) or CALL.search(text))


@dataclass(eq=False, slots=True, kw_only=True)
class RegisterFlow:
    """What a program's statements make of registers."""

    program: LsProgram
    frames: Frames
    called: CalledPrograms
    assumed: set[int] = field(default_factory=set)  # registers taken for Cartesian; see ``numbers``
    row_of: dict[int, int] = field(init=False)  # of each P in the table of positions, group 1
    joint_form: set[int] = field(init=False)  # rows of it

    def __post_init__(self) -> None:
        self.row_of = self.program.positions.row_of()
        self.joint_form = set(np.flatnonzero(self.program.positions.joint_form).tolist())

    def values(self, state: RegisterValues) -> KnownValues:
        """A state with what the program's positions and the table of frames say."""
        return KnownValues(state, self.position, self.frame)

    def position(self, number: int) -> Register:
        """The numbers of P[n]."""
        row = self.row_of.get(number)
        if row is None:
            return UNKNOWN
        p = self.program.positions
        if row in self.joint_form:
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

    def leave(self, node: Node, state: RegisterValues) -> RegisterValues:
        """What is known behind a node, from what is known before it."""
        if node.options:
            return self._after_options(node.options, state)
        return self._after(node.text, state) if node.text else state

    def _after(self, text: str, state: RegisterValues) -> RegisterValues:
        action = conditional_action(text)
        if action is not None:
            return state if IF_THEN.match(text) else meet(state, self._after_plain(action, state))
        return self._after_plain(text, state)

    def _after_plain(self, text: str, state: RegisterValues) -> RegisterValues:
        names = [name.upper() for name in CALL.findall(text)]
        if names or (may_move_arm(text) and not (CONDITION_OF_OFFSET.match(text) or MOVERS.match(text))):
            kept = bool(names) and all(name in self.called.settled for name in names)
            return {k: v for k, v in state.items() if k[0] != "R"} if kept else self._after_unknown_call(state)
        if condition := CONDITION_OF_OFFSET.match(text):
            return self._after_condition(condition[1].upper(), text, state)
        target = element(text)
        if target is not None and text[target[3] :].lstrip().startswith("="):
            return self._after_assignment(target, text, state)
        new = dict(state)
        for kind, number in written_frames(text):  # a system variable, or a component of it
            new[kind, ANY if number is None else number] = None
        if FOR.match(text) or "R[" in text.upper().replace("PR[", ""):
            new = {k: v for k, v in new.items() if k[0] != "R"}
        return _without_mentioned(text, new)

    def _after_assignment(
        self, target: tuple[str, int | None, int | None, int], text: str, state: RegisterValues
    ) -> RegisterValues:
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
                return _without_all(state, joint=self._may_be_joint(right, state))
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

    def _may_be_joint(self, text: str, state: RegisterValues) -> bool:
        """Whether an expression that is not known may be in joint form: its registers are, or the robot's joints."""
        values, named = self.values(state), POSITION_REGISTER.findall(text)
        registers = [v for k, v in state.items() if k[0] == "PR"] if "" in named else []
        registers += [values.register(int(n)) for n in named if n]
        return "JPOS" in text.upper() or any(isinstance(v, Register) and v.form == JOINT for v in registers)

    def _after_condition(self, kind: str, text: str, state: RegisterValues) -> RegisterValues:
        new = {k: v for k, v in state.items() if k[0] != kind}
        match = CONDITION_OF_OFFSET.match(text)
        inside = bracketed(text, match.end()) if match and match[2] else None
        index = REGISTER_INDEX.fullmatch(inside[0]) if inside else None
        if inside and index and not text[inside[1] :].strip():
            number = int(index[1])
            new[kind, 0] = float(number)
            new[kind, 1] = self.values(state).register(number)
        return new

    def _after_options(self, options: str, state: RegisterValues) -> RegisterValues:
        names = [name.upper() for name in CALL.findall(options)]
        if POINT_LOGIC.search(options) or not all(name in self.called.settled for name in names):
            return self._after_unknown_call(state)
        if names or NUMBER_REGISTER_SET.search(options):
            state = {k: v for k, v in state.items() if k[0] != "R"}
        written = POSITION_REGISTER_SET.findall(options)
        return _without_mentioned(" ".join(written), state) if written else state

    def _after_unknown_call(self, state: RegisterValues) -> RegisterValues:
        """What is left behind a program that may write all registers, and frames that this or a called one writes."""
        kept = {k: (None if k[0] in KINDS else v) for k, v in state.items() if k[0] != "R"}
        return _without_all(kept | {(kind, ANY if n is None else n): None for kind, n in self.called.frames})

    def settles(self, node: Node, state: RegisterValues) -> bool:
        """Whether a statement writes frames to known values only."""
        after = self.leave(node, state)
        return all(
            number is not None and after.get((kind, number)) is not None for kind, number in written_frames(node.text)
        )

    def numbers(self, register: Register, text: str = "") -> Numbers | None:
        """The six numbers of a register, when it is told in Cartesian form and they are known."""
        if register.form == JOINT or any(v is None or not abs(v) < LARGEST for v in register.values):
            return None
        if register.form == EITHER:
            self.assumed |= {int(n) for n in POSITION_REGISTER.findall(text) if n}
        return tuple(float(v) for v in register.values if v is not None)


def _without_mentioned(text: str, state: RegisterValues) -> RegisterValues:
    """A state without the position registers that a text names; without all where it names one found at run time."""
    named = POSITION_REGISTER.findall(text)
    if "" in named or SEARCH.search(text):
        return _without_all(state)
    lost = {("PR", int(n)) for n in named}
    return {k: _lost(v) if k in lost else v for k, v in state.items()} if lost & set(state) else state


def _without_all(state: RegisterValues, *, joint: bool = False) -> RegisterValues:
    """A state that knows no position register; ``joint``: any of them may be in joint form now."""
    new = {k: _lost(v) if k[0] == "PR" else v for k, v in state.items()}
    if not joint:
        return new
    return {k: v for k, v in new.items() if k[0] != "PR"} | {("PR", ANY): Register(JOINT)}


def _lost(value: Register | float | None) -> Register:
    """What is left of a register whose numbers are not known any more: it may still be in joint form."""
    return Register(JOINT) if isinstance(value, Register) and value.form == JOINT else UNKNOWN


def meet(a: RegisterValues, b: RegisterValues) -> RegisterValues:
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
