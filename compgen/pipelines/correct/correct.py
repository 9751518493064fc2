"""One correction from end to end: read, warm up, correct, write, read back, execute on the twin, judge."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.core.units import MM
from compgen.core.version import __version__
from compgen.fanuc import LsProgram, edited, loads
from compgen.fanuc.analysis import watermark
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.poses import require_frames
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.analysis.watermark import Mark, mark_of
from compgen.fanuc.editing.insertion import (
    allowed_pieces,
    insert_points,
    insert_remark,
    marking_remark,
    says_override,
    split_positions,
)
from compgen.fanuc.editing.lift import lifted_program
from compgen.fanuc.editing.numbers import NewPoses, number_edits
from compgen.fanuc.editing.shared_positions import (
    SharedCorrections,
    assign_new_positions,
    average_shared,
    midway_deviation,
)
from compgen.job.job import Cell
from compgen.job.uncertainty import quantities_of_cell, refuse_silent_file
from compgen.pipelines.correct.arc_findings import flat_arcs, wide_arcs
from compgen.pipelines.correct.correction_findings import correction_findings
from compgen.pipelines.correct.draws import fly_draws
from compgen.pipelines.correct.proof import ServedProof, unexplained_turns
from compgen.pipelines.correct.result import Correction, CorrectionPlan, Options, corrected_stations
from compgen.pipelines.correct.station_band import station_band
from compgen.pipelines.correct.station_corrections import cancel_errors, correct_stations, error_models
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.planned.dry_run import raised_findings
from compgen.pipelines.planned.program_text import running_override
from compgen.program.driven import NONE
from compgen.program.frames import Frames
from compgen.program.registers import Register
from compgen.program.sample_lengths import sample_lengths
from compgen.program.ways import interpolate_poses, straight_lines
from compgen.thermal import Duty
from compgen.verification.flight import fly, pose_errors

NEGLIGIBLE = 1e-9  # [m], [rad] a correction below this is none
MAX_PIECES = 1000  # of one straight way
MAX_ROUNDS = 5  # of cutting ways whose pieces still deviate midway


def correct(  # noqa: PLR0913  what a program is corrected with, each by its name
    data: bytes,
    cell: Cell,
    frames: Frames,
    before: Sequence[Duty],
    options: Options,
    progress: Progress,
    find_program: Callable[[str], bytes | None] = lambda name: None,
    registers: Mapping[int, Register] | None = None,
) -> Correction:
    """Correct a program.

    Args:
        data: The program file.
        cell: The robot, its heat model and its errors.
        frames: What UF and UT numbers mean.
        before: What the cell did before the program starts.
        options: What may be done.
        progress: Called with the stage and the share done.
        find_program: The listing of a program that this one calls, by its name in capitals; None where there is none.
        registers: Position registers when the program starts, by number.

    Returns:
        The corrected program and its proof.

    Raises:
        InputError: Not a program; a frame is not known; a position is used but not defined; the program carries
            compgen's mark; with ``strict``, a statement cannot be corrected; a bound with a probability is asked for
            and the robot file does not say how well it is known.
        TwinError: The proof cannot be made.
    """
    progress(stages.READING, 0.0)
    if options.guaranteed is not None:
        refuse_silent_file(cell, quantities_of_cell(cell), "--guaranteed")
    cell = replace(cell, input_findings=(*cell.input_findings, *frames.input_findings))
    planned = program = loads(data)
    around = ProgramContext(frames, registers or {}, called_programs(program, find_program))
    if options.raised:
        _refuse_marked_before_lift(program, cell, around, options)
        length = cell.robot.controller.name_length
        planned = program = lifted_program(program, options.raised / MM, length, around.called.motionless)
    plan_of = partial(_plan_correction, cell=cell, around=around, before=before, options=options, progress=progress)
    plan = plan_of(program)
    if not options.again:
        _refuse_marked(plan)
    for _ in range(MAX_ROUNDS if options.insert is not None else 0):
        pieces = _pieces_needed(plan, cell, options.insert or 1.0)
        if not (pieces > 1).any():
            break
        read = partial(around.poses, robot=cell.robot)
        program = insert_points(program, plan.poses, plan.drive, pieces, cell.robot, read)
        if not (says_override(program) or options.raised):
            overrides = (1.0,) if options.ensemble is None else options.ensemble.overrides
            program = insert_remark(program, running_override(overrides))
        plan = plan_of(program)
    if options.split:
        first = int(program.positions.number.max(initial=0)) + 1
        new_positions = assign_new_positions(plan.poses, plan.drive, plan.free, plan.stations.correction, first)
        if new_positions:
            program = split_positions(program, plan.poses, plan.drive, new_positions)
            plan = plan_of(program)
    return _write_and_verify(planned, plan, cell, around, before, options, progress)


def _plan_correction(
    program: LsProgram,
    cell: Cell,
    around: ProgramContext,
    before: Sequence[Duty],
    options: Options,
    progress: Progress,
) -> CorrectionPlan:
    """What is known of a program before its numbers change: poses, ways, and the correction of each station."""
    _refuse_unfit(program)
    poses, drive = around.drive(program, cell.robot)
    require_frames(program, poses)
    scope = read_scope(program, poses, drive, cell.robot)
    if options.strict and scope.unsafe:
        first = scope.unsafe[0]
        raise InputError(
            f"program {program.name}: line {first.line}: {first.text}: {first.reason}; {len(scope.unsafe)} in all are "
            "refused by --strict; without it they are passed through untouched"
        )
    stations = correct_stations(
        cell,
        drive,
        free=scope.free,
        before=before,
        settings=options.settings,
        progress=lambda share: progress(stages.CORRECTION, share),
        ensemble=options.ensemble,
    )
    free = scope.free.copy()
    free[[station for station, _ in stations.held]] = False
    return CorrectionPlan(program=program, poses=poses, drive=drive, scope=scope, stations=stations, free=free)


def _refuse_unfit(program: LsProgram) -> None:
    """Raises InputError for a program that moves no group, or uses a position that it does not define."""
    m = program.motions
    mask = dict(program.attributes).get("DEFAULT_GROUP", "1")
    if len(m.line) and "1" not in mask:
        raise InputError(f"program {program.name}: DEFAULT_GROUP = {mask} moves no group, but the program has motions")
    defined = set(program.positions.number.tolist())
    for i in np.flatnonzero(~m.disabled).tolist():
        for n in m.position[i]:
            if n >= 0 and n not in defined:
                raise InputError(
                    f"program {program.name}: line {m.line[i]}: P[{n}] is used but not defined; mend the program"
                )


def _refuse_marked(plan: CorrectionPlan) -> None:
    """Raises InputError for a program that carries compgen's mark, in a remark or in its numbers."""
    mark = mark_of(plan.program, plan.poses, plan.drive, plan.scope.free)
    if mark is not Mark.NONE:
        remark = f"its remark says '{watermark.remark_of(plan.program)}'"
        evidence = remark if mark is Mark.REMARK else "the last digits of its positions do"
        raise InputError(
            f"program {plan.program.name}: it carries compgen's mark ({evidence}): it would be corrected twice; "
            "start from the planned program, get it back with --restore, or say --again"
        )


def _refuse_marked_before_lift(program: LsProgram, cell: Cell, around: ProgramContext, options: Options) -> None:
    """Raises InputError for a program that carries the mark: lifting would take it out of its digits."""
    if not options.again and _read_mark(program, cell, around) is not Mark.NONE:
        raise InputError(
            f"program {program.name}: it carries compgen's mark and would be corrected twice; lift the planned one, "
            "get it back with --restore, or say --again"
        )


def _pieces_needed(plan: CorrectionPlan, cell: Cell, allowed: float) -> IntArray:
    """Into how many pieces each straight way must be cut, (S,): its deviation falls with the square of their count."""
    pieces = np.ones(len(plan.free), dtype=np.int64)
    ways = _straight_ways(plan)
    if len(ways):
        pieces[ways] = np.ceil(np.sqrt(_midway_deviations(plan, cell) / allowed)).astype(np.int64).clip(1, MAX_PIECES)
    return allowed_pieces(plan.program, plan.poses, plan.drive, pieces)


def _midway_corrections(plan: CorrectionPlan, cell: Cell, ways: IntArray) -> Array:
    """The correction wanted midway on straight ways, (n, 6)."""
    tcp = interpolate_poses(plan.drive, ways, np.full(len(ways), 0.5))
    ends = plan.drive.pose[ways]
    named = plan.drive.at
    at = replace(named, tcp=tcp, theta=named.theta[ends], tool=named.tool[ends], posture=named.posture[ends])
    rise = (plan.stations.rise[ways] + plan.stations.rise[plan.drive.origin[ways]]) / 2
    row = np.arange(len(ways))
    return cancel_errors(cell, error_models(cell, at, row), at, row, rise, plan.stations.midway.at(ways))[0]


def _write_and_verify(
    planned: LsProgram,
    plan: CorrectionPlan,
    cell: Cell,
    around: ProgramContext,
    before: Sequence[Duty],
    options: Options,
    progress: Progress,
) -> Correction:
    """The program with its numbers changed, read back, executed on the twin and judged."""
    program, drive = plan.program, plan.drive
    shared = average_shared(plan.poses, drive, plan.free, plan.stations.correction, plan.stations.theta)
    written, mark = _written(plan, shared, cell, around, remark=options.remark)
    progress(stages.TWIN_BEFORE, 0.0)
    _, new_drive = around.drive(written, cell.robot)
    beyond = np.maximum(drive.beyond, new_drive.beyond)  # such a way is executed in neither text
    arcs = drive.circular & new_drive.circular
    drives = replace(drive, beyond=beyond, circular=arcs), replace(new_drive, beyond=beyond, circular=arcs)
    twin = twin_of_cell(cell)
    before_stage, after_stage = (partial(progress, stage) for stage in (stages.TWIN_BEFORE, stages.TWIN_AFTER))
    planned_execution = fly(twin, drives[0], before, before_stage)
    station, fraction = planned_execution.station, planned_execution.fraction
    target = interpolate_poses(drive, station, fraction)
    judged = _between_corrected(plan, shared, station, fraction)
    length = sample_lengths(cell.robot, drive, station, fraction, judged)
    progress(stages.TWIN_AFTER, 0.0)
    flown = partial(fly, twin, drives[1], before, after_stage)
    if options.ensemble is None:
        execution, served = flown(), None
    else:
        proof = ServedProof(flown, target, judged, length)
        execution, served = proof.worst_of(options.ensemble)
        planned_execution = fly(twin, drives[0], before, before_stage, ((1.0, served.worst[0]),))
    result = Correction(
        name=program.name,
        cell=cell,
        around=around,
        before=tuple(before),
        options=options,
        planned=planned.data,
        text=written.data,
        plan=plan,
        shared=shared,
        changed=_changed_positions(program, written),
        added=len(program.positions.number) - len(planned.positions.number),
        execution=execution,
        error=pose_errors(planned_execution, target),
        residual=pose_errors(execution, target),
        turn=unexplained_turns(planned_execution, execution),
        new_beyond=np.flatnonzero((new_drive.beyond > 0) & (drive.beyond <= 0)),
        judged=judged,
        length=length,
        mark=mark,
        served=served,
        findings=(),
        band=station_band(cell, plan, before),
    )
    result = replace(result, draws=fly_draws(result, drives[1], target, partial(progress, stages.DRAWS)))
    findings = correction_findings(result, _midway_deviations(plan, cell))
    of_arcs = [*wide_arcs(*drives), *flat_arcs(drive, new_drive)]
    return replace(result, findings=(*findings, *of_arcs, *raised_findings(options.raised)))


def _written(
    plan: CorrectionPlan, shared: SharedCorrections, cell: Cell, around: ProgramContext, *, remark: bool
) -> tuple[LsProgram, Mark]:
    """The program with its numbers changed, and where it carries the mark."""
    program, poses = plan.program, plan.poses
    size = np.abs(shared.correction).max(axis=1)
    rows = np.flatnonzero(shared.changed & (size > NEGLIGIBLE))
    commanded = poses.tcp[rows].moved(shared.correction[rows])
    nudge = np.zeros((len(rows), 3), dtype=np.int64)

    def write(nudges: IntArray, marked_joints: BoolArray) -> LsProgram:
        new = NewPoses(rows=rows, tcp=commanded, theta=shared.theta[rows], nudge=nudges, marked=marked_joints)
        edits = number_edits(program, poses, cell.robot, new)
        return edited(program, edits) if edits else program

    written = write(nudge, nudge[:, 0] > 0)
    if written.data == program.data:
        return written, Mark.NONE
    at, nudge[at] = _mark_nudges(written, plan, rows)
    marked = write(nudge, np.isin(np.arange(len(rows)), at))
    mark = _read_mark(marked, cell, around)
    if mark is not Mark.NONE:
        return marked, mark
    if remark:
        return insert_remark(written, marking_remark(__version__)), Mark.REMARK
    return written, Mark.NONE


def _changed_positions(program: LsProgram, written: LsProgram) -> int:
    """How many positions read differently."""
    differs = (written.positions.value != program.positions.value) & np.isfinite(program.positions.value)
    return int(differs.any(axis=1).sum())


def _between_corrected(
    plan: CorrectionPlan, shared: SharedCorrections, station: IntArray, fraction: Array
) -> BoolArray:
    """Which samples, stations and fractions of the ways to them (M,), lie at or between corrected stations."""
    moved = corrected_stations(plan, shared)
    return np.asarray(moved[station] & ((fraction >= 1) | moved[plan.drive.origin[station]]))


def _mark_nudges(written: LsProgram, plan: CorrectionPlan, rows: IntArray) -> tuple[IntArray, IntArray]:
    """Which of ``rows`` shall carry the mark (m,), all at the first places, and their nudges (m, 3)."""
    listed = watermark.listed_rows(plan.poses, plan.drive, plan.scope.free)
    index = np.full(len(written.positions.number), NONE)
    index[plan.poses.row[rows]] = np.arange(len(rows))
    listed = watermark.legible_rows(written, listed[index[listed] != NONE])
    units, joint_form = watermark.last_digit_units(written, listed)
    first, place = watermark.first_places(units, joint_form)
    at = np.isin(place, first)
    return index[listed[at]], watermark.nudges(units[at]) * ~joint_form[at][:, None]


def _read_mark(program: LsProgram, cell: Cell, around: ProgramContext) -> Mark:
    """The mark as the next correction of a program would read it."""
    poses = around.poses(program, cell.robot)
    drive = read_traversal(program, poses, cell.robot)
    return mark_of(program, poses, drive, read_scope(program, poses, drive, cell.robot).free)


def _midway_deviations(plan: CorrectionPlan, cell: Cell) -> Array:
    """How far the correction wanted midway on straight ways is from the line between their ends, (n,) [m]."""
    ways = _straight_ways(plan)
    if not len(ways):
        return np.zeros(0)
    return midway_deviation(
        plan.stations.correction, _midway_corrections(plan, cell, ways), ways, plan.drive.origin[ways]
    )


def _straight_ways(plan: CorrectionPlan) -> IntArray:
    """Stations reached by straight lines between corrected ends."""
    drive, free = plan.drive, plan.free
    ways = np.flatnonzero(straight_lines(drive) & free)
    return ways[free[drive.origin[ways]]]
