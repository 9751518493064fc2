"""Which statements of a program make an off-line correction unsafe, and why, line by line.

The correction is computed for the place, frame and tool that the file names. Whatever moves them at run time, or names
a place that the file does not hold, is passed through untouched and reported.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.findings import printable
from compgen.fanuc.analysis.placements import Placements
from compgen.fanuc.listing.lines import letters, line_of
from compgen.fanuc.listing.listing import LsProgram, head_text, other_statements
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.motion_options import offsets_of, unsafe_options, without_offsets
from compgen.fanuc.vocabulary import OFFSET_CONDITIONS, UNSAFE_HEADERS, is_unknown, unsafe_words, without_words
from compgen.robot.configuration import CONFIG

AS_LISTED = Placements()


@dataclass(frozen=True, slots=True)
class Unsafe:
    """A statement that is not corrected, or that casts doubt on the correction of others."""

    line: int
    text: str
    reason: str

    def __post_init__(self) -> None:
        for field in ("text", "reason"):
            object.__setattr__(self, field, printable(letters(getattr(self, field))))


def unsafe_statements(program: LsProgram, placements: Placements = AS_LISTED) -> tuple[Unsafe, ...]:
    """Statements, positions and headers that make a correction unsafe, in order of line.

    Args:
        program: Any program.
        placements: How motions place positions: what is known of offsets and of frames that are written.
    """
    motions = _motions(program, placements)
    findings = [*motions, *_positions(program), *_others(program, placements), *_headers(program)]
    return tuple(sorted(set(findings), key=lambda u: (u.line, u.reason)))


def _motions(program: LsProgram, placements: Placements) -> list[Unsafe]:
    m = program.motions
    defined = set(program.positions.number.tolist())
    why = {options: unsafe_options(options) for options in set(m.options)}
    beside = {o: unsafe_options(without_offsets(o)) for o in why if o and offsets_of(o)}  # reasons but for offsets
    doubtful = [
        i
        for i, (numbers, options, speed, off) in enumerate(
            zip(m.position, m.options, m.speed, m.disabled.tolist(), strict=True)
        )
        if not (off or (numbers and speed and not why[options] and defined.issuperset(numbers)))
    ]
    doubtful = sorted({*doubtful, *placements.unknown})
    findings = []
    for i in doubtful:
        reasons = []
        for target, number in zip(m.target[i], m.position[i], strict=True):
            if number == NO_NUMBER:
                reasons.append(f"{target}: its value is not in the file")
            elif number not in defined:
                reasons.append(f"{target} is used but not defined")
        if not m.target[i]:
            reasons.append("its target is not understood")
        reasons += beside.get(m.options[i], why[m.options[i]])
        if i in placements.unknown:
            reasons.append(placements.unknown[i])
        elif m.options[i] in beside and i not in placements.shifted:
            reasons = [*reasons, *(r for r in why[m.options[i]] if r not in reasons)]
        if not m.speed[i]:
            reasons.append("its speed is not understood")
        text = program.motion_text(i)
        findings += [Unsafe(int(m.line[i]), text, reason) for reason in reasons]
    return findings


def _positions(program: LsProgram) -> list[Unsafe]:
    p = program.positions
    given = p.span[:, :, 1] > 0
    untaught = ~given.any(axis=1) | (given & np.isnan(p.value)).any(axis=1)
    cartesian = given[:, :6].any(axis=1)
    open_frame = (p.uframe == NO_NUMBER) | (p.utool == NO_NUMBER)
    valid = {config: config is not None and bool(CONFIG.match(config)) for config in set(p.config)}
    posture = np.array([valid[config] for config in p.config], dtype=bool)
    findings = []
    for rows, reason in (
        (untaught, "it is not taught (****)"),
        (p.remote, "remote TCP (RX to RR): the robot carries the part to a tool that stands still"),
        (cartesian & open_frame & ~p.remote, "UF : F or UT : F takes the frame that is active at run time"),
    ):
        findings += [Unsafe(int(p.line[i]), f"P[{p.number[i]}]", reason) for i in np.flatnonzero(rows & (p.group <= 1))]
    for i in np.flatnonzero(cartesian & ~posture & (p.group <= 1)):
        reason = f"CONFIG '{p.config[i] or ''}' does not name a posture of this arm"
        findings.append(Unsafe(int(p.line[i]), f"P[{p.number[i]}]", reason))
    return findings


def _others(program: LsProgram, placements: Placements) -> list[Unsafe]:
    """Statements that are neither motion nor remark."""
    m = program.motions
    active_options = {
        options
        for i, (options, disabled) in enumerate(zip(m.options, m.disabled.tolist(), strict=True))
        if not disabled and i not in placements.shifted
    }
    conditions = [c for c in OFFSET_CONDITIONS if any(map(c.option.search, active_options))]
    findings = []
    for number, text in other_statements(program):
        reasons = unsafe_words(without_words(text), frames=number not in placements.settled)
        reasons += [c.reason for c in conditions if c.pattern.match(text)]
        if program.is_german and is_unknown(text):
            reasons.append("a macro, or a German word that is not known: it may change the executed path")
        if reasons:
            short = " ".join(text.rstrip("; ").split())[:60]
            findings += [Unsafe(number, short, reason) for reason in reasons]
    return findings


def _headers(program: LsProgram) -> list[Unsafe]:
    head = head_text(program)
    findings = [
        Unsafe(line_of(program.data, match.start()), " ".join(match[0].split()), header.reason)
        for header in UNSAFE_HEADERS
        if (match := header.pattern.search(head))
    ]
    mask = dict(program.attributes).get("DEFAULT_GROUP", "1")
    if len(program.motions.line) and "1" not in mask:
        findings.append(
            Unsafe(
                line_of(program.data, max(head.find("DEFAULT_GROUP"), 0)), f"DEFAULT_GROUP = {mask}", "no motion group"
            )
        )
    return findings
