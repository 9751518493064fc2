"""The command that follows the warmth of a job's day."""

import sys

from compgen.cli.options import (
    JobRobot,
    OutputFolder,
    Overrides,
    PathFile,
    Quiet,
    StateAge,
    StateFile,
    output_folder,
    with_state,
)
from compgen.cli.ownership import HEAT, check_heat_folder
from compgen.cli.publish import publish


def heat(
    path: PathFile,
    robot: JobRobot = None,
    output: OutputFolder = None,
    overrides: Overrides = None,
    state: StateFile = None,
    state_age: StateAge = None,
    quiet: Quiet = False,
) -> None:
    """Follow the warmth over [[before]], [[cycle]] and [[after]], and what one corrected file is worth in each run."""
    from compgen.pipelines.path_file import load_job
    from compgen.pipelines.study import timeline
    from compgen.report.heat_page import heat_csv, heat_html, heat_json, heat_sentences, runs_csv

    folder = output_folder(path, output, "_heat")
    job = load_job(path, robot, with_state(path, overrides, state, state_age))
    check_heat_folder(folder, job.name)
    day = timeline(job)
    files = {
        HEAT: heat_json(job, day),
        "heat.csv": heat_csv(job, day),
        "heat.html": heat_html(job, day),
        "runs.csv": runs_csv(job, day),
    }
    publish(folder, {}, files, set(files))
    if not quiet:
        sys.stdout.write("".join(f"{sentence}\n" for sentence in heat_sentences(job, day)))
        sys.stdout.write("".join(f"{finding.level.value}: {finding.message}\n" for finding in job.unlikely))
        sys.stdout.write(f"wrote {', '.join(sorted(files))} to {folder}\n")
