r"""The twin's own timing of a program as read from its text: when it passes each position, and how fast it really goes.

A change of speed by dv, from or to a stop or from one line's written speed to the next one's, takes

    T(dv) = dv / a + a / j,    or 2 sqrt(dv / j) below dv = a^2 / j

with a and j what the joints allow along the path where it begins (faster) or ends (slower). It lies on the faster side,
as no line is driven above its word, and is counted as of the constant acceleration dv / T(dv), which takes as long over
as much way. So over a line of length L the square of the speed rises, and falls, by no more than 2 (dv / T) L:

    v_n^2 = min(limit_n^2, v_{n-1}^2 + 2 (dv / T) L_n)    forwards, and the same backwards

with limit_n the lower of two words, and zero at a stop. Words that go on rising (falling) on lines too short for their
own share of it are one change. A change that is broken off, as in a run too short for its ramps, is of the dv that it
reaches.

A controller that rounds up takes a whole number of interpolation periods for every line.

Where the robot's smoothing is known, it is the ramp: lines run at their words, one begins when the one before is over,
and all between two stops lasts the sum of their times and the smoothing's settling. No joint's acceleration counts.
"""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import NamedTuple

import numpy as np

from compgen.core.arcs import statement_starts
from compgen.core.arrays import Array, BoolArray, IntArray, cumulated
from compgen.program.program import Program
from compgen.robot.motion import ControllerMotion
from compgen.robot.robot import Controller, Robot
from compgen.verification.twin.controller.command import first_of_runs
from compgen.verification.twin.controller.passing import Settling, settling_of

SAME_POSITION = 1e-9  # m; two positions whose texts are the same
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share of the joints' limits that a ramp uses
SAME_WORD = 0.005  # by less, one word after another is rounding and no change of speed
ROUNDS = 60  # of finding what broken changes reach
REACHED = 1e-9  # relative


class ProgramTiming(NamedTuple):
    """When a program of N positions passes them, and how fast it drives between."""

    time: Array  # (N,) [s] when each position is passed
    driven: Array  # (N - 1,) [m/s] mean speed on each segment
    highest: Array  # (N - 1,) [m/s] highest speed on each segment
    unrounded: Array  # (N,) [s] ``time`` on a controller that does not round up
    at_word: Array  # (N - 1,) [m] how much of each segment is driven at its written speed
    rounded_up: float  # [s] how long all takes where the controller rounds up


class _Lines(NamedTuple):
    """S lines between stops, none of which is left out."""

    word: Array  # (S,) [m/s]
    length: Array  # (S,) [m]
    from_stop: BoolArray  # (S,)
    to_stop: BoolArray  # (S,)
    a: Array  # (S,) [m/s2] of a ramp there
    j: Array  # (S,) [m/s3]

    def backwards(self) -> "_Lines":
        """The same way from its end."""
        same = self.of(slice(None, None, -1))
        return same._replace(from_stop=same.to_stop, to_stop=same.from_stop)

    def of(self, rows: slice | BoolArray) -> "_Lines":
        """Some of them."""
        return _Lines(**{name: column[rows] for name, column in self._asdict().items()})


class _Changes(NamedTuple):
    """C changes to a higher speed."""

    first: IntArray  # (C,) the line that each begins with; it counts until the next one begins
    rise: Array  # (C,) [m/s]

    def acceleration(self, lines: _Lines) -> Array:
        """On each line, (S,) [m/s2]."""
        mean = self.rise / ramp_duration(self.rise, lines.a[self.first], lines.j[self.first])
        return np.repeat(mean, np.diff(self.first, append=len(lines.word)))

    def reached(self, speed: Array, peak: Array) -> "_Changes":
        """What they come to, of speeds at the start of each line (S,) and highest on it (S,) [m/s]."""
        risen = np.maximum.reduceat(peak, self.first) - speed[self.first]
        return _Changes(self.first, np.minimum(self.rise, np.maximum(risen, SAME_POSITION)))


class _Driven(NamedTuple):
    """How S lines are driven."""

    duration: Array  # (S,) [s]
    highest: Array  # (S,) [m/s]
    at_word: Array  # (S,) [m]


def time_program(robot: Robot, program: Program, length: Array, theta: Array) -> ProgramTiming:
    """When each position is passed, and the mean and the highest speed on each segment.

    Args:
        robot: Its joint limits or the smoothing that is known, and whether its controller rounds up.
        program: With N positions, a stop at both ends.
        length: Of its segments, (N - 1,) [m].
        theta: Joints at its positions, (N, 6) [rad].
    """
    way = np.maximum(length, SAME_POSITION)
    if robot.motion is not None and robot.motion.is_smooth:
        return time_smoothed(robot.controller, robot.motion, program, way)
    robot = robot.at_acceleration(program.acc)
    a, j = _ramp_limits(robot, program, theta, way)
    lines = _Lines(word=program.speed, length=way, from_stop=program.fine[:-1], to_stop=program.fine[1:], a=a, j=j)
    driven = _drive(lines)
    whole = segment_times(robot.controller, driven.duration, program.via, rounds_up=True)
    taken = whole if robot.controller.rounds_up_to_period else driven.duration
    return ProgramTiming(
        time=cumulated(taken),
        driven=way / taken,
        highest=driven.highest * (driven.duration / taken),
        unrounded=cumulated(driven.duration),
        at_word=driven.at_word,
        rounded_up=float(whole.sum()),
    )


def time_smoothed(
    controller: Controller, motion: ControllerMotion, program: Program, length: Array, override: float = 1.0
) -> ProgramTiming:
    """The timing of a program whose controller smooths as is known, at an override, of segments (N - 1,) [m]."""
    words = length / (program.speed * override)
    whole = segment_times(controller, words, program.via, rounds_up=True)
    taken = whole if controller.rounds_up_to_period else words
    short, long = (settling_of(motion.in_run(first)) for first in (0.0, inf))
    begins_long = first_of_runs(taken, program) > (motion.long if motion.after_long else inf)
    of_long = np.repeat(begins_long, np.diff(np.flatnonzero(program.fine)))
    passed, unrounded = (
        _passed(short, each, program.fine).where(of_long, partial(_passed, long, each, program.fine))
        for each in (taken, words)
    )
    return ProgramTiming(
        time=passed.time,
        driven=length / np.diff(passed.time),
        highest=length / taken * passed.rate,
        unrounded=unrounded.time,
        at_word=length * unrounded.held,
        rounded_up=float(whole.sum() + np.where(begins_long, long.time, short.time).sum()),
    )


class _Passed(NamedTuple):
    """How a smoothed motion goes through S segments."""

    time: Array  # (S + 1,) [s] when positions are passed
    rate: Array  # (S,) highest speed, as a share of the word
    held: Array  # (S,) of the segment's time at the word

    def where(self, segments: BoolArray, passed: Callable[[], "_Passed"]) -> "_Passed":
        """As another smoothing passes some segments, whole runs of them (S,)."""
        other = passed() if segments.any() else self
        took = np.where(segments, np.diff(other.time), np.diff(self.time))
        pairs = ((other.rate, self.rate), (other.held, self.held))
        return _Passed(cumulated(took), *(np.where(segments, *pair) for pair in pairs))


def _passed(settling: Settling, taken: Array, fine: BoolArray) -> _Passed:
    """Segments from stop to stop, through the smoothing.

    Args:
        settling: Of the smoothing.
        taken: At the words.
        fine: Stops, (S + 1,), both ends among them.
    """
    stops = np.flatnonzero(fine)
    run = np.cumsum(fine)[:-1] - 1
    commanded = np.add.reduceat(taken, stops[:-1])
    begin = cumulated(commanded + settling.time)[run]
    first = cumulated(commanded)[run]
    share = np.where(fine[1:], commanded[run], np.minimum(np.cumsum(taken) - first, commanded[run]))
    after = settling.passed(share, commanded[run])
    before = np.where(fine[:-1], 0.0, np.append(0.0, after[:-1]))
    fastest = np.clip((commanded[run] + settling.time) / 2, before, after)
    held = np.minimum(after, commanded[run]) - np.maximum(before, settling.time)
    rate = settling.speed(fastest, commanded[run])
    return _Passed(np.append(0.0, begin + after), rate, np.clip(held / taken, 0.0, 1.0))


def segment_times(controller: Controller, duration: Array, via: BoolArray, *, rounds_up: bool) -> Array:
    """How long the controller takes for segments (S,) [s]; the two of an arc share its statement's time.

    Args:
        controller: With its period.
        duration: Of the segments as they are, (S,) [s].
        via: Positions in the middle of an arc, (S + 1,).
        rounds_up: Whether to whole periods.
    """
    if not rounds_up:
        return duration
    starts = np.flatnonzero(statement_starts(via))
    together = np.add.reduceat(duration, starts)
    whole = controller.period * controller.whole_periods(together)
    return duration * np.repeat(whole / together, np.diff(starts, append=len(duration)))


def _drive(lines: _Lines) -> _Driven:
    """How lines are driven; both ends are stops."""
    reverse = lines.backwards()
    up, down = _changes(lines), _changes(reverse)
    todo = np.arange(len(lines.word))
    driven = _Driven(*(np.empty(len(todo)) for _ in range(3)))
    for _ in range(ROUNDS):
        a_up, a_down = up.acceleration(lines), down.acceleration(reverse)[::-1]
        v0, v1, peak = _speeds(lines, a_up, a_down)
        changing = (peak**2 - v0**2) / (2 * a_up) + (peak**2 - v1**2) / (2 * a_down)
        cruise = np.maximum(lines.length - changing, 0.0)
        driven.duration[todo] = (peak - v0) / a_up + (peak - v1) / a_down + cruise / peak
        driven.highest[todo] = peak
        driven.at_word[todo] = np.where(peak >= lines.word * (1 - REACHED), cruise, 0.0)
        # runs in which a change is broken off are driven again, with what it reaches
        up_new, down_new = up.reached(v0, peak), down.reached(v1[::-1], peak[::-1])
        broken = np.zeros(len(todo), dtype=bool)
        broken[up.first] = up_new.rise < up.rise * (1 - REACHED)
        broken[len(todo) - 1 - down.first[down_new.rise < down.rise * (1 - REACHED)]] = True
        run = np.cumsum(lines.from_stop)
        again = np.isin(run, run[broken])
        if not again.any():
            break
        todo = todo[again]
        up, down = _of_some(up_new, again), _of_some(down_new, again[::-1])
        lines = lines.of(again)
        reverse = lines.backwards()
    return driven


def _of_some(changes: _Changes, kept: BoolArray) -> _Changes:
    """The changes on the lines that are kept, whole runs of them."""
    number = np.cumsum(kept) - 1
    stays = kept[changes.first]
    return _Changes(number[changes.first[stays]], changes.rise[stays])


def _changes(lines: _Lines) -> _Changes:
    """Where the speed rises, in driving order, and by how much."""
    word = lines.word
    before = np.append(0.0, word[:-1])
    low = np.where(lines.from_stop, 0.0, np.minimum(word, before))
    rows = np.flatnonzero(word > low * (1 + SAME_WORD))
    falls = np.cumsum(lines.from_stop | (word < before * (1 - SAME_WORD)))
    at = np.cumsum(lines.length) - lines.length
    own = (low + word)[rows] / 2 * ramp_duration((word - low)[rows], lines.a[rows], lines.j[rows])
    goes_on = (np.diff(at[rows]) < own[:-1]) & (np.diff(falls[rows]) == 0)
    number = np.flatnonzero(np.append(True, ~goes_on))  # of the rise that each change begins with
    first, last = rows[number], rows[np.append(number[1:], len(rows)) - 1]
    return _Changes(first, word[last] - low[first])


def _speeds(lines: _Lines, a_up: Array, a_down: Array) -> tuple[Array, Array, Array]:
    """Speeds at the start and the end of each line, and the highest on it, (S,) each [m/s]."""
    word, length = lines.word, lines.length
    limit = np.concatenate([[0.0], np.where(lines.to_stop, 0.0, np.minimum(word, np.append(word[1:], 0.0)))])
    square = _rising(limit**2, 2 * a_up * length)
    square = _rising(square[::-1], (2 * a_down * length)[::-1])[::-1]
    before, after = square[:-1], square[1:]
    top = (2 * a_up * a_down * length + a_down * before + a_up * after) / (a_up + a_down)
    peak = np.sqrt(np.maximum(np.minimum(word**2, top), np.maximum(before, after)))
    return np.sqrt(before), np.sqrt(after), peak


def _rising(limit: Array, step: Array) -> Array:
    """The largest values within limits (N,) that rise from one to the next by no more than steps (N - 1,)."""
    sum_of_steps = cumulated(step)
    return np.asarray(np.clip(np.minimum.accumulate(limit - sum_of_steps) + sum_of_steps, 0.0, limit))


def _ramp_limits(robot: Robot, program: Program, theta: Array, length: Array) -> tuple[Array, Array]:
    """Acceleration and jerk along the path that the joints allow a ramp on each segment [m/s2], [m/s3].

    Where the speed does not change they are not asked for, and endless.
    """
    a, j = np.full(len(length), np.inf), np.full(len(length), np.inf)
    changes = program.fine | np.concatenate([[True], program.speed[1:] != program.speed[:-1], [True]])
    rows = np.flatnonzero(changes[:-1] | changes[1:])
    slope = np.abs(theta[rows + 1] - theta[rows]) / length[rows, None] + 1e-12  # rad/m
    a[rows] = RAMP_ACCELERATION * (robot.acceleration / slope).min(axis=1)
    j[rows] = RAMP_JERK * (robot.jerk / slope).min(axis=1)
    return a, j


def ramp_duration(change: Array, a: Array, j: Array) -> Array:
    """T: of a change of speed with limited acceleration and jerk, (K,) [s]."""
    return np.where(change > a * a / j, change / a + a / j, 2 * np.sqrt(change / j))
