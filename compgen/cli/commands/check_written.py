"""``cgen check --written``: a program that was written earlier, judged in the state that the files say now."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compgen.cli.screen.messages import outcome_words
from compgen.core.exceptions import InputError, naming_file


def judge_written(
    path: str, robot: str | None, overrides: Sequence[str], program: str, strict: bool, quiet: bool
) -> tuple[dict[str, Any], str]:
    """The report of a written program, and why it is not inside.

    Args:
        path: The path file that it was made from.
        robot: Robot name or file; None for what the path file says.
        overrides: Of both files: the state that the program is flown in.
        program: Its file.
        strict: Whether assumed accelerations may decide whether the bounds are kept.
        quiet: No progress.

    Raises:
        CompgenError: The program is another path's, or cannot be driven.
    """
    from compgen.cli.screen.progress_bar import PREDICT, show_progress
    from compgen.core.codes import Level
    from compgen.core.findings import first_message
    from compgen.pipelines.correct.program_file import read_program
    from compgen.pipelines.correct.programs_beside import programs_beside
    from compgen.pipelines.files.path_file import load_job
    from compgen.pipelines.planned.written_program import fly_written
    from compgen.report.job_summary import written_summary
    from compgen.verification.verdict import verdict_of

    job = load_job(path, robot, overrides)
    data = read_program(program)
    with show_progress(quiet, PREDICT) as progress, naming_file(f"--written {program}"):
        flight = fly_written(job, data, programs_beside(Path(program)), progress, strict)
    broken = first_message(Level.OUTSIDE, flight.findings)
    verdict = verdict_of(flight.findings)
    return written_summary(flight, program), f"{outcome_words(verdict)}: {broken}" if broken else ""


def refuse_several(written: str | None, paths: Sequence[str]) -> None:
    """Raises InputError where one program cannot be meant."""
    if written is not None and len(paths) > 1:
        raise InputError(f"--written {written}: it is the program of one path; give that path alone")


def show_written(summary: dict[str, Any]) -> None:
    """Print what the program leaves, and the findings."""
    from compgen.cli.screen.console import print_findings, stdout_console
    from compgen.report.band_words import guaranteed_text, headline

    console, written = stdout_console(), summary["written"]
    before, after = (summary["on_part"][side]["total"] for side in ("before", "after"))
    console.print(
        f"{written['name']}, {written['positions']} positions, in this state: largest error on the part "
        f"{after['max_um']:.2f} um (p99 {after['p99_um']:.2f}, rms {after['rms_um']:.2f}); planned, not corrected: "
        f"{before['max_um']:.2f} um",
    )
    rises = ", ".join(f"{name} {rise:.2f}" for name, rise in summary["thermal"]["start_K"].items())
    console.print(f"rise at the start [K]: {rises}")
    console.print(headline(summary))
    if summary["guaranteed"]:
        console.print(guaranteed_text(summary["guaranteed"]))
    print_findings(console, summary["findings"])
