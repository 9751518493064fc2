r"""Straight and circular ways that pass a singularity between their ends: J5 at zero, the J1 axis, the stretched arm.

On such a way joints turn round for a small move of the tool, and which way round hangs on micrometres: corrected, it
may be another one than planned. Where a way's step and turn move the wrist centre by at most h from the nearer end, and
both ends are r from the J1 axis and m from full stretch or fold, the forearm turns by less than 1.5 h (1 / r + 3 / m):
only ways that this leaves open are sampled.
"""

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.rotations import rotation_vector
from compgen.core.units import DEG, MM
from compgen.program.driven import DrivenProgram
from compgen.program.ways import between_known_ends, interpolate_poses, known_arcs
from compgen.robot.inverse_kinematics import ALL_POSTURES, flange_from_tool, solve_flange
from compgen.robot.joint_path import wrist_centre
from compgen.robot.robot import Robot

SUBDIVISIONS = 256
BLOCK = 250  # ways sampled at a time


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
        nearest = _nearest(robot, driven, ways[some])
        dips = (nearest < allowed) & (nearest < at_ends[some])
        dips &= nearest[:, 1:2] >= 0  # that a way leaves the reach is told elsewhere
        rows = np.flatnonzero(dips.any(axis=1)).tolist()
        passed += [(int(ways[some][k]), _words(nearest[k], dips[k])) for k in rows]
    return passed


def _distances(robot: Robot, theta: Array, margin: Array) -> Array:
    """From the J1 axis [m], from full stretch or fold [m], of J5 from zero [rad], (N, 3)."""
    wrist = np.abs(theta[:, 4] - robot.pendant_zero[4])
    return np.column_stack([np.abs(wrist_centre(robot, theta)[:, 0]), np.nan_to_num(margin, nan=np.inf), wrist])


def _may_pass(robot: Robot, driven: DrivenProgram, ways: IntArray, at_ends: Array, allowed: Array) -> BoolArray:
    """Ways that may come nearer to a singularity than is allowed, (n,)."""
    start, end = driven.pose[driven.origin[ways]], driven.pose[ways]
    lever = np.linalg.norm(driven.at.tools.position, axis=1)[driven.at.tool[end]] + abs(float(robot.d[5]))
    step = np.linalg.norm(driven.at.tcp.position[end] - driven.at.tcp.position[start], axis=1)
    step = np.where(driven.line[ways], step, driven.length[ways])
    turn = np.linalg.norm(rotation_vector((driven.at.tcp[start].inverse() @ driven.at.tcp[end]).rotation), axis=1)
    moved = (step + turn * lever) / 2
    shoulder, elbow, wrist = at_ends.T
    with np.errstate(divide="ignore"):
        swing = turn / 2 + 1.5 * moved * (1 / shoulder + 3 / np.maximum(elbow, 0.0))
    clear = (moved < 0.2 * np.minimum(shoulder, elbow)) & (wrist - allowed[2] > swing)
    return np.asarray(~(clear & (shoulder - allowed[0] > moved) & (elbow - allowed[1] > moved)))


def _nearest(robot: Robot, driven: DrivenProgram, ways: IntArray) -> Array:
    """The least distances between the ends of ways, (n, 3)."""
    inside = np.arange(1, SUBDIVISIONS) / SUBDIVISIONS
    station, fraction = np.repeat(ways, len(inside)), np.tile(inside, len(ways))
    tcp, pose = interpolate_poses(driven, station, fraction), driven.pose[station]
    distances = np.empty((len(station), 3))
    for tool, posture in np.unique(np.column_stack([driven.at.tool, driven.at.posture])[pose], axis=0).tolist():
        rows = np.flatnonzero((driven.at.tool[pose] == tool) & (driven.at.posture[pose] == posture))
        theta, margin = solve_flange(robot, flange_from_tool(tcp[rows], driven.at.tools[tool]), ALL_POSTURES[posture])
        distances[rows] = _distances(robot, theta, margin)
    return np.asarray(distances.reshape(len(ways), -1, 3).min(axis=1))


def _words(nearest: Array, dips: BoolArray) -> str:
    shoulder, elbow, wrist = nearest
    words = (
        f"the J1 axis by {shoulder / MM:.2f} mm", f"full stretch or fold by {elbow / MM:.2f} mm",
        f"J5 = 0 by {wrist / DEG:.3f} deg",
    )  # fmt: skip
    return " and ".join(text for text, dip in zip(words, dips, strict=True) if dip)
