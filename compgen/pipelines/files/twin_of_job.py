"""The twin of a cell and of a job: the real arm that their files describe."""

from compgen.core.pose import IDENTITY
from compgen.job.job import Cell, Job
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import Twin


def twin_of_cell(cell: Cell) -> Twin:
    """The real arm of a cell, to its flange: programs that exist name their tools themselves."""
    return Twin(
        robot=cell.robot,
        heat=cell.warming,
        profiles=cell.profiles,
        tool=IDENTITY,
        faults=faults_of(cell.sources),
    )


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
