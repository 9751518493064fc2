r"""The real arm, independently: a pinocchio model driven by the program's text as the controller would drive it.

Nothing here comes from the optimiser's chain. The arm is built link by link as a URDF has it,

    Rz(J1) Tx(a1) Ry(J2) Tz(a2) Ry(-(J2+J3)) Tz(a3) Rx(-J4) Tx(d4) Ry(-J5) Tx(d6) Rx(-J6) flange

its lengths grown by summing thin elements of each link's profile; the time comes from the text's own lengths, speeds
and stops; the heat from stepping each node through that time. The controller's nominal inverse is ``ik``, and every
pose it gives is confirmed with pinocchio's nominal arm to 1e-9 m. CNT is taken as passing through the points.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from compgen.arrays import Array, IntArray, own
from compgen.dialects.fanuc_ls.program import Program, apply_turns, posture_of
from compgen.exceptions import CompgenError
from compgen.ik import flange_of, nearest_turns, solve
from compgen.robot import Robot
from compgen.rotations import between
from compgen.thermal import Duty, NodeModel, Profile, Section

ELEMENT = 0.1e-3  # m
RAMP_ACCELERATION, RAMP_JERK = 0.9, 0.45  # share of the joints' limits that a ramp uses
GRID = 1e-3  # m
CONFIRM = 1e-9  # m

#: where each heated length sits: joint whose placement carries it, axis
_PLACES = {"a1": (2, 0), "a2": (3, 2), "a3": (4, 2), "d4": (5, 0), "d6": (6, 0)}


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
class Twin:
    """The real arm with its tool and its warmth."""

    robot: Robot
    heat: NodeModel
    profiles: tuple[Profile, ...]
    tool_position: Array  # (3,) [m]
    tool_rotation: Array  # (3, 3)

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
        length = np.linalg.norm(np.diff(program.position, axis=0), axis=1)
        points = self._joints_at(program)
        time, driven = self._clock(program, length, points)
        start = self._warm(np.zeros(len(self.heat.tau)), duties)
        way_rise = self._stepped(start, time, driven)

        pieces = 2 * np.maximum(1, np.ceil(length / (2 * GRID) - 1e-9)).astype(np.int64)
        segment = np.append(np.repeat(np.arange(len(length)), pieces), len(length) - 1)
        first = np.concatenate([[0], np.cumsum(pieces)[:-1]])
        fraction = np.append((np.arange(pieces.sum()) - first[segment[:-1]]) / pieces[segment[:-1]], 1.0)
        now = time[segment] + fraction * np.diff(time)[segment]
        decay = np.exp(-(now - time[segment])[:, None] / self.heat.tau)
        goal = self.heat.steady("moving", driven)[segment]
        rise = goal + (way_rise[segment] - goal) * decay

        step = np.diff(program.position, axis=0)[segment]
        position = program.position[segment] + fraction[:, None] * step
        rotation = between(program.rotation[segment], program.rotation[segment + 1], fraction)
        theta = self._controller(program, points, position, rotation, segment, fraction)
        self.confirm(theta, position, rotation, segment, lambda share: progress(share / 2))
        actual = self.reach(theta, rise, lambda share: progress(0.5 + share / 2))
        return Ride(segment, fraction, now, rise, theta, *actual)

    def reach(self, theta: Array, rise: Array, progress: Callable[[float], None]) -> tuple[Array, Array]:
        """Where the tool really is at commanded joints (M, 6) [rad] and rises (M, K) [K], (M, 3) [m] and (M, 3, 3)."""
        return self._fly(theta, self._growth(rise), progress)

    def confirm(
        self, theta: Array, position: Array, rotation: Array, segment: IntArray, progress: Callable[[float], None]
    ) -> None:
        """Raises TwinError unless pinocchio's nominal arm is where the controller's inverse says, to 1e-9 m."""
        nominal = self._fly(theta, None, progress)
        off = np.linalg.norm(nominal[0] - position, axis=1)
        turned = np.linalg.norm(nominal[1] - rotation, axis=(1, 2))
        if off.max(initial=0.0) > CONFIRM or turned.max(initial=0.0) > 1e-8:
            m = int(np.argmax(off + turned))
            raise TwinError(
                f"P[{segment[m] + 1}]: pinocchio's nominal arm is {off[m]:.1e} m from the pose asked for: "
                "the inverse kinematics cannot be trusted here"
            )

    def _clock(self, program: Program, length: Array, theta: Array) -> tuple[Array, Array]:
        r"""When each position is passed (N,) [s], and the speed really driven on each segment, (N - 1,) [m/s].

        A run between two stops takes its length over the written speeds and half of each ramp. A ramp to speed v takes
        T(v) = v / a + a / j, or 2 sqrt(v / j) below a^2 / j, with a and j what the joints allow along the path at its
        stop. A run too short for both ramps reaches the speed p with p T(p) = length, and takes 2 T(p).
        """
        share = np.abs(np.diff(theta, axis=0)) / length[:, None] + 1e-12  # rad/m
        a = RAMP_ACCELERATION * (self.robot.acceleration / share).min(axis=1)
        j = RAMP_JERK * (self.robot.jerk / share).min(axis=1)
        ends = np.flatnonzero(program.fine)
        first, last = ends[:-1], ends[1:] - 1
        said = length / program.speed
        whole, cruise = np.add.reduceat(length, first), np.add.reduceat(said, first)
        begin = _ramp(program.speed[first], a[first], j[first])
        end = _ramp(program.speed[last], a[last], j[last])
        room = program.speed[first] * begin / 2 + program.speed[last] * end / 2
        low, high = np.zeros(len(first)), np.minimum(program.speed[first], program.speed[last])
        soft_a, soft_j = np.minimum(a[first], a[last]), np.minimum(j[first], j[last])
        for _ in range(60):
            peak = (low + high) / 2
            under = peak * _ramp(peak, soft_a, soft_j) < whole
            low, high = np.where(under, peak, low), np.where(under, high, peak)
        spent = np.where(room < whole, cruise + (begin + end) / 2, 2 * _ramp(low, soft_a, soft_j))
        slower = np.repeat(cruise / spent, np.diff(ends))
        return np.concatenate([[0.0], np.cumsum(said / slower)]), program.speed * slower

    def _warm(self, rise: Array, duties: Sequence[Duty]) -> Array:
        for duty in duties:
            goal = self.heat.steady(duty.state, np.array([duty.feed]))[0]
            rise = goal - (goal - rise) * np.exp(-duty.duration / self.heat.tau)
        return rise

    def _stepped(self, rise: Array, time: Array, speed: Array) -> Array:
        """Node by node through every segment, exactly within each, (N, K) [K]."""
        goals = self.heat.steady("moving", speed)
        keep = np.exp(-np.diff(time)[:, None] / self.heat.tau)
        out = [rise]
        for goal, k in zip(goals, keep):
            rise = goal + (rise - goal) * k
            out.append(rise)
        return np.array(out)

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
        if set(posture_of(self.robot, theta)) != {program.posture}:
            raise TwinError("the joints of a position contradict its CONFIG letters")
        over = np.maximum(self.robot.lower - theta, theta - self.robot.upper)
        if over.max() > 1e-6:
            row, i = np.unravel_index(int(np.argmax(over)), over.shape)
            raise TwinError(
                f"P[{row + 1}]: joint {self.robot.joint_names[int(i)]} is beyond its limit in the posture of its CONFIG"
            )
        turn = np.abs(np.diff(theta, axis=0)).max(axis=1, initial=0.0)
        if turn.max(initial=0.0) > np.pi / 2:
            n = int(np.argmax(turn))
            raise TwinError(f"P[{n + 1}] to P[{n + 2}]: a joint turns by over 90 deg within one line")
        return theta

    def _controller(
        self, program: Program, at_points: Array, position: Array, rotation: Array, segment: IntArray, fraction: Array
    ) -> Array:
        """Joints commanded along the lines, with the posture and turns that the text names, (M, 6)."""
        flange = flange_of(position, rotation, self.tool_position, self.tool_rotation)
        theta, margin = solve(self.robot, *flange, program.posture)
        if margin.min() < 0:
            raise TwinError(f"P[{segment[int(np.argmin(margin))] + 1}]: out of the controller's reach")
        guess = at_points[segment] + fraction[:, None] * np.diff(at_points, axis=0)[segment]
        return nearest_turns(theta, guess)

    def _growth(self, rise: Array) -> dict[str, Array]:
        """Growth of each heated length, (M,) [m], by summing thin elements."""
        reference = dict(zip(self.heat.names, self.heat.reference_rise.tolist()))
        grown: dict[str, Array] = {}
        for profile in self.profiles:
            total = np.zeros(len(rise))
            for s in profile.sections:
                a, b = (rise[:, self.heat.names.index(n)] for n in (s.node_a, s.node_b))
                count = max(1, round((s.end - s.start) / ELEMENT))
                share = _element_shares(s, reference, count)
                total = total + profile.cte * (s.end - s.start) / count * (share.sum() * a + (1 - share).sum() * b)
            grown[profile.length] = grown.get(profile.length, 0.0) + total
        return grown

    def _fly(
        self, theta: Array, growth: dict[str, Array] | None, progress: Callable[[float], None]
    ) -> tuple[Array, Array]:
        """Forward kinematics of every sample in pinocchio, (M, 3) [m] and (M, 3, 3)."""
        model, tool = self._arm()
        data = model.createData()
        angles = theta - self.robot.pendant_zero
        position, rotation = np.empty((len(theta), 3)), np.empty((len(theta), 3, 3))
        places = []
        for name, more in (growth or {}).items():
            joint, axis = _PLACES[name]
            base = model.jointPlacements[joint].translation.copy()
            moved = np.tile(base, (len(theta), 1))
            moved[:, axis] += more
            places.append((model.jointPlacements[joint], moved))
        for m in range(len(theta)):
            for placement, moved in places:
                placement.translation = moved[m]
            pin.forwardKinematics(model, data, angles[m])
            pose = data.oMi[6] * tool
            position[m], rotation[m] = pose.translation, pose.rotation
            if m % 4096 == 0:
                progress(m / len(theta))
        return position, rotation

    def _arm(self) -> tuple[pin.Model, pin.SE3]:
        """The nominal arm, and the TCP seen from its last joint."""
        a1, a2, a3 = self.robot.a[:3]
        d4, d6 = -self.robot.d[3], -self.robot.d[5]
        model = pin.Model()
        joints = [
            ((0, 0, 1), (0, 0, 0)),
            ((0, 1, 0), (a1, 0, 0)),
            ((0, -1, 0), (0, 0, a2)),
            ((-1, 0, 0), (0, 0, a3)),
            ((0, -1, 0), (d4, 0, 0)),
            ((-1, 0, 0), (d6, 0, 0)),
        ]
        parent = 0
        for i, (axis, place) in enumerate(joints):
            kind = pin.JointModelRevoluteUnaligned(np.array(axis, dtype=float))
            parent = model.addJoint(parent, kind, pin.SE3(np.eye(3), np.array(place, dtype=float)), f"j{i + 1}")
        flange = pin.utils.rotate("y", -np.pi / 2) @ pin.utils.rotate("x", float(self.robot.alpha[5]))
        return model, pin.SE3(flange, np.zeros(3)) * pin.SE3(self.tool_rotation, self.tool_position)


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
