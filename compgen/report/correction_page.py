"""A correction of an existing program as one page."""

from collections.abc import Sequence
from html import escape

import numpy as np

from compgen.core.units import MM, UM
from compgen.fanuc.analysis.unsafe_statements import Unsafe
from compgen.pipelines.correct import Correction
from compgen.report.averaged import served_figure
from compgen.report.band_page import band_explained, band_facts, budget_figure, radius_row
from compgen.report.correction_summary import band_of_correction, correction_summary
from compgen.report.figure import COOL, WARM, Figure, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, sentence
from compgen.report.inputs import correction_inputs
from compgen.report.page import PLAIN, PageOptions, error_table, figure_section, findings_list, page, section, verdict
from compgen.report.rise_figure import rise_figure
from compgen.report.table import table
from compgen.report.view import close_together
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
    "space": "The program, coloured by its error",
    "heat": "Temperature while the program runs",
}
REMARK = "CNT is taken as passing through the points; jumps and calls are not followed."
MAX_STATEMENTS = 500  # unsafe ones on the page


def correction_html(result: Correction, options: PageOptions = PLAIN, with_program: bool = True) -> bytes:
    """One page, the same bytes for the same inputs; it says of a program that it is not written, where it is not."""
    data, plan = correction_summary(result), result.plan
    lead = (
        f'<p class="lead">{escape(data["name"])} on {escape(data["provenance"]["robot"])} &middot; '
        f"{data['positions']['corrected']} positions corrected, {data['positions']['new']} new, "
        f"{data['positions']['unchanged']} unchanged &middot; {data['duration_s']:.1f} s</p>"
    )
    if data["before"]:
        before, after = data["before"]["total"]["max_um"], data["after"]["total"]["max_um"]
        kind = "inside" if result.inside else "warning" if result.verdict is Verdict.NO_BOUNDS else "outside"
        words = VERDICTS[result.verdict]
        text = (
            f"<b>{words[0].upper()}{words[1:]}.</b> Largest error <b>{before:.1f} &micro;m</b> before, "
            f"<b>{after:.2f} &micro;m</b> after, proven from the written text."
        )
        errors = error_table("error", [(side, data[side]) for side in ("before", "after")], PARTS)
    else:
        kind, errors = "outside", ""
        text = "<b>Nothing corrected</b>: no position of this program can be, and it is unchanged."
    bound = data["bounds"].get("max_um")
    facts = [] if bound is None else [("bound", f"{bound:g} &micro;m")]
    facts += band_facts(data["band"]) if data["band"] else []
    body = findings_list(result.findings)
    figures = correction_figures(result) if len(result.execution.station) else {}
    explained = {"budget": band_explained(data["band"])} if data["band"] else {}
    body += "".join(figure_section(FIGURES[k], content, k, explained.get(k, "")) for k, content in figures.items())
    if plan.scope.unsafe:
        body += _unsafe_statements(plan.scope.unsafe)
    made = data["provenance"]
    inputs = correction_inputs(result, made["planned_sha256"], made["corrected_sha256"] if with_program else None)
    opening = lead + verdict(kind, text, facts) + errors
    return page(f"{data['name']}: correction", body, opening, inputs, REMARK, options)


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
    rows, words = [], []
    for name, error, colour, symbol in (
        ("before", result.error, WARM, "circle"),
        ("after", result.residual, COOL, "diamond"),
    ):
        drawn = rows_to_draw(error.distance)
        size = np.round(error.distance[drawn] / UM, 3)
        look = {
            "mode": "lines+markers", "marker": {"size": 4, "symbol": symbol}, "line": {"color": colour, "width": 1.4},
        }  # fmt: skip
        curve = trace("scatter", np.round(result.execution.time[drawn], 3), size, name=name, showlegend=True, **look)
        limit = result.options.bound if name == "after" else None
        bound = None if limit is None else (limit / UM, f"bound {limit / UM:g} µm")
        rows.append(Row(f"{name} [µm]", [curve], bound, {"rangemode": "tozero"}))
        words += [course(name, size, "µm"), bound[1] if bound else ""]
    if result.band is not None:
        shown = rows_to_draw(result.band.radius)
        radius = result.band.radius[shown]
        rows.append(radius_row(result.plan.stations.time[result.band.rows[shown]], radius))
        words.append(course("may be off (95 %)", radius / UM, "µm"))
    return figure_in_rows(rows, "time from the start [s]", sentence("Error over time", words))


def _program_in_space(result: Correction) -> Figure:
    """Stations before and after; the view is chosen by those that are corrected and stand close together."""
    plan = result.plan
    rows = np.flatnonzero(result.execution.fraction == 1)
    pose = plan.drive.pose[result.execution.station[rows]]
    places = plan.poses.in_cell(pose) / MM
    part = result.judged[rows].copy()
    part[part] = close_together(places[part])
    shown = rows_to_draw(result.error.distance[rows])
    labels = [f"P[{n}]" for n in plan.poses.number[pose[shown]].tolist()]
    paths = [
        Coloured(name, places[shown], np.round(error.distance[rows[shown]] / UM, 3), labels)
        for name, error in (("before", result.error), ("after", result.residual))
    ]
    return figure_in_space("Error of the program's positions in space", paths, places, part)
