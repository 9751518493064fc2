"""Settings that one statement makes and later motions obey: frames, payload, conditions.

A part of a program says them again. That is right only when it is sure which of them is in force: set by a statement
that always runs, with a value that the file holds, and not changed by a called program. Frames and payload stay with
the controller, so a part may also rely on the part before; conditions end with their program: there it is not parted.
"""

import re
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.fanuc.analysis.control_flow import Flow
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import NO_NUMBER

#: what a setting is called -> its statement; those that stay with the controller, those that end with their program
_STAY = {
    "UFRAME_NUM": r"UFRAME_NUM\s*(?:\[[^\]]*\])?\s*=",
    "UTOOL_NUM": r"UTOOL_NUM\s*(?:\[[^\]]*\])?\s*=",
    "PAYLOAD": r"PAYLOAD\s*\[",
}
_END = {
    "TOOL_OFFSET CONDITION": r"TOOL_OFFSET\s+CONDITION\b",
    "OFFSET CONDITION": r"(?<![A-Z_])OFFSET\s+CONDITION\b",
    "VOFFSET CONDITION": r"VOFFSET\s+CONDITION\b",
    "SKIP CONDITION": r"SKIP\s+CONDITION\b",
    "COL DETECT": r"COL\s+DETECT\b",
    "COL GUARD ADJUST": r"COL\s+GUARD\s+ADJUST\b",
    "JOINT_MAX_SPEED": r"JOINT_MAX_SPEED\s*(?:\[[^\]]*\])?\s*=",
    "LINEAR_MAX_SPEED": r"LINEAR_MAX_SPEED\s*=",
}
_LIVE = {"SKIP CONDITION"}  # looked at while the robot moves, not when it is said
_FORMS = {name: re.compile(form, re.IGNORECASE) for name, form in {**_STAY, **_END}.items()}
_CALL = re.compile(r"(?:^|,\s*|\s)(?:CALL|RUN)\s+[A-Z_]", re.IGNORECASE)
_REGISTER = re.compile(r"(?<![A-Z_$])(P?R)\[\s*(\d*)", re.IGNORECASE)
_NUMBER = re.compile(r"=\s*(\d+)\s*$")


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting from its statement on, to the next of its kind."""

    name: str
    unit: int
    sure_until: int  # unit after which it is no longer sure; before ``unit`` when it never was
    why: str  # it is not sure after that


@dataclass(frozen=True, eq=False, slots=True)
class InForce:
    """All settings of a program, in order, and where it may not be parted for their sake."""

    settings: tuple[Setting, ...]
    forbidden: BoolArray  # (S,) a condition is in force after that unit that cannot be said again

    def at(self, unit: int) -> tuple[list[int], list[str]]:
        """Statements to say again after a unit, in order, and why the others are left to the part before."""
        last = {s.name: s for s in self.settings if s.unit <= unit}
        again = [s.unit for s in last.values() if unit <= s.sure_until]
        left = [f"{s.name}: {s.why}" for s in last.values() if unit > s.sure_until]
        return sorted(again), left


def read_settings(program: LsProgram, flow: Flow) -> InForce:
    """The settings of a program."""
    S = len(flow.line)
    rows: list[tuple[str, str, int]] = []  # kind, which of it, unit
    calls: list[int] = []
    written: list[tuple[str, str, int]] = []
    for s, text in flow.text.items():
        found = [(name, form.search(text)) for name, form in _FORMS.items()]
        rows += [(name, re.sub(r"[\s=]", "", m.group()).upper(), s) for name, m in found if m]
        if _CALL.search(text):
            calls.append(s)
        if assigned := re.search(r"(?<![A-Z_$])(P?R)\[\s*(\d*)[^=<>]*=", text, re.IGNORECASE):
            written.append((assigned.group(1).upper(), assigned.group(2), s))
    frames = _frames_of_motions(program, flow)
    settings = []
    forbidden = np.zeros(S, dtype=bool)
    for i, (name, which, s) in enumerate(rows):
        until, why = _sure(name, which, s, flow, calls, written, frames)
        settings.append(Setting(which, s, until, why))
        if name in _END:
            stop = next((t for _, w, t in rows[i + 1 :] if w == which), S)
            forbidden[max(until + 1, s) : stop] = True
    return InForce(tuple(settings), forbidden)


def _sure(
    name: str,
    which: str,
    s: int,
    flow: Flow,
    calls: list[int],
    written: list[tuple[str, str, int]],
    frames: dict[str, tuple[IntArray, IntArray]],
) -> tuple[int, str]:
    """Up to which unit it is sure that the setting holds, and why not longer."""
    text, S = flow.text[s], len(flow.line)
    if not flow.sure[s] or not _FORMS[name].match(text):
        return s - 1, f"line {flow.line[s]} sets it on a condition"
    until, why = S, ""
    for kind, number in _REGISTER.findall(text) if name not in _LIVE else ():
        later = [w for k, n, w in written if w > s and k == kind.upper() and (n == number or not n or not number)]
        later += [c for c in calls if c > s]
        if later and min(later) <= until:
            until, why = min(later) - 1, f"line {flow.line[min(later)]} may change the register it is taken from"
    if name in _STAY:
        if after := [c for c in calls if c > s and c <= until]:
            until, why = after[0] - 1, f"line {flow.line[after[0]]} calls a program that may change it"
        found = _NUMBER.search(text)
        if found and which in frames:
            units, values = frames[which]
            other = units[(units > s) & (values != int(found.group(1)))]
            if len(other) and other[0] <= until:
                until, why = int(other[0]) - 1, f"line {flow.line[other[0]]} goes to a position in another frame"
    return until, why


def _frames_of_motions(program: LsProgram, flow: Flow) -> dict[str, tuple[IntArray, IntArray]]:
    """Units that are motions to a position of the file in a frame that it names, and that frame."""
    p = program.positions
    first = p.group <= 1
    order = np.argsort(p.number[first], kind="stable")
    number = p.number[first][order]
    unit, mention = flow.mention_unit, flow.mention
    if not len(number) or not len(mention):
        return {}
    at = np.clip(np.searchsorted(number, mention), 0, len(number) - 1)
    known = (number[at] == mention) & (flow.motion[unit] != NO_NUMBER)
    found = {}
    for name, column in (("UFRAME_NUM", p.uframe), ("UTOOL_NUM", p.utool)):
        value = column[first][order][at]
        named = known & (value != NO_NUMBER)
        found[name] = (unit[named], value[named])
    return found
