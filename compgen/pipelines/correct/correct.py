"""The story of one correction: read, warm up, correct, write, read again, fly, judge."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.findings import Progress
from compgen.core.rotations import rotation_matrix
from compgen.fanuc import LsProgram, edited, loads
from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.poses import J1, Poses, read_poses, require_frames
from compgen.fanuc.analysis.stations import on_the_way, straight
from compgen.fanuc.analysis.traversal import read_drive
from compgen.fanuc.editing import watermark
from compgen.fanuc.editing.insertion import insert_points, room_for_points, split_positions
from compgen.fanuc.editing.numbers import decimals_of, number_edits
from compgen.fanuc.editing.shared_positions import parting, shared, straightness
from compgen.fanuc.frames import Frames
from compgen.pipelines.correct import findings as say
from compgen.pipelines.correct.proof import fly, off
from compgen.pipelines.correct.result import Correction, CorrectionPlan, Options
from compgen.pipelines.correct.station_corrections import error_models, pointwise, solve
from compgen.pipelines.job import Cell
from compgen.thermal import Duty

NOTHING = 1e-9  # m, rad: a correction below this is none
MOST_PIECES = 1000  # of one straight line
ROUNDS = 5  # of cutting lines whose halves still stray


def correct(
    data: bytes, cell: Cell, frames: Frames, before: Sequence[Duty], options: Options, progress: Progress
) -> Correction:
    """Correct a program.

    Args:
        data: The program file.
        cell: The robot, its warmth and its errors.
        frames: What UF and UT numbers mean.
        before: What the cell did before.
        options: What may be done.
        progress: Called with the stage and the share done.

    Returns:
        The corrected program and its proof.

    Raises:
        InputError: Not a program; a frame is not known; a position is used but not defined; the program carries
            compgen's mark; with ``strict``, a statement cannot be corrected.
        TwinError: The proof cannot be made.
    """
    progress("reading", 0.0)
    planned = program = loads(data)
    plan = _plan(program, cell, frames, before, options, progress)
    if not options.again:
        _refuse_marked(plan)
    for _ in range(ROUNDS if options.insert is not None else 0):
        pieces = _pieces(plan, cell, options.insert or 1.0)
        if not (pieces > 1).any():
            break
        program = insert_points(program, plan.poses, plan.drive, pieces, cell.robot, frames)
        plan = _plan(program, cell, frames, before, options, progress)
    if options.split:
        first = int(program.positions.number.max(initial=0)) + 1
        parts = parting(plan.drive, plan.free, plan.solved.correction, first)
        if parts:
            program = split_positions(program, plan.poses, plan.drive, parts)
            plan = _plan(program, cell, frames, before, options, progress)
    return _written(planned, plan, cell, frames, before, options, progress)


def _plan(
    program: LsProgram, cell: Cell, frames: Frames, before: Sequence[Duty], options: Options, progress: Progress
) -> CorrectionPlan:
    _refuse_unfit(program)
    require_frames(program, frames)
    poses = read_poses(program, cell.robot, frames)
    drive = read_drive(program, poses, cell.robot)
    scope = read_scope(program, poses, drive, cell.robot)
    if options.strict and scope.unsafe:
        u = scope.unsafe[0]
        raise InputError(
            f"program {program.name}: line {u.line}: {u.text}: {u.reason}; {len(scope.unsafe)} in all are refused by "
            "--strict; without it they are passed through untouched"
        )
    solved = solve(cell, poses, drive, scope.free, before, options.settings, lambda s: progress("correction", s))
    free = scope.free.copy()
    free[[s for s, _ in solved.held]] = False
    return CorrectionPlan(program, poses, drive, scope, solved, free)


def _refuse_unfit(program: LsProgram) -> None:
    m, p = program.motions, program.positions
    mask = dict(program.attributes).get("DEFAULT_GROUP", "1")
    if len(m.line) and "1" not in mask:
        raise InputError(f"program {program.name}: DEFAULT_GROUP = {mask} moves no group, but the program has motions")
    defined = set(p.number.tolist())
    for i in np.flatnonzero(~m.disabled).tolist():
        for n in m.position[i]:
            if n >= 0 and n not in defined:
                raise InputError(
                    f"program {program.name}: line {m.line[i]}: P[{n}] is used but not defined; mend the program"
                )


def _refuse_marked(plan: CorrectionPlan) -> None:
    program = plan.program
    ours = next((r for r in program.remarks if r.startswith("compgen ")), None)
    planned = any(r.startswith("planned, not corrected") for r in program.remarks)
    which = _markable(plan)
    if (ours and not planned) or (
        len(which) and watermark.carries(_units(program, plan.poses, which), plan.poses.joint_form[which])
    ):
        told = f"its remark says '{ours}'" if ours else "the last digits of its positions do"
        raise InputError(
            f"program {program.name}: it carries compgen's mark ({told}): it would be corrected twice; "
            "start from the planned program, get it back with --restore, or say --again"
        )


def _markable(plan: CorrectionPlan) -> IntArray:
    """Rows of free positions in the order they are driven to, each once."""
    rows = plan.drive.pose[plan.scope.free]
    _, first = np.unique(rows, return_index=True)
    return np.asarray(rows[np.sort(first)])


def _units(program: LsProgram, poses: Poses, which: IntArray) -> IntArray:
    """Numbers of positions in units of their last digit, (n, 6)."""
    value = program.positions.value[poses.row[which]]
    value = np.where(poses.joint_form[which][:, None], value[:, J1 : J1 + 6], value[:, :6])
    return np.rint(value * 10.0 ** decimals_of(program, poses, which)).astype(np.int64)


def _pieces(plan: CorrectionPlan, cell: Cell, allowed: float) -> IntArray:
    """Into how many pieces each straight way must be cut, (S,): what it strays shrinks with the square."""
    pieces = np.ones(len(plan.free), dtype=np.int64)
    ways = _ways(plan)
    if len(ways):
        pieces[ways] = np.ceil(np.sqrt(_strays(plan, cell) / allowed)).astype(np.int64).clip(1, MOST_PIECES)
    return room_for_points(plan.program, plan.poses, plan.drive, pieces)


def _middle(plan: CorrectionPlan, cell: Cell, ways: IntArray) -> Array:
    """The correction wanted midway on straight ways, (n, 6)."""
    position, rotation = on_the_way(plan.poses, plan.drive, ways, np.full(len(ways), 0.5))
    ends = plan.drive.pose[ways]
    poses = replace(
        plan.poses, position=position, rotation=rotation, theta=plan.poses.theta[ends],
        tool=plan.poses.tool[ends], posture=plan.poses.posture[ends],
    )  # fmt: skip
    rise = (plan.solved.rise[ways] + plan.solved.rise[ways - 1]) / 2
    row = np.arange(len(ways))
    return pointwise(cell, error_models(cell, poses, row), poses, row, rise, plan.solved.midway.at(ways))[0]


def _written(
    planned: LsProgram,
    plan: CorrectionPlan,
    cell: Cell,
    frames: Frames,
    before: Sequence[Duty],
    options: Options,
    progress: Progress,
) -> Correction:
    """The numbers changed, read again, flown and judged."""
    program, poses, drive = plan.program, plan.poses, plan.drive
    each = shared(drive, plan.free, plan.solved.correction, plan.solved.theta, len(poses.row))
    size = np.abs(each.correction).max(axis=1)
    which = np.flatnonzero(each.changed & (size > NOTHING))
    c = each.correction[which]
    position = poses.position[which] + c[:, :3]
    rotation = poses.rotation[which] @ rotation_matrix(c[:, 3:])
    still = np.zeros((len(which), 3), dtype=np.int64)

    def changed(nudge: IntArray, joints: BoolArray) -> LsProgram:
        pose = position, rotation, each.theta[which]
        edits = number_edits(program, poses, cell.robot, which, *pose, nudge, joints)
        return edited(program, edits) if edits else program

    written = changed(still, still[:, 0] > 0)
    marked = _marked_rows(plan, which)
    told = written.data != program.data and watermark.enough(poses.joint_form[marked])
    if told:
        at = np.searchsorted(which, marked)
        still[at] = watermark.nudges(_units(written, poses, marked)) * ~poses.joint_form[marked][:, None]
        written = changed(still, np.isin(np.arange(len(which)), at))
    differs = (written.positions.value != program.positions.value) & np.isfinite(program.positions.value)
    progress("twin before", 0.0)
    meant = fly(cell, poses, drive, before, lambda share: progress("twin before", share))
    target = on_the_way(poses, drive, meant.station, meant.fraction)
    now = read_poses(written, cell.robot, frames)
    progress("twin after", 0.0)
    flight = fly(cell, now, read_drive(written, now, cell.robot), before, lambda share: progress("twin after", share))
    moved = plan.free & each.changed[drive.pose] if len(poses.row) else plan.free
    judged = moved[flight.station] & np.where(flight.fraction < 1, moved[flight.station - 1], True)
    result = Correction(
        name=program.name,
        cell=cell,
        before=tuple(before),
        options=options,
        planned=planned.data,
        text=written.data,
        plan=plan,
        shared=each,
        changed=int(differs.any(axis=1).sum()),
        added=len(program.positions.number) - len(planned.positions.number),
        flight=flight,
        error=off(meant, *target),
        residual=off(flight, *target),
        judged=judged,
        marked=told,
        findings=(),
    )
    stray = _strays(plan, cell)
    return replace(result, findings=say.findings(result, stray))


def _marked_rows(plan: CorrectionPlan, which: IntArray) -> IntArray:
    """The first corrected positions, in rising order of row."""
    rows = _markable(plan)
    rows = rows[np.isin(rows, which)]
    return np.sort(rows[: watermark.COUNT])


def _strays(plan: CorrectionPlan, cell: Cell) -> Array:
    """How far each straight way's own correction strays from the line between its ends, (n,) [m]."""
    ways = _ways(plan)
    return straightness(plan.solved.correction, _middle(plan, cell, ways), ways) if len(ways) else np.zeros(0)


def _ways(plan: CorrectionPlan) -> IntArray:
    """Stations reached by straight lines between corrected ends."""
    found = straight(plan.poses, plan.drive) & plan.free
    found[1:] &= plan.free[:-1]
    return np.flatnonzero(found)
