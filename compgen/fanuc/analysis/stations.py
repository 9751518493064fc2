"""Stations of a program, points on the straight lines between them, and the joints there."""

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import interpolate_rotation
from compgen.fanuc.analysis.poses import NONE, Poses
from compgen.fanuc.analysis.traversal import Traversal
from compgen.robot.inverse_kinematics import ALL_POSTURES, flange_from_tool, solve_flange
from compgen.robot.joint_path import nearest_turns
from compgen.robot.robot import Robot


def path_samples(poses: Poses, traversal: Traversal, inside: Array) -> tuple[IntArray, Array]:
    """Stations and fractions of the straight ways to them, in order of time."""
    known, lines = _known(poses, traversal), straight_lines(poses, traversal)
    station = np.concatenate([np.flatnonzero(known), *(np.flatnonzero(lines) for _ in inside)])
    fraction = np.concatenate([np.ones(int(known.sum())), *(np.full(int(lines.sum()), f) for f in inside)])
    order = np.lexsort((fraction, station))
    return station[order], fraction[order]


def straight_lines(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations reached by a straight line whose both ends are known, with one tool and one posture, (S,)."""
    lines, known = traversal.line.copy(), _known(poses, traversal)
    if not known.any():
        return known
    tool, posture = poses.tool[traversal.pose], poses.posture[traversal.pose]
    lines &= known
    lines[1:] &= known[:-1] & (tool[1:] == tool[:-1]) & (posture[1:] == posture[:-1])
    lines[:1] = False
    return np.asarray(lines)


def _known(poses: Poses, traversal: Traversal) -> BoolArray:
    """Stations whose joints are known, (S,)."""
    known = traversal.pose != NONE
    known[known] = np.isfinite(poses.theta[traversal.pose[known]]).all(axis=1)
    return np.asarray(known)


def interpolate_poses(poses: Poses, traversal: Traversal, station: IntArray, fraction: Array) -> tuple[Array, Array]:
    """Poses that a program means at fractions of the straight ways to stations, (M, 3) [m] and (M, 3, 3)."""
    end = traversal.pose[station]
    start = np.where(fraction < 1, traversal.pose[np.maximum(station - 1, 0)], end)
    step = poses.position[end] - poses.position[start]
    position = poses.position[end] - (1 - fraction)[:, None] * step
    rotation = poses.rotation[end].copy()
    way = np.flatnonzero(fraction < 1)
    rotation[way] = interpolate_rotation(poses.rotation[start[way]], poses.rotation[end[way]], fraction[way])
    return position, rotation


def commanded_joints(
    robot: Robot,
    poses: Poses,
    traversal: Traversal,
    station: IntArray,
    fraction: Array,
    position: Array,
    rotation: Array,
) -> tuple[Array, tuple[Array, Array]]:
    """Joints (M, 6) [rad] that the controller commands at poses on the way, and the flange there."""
    pose = traversal.pose[station]
    theta = poses.theta[pose].copy()
    flange = np.empty((len(station), 3)), np.empty((len(station), 3, 3))
    kinds = np.column_stack([poses.tool[pose], poses.posture[pose]])
    for tool, posture in np.unique(kinds, axis=0).tolist():
        rows = np.flatnonzero((kinds == [tool, posture]).all(axis=1))
        flange[0][rows], flange[1][rows] = flange_from_tool(position[rows], rotation[rows], *poses.tool_of(tool))
        way = rows[fraction[rows] < 1]
        solved, _ = solve_flange(robot, flange[0][way], flange[1][way], ALL_POSTURES[posture])
        theta[way] = nearest_turns(solved, theta[way])
    return theta, flange
