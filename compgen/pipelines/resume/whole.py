"""The plan of a whole job, as it was when its pages were written: path, joints, stops and times.

None of it depends on how warm the robot is, so that the pages of another day begin and end at the same waypoints.
"""

from dataclasses import dataclass, replace

import numpy as np

from compgen.core.arrays import Array, IntArray, own
from compgen.core.evaluation import run_in_background
from compgen.core.exceptions import InputError
from compgen.core.stages import Progress
from compgen.error_model.direction_memory import DirectionState, direction_states, reversal_widths
from compgen.error_model.model import ErrorModel
from compgen.job.job import Job
from compgen.job.motion_plan import plan_motion
from compgen.pipelines.planned.averaging import planned_rises
from compgen.pipelines.planned.generate import find_correction
from compgen.pipelines.planned.job_results import Planned
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.program.page_stops import PageStops
from compgen.thermal import JointMotion
from compgen.verification.deviation import Deviation
from compgen.verification.written_motion import WrittenMotion


@dataclass(frozen=True, eq=False, slots=True, kw_only=True)
class Whole:
    """N waypoints of a job: those that its program has."""

    job: Job
    feed: float  # [m/s]
    path: ToolPath
    page_stops: PageStops
    model: ErrorModel
    theta: Array  # (N, 6) [rad]
    motion: DirectionState
    trajectory: Trajectory

    def __post_init__(self) -> None:
        own(self, theta=("N", 6))

    @property
    def time(self) -> Array:
        """When the planned motion is at each waypoint, (N,) [s]."""
        return self.trajectory.time

    def motion_from(self, row: int) -> JointMotion:
        """What the drives do from a waypoint on."""
        time = self.time
        return JointMotion(time[row:] - time[row], self.theta[row:], self.trajectory.driven_speed[row:])

    def subset(self, rows: IntArray) -> "Whole":
        """The plan at some of its waypoints, rising."""
        return replace(
            self,
            path=self.path.subset(rows),
            page_stops=self.page_stops.at(rows),
            theta=self.theta[rows],
            motion=self.motion.at(rows),
            trajectory=self.trajectory.at(rows),
        )


def plan_whole(job: Job, progress: Progress) -> Whole:
    """The plan of a job in pages.

    Raises:
        InputError: The job needs no pages, or says its path in arcs.
        ImpossibleError: The robot cannot drive the path.
    """
    if job.plan.process.arcs:
        words = "where arcs begin hangs on the correction, so single pages of them cannot be written anew"
        raise InputError(f"{job.source}: process.moves = 'arcs': {words}; generate the job anew, or in lines")
    plan = plan_motion(job.plan, job.cell, job.feed, progress)
    if plan.page_stops is None or plan.page_stops.obstacle:
        raise InputError(f"{job.source}: this job is one file, and has no pages; generate it anew")
    motion = direction_states(reversal_widths(job.sources), plan.theta, plan.path.target.position)
    whole = Whole(
        job=job,
        feed=plan.feed,
        path=plan.path,
        page_stops=plan.page_stops,
        model=plan.model,
        theta=plan.theta,
        motion=motion,
        trajectory=plan.trajectory,
    )
    if job.plan.process.thin is None:
        return whole
    rows = np.arange(len(plan.theta))
    # which waypoints were left out depends on the correction that was written first
    planned = Planned(
        job=job,
        feed=plan.feed,
        path=plan.path,
        page_stops=plan.page_stops,
        model=plan.model,
        theta=plan.theta,
        motion=motion,
        trajectory=plan.trajectory,
        rise=planned_rises(job, plan.joint_motion),
        twin_result=run_in_background(_not_flown, 1),
        findings=(),
        rows=rows,
    )
    kept, *_ = find_correction(planned, progress)
    return whole.subset(kept.rows)


def _not_flown() -> tuple[Deviation, WrittenMotion]:
    """In place of a flight that nobody asks for."""
    raise InputError("the plan of a whole job is not flown; resume it from a page on")
