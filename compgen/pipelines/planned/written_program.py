"""A program that was written for a path earlier, flown by the twin in the state that the path's files say now."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from compgen.core import stages
from compgen.core.arrays import Array, BoolArray, IntArray, cumulated, first_true, step_lengths
from compgen.core.evaluation import done
from compgen.core.exceptions import CompgenError, InputError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.pose import Pose
from compgen.core.rotations import relative_rotation
from compgen.core.stages import Progress
from compgen.core.units import MM
from compgen.job.job import Job
from compgen.pipelines.files.program_course import read_canonical
from compgen.pipelines.files.twin_of_job import at_start, deviation_of, prepared_for
from compgen.pipelines.findings.job_findings import own_file_findings
from compgen.pipelines.planned import generate, motion_predistortion
from compgen.pipelines.planned.assumed_ramps import ramp_findings
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import in_world
from compgen.pipelines.uncertainty.draws import FlownDraws, fly_program_draws
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.thermal.ensemble import Start, starts_to_fly
from compgen.verification.deviation import Deviation
from compgen.verification.twin import PreparedProgram
from compgen.verification.verdict import judge
from compgen.verification.written_motion import read_motion

ROUNDED = 1e-5  # [m] and [rad] that the digits of a text may add to a correction
LONG = 1e-3  # [m] of lines of which digits and corrections change the speed by less than
SHORTEST = 1e-9  # [m] of a line
SAME_SPEED, SPEED_STEP = 0.1, 1e-4  # this share, and this much [m/s]
AHEAD = 5e-3  # [m] beside a statement's own length, that the path may go on for until the next position


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class WrittenFlight:
    """What a written program leaves in the state of a job."""

    planned: Planned  # at the positions of the text; flown is the job's uncorrected program, the motion is the text's
    program: Program
    start: Start  # at which it errs most, of those that the job asks for
    deviation: Deviation
    draws: FlownDraws | None  # of bounds with a probability; None: the job has none
    findings: tuple[Finding, ...]


def fly_written(
    job: Job,
    data: bytes,
    find_program: Callable[[str], bytes | None],
    progress: Progress,
    *,
    with_other_ramps: bool = False,
) -> WrittenFlight:
    """Fly a program's text after everything that a job's cell does.

    Args:
        job: Its path is the program's; its day need not be the one that the program was made for.
        data: The program, or the main program of its pages.
        find_program: The listing of a program that it calls, by name in capitals; None where there is none.
        progress: Called with the stage and the share done.
        with_other_ramps: Whether it is judged with steeper and flatter ramps too, where accelerations are assumed.

    Raises:
        InputError: It is not what compgen wrote for this path.
        ImpossibleError: The robot cannot drive the path.
        TwinError: The twin cannot drive the text.
    """
    try:
        program = read_canonical(data, find_program)
    except CompgenError as failure:
        raise InputError(f"it is no program as cgen generate writes it ({failure}); generate it anew") from None
    planned = generate.plan_uncorrected(job, progress)
    rows, path = _positions_of(job, planned.path, program)
    _refuse_other_motion(planned, path, program)
    progress(stages.TWIN_AFTER, 0.0)
    prepared = prepared_for(job, program)
    starts = [Start()] if job.ensemble is None else starts_to_fly(job.ensemble)
    flights = ((start, deviation_of(path, at_start(job, prepared, start))) for start in starts)  # one kept at a time
    worst, deviation = max(flights, key=lambda flight: flight[1].on_part["total"].max)
    named = planned.at(rows, path)
    draws = _draws(planned, named, prepared, deviation, progress)
    touching = generate.moves_otherwise(named)
    written = read_motion(prepared, np.diff(path.arc), planned.feed * path.pace, touching)
    findings = [*judge(deviation, job.bounds), *own_file_findings(job, path, deviation)]
    findings += draws.findings() if draws is not None else []
    findings += [*motion_predistortion.findings(named, prepared, written, deviation), *planned.findings]
    findings += _robot_findings(job, program)
    if with_other_ramps:
        findings += ramp_findings(job, path, program)
    return WrittenFlight(
        planned=replace(named, twin_result=done((planned.deviation(), replace(written, effect=named.effect(written))))),
        program=program,
        start=worst,
        deviation=deviation,
        draws=draws,
        findings=tuple(findings),
    )


def _robot_findings(job: Job, program: Program) -> Iterator[Finding]:
    """That the text was written with another robot file than it is flown with: then more than the state is another."""
    made = next((line.split()[2] for line in program.remarks if line.startswith("robot file ")), "")
    if made and not job.cell.robot_file_hash.startswith(made):
        now = f"{job.cell.robot_file} now, {job.cell.robot_file_hash[: len(made)]}"
        message = (
            f"{program.name} was written with another robot file ({made} in its remarks) than {now}; give that one"
        )
        yield Finding.of(Code.WRITTEN_ROBOT_FILE, f"{message} with --robot, or generate it anew")


def _draws(
    planned: Planned, named: Planned, prepared: PreparedProgram, deviation: Deviation, progress: Progress
) -> FlownDraws | None:
    """The text flown on arms and days that the files leave open; it may start as late as one that is made now.

    Args:
        planned: The job's plan.
        named: The same at the positions of the text.
        prepared: The text.
        deviation: Of it, on the arm that the files describe.
        progress: Called with the stage and the share done.
    """
    if planned.job.bounds.guaranteed is None:
        return None
    late = generate.late_start(planned.job, generate.start_window(planned, planned.theta))
    driven = named.driven(prepared.theta, named.motion)
    return fly_program_draws(driven, prepared, deviation, late, partial(progress, stages.DRAWS))


def _positions_of(job: Job, path: ToolPath, program: Program) -> tuple[IntArray, ToolPath]:
    """The waypoints of the planned path that a program's positions stand for, and the path of these.

    Raises:
        InputError: They are another path's.
    """
    uframe = 0 if job.frame is None else job.frame.number
    if (program.uframe, program.utool) != (uframe, job.tool.number):
        raise InputError(
            f"its positions are in UF {program.uframe} with UT {program.utool}; {job.source} has UF {uframe} and UT "
            f"{job.tool.number}: it is another path's program"
        )
    written = in_world(job, Pose(program.position, program.rotation))
    whole = job.plan.process.thin is None and not job.plan.process.arcs
    if whole and len(program.position) != len(path.arc):
        raise InputError(
            f"it has {len(program.position)} positions, and {job.source} plans {len(path.arc)}: it is another path's "
            "program, or a page of one; give the file that cgen generate wrote for this path"
        )
    rows = np.arange(len(path.arc)) if whole else _rows_of(path, written.position, program.fine)
    if not whole:
        path = path.subset(rows, program.via if program.via.any() else None)
    moved = np.linalg.norm(written.position - path.target.position - path.balance, axis=1)
    turned = np.linalg.norm(relative_rotation(path.target.rotation, written.rotation), axis=1)
    n = int(np.argmax(moved))
    if moved[n] > job.settings.clamp_position + ROUNDED or turned.max() > job.settings.clamp_rotation + ROUNDED:
        raise InputError(
            f"P[{n + 1}] is {moved[n] / MM:.3f} mm from where {job.source} plans it, and a correction is at most "
            f"{job.settings.clamp_position / MM:g} mm: it is another path's program"
        )
    return rows, path


def _refuse_other_motion(planned: Planned, path: ToolPath, program: Program) -> None:
    """Refuse a text that was edited since: other stops, speeds or payload than this path's program has."""
    job, mend = planned.job, "one was edited since; generate it anew"
    if (program.payload, program.acc) != (job.tool.payload, job.plan.process.acc):
        raise InputError(
            f"it says PAYLOAD {program.payload} and ACC {program.acc}, and {job.source} {job.tool.payload} and "
            f"{job.plan.process.acc}: {mend}"
        )
    other = first_true(program.fine != path.stop)
    if other is not None:
        does, plans = ("stops", "no stop") if program.fine[other] else ("does not stop", "a stop")
        raise InputError(f"P[{other + 1}]: it {does} there, and {job.source} plans {plans}: {mend}")
    motion, speed = job.robot.motion, planned.trajectory.speed
    if len(speed) != len(program.speed) or (motion is not None and motion.may_predistort):
        return  # each of its lines is as long as several, or is commanded elsewhere
    length = np.maximum(program.lengths(), SHORTEST)
    first = np.unique(cumulated(length[:-1]) // LONG, return_index=True)[1]  # of lines that are judged as one
    way = np.add.reduceat(length, first)
    given, wanted = (way / np.add.reduceat(length / each, first) for each in (program.speed, speed))
    other = first_true((way > LONG / 2) & (np.abs(given - wanted) > SAME_SPEED * wanted + SPEED_STEP))
    if other is not None:
        raise InputError(
            f"P[{first[other] + 2}]: {given[other] / MM:.4g} mm/s lead there, and {job.source} plans "
            f"{wanted[other] / MM:.4g} mm/s: {mend}"
        )


def _rows_of(path: ToolPath, position: Array, fine: BoolArray) -> IntArray:
    """The waypoints that a program's positions stand for, where it leaves some out: the nearest, one after another.

    Stops are known by their order. Between them a position stands for the waypoint nearest to where it would be with
    the correction of the one before it: on a tight curve waypoints lie nearer to one another than a correction is long.
    """
    text, plan = (np.union1d(np.flatnonzero(stops), [0, len(stops) - 1]) for stops in (fine, path.stop))
    if len(text) != len(plan):  # which is refused by the first that differs
        text, plan = text[[0, -1]], plan[[0, -1]]
    rows, at = [0], 0
    for k, length in enumerate(step_lengths(position).tolist(), 1):
        stop = int(np.searchsorted(text, k))
        left = int(text[stop]) - k  # positions until it
        last = int(np.searchsorted(path.arc, path.arc[at] + 1.6 * length + AHEAD, side="right"))
        first, last = at + 1, min(max(last, at + 2), int(plan[stop]) + 1 - left)
        if first >= last:
            raise InputError(f"P[{k + 1}]: it is none of this path's waypoints: it is another path's program")
        expected = position[k] - (position[k - 1] - path.target.position[at])
        near = np.linalg.norm(path.target.position[first:last] - expected, axis=1)
        at = first + int(np.argmin(near)) if left else last - 1
        rows.append(at)
    if rows[-1] != len(path.arc) - 1:
        raise InputError("it does not end where this path ends: it is another path's program")
    return np.array(rows)
