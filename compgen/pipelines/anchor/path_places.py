"""A program's path as anchoring needs it: places evenly along the part, their joints and times."""

from dataclasses import dataclass

import numpy as np

from compgen.core.arrays import Array
from compgen.core.exceptions import naming_file
from compgen.job.job import Job
from compgen.job.motion_plan import COARSE
from compgen.planning import toolpath
from compgen.planning.exact_path import MAX_SPACING
from compgen.robot import inverse_kinematics, joint_path

PLACES = 200


@dataclass(frozen=True, eq=False, slots=True)
class PathPlaces:
    """M places along the part, evenly."""

    position: Array  # (M, 3) [m] World
    theta: Array  # (M, 6) [rad]
    time: Array  # (M,) [s] from the program's start, at its feed

    @property
    def middle(self) -> Array:
        """Of the part, (3,) [m]."""
        return np.asarray((self.position.min(axis=0) + self.position.max(axis=0)) / 2)

    @property
    def radius(self) -> float:
        """Farthest place from the middle [m]."""
        return float(np.linalg.norm(self.position - self.middle, axis=1).max())


def path_places(job: Job, count: int = PLACES) -> PathPlaces:
    """Places along a job's part.

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    plan, tool = job.plan.path, job.tool
    with naming_file(job.source):
        path = toolpath.plan_tool_path(
            plan.pattern,
            plan.surface,
            plan.boundary,
            spin=tool.spin,
            chord=COARSE,
            lift=0.0,
            spacing=MAX_SPACING,
            frame=plan.place,
        )
        flange = inverse_kinematics.flange_from_tool(path.target, tool.pose)
        theta = joint_path.follow_branch(job.robot, flange, job.posture)
    on = np.flatnonzero(path.contact if path.contact.any() else np.ones_like(path.contact))
    along = np.cumsum(np.diff(path.arc, prepend=path.arc[0])[on])
    some = on[np.unique(np.searchsorted(along, np.linspace(0.0, along[-1], count)).clip(max=len(on) - 1))]
    return PathPlaces(path.target.position[some], theta[some], path.arc[some] / job.feed)
