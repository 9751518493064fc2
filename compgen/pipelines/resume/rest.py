"""The rest of a job's plan from a page on, as a plan of its own that begins as warm as the robot then is.

The plan of a whole job, as it was when its pages were written: path, joints, stops and times.

None of it depends on how warm the robot is, so that the pages of another day begin and end at the same waypoints.
"""

from dataclasses import replace

import numpy as np

from compgen.core.arrays import Array
from compgen.core.evaluation import run_in_background
from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.job.job import Job
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.files.twin_of_job import twin_of
from compgen.pipelines.planned.generate import find_correction
from compgen.pipelines.planned.job_results import Planned, plan_of
from compgen.pipelines.planned.motion_predistortion import as_logged
from compgen.pipelines.resume.beginning import Begun, air_from
from compgen.program.program import Program
from compgen.thermal import rises_during
from compgen.thermal.schedule import History
from compgen.verification.deviation import Deviation, deviation_from_path
from compgen.verification.twin import PreparedProgram, prepare
from compgen.verification.written_motion import WrittenMotion, read_motion


def rest_of_job(whole: Planned, begun: Begun) -> Job:
    """The job that begins with a page: its heat starts with the state there, and nothing is before it."""
    job = whole.job
    history = History(standing=job.history.standing, air=air_from(whole, begun))
    process = replace(job.plan.process, thin=None)  # which waypoints are left out is settled
    return replace(
        job,
        plan=replace(job.plan, process=process),
        cell=replace(begun.cell, heat=begun.cell.heat.starting(begun.state), past=begun.past),
        history=history,
        ensemble=None,
        on_other_heat_model=None,
    )


def rest_of_plan(whole: Planned, first: int, begun: Begun, old: Program, lead: Program | None) -> Planned:
    """The plan from a waypoint on.

    Args:
        whole: The plan of the job.
        first: The waypoint that a page starts at.
        begun: How warm the robot is there.
        old: The text of these pages so far; the twin flies it from the same beginning.
        lead: The text of the page before, which play remembers; None: there is none.
    """
    job = rest_of_job(whole, begun)
    rest = whole.at(np.arange(first, len(whole.theta)))
    trajectory = replace(rest.trajectory, time=rest.time - rest.time[0])
    stops = rest.page_stops
    if stops is not None:  # where it starts is its end
        stops = replace(stops, added=np.append(False, stops.added[1:]))
    rise = rises_during(job.heat, begun.state, rest.joint_motion.between(0), job.history.air, 0.0).rise

    def fly_old() -> tuple[Deviation, WrittenMotion]:
        prepared = prepared_rest(job, old, lead)
        written = read_motion(prepared, np.diff(rest.path.arc), rest.feed * rest.path.pace)
        return deviation_from_path(rest.path, prepared.chunks(), prepared.sample_count), written

    flight = run_in_background(fly_old, len(rest.theta))
    model = rest.model if begun.cell is whole.job.cell else job.cell.error_model(job.tool.pose)
    return replace(
        rest,
        job=job,
        page_stops=stops,
        model=model,
        trajectory=trajectory,
        rise=rise,
        twin_result=flight,
        rows=np.arange(len(rest.theta)),
    )


def prepared_rest(job: Job, text: Program, lead: Program | None) -> PreparedProgram:
    """The text of a rest on the twin, whose play has gone the way of the page before."""
    twin = twin_of(job)
    prepared = prepare(twin, text, (), job.history.air)
    if twin.only_grows or lead is None:
        return prepared
    before = prepare(twin, lead, (), job.history.air)
    return replace(prepared, history=before.direction_history())


def tool_at_end(job: Job, text: Program, rise: Array) -> Array:
    """Where the real tool stands at the end of a text, with given rises (K,) [K]: (3,) [m] in World."""
    prepared = prepare(twin_of(job), text, (), job.history.air)
    execution = prepared.with_rise(np.broadcast_to(rise, (len(text.position), len(rise)))).execute()
    return np.asarray(execution.actual.position[-1])


def plan_whole(job: Job, progress: Progress) -> Planned:
    """The plan of a job in pages, at the waypoints that its program has; it is not flown.

    Raises:
        InputError: The job needs no pages, or says its path in arcs.
        ImpossibleError: The robot cannot drive the path.
    """
    if job.plan.process.arcs:
        words = "where arcs begin hangs on the correction, so single pages of them cannot be written anew"
        raise InputError(f"{job.source}: process.moves = 'arcs': {words}; generate the job anew, or in lines")
    motion = plan_motion(job.plan, job.cell, job.feed, progress)
    if motion.page_stops is None or motion.page_stops.obstacle:
        raise InputError(f"{job.source}: this job is one file, and has no pages; generate it anew")
    whole = as_logged(plan_of(job, motion))
    if job.plan.process.thin is None:
        return whole
    # which waypoints were left out depends on the correction that was written first
    kept, *_ = find_correction(whole, progress)
    return whole.at(kept.rows)
