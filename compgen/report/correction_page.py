"""A correction of an existing program as one page."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import MM, UM
from compgen.pipelines.correct import Correction
from compgen.report.correction_summary import correction_summary
from compgen.report.figure import TURBO, Figure, axis, div, figure, numbers, trace
from compgen.report.page import COOL, LINES, WARM, findings_list, page, thin


def correction_html(result: Correction) -> bytes:
    """The story on one page that opens offline."""
    data = correction_summary(result)
    plan = result.plan
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['positions']['corrected']} positions corrected, {data['positions']['new']} new, "
        f"{data['positions']['unchanged']} unchanged &middot; {data['duration_s']:.1f} s</p>"
    )
    if data["before"]:
        before, after = data["before"]["total"]["max_um"], data["after"]["total"]["max_um"]
        told = f"Largest error <b>{before:.1f} &micro;m</b> before, <b>{after:.2f} &micro;m</b> after, proven from the "
        verdict = f"{told}written text: <b>{data['verdict']}</b> its bounds."
    else:
        verdict = "No position of this program can be corrected: it is unchanged."
    style = data["verdict"] if data["before"] else "predicted"
    body = f'{lead}<p class="big {style}">{verdict}</p>{findings_list(result.findings)}{_table(data)}'
    if len(result.ride.station):
        body += f"<h2>Error over time</h2>{div(_error(result), 'time')}"
        body += f"<h2>The program, coloured by its error before</h2>{div(_space(result), 'space')}"
        body += f"<h2>Temperature while the program runs</h2>{div(_heat(result), 'heat')}"
    if plan.scope.unsafe:
        rows = "".join(
            f"<tr><td>{u.line}</td><td style='text-align:left'><code>{escape(u.text)}</code></td>"
            f"<td style='text-align:left'>{escape(u.reason)}</td></tr>"
            for u in plan.scope.unsafe[:500]
        )
        body += "<h2>Passed through untouched, or casting doubt</h2><table><thead><tr><th>line</th>"
        body += (
            f"<th style='text-align:left'>statement</th><th style='text-align:left'>why</th></tr></thead>{rows}</table>"
        )
    made = data["provenance"]
    body += (
        f"<footer>compgen {made['compgen']}, robot file sha256 {made['robot_sha256']}, planned program sha256 "
        f"{made['planned_sha256']}, corrected {made['corrected_sha256']}. CNT is taken as passing through the points; "
        "jumps and calls are not followed.</footer>"
    )
    return page(f"{data['name']}: correction", body)


def _table(data: dict[str, Any]) -> str:
    if not data["before"]:
        return ""
    rows = ""
    for key, label in (("total", "position [&micro;m]"), ("turn", "orientation [mdeg]")):
        cells = "".join(f"<td>{v:.2f}</td>" for side in ("before", "after") for v in data[side][key].values())
        rows += f"<tr><td>{label}</td>{cells}</tr>"
    head = "".join(f"<th>{side} {part}</th>" for side in ("before", "after") for part in ("max", "p99", "rms"))
    title = "<h2>Error of the tool centre point</h2><table><thead><tr><th></th>"
    return f"{title}{head}</tr></thead><tbody>{rows}</tbody></table>"


def _error(result: Correction) -> Figure:
    traces = []
    for name, values, colour in (("before", result.error[0], WARM), ("after", result.residual[0], COOL)):
        keep = thin(values)
        look = {"mode": "lines+markers", "marker": {"size": 4}, "line": {"color": colour, "width": 1.4}}
        x, y = np.round(result.ride.time[keep], 3), np.round(values[keep] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, **look))
    return figure(traces, 320, yaxis=axis("error [µm]", rangemode="tozero"), xaxis=axis("time from the start [s]"))


def _space(result: Correction) -> Figure:
    plan = result.plan
    rows = np.flatnonzero(result.ride.fraction == 1)
    rows = rows[thin(result.error[0][rows])]
    pose = plan.drive.pose[result.ride.station[rows]]
    xyz = (np.round(v / MM, 2) for v in plan.poses.position[pose].T)
    marker = {
        "size": 3,
        "color": numbers(np.round(result.error[0][rows] / UM, 3)),
        "colorscale": TURBO,
        "colorbar": {"title": {"text": "µm"}, "thickness": 12},
        "cmin": 0,
        "cmax": max(float(np.max(result.error[0][rows], initial=0.0)) / UM, 1e-3),
    }
    text = [f"P[{n}]" for n in plan.poses.number[pose].tolist()]
    line = {"color": "#cbd5e1", "width": 2}
    points = trace("scatter3d", *xyz, mode="lines+markers", marker=marker, line=line, text=text, showlegend=False)
    scene = {
        "xaxis": axis("X [mm]"), "yaxis": axis("Y [mm]"), "zaxis": axis("Z [mm]"), "aspectmode": "data",
        "camera": {"eye": {"x": 1.3, "y": -1.9, "z": 1.3}},
    }  # fmt: skip
    return figure([points], 480, scene=scene)


def _heat(result: Correction) -> Figure:
    solved = result.plan.stations
    keep = thin(np.arange(len(solved.time), dtype=float))
    time = np.round(solved.time[keep], 3)
    traces = []
    for i, name in enumerate(result.cell.heat.names):
        line = {"color": LINES[i % len(LINES)], "width": 1.6}
        traces.append(trace("scatter", time, np.round(solved.rise[keep, i], 4), name=name, line=line))
    return figure(traces, 320, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis("time from the start [s]"))
