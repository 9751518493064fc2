"""A resumed program that existed: as data, and as one page."""

from html import escape
from typing import Any

from compgen.core.commands import Command
from compgen.core.version import __version__
from compgen.pipelines.resume.corrected import ResumedProgram, words_of
from compgen.report.inputs import correction_inputs
from compgen.report.page import PLAIN, PageOptions, findings_list, in_words, page, section, verdict
from compgen.report.provenance import provenance
from compgen.report.table import table


def program_summary(resumed: ResumedProgram) -> dict[str, Any]:
    """Everything that was found, in plain types."""
    cell = resumed.correction.cell
    return {
        "schema": 1,
        "command": Command.RESUME,
        "name": resumed.correction.name,
        "verdict": resumed.verdict.value,
        "from_page": resumed.from_page,
        "why": resumed.why,
        **resumed.cause,
        "replaced": list(resumed.replaced),
        "join": None if resumed.join is None else {**resumed.join.record(), "on_the_part": None},
        "pages": [
            {
                "page": p.number,
                "file": p.file,
                "replaced": p.is_new,
                "before": p.before.record(),
                "after": p.after.record(),
            }
            for p in resumed.pages
        ],
        "findings": [finding.record() for finding in resumed.findings],
        "provenance": {
            "compgen": __version__,
            "robot": cell.robot.name,
            "robot_file": {"path": cell.robot_file, "sha256": cell.robot_file_hash},
            "manifest": resumed.written.manifest_file,
        },
    }


def program_html(resumed: ResumedProgram, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = program_summary(resumed)
    rows = [
        [escape(row["file"]), *(f"{value:.2f}" for side in ("before", "after") for value in row[side].values())]
        for row in data["pages"]
    ]
    head = ["page", *(f"{side} {key}" for side in ("before", "after") for key in ("max", "p99", "rms"))]
    opening = verdict("inside" if resumed.correction.inside else "outside", in_words("; ".join(words_of(resumed))))
    body = findings_list(resumed.findings) + section("Each page at corrected places [&micro;m]", table(head, rows))
    made = provenance(resumed.correction)
    inputs = correction_inputs(resumed.correction, made["planned_sha256"], made["corrected_sha256"])
    inputs = inputs.with_rows(("manifest", resumed.written.manifest_file))
    return page(f"Resumed: {data['name']}", body, opening, inputs, options=options)
