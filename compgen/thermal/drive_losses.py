r"""Heat of each joint's drive, from the motion.

The torque at a joint comes from inverse dynamics of the loaded arm (pinocchio, links and payload as point masses), and
the drive's loss, with P its rated power, q_m its rated speed and T = P / q_m the torque that belongs to them, is

    loss = P [ holding (tau / T)^2 + coulomb |qd| / q_m + viscous (qd / q_m)^2 ]

copper loss of the torque, Coulomb and viscous friction of motor and gearbox. Three numbers for all joints: what the
tables of one robot can tell apart. With the servo on and standing the copper loss stays; off, nothing.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from compgen.core.arrays import Array, IntArray, owns
from compgen.core.rotations import rotation_matrix
from compgen.robot.robot import STANDING, Robot
from compgen.thermal.duty import JointMotion, MeanLosses

SAMPLES = 2000  # of a motion: heat answers to its mean over minutes


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
@owns(rated_power=(6,), rated_speed=(6,), link_mass=(6,), link_centre=(6, 3), payload_centre=(3,), down=(3,))
class Drives:
    """Six drives and the masses that they carry."""

    rated_power: Array  # (6,) [W]
    rated_speed: Array  # (6,) [rad/s]
    holding: float
    coulomb: float
    viscous: float
    link_mass: Array  # (6,) [kg]
    link_centre: Array  # (6, 3) [m] in the frame at each joint with all pendant angles zero, axes as World
    payload_mass: float  # [kg]
    payload_centre: Array  # (3,) [m] in the flange
    down: Array  # (3,) unit vector in World along which gravity pulls


def loaded_arm(robot: Robot, drives: Drives) -> pin.Model:
    """The nominal arm with its masses, joint by joint, for inverse dynamics."""
    a1, a2, a3 = robot.a[:3]
    d4, d6 = -robot.d[3], -robot.d[5]
    joints = [
        ((0, 0, 1), (0, 0, 0)),
        ((0, 1, 0), (a1, 0, 0)),
        ((0, -1, 0), (0, 0, a2)),
        ((-1, 0, 0), (0, 0, a3)),
        ((0, -1, 0), (d4, 0, 0)),
        ((-1, 0, 0), (0, 0, 0)),
    ]
    model, parent, turned = pin.Model(), 0, np.eye(3)  # of each link as the pendant stands at zero
    for i, (axis, place) in enumerate(joints):
        kind = pin.JointModelRevoluteUnaligned(np.array(axis, dtype=float))
        parent = model.addJoint(parent, kind, pin.SE3(np.eye(3), np.array(place, dtype=float)), f"j{i + 1}")
        turned = turned @ rotation_matrix((robot.pendant_zero - STANDING)[i] * np.array(axis))
        mass = pin.Inertia(float(drives.link_mass[i]), turned.T @ drives.link_centre[i], np.zeros((3, 3)))
        model.appendBodyToJoint(parent, mass, pin.SE3.Identity())
    flange = pin.utils.rotate("y", -np.pi / 2) @ pin.utils.rotate("x", float(robot.alpha[5]))
    load = pin.Inertia(drives.payload_mass, flange @ drives.payload_centre + [d6, 0, 0], np.zeros((3, 3)))
    model.appendBodyToJoint(parent, load, pin.SE3.Identity())
    model.gravity.linear = np.linalg.norm(model.gravity.linear) * drives.down
    return model


def joint_torques(robot: Robot, drives: Drives, theta: Array, speed: Array, acceleration: Array) -> Array:
    """Joint torques, (M, 6) [rad], [rad/s], [rad/s2] to (M, 6) [N m]."""
    model = loaded_arm(robot, drives)
    data = model.createData()
    q = theta - STANDING
    return np.array([pin.rnea(model, data, *row) for row in zip(q, speed, acceleration, strict=True)]).reshape(-1, 6)


def moving_losses(robot: Robot, drives: Drives, motion: JointMotion) -> Array:
    """Heat of each drive over the segments of a motion, with speeds from the waypoints' own times, (N - 1, 6) [W].

    Args:
        robot: For the arm.
        drives: Losses and masses.
        motion: N waypoints.
    """
    friction, sampled, copper = _losses(robot, drives, motion)
    return friction + _between(motion, sampled, copper)


def mean_losses(robot: Robot, drives: Drives, motion: JointMotion) -> MeanLosses:
    """Means over the motion's time, moving and standing still in its poses."""
    step = np.diff(motion.time) + 1e-12
    friction, sampled, copper = _losses(robot, drives, motion)
    at_rest = np.zeros((len(sampled), 6))
    held = _copper_loss(robot, drives, motion, at_rest, at_rest)
    weight = _weights(motion, sampled, step)
    moving = step @ friction + weight @ copper
    return MeanLosses(*(tuple((total / step.sum()).tolist()) for total in (moving, weight @ held)))


def _losses(robot: Robot, drives: Drives, motion: JointMotion) -> tuple[Array, IntArray, Array]:
    """Friction on every segment (N - 1, 6) [W], the sampled segments (P,), and the copper loss there, (P, 6) [W]."""
    step = np.diff(motion.time)[:, None]
    speed = np.divide(np.diff(motion.theta, axis=0), step, out=np.zeros((len(step), 6)), where=step > 0)
    share = np.abs(speed) / drives.rated_speed
    friction = drives.rated_power * (drives.coulomb * share + drives.viscous * share**2)
    sampled, time = _sampled(motion), (motion.time[1:] + motion.time[:-1]) / 2
    acceleration = np.zeros((len(sampled), 6))
    for first in (sampled - 1, sampled):  # half of the change from the segment before, and to the one after
        rows = np.flatnonzero((first >= 0) & (first < len(time) - 1))
        k = first[rows]
        between = (time[k + 1] - time[k])[:, None]
        change = speed[k + 1] - speed[k]
        acceleration[rows] += np.divide(change, between, out=np.zeros_like(change), where=between > 0) / 2
    # a stop's ramp lies between two waypoints: its mean is what counts, not the jump of the chord's speed
    bounded = np.clip(acceleration, -robot.acceleration, robot.acceleration)
    return friction, sampled, _copper_loss(robot, drives, motion, speed[sampled], bounded)


def _sampled(motion: JointMotion) -> IntArray:
    """Segments that torques are worked out on; between them heat is a straight line in time."""
    return np.unique(np.linspace(0, len(motion.time) - 2, SAMPLES).astype(int))


def _between(motion: JointMotion, sampled: IntArray, loss: Array) -> Array:
    """Losses of sampled segments (P, 6) on all, (N - 1, 6)."""
    time = (motion.time[1:] + motion.time[:-1]) / 2
    return np.array([np.interp(time, time[sampled], column) for column in loss.T]).T


def _weights(motion: JointMotion, sampled: IntArray, weight: Array) -> Array:
    """Weights (P,) of sampled segments with which their sum is that of ``_between`` with weights (N - 1,)."""
    number = _between(motion, sampled, np.arange(len(sampled), dtype=float)[:, None])[:, 0]
    before = number.astype(np.int64)
    share, P = weight * (number - before), len(sampled)
    after = np.bincount(before + 1, share, P + 1)[:P]
    return np.asarray(np.bincount(before, weight - share, P) + after, dtype=np.float64)


def _copper_loss(robot: Robot, drives: Drives, motion: JointMotion, speed: Array, acceleration: Array) -> Array:
    """Of each drive's torque on the sampled segments, with their speeds and accelerations, (P, 6) [W]."""
    sampled = _sampled(motion)
    middle = (motion.theta[sampled + 1] + motion.theta[sampled]) / 2
    torque = joint_torques(robot, drives, middle, speed, acceleration)
    rated = drives.rated_power / drives.rated_speed
    return np.asarray(drives.rated_power * drives.holding * (torque / rated) ** 2)
