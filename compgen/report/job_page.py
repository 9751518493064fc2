"""The report as one page that opens offline: findings first, then the error, the path, the warmth, the joints."""

from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from compgen.core.arrays import Array, column_extremes
from compgen.core.units import MM, UM
from compgen.pipelines.generate import Corrected, Planned
from compgen.planning.toolpath import ToolPath
from compgen.report.figure import TURBO, Figure, Trace, axis, div, figure, level, numbers, spans, trace
from compgen.report.job_summary import job_summary
from compgen.report.page import COOL, GREY, LINES, WARM, findings_list, page, thin
from compgen.verification.deviation import Deviation


def job_html(planned: Planned, corrected: Corrected | None) -> bytes:
    """One self-contained page, the same bytes for the same inputs."""
    data = job_summary(planned, corrected)
    drawn = [_drawn(planned.deviation())] + ([_drawn(corrected.deviation)] if corrected else [])
    figures = [
        ("Error over time", _error_over_time(drawn, planned.job.bounds.max), "time"),
        ("The path, coloured by error", _path_in_space(drawn, planned.path), "space"),
        ("Temperature while the program runs", _temperatures(planned), "heat"),
        ("Use of the joints", _joints(data), "joints"),
    ]
    body = "".join(f"<h2>{title}</h2>{div(figure, key)}" for title, figure, key in figures)
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['path']['waypoints']} waypoints, {data['path']['length_m']:.2f} m, "
        f"{data['timing']['duration_s']:.1f} s, {100 * data['timing']['at_feed']:.1f} % of the length at feed</p>"
    )
    found = findings_list([*(corrected.findings if corrected else planned.findings)])
    return page(data["title"] or data["name"], f"{lead}{_verdict(data)}{found}{_table(data)}{body}{_footer(data)}")


def _verdict(data: dict[str, Any]) -> str:
    before = data["before"]["total"]["max_um"]
    if data["after"] is None:
        text = f"Uncorrected, the tool will be up to <b>{before:.1f} &micro;m</b> off. Nothing has been corrected."
    else:
        after, window = data["after"]["total"]["max_um"], data["thermal"]["start_window_s"]
        text = (
            f"Largest error <b>{before:.1f} &micro;m</b> before, <b>{after:.2f} &micro;m</b> after, proven from the "
            f"written text: {data['ratio']:.0f} times smaller, <b>{data['verdict']}</b> its bounds. Right for a start "
            f"within {window:.0f} s of the stated warmth."
        )
    return f'<p class="big {data["verdict"]}">{text}</p>'


def _table(data: dict[str, Any]) -> str:
    sides = [("before", data["before"])] + ([("after", data["after"])] if data["after"] else [])
    head = "".join(f"<th>{side} {part}</th>" for side, _ in sides for part in ("max", "p99", "rms"))
    labels = {
        "total": "total [&micro;m]",
        "feed": "along feed [&micro;m]",
        "cross": "cross feed [&micro;m]",
        "normal": "normal to the surface [&micro;m]",
        "axis_angle": "tool axis [mdeg]",
    }
    rows = "".join(
        f"<tr><td>{label}</td>" + "".join(f"<td>{v:.2f}</td>" for _, s in sides for v in s[key].values()) + "</tr>"
        for key, label in labels.items()
    )
    bounds = ", ".join(f"{k} = {v:g}" for k, v in data["bounds"].items())
    return (
        f"<h2>Error of the tool centre point</h2><table><thead><tr><th>component</th>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table><p class=lead>Bounds: {bounds or 'none'}</p>"
    )


def _footer(data: dict[str, Any]) -> str:
    made = data["provenance"]
    over = "; overrides " + escape(", ".join(made["overrides"])) if made["overrides"] else ""
    return (
        f"<footer>compgen {made['compgen']}, inputs sha256 {made['inputs_sha256']}{over}. CNT is taken as passing "
        "through the points; only the error sources active in the robot file are known to it.</footer>"
    )


@dataclass(frozen=True, eq=False, slots=True)
class _Drawn:
    """Of a deviation, what its figures show, at K samples."""

    arc: Array  # (K,) [m]
    time: Array  # (K,) [s]
    total: Array  # (K,) [um]
    normal: Array  # (K,) [um]
    largest: float  # [m]


def _drawn(deviation: Deviation) -> _Drawn:
    total = deviation.total()
    keep = thin(total)
    size, normal = (np.round(values[keep] / UM, 3) for values in (total, deviation.normal))
    return _Drawn(deviation.arc[keep], deviation.time[keep], size, normal, deviation.extents["total"].max)


def _error_over_time(drawn: list[_Drawn], bound: float | None) -> Figure:
    rows = [*zip(("before", "after"), drawn, (WARM, COOL), ("", "2"))]
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    for (name, shown, colour, which), span in zip(rows, reversed(spans(len(rows), 0.08))):
        time = np.round(shown.time, 4)
        for part, values, dash, tint in (
            ("total", shown.total, "solid", colour),
            ("normal", shown.normal, "dot", GREY),
        ):
            line = {"color": tint, "width": 1.4 if part == "total" else 1, "dash": dash}
            place = {"xaxis": f"x{which}", "yaxis": f"y{which}"}
            traces.append(trace("scatter", time, values, name=f"{name}: {part}", line=line, **place))
        axes[f"yaxis{which}"] = axis(f"{name} [µm]", anchor=f"x{which}", domain=span)
        axes[f"xaxis{which}"] = {"anchor": f"y{which}", "domain": [0.0, 1.0]}
        last = axes[f"xaxis{which}"]
    if len(rows) > 1:  # the upper plot shows the lower one's times
        axes["xaxis"].update(matches="x2", showticklabels=False)
    last.update(axis("time from leaving P[1] [s]"))
    if len(rows) > 1 and bound is not None:
        axes["shapes"] = [level(bound / UM, "2")]
    return figure(traces, 260 * len(rows), **axes)


def _path_in_space(drawn: list[_Drawn], path: ToolPath) -> Figure:
    count = len(drawn)
    low, high = column_extremes(path.position)
    size = high - low
    reach = np.maximum(size / size.max(), 0.05).round(3).tolist()
    scene = {
        "xaxis": axis("X [mm]"),
        "yaxis": axis("Y [mm]"),
        "zaxis": axis("Z [mm]", nticks=3),
        # flat paths keep their plan's proportions and get a little height, so that leads can be seen
        "aspectmode": "manual",
        "aspectratio": {"x": reach[0], "y": reach[1], "z": max(reach[2], 0.15)},
        "camera": {"eye": {"x": 0.2, "y": -1.1, "z": 1.2}},
    }
    traces, scenes, titles = [], {}, []
    for i, (name, shown, span) in enumerate(zip(("before", "after"), drawn, spans(count, 0.2 / count)), 1):
        bar = {"title": {"text": "µm"}, "len": 0.7, "x": i / count - 0.02 if count > 1 else 1.0, "thickness": 12}
        marker = {
            "size": 2.2,
            "color": numbers(shown.total),
            "colorscale": TURBO,
            "colorbar": bar,
            "cmin": 0,
            "cmax": float(np.ceil(100 * shown.largest / UM) / 100),
            "line": {"width": 0},
        }
        where = f"scene{i if i > 1 else ''}"
        xyz = _places(path, shown.arc)
        traces.append(trace("scatter3d", *xyz, mode="markers", marker=marker, showlegend=False, scene=where))
        scenes[where] = {"domain": {"x": span, "y": [0.0, 1.0]}, **scene}
        titles.append(
            {"text": name, "font": {"size": 16}, "showarrow": False, "x": sum(span) / 2, "xref": "paper", "y": 1.0,
            "xanchor": "center", "yref": "paper", "yanchor": "bottom"}
        )  # fmt: skip
    return figure(traces, 460, annotations=titles, **scenes)


def _places(path: ToolPath, arc: Array) -> list[Array]:
    """x, y and z [mm] at some places, straight between the waypoints around each."""
    after = np.searchsorted(path.arc, arc, side="right").clip(1, len(path.arc) - 1)
    rows = np.unique(np.concatenate([after - 1, after]))
    return [np.round(np.interp(arc, path.arc[rows], path.position[rows, k]) / MM, 2) for k in range(3)]


def _temperatures(planned: Planned) -> Figure:
    keep = thin(np.arange(len(planned.rise), dtype=float))
    time = np.round(planned.trajectory.time[keep], 3)
    traces = [
        trace(
            "scatter", time, np.round(planned.rise[keep, i], 4), name=name,
            line={"color": LINES[i % len(LINES)], "width": 1.6},
        )
        for i, name in enumerate(planned.job.heat.names)
    ]  # fmt: skip
    return figure(traces, 320, yaxis=axis("rise [K]", rangemode="tozero"), xaxis=axis("time from leaving P[1] [s]"))


def _joints(data: dict[str, Any]) -> Figure:
    traces = [
        trace("bar", list(shares), [round(100 * v, 2) for v in shares.values()], name=kind, marker={"color": colour})
        for (kind, shares), colour in zip(data["timing"]["joint_use"].items(), LINES[2:])
    ]
    return figure(traces, 320, yaxis=axis("largest share of the limit [%]"), shapes=[level(100)])
