"""An identification as one page."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.arrays import Array, BoolArray
from compgen.core.units import DEG, HOUR, MM, UM
from compgen.identification.identifiability import correlations
from compgen.identification.identify import Identification
from compgen.identification.measurements import Measurements
from compgen.report.figure import COOL, GREY, RED_TO_BLUE, WARM, Figure, Trace, axis, figure, rows_to_draw, spans, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, curves_in_words, sentence
from compgen.report.identification_summary import identification_summary, limits_sentence
from compgen.report.inputs import Inputs
from compgen.report.key_words import parameter_words
from compgen.report.page import PLAIN, PageOptions, figure_section, findings_list, in_words, page, section, verdict
from compgen.report.table import table

FIGURES = {
    "space": "Residual vectors in space",
    "time": "Residual over time, before and after",
    "joints": "Residual over each joint, after",
    "correlation": "Correlation of the parameters that the data knows best",
}
REMARK = "What the measurements do not excite stays at the robot file's value, and is known no better than it says."
SIGNED = 0.3  # from which on a correlation has its sign written on it
MAX_PARAMETERS = 60  # that a figure of correlations can show
MOST_PARAMETERS = 40  # in the table, those first that move the tool most
LONG = 2 * HOUR  # of measurements, from which their time is in hours
MOST_PAIRS, ALIKE = 12, 0.8  # in the table of parameters that are hard to tell apart; correlation from which they are


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
    body += "".join(figure_section(FIGURES[key], figures[key], key) for key in figures if key != "correlation")
    body += _parameters(data) + _alike(identification)
    return page(f"Identification of {identification.robot.name}", body, opening, inputs, REMARK, options)


def identification_figures(identification: Identification) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``; none in space where no row is a place.

    Correlations are for a wide screen: the page has the largest of them as a table.
    """
    has_places = bool(_is_place(identification.data).any())
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
    ranked = sorted(data["parameters"], key=lambda p: -p["moves_um"])
    rows = [
        [escape(parameter_words(p["name"])), f"{p['value']:.4g} &plusmn; {p['sigma']:.2g}", f"{p['moves_um']:.0f}",
         f"{100 * p['told']:.0f} %"]
        for p in ranked[:MOST_PARAMETERS]
    ]  # fmt: skip
    rest = len(ranked) - MOST_PARAMETERS
    more = f" {rest} more, which move the tool less, are in the JSON file beside this page." if rest > 0 else ""
    lead = f'<p class="lead">Known: how much of the prior\'s variance the data has taken away.{more}</p>'
    head = ["parameter", "value &plusmn; sigma", "moves the tool by [&micro;m]", "known"]
    return section("Parameters", lead + table(head, rows))


def _alike(identification: Identification) -> str:
    """Pairs of parameters whose effects the data can hardly tell apart."""
    fit = identification.selected.fit
    names = [parameter_words(identification.model.parameters[k].name) for k in np.flatnonzero(fit.active)]
    values = np.triu(correlations(fit), 1)
    pairs = np.argwhere(np.abs(values) > ALIKE).tolist()
    pairs.sort(key=lambda pair: -abs(values[pair[0], pair[1]]))
    if not pairs:
        return section("Hard to tell apart", f"<p>No two parameters correlate by more than {ALIKE:g}.</p>")
    more = f", the first {MOST_PAIRS} of {len(pairs)}" if len(pairs) > MOST_PAIRS else ""
    lead = f'<p class="lead">Parameters that correlate by more than {ALIKE:g}{more}: the data knows what both do.</p>'
    rows = [[escape(names[i]), escape(names[j]), f"{values[i, j]:.2f}"] for i, j in pairs[:MOST_PAIRS]]
    return section("Hard to tell apart", lead + table(["parameter", "and", "correlation"], rows, [1]))


def _residuals_in_space(identification: Identification) -> Figure:
    """Residuals as lines from where they were measured, before and after, each as long as can be seen."""
    data, fit = identification.data, identification.selected.fit
    located = np.flatnonzero(_is_place(data) & ~fit.outlier)
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


def _is_place(data: Measurements) -> BoolArray:
    """Which rows can be drawn: a distance has no place, and a line may lack a coordinate."""
    return (data.numbers == 3) & np.isfinite(data.position).all(axis=1)


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
    """Each row on the scale of what was kept; rows that were set aside stand at the upper edge."""
    data, set_aside = identification.data, identification.selected.fit.outlier
    is_long = np.ptp(data.time) > LONG
    time = data.time[data.pose] / (HOUR if is_long else 1.0)
    rows, words = [], []
    for step, colour, name, symbol in (
        (identification.candidates[0], WARM, "before", "circle"),
        (identification.selected, COOL, "after", "diamond"),
    ):
        size = np.linalg.norm(step.fit.residual, axis=1) / UM
        kept = np.flatnonzero(~set_aside)
        shown = kept[rows_to_draw(size[kept])]
        look = {"mode": "markers", "name": name, "marker": {"color": colour, "size": 5, "symbol": symbol}}
        drawn = np.round(size[shown], 2)
        traces = [trace("scatter", time[shown], drawn, showlegend=True, **look)]
        words.append(course(name, drawn, "µm"))
        top = 1.15 * float(size[kept].max(initial=0.0)) or 1.0
        outliers = np.flatnonzero(set_aside) if name == "after" else np.zeros(0, dtype=int)
        if len(outliers):
            cross = {"color": GREY, "symbol": "x", "size": 9}
            traces.append(
                trace(
                    "scatter",
                    time[outliers],
                    np.full(len(outliers), 0.96 * top),
                    mode="markers",
                    marker=cross,
                    name="set aside, beyond this scale",
                    text=[f"{value:.0f}" for value in size[outliers]],
                    hovertemplate="%{text} µm<extra></extra>",
                )
            )
            words.append(f"{len(outliers)} set aside")
        rows.append(Row(f"{name} [µm]", traces, options={"range": [0, top]}))
    return figure_in_rows(rows, "time [h]" if is_long else "time [s], or order", sentence("Residual over time", words))


def _residuals_over_joints(identification: Identification) -> Figure:
    """A plot for each joint, all on one scale."""
    data, fit = identification.data, identification.selected.fit
    size = np.round(np.where(fit.outlier, np.nan, np.linalg.norm(fit.residual, axis=1)) / UM, 2)
    pendant = np.round(identification.robot.to_pendant(data.theta)[data.pose] / DEG, 3)
    traces: list[Trace] = []
    axes: dict[str, Any] = {}
    narrow: dict[str, Any] = {}
    for k in range(6):
        which = str(k + 1) if k else ""
        look = {"mode": "markers", "name": f"J{k + 1}", "marker": {"color": COOL, "size": 4, "symbol": "diamond"}}
        traces.append(trace("scatter", pendant[:, k], size, xaxis=f"x{which}", yaxis=f"y{which}", **look))
        for layout, columns, gaps in ((axes, 3, (0.07, 0.34)), (narrow, 2, (0.1, 0.18))):
            across, up = spans(columns, gaps[0]), spans(6 // columns, gaps[1])[::-1]
            of_y = {"showticklabels": k % columns == 0, "domain": up[k // columns]}
            of_y["title"] = {"text": "residual [µm]" if k % columns == 0 else ""}
            layout |= {f"xaxis{which}": {"domain": across[k % columns]}, f"yaxis{which}": of_y}
        axes[f"xaxis{which}"] |= axis(f"J{k + 1} [deg]", anchor=f"y{which}", nticks=4, tickangle=0)
        axes[f"yaxis{which}"] |= {"anchor": f"x{which}", "rangemode": "tozero", **({"matches": "y"} if k else {})}
    alt = curves_in_words("Residual over each joint's angle", traces, "µm")
    return figure(traces, 420, alt, {**narrow, "height": 540}, showlegend=False, **axes)


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
    signs = [["" if abs(v) < SIGNED else "+" if v > 0 else "\N{MINUS SIGN}" for v in row] for row in values.tolist()]
    unnamed = {"showticklabels": False}
    narrow = {"height": 420, "margin": {"l": 10, "b": 20}, "xaxis": unnamed, "yaxis": unnamed}
    look = {"colorscale": RED_TO_BLUE, "zmin": -1, "zmax": 1, "colorbar": {"title": {"text": "correlation"}}}
    look |= {"text": signs, "texttemplate": "%{text}"}  # by more than hue
    return figure(
        [trace("heatmap", names, names, values, **look)],
        760,
        f"{alt}.",
        narrow,
        yaxis={**small, "autorange": "reversed"},
        xaxis=small,
        margin={"l": 190, "r": 20, "t": 40, "b": 190},
    )
