"""Which stations of a program may be corrected; all others pass through untouched, with the reason."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import BoolArray, IntArray
from compgen.core.units import DEG, MM
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.unsafe_statements import Unsafe, unsafe_statements
from compgen.fanuc.listing.listing import LsProgram, other_statements
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.listing.positions import decimal_places
from compgen.fanuc.vocabulary import (
    DIVERSIONS,
    FRAME_WRITTEN,
    INDIRECT_POSITION,
    POSITION,
    is_unknown,
    without_words,
    written_frames,
)
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.ways import singular_ways
from compgen.robot.configuration import parse_config
from compgen.robot.joint_path import elbow_margins, wrist_centre
from compgen.robot.robot import Robot

_CARRIED = "an extended axis moves on the way there, or may: the arm or the part is moved with it"
STEEPEST = 60.0  # [deg] of J4 or J6 for one of the tool, at most: with J5 at 1 deg
LONGEST_NUMBER = 17  # characters: 15 digits, which a float keeps, sign and point


Test = tuple[BoolArray, Callable[[int], str]]  # which rows of poses fail, and why


@dataclass(frozen=True, eq=False, slots=True)
class Scope:
    """What may change, and what may not and why."""

    free: BoolArray  # (S,) stations that may be corrected
    unsafe: tuple[Unsafe, ...]  # every statement or position that is passed through, or casts doubt on others


def read_scope(program: LsProgram, poses: Poses, traversal: DrivenProgram, robot: Robot | None) -> Scope:
    """Free stations, and the list of all that is passed through untouched.

    Args:
        program: Any program.
        poses: Those of its positions.
        traversal: Its stations.
        robot: Whose reach and limits hold positions; without one these are not looked at, and nothing is free.
    """
    p, m = program.positions, program.motions
    unsafe = list(unsafe_statements(program, poses.placements))
    named = {u.line for u in unsafe}
    line, driven = m.line[traversal.motion], set(traversal.pose.tolist())
    held = np.isin(line, list(named)) | (traversal.pose == NONE)
    unplaced = np.flatnonzero((traversal.pose == NONE) & ~np.isin(line, list(named)))
    untaught = _untaught(program, traversal, unplaced)
    unsafe += _motions(program, traversal, untaught, "its position has no numbers of group 1")
    listed_already = np.isin(traversal.pose, np.flatnonzero(poses.extended))  # already, at the position
    unsafe += _motions(program, traversal, np.flatnonzero(traversal.carried & ~held & ~listed_already), _CARRIED)
    held |= traversal.carried
    pose = np.maximum(traversal.pose, 0)
    row = poses.row[pose] if len(poses.row) else np.zeros(len(pose), dtype=np.int64)
    if len(poses.row) and robot is not None:
        held |= ~np.isfinite(poses.theta[pose]).all(axis=1)
    for k, reason in _unfit(program, poses, robot):
        i = int(poses.row[k])
        if k in driven and int(p.line[i]) not in named:
            unsafe.append(Unsafe(int(p.line[i]), f"P[{p.number[i]}]", reason))
    held |= np.isin(row, np.flatnonzero(np.isin(p.line, [u.line for u in unsafe])))
    for number, text in other_statements(program) if len(poses.row) else []:
        named_here = _around(without_words(text), program, row, settled=number in poses.placements.settled)
        new = named_here & ~held
        if number not in named:
            unsafe += _used_as_value(number, text, held=bool(new.any()))
        why = "writes its frame or tool" if FRAME_WRITTEN.search(text) else "uses its position as a value"
        unsafe += _motions(program, traversal, np.flatnonzero(new), f"line {number} {why}")
        held |= named_here
    for s, passed in singular_ways(robot, traversal) if robot is not None else []:
        for k, way in ((s, "there"), (int(traversal.origin[s]), "from there")):
            reason = f"the way {way} passes {passed}: joints may turn round for a small correction"
            unsafe += _motions(program, traversal, [] if held[k] else [k], reason)
            held[k] = True
    for start, end, why in _stretches(program):
        inside = (line > start) & (line < end)
        unsafe += _motions(program, traversal, np.flatnonzero(inside & ~held), f"it runs {why}")
        held |= inside
    unsafe += _untold_turns(program, poses, robot) if robot is not None else []
    return Scope(~held & (robot is not None), tuple(sorted(set(unsafe), key=lambda u: (u.line, u.reason))))


def _untaught(program: LsProgram, traversal: DrivenProgram, unplaced: IntArray) -> list[int]:
    """Those of some stations without a pose whose motion names only positions that are there."""
    defined = set(program.positions.number.tolist())
    position, motion = program.motions.position, traversal.motion
    return [s for s in unplaced.tolist() if defined.issuperset(position[int(motion[s])])]


def _motions(program: LsProgram, traversal: DrivenProgram, stations: IntArray | list[int], reason: str) -> list[Unsafe]:
    """The motions to some stations, which are passed through for a reason."""
    motions = [int(traversal.motion[s]) for s in stations]
    return [Unsafe(int(program.motions.line[i]), program.motion_text(i), reason) for i in motions]


def _used_as_value(number: int, text: str, *, held: bool) -> list[Unsafe]:
    """A statement on a line that holds stations, or may use any position as a value."""
    short, text = " ".join(text.rstrip("; ").split())[:60], without_words(text)
    if held:
        return [Unsafe(number, short, "it uses a position as a value, which is left as it is")]
    if is_unknown(text) and POSITION.search(text):
        return [Unsafe(number, short, "no statement that is known here: the position that it names is left as it is")]
    if INDIRECT_POSITION.search(text):
        return [Unsafe(number, short, "it may use any position as a value, corrected where the others are")]
    return []


def _untold_turns(program: LsProgram, poses: Poses, robot: Robot) -> list[Unsafe]:
    """Positions whose CONFIG does not tell a joint's turn: 180 deg from -180, or joint 3's where both are legal."""
    p, turning = program.positions, np.array(robot.controller.turn_joints) - 1
    # so near 180 deg the digits of W, P and R do not tell the side; some leave the last zeros out
    digit = 10.0 ** -decimal_places(program.data, p.span[p.six_of(poses.row)])[:, 3:].max(initial=0) * DEG
    steep = 1 / np.maximum(np.abs(np.sin(poses.theta[:, 4:5])), 1 / STEEPEST)
    untellable = digit * np.where(turning > 2, steep, 1.0)  # J1 turns as the tool does
    angle = robot.to_pendant(poses.theta)[:, turning]
    at_half = np.abs(np.abs(angle) - np.pi) < untellable
    untold = []
    for k, column in np.argwhere(at_half & ~poses.joint_form[:, None]).tolist():
        joint = f"J{turning[column] + 1}"
        if parse_config(p.config[poses.row[k]] or "")[1][column] == 0:
            taken = f"{angle[k, column] / DEG:.0f} is taken"
            reason = f"{joint} stands at 180 or -180 deg, CONFIG's 0 does not say at which; {taken}: compare it"
            untold.append((k, reason))
    elbow = poses.theta[:, 2]
    for k in np.flatnonzero((elbow - 2 * np.pi >= robot.lower[2]) & ~poses.joint_form).tolist():
        high = f"{elbow[k] / DEG:.0f}"
        where = f"at {high} or {elbow[k] / DEG - 360:.0f} deg"
        reason = f"J2 + J3 stands {where}, CONFIG does not say at which; {high} is taken: compare it"
        untold.append((k, reason))
    rows = poses.row.tolist()
    return [Unsafe(int(p.line[rows[k]]), f"P[{p.number[rows[k]]}]", reason) for k, reason in untold]


def _unfit(program: LsProgram, poses: Poses, robot: Robot | None) -> list[tuple[int, str]]:
    """Positions that are known but cannot be corrected, and why."""
    reason_of = {k: poses.arm_bases.reason[poses.arm_bases.which[k]] for k in np.flatnonzero(poses.extended).tolist()}
    tests = [*_arm_tests(poses, robot), *_number_tests(program, poses)] if robot else _number_tests(program, poses)
    for rows, why in tests:
        for k in np.flatnonzero(rows).tolist():
            reason_of.setdefault(k, why(k))
    return sorted(reason_of.items())


def _arm_tests(poses: Poses, robot: Robot) -> list[Test]:
    """Positions that the arm cannot take, or takes badly."""
    known = np.asarray(np.isfinite(poses.theta).all(axis=1))
    shoulder, elbow = np.full(len(poses.theta), np.inf), poses.margin.copy()
    shoulder[known] = np.abs(wrist_centre(robot, poses.theta[known])[:, 0])
    in_joints = known & poses.joint_form
    elbow[in_joints] = elbow_margins(robot, poses.theta[in_joints])
    with np.errstate(invalid="ignore"):
        over = np.maximum(robot.lower - poses.theta, poses.theta - robot.upper)
        wrist = np.abs(poses.theta[:, 4])
        far, flat = poses.margin < 0, elbow < robot.elbow_margin
    clear = np.full(len(poses.theta), np.inf)
    if robot.interference is not None:
        clear[known] = robot.interference.clearance(poses.theta[known])
    worst, beyond = np.argmax(over, axis=1), np.asarray(known & (over > 1e-9).any(axis=1))
    turned, stretched = np.asarray(known & (wrist < robot.wrist_margin)), np.asarray(known & flat)
    return [
        (far, lambda k: f"it is {-poses.margin[k] / MM:.1f} mm out of reach of {robot.name} in the posture it names"),
        (
            beyond,
            lambda k: (
                f"joint {robot.joint_names[worst[k]]} is {over[k].max() / DEG:.3f} deg beyond its limit on {robot.name}"
            ),
        ),
        (
            clear < -1e-9,
            lambda k: f"J2 and J3 are {-clear[k] / DEG:.3f} deg where {robot.name} hits itself (interference)",
        ),
        (
            turned,
            lambda k: f"J5 is {wrist[k] / DEG:.3f} deg from zero: J4 and J6 may swing round for a small correction",
        ),
        (stretched, lambda k: f"the arm is {elbow[k] / MM:.2f} mm from full stretch or fold"),
        (
            shoulder < robot.shoulder_margin,
            lambda k: (
                f"the wrist centre is {shoulder[k] / MM:.3f} mm from the J1 axis: J1 may swing round for a small "
                "correction; is it taught?"
            ),
        ),
    ]


def _number_tests(program: LsProgram, poses: Poses) -> list[Test]:
    """Positions whose numbers cannot be taken or written."""
    p, row = program.positions, poses.row
    complete = np.isfinite(p.value[p.six_of(row)]).all(axis=1)
    too_long = longest_numbers(program, row) > LONGEST_NUMBER
    in_known_frame = (poses.tool != NONE) & (poses.base != NONE)
    return [
        (too_long, lambda _: "it has a number of more digits than a controller writes"),
        (np.asarray(~complete & (in_known_frame | poses.joint_form)), lambda _: "one of its six numbers is missing"),
    ]


def longest_numbers(program: LsProgram, rows: IntArray) -> IntArray:
    """Characters of the longest number of each of some positions, rows of the program's table, (n,)."""
    return np.asarray(np.diff(program.positions.span[rows], axis=2).max(axis=(1, 2), initial=0))


def _around(text: str, program: LsProgram, row: IntArray, *, settled: bool) -> BoolArray:
    """Stations that a statement holds: it names their position, or writes their frame or tool and that is not known."""
    p = program.positions
    held = np.zeros(len(row), dtype=bool)
    for number in POSITION.findall(text):
        held |= p.number[row] == int(number or NO_NUMBER)
    held |= any(INDIRECT_POSITION.findall(text))
    for kind, number in written_frames(text)[:1] if not settled else []:
        held |= number is None or (p.uframe if kind == "UFRAME" else p.utool)[row] == number
    return held


def _stretches(program: LsProgram) -> list[tuple[int, int, str]]:
    """Line numbers between which the executed path is not the programmed one; an option of a motion may begin it."""
    stretches = []
    m = program.motions
    with_options = [
        (line, options)
        for line, options, off in zip(m.line.tolist(), m.options, m.disabled.tolist(), strict=True)
        if options and not off
    ]
    statements = [(line, without_words(text)) for line, text in sorted(other_statements(program) + with_options)]
    for diversion in DIVERSIONS:
        start: int | None = None
        for number, text in statements:
            if start is None and diversion.opens.search(text):
                start = number
            elif start is not None and diversion.closes.search(text):
                stretches.append((start, number, diversion.reason))
                start = None
        if start is not None:
            stretches.append((start, np.iinfo(np.int64).max, diversion.reason))
    return stretches
