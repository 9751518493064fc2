r"""The flaws of the real arm, in the twin's own terms: pinocchio's arm with its joints and links changed.

The arm is the twin's, link by link; behind link i stands the DH row's frame, C_i seen from the link's. A flaw E_i of
that frame changes where the next joint sits,

    placement_{i+1}  ->  G_i C_i E_i C_i^-1 placement_{i+1},     G_i the link's growth along itself

and flaws of the joints change their angles. Torques are pinocchio's: generalized gravity of the nominal arm with its
masses, and the transposed Jacobian for the force on the tool. The direction of motion comes from the motion executed,
sample by sample. Equations, units and sources of all flaws are on the page of error sources; here they are applied
again, so that the twin shares no code with the optimiser's chain.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from compgen.core.arrays import Array, IntArray, own
from compgen.core.evaluation import evaluate
from compgen.core.exceptions import CompgenError
from compgen.core.rotations import rotation_matrix
from compgen.robot.robot import Robot
from compgen.verification.twin.nominal_arm import AGREE, build_chain, build_join, build_loads, build_model

#: the link that each heated length belongs to, and the link's axis along it
_ALONG = {"d1": (1, 2), "a1": (1, 0), "a2": (2, 2), "a3": (3, 2), "d4": (4, 0), "d6": (6, 0)}

Placed = tuple[Array, Array]  # rotations (1 or M, 3, 3) and places (1 or M, 3) [m]


class TwinError(CompgenError):
    """The twin cannot follow the text: the program must not be used."""

    exit_code = 1


@dataclass(frozen=True, eq=False, slots=True)
class Bend:
    """A link that bends with a rise."""

    rate: float  # [rad/K]
    row: int
    axis: Array  # (3,)
    lever: Array  # (3,) [m]
    node: int
    shift: float = 0.0  # [m/K] along the axis


@dataclass(frozen=True, eq=False, slots=True)
class Line:
    """Deviations measured along a World axis."""

    axis: int
    station: Array  # (S,) [m]
    forward: Array  # (S, 3) [m]
    reverse: Array  # (S, 3) [m]
    width: float  # [m]


@dataclass(frozen=True, eq=False, slots=True)
class Flaws:
    """All numbers in SI; what is left out is a perfect arm."""

    excess: Mapping[str, float] = field(default_factory=dict)  # own cte of a length over the file's, less one
    link: Array = field(default_factory=lambda: np.zeros((6, 4)))  # d [m], a [m], alpha [rad], beta [rad]
    zero: Array = field(default_factory=lambda: np.zeros(6))  # [rad]
    ratio: Array = field(default_factory=lambda: np.zeros((6, 6)))
    compliance: Array = field(default_factory=lambda: np.zeros(6))  # [rad/(N m)]
    waves: Array = field(default_factory=lambda: np.zeros((6, 2, 2)))  # [rad] joint, order, (sine, cosine)
    cycles: Array = field(default_factory=lambda: np.ones(6))
    ripple: Array = field(default_factory=lambda: np.zeros((6, 0, 2)))  # [rad] joint, order, (sine, cosine)
    order: Array = field(default_factory=lambda: np.zeros(0))  # waves a turn
    backlash: Array = field(default_factory=lambda: np.zeros(6))  # [rad]
    windup: Array = field(default_factory=lambda: np.zeros(6))  # [rad/(N m)]
    width: Array = field(default_factory=lambda: np.ones(6))  # [rad]
    base: Array = field(default_factory=lambda: np.zeros(6))  # place [m] and rotation vector [rad] in World
    tool: Array = field(default_factory=lambda: np.zeros(6))  # the same in the flange
    bends: tuple[Bend, ...] = ()
    lines: tuple[Line, ...] = ()
    mass: Array = field(default_factory=lambda: np.zeros(7))  # [kg] links, payload
    centre: Array = field(default_factory=lambda: np.zeros((7, 3)))  # [m] behind each row; of the payload in the flange
    gravity: Array = field(default_factory=lambda: np.zeros(3))  # [m/s2]
    force: Array = field(default_factory=lambda: np.zeros(3))  # [N] in tool axes

    def __post_init__(self) -> None:
        own(self, link=(6, 4), zero=(6,), ratio=(6, 6), compliance=(6,), waves=(6, 2, 2), cycles=(6,))
        own(self, ripple=(6, "H", 2), order=("H",))
        own(self, backlash=(6,), windup=(6,), width=(6,), base=(6,), tool=(6,))
        own(self, mass=(7,), centre=(7, 3), gravity=(3,), force=(3,))


@dataclass(frozen=True, eq=False, slots=True)
class Past:
    """What a motion leaves for the samples after it; nothing is known before the first."""

    theta: Array | None = None  # (6,) [rad] commanded
    position: Array | None = None  # (3,) [m] where the TCP was believed to be
    side: Array = field(default_factory=lambda: np.zeros(6))  # that each joint came from
    travel: tuple[Array, ...] = ()  # (3,) of the TCP, as each line follows it


@dataclass(frozen=True, eq=False, slots=True)
class RealArm:
    """The twin's nominal arm and what is wrong with it."""

    robot: Robot
    model: pin.Model
    flange: pin.SE3  # seen from the last joint
    flaws: Flaws

    def fly(
        self, theta: Array, growth: Mapping[str, Array], rise: Array, tool: Placed, past: Past, every: int
    ) -> tuple[Array, Array, Past]:
        """Where the tool really is.

        Args:
            theta: Joints as the controller commands them, in the order in which they are driven, (M, 6) [rad].
            growth: Of heated lengths at the robot file's cte, (M,) [m] each.
            rise: (M, K) [K].
            tool: TCP in the flange as the controller believes it, one for all or one a sample.
            past: What the samples before have left.
            every: Of so many samples pinocchio repeats one.

        Returns:
            (M, 3) [m], (M, 3, 3), and what these samples leave.

        Raises:
            TwinError: Pinocchio disagrees.
        """
        torque, believed = self._loads(theta, tool)
        first_theta = theta[0] if past.theta is None else past.theta
        first_place = believed[0] if past.position is None else past.position
        side = came_from(np.vstack([first_theta, theta]), self.flaws.width, past.side)[1:]
        before = past.travel or tuple(np.zeros(3) for _ in self.flaws.lines)
        going = tuple(
            followed(np.vstack([first_place, believed]), line.width, t)[1:] for line, t in zip(self.flaws.lines, before)
        )
        angles = theta + self._joint_flaws(theta, torque, side) - self.robot.pendant_zero
        parts = [*self._placements(growth, rise), tool]
        rows = [part for turn, place in parts for part in (place, turn.reshape(-1, 9))]
        position, rotation = evaluate(build_chain(), angles, *rows)
        rotation = rotation.reshape(-1, 3, 3)
        some = np.unique(np.append(np.arange(0, len(theta), every), len(theta) - 1))
        self._confirm(some, theta, (torque, believed), angles, parts, (rotation, position))
        left = Past(theta[-1], believed[-1], side[-1], tuple(t[-1] for t in going))
        return position + self._mapped(believed, going), rotation, left

    def _confirm(
        self, some: IntArray, theta: Array, loads: tuple[Array, Array], angles: Array, parts: list[Placed], pose: Placed
    ) -> None:
        """Raises TwinError unless pinocchio finds the same torques and places at some of the samples."""
        few = [(_at(turn, some), _at(place, some)) for turn, place in parts]
        torque, believed = self._weighed(theta[some], few[-1])
        there = self._stood(angles[some], few)
        apart = [(torque - loads[0][some]) / (1 + np.abs(torque)), believed - loads[1][some]]
        apart += [mine - theirs[some] for mine, theirs in zip(there, pose)]
        far = float(np.max([np.abs(x).max() for x in apart]))
        if not far <= AGREE:
            raise TwinError(f"pinocchio's arm is {far:.1e} from the twin's: the twin cannot be trusted")

    def _stood(self, angles: Array, parts: list[Placed]) -> Placed:
        """The TCP by pinocchio, sample by sample, its joints standing anywhere."""
        model, data = self.model.copy(), self.model.createData()
        rotation, position = np.empty((len(angles), 3, 3)), np.empty((len(angles), 3))
        for m, q in enumerate(angles):
            placed = [pin.SE3(_at(turn, [m])[0], _at(place, [m])[0]) for turn, place in parts]
            for i, placement in enumerate(placed[:6], 1):
                model.jointPlacements[i] = placement
            pin.forwardKinematics(model, data, q)
            tcp = data.oMi[6] * placed[6] * placed[7]
            rotation[m], position[m] = tcp.rotation, tcp.translation
        return rotation, position

    def _joint_flaws(self, theta: Array, torque: Array, side: Array) -> Array:
        """How far each joint is from where it is commanded, (M, 6) [rad]."""
        f = self.flaws
        off = f.zero + (theta - self.robot.pendant_zero) @ f.ratio.T + f.compliance * torque
        for n in (1, 2):
            angle = n * f.cycles * theta
            off = off + f.waves[:, n - 1, 0] * np.sin(angle) + f.waves[:, n - 1, 1] * np.cos(angle)
        for n, waves in zip(f.order, np.swapaxes(f.ripple, 0, 1)):
            off = off + waves[:, 0] * np.sin(n * theta) + waves[:, 1] * np.cos(n * theta)
        half = f.backlash + f.windup * np.sqrt(torque**2 + 1)
        return np.asarray(off - half * side)

    def _mapped(self, believed: Array, going: tuple[Array, ...]) -> Array:
        """What the measured lines add, (M, 3) [m]."""
        total = np.zeros_like(believed)
        for line, travel in zip(self.flaws.lines, going):
            s = np.clip(believed[:, line.axis], line.station[0], line.station[-1])
            forward, reverse = (
                CubicSpline(line.station, v, bc_type="natural")(s) for v in (line.forward, line.reverse)
            )
            total = total + (forward + reverse) / 2 + travel[:, line.axis, None] * (forward - reverse) / 2
        return total

    def _loads(self, theta: Array, tool: Placed) -> tuple[Array, Array]:
        """Torque of the loads about each joint (M, 6) [N m], and where the TCP is believed to be (M, 3) [m]."""
        f = self.flaws
        mass, moment = np.zeros(6), np.zeros((6, 3))
        for k, (more, centre) in enumerate(zip(f.mass, f.centre)):
            i = min(k, 5)
            mass[i] += more
            moment[i] += more * self._behind(i + 1).act(centre)
        known = (x.reshape(1, -1) for x in (mass, moment, f.gravity, f.force))
        angles = theta - self.robot.pendant_zero
        torque, position = evaluate(build_loads(self.robot), angles, tool[1], tool[0].reshape(-1, 9), *known)
        return torque, position

    def _weighed(self, theta: Array, tool: Placed) -> tuple[Array, Array]:
        """The same by pinocchio, sample by sample."""
        f = self.flaws
        torque, position = np.empty((len(theta), 6)), np.empty((len(theta), 3))
        model = self.model.copy()
        model.gravity.linear = f.gravity
        for k, (mass, centre) in enumerate(zip(f.mass, f.centre)):
            link = min(k + 1, 6)
            if mass:
                seen = self._behind(link).act(centre)
                model.inertias[link] = model.inertias[link] + pin.Inertia(float(mass), seen, np.zeros((3, 3)))
        data = model.createData()
        for m, q in enumerate(theta - self.robot.pendant_zero):
            pin.forwardKinematics(model, data, q)
            tcp = data.oMi[6] * self.flange * pin.SE3(_at(tool[0], [m])[0], _at(tool[1], [m])[0])
            position[m] = tcp.translation
            J = pin.computeJointJacobian(model, data, q, 6)  # of joint 6 in its own axes
            seen = data.oMi[6].actInv(tcp)
            push = seen.rotation @ f.force
            torque[m] = J[:3].T @ push + J[3:].T @ pin.skew(seen.translation) @ push
            torque[m] -= pin.computeGeneralizedGravity(model, data, q)
        return torque, position

    def _behind(self, link: int) -> pin.SE3:
        """C: the frame behind a DH row, seen from its link; both are fixed to the same body."""
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, np.zeros(6))
        frame = pin.SE3.Identity()
        robot = self.robot
        for i in range(link):
            turn = pin.utils.rotate("z", float(robot.pendant_zero[i]))
            twist = pin.utils.rotate("x", float(robot.alpha[i]))
            step = np.array([robot.a[i], 0.0, robot.d[i]])
            frame = frame * pin.SE3(turn, np.zeros(3)) * pin.SE3(twist, step)
        return data.oMi[link].actInv(frame) if link else frame

    def _placements(self, growth: Mapping[str, Array], rise: Array) -> list[Placed]:
        """Where each of the six joints sits on the link before it, and the flange on the last, with all flaws."""
        f = self.flaws
        found: list[Placed] = []
        for i in range(7):
            flaw = self._frame_flaw(i, rise)
            C = self._behind(i)
            change = _join(_join(_fixed(C), flaw), _fixed(C.inverse()))
            for name, more in growth.items():
                link, axis = _ALONG[name]
                if link == i:
                    along = np.zeros((len(more), 3))
                    along[:, axis] = more * (1 + f.excess.get(name, 0.0))
                    change = _join((np.eye(3)[None], along), change)
            nominal = self.flange if i == 6 else self.model.jointPlacements[i + 1]
            found.append(_join(change, _fixed(nominal)))
        return found

    def _frame_flaw(self, i: int, rise: Array) -> Placed:
        """E: the flaw of the frame behind row i; i = 0 is World."""
        f = self.flaws
        if i == 0:
            found: Placed = (rotation_matrix(f.base[3:])[None], f.base[None, :3])
        else:
            d, a, alpha, beta = f.link[i - 1]
            twist = float(self.robot.alpha[i - 1])
            back = pin.SE3(pin.utils.rotate("x", -twist), np.zeros(3))
            turn = pin.utils.rotate("x", twist + float(alpha)) @ pin.utils.rotate("y", float(beta))
            found = _fixed(back * pin.SE3(turn, np.array([a, 0.0, d])))
        for bend in f.bends:
            if bend.row == i:
                turn = bend.rate * rise[:, bend.node, None] * bend.axis
                aside = np.cross(turn, bend.lever) + bend.shift * rise[:, bend.node, None] * bend.axis
                found = _join(found, (rotation_matrix(turn), aside))
        if i == 6:
            found = _join(found, (rotation_matrix(f.tool[3:])[None], f.tool[None, :3]))
        return found


def real_arm(robot: Robot, flaws: Flaws) -> RealArm:
    """The twin's nominal arm with flaws."""
    return RealArm(robot, *build_model(robot), flaws)


def came_from(theta: Array, width: Array, u: Array) -> Array:
    """The side that each joint has come from, step by step from ``u`` (6,), (M, 6) [-1, 1]."""
    step = np.diff(theta, axis=0)
    left = np.exp(-np.abs(step) / width)
    return _kept(left, (1 - left) * np.sign(step), u)


def followed(position: Array, width: float, t: Array) -> Array:
    """The direction of travel, following the path's own with a lag from ``t`` (3,), (M, 3)."""
    step = np.diff(position, axis=0)
    length = np.sqrt((step**2).sum(axis=1, keepdims=True))
    left = np.exp(-length / width)
    return _kept(left, (1 - left) * step / np.maximum(length, 1e-30), t)


def _kept(left: Array, more: Array, start: Array) -> Array:
    """A state that keeps a share at each step and takes something on: x_{m+1} = left_m x_m + more_m.

    As many stretches of the way as a stretch has steps are walked side by side, each from nothing; what it began with
    fades by the product of its shares.
    """
    steps, width = more.shape
    size = max(1, int(np.sqrt(steps)))
    count = -(-steps // size)
    share, gain = np.ones((count * size, width)), np.zeros((count * size, width))
    share[:steps], gain[:steps] = left, more
    share, gain = share.reshape(count, size, width), gain.reshape(count, size, width)
    for n in range(1, size):
        gain[:, n] += share[:, n] * gain[:, n - 1]
        share[:, n] *= share[:, n - 1]
    out = np.empty((count, size, width))
    now = start
    for k in range(count):
        out[k] = share[k] * now + gain[k]
        now = out[k, -1]
    return np.vstack([start, out.reshape(-1, width)[:steps]])


def _at(part: Array, some: Any) -> Array:
    """Some samples of what is given once for all or sample by sample."""
    return part[some] if len(part) > 1 else np.broadcast_to(part, (len(some), *part.shape[1:]))


def _fixed(place: pin.SE3) -> Placed:
    return np.array(place.rotation)[None], np.array(place.translation)[None]


def _join(first: Placed, second: Placed) -> Placed:
    """One after the other, sample by sample."""
    turn, place = evaluate(build_join(), first[0].reshape(-1, 9), first[1], second[0].reshape(-1, 9), second[1])
    return turn.reshape(-1, 3, 3), place
