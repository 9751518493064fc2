"""What the positions of any program mean: pose, joints, posture. Group 1 only.

    T_world_tcp = T_uframe T_position         T_world_flange = T_world_tcp T_utool^-1

A Cartesian position takes its joints from its CONFIG, a joint-form position its pose from its joints. What cannot be
known (not taught, frame not known, CONFIG without a posture, out of reach, a step of INC) is NaN. A position that
motions place in several ways (``placements``: an offset, a frame written at run time) has a row for each of them.

World is the arm's own. Where an extended axis carries the arm (``ArmBases``), it is elsewhere in the cell, and user
frames are told in it: T_uframe = T_base^-1 T_cell_uframe.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.pose import IDENTITY, Pose
from compgen.core.units import DEG
from compgen.fanuc.analysis.placements import Placements, placed_poses
from compgen.fanuc.analysis.register_flow import Numbers
from compgen.fanuc.listing.listing import LsProgram
from compgen.fanuc.listing.position_parser import AXES, J1, NO_NUMBER
from compgen.fanuc.listing.positions import position_rows, units
from compgen.fanuc.motion_options import is_step
from compgen.program.driven import NONE, Positions
from compgen.program.extended_axes import NAMES, ExtendedAxis
from compgen.program.frames import Frames
from compgen.program.pose_table import pose_of
from compgen.robot.configuration import apply_turns, parse_config, posture_indices
from compgen.robot.inverse_kinematics import ALL_POSTURES, solve_tools
from compgen.robot.kinematics import flange_pose
from compgen.robot.robot import Robot

AS_LISTED = Placements()
E1 = AXES.index("E1")


@dataclass(frozen=True, eq=False, slots=True)
class ArmBases:
    """The arm's World in the cell's, for K positions."""

    base: IntArray  # (K,) in ``poses``, NO_NUMBER where it is not known
    poses: Pose  # one a row; the first: no axis carries the arm
    axes: Array  # (K, 3) values of E1 to E3 [mm] or [deg], NaN for none
    reason: tuple[str, ...]  # why some are not known
    which: IntArray  # (K,) in ``reason``, NO_NUMBER where it is known


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Poses(Positions):
    """K rows, one for group 1 of each position, P[n] of which n is the number."""

    row: IntArray  # (K,) in the program's table of positions
    line: IntArray  # (K,)
    joint_form: BoolArray  # (K,)
    base: IntArray  # (K,) in ``bases``, NONE when not known
    bases: Pose  # user frames in the arm's World; the last is World itself
    placement: IntArray  # (K,) in ``placements.table``
    placements: Placements
    placed: Mapping[tuple[int, int], int]  # row of a position's number and a placement that is not plain
    arm_bases: ArmBases  # the arm's World in the cell's
    step: BoolArray  # (K,) motions with INC add its numbers to where the robot stands: they are never changed

    @property
    def extended(self) -> BoolArray:
        """Positions of which extended axes leave unknown where the arm stands, (K,)."""
        return np.asarray(self.arm_bases.which != NONE)

    def in_cell(self, rows: IntArray) -> Array:
        """TCP in the cell's World, (n, 3) [m]: the arm's own unless an extended axis carries it."""
        return self.arm_bases.poses[np.maximum(self.arm_bases.base[rows], 0)].act(self.tcp.position[rows])


def program_poses(program: LsProgram, robot: Robot | None, frames: Frames, placements: Placements = AS_LISTED) -> Poses:
    """Poses and joints of all positions, as far as they can be known.

    Args:
        program: Any program.
        robot: Whose joints; its controller says which joints CONFIG's digits count. Without one no joint is known, and
            no place of a position in joint form.
        frames: What UF and UT numbers mean; a number that is not in it leaves the position unknown.
        placements: How motions place positions.
    """
    p = program.positions
    row, placement, placed = _rows(program, placements)
    K = len(row)
    step, only_step = _steps(program, row)
    value = np.where(only_step[:, None], np.nan, p.value[row])
    joint_form = p.joint_form[row]
    joints = value[:, J1 : J1 + 6] * DEG
    arm_bases = read_arm_bases(program, row, frames.extended)
    tool, known_tools = _numbered(p.utool[row], frames.utool, placement, [t.utool for t in placements.table])
    frames_of_cell = _numbered(p.uframe[row], frames.uframe, placement, [t.uframe for t in placements.table])
    base, frames_of_arm = _in_arm(*frames_of_cell, arm_bases)
    tools, bases = Pose.stack([*known_tools, IDENTITY]), Pose.stack([*frames_of_arm, IDENTITY])
    position, rotation = np.full((K, 3), np.nan), np.full((K, 3, 3), np.nan)
    theta, margin, posture = np.full((K, 6), np.nan), np.full(K, np.nan), np.full(K, NONE)

    taught = np.flatnonzero(joint_form & np.isfinite(joints).all(axis=1))
    if len(taught) and robot is not None:
        theta[taught] = robot.to_theta(joints[taught])
        tcp = flange_pose(robot, theta[taught]) @ tools[tool[taught]]
        position[taught], rotation[taught] = tcp.position, tcp.rotation
        posture[taught] = posture_indices(robot, theta[taught])

    given = np.isfinite(value[:, :6]).all(axis=1) & (tool != NONE) & (base != NONE) & ~joint_form & ~p.remote[row]
    cartesian = np.flatnonzero(given)
    if len(cartesian):
        tcp = placed_poses(value[cartesian, :6], bases[base[cartesian]], placements.table, placement[cartesian])
        position[cartesian], rotation[cartesian] = tcp.position, tcp.rotation
        posture[cartesian], turns = _configs([p.config[i] or "" for i in row[cartesian]])
        named = posture[cartesian] != NONE
        rows = cartesian[named]
        if robot is not None:
            solved = solve_tools(robot, tcp[named], tools, tool[rows], posture[rows])
            turned = apply_turns(robot, solved.theta, turns[named])
            theta[rows], margin[rows] = np.where(solved.margin[:, None] >= 0, turned, np.nan), solved.margin
    _, begins, same = np.unique(row, return_index=True, return_inverse=True)
    return Poses(
        row=row,
        number=p.number[row],
        line=p.line[row],
        tcp=Pose(position, rotation),
        theta=theta,
        margin=margin,
        posture=posture,
        joint_form=joint_form,
        tool=tool,
        tools=tools,
        base=base,
        bases=bases,
        placement=placement,
        placements=placements,
        placed=placed,
        first=begins[same.ravel()],
        arm_bases=arm_bases,
        step=step,
    )


def _rows(program: LsProgram, placements: Placements) -> tuple[IntArray, IntArray, dict[tuple[int, int], int]]:
    """Rows of the program's table: one for each way in which motions place a position, a plain one where none does."""
    p, m = program.positions, program.motions
    row = p.first_group
    plain = np.zeros(len(row), dtype=np.int64)
    if not placements.of_motion:
        return row, plain, {}
    row_of = p.row_of()
    ways: dict[int, set[int]] = {}
    for i in np.flatnonzero(~m.disabled).tolist():
        for n in m.position[i]:
            if n in row_of:
                ways.setdefault(n, set()).add(placements.of_motion.get(i, 0))
    pairs = [(row_of[n], t, n) for n in p.number[row].tolist() for t in sorted(ways.get(n, {0}))]
    placed = {(n, t): k for k, (_, t, n) in enumerate(pairs) if t}
    return np.array([r for r, _, _ in pairs]), np.array([t for _, t, _ in pairs]), placed


def step_motions(program: LsProgram) -> BoolArray:
    """Motions that are on and take the numbers of their positions for a step (INC), (M,)."""
    m = program.motions
    step = {options: bool(options) and is_step(options) for options in set(m.options)}
    return np.array([step[options] for options in m.options], dtype=bool) & ~m.disabled


def _steps(program: LsProgram, row: IntArray) -> tuple[BoolArray, BoolArray]:
    """Positions, rows of the program's table, that motions with INC drive by, and those that no other does, (K,)."""
    m, step = program.motions, step_motions(program)
    named: dict[bool, set[int]] = {True: set(), False: set()}
    for i in np.flatnonzero(~m.disabled).tolist():
        named[bool(step[i])].update(m.position[i])
    by_steps, by_others = (np.isin(program.positions.number[row], list(named[inc])) for inc in (True, False))
    return by_steps, by_steps & ~by_others


def _numbered(
    number: IntArray,
    known: Mapping[int, Pose],
    placement: IntArray,
    written: Sequence[Iterable[tuple[int, Numbers]]],
) -> tuple[IntArray, tuple[Pose, ...]]:
    """Which entry of a table each number is, NONE where it is not known, and the table.

    Args:
        number: Of frames, or of tools, (K,).
        known: What they mean.
        placement: That of each position, (K,).
        written: What each placement has written at run time, by number.
    """
    names = sorted(known)
    which = position_rows(number, np.array(names))
    more: dict[Numbers, int] = {}
    for t, numbers in enumerate(written):
        for n, values in numbers:
            which[(placement == t) & (number == n)] = more.setdefault(values, len(names) + len(more))
    return which, (*(known[n] for n in names), *map(pose_of, more))


def _in_arm(which: IntArray, table: tuple[Pose, ...], arm_bases: ArmBases) -> tuple[IntArray, tuple[Pose, ...]]:
    """User frames in the arm's World, wherever it stands; where that is not known, as if no axis carried it."""
    if len(arm_bases.poses) == 1:
        return which, table
    pairs, at = np.unique(np.column_stack([which, np.maximum(arm_bases.base, 0)]), axis=0, return_inverse=True)
    frames = [
        arm_bases.poses[base].inverse() @ table[frame] if frame != NONE else IDENTITY for frame, base in pairs.tolist()
    ]
    return np.where(which != NONE, at.ravel(), NONE), tuple(frames)


def require_frames(program: LsProgram, poses: Poses) -> None:
    """Raises InputError at the first Cartesian position whose frame or tool is not known; names the line."""
    p, row = program.positions, poses.row
    cartesian = (p.span[row, :6, 1] > 0).any(axis=1) & ~p.remote[row]
    for kind, numbers, known in (("uframe", p.uframe[row], poses.base), ("utool", p.utool[row], poses.tool)):
        missing = np.flatnonzero(cartesian & (numbers >= 0) & (known == NONE))
        if len(missing):
            k = int(missing[0])
            number = numbers[k]
            raise InputError(
                f"program {program.name}: line {poses.line[k]}: P[{poses.number[k]}] is in {kind} {number}, whose "
                f"value is not known; give [{kind}.{number}] in a table with --frames, or SYSFRAME.VA of a backup"
            )


def untold_tools(program: LsProgram, poses: Poses, some: BoolArray) -> list[int]:
    """Numbers of tools that are not known, of some positions (K,): those in joint form are placed at the flange."""
    return sorted({*program.positions.utool[poses.row[some & (poses.tool == NONE)]].tolist()} - {NO_NUMBER})


def _configs(texts: list[str]) -> tuple[IntArray, IntArray]:
    """Postures that CONFIGs name, (n,) in ``ALL_POSTURES``, NONE for no posture; and turns, (n, 3)."""
    index = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    which = [index[text] for text in texts]
    named, turns = zip(*map(parse_config, index), strict=True)
    postures = [NONE if posture is None else ALL_POSTURES.index(posture) for posture in named]
    return np.array(postures)[which], np.array(turns)[which]


def read_arm_bases(program: LsProgram, row: IntArray, extended: Mapping[str, ExtendedAxis]) -> ArmBases:
    """Where the arm stands at positions.

    Args:
        program: Any program.
        row: Positions, rows of the program's table, (K,).
        extended: What extended axes carry, by name.
    """
    written = program.positions.span[row, E1:, 1] > 0
    axes = np.where(written, program.positions.value[row, E1:], np.nan)
    base, which = np.zeros(len(row), dtype=np.int64), np.full(len(row), NO_NUMBER)
    carried = any(axis.kind == "rail" for axis in extended.values())
    if not written.any():
        return ArmBases(base, Pose.stack([IDENTITY]), axes, (), which)
    unit = units(program.data, program.positions.span[row, E1:])
    concerned = np.flatnonzero(written.any(axis=1) | carried)
    places: dict[int, int] = {}  # of each base told
    table = [IDENTITY]
    reasons: dict[str, int] = {}
    for k in concerned.tolist():
        reason = ""
        for name, has, value, u in zip(NAMES, written[k].tolist(), axes[k].tolist(), unit[k].tolist(), strict=True):
            axis = extended.get(name)
            if axis is None:
                reason = reason or (_unknown(name) if has else "")
            elif axis.kind == "rail":
                pose = axis.base_at(value, u) if has else None
                if pose is None:
                    reason = reason or _no_base(name, axis, value, u, has=has)
                else:
                    if id(pose) not in places:
                        places[id(pose)] = len(table)
                        table.append(pose)
                    base[k] = places[id(pose)]
        if reason:
            base[k], which[k] = NO_NUMBER, reasons.setdefault(reason, len(reasons))
    return ArmBases(base, Pose.stack(table), axes, tuple(reasons), which)


def _unknown(name: str) -> str:
    return f"extended axis {name} moves the base or the part: say which with [extended.{name}] in --frames"


def _no_base(name: str, axis: ExtendedAxis, value: float, unit: str, *, has: bool) -> str:
    if not has:
        return f"the arm stands on extended axis {name}, and the position does not say where"
    if np.isnan(value):
        return f"extended axis {name} is not taught (****)"
    axis_value = f"{value:g} {unit or '(no unit)'}"
    return (
        f"the arm stands on extended axis {name} at {axis_value}, where its base is not told: "
        f"give [[extended.{name}.base]] with at_{axis.unit} in --frames"
    )
