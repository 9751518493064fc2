"""A job's motion without its heat: path, joints and timing at any feed."""

from compgen import ik, timing, toolpath
from compgen.exceptions import InputError
from compgen.job import Job
from compgen.thermal import Motion
from compgen.timing import Trajectory
from compgen.toolpath import ToolPath


def rehearse(job: Job, feed: float) -> tuple[ToolPath, Motion, Trajectory]:
    """Plan a job's path and drive it at a feed [m/s].

    Raises:
        ImpossibleError: The robot cannot drive the path.
    """
    try:
        path = toolpath.build(job.pattern, job.surface, job.boundary, spin=job.spin, chord=job.chord, lift=job.lift)
    except InputError as failure:
        raise InputError(f"{job.source}: {failure}") from failure
    flange = ik.flange_of(path.position, path.rotation, job.tool_position, job.tool_rotation)
    theta = ik.follow(job.robot, *flange, job.posture)
    trajectory = timing.retime(job.robot, path.arc, theta, path.stop, feed)
    return path, Motion(trajectory.time, theta, trajectory.driven), trajectory
