"""A judged log as one page: what was run, how true, in which time, with pictures."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import MM, UM
from compgen.report.figure import COOL, GREY, WARM, Figure, axis, figure, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.figure_words import curves_in_words
from compgen.report.inputs import Inputs
from compgen.report.page import PLAIN, PageOptions, figure_section, findings_list, page, section, verdict
from compgen.report.table import table
from compgen.verification.executed.judgement import ExecutedRun

FIGURES = {
    "space": "The path, coloured by how far the motion is off it",
    "time": "Deviation over time",
    "speed": "Speed along the path",
}
REMARK = (
    "The log shows what the controller knows of its joints, not where the tool was: heat, geometry, compliance and "
    "play are not in it."
)
LABELS = {"total": "off the path", "across": "across, in the surface", "normal": "along the tool's axis"}


def executed_html(
    run: ExecutedRun, summary: dict[str, Any], inputs: Inputs | None = None, options: PageOptions = PLAIN
) -> bytes:
    """One page, the same bytes for the same inputs."""
    log, time = summary["log"], summary["time"]
    overrides = ", then ".join(f"{s['percent']:.0f} %" for s in summary["override"]) or "not known"
    lead = (
        f'<p class="lead">{escape(summary["name"])} by {escape(log["file"])} &middot; {log["rows"]} rows every '
        f"{log['period_ms']:.3g} ms, noise {log['noise_um']:.2f} &micro;m &middot; "
        f"{100 * summary['covered']['share']:.1f} % of the path</p>"
    )
    total = summary["deviation"].get("total")
    bound, off = summary["bounds"].get("max_um"), time["off_percent"]
    is_judged = bound is not None or not run.inside
    by_bound = f"{summary['verdict'].capitalize()}{'' if bound is None else ' its bound'}."
    by_bound = by_bound if is_judged else "Judged by no bound, for none is given."
    text = f"<b>{by_bound}</b> " + (
        f"The motion is at most <b>{total['max_um']:.1f} &micro;m</b> off the path, at {escape(total['at'])}."
        if total
        else "No part of the path could be judged."
    )
    facts = [
        ("bound", "none" if bound is None else f"{bound:g} &micro;m"),
        ("override", overrides),
        (
            "time",
            f"{time['took_s']:.2f} s, planned {time['expected_s']:.2f} s" + ("" if off is None else f" ({off:+.2f} %)"),
        ),
    ]
    body = findings_list(run.findings)
    for key, content in executed_figures(run).items():
        body += figure_section(FIGURES[key], content, key)
    opening = lead + verdict(summary["verdict"] if is_judged else "warning", text, facts) + _table(summary)
    return page(f"{summary['name']}: executed", body, opening, inputs, REMARK, options)


def _table(summary: dict[str, Any]) -> str:
    rows = [
        [LABELS[name], *(f"{d[key]:.2f}" for key in ("max_um", "p99_um", "rms_um")), escape(d["at"])]
        for name, d in summary["deviation"].items()
    ]
    return section("How far off the path", table(["deviation [&micro;m]", "max", "p99", "rms", "largest at"], rows))


def executed_figures(run: ExecutedRun) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``."""
    return {"space": _space(run), "time": _over_time(run), "speed": _speed(run)}


def _space(run: ExecutedRun) -> Figure:
    d = run.deviation
    rows = rows_to_draw(np.where(d.judged, d.distance, 0.0))
    places = run.followed.position[d.row] / MM
    off = np.round(np.where(d.judged, d.distance, np.nan)[rows] / UM, 3)
    path = Coloured("off the path", places[rows], off)
    return figure_in_space("How far the motion is off the path, in space", [path], places, d.judged)


def _over_time(run: ExecutedRun) -> Figure:
    d, traces = run.deviation, []
    for name, values, colour, dash in (
        (LABELS["across"], d.across, WARM, "solid"),
        (LABELS["normal"], d.normal, COOL, "dot"),
    ):
        rows = rows_to_draw(np.abs(values))
        x, y = np.round(d.time[rows], 3), np.round(values[rows] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, line={"color": colour, "width": 1.2, "dash": dash}))
    alt = curves_in_words("Deviation over time", traces, "µm")
    return figure(traces, 320, alt, yaxis=axis("deviation [µm]"), xaxis=axis("the log's clock [s]"))


def _speed(run: ExecutedRun) -> Figure:
    d, course = run.deviation, run.course
    rows = rows_to_draw(np.arange(len(d.time), dtype=float))
    way = run.followed.projection.way[d.row[rows]]
    written = np.diff(course.arc)[way] / np.maximum(np.diff(course.cruise)[way], 1e-9)
    traces = [
        trace("scatter", np.round(d.time[rows], 3), np.round(v / MM, 3), name=name, line=line)
        for name, v, line in (
            ("written", written, {"color": GREY, "width": 1.0, "dash": "dash"}),
            ("executed", d.speed[rows], {"color": WARM, "width": 1.4}),
        )
    ]
    alt = curves_in_words("Speed along the path", traces, "mm/s")
    return figure(traces, 300, alt, yaxis=axis("speed [mm/s]", rangemode="tozero"), xaxis=axis("the log's clock [s]"))
