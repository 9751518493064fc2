"""One correction from end to end: read, warm up, correct, write, read back, execute on the twin, judge."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.exceptions import InputError
from compgen.core.pose import Pose
from compgen.core.stages import Progress
from compgen.core.units import MM
from compgen.core.version import __version__
from compgen.fanuc import LsProgram, dumps, edited, loads
from compgen.fanuc.analysis import watermark
from compgen.fanuc.analysis.called_programs import called_programs
from compgen.fanuc.analysis.correctable import read_scope
from compgen.fanuc.analysis.poses import require_frames
from compgen.fanuc.analysis.program_context import ProgramContext
from compgen.fanuc.analysis.traversal import read_traversal
from compgen.fanuc.analysis.watermark import Mark, mark_of
from compgen.fanuc.editing.dry_run_lift import lifted_program
from compgen.fanuc.editing.insertion import (
    allowed_pieces,
    insert_points,
    insert_remark,
    marking_remark,
    says_override,
    split_positions,
)
from compgen.fanuc.editing.numbers import NewPoses, number_edits
from compgen.fanuc.editing.shared_positions import SharedCorrections, assign_new_positions, midway_deviation
from compgen.job.job import Cell
from compgen.pipelines.correct.correction_findings import correction_findings
from compgen.pipelines.correct.motion_command import (
    at_full_override,
    commanded_program,
    motion_command,
    motion_elsewhere,
    shifted_positions,
)
from compgen.pipelines.correct.proof import (
    ServedStarts,
    as_both_can,
    flat_arcs,
    residue_of,
    unexplained_turns,
    wide_arcs,
    worst_of_starts,
)
from compgen.pipelines.correct.result import (
    Correction,
    CorrectionPlan,
    MotionCommand,
    Options,
    between_corrected,
    changed_positions,
    check_known,
    straight_ways,
)
from compgen.pipelines.correct.station_band import fly_draws, station_band
from compgen.pipelines.correct.station_corrections import (
    cancel_errors,
    correct_stations,
    error_models,
    rise_at_stations,
)
from compgen.pipelines.files.program_course import course_of_driven
from compgen.pipelines.files.twin_of_job import twin_of_cell
from compgen.pipelines.planned.dry_run import raised_findings
from compgen.pipelines.planned.program_text import running_override
from compgen.program.driven import NONE, DrivenProgram
from compgen.program.frames import Frames
from compgen.program.registers import Register
from compgen.program.ways import interpolate_poses, way_lengths
from compgen.thermal import Duty
from compgen.verification.executed.course import ProgramCourse
from compgen.verification.flight import Flight, fly, pose_errors

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
        InputError: Not a program, a frame that is not known, a position that is used and not defined, compgen's mark,
            starts that outlive a state; with ``strict``, a statement that cannot be corrected; a bound with a
            probability, and a robot file that does not say how well it is known.
        TwinError: The proof cannot be made.
    """
    progress(stages.READING, 0.0)
    check_known(options, cell, before)
    cell = replace(cell, input_findings=(*cell.input_findings, *frames.input_findings))
    program = loads(data)
    around = ProgramContext(frames, registers or {}, called_programs(program, find_program))
    task = _Task(cell=cell, around=around, before=tuple(before), options=options, progress=progress)
    if options.raised:
        if not options.again:  # lifting takes the mark out of its digits
            _refuse_marked(program, _read_mark(program, task))
        length = cell.robot.controller.capacity.name_length
        program = lifted_program(program, options.raised / MM, length, around.called, frames.uframe)
    plan = _plan_correction(program, task)
    if not options.again:
        _refuse_marked(plan.program, mark_of(plan.program, plan.poses, plan.drive, plan.scope.free))
    return _write_and_verify(program, _with_new_positions(plan, task), task)


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class _Task:
    """What a program is corrected with."""

    cell: Cell
    around: ProgramContext
    before: tuple[Duty, ...]
    options: Options
    progress: Progress


def _with_new_positions(plan: CorrectionPlan, task: _Task) -> CorrectionPlan:
    """The plan of the program with the points and positions that the options ask for: put in, and parted."""
    options, robot, last = task.options, task.cell.robot, int(plan.program.positions.number.max(initial=0))
    pieces, lacking = _cuts_needed(plan, task, last)
    for _ in range(MAX_ROUNDS):
        if not (pieces > 1).any():
            break
        read = partial(task.around.poses, robot=robot)
        program = insert_points(plan.program, plan.poses, plan.drive, pieces, robot, read)
        if not (says_override(program) or options.raised):
            overrides = (1.0,) if options.ensemble is None else options.ensemble.overrides
            program = insert_remark(program, running_override(overrides))
        cut = _plan_correction(program, task)
        cut_pieces, cut_lacking = _cuts_needed(cut, task, last)
        if cut_lacking >= lacking:  # so short lines are not to be bent like that
            break
        plan, pieces, lacking = cut, cut_pieces, cut_lacking
    if not options.split:
        return plan
    first = int(plan.program.positions.number.max(initial=0)) + 1
    new_positions = assign_new_positions(plan.poses, plan.drive, plan.free, plan.stations.correction, first)
    if not new_positions:
        return plan
    return _plan_correction(split_positions(plan.program, plan.poses, plan.drive, new_positions), task)


def _cuts_needed(plan: CorrectionPlan, task: _Task, last: int) -> tuple[IntArray, tuple[int, float]]:
    """Into how many pieces straight ways must be cut, (S,), deviations fall with their square; and what is lacking.

    That is stations at positions up to number ``last`` that are corrected, negative, and how far ways stray midway [m].
    """
    pieces, allowed = np.ones(len(plan.free), dtype=np.int64), task.options.insert
    if allowed is None:
        return pieces, (0, 0.0)
    ways, deviation = straight_ways(plan), _midway_deviations(plan, task.cell)
    pieces[ways] = np.ceil(np.sqrt(deviation / allowed)).astype(np.int64).clip(1, MAX_PIECES)
    pieces = allowed_pieces(plan.program, plan.poses, plan.drive, pieces)
    corrected = plan.poses.number[plan.drive.pose[plan.free]] <= last
    return pieces, (-int(corrected.sum()), float(deviation[pieces[ways] > 1].max(initial=0.0)))


def _plan_correction(program: LsProgram, task: _Task) -> CorrectionPlan:
    """What is known of a program before its numbers change: poses, ways, and the correction of each station."""
    cell, options = task.cell, task.options
    _refuse_unfit(program)
    poses, drive = task.around.drive(program, cell.robot)
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
        reached=rise_at_stations(cell, drive, task.before, options.ensemble, options.air),
        settings=options.settings,
        progress=partial(task.progress, stages.CORRECTION),
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


def _refuse_marked(program: LsProgram, mark: Mark) -> None:
    """Raises InputError for a program that carries compgen's mark, in a remark or in its numbers."""
    if mark is not Mark.NONE:
        remark = f"its remark says '{watermark.remark_of(program)}'"
        evidence = remark if mark is Mark.REMARK else "the last digits of its positions do"
        raise InputError(
            f"program {program.name}: it carries compgen's mark ({evidence}): it would be corrected twice; "
            f"start from the planned program ({watermark.planned_source(program)}), or say --again"
        )


def _midway_corrections(plan: CorrectionPlan, cell: Cell, ways: IntArray) -> Array:
    """The correction wanted midway on straight ways, (n, 6)."""
    tcp = interpolate_poses(plan.drive, ways, np.full(len(ways), 0.5))
    ends = plan.drive.pose[ways]
    named = plan.drive.at
    at = replace(named, tcp=tcp, theta=named.theta[ends], tool=named.tool[ends], posture=named.posture[ends])
    rise = (plan.stations.rise[ways] + plan.stations.rise[plan.drive.origin[ways]]) / 2
    row = np.arange(len(ways))
    return cancel_errors(cell, error_models(cell, at, row), at, row, rise, plan.stations.midway.at(ways))[0]


def _write_and_verify(planned: LsProgram, plan: CorrectionPlan, task: _Task) -> Correction:
    """The program with its numbers changed, read back, executed on the twin and judged."""
    program, drive, cell, progress = plan.program, plan.drive, task.cell, task.progress
    command = _against_motion(plan, task)
    shared, meant = commanded_program(plan, cell, command)
    written, mark = _written(plan, shared, task)
    written = at_full_override(written, command)
    progress(stages.TWIN_BEFORE, 0.0)
    new_poses, new_drive = task.around.drive(written, cell.robot)
    drives = as_both_can(drive, new_drive)
    flights = _fly_both(plan, shared, drives, meant, task)
    result = Correction(
        name=program.name,
        cell=cell,
        around=task.around,
        before=task.before,
        options=task.options,
        planned=dumps(planned),
        written=written,
        plan=plan,
        shared=shared,
        changed=changed_positions(planned, written),
        added=len({*program.positions.number.tolist()} - {*planned.positions.number.tolist()}),
        execution=flights.corrected,
        error=pose_errors(flights.planned, interpolate_poses(drive, flights.planned.station, flights.planned.fraction)),
        residual=pose_errors(flights.corrected, flights.target),
        turn=unexplained_turns(flights.planned, flights.corrected),
        new_beyond=np.flatnonzero((new_drive.beyond > 0) & (drive.beyond <= 0)),
        judged=flights.judged,
        length=flights.length,
        mark=mark,
        served=flights.served,
        findings=(),
        band=station_band(cell, plan, task.around.frames, task.before, task.options.air),
        motion=motion_elsewhere(written, cell.robot, new_poses, new_drive, command),
        meant=meant,
        command=command,
    )
    result = replace(result, draws=fly_draws(result, drives[1], flights.target, partial(progress, stages.DRAWS)))
    findings = [*correction_findings(result, _midway_deviations(plan, cell)), *wide_arcs(*drives)]
    return replace(result, findings=(*findings, *flat_arcs(drive, new_drive), *raised_findings(task.options.raised)))


def _against_motion(plan: CorrectionPlan, task: _Task) -> MotionCommand | None:
    """What is commanded against the controller's motion; programs that serve other overrides than 100 % are not."""
    options, robot = task.options, task.cell.robot
    if options.raised or (options.ensemble is not None and set(options.ensemble.overrides) != {1.0}):
        return None

    def course_of(shift: Array) -> ProgramCourse | None:
        written, _ = _written(plan, shifted_positions(plan, task.cell, shift), task)
        try:
            return course_of_driven(written, robot, *task.around.drive(written, robot))
        except InputError:
            return None

    return motion_command(plan, robot, options.settings.clamp_position, course_of)


class _Flights(NamedTuple):
    """Both texts on the twin, at the same M samples."""

    planned: Flight
    corrected: Flight  # of several starts that at which it errs most
    target: Pose  # M, of the corrected text, with what is commanded against the controller's motion
    judged: BoolArray  # (M,) samples at or between corrected stations
    length: Array  # (M,) [m] of path that each of them stands for
    served: ServedStarts | None  # what is left over the starts, where these are several


def _fly_both(
    plan: CorrectionPlan,
    shared: SharedCorrections,
    drives: tuple[DrivenProgram, DrivenProgram],
    meant: DrivenProgram,
    task: _Task,
) -> _Flights:
    """The planned and the written text on the twin."""
    drive, twin, progress, ensemble = plan.drive, twin_of_cell(task.cell), task.progress, task.options.ensemble
    fly_planned, fly_written = (
        partial(fly, twin, driven, task.before, partial(progress, stage), air=task.options.air)
        for driven, stage in zip(drives, (stages.TWIN_BEFORE, stages.TWIN_AFTER), strict=True)
    )
    planned = fly_planned()
    station, fraction = planned.station, planned.fraction
    target = interpolate_poses(meant, station, fraction)
    judged = between_corrected(plan, shared, station, fraction) & (station >= task.options.judged_from)
    length = way_lengths(task.cell.robot, drive, station, fraction, judged)
    progress(stages.TWIN_AFTER, 0.0)
    if ensemble is None or not judged.any():
        return _Flights(planned, fly_written(), target, judged, length, None)
    residue = partial(residue_of, judged=judged, length=length)
    worst, served = worst_of_starts(ensemble, fly_written, partial(residue, target=target))
    own = interpolate_poses(drive, station, fraction)
    flights = {start: fly_planned(starts=((1.0, start),)) for start, _ in served.flown}
    served = replace(served, planned=tuple(residue(flight, target=own) for flight in flights.values()))
    return _Flights(flights[served.worst[0]], worst, target, judged, length, served)


def _written(plan: CorrectionPlan, shared: SharedCorrections, task: _Task) -> tuple[LsProgram, Mark]:
    """The program with its numbers changed, and where it carries the mark."""
    program, poses = plan.program, plan.poses
    size = np.abs(shared.correction).max(axis=1)
    rows = np.flatnonzero(shared.changed & (size > NEGLIGIBLE))
    commanded = poses.tcp[rows].moved(shared.correction[rows])
    nudge = np.zeros((len(rows), 3), dtype=np.int64)

    def write(nudges: IntArray, marked_joints: BoolArray) -> LsProgram:
        new = NewPoses(rows=rows, tcp=commanded, theta=shared.theta[rows], nudge=nudges, marked=marked_joints)
        edits = number_edits(program, poses, task.cell.robot, new)
        return edited(program, edits) if edits else program

    written = write(nudge, nudge[:, 0] > 0)
    if written.data == program.data:
        return written, Mark.NONE
    at, nudge[at] = _mark_nudges(written, plan, rows)
    marked = write(nudge, np.isin(np.arange(len(rows)), at))
    mark = _read_mark(marked, task)
    if mark is not Mark.NONE:
        return marked, mark
    if task.options.remark:
        return insert_remark(written, marking_remark(__version__)), Mark.REMARK
    return written, Mark.NONE


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


def _read_mark(program: LsProgram, task: _Task) -> Mark:
    """The mark as the next correction of a program would read it."""
    poses, robot = task.around.poses(program, task.cell.robot), task.cell.robot
    drive = read_traversal(program, poses, robot)
    return mark_of(program, poses, drive, read_scope(program, poses, drive, robot).free)


def _midway_deviations(plan: CorrectionPlan, cell: Cell) -> Array:
    """How far the correction wanted midway on straight ways is from the line between their ends, (n,) [m]."""
    ways = straight_ways(plan)
    wanted = _midway_corrections(plan, cell, ways)
    return midway_deviation(plan.stations.correction, wanted, ways, plan.drive.origin[ways])
