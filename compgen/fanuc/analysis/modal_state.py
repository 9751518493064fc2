"""Modal state: settings that one statement makes and later motions obey, as frames, payload, conditions.

A page of a program repeats them. That is right only when it is known which of them is in force: set by a statement
that always runs, with a value that the file holds, and not changed by a called program. Frames and payload stay with
the controller, so a page may also rely on the page before; conditions end with their program: it is not split there.
"""

import re
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.fanuc.analysis.control_flow import Flow
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.listing.positions import position_rows
from compgen.fanuc.vocabulary import (
    ASSIGNED_NUMBER,
    CALL,
    MODAL_STATEMENTS,
    MOVERS,
    REGISTER,
    REGISTER_WRITTEN,
    ModalStatement,
    is_unknown,
)

_NO_NAME = re.compile(r"[\s=]|\[$|(?<=_NUM)\[(?:GP)?1\]", re.IGNORECASE)  # blanks, the value, group 1


@dataclass(frozen=True, slots=True)
class ModalSetting:
    """A setting from its statement on, to the next of its kind."""

    name: str
    unit: int
    known_until: int  # unit after which it is no longer known; before ``unit`` when it never was
    why: str  # it is not known after that


@dataclass(frozen=True, eq=False, slots=True)
class ModalState:
    """All settings of a program, in order, and where it may not be split for their sake."""

    settings: tuple[ModalSetting, ...]
    forbidden: BoolArray  # (S,) a condition is in force after that unit that cannot be repeated

    def at(self, unit: int) -> tuple[list[int], list[str]]:
        """Statements to repeat after a unit, in order, and why the others are left to the page before."""
        last = {s.name: s for s in self.settings if s.unit <= unit}
        again = [s.unit for s in last.values() if unit <= s.known_until]
        left = [f"{s.name}: {s.why}" for s in last.values() if unit > s.known_until]
        return sorted(again), left


def read_modal_state(program: LsProgram, flow: Flow) -> ModalState:
    """The settings of a program."""
    S = len(flow.line)
    statements: list[tuple[ModalStatement, str, int]] = []  # kind, which of it, unit
    for s, text in flow.text.items():
        matches = [(statement, statement.pattern.search(text)) for statement in MODAL_STATEMENTS]
        statements += [(kind, _NO_NAME.sub("", match.group()).upper(), s) for kind, match in matches if match]
    calls = [s for s, text in flow.text.items() if is_unknown(text) and not MOVERS.match(text)]
    texts = {**flow.text, **flow.options}.items()
    calls = sorted([*calls, *(s for s, text in texts if CALL.search(text))])
    written = [(kind.upper(), number, s) for s, text in texts for kind, number in REGISTER_WRITTEN.findall(text)]
    frames = _frames_of_motions(program, flow)
    settings = []
    forbidden = np.zeros(S, dtype=bool)
    for i, (kind, name, s) in enumerate(statements):
        until, reason = _known_until(kind, name, s, flow, calls, written, frames)
        settings.append(ModalSetting(name, s, until, reason))
        if kind.ends_with_program:
            stop = next((unit for _, other, unit in statements[i + 1 :] if other == name), S)
            forbidden[max(until + 1, s) : stop] = True
    return ModalState(tuple(settings), forbidden)


def _known_until(
    kind: ModalStatement,
    name: str,
    s: int,
    flow: Flow,
    calls: list[int],
    written: list[tuple[str, str, int]],
    frames: dict[str, tuple[IntArray, IntArray]],
) -> tuple[int, str]:
    """Up to which unit the setting is known to hold, and why not longer."""
    text, S = flow.text[s], len(flow.line)
    if not flow.unconditional[s] or not kind.pattern.match(text):
        return s - 1, f"line {flow.line[s]} sets it on a condition"
    until, reason = S, ""
    for letters, number in REGISTER.findall(text) if not kind.evaluated_live else ():
        later = [w for k, n, w in written if w > s and k == letters.upper() and (n == number or not n or not number)]
        later += [c for c in calls if c > s]
        if later and min(later) <= until:
            until, reason = min(later) - 1, f"line {flow.line[min(later)]} may change the register it is taken from"
    if not kind.ends_with_program:
        if after := [c for c in calls if c > s and c <= until]:
            until, reason = after[0] - 1, f"line {flow.line[after[0]]} calls a program that may change it"
        assigned = ASSIGNED_NUMBER.search(text)
        if assigned and name in frames:
            units, values = frames[name]
            other = units[(units > s) & (values != int(assigned.group(1)))]
            if len(other) and other[0] <= until:
                until, reason = int(other[0]) - 1, f"line {flow.line[other[0]]} goes to a position in another frame"
    return until, reason


def _frames_of_motions(program: LsProgram, flow: Flow) -> dict[str, tuple[IntArray, IntArray]]:
    """Units that are motions to a position of the file in a frame that it names, and that frame."""
    p = program.positions
    row = position_rows(flow.mention, p.number[p.first_group])
    known = (row != NO_NUMBER) & (flow.motion[flow.mention_unit] != NO_NUMBER)
    unit, row = flow.mention_unit[known], p.first_group[row[known]]
    frames = {}
    for name, column in (("UFRAME_NUM", p.uframe), ("UTOOL_NUM", p.utool)):
        named = column[row] != NO_NUMBER
        frames[name] = (unit[named], column[row][named])
    return frames
