r"""An arm with faults: the twin's nominal arm with its joints and links changed.

The arm is the twin's, link by link; C_i is the frame behind DH row i as seen from link i. A fault E_i of that frame
changes where the next joint sits,

    placement_{i+1}  ->  G_i C_i E_i C_i^-1 placement_{i+1},     G_i the link's growth along itself

and faults of the joints change their angles. Torques are pinocchio's: generalized gravity of the nominal arm with its
masses, and the transposed Jacobian for the force on the tool. The direction of motion comes from the motion executed,
sample by sample. Equations, units and sources of all faults are on the page of error sources; here they are applied
again, so that the twin shares no code with the optimiser's chain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from compgen.core.arrays import Array, IntArray, frozen
from compgen.core.evaluation import evaluate
from compgen.core.exceptions import CompgenError
from compgen.core.exit_codes import ExitCode
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.unique_rows import grouped
from compgen.robot.robot import STANDING, Robot
from compgen.verification.twin.direction_history import DirectionHistory, joint_side, travel_direction
from compgen.verification.twin.faults import Faults, ThermalDistortion
from compgen.verification.twin.nominal_arm import (
    AGREEMENT,
    build_composition,
    build_load_torque,
    build_placed_chain,
    pinocchio_model,
)

#: the link that each heated length belongs to, and the link's axis along it
LINK_OF_LENGTH = {"d1": (1, 2), "a1": (1, 0), "a2": (2, 2), "a3": (3, 2), "d4": (4, 0), "d6": (6, 0)}


class TwinError(CompgenError):
    """The twin cannot follow the text: the program must not be used."""

    exit_code = ExitCode.OUTSIDE


@dataclass(frozen=True, eq=False, slots=True)
class FaultyArm:
    """The twin's nominal arm and what is wrong with it."""

    robot: Robot
    model: pin.Model
    flange: pin.SE3  # seen from the last joint
    faults: Faults

    def actual_pose(
        self,
        theta: Array,
        growth: Mapping[str, Array],
        rise: Array,
        tool: Pose,
        history: DirectionHistory,
        every: int,
    ) -> tuple[Pose, DirectionHistory]:
        """Where the tool really is, at M samples, and the history that they leave.

        Args:
            theta: Joints as the controller commands them, in the order in which they are executed, (M, 6) [rad].
            growth: Of heated lengths, (M,) [m] each.
            rise: (M, K) [K].
            tool: TCP in the flange as the controller believes it, 1 for all or M.
            history: Of the samples before.
            every: Pinocchio repeats one of so many samples.

        Raises:
            TwinError: Pinocchio disagrees.
        """
        torque, nominal = self._load_torque(theta, tool)
        first_theta = theta[0] if history.theta is None else history.theta
        first_position = nominal[0] if history.position is None else history.position
        reversals = self.faults.reversal_width, history.side, self.faults.reversal_law
        side = joint_side(np.vstack([first_theta, theta]), *reversals)[1:]
        before = history.travel or tuple(np.zeros(3) for _ in self.faults.axis_deviations)
        travel = tuple(
            travel_direction(np.vstack([first_position, nominal]), deviation.width, start)[1:]
            for deviation, start in zip(self.faults.axis_deviations, before, strict=True)
        )
        angles = theta + self._joint_faults(theta, torque, side) - STANDING
        placements = [*self._placements(growth, rise), tool]
        inputs = [part for placement in placements for part in (placement.position, placement.rotation_rows)]
        pose = Pose.from_rows(*evaluate(build_placed_chain(), angles, *inputs))
        rows = np.unique(np.append(np.arange(0, len(theta), every), len(theta) - 1))
        self._confirm(rows, theta, (torque, nominal), angles, placements, pose)
        after = DirectionHistory(theta[-1], nominal[-1], side[-1], tuple(t[-1] for t in travel))
        return Pose(frozen(pose.position + self._axis_deviation(nominal, travel)), pose.rotation), after

    def _confirm(
        self,
        rows: IntArray,
        theta: Array,
        loads: tuple[Array, Array],
        angles: Array,
        placements: list[Pose],
        pose: Pose,
    ) -> None:
        """Raises TwinError unless pinocchio has the same torques and poses at some of the samples."""
        chosen = [_rows(placement, rows) for placement in placements]
        torque, nominal = self._pinocchio_torque(theta[rows], chosen[-1])
        expected = self._pinocchio_pose(angles[rows], chosen)
        f = self.faults
        weight = f.mass.sum() * np.linalg.norm(f.gravity) + np.linalg.norm(f.force)  # [N], which also J1 rounds
        differences = [(torque - loads[0][rows]) / (1 + weight), nominal - loads[1][rows]]
        differences += [expected.position - pose.position[rows], expected.rotation - pose.rotation[rows]]
        largest = float(np.max([np.abs(x).max() for x in differences]))
        if not largest <= AGREEMENT:
            raise TwinError(f"pinocchio's arm is {largest:.1e} from the twin's: the twin cannot be trusted")

    def _pinocchio_pose(self, angles: Array, placements: list[Pose]) -> Pose:
        """The TCP by pinocchio, sample by sample, its joints sitting at the placements."""
        model, data = self.model.copy(), self.model.createData()
        rotation, position = np.empty((len(angles), 3, 3)), np.empty((len(angles), 3))
        for m, q in enumerate(angles):
            placed = [_se3(placement, m) for placement in placements]
            for i, placement in enumerate(placed[:6], 1):
                model.jointPlacements[i] = placement
            pin.forwardKinematics(model, data, q)
            tcp = data.oMi[6] * placed[6] * placed[7]
            rotation[m], position[m] = tcp.rotation, tcp.translation
        return Pose(frozen(position), frozen(rotation))

    def _joint_faults(self, theta: Array, torque: Array, side: Array) -> Array:
        """How far each joint is from where it is commanded, (M, 6) [rad]."""
        f = self.faults
        give = (f.compliance + f.hardening * np.sqrt(torque**2 + 1)) * torque
        offset = f.joint_zeros + (theta - self.robot.pendant_zero) @ f.joint_coupling.T + give
        for n in (1, 2):
            angle = n * f.gear_cycles * theta
            sine, cosine = f.gear_harmonics[:, n - 1, 0], f.gear_harmonics[:, n - 1, 1]
            offset = offset + sine * np.sin(angle) + cosine * np.cos(angle)
        for n, wave in zip(f.ripple_orders, np.swapaxes(f.joint_ripple, 0, 1), strict=True):
            offset = offset + wave[:, 0] * np.sin(n * theta) + wave[:, 1] * np.cos(n * theta)
        return np.asarray(offset - (f.backlash + f.windup * np.sqrt(torque**2 + 1)) * side)

    def _axis_deviation(self, nominal: Array, travel: tuple[Array, ...]) -> Array:
        """What the deviations along World axes add to the TCP, (M, 3) [m]."""
        if not self.faults.axis_deviations:
            return np.zeros_like(nominal)
        from scipy.interpolate import CubicSpline  # loaded by runs that need it

        total = np.zeros_like(nominal)
        for deviation, t in zip(self.faults.axis_deviations, travel, strict=True):
            station = deviation.station
            s = np.clip(nominal[:, deviation.axis], station[0], station[-1])
            forward, reverse = (
                CubicSpline(station, values, bc_type="natural")(s) for values in (deviation.forward, deviation.reverse)
            )
            total = total + (forward + reverse) / 2 + t[:, deviation.axis, None] * (forward - reverse) / 2
        return total

    def _load_torque(self, theta: Array, tool: Pose) -> tuple[Array, Array]:
        """Torque of the loads about each joint (M, 6) [N m], and the nominal TCP (M, 3) [m]."""
        f = self.faults
        mass, moment = np.zeros(6), np.zeros((6, 3))
        for k, (part_mass, centre) in enumerate(zip(f.mass, f.centre, strict=True)):
            i = min(k, 5)
            mass[i] += part_mass
            moment[i] += part_mass * self._row_frame(i + 1).act(centre)
        constants = (x.reshape(1, -1) for x in (mass, moment, f.gravity, f.force))
        angles = theta - STANDING
        function = build_load_torque(self.robot)
        torque, position = evaluate(function, angles, tool.position, tool.rotation_rows, *constants)
        return torque, position

    def _pinocchio_torque(self, theta: Array, tool: Pose) -> tuple[Array, Array]:
        """Torque of the loads and nominal TCP as ``_load_torque`` has them, by pinocchio, sample by sample."""
        f = self.faults
        torque, position = np.empty((len(theta), 6)), np.empty((len(theta), 3))
        model = self.model.copy()
        model.gravity.linear = f.gravity
        for k, (mass, centre) in enumerate(zip(f.mass, f.centre, strict=True)):
            link = min(k + 1, 6)
            if mass:
                centre_in_link = self._row_frame(link).act(centre)
                inertia = pin.Inertia(float(mass), centre_in_link, np.zeros((3, 3)))
                model.inertias[link] = model.inertias[link] + inertia
        data = model.createData()
        for m, q in enumerate(theta - STANDING):
            pin.forwardKinematics(model, data, q)
            tcp = data.oMi[6] * self.flange * _se3(tool, m)
            position[m] = tcp.translation
            J = pin.computeJointJacobian(model, data, q, 6)  # of joint 6 in its own axes
            tcp_in_wrist = data.oMi[6].actInv(tcp)
            force = tcp_in_wrist.rotation @ f.force
            torque[m] = J[:3].T @ force + J[3:].T @ pin.skew(tcp_in_wrist.translation) @ force
            torque[m] -= pin.computeGeneralizedGravity(model, data, q)
        return torque, position

    def _row_frame(self, link: int) -> pin.SE3:
        """C: the frame behind a DH row, seen from its link; both are fixed to the same body."""
        data = self.model.createData()
        pin.forwardKinematics(self.model, data, np.zeros(6))
        frame = pin.SE3.Identity()
        robot = self.robot
        for i in range(link):
            about_z = pin.utils.rotate("z", float(STANDING[i]))
            about_x = pin.utils.rotate("x", float(robot.alpha[i]))
            frame = frame * pin.SE3(about_z, np.zeros(3)) * pin.SE3(about_x, np.array([robot.a[i], 0.0, robot.d[i]]))
        return data.oMi[link].actInv(frame) if link else frame

    def _placements(self, growth: Mapping[str, Array], rise: Array) -> list[Pose]:
        """Of each of the six joints on the link before it, and of the flange on the last, with all faults."""
        placements: list[Pose] = []
        for i in range(7):
            C = self._row_frame(i)
            change = _compose(_compose(_constant(C), self._frame_fault(i, rise)), _constant(C.inverse()))
            for name, grown in growth.items():
                link, axis = LINK_OF_LENGTH[name]
                if link == i:
                    offset = np.zeros((len(grown), 3))
                    offset[:, axis] = grown
                    change = _compose(Pose(offset, np.tile(np.eye(3), (len(offset), 1, 1))), change)
            placements.append(_compose(change, _constant(self.flange if i == 6 else self.model.jointPlacements[i + 1])))
        return placements

    def _frame_fault(self, i: int, rise: Array) -> Pose:
        """E: the fault of the frame behind row i; i = 0 is World."""
        f = self.faults
        if i == 0:
            E = Pose(f.base_frame[None, :3], rotation_matrix(f.base_frame[3:])[None])
        else:
            d, a, alpha, beta = f.link_offsets[i - 1]
            twist = float(self.robot.alpha[i - 1])
            untwisted = pin.SE3(pin.utils.rotate("x", -twist), np.zeros(3))
            twisted = pin.utils.rotate("x", twist + float(alpha)) @ pin.utils.rotate("y", float(beta))
            E = _constant(untwisted * pin.SE3(twisted, np.array([a, 0.0, d])))
        for distortions in _of_one_place(f.thermal_distortions, i):
            bend = sum(d.bend * rise[:, d.node, None] * d.axis for d in distortions)
            shift = sum(d.shift * rise[:, d.node, None] * d.axis for d in distortions)
            E = _compose(E, Pose(np.cross(bend, distortions[0].lever) + shift, rotation_matrix(np.asarray(bend))))
        if i == 6:
            E = _compose(E, Pose(f.tool_frame[None, :3], rotation_matrix(f.tool_frame[3:])[None]))
        return E


def build_faulty_arm(robot: Robot, faults: Faults) -> FaultyArm:
    """The twin's nominal arm with faults."""
    return FaultyArm(robot, *pinocchio_model(robot), faults)


def _of_one_place(distortions: Sequence[ThermalDistortion], row: int) -> list[list[ThermalDistortion]]:
    """Distortions of the frame behind a row; those about one axis with one lever add up to one turn."""
    return list(grouped(((d.axis.tobytes(), d.lever.tobytes()), d) for d in distortions if d.row == row).values())


def _rows(placement: Pose, rows: Any) -> Pose:
    """Some samples of what is given once for all or sample by sample."""
    return placement[rows if len(placement) > 1 else np.zeros(len(rows), dtype=np.int64)]


def _constant(placement: pin.SE3) -> Pose:
    """A placement that is the same at all samples."""
    return Pose(np.array(placement.translation)[None], np.array(placement.rotation)[None])


def _se3(placement: Pose, sample: int) -> pin.SE3:
    """A sample of what is given once for all or sample by sample; an object for pinocchio alone."""
    row = sample if len(placement) > 1 else 0
    return pin.SE3(placement.rotation[row], placement.position[row])


def _compose(first: Pose, second: Pose) -> Pose:
    """One placement after the other, sample by sample: ``first @ second``, some times as fast for many."""
    rotation, position = evaluate(
        build_composition(), first.rotation_rows, first.position, second.rotation_rows, second.position
    )
    return Pose.from_rows(position, rotation)
