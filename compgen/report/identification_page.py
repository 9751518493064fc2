"""What an identification came to, as one page."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import DEG, MM, UM
from compgen.identification.identifiability import correlations
from compgen.identification.identify import Identification
from compgen.report.figure import RED_TO_BLUE, Figure, axis, div, figure, trace
from compgen.report.identification_summary import identification_summary
from compgen.report.page import COOL, GREY, LINES, WARM, page, thin

MANY = 60  # parameters that a picture of correlations can show


def identification_html(found: Identification) -> bytes:
    """One page: the verdict, the ladder, residuals before and after, parameters, correlations."""
    told = identification_summary(found)
    held = told["held_out_um"]
    first = told["ladder"][0]["held_out_um"]
    kind = "outside" if found.refused else "inside"
    lead = (
        f'<p class="lead">{told["poses"]} poses, {told["places"]} places of {len(told["reflectors"])} reflectors; '
        f"model &ldquo;{told['model']}&rdquo;, noise {told['noise_um']:.1f} &micro;m a coordinate</p>"
        f'<p class="big {kind}">Held-out error <b>{held["mean"]:.1f} &micro;m</b> (95 %: {held["low"]:.1f} to '
        f"{held['high']:.1f}) where the nominal arm has <b>{first['mean']:.1f} &micro;m</b>: {told['verdict']}.</p>"
    )
    notes = "".join(
        f'<li class="{"outside" if f["level"] == "refused" else f["level"]}">{f["level"]}: {escape(f["message"])}</li>'
        for f in told["findings"]
    )
    figures = [
        ("Residual vectors in space, 100 times larger", _in_space(found), "space"),
        ("Residual over time, before and after", _over_time(found), "time"),
        ("Residual over each joint, after", _over_joints(found), "joints"),
        ("Correlation of the parameters that the data knows best", _correlated(found), "correlation"),
    ]
    body = "".join(f"<h2>{title}</h2>{div(figure, key)}" for title, figure, key in figures)
    findings = f"<h2>Findings</h2><ul>{notes or '<li class=note>none</li>'}</ul>"
    return page(f"Identification of {found.robot.name}", lead + findings + _ladder(told) + body + _parameters(told))


def _ladder(told: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{s['model']}</td><td>{s['parameters']}</td><td>{s['effective']:.1f}</td>"
        f"<td>{s['held_out_um']['mean']:.1f}</td>"
        f"<td>{s['held_out_um']['low']:.1f} to {s['held_out_um']['high']:.1f}</td>"
        f"<td>{s['noise_um']:.1f}</td></tr>"
        for s in told["ladder"]
    )
    return (
        "<h2>Models</h2><table><thead><tr><th>model</th><th>parameters</th><th>effective</th>"
        f"<th>held-out [&micro;m]</th><th>95 %</th><th>noise [&micro;m]</th></tr></thead><tbody>{rows}</tbody></table>"
    )


def _parameters(told: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{p['name']}</td><td>{p['value']:.4g}</td><td>{p['sigma']:.3g}</td>"
        f"<td>{100 * p['told']:.0f} %</td></tr>"
        for p in told["parameters"]
    )
    return (
        "<h2>Parameters</h2><p class=lead>Known: how much of the prior's variance the data has taken away.</p><table>"
        "<thead><tr><th>parameter</th><th>value</th><th>sigma</th><th>known</th></tr></thead>"
        f"<tbody>{rows}</tbody></table>"
    )


def _in_space(found: Identification) -> Figure:
    data, fit = found.data, found.selected.fit
    traces = []
    keep = thin(np.linalg.norm(fit.residual, axis=1))
    for step, colour, name in ((found.candidates[0], WARM, "before"), (found.selected, COOL, "after")):
        start = data.position[keep]
        end = start + 100 * step.fit.residual[keep]
        gap = np.full(len(start), np.nan)
        xyz = (np.round(np.column_stack([start[:, k], end[:, k], gap]).ravel() / MM, 2) for k in range(3))
        traces.append(trace("scatter3d", *xyz, mode="lines", name=name, line={"color": colour, "width": 3}))
    scene = {"xaxis": axis("x [mm]"), "yaxis": axis("y [mm]"), "zaxis": axis("z [mm]"), "aspectmode": "data"}
    return figure(traces, 520, scene=scene)


def _over_time(found: Identification) -> Figure:
    data = found.data
    time = data.time[data.pose]
    traces = []
    for step, colour, name in ((found.candidates[0], WARM, "before"), (found.selected, COOL, "after")):
        size = np.linalg.norm(step.fit.residual, axis=1)
        keep = thin(size)
        look = {"mode": "markers", "name": name, "marker": {"color": colour, "size": 5}}
        traces.append(trace("scatter", time[keep], np.round(size[keep] / UM, 2), **look))
    wild = np.flatnonzero(found.selected.fit.outlier)
    size = np.linalg.norm(found.selected.fit.residual, axis=1)
    look = {"mode": "markers", "name": "set aside", "marker": {"color": GREY, "symbol": "x", "size": 9}}
    traces.append(trace("scatter", time[wild], np.round(size[wild] / UM, 2), **look))
    return figure(traces, 340, yaxis=axis("residual [µm]", type="log"), xaxis=axis("time [s], or order"))


def _over_joints(found: Identification) -> Figure:
    data, fit = found.data, found.selected.fit
    size = np.round(np.where(fit.outlier, np.nan, np.linalg.norm(fit.residual, axis=1)) / UM, 2)
    pendant = np.round(found.robot.to_pendant(data.theta)[data.pose] / DEG, 3)
    traces = [
        trace(
            "scatter", pendant[:, k], size, mode="markers", name=f"J{k + 1}", marker={"color": LINES[k], "size": 4},
            visible=True if k == 0 else "legendonly",
        )
        for k in range(6)
    ]  # fmt: skip
    told = "pendant angle [deg]; click the legend for another joint"
    return figure(traces, 340, yaxis=axis("residual [µm]"), xaxis=axis(told))


def _correlated(found: Identification) -> Figure:
    fit = found.selected.fit
    index = np.flatnonzero(fit.active)
    best = np.sort(np.argsort(-fit.gamma[index], kind="stable")[:MANY])
    names = [found.model.parameters[k].name for k in index[best]]
    values = np.round(correlations(fit)[np.ix_(best, best)], 3)
    small = {"tickfont": {"size": 8}}
    return figure(
        [trace("heatmap", names, names, values, colorscale=RED_TO_BLUE, zmin=-1, zmax=1)], 760,
        yaxis={**small, "autorange": "reversed"}, xaxis=small, margin={"l": 190, "r": 20, "t": 40, "b": 190},
    )  # fmt: skip
