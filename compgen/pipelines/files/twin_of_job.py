"""The twin of a cell and of a job: the real arm that their files describe, and a job's text on it."""

from collections.abc import Callable

from compgen.core.pose import IDENTITY
from compgen.job.job import Cell, Job
from compgen.planning.toolpath import ToolPath
from compgen.program.program import Program
from compgen.thermal.ensemble import Start, duties_before
from compgen.verification.deviation import Deviation, deviation_from_path
from compgen.verification.sources_to_faults import faults_of
from compgen.verification.twin import PreparedProgram, Twin, prepare


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


def prepared_for(job: Job, program: Program) -> PreparedProgram:
    """A text on the twin, after everything that a job's cell does before it.

    Raises:
        TwinError: The text cannot be followed.
    """
    return prepare(twin_of(job), program, job.history.before, job.history.air)


def at_start(job: Job, prepared: PreparedProgram, start: Start, twin: Twin | None = None) -> PreparedProgram:
    """A text after everything that a job's cell did until a start, by the twin's own heat; default the text's twin."""
    slowed = prepared if start.override == 1 else prepared.at_override(start.override)
    return slowed.reheated(twin or prepared.twin, duties_before(job.history, start), job.history.air)


def deviation_of(
    path: ToolPath, prepared: PreparedProgram, progress: Callable[[float], None] = lambda share: None
) -> Deviation:
    """What the twin does with a text, beside the path that it was written for; ``progress`` gets the share done."""
    return deviation_from_path(path, prepared.chunks(progress), prepared.sample_count)
