r"""Where motions really lead whose frame, tool or offset is written at run time, as far as the program's text tells it.

    Offset,PR[n]        X Y Z W P R of P[] and of PR[n] are added number by number, in the user frame
    Tool_Offset,PR[n]   T_world_tcp = T_uframe T_position T_PR[n]
    UFRAME[n]=PR[m]     T_uframe = T_PR[m] from there on, UTOOL[n]=PR[m] alike

(sources in docs/correct.md), so that a position's numbers come to, where a motion drives to it, and back,

    T = T_uframe T(numbers + Offset) T_Tool_Offset

``register_flow`` follows registers; where they are not known, the motion is left alone.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.core.pose import IDENTITY, Pose
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.called_programs import UNKNOWN_PROGRAMS, CalledPrograms
from compgen.fanuc.analysis.control_flow import Flow, read_flow
from compgen.fanuc.analysis.flow_graph import Node, arrivals, link_nodes, read_nodes
from compgen.fanuc.analysis.register_arithmetic import ANY, bracketed
from compgen.fanuc.analysis.register_flow import KINDS, Numbers, RegisterFlow, RegisterValues, acts, meet
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import offsets_of
from compgen.fanuc.vocabulary import (
    BESIDE,
    FRAME_BEGINS,
    FRAME_WRITTEN,
    POSITION_REGISTER,
    REGISTER_INDEX,
    written_frames,
)
from compgen.program.frames import Frames
from compgen.program.pose_table import pose_of
from compgen.program.registers import JOINT, Register

MOST_STATEMENTS = 5000  # that write registers; a program with more of them is not followed
_NAMES = {"OFFSET": "Offset", "TOOL_OFFSET": "Tool_Offset"}


@dataclass(frozen=True, slots=True)
class Placement:
    """How a motion places the positions that it drives to; all empty: as frames and tools of the table have them."""

    offset: Numbers | None = None  # added number by number
    tool_offset: Numbers | None = None
    uframe: tuple[tuple[int, Numbers], ...] = ()  # those of its positions that the program has written
    utool: tuple[tuple[int, Numbers], ...] = ()


PLAIN = Placement()


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
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
    registers: Mapping[int, Register],
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
    if not (with_offset or called.frames or FRAME_BEGINS.search(program.data)):
        return Placements()
    flow = read_flow(program)
    written = _written_frames(set(flow.text.values()), called)
    if not written and not any(m.options[i] in with_offset for i in active.tolist()):
        return Placements()
    registers_known = RegisterFlow(program=program, frames=frames, called=called)
    start = _start(registers, [*flow.text.values(), *with_offset])
    nodes = read_nodes(program, flow, active, called.motionless, acts)
    states, why = _follow(flow, nodes, registers_known, start)
    of_station: dict[int, RegisterValues] = {}
    for node, state in zip(nodes, states, strict=True):
        if node.stations and state is not None:
            of_station |= dict.fromkeys(range(node.stations[0], node.stations[1] + 1), state)
    motions = _Motions(registers_known, start, written, frozenset(with_offset))
    placements = motions.placements(active, of_station, why)
    settled = frozenset(
        int(flow.line[node.unit])
        for node, state in zip(nodes, states, strict=True)
        if state is not None and node.text and FRAME_WRITTEN.search(node.text) and registers_known.settles(node, state)
    )
    return replace(placements, settled=settled, assumed=tuple(sorted(registers_known.assumed)))


def _start(registers: Mapping[int, Register], texts: Iterable[str]) -> RegisterValues:
    """The registers when a program starts; of those in its text that are not known NaN, a number that could be given.

    What is computed from such numbers alone is NaN as well: known as soon as they are.
    """
    named = {int(n) for text in set(texts) for n in POSITION_REGISTER.findall(text) if n}
    could = {n: Register(values=tuple(float("nan") for _ in range(6))) for n in named}
    return {("PR", n): register for n, register in {**could, **registers}.items()}


def _follow(
    flow: Flow, nodes: list[Node], registers: RegisterFlow, start: RegisterValues
) -> tuple[list[RegisterValues | None], str]:
    """The registers with which each statement is reached, None where it is not known, and why it is not."""
    followed = link_nodes(nodes) and sum(acts(node.text or node.options) for node in nodes) <= MOST_STATEMENTS
    beside = any(BESIDE.match(text) for text in set(flow.text.values()))
    why = "the program's order is not understood" if not followed else "it runs in point logic, or no way leads there"
    why = "another program may run beside this one (RUN, MONITOR)" if beside else why
    unknown: list[RegisterValues | None] = [None] * len(nodes)
    return arrivals(nodes, start, registers.leave, meet) if followed and not beside else unknown, why


def _not_followed(options: str, why: str) -> str:
    word = next((word for word, _ in offsets_of(options)), "")
    return f"{_NAMES.get(word, 'its frame')} is {'added' if word else 'written'} at run time: {why}"


def _written_frames(texts: set[str], called: CalledPrograms) -> dict[str, set[int]]:
    """Numbers of user frames and tools that statements, or called programs, write; ANY for one found at run time."""
    written: dict[str, set[int]] = {}
    for kind, number in called.frames.union(*map(written_frames, texts)):
        written.setdefault(kind, set()).add(ANY if number is None else number)
    return written


@dataclass(frozen=True, eq=False, slots=True)
class _Motions:
    """What motions make of what is known where they run."""

    flow: RegisterFlow
    start: RegisterValues  # when the program starts
    written: Mapping[str, set[int]]  # numbers of user frames and tools that the program writes
    with_offset: frozenset[str]  # options that add one

    def placements(self, active: IntArray, state_of: Mapping[int, RegisterValues], why: str) -> Placements:
        """The placements of active motions by the registers known at their stations; ``why`` others are not known."""
        options = self.flow.program.motions.options
        table: dict[Placement, int] = {PLAIN: 0}
        of_motion: dict[int, int] = {}
        unknown: dict[int, str] = {}
        for station, i in enumerate(active.tolist()):
            if options[i] not in self.with_offset and not any(self._numbers_used(kind, i) for kind in self.written):
                continue  # neither offset nor in a frame, or with a tool, that the program writes
            state = state_of.get(station)
            placement = self._placement(i, state) if state is not None else _not_followed(options[i], why)
            if isinstance(placement, str):
                unknown[i] = placement
            elif placement != PLAIN:
                of_motion[i] = table.setdefault(placement, len(table))
        shifted = frozenset(i for i in active.tolist() if options[i] in self.with_offset and i not in unknown)
        return Placements(table=tuple(table), of_motion=of_motion, shifted=shifted, unknown=unknown)

    def _numbers_used(self, kind: str, motion: int) -> list[int]:
        p, column = self.flow.program.positions, "uframe" if kind == "UFRAME" else "utool"
        rows = [self.flow.row_of[n] for n in self.flow.program.motions.position[motion] if n in self.flow.row_of]
        used = {int(getattr(p, column)[row]) for row in rows}
        if kind == "UFRAME":  # a joint-form position has no frame
            used = {int(p.uframe[row]) for row in rows if row not in self.flow.joint_form}
        numbers = self.written.get(kind, set())
        return sorted(n for n in used if n != NO_NUMBER and (n in numbers or ANY in numbers))

    def _placement(self, motion: int, state: RegisterValues) -> Placement | str:
        """The placement of a motion, or why it is not known."""
        frames: dict[str, list[tuple[int, Numbers]]] = {kind: [] for kind in KINDS}
        for kind in KINDS:
            for number in self._numbers_used(kind, motion):
                if (kind, number) not in state and (kind, ANY) not in state:
                    continue  # not written yet
                values = state.get((kind, number))
                numbers = self.flow.numbers(values) if isinstance(values, Register) else None
                if numbers is None:
                    where = "is written before it, here or in a program that it calls"
                    return f"{kind}[{number}] {where}: its value is known at run time only"
                frames[kind].append((number, numbers))
        offsets = self._offsets(motion, state)
        if isinstance(offsets, str):
            return offsets
        return Placement(
            offsets.get("OFFSET"), offsets.get("TOOL_OFFSET"), tuple(frames["UFRAME"]), tuple(frames["UTOOL"])
        )

    def _offsets(self, motion: int, state: RegisterValues) -> dict[str, Numbers] | str:
        """The offsets of a motion, or why they are not known."""
        m = self.flow.program.motions
        parts = offsets_of(m.options[motion])
        if not parts:
            return {}
        if len(m.target[motion]) > 1 or m.letter[motion] in "CAS":
            return f"{_NAMES[parts[0][0]]} is added at run time: to which points of an arc is not known to cgen"
        if len(parts) > 1:
            return "Offset and Tool_Offset are added at run time: how they add up is not known to cgen"
        ((word, text),) = parts
        name = _NAMES[word]
        number = self._offset_register(word, text, state)
        if isinstance(number, str):
            return f"{name} is added at run time: {number}"
        register = self.flow.values(state).register(number)
        numbers = self.flow.numbers(register, f"PR[{number}]")
        if numbers is None:
            return f"{name} is added at run time: PR[{number}] {self._why_open(number, register)}"
        if any(self.flow.row_of.get(n) in self.flow.joint_form for n in m.position[motion]):
            return f"{name} is added at run time: to a position in joint form it is not followed"
        return {word: numbers}

    def _why_open(self, number: int, register: Register) -> str:
        """Why the numbers of a register are not known where an offset takes it; --registers where that frees it."""
        if register.form == JOINT:
            return "is in joint form"
        if register == self.start.get(("PR", number)):
            return "is not known: give it with --registers"
        if None not in register.values and np.isnan(np.array(register.values, dtype=float)).any():
            return "is not known: give it, or what it is written from, with --registers"
        causes = "from what --registers does not give, in a loop, by a call, a macro, on ways that differ"
        return f"may have been written before it ({causes})"

    def _offset_register(self, word: str, text: str, state: RegisterValues) -> int | str:
        """The number of the register that an offset takes, in the motion or from its CONDITION; or why it is open."""
        start = text.find("[")
        if start >= 0:
            inside = bracketed(text, start)
            index = REGISTER_INDEX.fullmatch(inside[0]) if inside else None
            if index is None or text[start - 2 : start].upper() != "PR" or (text[start - 3 : start - 2].isalpha()):
                return "which register it takes is found there"
            return int(index[1])
        given, now = state.get((word, 0)), state.get((word, 1))
        if not isinstance(given, float) or not isinstance(now, Register):
            return f"its {word} CONDITION is not known, or names a frame"
        if self.flow.values(state).register(int(given)) != now:
            return f"PR[{int(given)}] is written behind its {word} CONDITION"
        return int(given)


def placed_poses(values: Array, base: Pose, table: tuple[Placement, ...], placement: IntArray) -> Pose:
    """TCP poses of the numbers of Cartesian positions: with their offset, in their user frame, with their tool offset.

    Args:
        values: X Y Z [mm] and W P R [deg], (n, 6).
        base: User frames, n of them.
        table: Placements.
        placement: That of each, (n,).
    """
    shifted = values + _offsets(table, placement)
    return base @ Pose(shifted[:, :3] * MM, from_wpr(*(shifted[:, 3:] * DEG).T)) @ _tool_offsets(table, placement)


class PlacedNumbers(NamedTuple):
    """What n Cartesian positions say, their angles still as a rotation."""

    xyz: Array  # (n, 3) [mm] X Y Z
    rotation: Array  # (n, 3, 3) in the user frame, with the offset in it
    wpr_offset: Array  # (n, 3) [deg] of the offset, to be taken off W P R


def placed_numbers(tcp: Pose, base: Pose, table: tuple[Placement, ...], placement: IntArray) -> PlacedNumbers:
    """What Cartesian positions say at TCP poses: the inverse of ``placed_poses``."""
    placed = tcp @ _tool_offsets(table, placement).inverse()
    offset = _offsets(table, placement)
    xyz = np.einsum("nji,nj->ni", base.rotation, placed.position - base.position) / MM - offset[:, :3]
    return PlacedNumbers(xyz, np.swapaxes(base.rotation, 1, 2) @ placed.rotation, offset[:, 3:])


def _offsets(table: tuple[Placement, ...], placement: IntArray) -> Array:
    return np.array([t.offset or (0.0,) * 6 for t in table])[placement]


def _tool_offsets(table: tuple[Placement, ...], placement: IntArray) -> Pose:
    """The tool offset of each position, none where it has none."""
    return Pose.stack([IDENTITY if t.tool_offset is None else pose_of(t.tool_offset) for t in table])[placement]
