"""Stations of a program, points on the lines and arcs between them, and the joints there."""

from dataclasses import replace

import numpy as np

from compgen.core.arcs import arc_heights, arcs_through
from compgen.core.arrays import Array, BoolArray, IntArray, frozen, norm
from compgen.core.pose import Pose
from compgen.core.rotations import interpolate_rotation, rotation_vector
from compgen.fanuc.analysis.poses import NONE, Poses
from compgen.fanuc.analysis.traversal import Traversal
from compgen.robot.inverse_kinematics import ALL_POSTURES, flange_from_tool, solve_flange
from compgen.robot.joint_path import nearest_turns
from compgen.robot.robot import Robot

REACH_SUBDIVISIONS = 64  # of a way that may leave the reach; a multiple of what others cut a way into
REACH_BLOCK = 1000  # ways sampled at a time
IN_LINE = 2e-6  # [m] height of an arc that the last of three decimals may make, or take away


def path_samples(poses: Poses, traversal: Traversal, inside: Array) -> tuple[IntArray, Array]:
    """Stations and fractions of the straight and circular ways to them, in order of time."""
    known, ways = _known(poses, traversal), straight_lines(poses, traversal) | circular_ways(traversal)
    station = np.concatenate([np.flatnonzero(known), *(np.flatnonzero(ways) for _ in inside)])
    fraction = np.concatenate([np.ones(int(known.sum())), *(np.full(int(ways.sum()), f) for f in inside)])
    order = np.lexsort((fraction, station))
    return station[order], fraction[order]


def straight_lines(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations reached by a straight line within the reach, whose both ends are known, (S,).

    The robot surely comes from its origin, with one tool and one posture at both ends.
    """
    return between_known_ends(poses, traversal) & (traversal.beyond <= 0)


def circular_ways(traversal: Traversal) -> BoolArray:
    """Stations reached on an arc within the reach, by its via or from there, whose three places are known, (S,)."""
    ways = traversal.circular.copy()
    via = np.flatnonzero(ways & traversal.via)
    within = (traversal.beyond[via] <= 0) & (traversal.beyond[via + 1] <= 0)
    ways[via], ways[via + 1] = within, within
    return ways


def swept_angles(poses: Poses, traversal: Traversal, via: IntArray) -> Array:
    """How far arcs sweep by the vias at some stations, (n,) [rad]; NaN where three places make no circle."""
    stations = traversal.origin[via], via, via + 1
    return arcs_through(*(poses.tcp.position[traversal.pose[s]] for s in stations)).angle[:, 1]


def arcs_in_line(poses: Poses, traversal: Traversal, via: IntArray) -> BoolArray:
    """Whether the three places of arcs by the vias at some stations lie in one line, as far as digits tell, (n,)."""
    stations = traversal.origin[via], via, via + 1
    return np.asarray(~(arc_heights(*(poses.tcp.position[traversal.pose[s]] for s in stations)) > IN_LINE))


def known_arcs(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations on arcs of known places, with one tool and one posture, (S,)."""
    known, origin, ways = _known(poses, traversal), traversal.origin, np.zeros(len(traversal.pose), dtype=bool)
    via = np.flatnonzero(traversal.via & ~traversal.line & ~traversal.joint)
    via = via[via + 1 < len(known)]
    via = via[known[via] & known[via + 1] & (origin[via] != NONE) & (origin[via + 1] == via)]
    via = via[known[origin[via]]]
    start, middle, end = (traversal.pose[s] for s in (origin[via], via, via + 1))
    for column in (poses.tool, poses.posture):
        same = (column[start] == column[middle]) & (column[start] == column[end])
        via, start, middle, end = via[same], start[same], middle[same], end[same]
    via = via[~arcs_in_line(poses, traversal, via)]
    ways[via] = ways[via + 1] = True
    return ways


def between_known_ends(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations reached by a straight line whose both ends are known, with one tool and one posture, (S,)."""
    known, origin = _known(poses, traversal), traversal.origin
    if not known.any():
        return known
    end, start = traversal.pose, traversal.pose[origin]
    lines = traversal.line & known & known[origin] & (origin != NONE)
    lines &= (poses.tool[end] == poses.tool[start]) & (poses.posture[end] == poses.posture[start])
    return np.asarray(lines)


def measure_reach(robot: Robot, poses: Poses, traversal: Traversal) -> Traversal:
    """The traversal with ``circular`` told, and ``beyond`` measured on every straight way and every arc.

    The margin of a place within the reach changes at most as fast as its wrist centre moves, which between two ends is
    at most half the way, and half the turn times its lever, from the nearer of them: only ways that this leaves open
    are sampled.
    """
    traversal = replace(traversal, circular=known_arcs(poses, traversal))
    ways = np.flatnonzero(between_known_ends(poses, traversal) | traversal.circular)
    beyond = np.zeros(len(traversal.pose))
    if not len(ways):
        return replace(traversal, beyond=beyond)
    start, end = traversal.pose[traversal.origin[ways]], traversal.pose[ways]
    # from the wrist centre to the TCP, at most
    lever = norm(poses.tools.position)[poses.tool[end]] + abs(float(robot.d[5]))
    step = np.linalg.norm(poses.tcp.position[end] - poses.tcp.position[start], axis=1)
    step = np.where(traversal.line[ways], step, traversal.length[ways])
    turn = np.linalg.norm(rotation_vector((poses.tcp[start].inverse() @ poses.tcp[end]).rotation), axis=1)
    with np.errstate(invalid="ignore"):
        clear = np.minimum(poses.margin[start], poses.margin[end]) > (step + turn * lever) / 2
    inside = np.arange(1, REACH_SUBDIVISIONS) / REACH_SUBDIVISIONS
    kind = np.column_stack([poses.tool[end], poses.posture[end]])
    for tool, posture in np.unique(kind[~clear], axis=0).tolist():
        rows = ways[~clear & (kind == [tool, posture]).all(axis=1)]
        for some in np.array_split(rows, len(rows) // REACH_BLOCK + 1):
            station, fraction = np.repeat(some, len(inside)), np.tile(inside, len(some))
            tcp = interpolate_poses(poses, traversal, station, fraction)
            margin = solve_flange(robot, flange_from_tool(tcp, poses.tools[tool]), ALL_POSTURES[posture]).margin
            beyond[some] = np.maximum(-margin.reshape(-1, len(inside)).min(axis=1), 0.0)
    return replace(traversal, beyond=beyond)


def _known(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations whose joints are known, (S,)."""
    known = traversal.pose != NONE
    known[known] = np.isfinite(poses.theta[traversal.pose[known]]).all(axis=1)
    return np.asarray(known)


def chains(traversal: Traversal, station: IntArray) -> list[slice]:
    """Samples that the robot surely runs one after the other, in the order listed: each chain of them is one slice.

    Args:
        traversal: Of the program.
        station: Station of each sample, rising.
    """
    chain = np.cumsum(traversal.origin != np.arange(len(traversal.origin)) - 1)[station]
    edges = [0, *(np.flatnonzero(np.diff(chain)) + 1).tolist(), len(station)]
    return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if a < b]


def interpolate_poses(poses: Poses, traversal: Traversal, station: IntArray, fraction: Array) -> Pose:
    """The TCP's poses that a program means at fractions (M,) of the straight and circular ways to stations (M,)."""
    end = traversal.pose[station]
    start = np.where(fraction < 1, traversal.pose[traversal.origin[station]], end)
    places, axes = poses.tcp.position, poses.tcp.rotation
    position = places[end] - (1 - fraction)[:, None] * (places[end] - places[start])
    on_arc = np.flatnonzero((fraction < 1) & ~traversal.line[station] & ~traversal.joint[station])
    if len(on_arc):
        position[on_arc] = _on_arcs(places, traversal, station[on_arc], fraction[on_arc])
    rotation = axes[end]
    way = np.flatnonzero(fraction < 1)
    rotation[way] = interpolate_rotation(axes[start[way]], axes[end[way]], fraction[way])
    return Pose(frozen(position), frozen(rotation))


def _on_arcs(places: Array, traversal: Traversal, station: IntArray, fraction: Array) -> Array:
    """Places (M, 3) [m] on arcs, at fractions (M,) of the way to the via or from there to the end, stations (M,)."""
    second = ~traversal.via[station]
    via = station - second
    arcs = arcs_through(*(places[traversal.pose[s]] for s in (traversal.origin[via], via, via + 1)))
    begin = np.where(second, arcs.angle[:, 0], 0.0)
    end = np.where(second, arcs.angle[:, 1], arcs.angle[:, 0])
    return np.asarray(arcs.at((begin + fraction * (end - begin))[:, None])[:, 0])


def commanded_joints(
    robot: Robot,
    poses: Poses,
    traversal: Traversal,
    station: IntArray,
    fraction: Array,
    tcp: Pose,
) -> tuple[Array, Pose]:
    """Joints (M, 6) [rad] that the controller commands for M poses on the way, and the flange there."""
    pose = traversal.pose[station]
    theta = poses.theta[pose]
    position, rotation = np.empty((len(station), 3)), np.empty((len(station), 3, 3))
    kinds = np.column_stack([poses.tool[pose], poses.posture[pose]])
    for tool, posture in np.unique(kinds, axis=0).tolist():
        rows = np.flatnonzero((kinds == [tool, posture]).all(axis=1))
        flange, way = flange_from_tool(tcp[rows], poses.tools[tool]), fraction[rows] < 1
        position[rows], rotation[rows] = flange.position, flange.rotation
        solved = solve_flange(robot, flange[way], ALL_POSTURES[posture]).theta
        theta[rows[way]] = nearest_turns(solved, theta[rows[way]])
    return theta, Pose(frozen(position), frozen(rotation))
