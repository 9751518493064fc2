r"""DrivenProgram of any program in the order listed: where the robot goes, and how long each way takes.

Times are those of one pass in the order listed; ``origin`` says where the robot surely comes from. A way of length l at
a speed v takes l / v, and no joint outruns its speed, as where the tool turns on the spot; a joint motion at p percent
takes the longest of its joints' turns over p percent of their speeds; a motion in seconds takes those. Every motion
takes whole interpolation periods where the controller rounds up, and at a stop what the robot's smoothing takes to
settle, of lines and joints alike; where that is not known, what is expected of its class. WAIT pauses.
"""

from collections.abc import Collection
from dataclasses import dataclass
from math import inf

import numpy as np

from compgen.core.arcs import arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG
from compgen.fanuc.analysis.flow_graph import station_origins
from compgen.fanuc.analysis.poses import Poses, step_motions
from compgen.fanuc.listing.listing import LsProgram, other_statements
from compgen.fanuc.listing.position_parser import NO_NUMBER
from compgen.fanuc.listing.positions import position_rows
from compgen.fanuc.vocabulary import CONSTANT_SPEED, FLOW, PERCENT, RATES, TIMES, TURN_RATE, UNTIMED, WAIT
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.extended_axes import SAME_VALUE
from compgen.program.ways import joint_way_lengths
from compgen.robot.robot import Robot

ASSUMED = {"J": 0.25, "L": 0.1}  # share of joint speed, m/s: where a program leaves the speed to run time


def read_traversal(
    program: LsProgram, poses: Poses, robot: Robot | None, motionless: Collection[str] = frozenset()
) -> DrivenProgram:
    """Stations and times of a program.

    Args:
        program: Any program.
        poses: Of its positions.
        robot: Whose speeds and smoothing; without one no time is known that hangs on joints.
        motionless: Programs, in capitals, of which it is known that they do not move the arm.
    """
    m = program.motions
    active = np.flatnonzero(~m.disabled).tolist()
    motion = np.array([i for i in active for _ in m.position[i]], dtype=np.int64)
    number = np.array([n for i in active for n in m.position[i]], dtype=np.int64)
    last = np.append(motion[1:] != motion[:-1], True) if len(motion) else np.zeros(0, dtype=bool)
    pose = np.where(step_motions(program)[motion], NONE, pose_rows(poses, number, motion))
    letter = np.array(m.letter, dtype="U1")[motion]
    stops = np.array([t.upper().replace(" ", "") in ("FINE", "CNT0", "") for t in m.termination], dtype=bool)
    stop = last & stops[motion]
    known = pose != NONE
    position, theta = np.full((len(pose), 3), np.nan), np.full((len(pose), 6), np.nan)
    position[known], theta[known] = poses.tcp.position[pose[known]], poses.theta[pose[known]]
    length = _lengths(position, letter == "C", last)
    if robot is not None:
        turned = np.flatnonzero((letter == "J")[1:] & known[1:] & known[:-1]) + 1
        length[turned] = joint_way_lengths(robot, poses, pose[turned - 1], pose[turned])
    turn = np.abs(np.diff(theta, axis=0, prepend=np.nan))
    ways = _Ways(letter=letter, length=length, turn=turn, angle=_angles(poses, pose))
    value, unit = (column[motion] for column in parse_speeds(m.speed))
    written, untimed = _written(ways, value, unit, robot)
    beside = np.zeros(len(last)) if robot is None else _beside(written, last, stop, robot)
    others = other_statements(program)
    pause, flow = _others(others, m.line[motion])
    waits = [number for number, text in others if UNTIMED.match(text)]
    origin = _known_origins(station_origins(program, motion, motionless, poses.placements.shifted), known)
    carried = _carried(poses, pose, origin)
    # how fast an axis or another group moves is not told; the first way is never counted
    untimed[1:] |= carried[1:] | _other_groups_move(program, number)
    return DrivenProgram(
        at=poses,
        motion=motion,
        pose=pose,
        joint=letter == "J",
        line=letter == "L",
        via=~last,
        stop=stop,
        length=length,
        written=np.nan_to_num(written),
        duration=np.nan_to_num(written + beside),
        pause=pause[:-1],
        rest=float(pause[-1]),
        untimed=tuple(sorted({*m.line[motion[untimed]].tolist(), *waits})),
        flow=flow,
        origin=np.where(carried, NONE, origin),
        carried=carried,
        circular=np.zeros(len(motion), dtype=bool),
        beyond=np.zeros(len(motion)),
    )


def _known_origins(origin: IntArray, known: BoolArray) -> IntArray:
    """The stations that others come from, NONE also where the place of one is not known, (S,)."""
    return np.where(known[origin] & (origin != NONE), origin, NONE) if len(origin) else origin


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Ways:
    """What the time of the way to each of S stations hangs on."""

    letter: np.ndarray  # (S,) of the motion
    length: Array  # (S,) [m]
    turn: Array  # (S, 6) [rad] of the joints
    angle: Array  # (S,) [rad] of the tool


def _written(ways: _Ways, value: Array, unit: np.ndarray, robot: Robot | None) -> tuple[Array, BoolArray]:
    """How long each way takes at its programmed speed, (S,) [s], and where that is not known."""
    percent = unit == PERCENT
    rate = np.array([RATES.get(u, np.nan) for u in unit.tolist()])
    seconds = np.array([TIMES.get(u, np.nan) for u in unit.tolist()])
    with np.errstate(invalid="ignore", divide="ignore"):
        speed = np.where(np.isfinite(rate), value * rate, ASSUMED["L"])
        share = np.where(percent, value / 100, ASSUMED["J"])
        fastest = (ways.turn / (1.0 if robot is None else robot.speed)).max(axis=1)
        along = np.fmax(ways.length / speed, fastest)
        turning = np.fmax(ways.angle / (value * DEG), fastest)
        duration = np.where(ways.letter == "J", fastest / share, np.where(unit == TURN_RATE, turning, along))
    duration = np.where(np.isfinite(seconds), value * seconds / np.where(ways.letter == "C", 2, 1), duration)
    duration = np.where(np.isfinite(duration), duration, np.nan)
    untimed = ~(np.isfinite(rate) | percent | np.isfinite(seconds) | (unit == TURN_RATE))
    untimed[1:] |= ~np.isfinite(duration[1:])  # where a program starts from is never known
    return duration, untimed


def _beside(written: Array, last: BoolArray, stop: BoolArray, robot: Robot) -> Array:
    """What ways take beside their written times (S,) [s]: the rest of a period, and at a stop until all has settled.

    Args:
        written: Of the ways.
        last: Those that end a motion, (S,).
        stop: Those that end at rest, (S,).
        robot: Its periods and its smoothing.
    """
    ends, beside = np.flatnonzero(last), np.zeros(len(written))
    taken = np.asarray(np.bincount(np.cumsum(last) - last, written), dtype=float)
    whole = robot.controller.line_time(taken)
    begins = np.insert(stop[ends], 0, True)[:-1]
    run = np.cumsum(begins) - 1
    moves = np.bincount(run, taken)[run] != 0
    motion = robot.expected_motion.expected if robot.motion is None else robot.motion
    short, long = (motion.in_run(first).settling for first in (0.0, inf))
    beside[ends] = whole - taken + stop[ends] * moves * np.where(whole[begins][run] > motion.long, long, short)
    return beside


def _carried(poses: Poses, pose: IntArray, origin: IntArray) -> BoolArray:
    """Stations on the way to which an extended axis may move, (S,): where that is not sure, if it moves at all."""
    axes = poses.arm_bases.axes
    driven = axes[pose[pose != NONE]]
    if not np.isfinite(driven).any():
        return np.zeros(len(pose), dtype=bool)
    at = np.where((pose != NONE)[:, None], axes[pose], np.nan)
    lowest, highest = np.fmin.reduce(driven, axis=0), np.fmax.reduce(driven, axis=0)
    somewhere = (highest - lowest > SAME_VALUE).any()
    step = np.abs(at - at[origin])
    moved = (step > SAME_VALUE).any(axis=1) | (np.isnan(at) != np.isnan(at[origin])).any(axis=1)
    return np.asarray(np.where(origin != NONE, moved, somewhere) & np.isfinite(at).any(axis=1))


def _other_groups_move(program: LsProgram, number: IntArray) -> BoolArray:
    """Where a group besides the arm stands elsewhere at a position P[number] than at the one before, (S - 1,)."""
    p, moves = program.positions, np.zeros(max(len(number) - 1, 0), dtype=bool)
    for group in np.unique(p.group[p.group > 1]).tolist():
        rows = np.flatnonzero(p.group == group)
        at = position_rows(number, p.number[rows])
        value = np.where((at != NO_NUMBER)[:, None], p.value[rows[at]], np.nan)
        moves |= (np.abs(np.diff(value, axis=0)) > SAME_VALUE).any(axis=1)
        moves |= np.diff(np.isnan(value), axis=0).any(axis=1)
    return moves


def pose_rows(poses: Poses, number: IntArray, motion: IntArray) -> IntArray:
    """Row of ``Poses`` for each position that a motion drives to, as the motion places it; NONE where it is not there.

    Args:
        poses: Of a program.
        number: n of P[n], (S,).
        motion: In the program's table of motions, (S,).
    """
    rows = position_rows(number, poses.number)
    placement = poses.placements.of_motion
    for s in np.flatnonzero(np.isin(motion, list(placement))).tolist() if placement else []:
        rows[s] = poses.placed.get((int(number[s]), placement[int(motion[s])]), NONE)
    return rows


def _lengths(position: Array, circular: BoolArray, last: BoolArray) -> Array:
    """Length of the way to each station, (S,) [m]; of a C to its via, and from there to its end."""
    before = np.vstack([np.full((1, 3), np.nan), position[:-1]])
    length = np.linalg.norm(position - before, axis=1)
    via = np.flatnonzero(circular & ~last)
    halves = arcs_through(before[via], position[via], position[via + 1]).lengths
    curved = np.isfinite(halves).all(axis=1)
    length[via[curved]], length[via[curved] + 1] = halves[curved].T
    return np.asarray(length)


def arc_lengths(a: Array, b: Array, c: Array) -> Array:
    """Length of the circle arcs from a through b to c, (N,) [m]; the straight way where they are in line."""
    lengths = arcs_through(a, b, c).lengths.sum(axis=1)
    straight = np.linalg.norm(b - a, axis=1) + np.linalg.norm(c - b, axis=1)
    return np.asarray(np.where(np.isfinite(lengths), lengths, straight))


def _angles(poses: Poses, pose: IntArray) -> Array:
    """Turn of the tool on the way to each station, (S,) [rad]."""
    if not len(poses.row) or not len(pose):
        return np.full(len(pose), np.nan)
    after, before = pose[1:], pose[:-1]
    turn = rotation_vector((poses.tcp[before].inverse() @ poses.tcp[after]).rotation)
    known = (after != NONE) & (before != NONE)
    return np.concatenate([[np.nan], np.where(known, np.linalg.norm(turn, axis=1), np.nan)])


def parse_speeds(texts: tuple[str, ...]) -> tuple[Array, np.ndarray]:
    """Number and unit of each speed; NaN and "" where run time decides."""
    parsed: dict[str, tuple[float, str]] = {}
    for text in set(texts):
        match = CONSTANT_SPEED.match(text)
        parsed[text] = (float(match[1]), match[2].lower()) if match else (np.nan, "")
    pairs = list(map(parsed.__getitem__, texts))
    return np.array([p[0] for p in pairs]), np.array([p[1] for p in pairs], dtype="U8")


def _others(statements: list[tuple[int, str]], line: IntArray) -> tuple[Array, tuple[int, ...]]:
    """Pause before each station and behind the last (S + 1,) [s], and lines of statements that may change the order."""
    pause, flow = np.zeros(len(line) + 1), []
    for number, text in statements:
        if FLOW.match(text):
            flow.append(number)
        elif wait := WAIT.match(text):
            pause[np.searchsorted(line, number)] += float(wait[1])
    return pause, tuple(flow)
