"""The twin's own timing of a program as read from its text: when it passes each position, and how fast it really goes.

A run between two stops takes its length over the written speeds and half of each ramp. A ramp to speed v takes
T(v) = v / a + a / j, or 2 sqrt(v / j) below a^2 / j, with a and j what the joints allow along the path at its stop. A
run too short for both ramps reaches the speed p with p T(p) = length, and takes 2 T(p).
"""

from typing import NamedTuple

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.fanuc.program import Program
from compgen.robot.robot import Robot

SAME_POSITION = 1e-9  # m; two positions whose texts are the same
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share of the joints' limits that a ramp uses


class ProgramTiming(NamedTuple):
    """When a program of N positions passes them, and how fast it drives between."""

    time: Array  # (N,) [s] when each position is passed
    driven: Array  # (N - 1,) [m/s] mean speed on each segment
    highest: Array  # (N - 1,) [m/s] highest speed on each segment


def time_program(robot: Robot, program: Program, length: Array, theta: Array) -> ProgramTiming:
    """When each position is passed, and the mean and the highest speed on each segment.

    Args:
        robot: Its joint limits.
        program: With N positions.
        length: Of its segments, (N - 1,) [m].
        theta: Joints at its positions, (N, 6) [rad].
    """
    robot, stops = robot.at_acceleration(program.acc), np.flatnonzero(program.fine)
    first, last = stops[:-1], stops[1:] - 1  # segments of each run
    a_first, j_first = _ramp_limits(robot, theta, length, first)
    a_last, j_last = _ramp_limits(robot, theta, length, last)
    written_time = length / program.speed
    run_length, cruise_time = np.add.reduceat(length, first), np.add.reduceat(written_time, first)
    T_first = ramp_duration(program.speed[first], a_first, j_first)
    T_last = ramp_duration(program.speed[last], a_last, j_last)
    ramp_length = program.speed[first] * T_first / 2 + program.speed[last] * T_last / 2
    low, high = np.zeros(len(first)), np.minimum(program.speed[first], program.speed[last])
    a, j = np.minimum(a_first, a_last), np.minimum(j_first, j_last)
    for _ in range(60):  # bisection for p
        p = (low + high) / 2
        below = p * ramp_duration(p, a, j) < run_length
        low, high = np.where(below, p, low), np.where(below, high, p)
    run_time = np.where(ramp_length < run_length, cruise_time + (T_first + T_last) / 2, 2 * ramp_duration(low, a, j))
    segments = np.diff(stops)
    slowdown = np.repeat(cruise_time / run_time, segments)
    highest = np.minimum(program.speed, np.repeat(np.where(ramp_length < run_length, np.inf, low), segments))
    time = np.concatenate([[0.0], np.cumsum(written_time / slowdown)])
    return ProgramTiming(time, program.speed * slowdown, highest)


def ramps_length(robot: Robot, program: Program, length: Array, theta: Array, counted: BoolArray) -> float:
    """How much of the counted segments (N - 1,) is spent on ramps from and to stops [m]."""
    robot, stops = robot.at_acceleration(program.acc), np.flatnonzero(program.fine)
    total = 0.0
    for segment in (stops[:-1], stops[1:] - 1):
        segment = segment[counted[segment]]
        ramp_time = ramp_duration(program.speed[segment], *_ramp_limits(robot, theta, length, segment))
        total += float((program.speed[segment] * ramp_time / 2).sum())
    return total


def _ramp_limits(robot: Robot, theta: Array, length: Array, segment: IntArray) -> tuple[Array, Array]:
    """Acceleration and jerk along the path that the joints allow a ramp on some segments [m/s2], [m/s3]."""
    turn = np.abs(theta[segment + 1] - theta[segment])
    slope = turn / np.maximum(length[segment, None], SAME_POSITION) + 1e-12  # rad/m
    a = RAMP_ACCELERATION * (robot.acceleration / slope).min(axis=1)
    return a, RAMP_JERK * (robot.jerk / slope).min(axis=1)


def ramp_duration(speed: Array, a: Array, j: Array) -> Array:
    """T: from rest to a speed with limited acceleration and jerk, (K,) [s]."""
    return np.where(speed > a * a / j, speed / a + a / j, 2 * np.sqrt(speed / j))
