"""Corrected poses as bytes of a program: with its own decimals and way of writing zeros, nothing else touched."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.pose import Pose
from compgen.core.rotations import from_wpr, rotation_vector, to_wpr
from compgen.core.units import DEG
from compgen.fanuc.analysis import watermark
from compgen.fanuc.analysis.placements import placed_numbers, placed_poses
from compgen.fanuc.analysis.poses import Poses
from compgen.fanuc.analysis.watermark import decimals_of
from compgen.fanuc.listing.listing import LsProgram
from compgen.program.driven import NONE
from compgen.robot.configuration import CONFIG, turn_digits
from compgen.robot.joint_path import nearest_turns
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

Edits = dict[tuple[int, int], bytes]
#: [m] how much an angle counts against a distance when joints are rounded; where the tool is not known
TCP_LEVER, FLANGE_LEVER = 0.01, 0.2
AT_LIMIT = 6  # steps of the digits, of two joints that are limited together: so near to it a neighbour may be beyond
SAME_ANGLE = 1e-9  # [rad]
_BLOCK = 16
_NEIGHBOURS = np.array([0.0, -1, 1, -2, 2])[np.ascontiguousarray(np.indices(6 * (5,)).reshape(6, -1).T)]


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class NewPoses:
    """What n positions of a program shall say."""

    rows: IntArray  # (n,) of the program's poses
    tcp: Pose  # in World
    theta: Array  # (n, 6) [rad] joints there
    nudge: IntArray  # (n, 3) units of the last digit to add to W, P and R; see ``watermark``
    marked: BoolArray  # (n,) joint-form positions that shall carry the mark


def number_edits(program: LsProgram, poses: Poses, robot: Robot, new: NewPoses) -> Edits:
    """Edits that make positions say other poses.

    Args:
        program: As read.
        poses: Those of its positions.
        robot: For the digits of CONFIG.
        new: What they shall say.

    Returns:
        Span to new text; only where the text differs from what stands there.
    """
    rows, tcp, theta = new.rows, new.tcp, new.theta
    omit_zero = any(
        program.data[a : a + 2].lstrip(b"+-")[:1] == b"."
        for a in program.positions.span[poses.row[:200]][:, :12, 0].ravel().tolist()
        if a
    )
    edits: Edits = {}
    cartesian = np.flatnonzero(~poses.joint_form[rows])
    numbers, span = np.empty((len(rows), 6)), program.positions.span[program.positions.six_of(poses.row[rows])]
    if len(cartesian):
        k = rows[cartesian]
        numbers[cartesian] = numbers_at(poses, k, tcp[cartesian], program.positions.value[poses.row[k], 3:6])
    joint = np.flatnonzero(poses.joint_form[rows])
    if len(joint):
        step = np.asarray(10.0 ** -decimals_of(program, poses.row[rows[joint]]), dtype=float)
        pendant, tools = robot.to_pendant(theta[joint]) / DEG, poses.tools[poses.tool[rows[joint]]]
        lever = np.where(poses.tool[rows[joint]] == NONE, FLANGE_LEVER, TCP_LEVER)
        numbers[joint] = round_joints(robot, pendant, step, tools.position, lever, new.marked[joint])
    rounded = numbers.copy()
    for n, k in enumerate(rows.tolist()):
        for i, (start, end) in enumerate(span[n].tolist()):
            old_text = program.data[start:end]
            extra_units = int(new.nudge[n, i - 3]) if i >= 3 else 0
            is_angle = i >= 3 and not poses.joint_form[k]
            text = format_like(
                old_text, float(numbers[n, i]), omit_zero=omit_zero, is_angle=is_angle, extra_units=extra_units
            )
            rounded[n, i] = float(text)
            if text != old_text:
                edits[start, end] = text
    if len(cartesian):
        edits.update(_config_edits(program, poses, robot, rows[cartesian], rounded[cartesian], theta[cartesian]))
    return edits


def numbers_at(poses: Poses, rows: IntArray, tcp: Pose, old: Array) -> Array:
    """What Cartesian positions say at TCP poses, as their motions place them: X Y Z [mm], W P R [deg], (n, 6).

    Args:
        poses: Those of a program.
        rows: Of ``poses``, (n,).
        tcp: In the arm's World, n poses.
        old: W P R that the new ones shall be near to, (n, 3) [deg].
    """
    base = poses.bases[poses.base[rows]]
    numbers = placed_numbers(tcp, base, poses.placements.table, poses.placement[rows])
    return np.hstack([numbers.xyz, nearest_wpr(numbers.rotation, old + numbers.wpr_offset) - numbers.wpr_offset])


def round_joints(robot: Robot, pendant: Array, step: Array, tcp: Array, lever: Array, marked: BoolArray) -> Array:
    r"""Pendant angles on the grid of a program's digits that leave the tool nearest to the wanted pose.

    Rounding each joint for itself moves the tool by up to 26 um. Of the 5^6 neighbours of the nearest grid point the
    one is taken that minimises, to first order, \\|dp\\|^2 + lever^2 \\|dw\\|^2, of those within the joints' limits.

    Args:
        robot: Nominal arm.
        pendant: Wanted angles, (n, 6) [deg].
        step: Spacing of the grid, (n, 6) [deg].
        tcp: Tool centre point in the flange, (n, 3) [m].
        lever: How much an angle counts against a distance, (n,) [m].
        marked: Only neighbours that carry the mark are taken, (n,).

    Returns:
        Angles on the grid, (n, 6) [deg].
    """
    rounded = np.empty_like(pendant)
    for first in range(0, len(pendant), _BLOCK):
        rows = slice(first, first + _BLOCK)
        wanted, grid = pendant[rows], step[rows]
        jacobian = _jacobian(robot, wanted, tcp[rows], lever[rows])
        units = np.rint(wanted / grid)[:, None, :] + _NEIGHBOURS
        move = np.einsum("nij,nkj->nki", jacobian, units * grid[:, None, :] - wanted[:, None, :])
        cost = (move**2).sum(axis=2)
        theta = robot.to_theta(wanted * DEG)
        room = np.minimum(theta - robot.lower, robot.upper - theta).min(axis=1)
        for n in np.flatnonzero(room < AT_LIMIT * grid.max(axis=1) * DEG).tolist():
            there = robot.to_theta(units[n] * grid[n] * DEG)
            cost[n] += ((there < robot.lower - SAME_ANGLE) | (there > robot.upper + SAME_ANGLE)).any(axis=1)
        for n in np.flatnonzero(marked[rows]).tolist():
            cost[n, watermark.joint_remainder(units[n].astype(np.int64)) != 0] = np.inf
        best = np.argmin(cost, axis=1)
        rounded[rows] = np.take_along_axis(units, best[:, None, None], axis=1)[:, 0] * grid
    return rounded


def _jacobian(robot: Robot, pendant: Array, tcp: Array, lever: Array) -> Array:
    """Movement of the tool for each pendant angle, (n, 6, 6): [m/deg], and lever [m] times [rad/deg]."""
    step = 0.01  # [deg]

    columns = []
    for i in range(6):
        shift = np.eye(6)[i] * step
        before, after = (flange_pose(robot, robot.to_theta(q * DEG)) for q in (pendant - shift, pendant + shift))
        turn = rotation_vector((before.inverse() @ after).rotation)
        columns.append(np.hstack([after.act(tcp) - before.act(tcp), lever[:, None] * turn]) / (2 * step))
    return np.stack(columns, axis=2)


def format_like(old: bytes, value: float, *, omit_zero: bool, is_angle: bool = False, extra_units: int = 0) -> bytes:
    """A number as the program writes its own: decimals of the old one, ``.5`` or ``0.5``; the old text when equal.

    Args:
        old: Text to be replaced.
        value: [mm] or [deg].
        omit_zero: The program leaves out the zero before the point.
        is_angle: Whole turns make no difference: kept within 180 deg where the old one is.
        extra_units: Units of the last digit to add.
    """
    body = old.lstrip(b"+-")
    decimals = len(body.partition(b".")[2])
    scale = 10**decimals
    units = round(value * scale) + extra_units
    old_units = round(float(old) * scale)
    turn = 360 * scale if is_angle else 0
    if turn and abs(old_units) * 2 <= turn and abs(units) * 2 > turn:
        units -= turn if units > 0 else -turn
    if units == old_units or (turn and (units - old_units) % turn == 0):
        return old
    whole, remainder = divmod(abs(units), scale)
    fraction = f".{remainder:0{decimals}d}" if decimals else ("." if b"." in body else "")
    integer = "" if omit_zero and whole == 0 and decimals and units else str(whole)
    sign = "-" if units < 0 else ("+" if old[:1] == b"+" else "")
    return f"{sign}{integer}{fraction}".encode("ascii")


def nearest_wpr(rotation: Array, old: Array) -> Array:
    """W, P, R [deg] of rotations: of all equivalent triples the nearest to the old ones, (n, 3).

    (W, P, R) and (W + 180, 180 - P, R + 180) turn alike, and so does each with whole turns more. Near P = 90 deg, where
    only W -/+ R is fixed, R stays and W takes the change.
    """
    w, p, r = (angle / DEG for angle in to_wpr(rotation))
    first = np.column_stack([w, p, r])
    second = np.column_stack([w + 180, 180 - p, r + 180])
    first, second = (old + (c - old + 180) % 360 - 180 for c in (first, second))
    best = np.where((np.abs(second - old).max(axis=1) < np.abs(first - old).max(axis=1))[:, None], second, first)
    steep = np.abs(np.cos(old[:, 1] * DEG)) < 1e-4
    for k in np.flatnonzero(steep).tolist():
        tilt = from_wpr(*(np.array([a]) for a in (0.0, best[k, 1] * DEG, old[k, 2] * DEG)))[0]
        about_x = tilt.T @ rotation[k]  # Rx(W)
        angle = np.arctan2(about_x[2, 1] - about_x[1, 2], about_x[1, 1] + about_x[2, 2]) / DEG
        best[k] = [old[k, 0] + (angle - old[k, 0] + 180) % 360 - 180, best[k, 1], old[k, 2]]
    return np.asarray(best)


def _config_edits(
    program: LsProgram, poses: Poses, robot: Robot, rows: IntArray, numbers: Array, theta: Array
) -> Edits:
    """Edits of CONFIG's turn digits for the joints of the poses as printed, continuous with the planned ones."""
    edits: Edits = {}
    base = poses.bases[poses.base[rows]]
    tcp = placed_poses(numbers, base, poses.placements.table, poses.placement[rows])
    digits = turn_digits(robot, nearest_turns(poses.solve(robot, tcp, rows).theta, theta)).tolist()
    for i, wanted in zip(poses.row[rows].tolist(), digits, strict=True):
        text = program.positions.config[i] or ""
        config = CONFIG.match(text)
        if config and [int(t or 0) for t in config.groups()[3:]] != wanted and config[4] is not None:
            start = int(program.positions.config_span[i, 0])
            for column, digit in zip((4, 5, 6), wanted, strict=False):
                if int(config[column]) != digit:
                    edits[start + config.start(column), start + config.end(column)] = str(digit).encode("ascii")
    return edits
