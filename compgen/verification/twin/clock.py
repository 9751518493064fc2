"""The twin's own clock: when a program as read from its text passes each position, and how fast it is really driven."""

import numpy as np

from compgen.core.arrays import Array, IntArray
from compgen.fanuc.program import Program
from compgen.robot.robot import Robot

NO_WAY = 1e-9  # m; two positions whose texts are the same
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share of the joints' limits that a ramp uses


def clock(robot: Robot, program: Program, length: Array, theta: Array) -> tuple[Array, Array]:
    r"""When each position is passed (N,) [s], and the speed really driven on each segment, (N - 1,) [m/s].

    A run between two stops takes its length over the written speeds and half of each ramp. A ramp to speed v takes
    T(v) = v / a + a / j, or 2 sqrt(v / j) below a^2 / j, with a and j what the joints allow along the path at its
    stop. A run too short for both ramps reaches the speed p with p T(p) = length, and takes 2 T(p).
    """
    ends = np.flatnonzero(program.fine)
    first, last = ends[:-1], ends[1:] - 1
    a_first, j_first = _ramp_limits(robot, theta, length, first)
    a_last, j_last = _ramp_limits(robot, theta, length, last)
    said = length / program.speed
    whole, cruise = np.add.reduceat(length, first), np.add.reduceat(said, first)
    begin = _ramp(program.speed[first], a_first, j_first)
    end = _ramp(program.speed[last], a_last, j_last)
    room = program.speed[first] * begin / 2 + program.speed[last] * end / 2
    low, high = np.zeros(len(first)), np.minimum(program.speed[first], program.speed[last])
    soft_a, soft_j = np.minimum(a_first, a_last), np.minimum(j_first, j_last)
    for _ in range(60):
        peak = (low + high) / 2
        under = peak * _ramp(peak, soft_a, soft_j) < whole
        low, high = np.where(under, peak, low), np.where(under, high, peak)
    spent = np.where(room < whole, cruise + (begin + end) / 2, 2 * _ramp(low, soft_a, soft_j))
    slower = np.repeat(cruise / spent, np.diff(ends))
    return np.concatenate([[0.0], np.cumsum(said / slower)]), program.speed * slower


def _ramp_limits(robot: Robot, theta: Array, length: Array, line: IntArray) -> tuple[Array, Array]:
    """Acceleration and jerk along the path that the joints allow a ramp on some lines [m/s2], [m/s3]."""
    share = np.abs(theta[line + 1] - theta[line]) / np.maximum(length[line, None], NO_WAY) + 1e-12  # rad/m
    a = RAMP_ACCELERATION * (robot.acceleration / share).min(axis=1)
    return a, RAMP_JERK * (robot.jerk / share).min(axis=1)


def _ramp(speed: Array, a: Array, j: Array) -> Array:
    """Time from rest to a speed with limited acceleration and jerk, (K,) [s]."""
    return np.where(speed > a * a / j, speed / a + a / j, 2 * np.sqrt(speed / j))
