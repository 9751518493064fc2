r"""What the real arm does with a program's text, driven as the controller would drive it.

The time comes from the text's own lengths, speeds and stops; the heat from each node's own equation through that time.
The controller's nominal inverse is ``inverse_kinematics``, and every pose it gives is confirmed with the nominal arm to
1e-9 m. CNT is taken as passing through the points. Samples are at most 1 mm apart, the ends and the middle of each
segment among them. A segment is a line, or half of an arc: up to its via, or from there to its end.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, column_extremes, cumulated, frozen, owns
from compgen.core.evaluation import IndexedRows, evaluate, map_blocks
from compgen.core.pose import Pose
from compgen.core.rotations import relative_rotation
from compgen.program.program import Program
from compgen.robot.configuration import apply_turns, has_posture
from compgen.robot.inverse_kinematics import solve_tool
from compgen.thermal import Ambient, Duty, JointMotion, initial_state, still_air
from compgen.verification.twin.circular_motion import Chords, Sweeps, as_chords, sweeps
from compgen.verification.twin.controller.command import WrittenPath
from compgen.verification.twin.controller.deviation import MotionDeviation, motion_deviation
from compgen.verification.twin.direction_history import DirectionHistory
from compgen.verification.twin.faulty_arm import TwinError
from compgen.verification.twin.heat import mode_states, state_after_duties
from compgen.verification.twin.nominal_arm import build_rise_and_growth, build_segment_sample
from compgen.verification.twin.real_arm import Twin, refuse_interference, refuse_wrong_inverse
from compgen.verification.twin.timing import SAME_POSITION, ProgramTiming, segment_times, time_program, time_smoothed

SPACING = 1e-3  # m between samples at most
CHUNK = 16384  # segments at a time


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(segment=("M",), fraction=("M",), time=("M",), rise=("M", "K"), theta=("M", 6))
class Execution:
    """What the real arm does with a program, at M samples."""

    segment: IntArray  # (M,) from 0: a straight line of the program, or half of an arc
    fraction: Array  # (M,) of the segment
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    theta: Array  # (M, 6) [rad] as the controller commands
    actual: Pose  # M of the TCP

    @classmethod
    def concatenate(cls, parts: Sequence["Execution"]) -> "Execution":
        """Samples, part after part."""
        arrays = ("segment", "fraction", "time", "rise", "theta")
        return cls(
            **{name: frozen(np.concatenate([getattr(p, name) for p in parts])) for name in arrays},
            actual=Pose.concatenate([p.actual for p in parts]),
        )


def owning_segments(touching: BoolArray, segment: IntArray, begins: IntArray) -> IntArray:
    """The segments that samples belong to, (M,): the end of one that touches is its own where the next touches not.

    Args:
        touching: Of all segments, (S,).
        segment: Of each sample, (M,).
        begins: Samples at which a segment begins.
    """
    owning, here = segment.copy(), segment[begins]
    owning[begins] -= touching[np.maximum(here - 1, 0)] & ~touching[here]
    return owning


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class PreparedProgram:
    """A program of N positions, S segments between them, with the joints, times and rises that its execution needs."""

    twin: Twin
    program: Program  # in World
    timing: ProgramTiming
    rise: Array  # (N, K) [K] without what the air does from the first duty on
    theta: Array  # (N, 6) [rad]
    turn: Array  # (S, 3) [rad] rotation vector over each segment, in the axes of its start
    samples_per_segment: IntArray  # (S,)
    sweep: Sweeps  # of the segments
    chords: Chords  # what stands for arcs where their joints count
    chord_theta: Array  # (F, 6) [rad]
    air: Ambient
    start_time: float  # [s] from the first duty to the program's start
    history: DirectionHistory = field(default_factory=DirectionHistory)  # of the motion before it
    override: float = 1.0  # share of the written speeds
    led: MotionDeviation | None = None  # beside the path by the controller's motion; None: nowhere, or not known

    @property
    def sample_count(self) -> int:
        """How many samples there are in all."""
        return int(self.samples_per_segment.sum()) + 1

    def first_samples(self) -> IntArray:
        """The sample at each position, (N,)."""
        return np.concatenate([[0], np.cumsum(self.samples_per_segment)])

    def most_on_segments(self, values: Array) -> Array:
        """The largest value of each segment, of samples (M,), (S,): a corner ends one and begins the next."""
        at = self.first_samples()
        return np.maximum(np.maximum.reduceat(values, at[:-1]), values[at[1:]])

    def segments(self, touching: BoolArray) -> IntArray:
        """The segment that each sample belongs to, (M,), of segments (S,) that touch or do not."""
        S = len(self.samples_per_segment)
        segment = np.append(np.repeat(np.arange(S), self.samples_per_segment), S - 1)
        return owning_segments(touching, segment, self.first_samples()[:-1])

    def touching_samples(self, touching: BoolArray) -> BoolArray:
        """Samples (M,) of segments that touch, of which (S,) are given: all where none does."""
        return touching[self.segments(touching)] if touching.any() else np.ones(self.sample_count, dtype=bool)

    def execute(self, progress: Callable[[float], None] = lambda share: None) -> Execution:
        """All samples at once."""
        return Execution.concatenate(list(self.chunks(progress)))

    def chunks(self, progress: Callable[[float], None] = lambda share: None) -> Iterator[Execution]:
        """The samples of some segments at a time; each chunk begins with its first segment's start."""
        S = len(self.samples_per_segment)
        history = self.history

        def execute_chunk(first: int, last: int) -> Execution:
            nonlocal history
            execution, history = self._execute_segments(first, last, history)
            return execution

        # faults remember what was executed before: then one chunk after the other, and not side by side
        chunks = map_blocks(S, execute_chunk, CHUNK) if self.twin.only_grows else _in_order(S, execute_chunk)
        for k, execution in enumerate(chunks, 1):
            yield execution
            progress(min(1.0, k * CHUNK / S))

    def direction_history(self) -> DirectionHistory:
        """What this program leaves for the one after it."""
        S, history = len(self.samples_per_segment), self.history
        for first in range(0, S, CHUNK):
            _, history = self._execute_segments(first, min(S, first + CHUNK), history)
        return history

    def _execute_segments(self, first: int, last: int, history: DirectionHistory) -> tuple[Execution, DirectionHistory]:
        """Samples of the segments first to last, with the end of the program where it is among them.

        Raises:
            TwinError: Out of reach, or the inverse and the nominal arm disagree, or pinocchio disagrees with either.
        """
        twin = self.twin
        counts = self.samples_per_segment[first:last]
        begin = np.concatenate([[0], np.cumsum(counts)])
        segment = np.repeat(np.arange(first, last), counts)
        fraction = (np.arange(begin[-1]) - begin[segment - first]) / self.samples_per_segment[segment]
        if last == len(self.samples_per_segment):
            segment, fraction = np.append(segment, last - 1), np.append(fraction, 1.0)
        time = self.timing.time[segment] + fraction * np.diff(self.timing.time[first : last + 1])[segment - first]
        rise, growth = self.rise_and_growth(segment, fraction, time)
        has_arcs = bool(self.program.via[first : last + 1].any())
        function = build_segment_sample(twin.robot, self.program.posture, twin.tool, arcs=has_arcs)
        positions, rows = self.program.position, self.program.rotation.reshape(-1, 9)
        way = IndexedRows(positions, segment + 1)
        if has_arcs:
            way = IndexedRows(self.sweep.rows(first, last), segment - first)
        ends = IndexedRows(positions, segment), way, IndexedRows(rows, segment), IndexedRows(self.turn, segment)
        joints = IndexedRows(self.theta, segment), IndexedRows(self.theta, segment + 1)
        theta, position, rotation, checks = evaluate(function, *ends, *joints, fraction[:, None], growth)
        reach_margin, distance, turned = checks.T
        if reach_margin.min() < 0:
            raise TwinError(f"P[{segment[int(np.argmin(reach_margin))] + 1}]: out of the controller's reach")
        refuse_wrong_inverse(segment, distance, turned)
        refuse_interference(twin.robot, theta, segment)
        every = max(1, (len(segment) * len(self.samples_per_segment)) // (twin.confirmed * (last - first)))
        actual = Pose.from_rows(position, rotation)
        twin.confirm_by_pinocchio(theta, growth, actual, every)
        if not twin.only_grows:
            actual, history = twin.faulty_pose(theta, growth, rise, history, every)
        if self.led is not None:
            start = int(self.samples_per_segment[:first].sum())
            actual = self.led.moved(actual, slice(start, start + len(segment)))
        return Execution(segment=segment, fraction=fraction, time=time, rise=rise, theta=theta, actual=actual), history

    def rise_and_growth(self, segment: IntArray, fraction: Array, time: Array) -> tuple[Array, Array]:
        """Rises (M, K) [K] and growths (M, 6) [m] on segments, (M,), at their fractions (M,) and times (M,) [s].

        The nodes by their own equation; another model straight between two positions, seconds apart against hours.
        """
        law, K = self.twin.heat.law, self.rise.shape[1]
        if law is None:
            rise = self.rise[segment] + fraction[:, None] * (self.rise[segment + 1] - self.rise[segment])
        else:
            first, last = int(segment[0]), int(segment[-1]) + 1
            steady = law.steady_rise("moving", self.timing.driven[first:last])
            since = (time - self.timing.time[segment])[:, None]
            per_kelvin = self.twin.growth_per_kelvin().reshape(1, -1)
            rise, growth = evaluate(
                build_rise_and_growth(K), IndexedRows(self.rise, segment), IndexedRows(steady, segment - first),
                law.tau[None], per_kelvin, since,
            )  # fmt: skip
            if self.air.is_still:
                return rise, growth
        if not self.air.is_still:
            rise = rise + self._air_rise(time)
        return rise, self.twin.growth(rise)

    def rises_at(self, rows: IntArray) -> Array:
        """Rises at some of the positions, (M,) rising numbers, to (M, K) [K]."""
        rise = self.rise[rows]
        return rise if self.air.is_still else rise + self._air_rise(self.timing.time[rows])

    def _air_rise(self, time: Array) -> Array:
        """What the air adds: the exact response on a grid of seconds, a straight line between, (M, K) [K]."""
        heat = self.twin.heat
        grid = np.arange(np.floor(time[0]), time[-1] + 2.0, 1.0)
        states = heat.ambient * self.air.response(heat.rate, 0.0, self.start_time + grid)
        return np.array([np.interp(time, grid, column) for column in (states @ heat.outputs.T).T]).T

    def at_override(self, share: float) -> "PreparedProgram":
        """The program driven at a share of its speeds; its warmth is left to ``reheated``."""
        slower = replace(self, override=self.override * share)
        robot, length = self.twin.robot, np.maximum(self.sweep.length, SAME_POSITION)
        if robot.motion is not None and robot.motion.is_smooth:
            timing = time_smoothed(robot.controller, robot.motion, self.program, length, slower.override)
            return replace(slower, timing=timing, led=slower.motion_deviation())
        duration, controller = np.diff(self.timing.unrounded) / share, robot.controller
        whole = segment_times(controller, duration, self.program.via, rounds_up=True)
        taken = whole if controller.rounds_up_to_period else duration
        factor = np.diff(self.timing.time) / taken
        timing = self.timing._replace(
            time=cumulated(taken),
            unrounded=self.timing.unrounded / share,
            rounded_up=float(whole.sum()),
            driven=self.timing.driven * factor,
            highest=self.timing.highest * factor,
        )
        return replace(slower, timing=timing, led=slower.motion_deviation())

    def motion_deviation(self) -> MotionDeviation | None:
        """Where the controller's motion leads the tool at this override."""
        robot, tool = self.twin.robot, self.twin.tool
        return motion_deviation(robot, tool, self.written_path(), self.samples_per_segment, self.override)

    def written_path(self) -> WrittenPath:
        """The path of its text, with the twin's times at full override."""
        return WrittenPath(self.program, self.sweep, self.timing.unrounded * self.override, self.theta, self.turn)

    def with_ramps(self, share: float) -> "PreparedProgram":
        """The program with ramps at a share of the accelerations assumed; its warmth is left to ``reheated``."""
        robot = self.twin.robot
        slower = replace(robot, acceleration=share * robot.acceleration, jerk=share * robot.jerk)
        return replace(self, timing=time_program(slower, self.program, self.sweep.length, self.theta))

    def with_rise(self, rise: Array) -> "PreparedProgram":
        """The program with given rises at its positions, (N, K) [K], what the air does among them."""
        return replace(self, rise=rise, air=still_air())

    def reheated(self, twin: Twin, duties: Sequence[Duty], air: Ambient | None) -> "PreparedProgram":
        """The program prepared for an arm that differs in its heat and what was before only."""
        return replace(self, twin=twin, **_thermal_fields(twin, self.motion(), self.chords.rows, duties, air))

    def motion(self) -> JointMotion:
        """What the drives do, from chord to chord."""
        return JointMotion(
            self.chords.times(self.timing.time), self.chord_theta, self.timing.driven[self.chords.segment]
        )


def prepare(twin: Twin, program: Program, duties: Sequence[Duty], air: Ambient | None = None) -> PreparedProgram:
    """Joints, times and rises at the positions of a program, for executing it chunk by chunk.

    Args:
        twin: The real arm.
        program: As read back from its text, in the twin's user frame.
        duties: What the cell did before.
        air: Over time, from the first duty on; default still.

    Raises:
        TwinError: The text cannot be followed: out of reach, or another posture.
    """
    if twin.uframe is not None:
        in_world = twin.uframe @ Pose(program.position, program.rotation)
        program = replace(program, position=in_world.position, rotation=in_world.rotation)
    sweep = sweeps(program)
    chords = as_chords(program, sweep)
    chord_theta = _joints_of_chords(twin, chords)
    theta = chord_theta[chords.rows] if program.via.any() else chord_theta
    timing = time_program(twin.robot, program, sweep.length, theta)
    motion = JointMotion(chords.times(timing.time), chord_theta, timing.driven[chords.segment])
    thermal = _thermal_fields(twin, motion, chords.rows, duties, air)
    turn = relative_rotation(program.rotation[:-1], program.rotation[1:])
    samples_per_segment = 2 * np.maximum(1, np.ceil(sweep.length / (2 * SPACING) - 1e-9)).astype(np.int64)
    prepared = PreparedProgram(
        twin=twin,
        program=program,
        theta=theta,
        turn=turn,
        samples_per_segment=samples_per_segment,
        sweep=sweep,
        chords=chords,
        chord_theta=chord_theta,
        timing=timing,
        **thermal,
    )
    return replace(prepared, led=prepared.motion_deviation())


def execute(
    twin: Twin,
    program: Program,
    duties: Sequence[Duty],
    progress: Callable[[float], None] = lambda share: None,
    air: Ambient | None = None,
) -> Execution:
    """Execute a program after the given duties.

    Args:
        twin: The real arm.
        program: As read back from its text.
        duties: What the cell did before.
        progress: Called with the share done.
        air: Over time, from the first duty on; default still.

    Raises:
        TwinError: The text cannot be followed: out of reach, another posture, or inverse and pinocchio disagree.
    """
    return prepare(twin, program, duties, air).execute(progress)


def _thermal_fields(
    twin: Twin, motion: JointMotion, rows: IntArray, duties: Sequence[Duty], air: Ambient | None
) -> dict[str, Any]:
    """The fields of a prepared program that heat decides, from its motion, whose rows are its positions."""
    heat = twin.heat
    state = state_after_duties(heat, duties, initial_state(heat, air))
    states = mode_states(heat.rate, state, motion.time, heat.steady_states(motion))
    at_positions = states if len(rows) == len(states) else states[rows]
    return {
        "rise": at_positions @ heat.outputs.T,
        "air": air or still_air(),
        "start_time": sum(d.duration for d in duties),
    }


def _joints_of_chords(twin: Twin, chords: Chords) -> Array:
    """Joints of the F positions of a program by chords, with the posture and turns that its text names, (F, 6) [rad].

    Raises:
        TwinError: Out of reach or of a limit, or the joints contradict the text.
    """
    robot, program = twin.robot, chords.program

    def number(row: int) -> int:
        """P[n] of a position, or of the one before it."""
        return int(np.searchsorted(chords.rows, row, side="right"))

    theta, margin = solve_tool(robot, Pose(program.position, program.rotation), twin.tool, program.posture)
    if margin.min() < 0:
        raise TwinError(f"P[{number(int(np.argmin(margin)))}]: out of the controller's reach")
    theta = apply_turns(robot, theta, program.turns)
    if not has_posture(robot, theta, program.posture).all():
        raise TwinError("the joints of a position contradict its CONFIG letters")
    lowest, highest = column_extremes(theta)
    if max((robot.lower - lowest).max(), (highest - robot.upper).max()) > 1e-6:
        excess = np.maximum(robot.lower - theta, theta - robot.upper)
        row, i = np.unravel_index(int(np.argmax(excess)), excess.shape)
        raise TwinError(
            f"P[{number(int(row))}]: joint {robot.joint_names[int(i)]} is beyond its limit in the posture of its CONFIG"
        )
    refuse_interference(robot, theta, np.arange(len(theta)))
    step = max((np.abs(np.diff(joint)) for joint in theta.T), key=lambda each: each.max(initial=0.0))
    if step.max(initial=0.0) > np.pi / 2:
        n = number(int(np.argmax(step)))
        raise TwinError(f"P[{n}] to P[{n + 1}]: a joint turns by over 90 deg within one line")
    return frozen(theta)


def _in_order(count: int, work: Callable[[int, int], Execution]) -> Iterator[Execution]:
    """The results of work(first, last) over a count, one chunk after the other."""
    return (work(first, min(count, first + CHUNK)) for first in range(0, count, CHUNK))
