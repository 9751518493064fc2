"""A judged log as one page: what was run, how true, in which time, with pictures."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import MM, UM
from compgen.report.figure import (
    COOL,
    GREY,
    TURBO,
    WARM,
    Figure,
    axis,
    figure,
    packed_array,
    rows_to_draw,
    trace,
)
from compgen.report.figure_words import curves_in_words
from compgen.report.page import figure_section, findings_list, page, section, verdict
from compgen.verification.executed.judgement import ExecutedRun

FIGURES = {
    "space": "The path, coloured by how far the motion is off it",
    "time": "Deviation over time",
    "speed": "Speed along the path",
}
LABELS = {"total": "off the path", "across": "across, in the surface", "normal": "along the tool's axis"}


def executed_html(run: ExecutedRun, summary: dict[str, Any]) -> bytes:
    """One self-contained page, the same bytes for the same inputs."""
    log, program, time = summary["log"], summary["program"], summary["time"]
    overrides = ", then ".join(f"{s['percent']:.0f} %" for s in summary["override"]) or "not known"
    lead = (
        f'<p class="lead">{escape(summary["name"])} by {escape(log["file"])} &middot; {log["rows"]} rows every '
        f"{log['period_ms']:.3g} ms, noise {log['noise_um']:.2f} &micro;m &middot; "
        f"{100 * summary['covered']['share']:.1f} % of the path</p>"
    )
    total = summary["deviation"].get("total")
    largest = f"largest {total['max_um']:.1f} &micro;m at {total['at']}" if total else "nothing judged"
    off = "" if time["off_percent"] is None else f" ({time['off_percent']:+.2f} %)"
    text = (
        f"Override <b>{overrides}</b>; <b>{time['took_s']:.2f} s</b> where the plan has {time['expected_s']:.2f} s{off}"
        f"; off the path: <b>{largest}</b>: <b>{summary['verdict']}</b>."
    )
    body = lead + verdict("inside" if run.inside else "outside", text) + findings_list(run.findings) + _table(summary)
    for key, content in executed_figures(run).items():
        body += figure_section(FIGURES[key], content, key)
    body += (
        f"<footer>compgen {summary['provenance']['compgen']}, robot {escape(summary['provenance']['robot'])}, program "
        f"sha256 {program['sha256']}. The log shows what the controller knows of its joints, not where the tool was: "
        "heat, geometry, compliance and play are not in it.</footer>"
    )
    return page(f"{summary['name']}: executed", body)


def _table(summary: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{LABELS[name]}</td>"
        + "".join(f"<td>{d[key]:.2f}</td>" for key in ("max_um", "p99_um", "rms_um"))
        + f"<td>{escape(d['at'])}</td></tr>"
        for name, d in summary["deviation"].items()
    )
    head = "<thead><tr><th>&micro;m</th><th>max</th><th>p99</th><th>rms</th><th>largest at</th></tr></thead>"
    return section("How far off the path", f"<table>{head}<tbody>{rows}</tbody></table>")


def executed_figures(run: ExecutedRun) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``."""
    return {"space": _space(run), "time": _over_time(run), "speed": _speed(run)}


def _space(run: ExecutedRun) -> Figure:
    d = run.deviation
    rows = rows_to_draw(np.where(d.judged, d.distance, 0.0))
    xyz = (np.round(v / MM, 2) for v in run.laid.position[d.row[rows]].T)
    marker = {
        "size": 3,
        "color": packed_array(np.round(d.distance[rows] / UM, 3)),
        "colorscale": TURBO,
        "colorbar": {"title": {"text": "µm"}, "thickness": 12},
        "cmin": 0,
        "cmax": max(float(d.distance[d.judged].max(initial=0.0)) / UM, 1e-3),
    }
    points = trace("scatter3d", *xyz, mode="markers", marker=marker, showlegend=False)
    scene = {
        "xaxis": axis("X [mm]"), "yaxis": axis("Y [mm]"), "zaxis": axis("Z [mm]"), "aspectmode": "data",
        "camera": {"eye": {"x": 1.3, "y": -1.9, "z": 1.3}},
    }  # fmt: skip
    return figure([points], 480, "The path in space", scene=scene)


def _over_time(run: ExecutedRun) -> Figure:
    d, traces = run.deviation, []
    for name, values, colour in (("across", d.across, WARM), ("normal", d.normal, COOL)):
        rows = rows_to_draw(np.abs(values))
        x, y = np.round(d.time[rows], 3), np.round(values[rows] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, line={"color": colour, "width": 1.2}))
    alt = curves_in_words("Deviation over time", traces, "µm")
    return figure(traces, 320, alt, yaxis=axis("deviation [µm]"), xaxis=axis("the log's clock [s]"))


def _speed(run: ExecutedRun) -> Figure:
    d, course = run.deviation, run.course
    rows = rows_to_draw(np.arange(len(d.time), dtype=float))
    way = run.laid.projection.way[d.row[rows]]
    written = np.diff(course.arc)[way] / np.maximum(np.diff(course.cruise)[way], 1e-9)
    traces = [
        trace("scatter", np.round(d.time[rows], 3), np.round(v / MM, 3), name=name, line={"color": c, "width": w})
        for name, v, c, w in (("written", written, GREY, 1.0), ("executed", d.speed[rows], WARM, 1.4))
    ]
    alt = curves_in_words("Speed along the path", traces, "mm/s")
    return figure(traces, 300, alt, yaxis=axis("speed [mm/s]", rangemode="tozero"), xaxis=axis("the log's clock [s]"))
