"""A resumed job as one page that opens offline: what was replaced, why, and each page before and after."""

from html import escape
from typing import Any

from compgen.core.units import HOUR, UM
from compgen.pipelines.resume.result import Resumed
from compgen.report.figure import COOL, WARM, Figure, rows_to_draw, trace
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, sentence
from compgen.report.inputs import job_inputs
from compgen.report.page import PLAIN, PageOptions, error_table, figure_section, findings_list, page, section, verdict
from compgen.report.resume_summary import resume_summary
from compgen.report.table import table

PARTS = {
    "total": "position [&micro;m]",
    "feed": "along feed [&micro;m]",
    "cross": "cross feed [&micro;m]",
    "normal": "normal [&micro;m]",
    "axis_angle": "tool axis [mdeg]",
}


REMARK = "CNT is taken as passing through the points; only the error sources active in the robot file are known here."


def resume_html(resumed: Resumed, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = resume_summary(resumed)
    before, after = (data["on_part"][side]["total"]["max_um"] for side in ("before", "after"))
    kind = "inside" if resumed.inside else "outside"
    text = (
        f"From page {data['from_page']} on, because {escape(data['why'])}: <b>{before:.1f} &micro;m</b> on the part "
        f"with the pages so far, <b>{after:.2f} &micro;m</b> with the new ones, proven from their text: "
        f"<b>{escape(data['verdict'])}</b>."
    )
    sides = [(side, data["on_part"][side]) for side in ("before", "after")]
    opening = f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])}</p>'
    body = findings_list(resumed.findings) + _pages_table(data) + error_table("component", sides, PARTS)
    body += section("The join", _join_words(data))
    body += figure_section("Error over time", _figure(resumed), "time")
    inputs = job_inputs(resumed.planned.job).with_rows(("manifest", resumed.written.manifest_file))
    return page(f"Resumed: {data['name']}", body, opening + verdict(kind, text), inputs, REMARK, options)


def _pages_table(data: dict[str, Any]) -> str:
    rows = [
        [
            escape(row["file"]), f"{row['start_s'] / HOUR:.2f}",
            *(f"{value:.2f}" for side in ("before", "after") for value in row[side].values()),
        ]
        for row in data["pages"]
    ]  # fmt: skip
    head = [f"{side} {statistic}" for side in ("before", "after") for statistic in ("max", "p99", "rms")]
    return section("Each page on the part [&micro;m]", table(["page", "starts [h]", *head], rows))


def _join_words(data: dict[str, Any]) -> str:
    join = data["join"]
    if join is None:
        return "<p>The job begins with this page: nothing is before it.</p>"
    place = "on the part" if join["on_the_part"] else "off the part"
    return (
        f"<p>{escape(join['page'])} begins {place}. The tool steps by {join['step_um']:.2f} &micro;m at the stop: "
        f"{join['demanded_um']:.2f} have drifted, and {join['beyond_um']:.2f} are beyond that.</p>"
    )


def _figure(resumed: Resumed) -> Figure:
    rows, words = [], []
    for name, deviation, colour in (
        ("pages so far", resumed.planned.deviation(), WARM),
        ("new pages", resumed.deviation, COOL),
    ):
        size = deviation.total() / UM
        shown = rows_to_draw(size)
        line = {"color": colour, "width": 1}
        curve = trace("scatter", deviation.time[shown] / HOUR, size[shown], name=name, line=line, showlegend=True)
        rows.append(Row(f"{name} [µm]", [curve], options={"rangemode": "tozero"}))
        words.append(course(name, size, "µm"))
    return figure_in_rows(rows, "time from the page's start [h]", sentence("Error over time", words))
