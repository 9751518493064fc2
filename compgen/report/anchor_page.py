"""A state and what speaks for it, as a page: verdict, path before and after, rises, touches, hypotheses."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import MINUTE, MM, UM
from compgen.pipelines.anchor import Anchored
from compgen.report.anchor_record import anchor_record
from compgen.report.figure import COOL, GREY, WARM, axis, figure, trace
from compgen.report.figure_words import curves_in_words
from compgen.report.page import figure_section, findings_list, page, section, verdict


def anchor_html(anchored: Anchored) -> bytes:
    """One page."""
    data = anchor_record(anchored)
    before, after = data["path"]["before"]["rms_um"], data["path"]["after"]["rms_um"]
    kind = {"anchored": "inside", "leave it": "inside"}.get(data["verdict"], "outside")
    lead = (
        f"<b>{data['verdict']}</b>: {escape(data['reason'])}. Along this path the tool's place is open by {before:.0f} "
        f"&micro;m rms before the touches and {after:.0f} &micro;m after; the state holds "
        f"{data['state']['window_s'] / MINUTE:.0f} min."
    )
    body = verdict(kind, lead) + _path(anchored) + _rises(data) + _touches(data) + _hypotheses(data)
    return page(
        f"What {anchored.job.robot.name} is now: {anchored.job.title or anchored.job.name}",
        body + findings_list(anchored.findings),
    )


def _path(anchored: Anchored) -> str:
    place, x = anchored.path.position / MM, np.arange(len(anchored.path.theta)) / max(len(anchored.path.theta) - 1, 1)
    moved = np.linalg.norm(anchored.chosen.correction, axis=1) / UM
    traces = [
        trace("scatter", 100 * x, anchored.chosen.before / UM, name="open before", mode="lines", line={"color": WARM}),
        trace("scatter", 100 * x, anchored.chosen.after / UM, name="open after", mode="lines", line={"color": COOL}),
        trace("scatter", 100 * x, moved, name="the state moves it by", mode="lines", line={"color": GREY}),
    ]
    text = f"<p class=lead>{len(place)} places along the part; standard deviation, all directions together.</p>"
    alt = curves_in_words("Along the part", traces, "µm")
    drawn = figure(traces, 300, alt, xaxis=axis("along the part [%]"), yaxis=axis("[µm]", rangemode="tozero"))
    return figure_section("Along the path", drawn, "path", text)


def _rises(data: dict[str, Any]) -> str:
    state = data["state"]
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{state['forecast_K'][name]:.2f}</td><td>{rise:.2f}</td>"
        f"<td>{2 * state['sigma_K'][name]:.2f}</td></tr>"
        for name, rise in state["rise_K"].items()
    )
    head = "<tr><th>rise [K]</th><th>forecast</th><th>state</th><th>k = 2</th></tr>"
    base = "".join(
        f"<tr><td>base {name}</td><td>0</td><td>{value:.1f}</td><td>{2 * sigma:.1f}</td></tr>"
        for name, value, sigma in zip(
            ("x [&micro;m]", "y [&micro;m]", "z [&micro;m]", "about x [mdeg]", "about y [mdeg]", "about z [mdeg]"),
            (*state["base_shift_um"], *state["base_turn_mdeg"]), (*state["base_sigma_um"], *state["base_sigma_mdeg"]),
        )
    )  # fmt: skip
    drift = "".join(
        f"<tr><td>{escape(name)}</td><td>0</td><td>{d['change']:.4g}</td><td>{2 * d['sigma']:.2g}</td></tr>"
        for name, d in state["drifting"].items()
    )
    return section("The state", f"<table><thead>{head}</thead><tbody>{rows}{base}{drift}</tbody></table>")


def _touches(data: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td>{escape(t['at'].rsplit('/', 1)[-1])}</td><td>{escape(t['target'])}</td>"
        f"<td>{', '.join(f'{v:.0f}' for v in t['from_forecast_um'])}</td>"
        + (f"<td>{t['left_out_um']:.0f}</td><td>{t['E_n']:.2f}</td>" if t["used"] else "<td>left out</td><td></td>")
        + "</tr>"
        for t in data["touches"]
    )
    head = (
        "<tr><th>touch</th><th>target</th><th>from the forecast [&micro;m]</th><th>predicted by the others to "
        "[&micro;m]</th><th>E_n</th></tr>"
    )
    return section("Touches", f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>")


def _hypotheses(data: dict[str, Any]) -> str:
    rows = ""
    for h in data["hypotheses"]:
        wrong = h["knocked"] or (h["wrong_touch"] or "").rsplit("/", 1)[-1]
        rows += (
            f"<tr><td>{h['times_the_forecast']:g} times the forecast</td><td>{h['base_moved']}</td>"
            f"<td>{escape(wrong)}</td><td>{h['times_the_noise']:g}</td><td>{h['log_evidence']:.1f}</td>"
            f"<td>{h['chi2']:.0f}</td></tr>"
        )
    head = (
        "<tr><th>what is open</th><th>base</th><th>left out</th><th>times the noise</th><th>log evidence</th>"
        f"<th>chi&sup2; of {data['innovation']['coordinates']}</th></tr>"
    )
    return section("What may have happened", f"<table><thead>{head}</thead><tbody>{rows}</tbody></table>")
