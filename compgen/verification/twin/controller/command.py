r"""What a controller commands while it drives a written program: samples in time, before anything smooths them.

Each statement takes its length over its written speed, rounded up to whole interpolation periods where the controller
does so. From and to a stop the command runs up and down by a smooth ramp, as long as the twin's clock says: with C the
time of a run's statements and D the clock's, the ramps take T = D - C each, and the share c of the run's time is

    dc/dt = 3 u^2 - 2 u^3,  u = t / T    on the ramp,      1 between,      c(D) = C

A run too short for both ramps (T > D / 2) has T = D / 2 and reaches 2 C / D of its speed. A stop (FINE) waits until
the smoothing has come to rest; CNT n < 100 waits for the share 1 - n / 100 of that, which rounds a corner the less the
smaller n; CNT100 never waits, and only the smoothing rounds the corner. How CNT works inside a FANUC controller is not
published: this is a model of it.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, own
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation
from compgen.fanuc.program import Program
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.joint_path import nearest_turns
from compgen.robot.robot import Robot
from compgen.verification.twin.circular_motion import sweeps
from compgen.verification.twin.controller.smoothing import settling_time

SAME = 1e-9  # of a period: rounding up begins above


@dataclass(frozen=True, eq=False, slots=True)
class Command:
    """M samples of a commanded motion, a step apart, from the first position to the last and until all has settled."""

    step: float  # [s]
    time: Array  # (M,) [s] from 0
    segment: IntArray  # (M,) from 0: which segment of the program
    fraction: Array  # (M,) of the segment
    position: Array  # (M, 3) [m] of the TCP in World
    arc: Array  # (M,) [m] along the written path

    def __post_init__(self) -> None:
        own(self, time=("M",), segment=("M",), fraction=("M",), position=("M", 3), arc=("M",))


@dataclass(frozen=True, eq=False, slots=True)
class CommandClock:
    """When a controller commands what of a program: N positions, R runs between stops."""

    begin: Array  # (R,) [s] when each run begins
    duration: Array  # (R,) [s] of each run with its ramps: D
    at_speed: Array  # (R,) [s] of its statements alone: C
    first: Array  # (R,) [s] of all statements before it
    arrive: Array  # (N,) [s] at each position, had there been neither ramps nor stops
    leave: Array  # (N,) [s] after what CNT n < 100 waits there
    end: float  # [s] of the last run

    def position_numbers(self, time: Array) -> Array:
        """Where the command is at rising times (M,) [s]: numbers of positions from 0, between two a share of the way.

        That share is of the segment's time, which is of its length: a statement has one speed.
        """
        run = np.clip(np.searchsorted(self.begin, time, side="right") - 1, 0, len(self.begin) - 1)
        done = self.first[run] + run_law(time - self.begin[run], self.duration[run], self.at_speed[run])
        knots = np.column_stack([self.arrive, self.leave]).ravel()
        numbers = np.repeat(np.arange(len(self.arrive), dtype=float), 2)
        return np.asarray(np.interp(done, knots, numbers))


def command_clock(
    robot: Robot, program: Program, time: Array, override: float = 1.0, settle: Array | None = None
) -> CommandClock:
    """When the controller commands what of a program.

    Args:
        robot: Its interpolation period and its motion.
        program: In World, of N positions.
        time: When the twin's clock passes its positions at full override, (N,) [s]: ``PreparedProgram.time``.
        override: Share of all written speeds that the operator has set.
        settle: How much of the smoothing's settling it waits at each position, (N,): 0 for CNT100, 1 for FINE and
            CNT0; default as the program says.
    """
    settle = program.fine.astype(float) if settle is None else settle
    wait = settle * (settling_time(robot.motion) if robot.motion is not None else 0.0)
    length, period = segment_lengths(program), robot.controller.period
    statement = statement_times(length, program.speed * override, period, _rounds_up(robot), program.via)
    stops = np.flatnonzero(program.fine)
    ramps = np.diff(time[stops]) - np.add.reduceat(statement_times(length, program.speed, period, False), stops[:-1])
    inner = np.where(program.fine, 0.0, wait)
    arrive = np.concatenate([[0.0], np.cumsum(statement + inner[:-1])])
    at_speed = np.diff(arrive[stops])
    duration = at_speed + np.maximum(ramps, 0.0) / override
    begin = np.concatenate([[0.0], np.cumsum(duration + wait[stops[1:]])])
    return CommandClock(begin[:-1], duration, at_speed, arrive[stops[:-1]], arrive, arrive + inner, float(begin[-1]))


def sample_command(
    robot: Robot,
    program: Program,
    time: Array,
    override: float = 1.0,
    step: float | None = None,
    settle: Array | None = None,
) -> Command:
    """The commanded motion of a program.

    Args:
        robot: Its interpolation period and its motion.
        program: In World, of N positions.
        time: When the twin's clock passes its positions at full override, (N,) [s]: ``PreparedProgram.time``.
        override: Share of all written speeds.
        step: Between samples [s]; default the interpolation period.
        settle: As ``command_clock`` has it.
    """
    clock = command_clock(robot, program, time, override, settle)
    step = robot.controller.period if step is None else step
    samples = step * np.arange(int(np.ceil(clock.end / step)) + 2, dtype=float)
    return command_at(program, clock.position_numbers(samples), samples, step)


def command_at(program: Program, number: Array, time: Array, step: float) -> Command:
    """Samples at numbers of positions (M,), as ``CommandClock.position_numbers`` counts them, and times (M,) [s]."""
    numbers = np.arange(len(program.position), dtype=float)
    segment = np.minimum(number.astype(np.int64), len(numbers) - 2)
    if program.via.any():
        position = sweeps(program).places(program.position, segment, number - segment)
    else:
        position = np.column_stack([np.interp(number, numbers, column) for column in program.position.T])
    arc = np.concatenate([[0.0], np.cumsum(segment_lengths(program))])
    return Command(step, time, segment, number - segment, position, np.interp(number, numbers, arc))


def command_rotation(program: Program, command: Command) -> Array:
    """Orientation of the TCP in World at the samples of a command, (M, 3, 3): turning steadily over each segment."""
    k = command.segment
    return interpolate_rotation(program.rotation[k], program.rotation[k + 1], command.fraction)


def command_joints(robot: Robot, tool: Pose, program: Program, theta: Array, command: Command) -> Array:
    """Joints at the samples of a command, (M, 6) [rad], on the program's branch and continuous.

    Args:
        robot: The arm.
        tool: TCP in the flange.
        program: In World.
        theta: Joints at its positions, (N, 6) [rad]: ``PreparedProgram.theta``.
        command: Of the program.
    """
    pose = Pose(command.position, command_rotation(program, command))
    joints, _ = solve_tool(robot, pose, tool, program.posture)
    k = command.segment
    return nearest_turns(joints, theta[k] + command.fraction[:, None] * (theta[k + 1] - theta[k]))


def run_law(time: Array, duration: Array, at_speed: Array) -> Array:
    """How much of its statements' time C (M,) a run of duration D (M,) [s] has done at times (M,) since it began."""
    ramp = np.clip(duration - at_speed, 0.0, duration / 2)
    rate = np.where(duration > ramp, at_speed / np.maximum(duration - ramp, 1e-300), 1.0)
    safe = np.maximum(ramp, 1e-300)

    def run_up(since: Array) -> Array:
        """Of a run that starts to move and never stops: t - T / 2 once it is at speed."""
        u = np.clip(since / safe, 0.0, 1.0)
        return np.where(since < ramp, ramp * u**3 * (1 - u / 2), since - ramp / 2)

    inside = np.clip(time, 0.0, duration)
    rising = run_up(inside)
    falling = at_speed / np.maximum(rate, 1e-300) - run_up(duration - inside)
    done = rate * np.where(inside < duration / 2, rising, falling)
    return np.asarray(np.clip(done, 0.0, at_speed))


def segment_lengths(program: Program) -> Array:
    """Length of each segment, a line or half of an arc, (N - 1,) [m]."""
    return sweeps(program).length


def statement_times(length: Array, speed: Array, period: float, rounds_up: bool, via: BoolArray | None = None) -> Array:
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
    return np.asarray(time / whole * (period * np.ceil(whole / period - SAME)))


def _rounds_up(robot: Robot) -> bool:
    return bool(getattr(robot.controller, "rounds_up_to_period", False))
