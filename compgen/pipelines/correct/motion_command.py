r"""What a program that exists is commanded off its path against the controller's motion: chains of short lines, arcs.

A run, from a stop to the next, is commanded as ``generate`` would (``compensation.predistortion``), where its positions
may be moved. Held, as corners are, is what a few positions cannot say or nobody knows: both ends of a straight line
that takes longer than the shortest window, a position behind which CNT n < 100 or a pause waits, whose statement has
options, that does not change, or that other motions place elsewhere. Each run is then judged by its written text, flown
through the moving means: with x the smoothed place and p the text's own without the command,

    |x_commanded - p| <= |x_plain - p| + WORSE

at every position and between two. A run that breaks it, gains little, or takes longer, stays as it is.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from compgen.compensation.predistortion import Commanded, bent_runs, predistortion
from compgen.core.arrays import Array, BoolArray, IntArray, rms, row_norms
from compgen.core.exceptions import InputError
from compgen.core.finding_codes import Code, Level
from compgen.core.findings import Finding
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import UM, counted
from compgen.fanuc import LsProgram
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.editing.insertion import insert_remark, says_override
from compgen.fanuc.editing.shared_positions import SharedCorrections, average_shared, fixed_positions
from compgen.job.bounds import Bounds
from compgen.job.job import Cell
from compgen.pipelines.correct.proof import Residue
from compgen.pipelines.correct.result import Correction, CorrectionPlan, MotionCommand
from compgen.pipelines.correct.station_corrections import solved_after
from compgen.pipelines.files.program_course import chained_lines, course_of_driven, known_stations
from compgen.pipelines.findings.motion_findings import WHAT, motion_of_a_listing, motion_words
from compgen.pipelines.planned.program_text import running_override
from compgen.program.driven import DrivenProgram
from compgen.robot.joint_path import nearest_turns
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.course_motion import course_motion, led_beside, statement_durations
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.motion_effect import MotionEffect

WORSE = 1 * UM  # what the digits and the places between may add
GAIN = 0.9  # of what the tool is led off, rms, may stay at most
SLOWER = 1.005  # times as long, of a run
BETWEEN, BETWEEN_ON_ARCS = 4, 64  # places from each position to the next, that one not among them
ROUNDS = 4  # of leaving runs out
SETS_SPEED = re.compile(rb"OVERRIDE|MAX_SPEED")  # of all that comes behind
NOTHING = Residue(0.0, 0.0)


def motion_command(
    plan: CorrectionPlan, robot: Robot, largest: float, course_of: Callable[[Array], ProgramCourse | None]
) -> MotionCommand | None:
    """What a program is commanded off its path; None where the robot's motion is not commanded against.

    Args:
        plan: The program with its correction.
        robot: With its motion.
        largest: No position is commanded farther off [m].
        course_of: The course of the text that is written with a shift of the stations, (S, 6); None of one without.
    """
    none, motion = np.zeros((len(plan.free), 6)), robot.motion
    if motion is None or not motion.may_predistort or motion.space == "joint" or (course := course_of(none)) is None:
        return None
    stations, named = known_stations(plan.poses, plan.drive), np.flatnonzero(course.number > 0)
    held, kept = _held(plan, course, stations, named, motion), []
    shift, runs, clocks = none.copy(), [], statement_durations(course, robot)
    stops = np.flatnonzero(course.stop).tolist()
    for first, last in zip(stops[:-1], stops[1:], strict=True):
        inside = (named >= first) & (named <= last)
        path = _commanded(course, clocks, slice(first, last + 1), held)
        if not (course.judged[first:last].all() and bent_runs(motion, path).any()):
            continue
        if why := _why_not(plan, stations[inside], motion, path):
            kept.append(why)
            continue
        off = predistortion(robot, IDENTITY, path, largest)
        moved = inside & ~held[named]
        shift[stations[moved], :3] = off[named[moved] - first]
        runs.append((int(stations[inside][0]), int(stations[inside][-1])))
    return _nearer(MotionCommand(shift, tuple(runs), NOTHING, NOTHING, tuple(kept)), course, robot, stations, course_of)


def _nearer(
    wanted: MotionCommand,
    course: ProgramCourse,
    robot: Robot,
    stations: IntArray,
    course_of: Callable[[Array], ProgramCourse | None],
) -> MotionCommand:
    """What is left of a command where runs that it does not bring nearer to their path stay as they are."""
    between = BETWEEN if (course.number > 0).all() else BETWEEN_ON_ARCS
    at = np.repeat(stations[:-1], between)
    time, place, led = _flown(course, robot, between)
    before, shift, runs, kept = row_norms(led), wanted.shift.copy(), wanted.runs, list(wanted.kept)
    for _ in range(ROUNDS):
        commanded = course_of(shift) if runs else None
        if commanded is None:
            break
        late, moved, led = _flown(commanded, robot, between)
        after = row_norms(moved + led - place)
        inside = {(a, b): (at >= a) & (at < b) for a, b in runs}
        whys = {run: _worse(before[some], after[some], time[some], late[some]) for run, some in inside.items()}
        good = tuple(run for run in runs if not whys[run])
        if good == runs:
            on = np.any(list(inside.values()), axis=0)
            without, left = (Residue(float(off[on].max()), rms(off[on])) for off in (before, after))
            return MotionCommand(shift, runs, without, left, tuple(kept))
        kept += [why for why in whys.values() if why]
        for a, b in set(runs) - set(good):
            shift[a : b + 1] = 0.0
        runs = good
    return wanted._replace(shift=np.zeros_like(shift), runs=(), kept=tuple(kept))


def _worse(before: Array, after: Array, time: Array, late: Array) -> str:
    """Why a run had better stay as it is, by what it is led off (K,) [m] and when (K,) [s]; empty where it had not."""
    if (after > before + WORSE).any() or rms(after) > GAIN * rms(before):
        return "its positions stand too far apart for it"
    return "its lines would last one more interpolation period" if np.ptp(late) > SLOWER * np.ptp(time) else ""


def _commanded(course: ProgramCourse, clocks: tuple[Array, Array], run: slice, held: BoolArray) -> Commanded:
    """A run as it is driven, in statements of whole periods where the controller rounds up."""
    clock, statement = clocks
    return Commanded(
        position=course.position[run],
        theta=course.theta[run],
        arc=course.arc[run],
        speed=np.diff(course.arc[run]) / np.maximum(np.diff(clock[run]), 1e-12),
        stop=np.isin(np.arange(run.start, run.stop), (run.start, run.stop - 1)),
        by_lines=bool((course.number[run] > 0).all()),
        held=held[run],
        first=statement[course.statement[run.start : run.start + 1]],
    )


def _held(
    plan: CorrectionPlan, course: ProgramCourse, stations: IntArray, named: IntArray, motion: ControllerMotion
) -> BoolArray:
    """Nodes that stay, (N,)."""
    poses, drive, moves = plan.poses, plan.drive, plan.program.motions
    pose = drive.pose[stations]
    fixed = fixed_positions(poses, drive, plan.free)
    placed = np.bincount(poses.first[poses.first != np.arange(len(poses.first))], minlength=len(poses.first)) > 0
    held, at = np.zeros(len(course.number), dtype=bool), drive.motion[stations]
    held[named] = ~plan.free[stations] | fixed[poses.first[pose]] | placed[poses.first[pose]]
    held[named] |= np.array([bool(text.strip()) for text in moves.options])[at]
    held |= ~course.stop & ((course.kept < 1) | (course.wait > 0))
    windows = (*motion.moving_averages, *motion.after_long, *motion.first_orders)
    long = (course.number[1:] > 0) & (course.number[:-1] > 0)
    long &= np.diff(course.cruise) > min(t for t in windows if t > 0)
    held[1:] |= long
    held[:-1] |= long
    return held


def _why_not(plan: CorrectionPlan, rows: IntArray, motion: ControllerMotion, path: Commanded) -> str:
    """Why the run of some stations is not commanded for its bends; empty where it may be."""
    lines = plan.program.motions.line[plan.drive.motion[rows]]
    if not plan.drive.stop[rows[[0, -1]]].all():
        return "it does not begin and end at a stop (FINE)"
    text = plan.program.data.upper().splitlines()
    if any(lines[0] < n <= lines[-1] or SETS_SPEED.search(text[n - 1]) for n in plan.drive.untimed):
        return "its speed is known at run time alone"
    return "" if path.first is None or motion.covers(path.first) else "it begins as no logged run did"


def shifted_positions(plan: CorrectionPlan, cell: Cell, shift: Array) -> SharedCorrections:
    """What positions take, with a shift of the stations, (S, 6)."""
    drive, theta = plan.drive, plan.stations.theta.copy()
    correction, rows = plan.stations.correction + shift, np.flatnonzero(shift.any(axis=1))
    if len(rows):
        joints, _ = solved_after(cell, drive.at, drive.pose[rows], correction[rows])
        theta[rows] = nearest_turns(joints, theta[rows])
    return average_shared(plan.poses, drive, plan.free, correction, theta)


def at_full_override(written: LsProgram, command: MotionCommand | None) -> LsProgram:
    """A program with the remark of the one override that what it is commanded off its path is right for."""
    if command is None or not command.runs or says_override(written):
        return written
    return insert_remark(written, running_override((1.0,)))


def motion_elsewhere(
    written: LsProgram, robot: Robot, poses: Poses, drive: DrivenProgram, command: MotionCommand | None
) -> MotionEffect | None:
    """What the controller's motion does to a text where it is not commanded; None where nothing can be followed."""
    try:
        course = course_of_driven(written, robot, poses, drive)
    except InputError:
        return None
    effect = course_motion(course, robot)
    if effect is None or command is None or not command.runs:
        return effect
    other = course.judged & ~_commanded_ways(command, course, known_stations(poses, drive))
    rest = course_motion(replace(course, judged=other), robot)
    return rest or replace(effect, largest=0.0, lowest=0.0, highest=0.0, along=0.0)


def _commanded_ways(command: MotionCommand, course: ProgramCourse, stations: IntArray) -> BoolArray:
    """Ways of a program's course on runs that are commanded, (N - 1,); its named nodes are stations (n,)."""
    named = np.flatnonzero(course.number > 0)
    station = stations[np.searchsorted(named, np.arange(len(course.judged)), side="right") - 1]
    return np.asarray(np.any([(station >= a) & (station < b) for a, b in command.runs], axis=0), dtype=bool)


def _flown(course: ProgramCourse, robot: Robot, between: int) -> tuple[Array, Array, Array]:
    """When (K,) [s] and where (K, 3) [m] a text is, so many places from each position on, and led off (K, 3) [m]."""
    named = np.flatnonzero(course.number > 0)
    begin, end = course.arc[named[:-1], None], course.arc[named[1:], None]
    arc = (begin + np.arange(between) / between * (end - begin)).ravel()
    led = np.zeros((len(arc), 3)) if robot.motion is None else led_beside(course, robot, robot.motion, arc)
    return course.at(statement_durations(course, robot)[0], arc), course.place(arc), led


def commanded_program(
    plan: CorrectionPlan, cell: Cell, command: MotionCommand | None
) -> tuple[SharedCorrections, DrivenProgram]:
    """What positions take, and the planned program off its targets as it is commanded against the motion."""
    drive, none = plan.drive, np.zeros_like(plan.stations.correction)
    alone = shifted_positions(plan, cell, none)
    if command is None or not command.runs:
        return alone, drive
    shared = shifted_positions(plan, cell, command.shift)
    tcp = drive.at.tcp
    off = Pose(tcp.position + (shared.correction - alone.correction)[:, :3], tcp.rotation)
    return shared, replace(drive, at=replace(drive.at, tcp=off))


def motion_command_findings(result: Correction) -> Iterator[Finding]:
    """What the controller's motion does, and what is commanded against it."""
    command, motion, bound = result.command, result.cell.robot.motion, result.options.bound
    if command is not None and command.runs and motion is not None:
        beyond = bound is not None and command.left.largest > bound
        stations = [command.runs[0][0], command.runs[-1][1]]
        first, last = result.plan.program.motions.line[result.plan.drive.motion[stations]]
        before, after = (f"{r.largest / UM:.1f} um ({r.rms / UM:.1f} rms)" for r in (command.plain, command.left))
        message = (
            f"the program is made for 100 % override: {len(command.runs)} of its runs, lines {first} to {last}, are "
            f"commanded against {WHAT} ({motion_words(motion)}), which leads the tool {before} off them before, "
            f"{after} after, beside the error after correction"
        )
        level = Level.WARNING if beyond else Level.NOTE
        yield Finding(level, Code.MOTION_PREDISTORTED, message)
    if command is not None and command.kept:
        runs = counted(len(command.kept), "run with bends is", "runs with bends are")
        message = f"{runs} not commanded against {WHAT}; the first: {command.kept[0]}"
        yield Finding(Level.NOTE, Code.MOTION_KNOWN, message)
    chained = chained_lines(result.plan.program)
    if result.motion is None or command is None or not command.runs or result.motion.largest > 0 or chained:
        yield from motion_of_a_listing(result.cell.robot, result.motion, Bounds(max=bound), chained)
