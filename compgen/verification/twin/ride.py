r"""The real arm, independently: driven by the program's text as the controller would drive it.

Nothing here comes from the optimiser's chain. The arm is ``plant``'s, confirmed by pinocchio on samples of every ride;
its lengths are grown by summing thin elements of each link's profile; the time comes from the text's own lengths,
speeds and stops; the heat from each node's own equation through that time. The controller's nominal inverse is ``ik``,
and every pose it gives is confirmed with the nominal arm to 1e-9 m. CNT is taken as passing through the points.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray, column_extremes, norm, own
from compgen.core.evaluation import IndexedRows, evaluate, map_blocks
from compgen.core.rotations import relative_rotation
from compgen.fanuc.configuration import apply_turns, has_posture
from compgen.fanuc.program import Program
from compgen.robot.inverse_kinematics import solve_tool
from compgen.robot.robot import Robot
from compgen.thermal import (
    Ambient,
    Duty,
    JointMotion,
    NodeModel,
    Profile,
    Section,
    ThermalModel,
    initial_state,
    still_air,
)
from compgen.verification.twin.clock import clock
from compgen.verification.twin.faulty_arm import Flaws, Past, Placed, TwinError, real_arm
from compgen.verification.twin.heat import warmed
from compgen.verification.twin.nominal_arm import AGREE, LENGTHS, build_drive, build_fly, build_warmth, disagreement

ELEMENT = 0.1e-3  # m
GRID = 1e-3  # m
CONFIRM = 1e-9  # m
CONFIRMED = 1000  # samples of a ride that pinocchio repeats
CHUNK = 16384  # segments at a time


@dataclass(frozen=True, eq=False, slots=True)
class Ride:
    """What the real arm does with a program, at M samples."""

    segment: IntArray  # (M,)
    fraction: Array  # (M,) of the segment
    time: Array  # (M,) [s]
    rise: Array  # (M, K) [K]
    theta: Array  # (M, 6) [rad] as the controller commands
    position: Array  # (M, 3) [m] actual TCP
    rotation: Array  # (M, 3, 3)

    def __post_init__(self) -> None:
        own(
            self,
            segment=("M",),
            fraction=("M",),
            time=("M",),
            rise=("M", "K"),
            theta=("M", 6),
            position=("M", 3),
            rotation=("M", 3, 3),
        )


@dataclass(frozen=True, eq=False, slots=True)
class Leg:
    """A program made ready to be driven: what happens on each of its S lines."""

    twin: "Twin"
    program: Program
    time: Array  # (N,) [s]
    rise: Array  # (N, K) [K] without what the air does from the first duty on
    driven: Array  # (S,) [m/s]
    theta: Array  # (N, 6) [rad]
    turn: Array  # (S, 3) [rad] rotation vector over each line, in the axes of its start
    pieces: IntArray  # (S,) samples on each
    air: Ambient
    clock: float  # [s] from the first duty to the program's start

    def ride(self, progress: Callable[[float], None] = lambda share: None) -> Ride:
        """All samples."""
        rides = list(self.rides(progress))
        return Ride(*(np.concatenate([getattr(r, name) for r in rides]) for name in Ride.__slots__))

    @property
    def samples(self) -> int:
        """How many there are in all."""
        return int(self.pieces.sum()) + 1

    def first_samples(self) -> IntArray:
        """The sample at each position, (N,)."""
        return np.concatenate([[0], np.cumsum(self.pieces)])

    def rides(self, progress: Callable[[float], None] = lambda share: None) -> Iterator[Ride]:
        """The samples, a stretch of lines at a time; each stretch begins with its first line's start."""
        S = len(self.pieces)
        past = Past()

        def driven(first: int, last: int) -> Ride:
            nonlocal past
            ride, past = self._ride(first, last, past)
            return ride

        # flaws remember what was driven before: then one stretch after the other
        stretches = map_blocks(S, driven, CHUNK) if self.twin.flaws is None else _in_turn(S, driven)
        for k, ride in enumerate(stretches, 1):
            yield ride
            progress(min(1.0, k * CHUNK / S))

    def _ride(self, first: int, last: int, past: Past) -> tuple[Ride, Past]:
        """Samples of the lines first to last, with the end of the program where it is among them.

        Raises:
            TwinError: Out of reach, or ik and the nominal arm disagree, or pinocchio disagrees with either.
        """
        twin = self.twin
        pieces = self.pieces[first:last]
        begin = np.concatenate([[0], np.cumsum(pieces)])
        line = np.repeat(np.arange(first, last), pieces)
        fraction = (np.arange(begin[-1]) - begin[line - first]) / self.pieces[line]
        if last == len(self.pieces):
            line, fraction = np.append(line, last - 1), np.append(fraction, 1.0)
        now = self.time[line] + fraction * np.diff(self.time[first : last + 1])[line - first]
        rise, growth = self.warmth(line, fraction, now)
        drive = build_drive(
            twin.robot, self.program.posture, twin.tool_position.tobytes(), twin.tool_rotation.tobytes()
        )
        places, rows = self.program.position, self.program.rotation.reshape(-1, 9)
        theta, position, rotation, wrong = evaluate(
            drive, IndexedRows(places, line), IndexedRows(places, line + 1), IndexedRows(rows, line),
            IndexedRows(self.turn, line), IndexedRows(self.theta, line), IndexedRows(self.theta, line + 1),
            fraction[:, None], growth,
        )  # fmt: skip
        if wrong[:, 0].min() < 0:
            raise TwinError(f"P[{line[int(np.argmin(wrong[:, 0]))] + 1}]: out of the controller's reach")
        refuse_unlike(line, wrong[:, 1], wrong[:, 2])
        every = max(1, (len(line) * len(self.pieces)) // (CONFIRMED * (last - first)))
        twin.agree(theta, growth, (position, rotation), every)
        rotation = rotation.reshape(-1, 3, 3)
        if twin.flaws is not None:
            position, rotation, past = twin.flawed(theta, growth, rise, past, every)
        return Ride(line, fraction, now, rise, theta, position, rotation), past

    def warmth(self, line: IntArray, fraction: Array, now: Array) -> tuple[Array, Array]:
        """Rises (M, K) [K] and growths (M, 6) [m] on lines, (M,), at their fractions (M,) and moments (M,) [s].

        The nodes by their own equation; another model straight between two positions, seconds apart against hours.
        """
        heat, K = self.twin.heat, self.rise.shape[1]
        if not isinstance(heat, NodeModel):
            rise = self.rise[line] + fraction[:, None] * (self.rise[line + 1] - self.rise[line])
        else:
            first, last = int(line[0]), int(line[-1]) + 1
            goal = heat.steady_rise("moving", self.driven[first:last])
            since, per = (now - self.time[line])[:, None], self.twin.growths().reshape(1, -1)
            rise, growth = evaluate(
                build_warmth(K),
                IndexedRows(self.rise, line),
                IndexedRows(goal, line - first),
                heat.tau[None],
                per,
                since,
            )
            if self.air.is_still:
                return rise, growth
        if not self.air.is_still:
            rise = rise + self._breathed(now)
        return rise, self.twin.growth(rise)

    def _breathed(self, now: Array) -> Array:
        """What the air adds: the exact response on a grid of seconds, a line between, (M, K) [K]."""
        heat = self.twin.heat
        grid = np.arange(np.floor(now[0]), now[-1] + 2.0, 1.0)
        share = heat.ambient * self.air.response(heat.rate, 0.0, self.clock + grid)
        return np.array([np.interp(now, grid, column) for column in (share @ heat.outputs.T).T]).T

    def rewarmed(self, twin: "Twin", duties: Sequence[Duty], air: Ambient | None = None) -> "Leg":
        """The same drive of an arm with another warmth."""
        return replace(self, twin=twin, **twin.heated(self.time, self.theta, self.driven, duties, air))


@dataclass(frozen=True, eq=False, slots=True)
class Twin:
    """The real arm with its tool and its warmth."""

    robot: Robot
    heat: ThermalModel
    profiles: tuple[Profile, ...]
    tool_position: Array  # (3,) [m]
    tool_rotation: Array  # (3, 3)
    flaws: Flaws | None = None  # beside growth; None is a perfect arm that only grows

    def ride(
        self,
        program: Program,
        duties: Sequence[Duty],
        progress: Callable[[float], None] = lambda share: None,
        air: Ambient | None = None,
    ) -> Ride:
        """Drive a program after the given duties.

        Args:
            program: As read back from its text.
            duties: What the cell did before.
            progress: Called with the share done.
            air: Over time, from the first duty on; default still.

        Returns:
            Samples at most 1 mm apart, each segment's ends and middle among them.

        Raises:
            TwinError: The text cannot be followed: out of reach, another posture, or ik and pinocchio disagree.
        """
        return self.ready(program, duties, air).ride(progress)

    def ready(self, program: Program, duties: Sequence[Duty], air: Ambient | None = None) -> Leg:
        """Joints, clock and heat at the positions of a program, for driving it stretch by stretch.

        Raises:
            TwinError: Out of reach, or another posture.
        """
        step = np.diff(program.position, axis=0)
        length = norm(step)
        points = self._joints_at(program)
        time, driven = clock(self.robot, program, length, points)
        warm = self.heated(time, points, driven, duties, air)
        turn = relative_rotation(program.rotation[:-1], program.rotation[1:])
        pieces = 2 * np.maximum(1, np.ceil(length / (2 * GRID) - 1e-9)).astype(np.int64)
        return Leg(self, program, time, driven=driven, theta=points, turn=turn, pieces=pieces, **warm)

    def heated(
        self, time: Array, theta: Array, driven: Array, duties: Sequence[Duty], air: Ambient | None
    ) -> dict[str, Any]:
        """The fields of a leg that its warmth decides."""
        goals = self.heat.steady_states(JointMotion(time, theta, driven))
        states = warmed(self.heat.rate, self._warm(duties, air), time, goals)
        clock = sum(d.duration for d in duties)
        return {"rise": states @ self.heat.outputs.T, "air": air or still_air(), "clock": clock}

    def reach(
        self, theta: Array, rise: Array, progress: Callable[[float], None], tool: Placed | None = None
    ) -> tuple[Array, Array]:
        """Where the tool really is, at samples in the order in which they are driven.

        Args:
            theta: Commanded joints, (M, 6) [rad].
            rise: (M, K) [K].
            progress: Called with the share done.
            tool: A tool a sample, (M, 3, 3) and (M, 3) [m]; default the twin's own.

        Returns:
            (M, 3) [m] and (M, 3, 3).
        """
        if self.flaws is None and tool is None:
            return self._fly(theta, self.growth(rise), progress)
        every = max(1, len(theta) // CONFIRMED)
        position, rotation, _ = self.flawed(theta, self.growth(rise), rise, Past(), every, tool)
        progress(1.0)
        return position, rotation

    def flawed(
        self, theta: Array, growth: Array, rise: Array, past: Past, every: int, tool: Placed | None = None
    ) -> tuple[Array, Array, Past]:
        """The TCP with all flaws, (M, 3) [m] and (M, 3, 3), and what the samples leave for those after them."""
        arm = real_arm(self.robot, self.flaws or Flaws())
        grown = dict(zip(LENGTHS, growth.T))
        mine = (self.tool_rotation[None], self.tool_position[None])
        return arm.fly(theta, grown, rise, tool or mine, past, every)

    def confirm(
        self, theta: Array, position: Array, rotation: Array, segment: IntArray, progress: Callable[[float], None]
    ) -> None:
        """Raises TwinError unless the nominal arm is where the controller's inverse says, to 1e-9 m."""
        nominal = self._fly(theta, np.zeros((len(theta), len(LENGTHS))), progress)
        off = norm(nominal[0] - position)
        turned = np.linalg.norm(nominal[1] - rotation, axis=(1, 2))
        refuse_unlike(segment, off, turned)

    def _fly(self, theta: Array, growth: Array, progress: Callable[[float], None]) -> tuple[Array, Array]:
        """The real TCP at joints (M, 6) [rad] and growths (M, 6) [m], confirmed by pinocchio on samples."""
        tool = (self.tool_position.tobytes(), self.tool_rotation.tobytes())
        pose = evaluate(build_fly(self.robot, *tool), theta, growth)
        self.agree(theta, growth, pose, max(1, len(theta) // CONFIRMED))
        progress(1.0)
        return pose[0], pose[1].reshape(-1, 3, 3)

    def agree(self, theta: Array, growth: Array, pose: tuple[Array, ...], every: int) -> None:
        """Raises TwinError unless pinocchio agrees on every so many of the samples, and on the last."""
        some = np.unique(np.append(np.arange(0, len(theta), every), max(len(theta) - 1, 0)))[: len(theta)]
        found = (pose[0][some], pose[1][some])
        far = disagreement(self.robot, self.tool_position, self.tool_rotation, theta[some], growth[some], found)
        if not far <= AGREE:
            raise TwinError(f"pinocchio's arm is {far:.1e} from the twin's: the twin cannot be trusted")

    def _warm(self, duties: Sequence[Duty], air: Ambient | None) -> Array:
        state = initial_state(self.heat, air)
        for duty in duties:
            goal = self.heat.steady_state(duty)
            state = goal - (goal - state) * np.exp(-duty.duration * self.heat.rate)
        return state

    def _joints_at(self, program: Program) -> Array:
        """Joints of the positions, with the posture and turns that the text names, (N, 6) [rad].

        Raises:
            TwinError: Out of reach or of a limit, or the joints contradict the text.
        """
        tool = (self.tool_position, self.tool_rotation)
        theta, margin = solve_tool(self.robot, program.position, program.rotation, *tool, program.posture)
        if margin.min() < 0:
            raise TwinError(f"P[{int(np.argmin(margin)) + 1}]: out of the controller's reach")
        theta = apply_turns(self.robot, theta, program.turns)
        if not has_posture(self.robot, theta, program.posture).all():
            raise TwinError("the joints of a position contradict its CONFIG letters")
        if theta_over(self.robot, theta) > 1e-6:
            over = np.maximum(self.robot.lower - theta, theta - self.robot.upper)
            row, i = np.unravel_index(int(np.argmax(over)), over.shape)
            raise TwinError(
                f"P[{row + 1}]: joint {self.robot.joint_names[int(i)]} is beyond its limit in the posture of its CONFIG"
            )
        turn = np.abs(np.diff(theta, axis=0))
        if turn.max(initial=0.0) > np.pi / 2:
            n = int(np.argmax(turn.max(axis=1)))
            raise TwinError(f"P[{n + 1}] to P[{n + 2}]: a joint turns by over 90 deg within one line")
        return theta

    def growth(self, rise: Array) -> Array:
        """Growth of each of ``plant.LENGTHS``, (M, 6) [m], by summing thin elements."""
        return np.asarray(rise @ self.growths())

    def growths(self) -> Array:
        """The same per kelvin of each node, (K, 6) [m/K]."""
        reference = dict(zip(self.heat.names, self.heat.reference_rise.tolist()))
        grown = np.zeros((len(self.heat.names), len(LENGTHS)))
        for profile in self.profiles:
            column = list(LENGTHS).index(profile.length)
            for s in profile.sections:
                a, b = (self.heat.names.index(n) for n in (s.node_a, s.node_b))
                count = max(1, round((s.end - s.start) / ELEMENT))
                share = _element_shares(s, reference, count)
                element = profile.cte * (s.end - s.start) / count
                grown[a, column] += element * share.sum()
                grown[b, column] += element * (1 - share).sum()
        return grown


def _in_turn(count: int, work: Callable[[int, int], Ride]) -> Iterator[Ride]:
    return (work(at, min(count, at + CHUNK)) for at in range(0, count, CHUNK))


def theta_over(robot: Robot, theta: Array) -> float:
    """How far any joint is beyond its limits, at most [rad]; below zero inside."""
    lowest, highest = column_extremes(theta)
    return float(max((robot.lower - lowest).max(), (highest - robot.upper).max()))


def refuse_unlike(line: IntArray, off: Array, turned: Array) -> None:
    """Raises TwinError where the nominal TCP is off a pose asked for, (M,) [m] and turned against it, (M,)."""
    if not (off.max(initial=0.0) <= CONFIRM and turned.max(initial=0.0) <= 10 * CONFIRM):
        m = int(np.argmax(off + turned))
        raise TwinError(
            f"P[{line[m] + 1}]: the nominal arm is {off[m]:.1e} m from the pose asked for: "
            "the inverse kinematics cannot be trusted here"
        )


def _element_shares(section: Section, reference: dict[str, float], count: int) -> Array:
    """Share of node a's rise at the middle of each element: the fixed shape of the reference state."""
    u = (np.arange(count) + 0.5) / count
    ra, rb = reference[section.node_a], reference[section.node_b]
    if section.shape == "linear" or ra == rb:
        return 1 - u
    return np.asarray((ra ** (1 - u) * rb**u - rb) / (ra - rb))
