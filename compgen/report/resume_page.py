"""A resumed job as one page that opens offline: what was replaced, why, and each page before and after."""

from html import escape
from typing import Any

from compgen.core.units import HOUR, UM
from compgen.pipelines.resume.result import Resumed
from compgen.report.figure import COOL, WARM, Figure, rows_to_draw, trace
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, sentence
from compgen.report.inputs import Inputs, job_inputs, time_words
from compgen.report.job_page import KINDS, REMARK, VERDICTS
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


def resume_html(resumed: Resumed, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = resume_summary(resumed)
    before, after = (data["on_part"][side]["total"]["max_um"] for side in ("before", "after"))
    words, why = VERDICTS[data["verdict"]], _why(data)
    text = (
        f"<b>{words[0].upper()}{words[1:]}.</b> From page {data['from_page']} on, because {escape(why)}: "
        f"<b>{before:.1f} &micro;m</b> on the part with the pages so far, <b>{after:.2f} &micro;m</b> with the new "
        "ones, proven from their text."
    )
    sides = [(side, data["on_part"][side]) for side in ("before", "after")]
    opening = f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])}</p>'
    opening += verdict(KINDS.get(data["verdict"], "outside"), text)
    body = findings_list(resumed.findings) + _pages_table(data) + error_table("component", sides, PARTS)
    body += _state(data) + section("The join", _join_words(data))
    body += figure_section("Error over time", _figure(resumed), "time")
    return page(f"Resumed: {data['name']}", body, opening, _inputs(resumed, why), REMARK, options)


def _inputs(resumed: Resumed, why: str) -> Inputs:
    """The job's, but for its history: the pages begin in the middle of it."""
    made = job_inputs(resumed.planned.job)
    rows = tuple(("history", f"the job's pages so far; {why}") if row[0] == "history" else row for row in made.rows)
    return Inputs(rows, made.hashes).with_rows(("manifest", resumed.written.manifest_file))


def _why(data: dict[str, Any]) -> str:
    late = data.get("late_s")
    return f"it starts {time_words(late)} late" if late else str(data["why"])


def _state(data: dict[str, Any]) -> str:
    """How warm the robot is as the first new page begins, and how warm it was planned to be."""
    thermal = data["thermal"]
    rows = [
        [f"rise of {escape(name)} [K]", f"{thermal['planned_K'][name]:.2f}", f"{rise:.2f}"]
        for name, rise in thermal["start_K"].items()
    ]
    window = thermal["start_window_s"]
    until = f'<p class="lead">Right for a start within {time_words(window)} of this.</p>' if window else ""
    return section("The robot as the first new page begins", until + table(["", "as planned", "now"], rows))


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
        f"<p>{escape(join['page'])} begins at a stop {place}. There the tool steps by {join['step_um']:.2f} &micro;m: "
        f"what has drifted since the page before asks for {join['demanded_um']:.2f} &micro;m, and the step is "
        f"{join['beyond_um']:.2f} &micro;m off that.</p>"
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
        curve = trace("scatter", deviation.time[shown] / HOUR, size[shown], name=name, line=line, showlegend=False)
        bound = resumed.planned.job.bounds.max if name == "new pages" else None
        limit = None if bound is None else (bound / UM, f"bound {bound / UM:g} µm")
        rows.append(Row(f"{name} [µm]", [curve], limit, {"rangemode": "tozero"}))
        words += [course(name, size, "µm"), *([limit[1]] if limit else [])]
    return figure_in_rows(rows, "time from the page's start [h]", sentence("Error over time", words))
