"""A job as one page that opens offline: findings first, then the error, the path, the temperatures, the joints."""

from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np

from compgen.core.arrays import Array, column_extremes
from compgen.core.units import MM, UM
from compgen.pipelines.job_results import Corrected, Planned
from compgen.planning.toolpath import ToolPath
from compgen.report.averaged import averaged_figure
from compgen.report.band_page import BAND, BAND_LINE, band_explained, budget_figure, known_html
from compgen.report.figure import (
    COOL,
    GREY,
    LINES,
    TURBO,
    WARM,
    Figure,
    Trace,
    axis,
    figure,
    horizontal_line,
    packed_array,
    rows_to_draw,
    spans,
    trace,
)
from compgen.report.figure_words import curves_in_words
from compgen.report.guaranteed import guaranteed_text
from compgen.report.inputs import job_inputs
from compgen.report.job_summary import band_of, job_summary
from compgen.report.page import PLAIN, PageOptions, error_table, figure_section, findings_list, page, verdict
from compgen.report.rise_figure import rise_figure
from compgen.verification.band import Band
from compgen.verification.deviation import Deviation

#: Parts of the error, as the summary and as the table name them.
PARTS = {
    "total": "total [&micro;m]",
    "feed": "along feed [&micro;m]",
    "cross": "cross feed [&micro;m]",
    "normal": "normal to the surface [&micro;m]",
    "axis_angle": "tool axis [mdeg]",
}

FIGURES = {
    "average": "Error at each start that this file serves",
    "time": "Error over time",
    "budget": "What the part will see beyond the arithmetic",
    "space": "The path, coloured by error",
    "band": "The path, coloured by how far off the tool may be (95 %)",
    "heat": "Temperature while the program runs",
    "joints": "Use of the joints",
}

REMARK = "CNT is taken as passing through the points; only the error sources active in the robot file are known here."

VERDICTS = {
    "inside": "inside its bounds",
    "outside": "outside its bounds",
    "not loadable": "more than the controller can load",
    "no bounds": "judged by no bounds, for none are given",
    "nothing corrected": "nothing corrected",
}


def job_html(planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = job_summary(planned, corrected)
    figures = job_figures(planned, corrected, data)
    body = "".join(
        figure_section(FIGURES[key], content, key, band_explained(data["band"]) if key == "budget" else "")
        for key, content in figures.items()
    )
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['path']['waypoints']} waypoints, {data['path']['length_m']:.2f} m, "
        f"{data['timing']['duration_s']:.1f} s, {100 * data['timing']['at_feed']:.1f} % of the length at feed</p>"
    )
    findings = findings_list(corrected.findings if corrected else planned.findings)
    return page(
        data["title"] or data["name"], f"{findings}{_table(data)}{body}", lead + _verdict(data),
        job_inputs(planned.job), REMARK, options,
    )  # fmt: skip


def job_figures(planned: Planned, corrected: Corrected | None, summary: dict[str, Any]) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``."""
    curves = [_error_curves(planned.deviation())] + ([_error_curves(corrected.deviation)] if corrected else [])
    rises = (planned.job.heat.names, planned.trajectory.time, planned.rise)
    averaged = None if corrected is None else corrected.averaged
    band, path = band_of(planned, corrected), planned.path
    may = np.interp(curves[-1].arc, path.arc[band.rows], band.radius)
    return {
        **({} if averaged is None else {"average": averaged_figure(averaged)}),
        "time": _error_over_time(curves, planned.job.bounds.max, may),
        "budget": budget_figure(summary["band"]),
        "space": _path_in_space(curves, path),
        "band": _band_in_space(band, path),
        "heat": rise_figure(*rises, "time from leaving P[1] [s]"),
        "joints": _joint_use(summary),
    }


def _verdict(data: dict[str, Any]) -> str:
    before = data["before"]["total"]["max_um"]
    if data["after"] is None:
        text = (
            f"Uncorrected, the tool will be up to <b>{before:.1f} &micro;m</b> off; {known_html(data['band'])}. "
            "Nothing has been corrected."
        )
    else:
        after, window = data["after"]["total"]["max_um"], data["thermal"]["start_window_s"]
        text = (
            f"Largest error <b>{before:.1f} &micro;m</b> before; after: <b>{after:.2f} &micro;m</b> of arithmetic, "
            f"proven from the written text: {data['ratio']:.0f} times smaller, <b>{VERDICTS[data['verdict']]}</b>; "
            f"{known_html(data['band'])}. Right for a start within {window:.0f} s of the stated warmth."
        )
    if served := data.get("average_over", {}).get("flown"):
        average = data["average_over"]
        text += (
            f" This file serves many starts: with the mean of their rises it leaves {average['at_mean']['max_um']:.2f} "
            f"&micro;m, at the worst of {len(served)} flown starts {average['max_um']:.2f}, "
            f"{average['rms_um']:.2f} rms over all of them."
        )
    kind = data["verdict"] if data["verdict"] in ("inside", "predicted") else "outside"
    return verdict(kind, text)


def _table(data: dict[str, Any]) -> str:
    sides = [(name, data[name]) for name in ("before", "after") if data[name]]
    bounds = ", ".join(f"{key} = {bound:g}" for key, bound in data["bounds"].items())
    guaranteed = f"; {escape(guaranteed_text(data['guaranteed']))}" if data.get("guaranteed") else ""
    return f"{error_table('component', sides, PARTS)}<p class=lead>Bounds: {bounds or 'none'}{guaranteed}</p>"


@dataclass(frozen=True, eq=False, slots=True)
class _ErrorCurves:
    """What the figures show of a deviation, at K samples."""

    arc: Array  # (K,) [m]
    time: Array  # (K,) [s]
    total: Array  # (K,) [um]
    normal: Array  # (K,) [um]
    largest: float  # [m]


def _error_curves(deviation: Deviation) -> _ErrorCurves:
    error = deviation.total()
    rows = rows_to_draw(error)
    total, normal = (np.round(values[rows] / UM, 3) for values in (error, deviation.normal))
    return _ErrorCurves(deviation.arc[rows], deviation.time[rows], total, normal, deviation.extents["total"].max)


def _error_over_time(curves: list[_ErrorCurves], bound: float | None, radius: Array) -> Figure:
    """Before and after, and under them how far off the tool may be: ``radius`` (K,) [m] at the last curve's samples."""
    rows = [*zip(("before", "after"), curves, (WARM, COOL), ("", "2"))]
    *above, lowest = reversed(spans(len(rows) + 1, 0.08))
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    for (name, curve, colour, which), span in zip(rows, above):
        time = np.round(curve.time, 4)
        for part, values, dash, line_colour in (
            ("total", curve.total, "solid", colour),
            ("normal", curve.normal, "dot", GREY),
        ):
            line = {"color": line_colour, "width": 1.4 if part == "total" else 1, "dash": dash}
            place = {"xaxis": f"x{which}", "yaxis": f"y{which}"}
            traces.append(trace("scatter", time, values, name=f"{name}: {part}", line=line, **place))
        axes[f"yaxis{which}"] = axis(f"{name} [µm]", anchor=f"x{which}", domain=span)
        axes[f"xaxis{which}"] = {"anchor": f"y{which}", "domain": [0.0, 1.0]}
        # the upper plots show the lowest one's times
        axes[f"xaxis{which}"].update(matches="x3", showticklabels=False)
    may_be = trace(
        "scatter", np.round(curves[-1].time, 4), np.round(radius / UM, 3), name="may be off (95 %), as far as known",
        xaxis="x3", yaxis="y3", fill="tozeroy", fillcolor=BAND, line={"color": BAND_LINE, "width": 1},
    )  # fmt: skip
    traces.append(may_be)
    axes["yaxis3"] = axis("may be off [µm]", anchor="x3", domain=lowest, rangemode="tozero")
    axes["xaxis3"] = {"anchor": "y3", "domain": [0.0, 1.0], **axis("time from leaving P[1] [s]")}
    if len(rows) > 1 and bound is not None:
        axes["shapes"] = [horizontal_line(bound / UM, "2")]
    return figure(traces, 230 * (len(rows) + 1), curves_in_words("Error over time", traces, "µm"), **axes)


def _scene(path: ToolPath) -> dict[str, Any]:
    """Axes in space: flat paths keep their plan's proportions and get a little height, so that leads can be seen."""
    low, high = column_extremes(path.target.position)
    size = high - low
    proportions = np.maximum(size / size.max(), 0.05).round(3).tolist()
    return {
        "xaxis": axis("X [mm]"),
        "yaxis": axis("Y [mm]"),
        "zaxis": axis("Z [mm]", nticks=3),
        "aspectmode": "manual",
        "aspectratio": {"x": proportions[0], "y": proportions[1], "z": max(proportions[2], 0.15)},
        "camera": {"eye": {"x": 0.2, "y": -1.1, "z": 1.2}},
    }


def _path_in_space(curves: list[_ErrorCurves], path: ToolPath) -> Figure:
    count, scene = len(curves), _scene(path)
    traces, scenes, titles = [], {}, []
    for i, (name, curve, span) in enumerate(zip(("before", "after"), curves, spans(count, 0.2 / count)), 1):
        bar = {"title": {"text": "µm"}, "len": 0.7, "x": i / count - 0.02 if count > 1 else 1.0, "thickness": 12}
        marker = {
            "size": 2.2,
            "color": packed_array(curve.total),
            "colorscale": TURBO,
            "colorbar": bar,
            "cmin": 0,
            "cmax": float(np.ceil(100 * curve.largest / UM) / 100),
            "line": {"width": 0},
        }
        scene_name = f"scene{i if i > 1 else ''}"
        xyz = positions_at(path, curve.arc)
        traces.append(trace("scatter3d", *xyz, mode="markers", marker=marker, showlegend=False, scene=scene_name))
        scenes[scene_name] = {"domain": {"x": span, "y": [0.0, 1.0]}, **scene}
        titles.append(
            {"text": name, "font": {"size": 16}, "showarrow": False, "x": sum(span) / 2, "xref": "paper", "y": 1.0,
            "xanchor": "center", "yref": "paper", "yanchor": "bottom"}
        )  # fmt: skip
    return figure(traces, 460, "The path in space", annotations=titles, **scenes)


def _band_in_space(band: Band, path: ToolPath) -> Figure:
    """The path, coloured by the radius that the tool stays within in 95 of 100 cases."""
    rows = rows_to_draw(band.radius)
    radius = np.round(band.radius[rows] / UM, 3)
    marker = {
        "size": 2.2, "color": packed_array(radius), "colorscale": TURBO, "line": {"width": 0},
        "colorbar": {"title": {"text": "µm"}, "len": 0.7, "thickness": 12},
        "cmin": 0, "cmax": max(float(np.ceil(100 * radius.max()) / 100), 0.01),
    }  # fmt: skip
    xyz = positions_at(path, path.arc[band.rows[rows]])
    points = trace("scatter3d", *xyz, mode="markers", marker=marker, showlegend=False)
    return figure([points], 460, "The path in space", scene=_scene(path))


def positions_at(path: ToolPath, arc: Array) -> list[Array]:
    """x, y and z [mm] at lengths along the path, (K,) each, linear between waypoints."""
    after = np.searchsorted(path.arc, arc, side="right").clip(1, len(path.arc) - 1)
    rows = np.unique(np.concatenate([after - 1, after]))
    return [np.round(np.interp(arc, path.arc[rows], path.target.position[rows, k]) / MM, 2) for k in range(3)]


def _joint_use(data: dict[str, Any]) -> Figure:
    traces = [
        trace("bar", list(shares), [round(100 * v, 2) for v in shares.values()], name=kind, marker={"color": colour})
        for (kind, shares), colour in zip(data["timing"]["joint_use"].items(), LINES[2:])
    ]
    alt = curves_in_words("Use of the joints", traces, "% of the limit")
    return figure(traces, 320, alt, yaxis=axis("largest share of the limit [%]"), shapes=[horizontal_line(100)])
