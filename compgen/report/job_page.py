"""A job as one page that opens offline: findings first, then the error, the path, the temperatures, the joints."""

from html import escape
from typing import Any

from compgen.pipelines.job_results import Corrected, Planned
from compgen.report.band_page import band_explained, known_html
from compgen.report.guaranteed import guaranteed_text
from compgen.report.inputs import job_inputs
from compgen.report.job_figures import job_figures
from compgen.report.job_summary import job_summary
from compgen.report.page import PLAIN, PageOptions, error_table, figure_section, findings_list, page, verdict

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

#: Bounds as the summary names them, and as the page does.
BOUNDS = {
    "max_um": "largest {} &micro;m",
    "p99_um": "99th percentile {} &micro;m",
    "rms_um": "rms {} &micro;m",
    "feed_um": "along feed {} &micro;m",
    "cross_um": "cross feed {} &micro;m",
    "normal_um": "normal to the surface {} &micro;m",
    "axis_mdeg": "tool axis {} mdeg",
}

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
    bounds = ", ".join(BOUNDS[key].format(f"{bound:g}") for key, bound in data["bounds"].items())
    guaranteed = f"; {escape(guaranteed_text(data['guaranteed']))}" if data.get("guaranteed") else ""
    return f"{error_table('component', sides, PARTS)}<p class=lead>Bounds: {bounds or 'none'}{guaranteed}</p>"
