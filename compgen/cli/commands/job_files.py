"""The files that a job leaves: reports and programs."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from compgen.cli.output_files.ownership import check_job_folder, check_planned_program, resume_files
from compgen.cli.output_files.publish import publish
from compgen.core import stages
from compgen.core.commands import Command
from compgen.core.stages import Progress
from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX
from compgen.job.job import Job
from compgen.pipelines.planned.planned_delivery import COMMENT, planned_name_of
from compgen.pipelines.planned.program_text import program_name_of


def check_folder(folder: Path, command: Command, job: Job) -> None:
    """Raises InputError when a job's files would replace what another command, or a run of another job, has written."""
    check_job_folder(folder, command, job.name, f"{program_name_of(job)}.LS")
    if command is Command.PREDICT:
        check_planned_program(folder, f"{planned_name_of(job)}.LS", COMMENT)


def publish_job(
    folder: Path, programs: Mapping[str, bytes], reports: Mapping[str, bytes | Iterable[bytes]], job: Job,
    progress: Progress, is_planned: bool = False,
) -> None:  # fmt: skip
    """Put a job's files into its folder; an earlier run's program and pages go where this run writes none."""
    program = planned_name_of(job) if is_planned else program_name_of(job)
    contents = {
        name: _with_progress(content, progress, 0.6 + 0.4 * k / len(reports))
        for k, (name, content) in enumerate(reports.items())
    }
    own_names = {f"{program}.LS", *resume_files(folder)}
    publish(folder, programs, contents, own_names, f"{program}{MANIFEST_SUFFIX}")


def _with_progress(content: bytes | Iterable[bytes], progress: Progress, share: float) -> Iterable[bytes]:
    for block in [content] if isinstance(content, bytes) else content:
        progress(stages.REPORT, share)
        yield block
