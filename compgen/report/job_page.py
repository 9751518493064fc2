"""A job as one page that opens offline: findings first, then the error, the path, the temperatures, the joints."""

from dataclasses import replace
from html import escape
from typing import Any

from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report.band_page import band_explained, band_facts
from compgen.report.guaranteed import guaranteed_text
from compgen.report.inputs import SHORT, Inputs, job_inputs, time_words
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


#: Looks of verdicts; any other is ``outside``.
KINDS = {"inside": "inside", "predicted": "predicted", "no bounds": "warning"}


def job_html(
    planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN, with_program: bool = True
) -> bytes:
    """One page, the same bytes for the same inputs; it says of a program that it is not written, where it is not."""
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
        data["title"] or data["name"], findings + body, lead + _verdict(data) + _table(data),
        _inputs(planned, data, with_program), REMARK, options,
    )  # fmt: skip


def _inputs(planned: Planned, data: dict[str, Any], with_program: bool) -> Inputs:
    """What the page was made from, and the programs that it speaks of."""
    made = job_inputs(planned.job)
    written = list(data["program"]["sha256"].items()) if data.get("program") else []
    if not written:
        return made
    if not with_program:
        return made.with_rows(("program", f"not written: {VERDICTS[data['verdict']]}"))
    file, digest = written[-1] if data["program"]["pages"] else written[0]
    pages = f" and {len(written) - 1} pages" if len(written) > 1 else ""
    return replace(
        made.with_rows(("program", f"{file}{pages}, sha256 {digest[:SHORT]}")),
        hashes=(*made.hashes, *((f"program {name}", whole) for name, whole in written)),
    )


def _verdict(data: dict[str, Any]) -> str:
    part, corrected = data["on_part"], data["after"] is not None
    before = part["before"]["total"]["max_um"]
    if corrected:
        words = VERDICTS[data["verdict"]]
        text = (
            f"<b>{words[0].upper()}{words[1:]}.</b> Largest error on the part <b>{before:.1f} &micro;m</b> before, "
            f"<b>{part['after']['total']['max_um']:.2f} &micro;m</b> after, proven from the written text."
        )
    else:
        text = f"Uncorrected, the tool will be up to <b>{before:.1f} &micro;m</b> off. Nothing has been corrected."
    kind = KINDS.get(data["verdict"], "outside")
    return verdict(kind, text, [("bounds", _bounds(data)), *band_facts(data["band"]), *_served(data)])


def _bounds(data: dict[str, Any]) -> str:
    bounds = ", ".join(BOUNDS[key].format(f"{bound:g}") for key, bound in data["bounds"].items())
    guaranteed = f"; {escape(guaranteed_text(data['guaranteed']))}" if data.get("guaranteed") else ""
    return f"{bounds or 'none'}{guaranteed}"


def _served(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Which starts the file is right for."""
    if data["after"] is None:
        return []
    average = data.get("average_over", {})
    if not average.get("flown"):
        return [("right for", f"a start within {time_words(data['thermal']['start_window_s'])} of the stated warmth")]
    words = (
        f"many starts: with the mean of their rises it leaves {average['at_mean']['max_um']:.2f} &micro;m, at the "
        f"worst of {len(average['flown'])} flown starts {average['max_um']:.2f}, {average['rms_um']:.2f} rms over all"
    )
    return [("right for", words)]


def _table(data: dict[str, Any]) -> str:
    """The error on the part, which the bounds are for, and what it is over the whole program where that is more."""
    sides = [(name, data["on_part"][name]) for name in ("before", "after") if data[name]]
    largest = [(name, data[name]["total"]["max_um"]) for name, _ in sides]
    more = any(
        f"{size:.2f}" != f"{part['total']['max_um']:.2f}" for (_, size), (_, part) in zip(largest, sides, strict=False)
    )
    words = ", ".join(f"{size:.2f} &micro;m {name}" for name, size in largest)
    remark = f"<p class=lead>Largest with approach and retract: {words}.</p>" if more else ""
    return error_table("component", sides, PARTS, "Error of the tool centre point on the part") + remark
