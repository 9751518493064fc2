r"""What a controller commands while it drives a written program: samples in time, before anything smooths them.

Each statement takes its length over its written speed, rounded up to whole interpolation periods where the controller
does so, and the next begins when it is over. Where the robot's smoothing is known the command has no ramps of its own:
a start from a stop is a jump of speed, and the smoothing is the ramp. FINE waits until it has come to rest. CNT n waits

    d = floor((N - 1) (1 - sqrt(n / 100))),     N = (T1 + T2) / period

periods, so that on a straight way the speeds of both motions together never fall below n %; CNT100 never waits. Times,
FINE and CNT are those of FANUC's motion code; see docs/motion.md.

Where no smoothing is known the command itself runs up and down, as long as the twin's clock says: with C the time of a
run's statements and D the clock's, the ramps take T = D - C each, and the share c of the run's time is

    dc/dt = 3 u^2 - 2 u^3,  u = t / T    on the ramp,      1 between,      c(D) = C

A run too short for both ramps (T > D / 2) has T = D / 2 and reaches 2 C / D of its speed.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, owns, row_norms
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation, relative_rotation
from compgen.program.program import Program
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.robot.robot import SAME_PERIOD, Robot
from compgen.verification.twin.circular_motion import Sweeps


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
@owns(time=("N",), theta=("N", 6))
class WrittenPath:
    """A program of N positions in World, with how its segments run and when the twin's clock passes its positions."""

    program: Program
    sweep: Sweeps  # of its N - 1 segments
    time: Array  # (N,) [s] at full override, lines not rounded up; counts where no smoothing is known
    theta: Array  # (N, 6) [rad]
    turn: Array | None = None  # (N - 1, 3) [rad] rotation vector over each segment, in the axes of its start

    def arcs(self) -> Array:
        """Length of the path at each position, (N,) [m]."""
        return cumulated(self.sweep.length)

    def places(self, segment: IntArray, fraction: Array) -> Array:
        """Places (M, 3) [m] at fractions (M,) of segments (M,)."""
        if self.program.via.any():
            return self.sweep.places(self.program.position, segment, fraction)
        return np.asarray(self.program.position[segment] + fraction[:, None] * self.sweep.straight[segment])

    def directions(self, segment: IntArray, fraction: Array) -> Array:
        """Directions of travel there, (M, 3); zero on a segment without length."""
        sweep, k = self.sweep, segment
        part = (fraction * sweep.angle[k])[:, None]
        ahead = sweep.straight[k]
        if self.program.via.any():
            ahead = ahead + np.cos(part) * sweep.along[k] + np.sin(part) * sweep.inwards[k]
        return np.asarray(ahead / np.maximum(row_norms(ahead), 1e-12)[:, None])

    def turned(self) -> Array:
        """Rotation vectors of all segments before each position added up in World, (N, 3) [rad]."""
        rotation = self.program.rotation
        turn = relative_rotation(rotation[:-1], rotation[1:]) if self.turn is None else self.turn
        if not turn.any():
            return np.zeros_like(self.program.position)
        return np.concatenate([np.zeros((1, 3)), np.cumsum((rotation[:-1] @ turn[:, :, None])[:, :, 0], axis=0)])

    def rotations(self, segment: IntArray, fraction: Array) -> Array:
        """Orientations of the TCP there, (M, 3, 3): turning steadily over each segment."""
        rotation = self.program.rotation
        return interpolate_rotation(rotation[segment], rotation[segment + 1], fraction)

    def joints(self, robot: Robot, tool: Pose, segment: IntArray, fraction: Array) -> Array:
        """Joints there by the controller's inverse, (M, 6) [rad], on the program's branch and continuous."""
        pose = Pose(self.places(segment, fraction), self.rotations(segment, fraction))
        joints, _ = solve_tool(robot, pose, tool, self.program.posture)
        between = self.theta[segment] + fraction[:, None] * (self.theta[segment + 1] - self.theta[segment])
        return nearest_turns(joints, between)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(time=("M",), segment=("M",), fraction=("M",), position=("M", 3), arc=("M",))
class CommandedMotion:
    """M samples of a commanded motion, a step apart, from the first position to the last and until all has settled."""

    step: float  # [s]
    time: Array  # (M,) [s] from 0
    segment: IntArray  # (M,) from 0: which segment of the program
    fraction: Array  # (M,) of the segment
    position: Array  # (M, 3) [m] of the TCP in World
    arc: Array  # (M,) [m] along the written path


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class CommandClock:
    """When a controller commands what of a program: N positions, R runs between stops."""

    begin: Array  # (R,) [s] when each run begins
    duration: Array  # (R,) [s] of each run with its ramps: D
    at_speed: Array  # (R,) [s] of its statements alone: C
    first: Array  # (R,) [s] of all statements before it
    arrive: Array  # (N,) [s] at each position, had there been neither ramps nor stops
    end: float  # [s] of the last run

    def on_samples(self, step: float) -> "CommandClock":
        """With every run begun on a sample [s], up to a step later: then the stop before it is seen at rest."""
        gaps = step * np.ceil(np.diff(self.begin) / step - SAME_PERIOD)
        begin = cumulated(gaps)
        return replace(self, begin=begin, end=float(begin[-1] + self.end - self.begin[-1]))

    def position_numbers(self, time: Array) -> Array:
        """Where the command is at rising times (M,) [s]: numbers of positions from 0, between two a share of the way.

        That share is of the segment's time, which is of its length: a statement has one speed.
        """
        run = np.clip(np.searchsorted(self.begin, time, side="right") - 1, 0, len(self.begin) - 1)
        done = self.first[run] + run_law(time - self.begin[run], self.duration[run], self.at_speed[run])
        first, last = (int(n) for n in np.searchsorted(self.arrive, done[[0, -1]]))
        first, last = max(first - 1, 0), min(last + 2, len(self.arrive))
        return np.asarray(np.interp(done, self.arrive[first:last], np.arange(first, last, dtype=float)))


def command_clock(robot: Robot, path: WrittenPath, override: float = 1.0) -> CommandClock:
    """When the controller commands what of a program.

    Args:
        robot: Its interpolation period and its motion.
        path: The program.
        override: Share of all written speeds that the operator has set.
    """
    program, length, period = path.program, path.sweep.length, robot.controller.period
    smoothed = robot.motion is not None and robot.motion.is_smooth
    statement = _statements(robot, path, override)
    wait = 0.0 if robot.motion is None else robot.motion.settling
    stops = np.flatnonzero(program.fine)
    exact = np.add.reduceat(statement_times(length, program.speed, period, rounds_up=False), stops[:-1])
    ramps = 0.0 if smoothed else np.maximum(np.diff(path.time[stops]) - exact, 0.0) / override
    arrive = cumulated(statement)
    at_speed = np.diff(arrive[stops])
    duration = at_speed + ramps
    begin = cumulated(duration + wait)
    return CommandClock(
        begin=begin[:-1],
        duration=duration,
        at_speed=at_speed,
        first=arrive[stops[:-1]],
        arrive=arrive,
        end=float(begin[-1]),
    )


def first_statements(robot: Robot, path: WrittenPath, override: float = 1.0) -> Array:
    """How long the statement takes that each run from a stop to the next begins with, (R,) [s]."""
    return first_of_runs(_statements(robot, path, override), path.program)


def _statements(robot: Robot, path: WrittenPath, override: float) -> Array:
    """How long each segment takes at an override, (N - 1,) [s]."""
    program, controller = path.program, robot.controller
    return statement_times(
        path.sweep.length,
        program.speed * override,
        controller.period,
        rounds_up=controller.rounds_up_to_period,
        via=program.via,
    )


def first_of_runs(time: Array, program: Program) -> Array:
    """Of the times of segments (N - 1,) [s] those of the statements that runs begin with, (R,) [s]."""
    first = np.flatnonzero(program.fine)[:-1]
    return np.asarray(time[first] + np.where(program.via[first + 1], time[np.minimum(first + 1, len(time) - 1)], 0.0))


def corner_wait(robot: Robot, kept: Array, spread: Array) -> Array:
    """How long the next motion waits at CNT n when the one before is over, of n / 100 (K,), (K,) [s].

    That one's means count, of how far the arm is spread on it (K,) [m2].
    """
    if robot.motion is None or not robot.motion.is_smooth:
        return np.zeros(len(kept))
    period = robot.controller.period
    motion = robot.motion
    longer = motion.reach * (spread - motion.reach_at) * sum(motion.moving_averages)
    periods = (motion.settling - motion.lag + longer) / period
    return np.asarray(period * np.floor((periods - 1) * (1 - np.sqrt(kept)) + SAME_PERIOD))


def sample_command(robot: Robot, path: WrittenPath, override: float = 1.0, parts: int = 1) -> CommandedMotion:
    """The commanded motion of a program, from its start until all has settled.

    Args:
        robot: Its interpolation period and its motion.
        path: The program; ``PreparedProgram.written_path()``.
        override: Share of all written speeds.
        parts: Samples in each interpolation period.
    """
    clock, step = command_clock(robot, path, override), robot.controller.period / parts
    samples = step * np.arange(int(np.ceil(clock.end / step)) + 2, dtype=float)
    return command_at(path, path.arcs(), clock.position_numbers(samples), samples, step)


def command_at(path: WrittenPath, arcs: Array, number: Array, time: Array, step: float) -> CommandedMotion:
    """Samples of a program at numbers of positions, as ``CommandClock.position_numbers`` counts them.

    Args:
        path: The program.
        arcs: Its ``arcs``.
        number: (M,), rising.
        time: (M,) [s].
        step: Between them [s].
    """
    segment = np.minimum(number.astype(np.int64), len(arcs) - 2)
    fraction = number - segment
    arc = arcs[segment] + fraction * path.sweep.length[segment]
    return CommandedMotion(
        step=step, time=time, segment=segment, fraction=fraction, position=path.places(segment, fraction), arc=arc
    )


def run_law(time: Array, duration: Array, at_speed: Array) -> Array:
    """How much of its statements' time C (M,) a run of duration D (M,) [s] has done at times (M,) since it began."""
    inside, ramp = np.clip(time, 0.0, duration), np.clip(duration - at_speed, 0.0, duration / 2)
    if not ramp.any():
        return np.asarray(inside)
    rate = np.where(duration > ramp, at_speed / np.maximum(duration - ramp, 1e-300), 1.0)
    safe = np.maximum(ramp, 1e-300)

    def run_up(since: Array) -> Array:
        """Of a run that starts to move and never stops: t - T / 2 once it is at speed."""
        u = np.clip(since / safe, 0.0, 1.0)
        return np.where(since < ramp, ramp * u**3 * (1 - u / 2), since - ramp / 2)

    rising = run_up(inside)
    falling = at_speed / np.maximum(rate, 1e-300) - run_up(duration - inside)
    return np.asarray(np.clip(rate * np.where(inside < duration / 2, rising, falling), 0.0, at_speed))


def statement_times(
    length: Array, speed: Array, period: float, *, rounds_up: bool, via: BoolArray | None = None
) -> Array:
    """How long segments take at their speeds, (S,) [s]; statements in whole periods where the controller rounds up.

    An arc through a via (S + 1,) is one statement of two segments.
    """
    time = length / speed
    if not rounds_up:
        return np.asarray(time)
    whole = time.copy()
    if via is not None and via.any():
        half = np.flatnonzero(via)
        whole[half - 1] = whole[half] = time[half - 1] + time[half]
    return np.asarray(time / np.maximum(whole, 1e-300) * (period * np.ceil(whole / period - SAME_PERIOD)))
