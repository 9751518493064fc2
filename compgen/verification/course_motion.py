r"""How far a controller's motion leads the tool off a program that exists: its course, commanded and smoothed.

From stop to stop the statements are commanded back to back at their written speeds, in whole periods where the
controller rounds up, with waits behind CNT n (``twin.controller.command``) and the program's own. With x the smoothed
place, s the smoothed way and t the course's direction there,

    d = x - p(s),      across = d - (d . t) t

Ways that no straight line or arc surely leads along are left out, and so is what is smoothed in the joints.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from compgen.core.arrays import Array, frozen, interpolated, row_norms
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Robot
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.motion_effect import MotionEffect, expected_effect
from compgen.verification.twin.controller.command import corner_wait
from compgen.verification.twin.controller.deviation import cubic
from compgen.verification.twin.controller.smoothing import moments, smooth


def course_motion(course: ProgramCourse, robot: Robot) -> MotionEffect | None:
    """What the controller's motion does to a program, or is expected to do; None where that is not looked at.

    Args:
        course: Of the program.
        robot: Its controller, its motion, or what is expected of it.
    """
    if not course.judged.any() or (robot.motion is not None and robot.motion.space == "joint"):
        return None
    return expected_effect(robot, partial(_effect, course, robot), partial(_largest, course, robot))


@dataclass(frozen=True, eq=False, slots=True)
class _Led:
    """A run from stop to stop, at K samples."""

    way: Array  # (K,) [m] smoothed
    across: Array  # (K, 3) [m]
    along: Array  # (K,) [m]


def _effect(course: ProgramCourse, robot: Robot, motion: ControllerMotion) -> MotionEffect:
    """Of one motion."""
    off, along, worst, worst_motion = np.zeros(len(course.judged)), 0.0, 0.0, motion
    where = float(course.arc[np.argmax(course.judged)])  # of a program of which nothing is led off
    for own, led in _runs(course, robot, motion):
        across = row_norms(led.across)
        np.maximum.at(off, course.way(led.way), across)
        along = max(along, float(led.along.max()))
        if across.max() > worst:
            worst, where, worst_motion = float(across.max()), float(led.way[np.argmax(across)]), own
    speed = np.diff(course.arc) / np.maximum(np.diff(course.cruise), 1e-12)
    return MotionEffect(
        motion=worst_motion,
        expected=None,
        largest=worst,
        lowest=worst,
        highest=worst,
        where=where,
        near=course.point_name(where),
        speed=float(speed[course.way(np.array([where]))[0]]),
        along=along,
        lag=moments(motion).delay * float(speed[course.judged].max()),
        off=frozen(off),
    )


def led_beside(course: ProgramCourse, robot: Robot, motion: ControllerMotion, arc: Array) -> Array:
    """How far a motion leads the tool across a program at arc lengths (M,) [m], (M, 3) [m]; zero where unknown."""
    across = np.zeros((len(arc), 3))
    for _, led in _runs(course, robot, motion):
        there = (arc >= led.way[0]) & (arc <= led.way[-1])
        across[there] = interpolated(arc[there], led.way, led.across)
    return across


def statement_durations(course: ProgramCourse, robot: Robot) -> tuple[Array, Array]:
    """When the command passes the nodes (N,) [s], had it no stops, and how long each statement takes [s]."""
    clock = course.counted_clock() if robot.controller.rounds_up_to_period else course.cruise
    return clock, np.asarray(np.bincount(course.statement, np.diff(clock)), dtype=float)


def _runs(course: ProgramCourse, robot: Robot, motion: ControllerMotion) -> Iterator[tuple[ControllerMotion, _Led]]:
    """Each run from stop to stop that is judged all along, with its own motion."""
    clock, statement = statement_durations(course, robot)
    stops, spread = np.flatnonzero(course.stop), np.nan_to_num(course.spreads(robot), nan=motion.reach_at)
    for a, b in zip(stops[:-1].tolist(), stops[1:].tolist(), strict=True):
        if course.judged[a:b].all() and motion.is_smooth:
            own = motion.in_run(float(statement[course.statement[a]]))
            yield own, _led(course, robot, own, clock, slice(a, b + 1), spread)


def _largest(course: ProgramCourse, robot: Robot, motion: ControllerMotion) -> float:
    return _effect(course, robot, motion).largest


def _led(
    course: ProgramCourse, robot: Robot, motion: ControllerMotion, clock: Array, run: slice, spread: Array
) -> _Led:
    """The nodes of one run, commanded and smoothed; behind the last it rests until all has settled."""
    if run.stop - run.start == 2:  # one straight way, which no smoothing leaves
        return _Led(course.arc[run], np.zeros((2, 3)), np.zeros(2))
    before = spread[np.maximum(np.arange(run.start, run.stop) - 1, 0)]
    wait = corner_wait(replace(robot, motion=motion), np.where(course.stop[run], 1.0, course.kept[run]), before)
    period = robot.controller.period
    longest = motion.on_line(float(max(motion.reach_at, *spread[run.start : run.stop - 1]))).settling
    wait[1:-1] += np.minimum(course.wait[run][1:-1], longest)  # the program's own: it rests there, once all has settled
    arrive = clock[run] - clock[run.start] + np.cumsum(wait) - wait
    time = period * np.arange(int(np.ceil((arrive[-1] + longest) / period)) + 1, dtype=float)
    knots = np.column_stack([arrive, arrive + wait]).ravel()
    command = np.interp(time, knots, np.repeat(course.arc[run], 2))
    line = course.way(command - np.diff(command, prepend=command[0]) / 2)
    smoothed = smooth(np.column_stack([command, course.place(command)]), period, motion, spread[line])
    passed = np.clip(np.maximum.accumulate(smoothed[:, 0]), course.arc[run.start], course.arc[run.stop - 1])
    way = np.union1d(passed, course.arc[run])  # a corner lies between two samples
    place = cubic(smoothed[:, 1:], np.interp(way, passed, np.arange(len(passed), dtype=float)))
    d, ahead = place - course.place(way), course.tangents()[course.way(way)]
    along = np.einsum("ij,ij->i", d, ahead)
    return _Led(way, d - along[:, None] * ahead, np.abs(along))
