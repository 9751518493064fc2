"""The plan of a whole job, as it was when its pages were written: path, joints, stops and times.

None of it depends on how warm the robot is, so that the pages of another day begin and end at the same waypoints.
"""

from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.job.job import Job
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.planned.generate import find_correction
from compgen.pipelines.planned.job_results import Planned, plan_of
from compgen.pipelines.planned.motion_predistortion import as_logged


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
