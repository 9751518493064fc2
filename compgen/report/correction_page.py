"""A correction of an existing program as one page."""

from collections.abc import Sequence
from html import escape

import numpy as np

from compgen.core.units import MM, UM
from compgen.fanuc.analysis.unsafe_statements import Unsafe
from compgen.pipelines.correct import Correction
from compgen.report.averaged import served_figure
from compgen.report.band_page import BAND, BAND_LINE, band_explained, budget_figure, known_html
from compgen.report.correction_summary import band_of_correction, correction_summary
from compgen.report.figure import (
    COOL,
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
from compgen.report.inputs import correction_inputs
from compgen.report.page import PLAIN, PageOptions, error_table, figure_section, findings_list, page, section, verdict
from compgen.report.rise_figure import rise_figure
from compgen.report.table import table
from compgen.verification.verdict import Verdict

#: Parts of the error, as the summary and as the table name them.
PARTS = {"total": "position [&micro;m]", "turn": "orientation [mdeg]"}
VERDICTS = {
    Verdict.INSIDE: "inside its bound",
    Verdict.OUTSIDE: "outside",
    Verdict.NOT_LOADABLE: "more than the controller can load",
    Verdict.NO_BOUNDS: "nowhere worse; judged by no bound, for none is given (--max-um)",
    Verdict.NOT_CORRECTED: "nothing corrected",
}
FIGURES = {
    "average": "Error at each start that this file serves",
    "time": "Error over time",
    "budget": "What the part will see beyond the arithmetic",
    "space": "The program, coloured by its error before",
    "heat": "Temperature while the program runs",
}
REMARK = "CNT is taken as passing through the points; jumps and calls are not followed."
MAX_STATEMENTS = 500  # unsafe ones on the page


def correction_html(result: Correction, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data, plan = correction_summary(result), result.plan
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['positions']['corrected']} positions corrected, {data['positions']['new']} new, "
        f"{data['positions']['unchanged']} unchanged &middot; {data['duration_s']:.1f} s</p>"
    )
    if data["before"]:
        before, after = data["before"]["total"]["max_um"], data["after"]["total"]["max_um"]
        kind = "inside" if result.inside else "outside"
        text = (
            f"Largest error <b>{before:.1f} &micro;m</b> before; after: <b>{after:.2f} &micro;m</b> of arithmetic, "
            f"proven from the written text: <b>{VERDICTS[result.verdict]}</b>"
            + (f"; {known_html(data['band'])}." if data["band"] else ".")
        )
        errors = error_table("error", [(side, data[side]) for side in ("before", "after")], PARTS)
    else:
        kind, errors = "outside", ""
        text = "<b>Nothing corrected</b>: no position of this program can be, and it is unchanged."
    body = f"{findings_list(result.findings)}{errors}"
    figures = correction_figures(result) if len(result.execution.station) else {}
    explained = {"budget": band_explained(data["band"])} if data["band"] else {}
    body += "".join(figure_section(FIGURES[k], content, k, explained.get(k, "")) for k, content in figures.items())
    if plan.scope.unsafe:
        body += _unsafe_statements(plan.scope.unsafe)
    made = data["provenance"]
    inputs = correction_inputs(result, made["planned_sha256"], made["corrected_sha256"])
    return page(f"{data['name']}: correction", body, lead + verdict(kind, text), inputs, REMARK, options)


def correction_figures(result: Correction) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``."""
    stations = result.plan.stations
    record = band_of_correction(result)
    return {
        **({} if result.served is None else {"average": served_figure(result.served)}),
        "time": _error_over_time(result),
        **({} if record is None else {"budget": budget_figure(record)}),
        "space": _program_in_space(result),
        "heat": rise_figure(result.cell.heat.names, stations.time, stations.rise, "time from the start [s]"),
    }


def _unsafe_statements(unsafe: Sequence[Unsafe]) -> str:
    """Statements that are passed through untouched or cast doubt, with the reason of each, as a table."""
    rows = [[str(u.line), f"<code>{escape(u.text)}</code>", escape(u.reason)] for u in unsafe[:MAX_STATEMENTS]]
    return section("Passed through untouched, or casting doubt", table(["line", "statement", "why"], rows, (1, 2)))


def _error_over_time(result: Correction) -> Figure:
    traces = []
    for name, values, colour in (("before", result.error.distance, WARM), ("after", result.residual.distance, COOL)):
        rows = rows_to_draw(values)
        look = {"mode": "lines+markers", "marker": {"size": 4}, "line": {"color": colour, "width": 1.4}}
        x, y = np.round(result.execution.time[rows], 3), np.round(values[rows] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, **look))
    if result.band is not None:
        time, may = result.plan.stations.time[result.band.rows], result.band.radius
        rows = rows_to_draw(may)
        x, y = np.round(time[rows], 3), np.round(may[rows] / UM, 3)
        look = {"fill": "tozeroy", "fillcolor": BAND, "line": {"color": BAND_LINE, "width": 1}}
        traces.append(trace("scatter", x, y, name="may be off (95 %), as far as known", mode="lines", **look))
    alt = curves_in_words("Error over time", traces, "µm")
    return figure(traces, 320, alt, yaxis=axis("error [µm]", rangemode="tozero"), xaxis=axis("time from the start [s]"))


def _program_in_space(result: Correction) -> Figure:
    plan = result.plan
    rows = np.flatnonzero(result.execution.fraction == 1)
    rows = rows[rows_to_draw(result.error.distance[rows])]
    pose = plan.drive.pose[result.execution.station[rows]]
    xyz = (np.round(v / MM, 2) for v in plan.poses.tcp.position[pose].T)
    marker = {
        "size": 3,
        "color": packed_array(np.round(result.error.distance[rows] / UM, 3)),
        "colorscale": TURBO,
        "colorbar": {"title": {"text": "µm"}, "thickness": 12},
        "cmin": 0,
        "cmax": max(float(np.max(result.error.distance[rows], initial=0.0)) / UM, 1e-3),
    }
    text = [f"P[{n}]" for n in plan.poses.number[pose].tolist()]
    line = {"color": "#cbd5e1", "width": 2}
    points = trace("scatter3d", *xyz, mode="lines+markers", marker=marker, line=line, text=text, showlegend=False)
    scene = {
        "xaxis": axis("X [mm]"), "yaxis": axis("Y [mm]"), "zaxis": axis("Z [mm]"), "aspectmode": "data",
        "camera": {"eye": {"x": 1.3, "y": -1.9, "z": 1.3}},
    }  # fmt: skip
    return figure([points], 480, "The program in space", scene=scene)
