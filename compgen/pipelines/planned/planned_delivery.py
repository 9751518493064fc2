"""The planned program as files for the controller, called what it is everywhere: planned, not corrected.

Its name ends in ``_PLAN``, its comment and each of its pages say it, and no manifest of it can be resumed. The text is
read back and is the program that the twin has flown for the prediction, number by number.
"""

from collections.abc import Sequence
from dataclasses import replace

from compgen.core.commands import Command
from compgen.core.dates import DEFAULT_DATE
from compgen.core.version import __version__
from compgen.job.job import Job
from compgen.pipelines.planned.delivery import (
    Delivery,
    deliver_file,
    deliver_parted,
    part_program,
    require_equal,
    size_findings,
)
from compgen.pipelines.planned.job_results import Planned
from compgen.pipelines.planned.program_text import compose_program, rise_remarks
from compgen.program.program import Program, program_name

PLAN = "_PLAN"  # behind the name of a program that is not corrected
COMMENT = "compgen PLANNED"


def planned_name_of(job: Job) -> str:
    """The name of the job's planned program on the controller."""
    return f"{program_name(job.name, job.robot.controller.capacity.name_length - len(PLAN))}{PLAN}"


def deliver_planned(planned: Planned, date: str = DEFAULT_DATE) -> tuple[Planned, Delivery]:
    """The files of a prediction's program, and the prediction with what is said of their size.

    Args:
        planned: The prediction.
        date: In the program's header.

    Raises:
        ImpossibleError: It cannot be split so that each page fits.
        InputError: The format cannot say it.
        JoinError: The text, read back, is not the program that was flown.
    """
    job, path = planned.job, planned.path
    program, _ = compose_program(job, path.target, planned.theta, planned.trajectory, path, date, None)
    program = replace(program, name=planned_name_of(job), comment=COMMENT)
    if planned.page_stops is None or planned.page_stops.obstacle:
        delivered = deliver_file(program)
        require_equal(delivered.program, program)
    else:
        delivered = _deliver_pages(planned, program)
    notes = size_findings(job, delivered, planned.page_stops)
    return replace(planned, findings=(*notes, *planned.findings)), delivered


def _deliver_pages(planned: Planned, program: Program) -> Delivery:
    """The program as pages; each says when it begins and how warm the robot is then, and none how long it may wait."""
    job = planned.job

    def headings(first: Sequence[int]) -> list[list[str]]:
        times = planned.trajectory.time[list(first)].tolist()
        pages = [f"page {k + 1} of {len(first)}, after {time:.0f} s" for k, time in enumerate(times)]
        rises = [rise_remarks(job, planned.rise[row]) for row in first]
        return [[*program.remarks, page, *rise] for page, rise in zip(pages, rises, strict=True)]

    paged = part_program(job, program, headings, program.remarks)
    head = {
        "command": Command.PREDICT,
        "compgen": __version__,
        "planned": "not corrected",
        "inputs_sha256": job.inputs_hash,
        "robot": job.robot.name,
    }
    return deliver_parted(job, program, paged, head)
