"""An identification as one page."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import DEG, MM, UM
from compgen.identification.identifiability import correlations
from compgen.identification.identify import Identification
from compgen.report.figure import COOL, GREY, LINES, RED_TO_BLUE, WARM, Figure, axis, figure, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, curves_in_words, sentence
from compgen.report.identification_summary import identification_summary, limits_sentence
from compgen.report.inputs import Inputs
from compgen.report.page import PLAIN, PageOptions, figure_section, findings_list, in_words, page, section, verdict
from compgen.report.table import table

FIGURES = {
    "space": "Residual vectors in space",
    "time": "Residual over time, before and after",
    "joints": "Residual over each joint, after",
    "correlation": "Correlation of the parameters that the data knows best",
}
REMARK = "What the measurements do not excite stays at the robot file's value, and is known no better than it says."
MAX_PARAMETERS = 60  # that a figure of correlations can show


def identification_html(
    identification: Identification, inputs: Inputs | None = None, options: PageOptions = PLAIN
) -> bytes:
    """One page: the verdict, the ladder, residuals before and after, parameters, correlations."""
    data = identification_summary(identification)
    held_out, nominal = data["held_out_um"], data["ladder"][0]["held_out_um"]
    kinds = ", ".join(f"{rows['rows']} {kind}" for kind, rows in data["kinds"].items())
    lead = (
        f'<p class="lead">{data["poses"]} poses, {kinds} of {len(data["reflectors"])} reflectors; '
        f"model &ldquo;{data['model']}&rdquo;, noise {data['noise_um']:.1f} &micro;m a coordinate</p>"
    )
    sentence = (
        f"Held-out error <b>{held_out['mean']:.1f} &micro;m</b> (95 %: {held_out['low']:.1f} to "
        f"{held_out['high']:.1f}) where the nominal arm has <b>{nominal['mean']:.1f} &micro;m</b>: {data['verdict']}."
    )
    opening = lead + verdict("outside" if identification.refused else "inside", sentence)
    figures = identification_figures(identification)
    opening += f"<p>{in_words(limits_sentence(data))}</p>"
    body = findings_list(identification.findings) + _ladder(data) + _kinds(data)
    body += "".join(figure_section(FIGURES[key], content, key) for key, content in figures.items())
    body += _parameters(data)
    return page(f"Identification of {identification.robot.name}", body, opening, inputs, REMARK, options)


def identification_figures(identification: Identification) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``; none in space where no row is a place."""
    has_places = bool((identification.data.numbers == 3).any())  # a distance has no place to be drawn at
    return {
        **({"space": _residuals_in_space(identification)} if has_places else {}),
        "time": _residuals_over_time(identification),
        "joints": _residuals_over_joints(identification),
        "correlation": _correlation_map(identification),
    }


def _ladder(data: dict[str, Any]) -> str:
    rows = [
        [
            s["model"], str(s["parameters"]), f"{s['effective']:.1f}", f"{s['held_out_um']['mean']:.1f}",
            f"{s['held_out_um']['low']:.1f} to {s['held_out_um']['high']:.1f}", f"{s['noise_um']:.1f}",
        ]
        for s in data["ladder"]
    ]  # fmt: skip
    head = ["model", "parameters", "effective", "held-out [&micro;m]", "95 %", "noise [&micro;m]"]
    return section("Models", table(head, rows))


def _kinds(data: dict[str, Any]) -> str:
    """What each kind of rows left, where there are several or none is a place."""
    if list(data["kinds"]) == ["places"]:
        return ""
    rows = [
        [kind, str(k["rows"]), f"{k['noise_um']:.1f}", f"{k['held_out_um']:.1f}"] for kind, k in data["kinds"].items()
    ]
    lead = "<p class=lead>A distance or a touch from one side counts &radic;3 times, as one coordinate of a place.</p>"
    return section("Measured", lead + table(["rows", "count", "noise [&micro;m]", "held-out [&micro;m]"], rows))


def _parameters(data: dict[str, Any]) -> str:
    rows = [
        [p["name"], f"{p['value']:.4g}", f"{p['sigma']:.3g}", f"{100 * p['told']:.0f} %"] for p in data["parameters"]
    ]
    lead = "<p class=lead>Known: how much of the prior's variance the data has taken away.</p>"
    return section("Parameters", lead + table(["parameter", "value", "sigma", "known"], rows))


def _residuals_in_space(identification: Identification) -> Figure:
    """Residuals as lines from where they were measured, before and after, each as long as can be seen."""
    data, fit = identification.data, identification.selected.fit
    located = np.flatnonzero(data.numbers == 3)
    rows = located[rows_to_draw(np.linalg.norm(fit.residual[located], axis=1))]
    places = fit.frames.far_ends(data, *identification.model.pose(data, fit.p))[rows]
    paths, ends = [], [places]
    for name, step in (("before", identification.candidates[0]), ("after", identification.selected)):
        residual = step.fit.residual[rows]
        size = np.linalg.norm(residual, axis=1)
        times = magnification(places, size)
        tips = places + times * residual
        gap = np.full_like(places, np.nan)
        line = np.stack([places, tips, gap], axis=1).reshape(-1, 3)
        paths.append(Coloured(f"{name}, {times:,} times larger", line / MM, np.repeat(np.round(size / UM, 2), 3)))
        ends.append(tips)
    everywhere = np.vstack(ends) / MM
    return figure_in_space("Residuals in space", paths, everywhere, np.ones(len(everywhere), dtype=bool))


def magnification(places: Array, size: Array) -> int:
    """A round number by which residuals of these sizes can be seen among places, the largest about a tenth of them."""
    largest = float(size.max(initial=0.0))
    if largest == 0:
        return 1
    spread = max(float(np.ptp(places, axis=0).max()), 0.1)
    wanted = max(0.12 * spread / largest, 1.0)
    power = 10 ** int(np.floor(np.log10(wanted)))
    return int(max(step * power for step in (1, 2, 5) if step * power <= wanted))


def _residuals_over_time(identification: Identification) -> Figure:
    data = identification.data
    time = data.time[data.pose]
    rows, words = [], []
    for step, colour, name, symbol in (
        (identification.candidates[0], WARM, "before", "circle"),
        (identification.selected, COOL, "after", "diamond"),
    ):
        size = np.linalg.norm(step.fit.residual, axis=1)
        shown = rows_to_draw(size)
        look = {"mode": "markers", "name": name, "marker": {"color": colour, "size": 5, "symbol": symbol}}
        drawn = np.round(size[shown] / UM, 2)
        traces = [trace("scatter", time[shown], drawn, showlegend=True, **look)]
        words.append(course(name, drawn, "µm"))
        outliers = np.flatnonzero(step.fit.outlier) if step is identification.selected else np.zeros(0, dtype=int)
        if len(outliers):
            cross = {"mode": "markers", "name": "set aside", "marker": {"color": GREY, "symbol": "x", "size": 9}}
            traces.append(trace("scatter", time[outliers], np.round(size[outliers] / UM, 2), **cross))
            words.append(f"{len(outliers)} set aside")
        rows.append(Row(f"{name} [µm]", traces, options={"rangemode": "tozero"}))
    return figure_in_rows(rows, "time [s], or order", sentence("Residual over time", words))


def _residuals_over_joints(identification: Identification) -> Figure:
    data, fit = identification.data, identification.selected.fit
    size = np.round(np.where(fit.outlier, np.nan, np.linalg.norm(fit.residual, axis=1)) / UM, 2)
    pendant = np.round(identification.robot.to_pendant(data.theta)[data.pose] / DEG, 3)
    traces = [
        trace(
            "scatter", pendant[:, k], size, mode="markers", name=f"J{k + 1}", marker={"color": LINES[k], "size": 4},
            visible=True if k == 0 else "legendonly",
        )
        for k in range(6)
    ]  # fmt: skip
    title = "pendant angle [deg]"
    narrow = {"xaxis": {"title": {"text": title}}}
    alt = curves_in_words("Residual over each joint's angle", traces, "µm")
    return figure(
        traces,
        340,
        alt,
        narrow,
        yaxis=axis("residual [µm]"),
        xaxis=axis(f"{title}; click the legend for another joint"),
    )


def _correlation_map(identification: Identification) -> Figure:
    fit = identification.selected.fit
    index = np.flatnonzero(fit.active)
    best = np.sort(np.argsort(-fit.gamma[index], kind="stable")[:MAX_PARAMETERS])
    names = [identification.model.parameters[k].name for k in index[best]]
    values = np.round(correlations(fit)[np.ix_(best, best)], 3)
    small = {"tickfont": {"size": 8}}
    pairs = np.abs(np.triu(values, 1))
    one, other = np.unravel_index(int(np.argmax(pairs)), pairs.shape) if len(names) > 1 else (0, 0)
    alt = f"Correlation of {len(names)} parameters"
    if len(names) > 1:
        alt += (
            f": largest {values[one, other]:.2f}, of {names[one]} and {names[other]}; {(pairs > 0.9).sum()} above 0.9"
        )
    unnamed = {"showticklabels": False}
    narrow = {"height": 420, "margin": {"l": 10, "b": 20}, "xaxis": unnamed, "yaxis": unnamed}
    look = {"colorscale": RED_TO_BLUE, "zmin": -1, "zmax": 1, "colorbar": {"title": {"text": "correlation"}}}
    return figure(
        [trace("heatmap", names, names, values, **look)], 760, f"{alt}.", narrow,
        yaxis={**small, "autorange": "reversed"}, xaxis=small, margin={"l": 190, "r": 20, "t": 40, "b": 190},
    )  # fmt: skip
