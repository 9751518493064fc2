"""A resumed program that existed: as data, and as one page."""

import json
from html import escape
from typing import Any

from compgen import __version__
from compgen.pipelines.resume.corrected import ResumedProgram, words_of
from compgen.report.page import findings_list, page, section, verdict


def program_summary(resumed: ResumedProgram) -> dict[str, Any]:
    """Everything that was found, in plain types."""
    cell = resumed.correction.cell
    return {
        "schema": 1,
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


def program_json(resumed: ResumedProgram) -> bytes:
    """The summary as text, the same bytes for the same inputs."""
    return (json.dumps(program_summary(resumed), indent=2, allow_nan=False) + "\n").encode()


def program_html(resumed: ResumedProgram) -> bytes:
    """One self-contained page."""
    data = program_summary(resumed)
    head = "".join(f"<th>{side} {key}</th>" for side in ("before", "after") for key in ("max", "p99", "rms"))
    rows = ""
    for row in data["pages"]:
        cells = "".join(f"<td>{value:.2f}</td>" for side in ("before", "after") for value in row[side].values())
        rows += f"<tr><td>{escape(row['file'])}</td>{cells}</tr>"
    table = f"<table><thead><tr><th>page</th>{head}</tr></thead><tbody>{rows}</tbody></table>"
    body = verdict("inside" if resumed.correction.inside else "outside", escape("; ".join(words_of(resumed))))
    body += findings_list(resumed.findings) + section("Each page at corrected places [&micro;m]", table)
    return page(f"Resumed: {data['name']}", body)
