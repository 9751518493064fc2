"""Commands on a path file: generate, predict, check."""

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from compgen.cli import publish
from compgen.cli.app import (
    Date,
    OutDir,
    PathFile,
    Quiet,
    RobotName,
    Set,
    Workers,
    app,
    checked_date,
    output_folder,
    say_error,
    use_machine,
    write_file,
)
from compgen.cli.progress_bar import CHECK, GENERATE, PREDICT, stages
from compgen.core.exceptions import InputError
from compgen.core.findings import Level, Progress
from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX
from compgen.pipelines import generate as pipeline
from compgen.pipelines.generate import Corrected, Planned
from compgen.pipelines.job import Job
from compgen.pipelines.path_file import load_job
from compgen.pipelines.program_text import DATE, program_name_of
from compgen.report import job_html, job_json, job_summary, waypoints_blocks


@app.command()
def generate(
    path: PathFile,
    robot: RobotName = None,
    output: OutDir = None,
    set_: Set = None,
    date: Date = DATE,
    force: Annotated[bool, typer.Option("--force", help="Write the program even outside its bounds.")] = False,
    pages: Annotated[
        bool, typer.Option("--pages/--no-pages", help="Part a program that is more than the controller holds.")
    ] = True,
    quiet: Quiet = False,
    workers: Workers = None,
) -> None:
    """Write the corrected program and its proof."""
    use_machine(workers)
    folder = output_folder(path, output)
    with stages(quiet, GENERATE) as progress:
        job = load_job(path, robot, set_ or ())
        planned, corrected = pipeline.generate(job, progress, checked_date(date), pages)
        progress("report", 0.0)
        files = _files(planned, corrected)
        program = f"{corrected.program.name}.LS"
        if corrected.inside or force:
            files |= dict(corrected.delivery.files)
        _publish(folder, files, job, progress)
    if not quiet:
        _show(planned, corrected, folder, files)
    if not corrected.inside:
        told = "written all the same (--force)" if force else f"{program} not written; --force writes it"
        worst = next(f.message for f in corrected.findings if f.level is Level.OUTSIDE)
        raise typer.Exit(say_error(f"outside bounds: {worst}; {told}", 1))


@app.command()
def predict(
    path: PathFile,
    robot: RobotName = None,
    output: OutDir = None,
    set_: Set = None,
    quiet: Quiet = False,
    workers: Workers = None,
) -> None:
    """Predict the error of the planned program, without correcting it."""
    use_machine(workers)
    folder = output_folder(path, output)
    with stages(quiet, PREDICT) as progress:
        job = load_job(path, robot, set_ or ())
        planned = pipeline.predict(job, progress)
        progress("report", 0.0)
        files = _files(planned, None)
        _publish(folder, files, job, progress)
    if not quiet:
        _show(planned, None, folder, files)


@app.command()
def check(
    path: PathFile,
    robot: RobotName = None,
    set_: Set = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
    junit: Annotated[str | None, typer.Option("--junit", help="Write a JUnit XML file.")] = None,
    quiet: Quiet = False,
    workers: Workers = None,
) -> None:
    """Generate in memory and verify; exit 1 outside the bounds. Writes no program."""
    use_machine(workers)
    with stages(quiet or as_json, CHECK) as progress:
        job = load_job(path, robot, set_ or ())
        if junit is not None:
            if not junit or Path(junit).is_dir():
                raise InputError(f"--junit '{junit}': not a file's name; give one")
            publish.check_writable(Path(junit).absolute().parent)
        planned, corrected = pipeline.generate(job, progress)
    data = job_summary(planned, corrected)
    if junit is not None:
        write_file(Path(junit), _junit(data))
    if as_json:
        sys.stdout.write(json.dumps(data, indent=2, allow_nan=False) + "\n")
    elif not quiet:
        _show(planned, corrected, None, {})
    if not corrected.inside:
        worst = next(f.message for f in corrected.findings if f.level is Level.OUTSIDE)
        raise typer.Exit(1 if as_json else say_error(f"outside bounds: {worst}", 1))


def _files(planned: Planned, corrected: Corrected | None) -> dict[str, bytes | Iterable[bytes]]:
    return {
        "report.json": job_json(planned, corrected),
        "waypoints.csv": waypoints_blocks(planned, corrected),
        "report.html": job_html(planned, corrected),
    }


def _show(planned: Planned, corrected: Corrected | None, folder: Path | None, files: Iterable[str]) -> None:
    from compgen.cli.job_table import show_job  # here: a quiet run starts without tables

    show_job(planned, corrected, folder, files)


def _publish(folder: Path, files: dict[str, bytes | Iterable[bytes]], job: Job, progress: Progress) -> None:
    def told(content: bytes | Iterable[bytes], share: float) -> Iterable[bytes]:
        for block in [content] if isinstance(content, bytes) else content:
            progress("report", share)
            yield block

    program = program_name_of(job)
    ours = {"report.json", "waypoints.csv", "report.html", f"{program}.LS", *files}
    each = {name: told(content, 0.6 + 0.4 * k / len(files)) for k, (name, content) in enumerate(files.items())}
    publish.publish(folder, each, ours | publish.files_of_earlier_run(folder / f"{program}{MANIFEST_SUFFIX}"))


def _junit(data: dict[str, Any]) -> bytes:
    """A test case for each bound, failed by its finding."""
    from xml.sax.saxutils import quoteattr  # here: it brings the libraries of the web

    broken = {f["code"]: f["message"] for f in data["findings"] if f["level"] == "outside"}
    cases = [f"bounds.{key}" for key in data["bounds"]]
    cases += [code for code in broken if code not in cases]
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines.append(
        f'<testsuite name={quoteattr("compgen." + data["name"])} tests="{len(cases)}" failures="{len(broken)}">'
    )
    for case in cases:
        start = f"  <testcase classname={quoteattr('compgen.' + data['name'])} name={quoteattr(case)}"
        if case in broken:
            lines.append(f"{start}><failure message={quoteattr(broken[case])}/></testcase>")
        else:
            lines.append(f"{start}/>")
    return ("\n".join([*lines, "</testsuite>"]) + "\n").encode()
