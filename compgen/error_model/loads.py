r"""Torque of gravity and process force about each joint, at the pose that the controller believes in.

    tau_i = z_i . [ sum_{k >= i} (c_k - o_i) x m_k g  +  (p - o_i) x R f ]                       [N m]

with o_i and z_i the place and direction of joint i's axis, c_k the centre of mass of link k (fixed in the frame behind
row k) and of the payload (fixed in the flange), p and R the TCP, f a force that the process puts on the tool, in tool
axes. tau is the load's torque about the axis: positive where it turns the joint towards larger theta. Accelerations are
left out: smoothing is slow. Errors of the pose change tau by parts in 10^3 and are left out too.
"""

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from compgen.core.arrays import Array, owns
from compgen.core.units import MM
from compgen.error_model.expressions import cross
from compgen.error_model.schema import LoadsTable
from compgen.robot.kinematics import Chain, frames_at_zero
from compgen.robot.robot import Robot


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(mass=(6,), centre=(6, 3), payload_centre=(3,), gravity=(3,), force=(3,))
class Loads:
    """Masses and forces that the joints carry; facts, not parameters."""

    mass: Array  # (6,) [kg] of the links
    centre: Array  # (6, 3) [m] of each, in the frame behind its row
    payload: float  # [kg] on the flange
    payload_centre: Array  # (3,) [m] in the flange
    gravity: Array  # (3,) [m/s2] in World
    force: Array  # (3,) [N] on the tool, in tool axes

    @property
    def have_weight(self) -> bool:
        """Whether a mass of link or payload is known."""
        return bool(self.mass.any() or self.payload)

    @property
    def act(self) -> bool:
        """Whether anything loads the joints: a weight under gravity, or a force."""
        return bool(self.force.any() or (self.have_weight and self.gravity.any()))

    def without_force(self) -> "Loads":
        """Links and payload alone."""
        return replace(self, force=np.zeros(3))


def loads_of(table: LoadsTable, robot: Robot) -> Loads:
    """The loads of a robot file."""
    frames, from_joint = frames_at_zero(robot), np.array(table.link_centre_mm) * MM
    centre = np.einsum("kji,kj->ki", frames.rotation[1:], frames.position[:-1] + from_joint - frames.position[1:])
    return Loads(
        mass=np.array(table.link_kg),
        centre=centre,
        payload=table.payload_kg,
        payload_centre=np.array(table.payload_centre_mm) * MM,
        gravity=np.array(table.gravity_m_s2),
        force=np.array(table.force_N),
    )


def torque_expr(loads: Loads, nominal: Chain) -> list[Any]:
    """tau of the six joints [N m]; a number where nothing acts."""
    frames = nominal.joint_frames()
    forces = [
        (k, frames[k].position + frames[k].rotation @ ca.DM(centre), ca.DM(mass * loads.gravity))
        for k, mass, centre in (
            *((k + 1, float(loads.mass[k]), loads.centre[k]) for k in range(6)),
            (6, loads.payload, loads.payload_centre),
        )
        if mass
    ]
    if np.any(loads.force):
        tcp = nominal.tcp_expr()
        forces.append((6, tcp.position, tcp.rotation @ ca.DM(loads.force)))
    torques = []
    for joint in range(1, 7):
        origin, axis = frames[joint - 1].position, frames[joint - 1].rotation[:, 2]
        total: Any = 0.0
        for row, place, force in forces:
            if row >= joint:
                total = total + ca.dot(axis, cross(place - origin, force))
        torques.append(total)
    return torques
