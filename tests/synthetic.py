"""Made-up robots and their measurements: the study's arm with its sources on, true parameters drawn from priors."""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, UM
from compgen.identification.instrument_frames import InstrumentFrames
from compgen.identification.measured_poses import motion_directions
from compgen.identification.measurements import Measurements, plain_ends
from compgen.identification.model import ArmModel, build_model
from compgen.identification.parameters import symbolic_sources
from compgen.pipelines.files.robot_file import Arm, load_arm
from compgen.robot.inverse_kinematics import Posture
from compgen.robot.joint_path import follow_branch

NOISE = 25 * UM
PRISM = np.array([[60, 10, 120], [-50, 40, 150], [5, -60, 180]]) * 1e-3  # reflectors in the flange [m]
PENDANT_LOW = np.array([-60, -30, -60, -120, -110, -150]) * DEG
PENDANT_HIGH = np.array([60, 60, 30, 120, 110, 150]) * DEG


@dataclass(frozen=True, eq=False, slots=True)
class Truth:
    """A robot as it really is."""

    arm: Arm
    model: ArmModel
    p: np.ndarray
    frames: InstrumentFrames

    def noiseless(self, data):
        return self.frames.predict(data, *self.model.pose(data, self.p))


def made_up(robot_file, seed, ripple=0.0):
    """A robot whose parameters are drawn from their priors; ``ripple`` scales the orders above two."""
    arm = load_arm(robot_file)
    parts = symbolic_sources(arm.robot, arm.known, np.ones(6, bool), warm=True)
    model = build_model(arm.robot, parts, len(arm.nodes))
    rng = np.random.default_rng(seed)
    share = np.array([ripple if t.source == "joint_ripple" else 1.0 for t in model.parameters])
    late = np.array([t.field == "hardening" for t in model.parameters])  # drawn for itself: arms stay
    p = np.zeros(len(share))
    p[~late] = rng.normal(0, model.prior[~late]) * share[~late]
    p[late] = np.random.default_rng([seed, 1]).normal(0, model.prior[late])
    turn = rotation_matrix(rng.normal(0, 1, (1, 3)))
    return Truth(arm, model, p, InstrumentFrames(turn, rng.uniform(-3, 3, (1, 3)), PRISM))


def random_theta(robot, rng, count):
    """Poses in front of the arm, J5 away from zero, inside the limits."""
    poses = list[np.ndarray]()
    while len(poses) < count:
        pendant = rng.uniform(PENDANT_LOW, PENDANT_HIGH)
        theta = robot.to_theta(pendant[None])[0]
        inside = (theta > robot.lower).all() and (theta < robot.upper).all()
        if inside and abs(pendant[4]) > 10 * DEG:
            poses.append(theta)
    return np.array(poses)


def measured(
    truth, theta, rng, reflectors=3, noise=NOISE, direction=None, rise=None, time=None, warm=None, name="cold"
):
    """Rows for some reflectors at each pose, with noise."""
    M, nodes = len(theta), len(truth.arm.nodes)
    pose = np.repeat(np.arange(M), reflectors)
    N = len(pose)
    data = Measurements(
        theta=theta,
        rise=np.zeros((M, nodes)) if rise is None else rise,
        lag=np.zeros((M, nodes)),
        direction=motion_directions(theta) if direction is None else direction,
        time=np.arange(M, dtype=float) if time is None else time,
        warm=np.zeros(M) if warm is None else warm,
        pose=pose,
        instrument=np.zeros(N, int),
        reflector=np.tile(np.arange(reflectors), M),
        ends=plain_ends(N),
        position=np.zeros((N, 3)),
        rotation=np.full((N, 3, 3), np.nan),
        sigma=np.ones(N),
        label=tuple(f"{name}.csv: line {i + 2}" for i in range(N)),
        reflectors=tuple(f"r{i + 1}" for i in range(reflectors)),
        instruments=(f"{name}.csv",),
        aligned=np.array([False]),
    )
    return replace(data, position=truth.noiseless(data) + rng.normal(0, noise, (N, 3)))


def with_outliers(data, rng, share=0.01, least=0.5e-3, most=5e-3):
    """Some rows pushed away, in any direction; which ones."""
    count = max(1, round(share * len(data.pose)))
    rows = rng.choice(len(data.pose), count, replace=False)
    push = rng.normal(size=(count, 3))
    push *= rng.uniform(least, most, (count, 1)) / np.linalg.norm(push, axis=1, keepdims=True)
    position = data.position.copy()
    position[rows] += push
    outlier = np.zeros(len(data.pose), bool)
    outlier[rows] = True
    return replace(data, position=position), outlier


def axis_lines(truth, rng, noise=NOISE):
    """Two horizontal lines and a vertical one through a point, both ways, three runs: what the study measured."""
    robot = truth.arm.robot
    places, directions, lines = [], list[int](), list[int]()
    for k, (axis, low, high) in enumerate(((0, 0.9, 1.7), (1, -0.6, 0.6), (2, -0.3, 0.5))):
        for _ in range(3):
            for sense in (1, -1):
                s = np.linspace(low, high, 13)[::sense]
                points = np.tile([1.3, 0.0, 0.1], (13, 1))
                points[:, axis] = s
                places.append(points)
                directions += 13 * [sense]
                lines += 13 * [k]
    place, direction, line = np.concatenate(places), np.array(directions), np.array(lines)
    down = np.tile(np.diag([1.0, -1.0, -1.0]), (len(place), 1, 1))
    theta = follow_branch(robot, Pose(place, down), Posture())
    going = np.zeros_like(theta)
    for k in range(3):
        rows = np.flatnonzero(line == k)
        s = place[rows, k]
        for i in range(6):
            rate = np.polyval(np.polyder(np.polyfit(s, theta[rows, i], 5)), s)
            going[rows, i] = np.where(np.abs(rate) > 1e-4, np.sign(rate), 0.0) * direction[rows]
    N = len(place)
    data = Measurements(
        theta=theta, rise=np.zeros((N, len(truth.arm.nodes))), lag=np.zeros((N, len(truth.arm.nodes))),
        direction=going, time=np.arange(N, dtype=float), warm=np.zeros(N), pose=np.arange(N), instrument=line,
        reflector=np.zeros(N, int), ends=plain_ends(N), position=np.zeros((N, 3)),
        rotation=np.full((N, 3, 3), np.nan), sigma=np.ones(N),
        label=tuple(f"lines.csv: line {i + 2}" for i in range(N)),
        reflectors=("tool",), instruments=("line x", "line y", "line z"), aligned=np.ones(3, bool),
    )  # fmt: skip
    P, _ = truth.model.pose(data, truth.p)
    zero = rng.normal(0, 1e-3, (3, 3))
    tilt = rotation_matrix(rng.normal(0, 3e-4, (3, 3)))
    position_in_frame = np.einsum("nij,nj->ni", tilt[line], P) + zero[line]
    return replace(data, position=position_in_frame + rng.normal(0, noise, (N, 3)))


def warming(truth, rng, count=40, hours=5.0, tau=(2.2, 1.4, 2.0, 1.8, 1.8), final=(11, 4, 13, 3, 2.3)):
    """Poses while the arm warms, and the temperatures at each."""
    time = np.linspace(0, hours * 3600, count)
    rise = np.array(final) * (1 - np.exp(-time[:, None] / (np.array(tau) * 3600)))
    theta = random_theta(truth.arm.robot, rng, count)
    return measured(truth, theta, rng, rise=rise, time=time, warm=time, name="warm"), rise
