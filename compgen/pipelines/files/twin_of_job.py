"""The twin of a job: the real arm that its files describe."""

from compgen.job.job import Job
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import Twin


def twin_of(job: Job) -> Twin:
    """The real arm of a job."""
    uframe = None if job.frame is None else job.frame.register
    return Twin(
        robot=job.robot,
        heat=job.heat,
        profiles=job.cell.profiles,
        tool=job.tool.pose,
        faults=faults_of(job.sources),
        uframe=uframe,
    )
