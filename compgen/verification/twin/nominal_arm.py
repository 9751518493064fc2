r"""The arm of the twin, link by link as a URDF has it, as an expression of its own; pinocchio confirms every run of it.

    Rz(J1) Tx(a1) Ry(J2) Tz(a2) Ry(-(J2+J3)) Tz(a3) Rx(-J4) Tx(d4) Ry(-J5) Tx(d6) Rx(-J6) flange

Nothing here comes from the optimiser's chain. pinocchio has no forward kinematics of many samples at once, so the
expression gives the pose of all, and ``pinocchio_difference`` builds the arm in pinocchio and compares some samples.
"""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from compgen.core.arrays import Array, frozen
from compgen.core.evaluation import evaluate, kept_with
from compgen.core.pose import Pose
from compgen.robot.inverse_kinematics import Posture, joints_expr
from compgen.robot.robot import STANDING, Robot

#: the lengths that may grow, in the order of all growths here: joint whose placement carries it, axis
LENGTHS = {"a1": (2, 0), "a2": (3, 2), "a3": (4, 2), "d4": (5, 0), "d6": (6, 0), "d1": (1, 2)}
AXES = ((0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0))
AGREEMENT = 1e-12  # [m], and in each entry of the rotation: how far pinocchio may be from the expression


def nominal_lengths(robot: Robot) -> tuple[float, ...]:
    """The six lengths of a cold arm [m], in the order of ``LENGTHS``."""
    return (float(robot.a[0]), float(robot.a[1]), float(robot.a[2]), float(-robot.d[3]), float(-robot.d[5]), 0.0)


def _axis_rotation_expr(axis: tuple[int, int, int], angle: Any) -> Any:
    """Rotation by an angle about a coordinate axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    k = next(i for i in range(3) if axis[i])
    i, j = (k + 1) % 3, (k + 2) % 3
    rotation = ca.SX.eye(3)
    rotation[i, i], rotation[j, j], rotation[i, j], rotation[j, i] = c, c, -axis[k] * s, axis[k] * s
    return rotation


def pose_expr(robot: Robot, angles: Any, growth: Any, tool: Pose) -> tuple[Any, Any]:
    """TCP position (3, 1) and rotation (3, 3) from joint angles about the axes (6, 1) and growths (6, 1) [m]."""
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    carried = {joint: (k, axis) for k, (joint, axis) in enumerate(LENGTHS.values())}
    for joint, joint_axis in enumerate(AXES, 1):
        if joint in carried:
            k, along = carried[joint]
            position = position + rotation[:, along] * (nominal_lengths(robot)[k] + growth[k])
        rotation = rotation @ _axis_rotation_expr(joint_axis, angles[joint - 1])
    rotation = rotation @ ca.DM(np.rint(_flange_rotation(robot)))
    return position + rotation @ ca.DM(tool.position), rotation @ ca.DM(tool.rotation)


def _flange_rotation(robot: Robot) -> Array:
    """Of the flange when all joints stand at zero, (3, 3): right angles, exactly."""
    return np.asarray(pin.utils.rotate("y", -np.pi / 2) @ pin.utils.rotate("x", float(robot.alpha[5])))


@kept_with("robot")
def build_segment_sample(robot: Robot, posture: Posture, tool: Pose, *, arcs: bool) -> Any:
    """One sample of a straight line, as the controller commands it and as the real arm executes it.

    With ``arcs`` of a line or an arc: in place of the end's position stands its sweep, straight (3), angle (1), along
    (3) and inwards (3).

    (both ends' position (3, 3); rotation at its start (9, row by row) and rotation vector over it (3); both ends'
    joints (6, 6); fraction; growths) -> theta (6), position and rotation of the real TCP (3, 9), and checks (3):
    reach margin [m], distance [m] and rotation of the nominal TCP from the commanded pose.
    """
    names = {"p0": 3, "p1": 3, "r0": 9, "turn": 3, "q0": 6, "q1": 6, "fraction": 1, "growth": len(LENGTHS)}
    if arcs:
        names["p1"] = 10
    symbols = [ca.SX.sym(name, size) for name, size in names.items()]
    p0, p1, r0, turn, q0, q1, fraction, growth = symbols
    angle = ca.norm_2(turn)
    axis = ca.skew(turn / ca.if_else(angle > 0, angle, 1.0))
    part = fraction * angle
    turned = ca.SX.eye(3) + ca.sin(part) * axis + 2 * ca.sin(part / 2) ** 2 * (axis @ axis)  # Rodrigues
    rotation = ca.reshape(r0, 3, 3).T @ turned
    if arcs:
        swept = fraction * p1[3]
        position = p0 + fraction * p1[:3] + ca.sin(swept) * p1[4:7] + 2 * ca.sin(swept / 2) ** 2 * p1[7:10]
    else:
        position = p0 + fraction * (p1 - p0)
    flange = rotation @ ca.DM(tool.rotation.T)
    theta, margin = joints_expr(robot, posture, position - flange @ ca.DM(tool.position), flange)
    expected = q0 + fraction * (q1 - q0)
    theta = theta + 2 * np.pi * ca.floor((expected - theta) / (2 * np.pi) + 0.5)
    angles = theta - ca.DM(STANDING)
    nominal = pose_expr(robot, angles, ca.SX.zeros(len(LENGTHS)), tool)
    actual = pose_expr(robot, angles, growth, tool)
    checks = ca.vertcat(margin, ca.norm_2(nominal[0] - position), ca.norm_fro(nominal[1] - rotation))
    return ca.Function("segment_sample", symbols, ca.cse([theta, actual[0], ca.vec(actual[1].T), checks]))


@lru_cache(maxsize=4)
def build_rise_and_growth(nodes: int) -> Any:
    """Rises of the nodes (K) [K] some time into a segment, and how much the lengths have grown by them (6) [m].

    (rise at the segment's start, steady rise, time constants (K each); growth per kelvin (K by 6, node by node); time
    since the start) -> rise, growth.
    """
    start, steady, tau = (ca.SX.sym(name, nodes) for name in ("start", "steady", "tau"))
    growth_per_kelvin, since = ca.SX.sym("growth_per_kelvin", nodes * len(LENGTHS)), ca.SX.sym("since")
    rise = steady + (start - steady) * ca.exp(-since / tau)
    growth = ca.reshape(growth_per_kelvin, len(LENGTHS), nodes) @ rise
    return ca.Function("rise_and_growth", [start, steady, tau, growth_per_kelvin, since], [rise, growth])


@kept_with("robot")
def build_grown_pose(robot: Robot, tool: Pose) -> Any:
    """(theta (6), growths (6)) -> position (3), rotation (9, row by row) of the TCP."""
    theta, growth = ca.SX.sym("theta", 6), ca.SX.sym("growth", len(LENGTHS))
    position, rotation = pose_expr(robot, theta - ca.DM(STANDING), growth, tool)
    return ca.Function("grown_pose", [theta, growth], [position, ca.vec(rotation.T)])


@lru_cache(maxsize=1)
def build_composition() -> Any:
    """One placement after another: (R (9, row by row), p (3), S (9), q (3)) -> R S (9, row by row), p + R q (3)."""
    r, p, s, q = (ca.SX.sym(name, size) for name, size in (("r", 9), ("p", 3), ("s", 9), ("q", 3)))
    R = ca.reshape(r, 3, 3).T
    return ca.Function("composition", [r, p, s, q], [ca.reshape(s, 3, 3) @ R.T, p + R @ q])


@lru_cache(maxsize=1)
def build_placed_chain() -> Any:
    """An arm whose joints may sit anywhere.

    (angles (6); for each joint, the flange and the tool, its placement on the part before it: position (3) and rotation
    (9, row by row)) -> position (3), rotation (9, row by row) of the TCP.
    """
    angles = ca.SX.sym("angles", 6)
    placements = [ca.SX.sym(f"{name}{i}", size) for i in range(8) for name, size in (("position", 3), ("rotation", 9))]
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    for i, (offset, rows) in enumerate(zip(placements[::2], placements[1::2], strict=True)):
        position = position + rotation @ offset
        rotation = rotation @ ca.reshape(rows, 3, 3).T
        if i < 6:
            rotation = rotation @ _axis_rotation_expr(AXES[i], angles[i])
    return ca.Function("placed_chain", [angles, *placements], [position, ca.vec(rotation.T)])


@kept_with("robot")
def build_load_torque(robot: Robot) -> Any:
    """Torque of loads about the joints of the nominal arm: of F at p about axis z_j through o_j, z_j . ((p - o_j) x F).

    (angles (6); TCP in the flange, position (3) and rotation (9, row by row); masses of the six links [kg], each times
    its centre (18) [kg m] in the axes of its joint; gravity (3) [m/s2]; force on the tool (3) [N] in its axes) ->
    torque about each joint (6) [N m], position (3) of the TCP.
    """
    row_norms = {"angles": 6, "tool_position": 3, "tool_rows": 9, "mass": 6, "moment": 18, "gravity": 3, "force": 3}
    symbols = [ca.SX.sym(name, size) for name, size in row_norms.items()]
    angles, tool_position, tool_rows, mass, moment, gravity, force = symbols
    model, flange = pinocchio_model(robot)
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    joints, weights = [], []
    for i, axis in enumerate(AXES):
        position = position + rotation @ ca.DM(model.jointPlacements[i + 1].translation)
        rotation = rotation @ _axis_rotation_expr(axis, angles[i])
        joints.append((rotation @ ca.DM(axis), position))
        weights.append((mass[i] * position + rotation @ moment[3 * i : 3 * i + 3], mass[i]))
    rotation = rotation @ ca.DM(flange.rotation)
    tcp = position + rotation @ (ca.DM(flange.translation) + tool_position)
    tool_force = rotation @ ca.reshape(tool_rows, 3, 3).T @ force
    torque = []
    for j, (axis, origin) in enumerate(joints):
        lever = ca.SX.zeros(3)
        for mass_times_centre, link_mass in weights[j:]:
            lever = lever + mass_times_centre - link_mass * origin
        torque.append(ca.dot(axis, ca.cross(lever, gravity) + ca.cross(tcp - origin, tool_force)))
    return ca.Function("load_torque", symbols, ca.cse([ca.vertcat(*torque), tcp]))


def pinocchio_model(robot: Robot) -> tuple[pin.Model, pin.SE3]:
    """The nominal arm in pinocchio, and the flange seen from its last joint."""
    model = pin.Model()
    parent = 0
    offsets = np.zeros((6, 3))
    for length, (joint, along) in zip(nominal_lengths(robot), LENGTHS.values(), strict=True):
        offsets[joint - 1, along] = length
    for i, (axis, offset) in enumerate(zip(AXES, offsets, strict=True)):
        joint_model = pin.JointModelRevoluteUnaligned(np.array(axis, dtype=float))
        parent = model.addJoint(parent, joint_model, pin.SE3(np.eye(3), offset), f"j{i + 1}")
    return model, pin.SE3(_flange_rotation(robot), np.zeros(3))


def pinocchio_difference(robot: Robot, tool: Pose, theta: Array, growth: Array, pose: Pose) -> float:
    """Largest difference of the expression from pinocchio, [m] and per entry of the rotation.

    Args:
        robot: The arm.
        tool: TCP in the flange.
        theta: Joints of some samples, (S, 6) [rad].
        growth: Growths of the lengths there, (S, 6) [m].
        pose: Of the TCP there by the expression, S of them.
    """
    model, flange = pinocchio_model(robot)
    nominal = Pose.from_rows(*evaluate(build_grown_pose(robot, tool), theta, np.zeros((1, len(LENGTHS)))))
    nominal_offsets = np.tile([p.translation for p in model.jointPlacements][1:], (len(theta), 1, 1))
    grown_offsets = nominal_offsets.copy()
    for (joint, along), growths in zip(LENGTHS.values(), growth.T, strict=True):
        grown_offsets[:, joint - 1, along] += growths
    tcp = flange * pin.SE3(tool.rotation, tool.position)
    angles = theta - STANDING
    differences = [0.0]
    for offsets, expected in ((nominal_offsets[:1], nominal), (grown_offsets, pose)):
        wrist = _pinocchio_wrist(model, angles, offsets)
        pair = (
            wrist.position + wrist.rotation @ tcp.translation - expected.position,
            wrist.rotation @ tcp.rotation - expected.rotation,
        )
        differences += [float(np.abs(x).max(initial=0.0)) for x in pair]
    return float(np.max(differences))


def _pinocchio_wrist(model: pin.Model, angles: Array, offsets: Array) -> Pose:
    """Pinocchio's last joint, S poses.

    Args:
        model: The arm.
        angles: Of its joints, (S, 6) [rad].
        offsets: Of each joint from the one before, (S or 1, 6, 3) [m].
    """
    data = model.createData()
    wrist, placements = data.oMi[6], list(model.jointPlacements)[1:]
    rotation, position = np.empty((len(angles), 3, 3)), np.empty((len(angles), 3))
    for joint in range(6 if len(angles) else 0):
        placements[joint].translation = offsets[0, joint]
    growing = np.flatnonzero((offsets != offsets[:1]).any(axis=(0, 2))).tolist()
    for m, q in enumerate(angles):
        for joint in growing:
            placements[joint].translation = offsets[m, joint]
        pin.forwardKinematics(model, data, q)
        rotation[m], position[m] = wrist.rotation, wrist.translation
    return Pose(frozen(position), frozen(rotation))
