r"""The real arm, independently: driven by the program's text as the controller would drive it.

Nothing here comes from the optimiser's chain. The arm is ``plant``'s, confirmed by pinocchio on samples of every ride;
its lengths are grown by summing thin elements of each link's profile; the time comes from the text's own lengths,
speeds and stops; the heat from each node's own equation through that time. The controller's nominal inverse is ``ik``,
and every pose it gives is confirmed with the nominal arm to 1e-9 m. CNT is taken as passing through the points.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.arrays import Array, IntArray, norm, own
from compgen.dialects.fanuc_ls.program import Program, apply_turns, in_posture
from compgen.evaluation import Picked, evaluate
from compgen.exceptions import CompgenError
from compgen.ik import flange_of, solve
from compgen.plant import AGREE, LENGTHS, build_drive, build_fly, build_warmth, disagreement
from compgen.real_arm import Flaws, Past, Placed, real_arm
from compgen.robot import Robot
from compgen.rotations import turns
from compgen.thermal import Duty, NodeModel, Profile, Section

ELEMENT = 0.1e-3  # m
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share of the joints' limits that a ramp uses
GRID = 1e-3  # m
CONFIRM = 1e-9  # m
CONFIRMED = 1000  # samples of a ride that pinocchio repeats
CHUNK = 65536  # segments at a time
FADED = 200.0  # time constants of a node over which its heat is summed in one go


class TwinError(CompgenError):
    """The twin cannot follow the text: the program must not be used."""

    exit_code = 1


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
    rise: Array  # (N, K) [K]
    driven: Array  # (S,) [m/s]
    theta: Array  # (N, 6) [rad]
    turn: Array  # (S, 3) [rad] rotation vector over each line, in the axes of its start
    pieces: IntArray  # (S,) samples on each

    def ride(self, progress: Callable[[float], None] = lambda share: None) -> Ride:
        """All samples."""
        rides = list(self.rides(progress))
        return Ride(*(np.concatenate([getattr(r, name) for r in rides]) for name in Ride.__slots__))

    def first_samples(self) -> IntArray:
        """The sample at each position, (N,)."""
        return np.concatenate([[0], np.cumsum(self.pieces)])

    def rides(self, progress: Callable[[float], None] = lambda share: None) -> Iterator[Ride]:
        """The samples, a stretch of lines at a time; each stretch begins with its first line's start."""
        S = len(self.pieces)
        past = Past()
        for first in range(0, S, CHUNK):
            last = min(S, first + CHUNK)
            ride, past = self._ride(first, last, past)
            yield ride
            progress(last / S)

    def _ride(self, first: int, last: int, past: Past) -> tuple[Ride, Past]:
        """Samples of the lines first to last, with the end of the program where it is among them.

        Raises:
            TwinError: Out of reach, or ik and the nominal arm disagree, or pinocchio disagrees with either.
        """
        twin, heat = self.twin, self.twin.heat
        pieces = self.pieces[first:last]
        begin = np.concatenate([[0], np.cumsum(pieces)])
        line = np.repeat(np.arange(first, last), pieces)
        fraction = (np.arange(begin[-1]) - begin[line - first]) / self.pieces[line]
        if last == len(self.pieces):
            line, fraction = np.append(line, last - 1), np.append(fraction, 1.0)
        now = self.time[line] + fraction * np.diff(self.time[first : last + 1])[line - first]
        goal = heat.steady("moving", self.driven[first:last])
        since = (now - self.time[line])[:, None]
        warmth = build_warmth(len(heat.tau))
        per = twin.growths().reshape(1, -1)
        rise, growth = evaluate(warmth, Picked(self.rise, line), Picked(goal, line - first), heat.tau[None], per, since)
        drive = build_drive(
            twin.robot, self.program.posture, twin.tool_position.tobytes(), twin.tool_rotation.tobytes()
        )
        places, rows = self.program.position, self.program.rotation.reshape(-1, 9)
        theta, position, rotation, wrong = evaluate(
            drive, Picked(places, line), Picked(places, line + 1), Picked(rows, line), Picked(self.turn, line),
            Picked(self.theta, line), Picked(self.theta, line + 1), fraction[:, None], growth,
        )  # fmt: skip
        if wrong[:, 0].min() < 0:
            raise TwinError(f"P[{line[int(np.argmin(wrong[:, 0]))] + 1}]: out of the controller's reach")
        refuse_unlike(line, wrong[:, 1], wrong[:, 2])
        every = max(1, (len(line) * len(self.pieces)) // (CONFIRMED * (last - first)))
        twin.agree(theta, growth, (position, rotation), every)
        rotation = rotation.reshape(-1, 3, 3)
        if twin.flaws is not None:
            position, rotation, past = twin.flawed(theta, growth, rise, past)
        return Ride(line, fraction, now, rise, theta, position, rotation), past


@dataclass(frozen=True, eq=False, slots=True)
class Twin:
    """The real arm with its tool and its warmth."""

    robot: Robot
    heat: NodeModel
    profiles: tuple[Profile, ...]
    tool_position: Array  # (3,) [m]
    tool_rotation: Array  # (3, 3)
    flaws: Flaws | None = None  # beside growth; None is a perfect arm that only grows

    def ride(
        self, program: Program, duties: Sequence[Duty], progress: Callable[[float], None] = lambda share: None
    ) -> Ride:
        """Drive a program after the given duties.

        Args:
            program: As read back from its text.
            duties: What the cell did before.
            progress: Called with the share done.

        Returns:
            Samples at most 1 mm apart, each segment's ends and middle among them.

        Raises:
            TwinError: The text cannot be followed: out of reach, another posture, or ik and pinocchio disagree.
        """
        return self.ready(program, duties).ride(progress)

    def ready(self, program: Program, duties: Sequence[Duty]) -> Leg:
        """Joints, clock and heat at the positions of a program, for driving it stretch by stretch.

        Raises:
            TwinError: Out of reach, or another posture.
        """
        step = np.diff(program.position, axis=0)
        length = norm(step)
        points = self._joints_at(program)
        time, driven = self._clock(program, length, points)
        rise = self._heated(self._warm(np.zeros(len(self.heat.tau)), duties), time, driven)
        turn = turns(program.rotation[:-1], program.rotation[1:])
        pieces = 2 * np.maximum(1, np.ceil(length / (2 * GRID) - 1e-9)).astype(np.int64)
        return Leg(self, program, time, rise, driven, points, turn, pieces)

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
        position, rotation, _ = self.flawed(theta, self.growth(rise), rise, Past(), tool)
        progress(1.0)
        return position, rotation

    def flawed(
        self, theta: Array, growth: Array, rise: Array, past: Past, tool: Placed | None = None
    ) -> tuple[Array, Array, Past]:
        """The TCP with all flaws, (M, 3) [m] and (M, 3, 3), and what the samples leave for those after them."""
        arm = real_arm(self.robot, self.flaws or Flaws())
        grown = dict(zip(LENGTHS, growth.T))
        mine = (self.tool_rotation[None], self.tool_position[None])
        return arm.fly(theta, grown, rise, tool or mine, past)

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

    def _clock(self, program: Program, length: Array, theta: Array) -> tuple[Array, Array]:
        r"""When each position is passed (N,) [s], and the speed really driven on each segment, (N - 1,) [m/s].

        A run between two stops takes its length over the written speeds and half of each ramp. A ramp to speed v takes
        T(v) = v / a + a / j, or 2 sqrt(v / j) below a^2 / j, with a and j what the joints allow along the path at its
        stop. A run too short for both ramps reaches the speed p with p T(p) = length, and takes 2 T(p).
        """
        ends = np.flatnonzero(program.fine)
        first, last = ends[:-1], ends[1:] - 1
        a_first, j_first = self._ramp_limits(theta, length, first)
        a_last, j_last = self._ramp_limits(theta, length, last)
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

    def _ramp_limits(self, theta: Array, length: Array, line: IntArray) -> tuple[Array, Array]:
        """Acceleration and jerk along the path that the joints allow a ramp on some lines [m/s2], [m/s3]."""
        share = np.abs(theta[line + 1] - theta[line]) / length[line, None] + 1e-12  # rad/m
        a = RAMP_ACCELERATION * (self.robot.acceleration / share).min(axis=1)
        return a, RAMP_JERK * (self.robot.jerk / share).min(axis=1)

    def _warm(self, rise: Array, duties: Sequence[Duty]) -> Array:
        for duty in duties:
            goal = self.heat.steady(duty.state, np.array([duty.feed]))[0]
            rise = goal - (goal - rise) * np.exp(-duty.duration / self.heat.tau)
        return rise

    def _heated(self, rise: Array, time: Array, speed: Array) -> Array:
        r"""Each node by its own equation through every segment, (N, K) [K].

        rise_{n+1} = goal_n + (rise_n - goal_n) k_n, k_n = exp(-dt_n / tau), is a sum once divided by the product of all
        k so far; a stretch as long as that product stays a number is summed in one go.
        """
        goals = self.heat.steady("moving", speed)
        drop = np.diff(time)[:, None] / self.heat.tau
        out = np.empty((len(time), len(rise)))
        out[0] = rise
        first = 0
        passed = np.concatenate([[0.0], np.cumsum(drop.max(axis=1))])
        while first < len(speed):
            last = max(first + 1, int(np.searchsorted(passed, passed[first] + FADED, side="right")) - 1)
            kept = np.exp(-np.cumsum(drop[first:last], axis=0))
            gain = goals[first:last] * -np.expm1(-drop[first:last])
            # the end of a long single segment may keep nothing: then only its own goal counts
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                summed = kept * (out[first] + np.cumsum(gain / kept, axis=0))
            out[first + 1 : last + 1] = np.where(np.isfinite(summed), summed, goals[first:last])
            first = last
        return out

    def _joints_at(self, program: Program) -> Array:
        """Joints of the positions, with the posture and turns that the text names, (N, 6) [rad].

        Raises:
            TwinError: Out of reach or of a limit, or the joints contradict the text.
        """
        flange = flange_of(program.position, program.rotation, self.tool_position, self.tool_rotation)
        theta, margin = solve(self.robot, *flange, program.posture)
        if margin.min() < 0:
            raise TwinError(f"P[{int(np.argmin(margin)) + 1}]: out of the controller's reach")
        theta = apply_turns(self.robot, theta, program.turns)
        if not in_posture(self.robot, theta, program.posture).all():
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


def theta_over(robot: Robot, theta: Array) -> float:
    """How far any joint is beyond its limits, at most [rad]; below zero inside."""
    return float(max((robot.lower - theta.min(axis=0)).max(), (theta.max(axis=0) - robot.upper).max()))


def refuse_unlike(line: IntArray, off: Array, turned: Array) -> None:
    """Raises TwinError where the nominal TCP is off a pose asked for, (M,) [m] and turned against it, (M,)."""
    if not (off.max(initial=0.0) <= CONFIRM and turned.max(initial=0.0) <= 10 * CONFIRM):
        m = int(np.argmax(off + turned))
        raise TwinError(
            f"P[{line[m] + 1}]: the nominal arm is {off[m]:.1e} m from the pose asked for: "
            "the inverse kinematics cannot be trusted here"
        )


def _ramp(speed: Array, a: Array, j: Array) -> Array:
    """Time from rest to a speed with limited acceleration and jerk, (K,) [s]."""
    return np.where(speed > a * a / j, speed / a + a / j, 2 * np.sqrt(speed / j))


def _element_shares(section: Section, reference: dict[str, float], count: int) -> Array:
    """Share of node a's rise at the middle of each element: the fixed shape of the reference state."""
    u = (np.arange(count) + 0.5) / count
    ra, rb = reference[section.node_a], reference[section.node_b]
    if section.shape == "linear" or ra == rb:
        return 1 - u
    return np.asarray((ra ** (1 - u) * rb**u - rb) / (ra - rb))
