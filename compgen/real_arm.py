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

import numpy as np
import pinocchio as pin

from compgen.arrays import Array, own
from compgen.plant import build_model
from compgen.robot import Robot
from compgen.rotations import matrix_of

#: the link that each heated length belongs to, and the link's axis along it
_ALONG = {"d1": (1, 2), "a1": (1, 0), "a2": (2, 2), "a3": (3, 2), "d4": (4, 0), "d6": (6, 0)}

Placed = tuple[Array, Array]  # rotations (1 or M, 3, 3) and places (1 or M, 3) [m]


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
        self, theta: Array, growth: Mapping[str, Array], rise: Array, tool: Placed, past: Past
    ) -> tuple[Array, Array, Past]:
        """Where the tool really is.

        Args:
            theta: Joints as the controller commands them, in the order in which they are driven, (M, 6) [rad].
            growth: Of heated lengths at the robot file's cte, (M,) [m] each.
            rise: (M, K) [K].
            tool: TCP in the flange as the controller believes it, one for all or one a sample.
            past: What the samples before have left.

        Returns:
            (M, 3) [m], (M, 3, 3), and what these samples leave.
        """
        torque, believed = self._loads(theta, tool)
        first_theta = theta[0] if past.theta is None else past.theta
        first_place = believed[0] if past.position is None else past.position
        side = came_from(np.vstack([first_theta, theta]), self.flaws.width, past.side)[1:]
        before = past.travel or tuple(np.zeros(3) for _ in self.flaws.lines)
        going = tuple(
            followed(np.vstack([first_place, believed]), line.width, t)[1:] for line, t in zip(self.flaws.lines, before)
        )
        turned = theta + self._joint_flaws(theta, torque, side)
        placements, behind = self._placements(growth, rise)
        data = self.model.createData()
        model, angles = self.model, turned - self.robot.pendant_zero
        moving = [i for i in range(1, 7) if len(placements[i][0]) > 1 or len(placements[i][1]) > 1]
        for i in range(1, 7):
            model.jointPlacements[i] = pin.SE3(placements[i][0][0], placements[i][1][0])
        rows = [(model.jointPlacements[i], *placements[i]) for i in moving]
        M = len(theta)
        rotation, position = np.empty((M, 3, 3)), np.empty((M, 3))
        for m in range(M):
            for placement, turn, place in rows:
                placement.rotation = turn[m if len(turn) > 1 else 0]
                placement.translation = place[m if len(place) > 1 else 0]
            pin.forwardKinematics(model, data, angles[m])
            wrist = data.oMi[6]
            rotation[m], position[m] = wrist.rotation, wrist.translation
        rotation, position = _join((rotation, position), _join(behind, tool))
        left = Past(theta[-1], believed[-1], side[-1], tuple(t[-1] for t in going))
        return position + self._mapped(believed, going), rotation, left

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
        from scipy.interpolate import CubicSpline  # here: an arm without a map starts without scipy

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
        M = len(theta)
        torque, position = np.zeros((M, 6)), np.empty((M, 3))
        heavy = bool(f.mass.any()) and bool((f.compliance != 0).any() or (f.windup != 0).any())
        pushed = bool(f.force.any()) and bool((f.compliance != 0).any() or (f.windup != 0).any())
        model = self.model.copy()
        model.gravity.linear = f.gravity
        for k, (mass, centre) in enumerate(zip(f.mass, f.centre)):
            link = min(k + 1, 6)
            if mass:
                seen = self._behind(link).act(centre)
                model.inertias[link] = model.inertias[link] + pin.Inertia(float(mass), seen, np.zeros((3, 3)))
        data = model.createData()
        turns, places = tool
        for m in range(M):
            q = theta[m] - self.robot.pendant_zero
            pin.forwardKinematics(model, data, q)
            held = pin.SE3(turns[m if len(turns) > 1 else 0], places[m if len(places) > 1 else 0])
            tcp = data.oMi[6] * self.flange * held
            position[m] = tcp.translation
            if heavy:
                torque[m] -= pin.computeGeneralizedGravity(model, data, q)
            if pushed:
                J = pin.computeJointJacobian(model, data, q, 6)  # of joint 6 in its own axes
                seen = data.oMi[6].actInv(tcp)
                push = seen.rotation @ f.force
                torque[m] += J[:3].T @ push + J[3:].T @ pin.skew(seen.translation) @ push
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

    def _placements(self, growth: Mapping[str, Array], rise: Array) -> tuple[list[Placed], Placed]:
        """Where each joint sits on the link before it (from 1), and the flange on the last, with all flaws."""
        f = self.flaws
        found: list[Placed] = [_fixed(pin.SE3.Identity())]
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
        return found[:-1], found[-1]

    def _frame_flaw(self, i: int, rise: Array) -> Placed:
        """E: the flaw of the frame behind row i; i = 0 is World."""
        f = self.flaws
        if i == 0:
            found: Placed = (matrix_of(f.base[3:])[None], f.base[None, :3])
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
                found = _join(found, (matrix_of(turn), aside))
        if i == 6:
            found = _join(found, (matrix_of(f.tool[3:])[None], f.tool[None, :3]))
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
    """A state that keeps a share at each step and takes something on, sample by sample."""
    out = np.empty((len(left) + 1, len(start)))
    out[0] = now = start
    for m, (share, gain) in enumerate(zip(left, more), start=1):
        out[m] = now = share * now + gain
    return out


def _fixed(place: pin.SE3) -> Placed:
    return np.array(place.rotation)[None], np.array(place.translation)[None]


def _join(first: Placed, second: Placed) -> Placed:
    """One after the other, sample by sample."""
    place = first[1] + np.einsum("mij,mj->mi", *_level(first[0], second[1]))
    return first[0] @ second[0], place


def _level(turn: Array, place: Array) -> tuple[Array, Array]:
    M = max(len(turn), len(place))
    return np.broadcast_to(turn, (M, 3, 3)), np.broadcast_to(place, (M, 3))
