"""Courses of programs: of text as compgen writes it, its pages among them, and of anyone's as far as it can be known.

Motions are taken as listed. A joint motion, one of A or S, a motion whose target the file does not tell, and one of
which it is not sure where it comes from lead along a way that no log is judged on.
"""

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, lengths_along
from compgen.core.exceptions import CompgenError, InputError, naming_file
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import PERCENT
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.poses import Poses, require_frames
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.canonical.reader import interpret
from compgen.fanuc.listing.listing import LsProgram, loads, other_statements
from compgen.fanuc.paging.join_check import called_pages as called_pages
from compgen.fanuc.paging.join_check import interpret_pages
from compgen.fanuc.vocabulary import UNTIMED_WAIT
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.frames import Frames
from compgen.program.program import Program
from compgen.program.registers import Register
from compgen.robot.configuration import apply_turns
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse, at_numbers, divided
from compgen.verification.twin.timing import time_program

SHORTEST = 1e-9  # m
CNT = re.compile(r"CNT\s*(\d+)", re.IGNORECASE)
SLOWER = re.compile(rb"CNT\s*(?!100\b)\d+", re.IGNORECASE)  # of a text of lines that is not compgen's: they wait


def listing_of(content: bytes, file: str) -> LsProgram:
    """A program's listing; what is refused of it names its file."""
    with naming_file(file):
        return loads(content)


def course_of_text(
    data: bytes,
    robot: Robot,
    frames: Frames,
    registers: dict[int, Register] | None = None,
    find_program: Callable[[str], bytes | None] = lambda name: None,
) -> ProgramCourse:
    """The course of a program.

    Args:
        data: Its listing.
        robot: Whose joints and speeds.
        frames: What UF and UT numbers mean.
        registers: Position registers when it starts, by number.
        find_program: The listing of a program that it calls, by name in capitals; None where there is none.

    Raises:
        InputError: Not a program, a frame that is not known, or nothing in it that a log can be laid along.
    """
    program = canonical_program(data, find_program)
    if program is not None and len(program.position) > 1 and not SLOWER.search(data):
        return _canonical_course(program, robot, frames)
    listing = loads(data)
    around = ProgramContext(frames, registers or {}, called_programs(listing, find_program))
    poses = around.poses(listing, robot)
    require_frames(listing, poses)
    return course_of_driven(listing, robot, poses, read_traversal(listing, poses, robot, around.called.motionless))


def canonical_program(data: bytes, find_program: Callable[[str], bytes | None]) -> Program | None:
    """The program that canonical text, or a main program with its pages, means; None for anyone else's."""
    with suppress(CompgenError):
        return read_canonical(data, find_program)
    return None


def read_canonical(data: bytes, find_program: Callable[[str], bytes | None]) -> Program:
    """The program that canonical text, or a main program with its pages, means.

    Raises:
        JoinError: A page is missing, or does not go on where the one before stops.
        InputError: It is anyone else's.
    """
    try:
        return interpret(data)
    except InputError:
        names = called_pages(data)
        if not names:
            raise
    pages = {name: text for name in names if (text := find_program(name.upper())) is not None}
    return replace(interpret_pages(data, pages)[0], name=loads(data).name)


def _canonical_course(program: Program, robot: Robot, frames: Frames) -> ProgramCourse:
    """The course of a program of straight lines, and arcs, in one frame with one tool."""
    known = ("uframe", program.uframe, frames.uframe), ("utool", program.utool, frames.utool)
    for kind, number, table in known:
        if number not in table:
            raise InputError(
                f"program {program.name}: its positions are in {kind} {number}, whose value is not known; give "
                f"[{kind}.{number}] in a table with --frames, or SYSFRAME.VA of a backup"
            )
    frame, tool = frames.uframe[program.uframe], frames.utool[program.utool]
    pose = frame @ Pose(program.position, program.rotation)
    in_world = replace(program, position=pose.position, rotation=pose.rotation)
    theta, _ = solve_tool(robot, pose, tool, program.posture)
    theta = apply_turns(robot, theta, program.turns)
    length = np.maximum(in_world.lengths(), SHORTEST)
    planned = time_program(robot, in_world, length, theta).time
    S, N = len(length), len(planned)
    via = program.via
    nodes = {
        "position": pose.position,
        "judged": np.ones(S, dtype=bool),
        "cruise": cumulated(length / program.speed),
        "planned": planned,
        "stop": program.fine,
        "kept": np.where(program.fine, 0.0, 1.0),
        "wait": np.zeros(N),
        "waits": np.zeros(N, dtype=bool),
        "number": np.arange(1, N + 1),
        "theta": theta,
    }
    numbers = program.uframe, program.utool
    course = _course(nodes, pose.rotation, via, frame, tool, numbers, robot)
    return replace(course, settles=robot.motion is not None and robot.motion.is_smooth)


def _course(
    nodes: dict[str, Any],
    rotation: Array,
    via: BoolArray,
    frame: Pose,
    tool: Pose,
    numbers: tuple[int, int],
    robot: Robot,
) -> ProgramCourse:
    """A course of positions, with nodes on its arcs; an orientation there is that of the nearest position."""
    number, position = divided(nodes["position"], via)
    base, nearest = np.floor(number).astype(np.int64), np.rint(number).astype(np.int64)
    columns: dict[str, Any] = {}
    for name in ("stop", "wait", "waits", "number"):
        columns[name] = np.where(number % 1 > 0, 0, nodes[name][base]).astype(nodes[name].dtype)
    for name in ("cruise", "planned", "theta"):
        columns[name] = at_numbers(nodes[name], number)
    columns["kept"] = np.where(number % 1 > 0, 1.0, nodes["kept"][base])
    return ProgramCourse(
        position=position,
        rotation=rotation[nearest],
        arc=lengths_along(position),
        judged=nodes["judged"][base[:-1]],
        statement=(np.cumsum(~via) - 1)[base[:-1]],
        **columns,
        frame=frame,
        tool=tool,
        numbers=numbers,
        period=robot.controller.period,
        counted=robot.controller.rounds_up_to_period,
    )


def course_of_driven(program: LsProgram, robot: Robot, poses: Poses, drive: DrivenProgram) -> ProgramCourse:
    """The course of anyone's program, its motions as listed, of its poses and as it is driven.

    Raises:
        InputError: Nothing in it that a log can be laid along.
    """
    at = known_stations(poses, drive)
    if len(at) < 2:
        raise InputError(
            f"program {program.name}: it has fewer than two motions to positions that the file tells; a log cannot be "
            "laid along it"
        )
    pose = drive.pose[at]
    follows = np.diff(at) == 1  # the next station is the one before and no unknown lies between
    judged = follows & _surely_driven(drive, at[1:]) & (poses.tool[pose[1:]] == poses.tool[pose[:-1]])
    via = drive.via[at] & np.append(judged, False) & np.append(False, judged)
    # a way along unknown places, and the first one, take what they take
    pause = drive.pause.copy()
    for station, drives in drive.called.items():
        pause[station] += np.nansum([its.rest for its in drives])
    planned, written = (np.cumsum(pause + each)[at] for each in (drive.duration, drive.written))
    wait = np.append(np.where(follows, pause[at[1:]], 0.0), 0.0)
    rests = drive.stop[at] | (at == len(drive.pose) - 1)  # at its end a program rests, whatever its last line says
    nodes = {
        "position": poses.tcp.position[pose],
        "judged": judged,
        "cruise": cumulated(np.diff(written) - wait[:-1]),
        "planned": planned - planned[0],
        "stop": rests | ~np.append(False, judged) | ~np.append(judged, False),
        "kept": np.where(rests, 0.0, _kept_speed(np.array(program.motions.termination)[drive.motion[at]])),
        "wait": wait,
        "waits": (wait > 0) | _waits_for_signals(program, drive, at),
        "number": poses.number[pose].astype(np.int64),
        "theta": poses.theta[pose],
    }
    usual, frames_and_tools = _usual(poses, pose[1:][judged] if judged.any() else pose)
    base, tool = int(poses.base[usual]), int(poses.tool[usual])
    p, row = program.positions, poses.row[usual]
    numbers = int(max(p.uframe[row], 0)), int(max(p.utool[row], 0))
    frame = IDENTITY if base == NONE else poses.bases[base]
    tools = IDENTITY if tool == NONE else poses.tools[tool]
    course = _course(nodes, poses.tcp.rotation[pose], via, frame, tools, numbers, robot)
    several_frames, several_tools = (count > 1 for count in frames_and_tools)
    course = replace(course, elsewhere=_elsewhere(poses.tool[pose], judged, nodes["position"]), flow=drive.flow)
    return replace(course, settles=True, several_frames=several_frames, several_tools=several_tools)


def _waits_for_signals(program: LsProgram, drive: DrivenProgram, at: IntArray) -> BoolArray:
    """Stations at which the program waits for as long as run time or an operator decides, of some, (n,)."""
    lines = [number for number, text in other_statements(program) if UNTIMED_WAIT.match(text)]
    behind = np.searchsorted(np.array(program.motions.line)[drive.motion[at]], lines)
    return np.isin(np.arange(1, len(at) + 1), behind)


def _elsewhere(tool: IntArray, judged: BoolArray, position: Array) -> tuple[float, float]:
    """Ways before the first judged one, and behind the last, that another tool begins or ends [m]: home, mostly."""
    sure, changed, arc = np.flatnonzero(judged), np.flatnonzero(np.diff(tool)) + 1, lengths_along(position)
    if not len(sure):
        return 0.0, 0.0
    before, behind = changed[changed <= sure[0]], changed[changed > sure[-1] + 1]
    return float(arc[before].max(initial=0.0)), float((arc[-1] - arc[behind - 1]).max(initial=0.0))


def known_stations(poses: Poses, drive: DrivenProgram) -> IntArray:
    """Stations at places that the file tells, in order: the named nodes of the program's course, (n,)."""
    at = np.flatnonzero(drive.pose != NONE)
    return at[np.isfinite(poses.tcp.position[drive.pose[at]]).all(axis=1)]


def chained_lines(program: LsProgram) -> list[int]:
    """Lines of A and S, along whose ways no course leads: nothing knows the curve."""
    m = program.motions
    return [int(m.line[i]) for i in np.flatnonzero(~m.disabled).tolist() if m.letter[i] in "AS"]


def _usual(poses: Poses, ends: IntArray) -> tuple[int, tuple[int, int]]:
    """A pose in the frame and tool of most: home may stand in others; and in how many frames and tools they are."""
    pairs = np.column_stack([poses.base, poses.tool])[ends]
    kinds, first, count = np.unique(pairs, axis=0, return_index=True, return_counts=True)
    return int(ends[first[np.argmax(count)]]), (len(np.unique(kinds[:, 0])), len(np.unique(kinds[:, 1])))


def _kept_speed(termination: NDArray[np.str_]) -> Array:
    """n / 100 of CNT n, (N,); 1 of words that are none."""
    word, which = np.unique(termination, return_inverse=True)
    digits = [match[1] if (match := CNT.fullmatch(text.strip())) else "100" for text in word.tolist()]
    return np.asarray(np.array(digits, dtype=float) * PERCENT)[which]


def _surely_driven(drive: DrivenProgram, station: IntArray) -> BoolArray:
    """Stations reached on a straight line, or on the arc of a C, from the one that is listed before."""
    ends_arc = drive.via[station - 1]
    sure = (drive.origin[station] == station - 1) | ends_arc
    return np.asarray(sure & (drive.line[station] | drive.via[station] | ends_arc))
