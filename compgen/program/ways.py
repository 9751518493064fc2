r"""Stations of a program, points on the lines and arcs between them, and the joints there.

Straight and circular ways that pass a singularity between their ends: J5 at zero, the J1 axis, the stretched arm.

On such a way joints turn round for a small move of the tool, and which way round hangs on micrometres: corrected, it
may be another one than planned. Where a way's step and turn move the wrist centre by at most h from the nearer end, and
both ends are r from the J1 axis and m from full stretch or fold, the forearm turns by less than 1.5 h (1 / r + 3 / m):
only ways that this leaves open are sampled.

The length of path that each sample of an execution stands for: by it a corrected program's errors are averaged.

From a sample to the next on the same way, or from the station that the robot surely comes from to the first sample of
a way, the tool travels a length d; where both are judged, half of it belongs to each:

    w_m = (d_before + d_after) / 2,    rms = sqrt(sum w e^2 / sum w)

d is the share of a straight line, the share of a circle's arc, and on a joint motion the length of the tool's own way
while all joints turn evenly, on the nominal arm. What the robot may drive between two stations whose order is not sure
counts for nothing; where nothing is left that counts, all judged samples count alike.
"""

from dataclasses import replace

import numpy as np

from compgen.core.arcs import arc_heights, arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, frozen, norm
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation, rotation_vector
from compgen.core.units import DEG, MM
from compgen.program.driven import NONE, DrivenProgram, Positions
from compgen.robot.inverse_kinematics import BranchSolution
from compgen.robot.joint_path import nearest_turns, wrist_centre
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

REACH_SUBDIVISIONS = 64  # of a way that may leave the reach; a multiple of what others cut a way into
REACH_BLOCK = 1000  # ways sampled at a time
IN_LINE = 2e-6  # [m] height of an arc that the last of three decimals may make, or take away
SINGULAR_SUBDIVISIONS = 256
BLOCK = 250  # ways sampled at a time
JOINT_PIECES = 8  # chords of the tool's way on a joint motion: 0.2 % short for a quarter turn


def path_samples(driven: DrivenProgram, inside: Array) -> tuple[IntArray, Array]:
    """Stations and fractions of the straight and circular ways to them, in order of time.

    Where it stands before a way, the way's beginning too: the arm has cooled since it came there.
    """
    ways = straight_lines(driven) | circular_ways(driven)
    stood = ways & ((driven.pause > 0) | np.isin(np.arange(len(ways)), list(driven.called)))
    stations = [np.flatnonzero(some) for some in (_known(driven), stood, *(ways for _ in inside))]
    station = np.concatenate(stations)
    fraction = np.repeat(np.array([1.0, 0.0, *inside]), [len(some) for some in stations])
    order = np.lexsort((fraction, station))
    return station[order], fraction[order]


def straight_lines(driven: DrivenProgram) -> BoolArray:
    """Stations reached by a straight line within the reach, whose both ends are known, (S,).

    The robot surely comes from its origin, with one tool and one posture at both ends.
    """
    return between_known_ends(driven) & (driven.beyond <= 0)


def circular_ways(driven: DrivenProgram) -> BoolArray:
    """Stations reached on an arc within the reach, by its via or from there, whose three places are known, (S,)."""
    ways = driven.circular.copy()
    via = np.flatnonzero(ways & driven.via)
    within = (driven.beyond[via] <= 0) & (driven.beyond[via + 1] <= 0)
    ways[via], ways[via + 1] = within, within
    return ways


def swept_angles(driven: DrivenProgram, via: IntArray) -> Array:
    """How far arcs sweep by the vias at some stations, (n,) [rad]; NaN where three places make no circle."""
    return arcs_through(*_places_of_arcs(driven, via)).angle[:, 1]


def arcs_in_line(driven: DrivenProgram, via: IntArray) -> BoolArray:
    """Whether the three places of arcs by the vias at some stations lie in one line, as far as digits tell, (n,)."""
    return np.asarray(~(arc_heights(*_places_of_arcs(driven, via)) > IN_LINE))


def _places_of_arcs(driven: DrivenProgram, via: IntArray) -> list[Array]:
    """Where arcs by the vias at some stations start, their vias and where they end, (n, 3) each [m]."""
    return [driven.at.tcp.position[driven.pose[s]] for s in (driven.origin[via], via, via + 1)]


def known_arcs(driven: DrivenProgram) -> BoolArray:
    """Stations on arcs of known places, with one tool and one posture, (S,)."""
    known, origin, ways = _known(driven), driven.origin, np.zeros(len(driven.pose), dtype=bool)
    via = np.flatnonzero(driven.via & ~driven.line & ~driven.joint)
    via = via[via + 1 < len(known)]
    via = via[known[via] & known[via + 1] & (origin[via] != NONE) & (origin[via + 1] == via)]
    via = via[known[origin[via]]]
    start, middle, end = (driven.pose[s] for s in (origin[via], via, via + 1))
    for column in (driven.at.tool, driven.at.posture):
        same = (column[start] == column[middle]) & (column[start] == column[end])
        via, start, middle, end = via[same], start[same], middle[same], end[same]
    via = via[~arcs_in_line(driven, via)]
    ways[via] = ways[via + 1] = True
    return ways


def between_known_ends(driven: DrivenProgram) -> BoolArray:
    """Stations reached by a straight line whose both ends are known, with one tool and one posture, (S,)."""
    known, origin = _known(driven), driven.origin
    if not known.any():
        return known
    end, start = driven.pose, driven.pose[origin]
    lines = driven.line & known & known[origin] & (origin != NONE)
    lines &= (driven.at.tool[end] == driven.at.tool[start]) & (driven.at.posture[end] == driven.at.posture[start])
    return np.asarray(lines)


def measure_reach(robot: Robot, driven: DrivenProgram) -> DrivenProgram:
    """The program with ``circular`` told, and ``beyond`` measured on every straight way and every arc.

    The margin of a place within the reach changes at most as fast as its wrist centre moves, which between two ends is
    at most half the way, and half the turn times its lever, from the nearer of them: only ways that this leaves open
    are sampled.
    """
    driven = replace(driven, circular=known_arcs(driven))
    ways = np.flatnonzero(between_known_ends(driven) | driven.circular)
    beyond = np.zeros(len(driven.pose))
    if not len(ways):
        return replace(driven, beyond=beyond)
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    moved, _ = _largest_moves(robot, driven, ways)
    with np.errstate(invalid="ignore"):
        clear = np.minimum(driven.at.margin[start], driven.at.margin[end]) > moved
    doubtful = ways[~clear]
    for some in np.array_split(doubtful, len(doubtful) // REACH_BLOCK + 1):
        margin = _solve_inside(robot, driven, some, REACH_SUBDIVISIONS).margin.reshape(-1, REACH_SUBDIVISIONS - 1)
        beyond[some] = np.maximum(-margin.min(axis=1), 0.0)
    return replace(driven, beyond=beyond)


def _solve_inside(robot: Robot, driven: DrivenProgram, ways: IntArray, pieces: int) -> BranchSolution:
    """The arm between the ends of ways, each cut into equal pieces, way by way."""
    inside = np.arange(1, pieces) / pieces
    station, fraction = np.repeat(ways, len(inside)), np.tile(inside, len(ways))
    return driven.at.solve(robot, interpolate_poses(driven, station, fraction), driven.pose[station])


def _largest_moves(robot: Robot, driven: DrivenProgram, ways: IntArray) -> tuple[Array, Array]:
    """How far the wrist centre is from the nearer end of ways, at most [m], and how far the tool turns [rad], (n,)."""
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    lever = norm(driven.at.tools.position)[driven.at.tool[end]] + abs(float(robot.d[5]))  # from there to the TCP
    step = np.linalg.norm(driven.at.tcp.position[end] - driven.at.tcp.position[start], axis=1)
    step = np.where(driven.line[ways], step, driven.length[ways])
    turn = np.linalg.norm(rotation_vector((driven.at.tcp[start].inverse() @ driven.at.tcp[end]).rotation), axis=1)
    return (step + turn * lever) / 2, turn


def _known(driven: DrivenProgram) -> BoolArray:
    """Stations whose joints are known, (S,)."""
    known = driven.pose != NONE
    known[known] = np.isfinite(driven.at.theta[driven.pose[known]]).all(axis=1)
    return np.asarray(known)


def chains(driven: DrivenProgram, station: IntArray) -> list[slice]:
    """Samples that the robot surely runs one after the other, in the order listed: each chain of them is one slice.

    Args:
        driven: The program.
        station: Station of each sample, rising.
    """
    chain = np.cumsum(driven.origin != np.arange(len(driven.origin)) - 1)[station]
    edges = [0, *(np.flatnonzero(np.diff(chain)) + 1).tolist(), len(station)]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if a < b]


def interpolate_poses(driven: DrivenProgram, station: IntArray, fraction: Array) -> Pose:
    """The TCP's poses that a program means at fractions (M,) of the straight and circular ways to stations (M,)."""
    end = driven.pose[station]
    start = np.where(fraction < 1, driven.pose[driven.origin[station]], end)
    places, axes = driven.at.tcp.position, driven.at.tcp.rotation
    position = places[end] - (1 - fraction)[:, None] * (places[end] - places[start])
    on_arc = np.flatnonzero((fraction < 1) & ~driven.line[station] & ~driven.joint[station])
    if len(on_arc):
        position[on_arc] = _on_arcs(driven, station[on_arc], fraction[on_arc])
    rotation = axes[end]
    way = np.flatnonzero(fraction < 1)
    rotation[way] = interpolate_rotation(axes[start[way]], axes[end[way]], fraction[way])
    return Pose(frozen(position), frozen(rotation))


def _on_arcs(driven: DrivenProgram, station: IntArray, fraction: Array) -> Array:
    """Places (M, 3) [m] on arcs, at fractions (M,) of the way to the via or from there to the end, stations (M,)."""
    second = ~driven.via[station]
    via = station - second
    return arcs_through(*_places_of_arcs(driven, via)).on_halves(np.arange(len(via)), second, fraction)


def commanded_joints(robot: Robot, driven: DrivenProgram, station: IntArray, fraction: Array, tcp: Pose) -> Array:
    """Joints (M, 6) [rad] that the controller commands for M poses on the way."""
    pose, way = driven.pose[station], fraction < 1
    theta = driven.at.theta[pose]
    solved = driven.at.solve(robot, tcp[way], pose[way]).theta
    theta[way] = nearest_turns(solved, theta[way])
    return theta


def singular_ways(robot: Robot, driven: DrivenProgram) -> list[tuple[int, str]]:
    """Stations whose way there comes nearer to a singularity than its ends and than the robot file allows, and how."""
    ways = np.flatnonzero(between_known_ends(driven) | known_arcs(driven))
    if not len(ways):
        return []
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    allowed = np.array([robot.shoulder_margin, robot.elbow_margin, robot.wrist_margin])
    at_ends = np.minimum(*(_distances(robot, driven.at.theta[rows], driven.at.margin[rows]) for rows in (start, end)))
    open_ways = _may_pass(robot, driven, ways, at_ends, allowed)
    ways, at_ends = ways[open_ways], at_ends[open_ways]
    passed: list[tuple[int, str]] = []
    for first in range(0, len(ways), BLOCK):
        some = slice(first, first + BLOCK)
        inside = _distances(robot, *_solve_inside(robot, driven, ways[some], SINGULAR_SUBDIVISIONS))
        nearest = inside.reshape(-1, SINGULAR_SUBDIVISIONS - 1, 3).min(axis=1)
        dips = (nearest < allowed) & (nearest < at_ends[some])
        dips &= nearest[:, 1:2] >= 0  # that a way leaves the reach is told elsewhere
        rows = np.flatnonzero(dips.any(axis=1)).tolist()
        passed += [(int(ways[some][k]), _words(nearest[k], dips[k])) for k in rows]
    return passed


def _distances(robot: Robot, theta: Array, margin: Array) -> Array:
    """From the J1 axis [m], from full stretch or fold [m], of J5 from zero [rad], (N, 3)."""
    wrist = np.abs(theta[:, 4])
    return np.column_stack([np.abs(wrist_centre(robot, theta)[:, 0]), np.nan_to_num(margin, nan=np.inf), wrist])


def _may_pass(robot: Robot, driven: DrivenProgram, ways: IntArray, at_ends: Array, allowed: Array) -> BoolArray:
    """Ways that may come nearer to a singularity than is allowed, (n,)."""
    moved, turn = _largest_moves(robot, driven, ways)
    shoulder, elbow, wrist = at_ends.T
    with np.errstate(divide="ignore"):
        swing = turn / 2 + 1.5 * moved * (1 / shoulder + 3 / np.maximum(elbow, 0.0))
    clear = (moved < 0.2 * np.minimum(shoulder, elbow)) & (wrist - allowed[2] > swing)
    return np.asarray(~(clear & (shoulder - allowed[0] > moved) & (elbow - allowed[1] > moved)))


def _words(nearest: Array, dips: BoolArray) -> str:
    shoulder, elbow, wrist = nearest
    words = (
        f"the J1 axis by {shoulder / MM:.2f} mm", f"full stretch or fold by {elbow / MM:.2f} mm",
        f"J5 = 0 by {wrist / DEG:.3f} deg",
    )  # fmt: skip
    return " and ".join(text for text, dip in zip(words, dips, strict=True) if dip)


def way_lengths(robot: Robot, driven: DrivenProgram, station: IntArray, fraction: Array, judged: BoolArray) -> Array:
    """Length of path that each sample stands for, (M,) [m].

    Args:
        robot: The nominal arm.
        driven: The program.
        station: Of each sample, rising, (M,).
        fraction: Of the way to it, rising within a station, (M,).
        judged: Samples that are averaged, (M,); the others get 0.

    Returns:
        Lengths of which at least one is above 0, or 1 for every judged sample.
    """
    sample = np.full(len(driven.pose) + 1, NONE)  # of each station itself; the last belongs to NONE
    sample[station[fraction == 1]] = np.flatnonzero(fraction == 1)
    follows = np.concatenate([[False], station[1:] == station[:-1]])[: len(station)]
    before = np.where(follows, np.arange(len(station)) - 1, sample[driven.origin[station]])
    rows = np.flatnonzero(judged & (before != NONE))
    rows = rows[judged[before[rows]]]
    share = fraction[rows] - np.where(follows[rows], fraction[before[rows]], 0.0)
    ways, of_way = np.unique(station[rows], return_inverse=True)
    half = _way_lengths(robot, driven, ways)[of_way] * share / 2
    lengths = np.zeros(len(station))
    np.add.at(lengths, rows, half)
    np.add.at(lengths, before[rows], half)
    return lengths if lengths.any() else judged.astype(float)


def _way_lengths(robot: Robot, driven: DrivenProgram, ways: IntArray) -> Array:
    """Length of the tool's way to stations from their origins, (n,) [m]."""
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    lengths = np.asarray(np.linalg.norm(driven.at.tcp.position[end] - driven.at.tcp.position[start], axis=1))
    arcs = ~driven.line[ways] & ~driven.joint[ways] & (driven.origin[ways] == ways - 1)
    lengths[arcs] = driven.length[ways[arcs]]
    turned = np.flatnonzero(driven.joint[ways])
    lengths[turned] = joint_way_lengths(robot, driven.at, start[turned], end[turned])
    return np.asarray(np.nan_to_num(lengths, nan=0.0))


def joint_way_lengths(robot: Robot, poses: Positions, start: IntArray, end: IntArray) -> Array:
    """Length of the tool's way on joint motions from some rows of poses to others, (n,) [m]."""
    if not len(start):
        return np.zeros(0)
    at = np.linspace(0, 1, JOINT_PIECES + 1)[:, None]
    theta = poses.theta[start, None] * (1 - at) + poses.theta[end, None] * at
    tools = np.repeat(poses.tools.position[poses.tool[end]], len(at), axis=0)
    place = flange_pose(robot, theta.reshape(-1, 6)).act(tools)
    chords = np.diff(place.reshape(len(start), len(at), 3), axis=1)
    return np.asarray(np.linalg.norm(chords, axis=2).sum(axis=1))
