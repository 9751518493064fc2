"""The twin of a job: the real arm that its files describe."""

from compgen.pipelines.job import Job
from compgen.verification.twin import Twin
from compgen.verification.twin_of import flaws_of


def twin_of(job: Job) -> Twin:
    """The real arm of a job."""
    return Twin(job.robot, job.heat, job.profiles, job.tool_position, job.tool_rotation, flaws_of(job.sources))
