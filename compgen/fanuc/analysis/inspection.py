"""What a program is: its motions, frames and positions, how long it runs, how near it comes to limits, what is unsafe.

Motions are taken as listed: jumps, calls and loops are not followed. Lengths and times need both ends in the file and
their frames known.

What a program tells of the robot it is for: names in its remarks, and positions that an arm cannot take.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.contradictions import contradictions
from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import arc_lengths, parse_speeds, pose_rows, read_traversal
from compgen.fanuc.analysis.unsafe_statements import Unsafe, unsafe_statements
from compgen.fanuc.analysis.watermark import mark_of
from compgen.fanuc.listing.lines import letters
from compgen.fanuc.listing.listing import LsProgram, other_statements
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.vocabulary import POSITION, RATES, TIMES, without_words
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.frames import Frames
from compgen.program.registers import Register
from compgen.robot.configuration import CONFIG
from compgen.robot.joint_path import wrist_centre
from compgen.robot.robot import Robot

_HALF = 32  # bits: two numbers in one
LONGEST_S = 1e9  # a time above is a slip of the pen, not a duration
_WORD = re.compile(r"[A-Za-z0-9]+")
_MOST_WORDS = 5  # that make up one name, as in LR Mate 200 iD 7L
#: FANUC's models, their blanks and marks left out
_MODEL = re.compile(
    r"(?:LR|ARC)MATE(?:\d{2,3}I[A-Z]?)?(?:\d+[A-Z]{0,2})?|(?:R\d{4}|M\d{1,4}|S\d{3}|P\d{2,3}|(?:CRX?|SR|DR)\d{1,2})I[ABCDFW](?:\d+(?!ST|ND|RD|TH|KG|MM|[DV])[A-Z]{0,2})?"
)
_SUFFIX = "[FHLMS][CH]?(?![A-Z0-9])"  # of FANUC's variants; behind a blank no other: 2ND, 20KG and 10MM name no arm
#: what goes on with a model's name: glued to it, the 4S of a series (200iD/4S), the H of M-710iC/50 H
_MORE = "|".join(
    (
        "[A-Z0-9]+",
        rf"(?<=I[A-Z])(?:/\d[A-Z0-9]*|[ /_-]*\d+{_SUFFIX})",
        rf"(?:(?<=I[A-Z])/|(?<=\d)[ /_-]*){_SUFFIX}(?![ -]\d)",  # and no other arm: M-710iC/50 M-20iA
    )
)
TOLERANCE = 1e-9  # [rad]


def inspect(
    program: LsProgram,
    robot: Robot | None,
    frames: Frames,
    registers: Mapping[int, Register] | None = None,
    find_program: Callable[[str], bytes | None] = lambda name: None,
) -> dict[str, Any]:
    """Everything ``cgen inspect`` says, in plain types.

    Args:
        program: Any program.
        robot: For limits, reach and singularities; without one nothing is said of them.
        frames: What UFRAME and UTOOL numbers mean.
        registers: Position registers when the program starts, by number.
        find_program: The listing of a program that this one calls, by its name in capitals; None where there is none.
    """
    around = ProgramContext(frames, registers or {}, called_programs(program, find_program))
    m, p = program.motions, program.positions
    active = np.flatnonzero(~m.disabled)
    via, goal = _targets(program, active)
    poses = around.poses(program, robot)
    length, duration, untimed = _travel(program, poses, active, via, goal)
    first = p.group <= 1
    traversal = read_traversal(program, poses, robot, around.called.motionless)
    scope = read_scope(program, poses, traversal, robot)
    mark = mark_of(program, poses, traversal, scope.free)
    number = p.number[poses.row]
    unsafe = [*scope.unsafe, *_unknown_frames(program, poses)]
    unsafe += contradictions(program, traversal, around.called)
    in_order = sorted(unsafe, key=lambda u: (u.line, u.reason))
    return {
        "name": program.name,
        "subtype": program.subtype,
        "comment": letters(dict(program.attributes).get("COMMENT", "")).strip('"'),
        "robot": robot.name if robot else None,
        "mark": mark.value,
        "bytes": len(program.data),
        "motions": dict(Counter(map(m.letter.__getitem__, active.tolist()))),
        "disabled_motions": int(m.disabled.sum()),
        "frames": _frames(p.uframe[first], p.utool[first]),
        "positions": {**_uses(program, np.concatenate([via, goal])), "joint_form": int(poses.joint_form.sum())},
        "path_length_mm": None if length is None else length / MM,
        "duration_s": duration,
        "motions_without_time": untimed,
        "postures": _postures(program, first),
        "limits": _limits(poses, number, robot) if robot else {},
        "out_of_reach": number[poses.margin < 0].tolist(),
        "unsafe": [{"line": u.line, "text": u.text, "reason": u.reason} for u in in_order],
    }


def _frames(uframe: IntArray, utool: IntArray) -> list[dict[str, int]]:
    """How many positions are in each frame with each tool; -1 stands for F."""
    pairs, counts = _distinct((uframe + 1 << _HALF) + utool + 1)
    return [
        {"uframe": (pair >> _HALF) - 1, "utool": (pair & (1 << _HALF) - 1) - 1, "positions": n}
        for pair, n in zip(pairs.tolist(), counts.tolist(), strict=True)
    ]


def _uses(program: LsProgram, targets: IntArray) -> dict[str, Any]:
    """Which positions are there, which of them motions and other statements name, and which are not there."""
    used, uses = _distinct(targets[targets >= 0])
    defined, _ = _distinct(program.positions.number)
    mentioned = [int(n) for _, text in other_statements(program) for n in POSITION.findall(without_words(text)) if n]
    read = np.isin(defined, used) | np.isin(defined, mentioned)
    return {
        "defined": len(defined),
        "used": int(read.sum()),
        "unused": defined[~read].tolist(),
        "shared": used[uses > 1].tolist(),
        "undefined": used[~np.isin(used, defined)].tolist(),
    }


def _distinct(numbers: IntArray) -> tuple[IntArray, IntArray]:
    """The different numbers in rising order, and how often each occurs."""
    ordered = np.sort(numbers)
    begins = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)])
    return ordered[begins], np.diff(np.append(begins, len(ordered)))


def _targets(program: LsProgram, active: IntArray) -> tuple[IntArray, IntArray]:
    """P numbers of the via point and of the end of each motion; NO_NUMBER where there is none in the file."""
    numbers = list(map(program.motions.position.__getitem__, active.tolist()))
    goal = np.array([n[-1] if n else NO_NUMBER for n in numbers], dtype=np.int64)
    return np.array([n[0] if len(n) > 1 else NO_NUMBER for n in numbers], dtype=np.int64), goal


def _postures(program: LsProgram, first: BoolArray) -> dict[str, int]:
    """How many positions have which letters."""
    p = program.positions
    configs = Counter(map(p.config.__getitem__, np.flatnonzero(first).tolist()))
    counts: Counter[str] = Counter()
    for config, count in configs.items():
        if config is not None:
            match = CONFIG.match(config)
            counts[" ".join(match.groups()[:3]) if match else config] += count
    return dict(counts)


def _travel(
    program: LsProgram, poses: Poses, active: IntArray, via: IntArray, goal: IntArray
) -> tuple[float | None, float | None, int]:
    """Length of lines and arcs [m], the motions' time at programmed speeds [s], and how many have none of their own.

    Summed are those that are known; None where there are some and none is known.
    """
    m = program.motions
    if not len(active):
        return 0.0, 0.0, 0
    stands = np.vstack([poses.tcp.position, np.full((1, 3), np.nan)])  # the last row: not known
    stands[:-1][poses.joint_form & (poses.tool == NONE)] = np.nan
    end, via_point = stands[pose_rows(poses, goal, active)], stands[pose_rows(poses, via, active)]
    start = np.vstack([stands[-1:], end[:-1]])
    letter = np.array(m.letter, dtype="U1")[active]
    step = np.linalg.norm(end - start, axis=1)
    arc = np.flatnonzero((letter == "C") & (via != NO_NUMBER))
    step[arc] = arc_lengths(start[arc], via_point[arc], end[arc])
    step[letter == "J"] = np.nan
    value, unit = (column[active] for column in parse_speeds(m.speed))
    units, which = np.unique(unit, return_inverse=True)
    rate = np.array([RATES.get(u, np.nan) for u in units.tolist()])[which]
    seconds = np.array([TIMES.get(u, np.nan) for u in units.tolist()])[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        duration = np.where(np.isfinite(seconds), value * seconds, step / (value * rate))
    timed = duration < LONGEST_S
    is_known = np.isfinite(step)
    return (
        float(step[is_known].sum()) if is_known.any() or (letter == "J").all() else None,
        float(duration[timed].sum()) if timed.any() else None,
        int((~timed).sum()),
    )


def _unknown_frames(program: LsProgram, poses: Poses) -> list[Unsafe]:
    """Frames and tools whose value is not known, told at their first position."""
    p = program.positions
    cartesian = (p.span[poses.row, :6, 1] > 0).any(axis=1) & ~p.remote[poses.row]
    findings = []
    for kind, numbers, known in (("uframe", p.uframe, poses.base), ("utool", p.utool, poses.tool)):
        rows = np.unique(poses.row[cartesian & (numbers[poses.row] >= 0) & (known == NONE)])
        for number, first, count in zip(*np.unique(numbers[rows], return_index=True, return_counts=True), strict=True):
            i = rows[first]
            others = f" and {count - 1} more" if count > 1 else ""
            reason = f"{kind} {number} is not known: give [{kind}.{number}] in a table with --frames"
            findings.append(Unsafe(int(p.line[i]), f"P[{p.number[i]}]{others}", reason))
    return findings


def _limits(poses: Poses, number: IntArray, robot: Robot) -> dict[str, Any]:
    """Closest distance of each joint to its limits, and to the singularities, with the position."""
    known = np.isfinite(poses.theta).all(axis=1)
    if not known.any():
        return {}
    theta, names = poses.theta[known], number[known]
    room = np.minimum(theta - robot.lower, robot.upper - theta) / DEG
    closest = room.argmin(axis=0)
    wrist = np.abs(theta[:, 4]) / DEG
    closest_to: dict[str, Any] = {
        name: {"room_deg": float(room[i, j]), "position": int(names[i])}
        for j, (name, i) in enumerate(zip(robot.joint_names, closest.tolist(), strict=True))
    }
    closest_to["wrist_singularity"] = {"room_deg": float(wrist.min()), "position": int(names[wrist.argmin()])}
    shoulder = np.abs(wrist_centre(robot, theta)[:, 0]) / MM
    closest_to["shoulder_singularity"] = {"room_mm": float(shoulder.min()), "position": int(names[shoulder.argmin()])}
    if robot.interference is not None:
        clearance = robot.interference.clearance(theta) / DEG
        i = int(clearance.argmin())
        closest_to["J2/J3 interference"] = {"room_deg": float(clearance[i]), "position": int(names[i])}
    margin: Array = poses.margin[known]
    if np.isfinite(margin).any():
        i = int(np.nanargmin(margin))
        closest_to["reach"] = {"room_mm": float(margin[i] / MM), "position": int(names[i])}
    return closest_to


@dataclass(frozen=True, slots=True)
class Unattainable:
    """Positions that plain motions drive to and that an arm cannot take."""

    positions: tuple[int, ...]  # n of P[n]
    driven: int  # so many are driven to and known


def robots_named(program: LsProgram, names: Sequence[str]) -> list[str]:
    """Those of some robots that a program's remarks or comment name, blanks and marks left out.

    M-710iC/50 is not named by M-710iC/50H, nor LR Mate 200iD by LR Mate 200iD/4S: other arms.
    """
    return [name for name in names if "" in _named_with(program, _plain(name))]


def other_models(program: LsProgram, robot: Robot) -> list[str]:
    """FANUC models that a program's remarks or comment name and that are not this robot's, nor of its family."""
    own = _plain(robot.name)
    if not _MODEL.fullmatch(own):
        return []  # a name of the user's own: no model to compare with
    models = [name for name in _names_in(program) if _MODEL.fullmatch(name)]
    others = [name for name in models if not (own.startswith(name) or name.startswith(own))]
    others += [own + more for more in _named_with(program, own) if more and _MODEL.fullmatch(own + more)]
    return sorted({name for name in others if not any(name != other and other.startswith(name) for other in others)})


def unattainable(program: LsProgram, poses: Poses, traversal: DrivenProgram, robot: Robot) -> Unattainable:
    """Positions out of reach or beyond a joint limit, where the motion drives to the position itself."""
    held = {u.line for u in unsafe_statements(program, poses.placements)}
    plain = (traversal.pose >= 0) & ~np.isin(program.motions.line[traversal.motion], list(held))
    rows = np.unique(traversal.pose[plain])
    rows = rows[~poses.extended[rows] & ~np.isin(poses.line[rows], list(held))]
    theta, far = poses.theta[rows], poses.margin[rows] < 0
    with np.errstate(invalid="ignore"):
        beyond = (np.maximum(robot.lower - theta, theta - robot.upper) > TOLERANCE).any(axis=1)
        beyond |= ~robot.is_clear(theta)
    known = np.isfinite(theta).all(axis=1) | far
    return Unattainable(tuple(poses.number[rows[far | beyond]].tolist()), int(known.sum()))


def _named_with(program: LsProgram, name: str) -> set[str]:
    """What the remarks and the comment say behind a plain name before the model's name ends: nothing, or 50's H."""
    says = re.compile(f"(?<![A-Z0-9]){'[^A-Z0-9]*'.join(name)}({_MORE})?")
    return {_plain(match[1] or "") for text in _texts(program) for match in says.finditer(text.upper())}


def _texts(program: LsProgram) -> list[str]:
    return [dict(program.attributes).get("COMMENT", ""), *program.remarks]


def _names_in(program: LsProgram) -> list[str]:
    """Words of the remarks and the comment, alone and with those that follow, in capitals."""
    runs = [[w.upper() for w in _WORD.findall(text)] for text in _texts(program)]
    return [
        "".join(words[i : i + n])
        for words in runs
        for i in range(len(words))
        for n in range(1, min(_MOST_WORDS, len(words) - i) + 1)
    ]


def _plain(name: str) -> str:
    return "".join(_WORD.findall(name)).upper()
