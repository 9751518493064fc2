r"""Ways to touch spheres and planes: directions and probe orientations that the arm reaches in a program's posture.

A ball of radius r touches a sphere of radius R about s, moving along n, when its centre is at

    c = s - (R + r) n

A plane is a sphere of no radius that is touched at its point, against its normal. The probe's stem runs from the ball
back along -t, t the flange's z. It stays clear of the target while -t . n' >= 0, n' = -n the outward normal at the
touch; spheres stand on stems below them, so nothing touches from underneath. The
probe comes from above along t to a distance of ``clearance`` before c, searches along n, and may go ``beyond`` c. A
way is kept where all of it is in reach, within the joints' limits, away from singularities, and on one branch.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray, owns
from compgen.core.pose import Pose
from compgen.core.rotations import rotation_matrix
from compgen.core.units import DEG, MM
from compgen.robot.inverse_kinematics import Posture, flange_from_tool, solve_tool
from compgen.robot.joint_path import legal_turns, nearest_turns
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

MOST = 20_000  # ways that are looked at; of more, as many of each target, at random
TILTS = (30 * DEG, 55 * DEG)  # of the stem from the vertical, beside none
AZIMUTHS = 6  # to which it is tilted
SPINS = 6  # of the flange about the stem
RINGS = ((0.0, 8), (45 * DEG, 8), (90 * DEG, 1))  # elevation of touched points, and how many lie around
LIFT = 150 * MM  # along the stem, from the approach to where the arm may turn
STEP = 20 * DEG  # a joint that turns farther between two points of a way has passed something singular
PIECES = 5  # of each straight piece of a way, at whose ends the joints are looked at
STEM_GAP = 5 * MM  # between the probe's stem and other targets
POINTS = 17  # of a stem, from the ball to the flange


@dataclass(frozen=True, eq=False, slots=True)
@owns(place=("S", 3), radius=("S",), normal=("S", 3))
class Targets:
    """S spheres and planes that may be touched."""

    name: tuple[str, ...]
    place: Array  # (S, 3) [m] in World
    radius: Array  # (S,) [m] 0 of a plane
    normal: Array  # (S, 3) out of a plane's material; NaN: a sphere


@dataclass(frozen=True, slots=True)
class Probe:
    """What touches: a ball on a stem along the flange's z."""

    centre: Pose  # in the flange
    radius: float  # [m] of the ball


@dataclass(frozen=True, slots=True)
class Search:
    """How a touch is driven."""

    clearance: float  # [m] before the touch, from where the search begins
    beyond: float  # [m] behind the touch, to where it may go
    centres: bool = False  # whether it locates the centre of a sphere (a nest, a centring probe), not one side of it


@dataclass(frozen=True, eq=False, slots=True)
@owns(target=("K",), normal=("K", 3), position=("K", 4, 3), rotation=("K", 3, 3), theta=("K", 4, 6))
class Ways:
    """K ways to touch; each is lifted, approaches, touches, and goes beyond."""

    target: IntArray  # (K,)
    normal: Array  # (K, 3) in which the probe moves; NaN: it locates the centre
    position: Array  # (K, 4, 3) [m] of the ball's centre in World
    rotation: Array  # (K, 3, 3) of the flange
    theta: Array  # (K, 4, 6) [rad]

    def subset(self, rows: IntArray | BoolArray) -> "Ways":
        """Some of them."""
        return Ways(*(getattr(self, name)[rows] for name in ("target", "normal", "position", "rotation", "theta")))


def reachable_ways(robot: Robot, posture: Posture, near: Array, targets: Targets, probe: Probe, search: Search) -> Ways:
    """All ways that the arm can drive.

    Args:
        robot: Arm of the class that the closed form covers.
        posture: Kept throughout.
        near: Joints (6,) [rad] whose turns are to be kept.
        targets: What may be touched.
        probe: With what.
        search: How a touch is driven.
    """
    ways = [_ways_of(s, targets, probe, search) for s in range(len(targets.name))]
    rng, each = np.random.default_rng(1), MOST // len(ways)  # the same ways at every run
    rows = [np.sort(rng.permutation(len(part[0]))[:each]) for part in ways]
    target, normal, position, rotation = (
        np.concatenate([part[k][some] for part, some in zip(ways, rows, strict=True)]) for k in range(4)
    )
    theta, reached = _drive(robot, posture, near, probe, position, rotation)
    reached &= _clear(targets, probe, target, position, rotation)
    return Ways(target, normal, position, rotation, theta).subset(reached)


def _ways_of(s: int, targets: Targets, probe: Probe, search: Search) -> tuple[Array, ...]:
    """Target, normal, stages and rotation of all ways to touch one target, whatever the arm reaches."""
    rotations = _orientations()
    stem = rotations[:, :, 2]
    is_plane = bool(np.isfinite(targets.normal[s, 0]))
    outward = np.empty((0, 3)) if search.centres else targets.normal[s : s + 1] if is_plane else _outward()
    i, j = np.indices((max(len(outward), 1), len(rotations))).reshape(2, -1)
    if search.centres:  # the probe comes down along its stem; a plane has no centre
        i, j = (i[:0], j[:0]) if is_plane else (i, j)
        normal, way, touch = np.full((len(j), 3), np.nan), stem[j], np.tile(targets.place[s], (len(j), 1))
    else:
        clear = np.einsum("ki,ki->k", -stem[j], outward[i]) >= -1e-9
        i, j = i[clear], j[clear]
        normal = way = -outward[i]
        touch = targets.place[s] - (targets.radius[s] + probe.radius) * way
    before = touch - search.clearance * way
    stages = np.stack(
        [before - LIFT * stem[j], before, touch, touch + search.beyond * way * (not search.centres)], axis=1
    )
    return np.full(len(j), s), normal, stages, rotations[j]


def _outward() -> Array:
    """Outward normals of the points that are touched, (17, 3)."""
    normals = [
        [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)]
        for up, count in RINGS
        for around in 2 * np.pi * np.arange(count) / count
    ]
    return np.asarray(np.round(normals, 12) + 0.0)


def _orientations() -> Array:
    """Rotations of the flange, its z downward and tilted to all sides, (O, 3, 3)."""
    down = rotation_matrix(np.array([np.pi, 0.0, 0.0]))
    rotations = []
    for tilt, azimuth in [(0.0, 0.0), *product(TILTS, 2 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS)]:
        lean = rotation_matrix(tilt * np.array([-np.sin(azimuth), np.cos(azimuth), 0.0]))
        spins = 2 * np.pi * np.arange(SPINS) / SPINS
        rotations += [lean @ down @ rotation_matrix(np.array([0.0, 0.0, spin])) for spin in spins]
    return np.array(rotations)


def _drive(
    robot: Robot, posture: Posture, near: Array, probe: Probe, position: Array, rotation: Array
) -> tuple[Array, BoolArray]:
    """Joints of the stages, (K, 4, 6) [rad], and which ways the arm drives, (K,)."""
    K, count = len(position), 3 * PIECES + 1
    at = np.linspace(0.0, 3.0, count)
    piece = np.minimum(at.astype(int), 2)
    share = (at - piece)[None, :, None]
    points = position[:, piece] * (1 - share) + position[:, piece + 1] * share
    pose = Pose(points.reshape(-1, 3), np.repeat(rotation, count, axis=0))
    theta, margin = solve_tool(robot, pose, probe.centre, posture)
    theta = legal_turns(robot, nearest_turns(theta, np.broadcast_to(near, theta.shape)))
    flange = flange_from_tool(pose, probe.centre)
    wrist = flange.position - np.cos(robot.alpha[5]) * robot.d[5] * flange.rotation[:, :, 2]
    good = (
        ((theta >= robot.lower) & (theta <= robot.upper)).all(axis=1)
        & (margin > robot.elbow_margin)
        & (np.hypot(wrist[:, 0], wrist[:, 1]) > robot.shoulder_margin)
        & (np.abs(theta[:, 4]) > robot.wrist_margin)
    )
    if robot.interference is not None:
        good &= robot.interference.clearance(theta) > 0
    theta = theta.reshape(K, count, 6)
    smooth = (np.abs(np.diff(theta, axis=1)) < STEP).all(axis=(1, 2))
    return theta[:, ::PIECES], good.reshape(K, count).all(axis=1) & smooth


def _clear(targets: Targets, probe: Probe, target: IntArray, position: Array, rotation: Array) -> BoolArray:
    """Which ways keep the probe's stem clear of the other targets and the stems below them, (K,)."""
    to_flange = np.einsum("kij,j->ki", rotation, probe.centre.position)
    other = np.arange(len(targets.name)) != target[:, None]
    gaps = [_gaps(targets, probe, position[:, stage], position[:, stage] - to_flange) for stage in (1, 2)]
    return np.asarray(~((np.min(gaps, axis=0) < STEM_GAP) & other).any(axis=1))


def stem_gap(robot: Robot, targets: Targets, probe: Probe, theta: Array) -> Array:
    """The smallest distance of the probe from each target and the stem below it while it takes poses, (S,) [m].

    Args:
        robot: The arm.
        targets: S of them.
        probe: Its stem runs from the ball to the flange.
        theta: Joints (M, 6) [rad].
    """
    flange = flange_pose(robot, theta)
    return np.asarray(_gaps(targets, probe, flange.act(probe.centre.position), flange.position).min(axis=0))


def _gaps(targets: Targets, probe: Probe, ball: Array, flange: Array) -> Array:
    """Distances of stems from balls to flanges, (K, 3) each [m], from targets and stems below them, (K, S) [m]."""
    stem = ball[:, None] + (flange - ball)[:, None] * np.linspace(0.0, 1.0, POINTS)[:, None]  # (K, POINTS, 3)
    gaps = np.empty((len(ball), len(targets.name)))
    for s, (place, radius) in enumerate(zip(targets.place, targets.radius, strict=True)):
        off = stem - place
        off[:, :, 2] = np.maximum(off[:, :, 2], 0.0)
        gaps[:, s] = np.linalg.norm(off, axis=2).min(axis=1) - radius - probe.radius
    return gaps
