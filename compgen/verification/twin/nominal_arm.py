r"""The arm of the twin, link by link as a URDF has it, as an expression of its own; pinocchio confirms every run of it.

    Rz(J1) Tx(a1) Ry(J2) Tz(a2) Ry(-(J2+J3)) Tz(a3) Rx(-J4) Tx(d4) Ry(-J5) Tx(d6) Rx(-J6) flange

Nothing here comes from the optimiser's chain. pinocchio has no forward kinematics of many samples at once, so the
expression drives them all, and ``confirm`` builds the same arm in pinocchio and compares a thousand samples.
"""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from compgen.core.arrays import Array
from compgen.core.evaluation import evaluate
from compgen.robot.inverse_kinematics import Posture, joints_expr
from compgen.robot.robot import Robot

#: the lengths that may grow, in the order of ``fly``'s growth: joint whose placement carries it, axis
LENGTHS = {"a1": (2, 0), "a2": (3, 2), "a3": (4, 2), "d4": (5, 0), "d6": (6, 0), "d1": (1, 2)}
AXES = ((0, 0, 1), (0, 1, 0), (0, -1, 0), (-1, 0, 0), (0, -1, 0), (-1, 0, 0))
AGREE = 1e-12  # m, and in each entry of the rotation


def _lengths(robot: Robot) -> tuple[float, ...]:
    return (float(robot.a[0]), float(robot.a[1]), float(robot.a[2]), float(-robot.d[3]), float(-robot.d[5]), 0.0)


def _turn_expr(axis: tuple[int, int, int], angle: Any) -> Any:
    """Rotation by an angle about a coordinate axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    k = next(i for i in range(3) if axis[i])
    i, j = (k + 1) % 3, (k + 2) % 3
    turn = ca.SX.eye(3)
    turn[i, i], turn[j, j], turn[i, j], turn[j, i] = c, c, -axis[k] * s, axis[k] * s
    return turn


def pose_expr(robot: Robot, angles: Any, growth: Any, tool_position: Array, tool_rotation: Array) -> tuple[Any, Any]:
    """TCP position (3, 1) and rotation (3, 3) from joint angles about the axes (6, 1) and growths (6, 1) [m]."""
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    where = {joint: (k, axis) for k, (joint, axis) in enumerate(LENGTHS.values())}
    for joint, turning in enumerate(AXES, 1):
        if joint in where:
            k, along = where[joint]
            position = position + rotation[:, along] * (_lengths(robot)[k] + growth[k])
        rotation = rotation @ _turn_expr(turning, angles[joint - 1])
    rotation = rotation @ ca.DM(np.rint(_flange(robot)))
    return position + rotation @ ca.DM(tool_position), rotation @ ca.DM(tool_rotation)


def _flange(robot: Robot) -> Array:
    """Where the flange's axes are when all joints stand at zero: right angles, exactly."""
    return np.asarray(pin.utils.rotate("y", -np.pi / 2) @ pin.utils.rotate("x", float(robot.alpha[5])))


@lru_cache(maxsize=16)
def build_drive(robot: Robot, posture: Posture, tool_position: bytes, tool_rotation: bytes) -> Any:
    """One sample of a straight line, as the controller commands it and as the real arm drives it.

    (both ends' position (3, 3); rotation at its start (9, row by row) and its turn (3); both ends' joints (6, 6);
    fraction; growths) -> theta (6), position and rotation of the real TCP (3, 9), and what may be wrong: reach margin
    [m], distance [m] and turn of the nominal TCP from the pose asked for.
    """
    names = {"p0": 3, "p1": 3, "r0": 9, "turn": 3, "q0": 6, "q1": 6, "fraction": 1, "growth": len(LENGTHS)}
    symbols = [ca.SX.sym(name, size) for name, size in names.items()]
    p0, p1, r0, turn, q0, q1, fraction, growth = symbols
    place, tool = (np.frombuffer(t).reshape(-1, 3) for t in (tool_position, tool_rotation))
    angle = ca.norm_2(turn)
    axis = ca.skew(turn / ca.if_else(angle > 0, angle, 1.0))
    some = fraction * angle
    whole = ca.SX.eye(3) + ca.sin(some) * axis + 2 * ca.sin(some / 2) ** 2 * (axis @ axis)
    rotation = ca.reshape(r0, 3, 3).T @ whole
    position = p0 + fraction * (p1 - p0)
    flange = rotation @ ca.DM(tool.T)
    theta, margin = joints_expr(robot, posture, position - flange @ ca.DM(place.ravel()), flange)
    guess = q0 + fraction * (q1 - q0)
    theta = theta + 2 * np.pi * ca.floor((guess - theta) / (2 * np.pi) + 0.5)
    angles = theta - ca.DM(robot.pendant_zero)
    nominal = pose_expr(robot, angles, ca.SX.zeros(len(LENGTHS)), place.ravel(), tool)
    actual = pose_expr(robot, angles, growth, place.ravel(), tool)
    wrong = ca.vertcat(margin, ca.norm_2(nominal[0] - position), ca.norm_fro(nominal[1] - rotation))
    return ca.Function("drive", symbols, ca.cse([theta, actual[0], ca.vec(actual[1].T), wrong]))


@lru_cache(maxsize=4)
def build_warmth(nodes: int) -> Any:
    """How warm the nodes (K) are some time into a line, and how much the lengths have grown by it (6) [m].

    (rise at the line's start, what it tends to, time constants (K each); growth per kelvin (K by 6, node by node); time
    since) -> rise, growth.
    """
    rise, goal, tau = (ca.SX.sym(name, nodes) for name in ("rise", "goal", "tau"))
    per, since = ca.SX.sym("per", nodes * len(LENGTHS)), ca.SX.sym("since")
    now = goal + (rise - goal) * ca.exp(-since / tau)
    grown = ca.reshape(per, len(LENGTHS), nodes) @ now
    return ca.Function("warmth", [rise, goal, tau, per, since], [now, grown])


@lru_cache(maxsize=16)
def build_fly(robot: Robot, tool_position: bytes, tool_rotation: bytes) -> Any:
    """(theta (6), growths (6)) -> position (3), rotation (9, row by row) of the TCP."""
    theta, growth = ca.SX.sym("theta", 6), ca.SX.sym("growth", len(LENGTHS))
    place, tool = (np.frombuffer(t).reshape(-1, 3) for t in (tool_position, tool_rotation))
    position, rotation = pose_expr(robot, theta - ca.DM(robot.pendant_zero), growth, place.ravel(), tool)
    return ca.Function("fly", [theta, growth], [position, ca.vec(rotation.T)])


@lru_cache(maxsize=1)
def build_join() -> Any:
    """One place after another: (turn (9, row by row), place (3), and again) -> turn (9, row by row), place (3)."""
    r, p, s, q = (ca.SX.sym(name, size) for name, size in (("r", 9), ("p", 3), ("s", 9), ("q", 3)))
    turn = ca.reshape(r, 3, 3).T
    return ca.Function("join", [r, p, s, q], [ca.reshape(s, 3, 3) @ turn.T, p + turn @ q])


@lru_cache(maxsize=1)
def build_chain() -> Any:
    """An arm whose joints may sit anywhere.

    (angles (6); for each joint, the flange and the tool, where it sits on the part before it: place (3) and turn (9,
    row by row)) -> position (3), rotation (9, row by row) of the TCP.
    """
    angles = ca.SX.sym("angles", 6)
    parts = [ca.SX.sym(f"{what}{i}", size) for i in range(8) for what, size in (("place", 3), ("turn", 9))]
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    for i, (place, rows) in enumerate(zip(parts[::2], parts[1::2])):
        position = position + rotation @ place
        rotation = rotation @ ca.reshape(rows, 3, 3).T
        if i < 6:
            rotation = rotation @ _turn_expr(AXES[i], angles[i])
    return ca.Function("chain", [angles, *parts], [position, ca.vec(rotation.T)])


@lru_cache(maxsize=16)
def build_loads(robot: Robot) -> Any:
    """What weighs on the nominal arm: about axis z_j through o_j, a load F at p turns by z_j . ((p - o_j) x F).

    (angles (6); TCP in the flange, place (3) and turn (9, row by row); masses of the six links [kg], each times its
    centre (18) [kg m] in the axes of its joint; gravity (3) [m/s2]; force on the tool (3) [N] in its axes) -> torque of
    all that about each joint (6) [N m], position (3) of the TCP.
    """
    sizes = {"angles": 6, "place": 3, "turn": 9, "mass": 6, "moment": 18, "gravity": 3, "force": 3}
    symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
    angles, place, turn, mass, moment, gravity, force = symbols
    model, flange = build_model(robot)
    position, rotation = ca.SX.zeros(3), ca.SX.eye(3)
    joints, weights = [], []
    for i, axis in enumerate(AXES):
        position = position + rotation @ ca.DM(model.jointPlacements[i + 1].translation)
        rotation = rotation @ _turn_expr(axis, angles[i])
        joints.append((rotation @ ca.DM(axis), position))
        weights.append((mass[i] * position + rotation @ moment[3 * i : 3 * i + 3], mass[i]))
    rotation = rotation @ ca.DM(flange.rotation)
    tcp = position + rotation @ (ca.DM(flange.translation) + place)
    push = rotation @ ca.reshape(turn, 3, 3).T @ force
    torque = []
    for j, (axis, origin) in enumerate(joints):
        lever = ca.SX.zeros(3)
        for at, heavy in weights[j:]:
            lever = lever + at - heavy * origin
        torque.append(ca.dot(axis, ca.cross(lever, gravity) + ca.cross(tcp - origin, push)))
    return ca.Function("loads", symbols, ca.cse([ca.vertcat(*torque), tcp]))


def build_model(robot: Robot) -> tuple[pin.Model, pin.SE3]:
    """The nominal arm in pinocchio, and the flange seen from its last joint."""
    model = pin.Model()
    parent = 0
    places = np.zeros((6, 3))
    for length, (joint, along) in zip(_lengths(robot), LENGTHS.values()):
        places[joint - 1, along] = length
    for i, (axis, place) in enumerate(zip(AXES, places)):
        kind = pin.JointModelRevoluteUnaligned(np.array(axis, dtype=float))
        parent = model.addJoint(parent, kind, pin.SE3(np.eye(3), place), f"j{i + 1}")
    return model, pin.SE3(_flange(robot), np.zeros(3))


def disagreement(
    robot: Robot, tool_position: Array, tool_rotation: Array, theta: Array, growth: Array, pose: tuple[Array, Array]
) -> float:
    """How far the expression is from pinocchio, sample by sample, at most [m, and per entry of the rotation].

    Args:
        robot: The arm.
        tool_position: TCP in the flange, (3,) [m].
        tool_rotation: (3, 3).
        theta: Joints of some samples, (S, 6) [rad].
        growth: Growths of the lengths there, (S, 6) [m].
        pose: What the expression found there with those growths, (S, 3) [m] and (S, 9).
    """
    model, flange = build_model(robot)
    nominal = evaluate(
        build_fly(robot, tool_position.tobytes(), tool_rotation.tobytes()), theta, np.zeros((1, len(LENGTHS)))
    )
    places = np.tile([p.translation for p in model.jointPlacements][1:], (len(theta), 1, 1))
    grown = places.copy()
    for (joint, along), more in zip(LENGTHS.values(), growth.T):
        grown[:, joint - 1, along] += more
    tool = flange * pin.SE3(tool_rotation, tool_position)
    angles = theta - robot.pendant_zero
    far = [0.0]
    for placed, found in ((places[:1], nominal), (grown, pose)):
        turn, place = _flown(model, angles, placed)
        apart = (place + turn @ tool.translation - found[0], turn @ tool.rotation - found[1].reshape(-1, 3, 3))
        far += [float(np.abs(x).max(initial=0.0)) for x in apart]
    return float(np.max(far))


def _flown(model: pin.Model, angles: Array, placed: Array) -> tuple[Array, Array]:
    """Pinocchio's last joint, (S, 3, 3) and (S, 3) [m], its joints standing at places (S or 1, 6, 3) [m]."""
    data = model.createData()
    wrist, joints = data.oMi[6], list(model.jointPlacements)[1:]
    turn, place = np.empty((len(angles), 3, 3)), np.empty((len(angles), 3))
    for m, q in enumerate(angles):
        if m < len(placed):
            for joint, at in zip(joints, placed[m]):
                joint.translation = at
        pin.forwardKinematics(model, data, q)
        turn[m], place[m] = wrist.rotation, wrist.translation
    return turn, place
