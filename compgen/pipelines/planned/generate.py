"""The story of one run, on one page: path, joints, time, heat, error, correction, text, twin, verdict."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from compgen.compensation import limits, optimise, simplify
from compgen.compensation.mid_spatial import mid_spatial
from compgen.compensation.problem import Problem, Settings, Solution, Solver
from compgen.core import stages
from compgen.core.arrays import Array, BoolArray, IntArray
from compgen.core.dates import DEFAULT_DATE
from compgen.core.evaluation import run_in_background
from compgen.core.exceptions import ImpossibleError
from compgen.core.finding_codes import Code
from compgen.core.findings import Finding
from compgen.core.stages import Progress, RunStage
from compgen.core.units import UM
from compgen.error_model.beyond_measured import DrivenPoses, joint_box_findings, map_findings, unknown_start_findings
from compgen.error_model.direction_memory import DirectionState, command_directions, reversal_widths
from compgen.job.job import Job
from compgen.job.motion_plan import keeps_waypoints, plan_motion
from compgen.job.moves_in_arcs import flown_at_waypoints
from compgen.job.part_frame import frame_findings
from compgen.job.start_window import longest_waits
from compgen.pipelines.files.twin_of_job import deviation_of, prepared_for
from compgen.pipelines.findings import job_findings
from compgen.pipelines.findings.job_findings import over_periods, own_file_findings, times_apart
from compgen.pipelines.findings.motion_findings import lead_findings, motion_findings
from compgen.pipelines.planned import corrected_arcs, delivery, motion_predistortion
from compgen.pipelines.planned.delivery import Delivery, PageStart
from compgen.pipelines.planned.dry_run import dry_run_findings
from compgen.pipelines.planned.job_results import Corrected, Planned, plan_of, solution_at
from compgen.pipelines.planned.many_starts import Averaged, WrittenFile, averaging_findings, fly_starts
from compgen.pipelines.planned.program_text import compose_program, planned_program, printed_in_world
from compgen.pipelines.uncertainty import model_form
from compgen.pipelines.uncertainty.band_columns import assumed_findings, band_along
from compgen.pipelines.uncertainty.draws import fly_program_draws
from compgen.planning.retiming import Trajectory
from compgen.program.digits import resolution
from compgen.program.program import Program
from compgen.robot import inverse_kinematics, joint_path
from compgen.thermal import states_at
from compgen.thermal.model import extrapolations
from compgen.verification.deviation import Deviation
from compgen.verification.twin import PreparedProgram
from compgen.verification.verdict import judge
from compgen.verification.written_motion import WrittenMotion, read_motion

MAX_RIPPLE = 0.05 * UM


def predict(job: Job, progress: Progress, date: str = DEFAULT_DATE, *, pages: bool = True) -> Planned:
    """What would go wrong if the planned program ran as it is.

    Args:
        job: The planned program.
        progress: Called with the stage and the share done.
        date: In the program's header.
        pages: Whether a program that is more than the controller holds in one file gets the stops of its pages.

    Raises:
        ImpossibleError: The robot cannot drive the path.
        TwinError: The twin cannot drive it.
    """
    planned = corrected_arcs.at_program_positions(plan_lines(job, progress, pages=pages), progress)
    planned = _flown(planned, planned, progress, date)
    effect = planned.written().effect
    findings = (
        *own_file_findings(job, planned.path, planned.deviation()),
        *job_findings.below_feed(job, planned.feed, planned.path, planned.trajectory),
        *motion_findings(effect, job.bounds),
        *lead_findings(effect, planned.path, job),
        *planned.findings,
    )
    return replace(planned, findings=tuple(findings), band=band_along(planned.driven(planned.theta, planned.motion)))


def plan_uncorrected(job: Job, progress: Progress, date: str = DEFAULT_DATE, *, pages: bool = True) -> Planned:
    """The plan in lines through each waypoint, the twin still driving on another thread what its program names."""
    lines = plan_lines(job, progress, pages=pages)
    return _flown(lines, corrected_arcs.at_program_positions(lines, progress), progress, date)


def plan_lines(job: Job, progress: Progress, *, pages: bool = True) -> Planned:
    """The plan in lines through each waypoint, not flown."""
    with job_findings.asking_units(job):
        planned = plan_of(job, plan_motion(job.plan, job.cell, job.feed, progress, pages=pages))
    return motion_predistortion.as_logged(planned)


def _flown(planned: Planned, named: Planned, progress: Progress, date: str) -> Planned:
    """A plan with what is known of it, the twin still driving the text of its named positions on another thread."""
    progress(stages.TWIN_BEFORE, 0.0)
    flight = run_in_background(partial(_fly_uncorrected, named, date), len(named.theta))
    return replace(planned, twin_result=flight, findings=tuple(_plan_findings(planned)))


def _fly_uncorrected(planned: Planned, date: str) -> tuple[Deviation, WrittenMotion]:
    """What the twin does with the uncorrected text, of many starts as warm as in their mean."""
    job, path = planned.job, planned.path
    prepared = prepared_for(job, planned_program(job, path, planned.theta, planned.trajectory, date))
    if job.ensemble is not None:
        prepared = prepared.with_rise(planned.rise)
    written = read_motion(prepared, np.diff(path.arc), planned.feed * path.pace, path.touching_segments())
    return deviation_of(path, prepared), motion_predistortion.as_commanded(planned, written)


def _plan_findings(planned: Planned) -> Iterator[Finding]:
    """What is known of a plan before anything is flown: where models leave what was measured, and what files say."""
    job, path, theta, rise = planned.job, planned.path, planned.theta, planned.rise
    time, places, on_part = planned.time, path.target.position, path.rows_on_part()
    driven = DrivenPoses(theta=theta, position=places, rise=rise, directions=planned.motion, contact=path.contact)
    hot = extrapolations(job.cell.heat, job.duties_before(), job.feed, time[-1], rise, job.history.step_at)
    yield from [
        *(Finding.of(Code.THERMAL_BOX, text) for text in hot),
        *map_findings(job.sources, places[on_part], on_part),
        *joint_box_findings(job.robot, job.cell.joint_box, theta[on_part]),
        *unknown_start_findings(job.robot, job.sources, planned.model, driven),
        *frame_findings(job.frame, job.cell.robot_file_hash, job.cell.heat.names),
        *assumed_findings(job.cell),
        *job.input_findings,
        *dry_run_findings(job, path),
    ]
    if not job.history.before and job.heat.start is None:
        yield Finding.of(Code.THERMAL_COLD, "no [[before]]: the cell starts cold")
    if job.robot.controller.compensation == "signature":
        text = "the controller corrects its own geometry: only sources it does not know may be active"
        yield Finding.of(Code.CONTROLLER_SIGNATURE, text)


def generate(
    job: Job, progress: Progress, date: str = DEFAULT_DATE, *, pages: bool = True
) -> tuple[Planned, Corrected]:
    """The corrected program, proven from the text that is delivered.

    Args:
        job: The planned program.
        progress: Called with the stage and the share done.
        date: In the program's header.
        pages: Whether a program that is more than the controller holds in one file is written as pages.

    Raises:
        ImpossibleError: The robot cannot drive the path, or no legal correction exists.
        JoinError: Pages, read back, are not the program.
        TwinError: The twin cannot drive the program, uncorrected or corrected.
    """
    planned = plan_uncorrected(job, progress, date, pages=pages)
    job = planned.job
    as_written = pages and keeps_waypoints(job.plan.process)  # uncorrected: what the day before was driven as
    other, unknown_form = model_form.plan_other_day(job, planned.joint_motion if as_written else None)
    planned, problem, solution, limited = find_correction(planned, progress)
    path = planned.path
    commanded = problem.commanded(solution.correction)
    trajectory = final_timing(planned, problem, solution, progress)
    solution = motion_predistortion.from_targets(solution, problem, path)
    progress(stages.TEXT, 0.0)
    window = start_window(planned, solution.theta)
    driven = planned.driven(solution.theta, problem.direction_state)
    late = late_start(job, window)
    band = band_along(driven, late)
    program = compose_program(job, commanded, solution.theta, trajectory, path, date, window)[0]
    delivered = _delivered(planned, solution, program, window)
    del program, commanded
    planned.deviation()
    prepared = prepared_for(job, delivered.program)
    written = read_motion(prepared, np.diff(path.arc), planned.feed * path.pace, moves_otherwise(planned))
    deviation, averaged = _fly_corrected(planned, problem, solution, trajectory, prepared, progress)
    progress(stages.CROSS_FLIGHT, 0.0)
    form, form_findings = model_form.cross_flight(job, other, prepared, deviation)
    drawn = fly_program_draws(driven, prepared, deviation, late, partial(progress, stages.DRAWS))
    corrected = Corrected(
        solution=solution,
        trajectory=trajectory,
        program=delivered.program,
        delivery=delivered,
        twin=prepared.twin,
        before=job.history.before,
        air=job.history.air,
        samples=prepared.first_samples(),
        deviation=deviation,
        written=written,
        start_window=window,
        mid_spatial=_ripple(planned, solution),
        band=band,
        model_form=form,
        draws=drawn,
        findings=(),
        averaged=averaged,
    )
    verdict = _verdict(planned, corrected, prepared, limited, [*unknown_form, *form_findings])
    return planned, replace(corrected, findings=tuple(verdict))


def moves_otherwise(planned: Planned) -> BoolArray | None:
    """The segments on the part of a corrected text whose motion the uncorrected one does not tell; else None."""
    process = planned.job.plan.process
    names_others = process.arcs or process.thin is not None
    return planned.path.touching_segments() if planned.job.robot.motion is not None or names_others else None


def _fly_corrected(
    planned: Planned,
    problem: Problem,
    solution: Solution,
    trajectory: Trajectory,
    prepared: PreparedProgram,
    progress: Progress,
) -> tuple[Deviation, Averaged | None]:
    """What the twin does with a corrected text, of many starts the worst; and what it leaves over these."""
    tell = partial(progress, stages.TWIN_AFTER)
    if planned.job.ensemble is None:
        return deviation_of(planned.path, prepared, tell), None
    program, motion = planned.driven(solution.theta, planned.motion), planned.joint_motion
    file = WrittenFile(program=program, motion=motion, prepared=prepared, problem=problem, trajectory=trajectory)
    averaged = fly_starts(file, tell)
    return averaged.worst, averaged


def _ripple(planned: Planned, solution: Solution) -> float:
    """What a correction puts onto the surface, rms [m]: of arcs as it was found on the dense waypoints."""
    if planned.dense is not None:
        return mid_spatial(planned.dense.path, planned.dense.correction)
    return mid_spatial(planned.path, solution.correction)


def _verdict(
    planned: Planned,
    corrected: Corrected,
    prepared: PreparedProgram,
    limited: Sequence[Finding],
    of_form: Sequence[Finding],
) -> Iterator[Finding]:
    """Everything that is found of a corrected program; given what its limits and the other heat model say."""
    job, path, controller = planned.job, planned.path, planned.job.robot.controller
    text, written, trajectory = corrected.program, corrected.written, corrected.trajectory
    yield from [
        *judge(corrected.deviation, job.bounds),
        *own_file_findings(job, path, corrected.deviation),
        *(corrected.draws.findings() if corrected.draws is not None else []),
        *job_findings.of_knowledge(job),
        *limited,
        *job_findings.solver(corrected.solution, job.settings),
        *job_findings.below_feed(job, planned.feed, path, trajectory),
        *job_findings.words_off(trajectory, text),
        *delivery.size_findings(job, corrected.delivery, planned.page_stops),
        *job_findings.clocks_apart(trajectory, written),
        *motion_predistortion.findings(planned, prepared, written, corrected.deviation),
        *times_apart(controller, written),
        *over_periods(controller, path, text, planned.feed),
        *job_findings.joints_asked(job, text, written),
        *job_findings.orientation_on_arcs(job, text),
        *(averaging_findings(corrected.averaged) if corrected.averaged is not None else ()),
        *of_form,
        *planned.findings,
    ]
    if corrected.mid_spatial > MAX_RIPPLE:
        puts = f"the correction puts {corrected.mid_spatial / UM:.2f} um rms at periods of 1 to 20 mm onto the surface"
        yield Finding.of(Code.COMPENSATION_MID_SPATIAL, f"{puts}; raise compensation.curvature_period_mm")


def find_correction(planned: Planned, progress: Progress) -> tuple[Planned, Problem, Solution, list[Finding]]:
    """The correction of a plan: the waypoints that it keeps, their problem, its solution, and the limits that bind.

    Raises:
        ImpossibleError: No legal correction exists.
    """
    job = planned.job
    problem = _problem_of(planned)
    solution = _solved(problem, job, progress, stages.CORRECTION)
    limited = list(job_findings.limited(solution))
    arcs = job.plan.process.arcs
    if job.plan.process.thin is not None and not arcs:
        progress(stages.THINNING, 0.0)
        planned, solution = _thinned(planned, solution, job.plan.process.thin)
        problem = problem.window(planned.rows)
    if reversal_widths(job.sources) is not None:
        progress(stages.DIRECTIONS, 0.0)
        problem = replace(problem, direction_state=_written_directions(problem, solution, planned))
        solution = _solved(problem, job, progress, stages.DIRECTIONS)
        limited = list(job_findings.limited(solution))
    if arcs:
        progress(stages.ARCS, 0.0)
        moves = corrected_arcs.fit_job_moves(planned, problem.commanded(solution.correction), solution.theta)
        planned, problem, solution = corrected_arcs.with_arcs(planned, problem, solution, moves)
    return planned, problem, solution, limited


def final_timing(planned: Planned, problem: Problem, solution: Solution, progress: Progress) -> Trajectory:
    """The timing of a corrected program, as its joints are driven, with words for its times as it is commanded."""
    as_driven = motion_predistortion.as_smoothed(solution, problem, planned)
    timed = corrected_arcs.time_corrected(planned, as_driven.theta, progress)
    return motion_predistortion.at_planned_times(timed, planned, problem.commanded(solution.correction))


def _problem_of(planned: Planned) -> Problem:
    """The problem of a plan's waypoints, its targets moved against the motion, its limits narrowed by their margins."""
    job, path = planned.job, planned.path
    # a stop for a page's sake is no corner of the path: the correction stays smooth across it
    corners = path.stop & ~planned.page_stops.added if planned.page_stops is not None else path.stop
    problem = Problem(
        robot=job.robot,
        model=planned.model,
        posture=job.posture,
        tool=job.tool.pose,
        target=path.target,
        theta=planned.theta,
        rise=planned.rise,
        arc=path.arc,
        stop=corners,
        direction_state=planned.motion,
    )
    problem = motion_predistortion.predistorted(problem, planned)
    problem = limits.with_rounding_margin(problem, resolution(job.robot.controller.decimals))
    if job.settings.margin:
        open_yet = planned.band_of_plan()
        problem = limits.with_uncertainty_margin(problem, open_yet.rows, open_yet.moment, job.settings.margin)
    return problem


def _solved(problem: Problem, job: Job, progress: Progress, stage: RunStage) -> Solution:
    """The solution of a problem; raises ImpossibleError where it has none that is legal."""
    solution = optimise.optimise(problem, job.settings, _stage(progress, stage, job.settings))
    if not solution.status.is_legal:
        raise ImpossibleError(f"{job.source}: {job_findings.why_uncorrected(solution)}")
    return solution


def late_start(job: Job, window: float) -> float:
    """How late a start may be that the proof has not flown [s]: none of a file that was flown at its delays."""
    return window if job.ensemble is None or job.ensemble.delay[1] == 0 else 0.0


def _written_directions(problem: Problem, solution: Solution, planned: Planned) -> DirectionState:
    """Where joints and TCP come from on the way that the text's rounded poses name.

    A joint that the planned path leaves at rest steps to and fro by what the digits round, and forgets the side it came
    from: that is known only once there is a correction to round.
    """
    job, commanded = planned.job, problem.commanded(solution.correction)
    printed = printed_in_world(job, commanded)
    if job.plan.process.arcs:
        moves = corrected_arcs.fit_job_moves(planned, commanded, solution.theta)
        printed = flown_at_waypoints(problem.arc, printed, moves)
    joints, _ = inverse_kinematics.solve_tool(job.robot, printed, job.tool.pose, job.posture)
    theta = joint_path.nearest_turns(joints, solution.theta)
    start = problem.direction_state.at(slice(0, 1))
    return command_directions(job.sources, theta, printed.position, problem.direction_state, start)


def _stage(progress: Progress, stage: RunStage, settings: Settings) -> Callable[[float], None]:
    """Tells a stage's share; of ipopt, which takes minutes, in words as well."""
    if settings.solver is Solver.IPOPT:
        return lambda share: progress(RunStage(stage, f"ipopt {share:.0%}", is_even=False), share)
    return lambda share: progress(stage, share)


def _thinned(planned: Planned, solution: Solution, tolerance: float) -> tuple[Planned, Solution]:
    """The plan and its correction at those waypoints only that the written program keeps."""
    path, period = planned.path, planned.job.robot.controller.period
    rows = simplify.simplify(path, solution.theta, solution.correction[:, :3], tolerance, planned.feed * period)
    N = len(path.arc)
    message = f"{N - len(rows)} of {N} waypoints are left out: lines stay within {tolerance / UM:g} um of the path"
    findings = (*planned.findings, Finding.of(Code.PATH_THINNED, message))
    return replace(planned.at(rows), findings=findings), solution_at(solution, rows)


def start_window(planned: Planned, theta: Array) -> float:
    """How long the start may be delayed, servo on and standing [s], with commanded joints (N, 6) [rad].

    Until it adds more than ``job.start_drift``; a file that serves an interval of delays may be started within it.
    """
    if planned.job.ensemble is not None and planned.job.ensemble.delay[1] > 0:
        return planned.job.ensemble.delay[1]
    return float(start_windows(planned, theta, np.zeros(1, dtype=np.int64))[0])


def start_windows(planned: Planned, theta: Array, first: IntArray) -> Array:
    """How long the robot may wait at each of some waypoints, (P,) rising numbers from 0, to (P,) [s]."""
    job = planned.job
    state = states_at(job.heat, job.state(), planned.joint_motion, first, job.history.air, job.clock)
    return longest_waits(job, planned.model, planned.driven(theta, planned.motion), first, state)


def _delivered(planned: Planned, solution: Solution, program: Program, window: float) -> Delivery:
    """The program's files: pages when they are needed and possible; the start may be delayed by ``window`` [s]."""
    if planned.page_stops is None or planned.page_stops.obstacle:
        return delivery.deliver_file(program)

    def starts_at(first: IntArray) -> list[PageStart]:
        windows = start_windows(planned, solution.theta, first)
        windows[0] = window
        time, rise = planned.trajectory.time[first], planned.rise[first]
        if planned.job.ensemble is not None:
            rise[0] = planned.job.start_rise()  # from which the start window counts
        return [PageStart(*now) for now in zip(time.tolist(), rise, windows.tolist(), strict=True)]

    return delivery.deliver_pages(planned.job, program, starts_at)
