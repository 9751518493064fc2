"""The twin of a job: the real arm that its files describe."""

from compgen.pipelines.job import Job
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import Twin


def twin_of(job: Job) -> Twin:
    """The real arm of a job."""
    uframe = None if job.frame is None else job.frame.register
    return Twin(job.robot, job.heat, job.cell.profiles, job.tool.pose, faults_of(job.sources), uframe)
