"""A job's motion without its heat: path, joints and timing at any feed."""

from compgen.core.exceptions import InputError
from compgen.pipelines.job import Job
from compgen.planning import retiming, toolpath
from compgen.planning.retiming import Trajectory
from compgen.planning.toolpath import ToolPath
from compgen.robot import inverse_kinematics
from compgen.thermal import JointMotion


def rehearse(job: Job, feed: float) -> tuple[ToolPath, JointMotion, Trajectory]:
    """Plan a job's path and drive it at a feed [m/s].

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    try:
        path = toolpath.build(job.pattern, job.surface, job.boundary, spin=job.spin, chord=job.chord, lift=job.lift)
    except InputError as failure:
        raise InputError(f"{job.source}: {failure}") from failure
    flange = inverse_kinematics.flange_of(path.position, path.rotation, job.tool_position, job.tool_rotation)
    theta = inverse_kinematics.follow(job.robot, *flange, job.posture)
    trajectory = retiming.retime(job.robot, path.arc, theta, path.stop, feed)
    return path, JointMotion(trajectory.time, theta, trajectory.driven), trajectory
