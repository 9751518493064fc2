"""The files that a job leaves: reports, programs, and what CI reads."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from compgen.cli.ownership import check_job_folder, resume_files
from compgen.cli.publish import publish
from compgen.core.findings import Progress
from compgen.fanuc.paging.manifest import MANIFEST_SUFFIX
from compgen.pipelines.job import Job
from compgen.pipelines.program_text import program_name_of
from compgen.report.band_words import headline, unknown_words


def check_folder(folder: Path, command: str, job: Job) -> None:
    """Raises InputError when a job's files would replace what another command, or a run of another job, has written."""
    check_job_folder(folder, command, job.name, f"{program_name_of(job)}.LS")


def publish_job(
    folder: Path, programs: Mapping[str, bytes], reports: Mapping[str, bytes | Iterable[bytes]], job: Job,
    progress: Progress,
) -> None:  # fmt: skip
    """Put a job's files into its folder; an earlier run's program and pages go where this run writes none."""
    program = program_name_of(job)
    contents = {
        name: _with_progress(content, progress, 0.6 + 0.4 * k / len(reports))
        for k, (name, content) in enumerate(reports.items())
    }
    own_names = {f"{program}.LS", *programs, *reports, *resume_files(folder)}
    publish(folder, programs, contents, own_names, f"{program}{MANIFEST_SUFFIX}")


def _with_progress(content: bytes | Iterable[bytes], progress: Progress, share: float) -> Iterable[bytes]:
    for block in [content] if isinstance(content, bytes) else content:
        progress("report", share)
        yield block


def junit_xml(summary: dict[str, Any]) -> bytes:
    """A test case for each bound, failed by its finding; the band as properties and in words."""
    broken = {f["code"]: f["message"] for f in summary["findings"] if f["level"] == "outside"}
    cases = [f"bounds.{key}" for key in summary["bounds"]]
    guaranteed = summary.get("guaranteed") or {"bounds": {}}
    cases += [f"bounds.guaranteed.{key}" for key in guaranteed["bounds"]]
    cases += [code for code in broken if code not in cases]
    suite = quoteattr(f"compgen.{summary['name']}")
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    lines.append(f'<testsuite name={suite} tests="{len(cases)}" failures="{len(broken)}">')
    properties = {"band.p95_um": f"{summary['band']['p95_um']:g}", "band.not_known": unknown_words(summary["band"])}
    lines.append("  <properties>")
    lines += [f'    <property name="{name}" value={quoteattr(value)}/>' for name, value in properties.items()]
    lines.append("  </properties>")
    for case in cases:
        start = f"  <testcase classname={suite} name={quoteattr(case)}"
        if case in broken:
            lines.append(f"{start}><failure message={quoteattr(broken[case])}/></testcase>")
        else:
            lines.append(f"{start}/>")
    lines.append(f"  <system-out>{escape(headline(summary))}</system-out>")
    return ("\n".join([*lines, "</testsuite>"]) + "\n").encode()
