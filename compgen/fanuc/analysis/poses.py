"""What the positions of any program mean: pose in World, joints, posture. Group 1 only.

    T_world_tcp = T_uframe T_position         T_world_flange = T_world_tcp T_utool^-1

A Cartesian position takes its joints from its CONFIG, a joint-form position its pose from its joints. What cannot be
known (not taught, frame not known, CONFIG without a posture, out of reach) is NaN.
"""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.rotations import from_wpr
from compgen.core.units import DEG, MM
from compgen.fanuc.configuration import apply_turns, parse_config, posture_indices
from compgen.fanuc.frames import Frames, Pose
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES
from compgen.robot.inverse_kinematics import ALL_POSTURES, Posture, flange_from_tool, solve_flange
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

NONE = -1
J1, E1 = AXES.index("J1"), AXES.index("E1")


@dataclass(frozen=True, eq=False, slots=True)
class Poses:
    """K rows, one for group 1 of each position."""

    row: IntArray  # (K,) in the program's table of positions
    number: IntArray  # (K,) n of P[n]
    line: IntArray  # (K,)
    position: Array  # (K, 3) [m] TCP in World
    rotation: Array  # (K, 3, 3)
    theta: Array  # (K, 6) [rad]
    margin: Array  # (K,) [m] inside reach; NaN in joint form
    posture: IntArray  # (K,) in ``ALL_POSTURES``, NONE when not known
    joint_form: BoolArray  # (K,)
    extended: BoolArray  # (K,) has E1, E2 or E3
    tool: IntArray  # (K,) in ``tools``
    tools: tuple[Pose, ...]
    base: IntArray  # (K,) in ``bases``
    bases: tuple[Pose, ...]

    def tool_of(self, tool: int) -> Pose:
        """The TCP in the flange; the flange itself for a joint-form position whose tool is not known."""
        return self.tools[tool] if tool != NONE else (np.zeros(3), np.eye(3))


def read_poses(program: LsProgram, robot: Robot, frames: Frames) -> Poses:
    """Poses and joints of all positions, as far as they can be known.

    Args:
        program: Any program.
        robot: Whose joints; its controller says which joints CONFIG's digits count.
        frames: What UF and UT numbers mean; a number that is not in it leaves the position unknown.
    """
    p = program.positions
    row = np.flatnonzero(p.group <= 1)
    K = len(row)
    value = p.value[row]
    joint_form = p.span[row, J1, 1] > 0
    joints = value[:, J1 : J1 + 6] * DEG
    tool, tools = _numbered(p.utool[row], frames.utool)
    base, bases = _numbered(p.uframe[row], frames.uframe)
    position, rotation = np.full((K, 3), np.nan), np.full((K, 3, 3), np.nan)
    theta, margin, posture = np.full((K, 6), np.nan), np.full(K, np.nan), np.full(K, NONE)

    taught = np.flatnonzero(joint_form & np.isfinite(joints).all(axis=1))
    if len(taught):
        theta[taught] = robot.to_theta(joints[taught])
        flange = flange_pose(robot, theta[taught])
        tcp, turn = _stacked(tool[taught], tools)
        position[taught] = flange[0] + np.einsum("nij,nj->ni", flange[1], tcp)
        rotation[taught] = flange[1] @ turn
        posture[taught] = posture_indices(robot, theta[taught])

    given = np.isfinite(value[:, :6]).all(axis=1) & (tool != NONE) & (base != NONE) & ~joint_form & ~p.remote[row]
    cartesian = np.flatnonzero(given)
    if len(cartesian):
        origin, axes = _stacked(base[cartesian], bases)
        position[cartesian] = origin + np.einsum("nij,nj->ni", axes, value[cartesian, :3] * MM)
        rotation[cartesian] = axes @ from_wpr(*(value[cartesian, 3:6] * DEG).T)
        configs, which = _configs([p.config[i] or "" for i in row[cartesian]])
        for k, (named, turns) in enumerate(configs):
            rows = cartesian[which == k]
            if named is None:
                continue
            posture[rows] = ALL_POSTURES.index(named)
            for t in np.unique(tool[rows]):
                some = rows[tool[rows] == t]
                flange = flange_from_tool(position[some], rotation[some], *tools[t])
                solved, reach = solve_flange(robot, *flange, named)
                turned = apply_turns(robot, solved, np.tile(turns, (len(some), 1)))
                theta[some] = np.where(reach[:, None] >= 0, turned, np.nan)
                margin[some] = reach
    extended = np.asarray((p.span[row, E1:, 1] > 0).any(axis=1))
    return Poses(
        row, p.number[row], p.line[row], position, rotation, theta, margin, posture, joint_form, extended,
        tool, tools, base, bases,
    )  # fmt: skip


def require_frames(program: LsProgram, frames: Frames) -> None:
    """Raises InputError at the first Cartesian position whose frame or tool the table does not have; names the line."""
    p = program.positions
    cartesian = (p.group <= 1) & (p.span[:, :6, 1] > 0).any(axis=1) & ~p.remote
    for kind, numbers, known in (("uframe", p.uframe, frames.uframe), ("utool", p.utool, frames.utool)):
        missing = cartesian & (numbers >= 0) & ~np.isin(numbers, list(known))
        if missing.any():
            i = int(np.flatnonzero(missing)[0])
            raise InputError(
                f"program {program.name}: line {p.line[i]}: P[{p.number[i]}] is in {kind} {numbers[i]}, whose value is "
                f"not known; give [{kind}.{numbers[i]}] in a table with --frames, or SYSFRAME.VA of a backup"
            )


def _numbered(numbers: IntArray, known: dict[int, Pose]) -> tuple[IntArray, tuple[Pose, ...]]:
    """Which entry of a table each number is, and the table; NONE where it is not known."""
    names = sorted(known)
    at = np.minimum(np.searchsorted(names, numbers), len(names) - 1)
    return np.where(np.array(names)[at] == numbers, at, NONE), tuple(known[n] for n in names)


def _stacked(which: IntArray, table: tuple[Pose, ...]) -> tuple[Array, Array]:
    """Positions (N, 3) and rotations (N, 3, 3) of numbered entries; a number not known is no offset."""
    positions = np.array([*(p for p, _ in table), np.zeros(3)])
    rotations = np.array([*(r for _, r in table), np.eye(3)])
    return positions[which], rotations[which]


def _configs(texts: list[str]) -> tuple[list[tuple[Posture | None, tuple[int, ...]]], IntArray]:
    """The different CONFIGs, and which each position has."""
    index = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    return [parse_config(text) for text in index], np.array([index[text] for text in texts], dtype=np.int64)
