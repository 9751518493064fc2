"""A state and what speaks for it, as a page: verdict, path before and after, rises, touches, hypotheses."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.units import MINUTE, MM, UM
from compgen.pipelines.anchor import Anchored
from compgen.report.anchor_record import anchor_record
from compgen.report.figure import COOL, GREY, WARM, axis, figure, trace
from compgen.report.figure_words import curves_in_words
from compgen.report.inputs import SHORT, Inputs, job_inputs
from compgen.report.page import PLAIN, PageOptions, figure_section, findings_list, page, section, verdict
from compgen.report.table import table

REMARK = "The state holds for the robot as it was touched, standing since, for as long as it says."


OF_JOB = ("path", "robot_file")  # files that the job's inputs have already


def anchor_html(anchored: Anchored, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = anchor_record(anchored)
    before, after = data["path"]["before"]["rms_um"], data["path"]["after"]["rms_um"]
    kind = {"anchored": "inside", "leave it": "inside"}.get(data["verdict"], "outside")
    lead = (
        f"<b>{data['verdict']}</b>: {escape(data['reason'])}. Along this path the tool's place is open by {before:.0f} "
        f"&micro;m rms before the touches and {after:.0f} &micro;m after; the state holds "
        f"{data['state']['window_s'] / MINUTE:.0f} min."
    )
    body = findings_list(anchored.findings)
    body += _path(anchored) + _rises(data) + _touches(data) + _hypotheses(data)
    title = f"What {anchored.job.robot.name} is now: {anchored.job.title or anchored.job.name}"
    return page(title, body, verdict(kind, lead), _inputs(anchored), REMARK, options)


def _inputs(anchored: Anchored) -> Inputs:
    """The job's, and what was touched."""
    of_job, made_from = job_inputs(anchored.job), anchored.state.made_from
    rows = [(name, f"sha256 {digest[:SHORT]}") for name, digest in made_from.items() if name not in OF_JOB]
    hashes = [(name, digest) for name, digest in made_from.items() if name not in OF_JOB]
    return Inputs((*of_job.rows, *rows), (*of_job.hashes, *hashes))


def _path(anchored: Anchored) -> str:
    place, x = anchored.path.position / MM, np.arange(len(anchored.path.theta)) / max(len(anchored.path.theta) - 1, 1)
    moved = np.linalg.norm(anchored.chosen.correction, axis=1) / UM
    traces = [
        trace("scatter", 100 * x, anchored.chosen.before / UM, name="open before", mode="lines", line={"color": WARM}),
        trace(
            "scatter",
            100 * x,
            anchored.chosen.after / UM,
            name="open after",
            mode="lines",
            line={"color": COOL, "dash": "dash"},
        ),
        trace(
            "scatter", 100 * x, moved, name="the state moves it by", mode="lines", line={"color": GREY, "dash": "dot"}
        ),
    ]
    text = f"<p class=lead>{len(place)} places along the part; standard deviation, all directions together.</p>"
    alt = curves_in_words("Along the part", traces, "µm")
    drawn = figure(traces, 300, alt, xaxis=axis("along the part [%]"), yaxis=axis("[µm]", rangemode="tozero"))
    return figure_section("Along the path", drawn, "path", text)


def _rises(data: dict[str, Any]) -> str:
    state = data["state"]
    rows = [
        [f"rise of {escape(name)} [K]", f"{state['forecast_K'][name]:.2f}", f"{rise:.2f}",
         f"{2 * state['sigma_K'][name]:.2f}"]
        for name, rise in state["rise_K"].items()
    ]  # fmt: skip
    rows += [
        [f"base {name}", "0", f"{value:.1f}", f"{2 * sigma:.1f}"]
        for name, value, sigma in zip(
            ("x [&micro;m]", "y [&micro;m]", "z [&micro;m]", "about x [mdeg]", "about y [mdeg]", "about z [mdeg]"),
            (*state["base_shift_um"], *state["base_turn_mdeg"]), (*state["base_sigma_um"], *state["base_sigma_mdeg"]),
        )
    ]  # fmt: skip
    rows += [
        [escape(name), "0", f"{d['change']:.4g}", f"{2 * d['sigma']:.2g}"] for name, d in state["drifting"].items()
    ]
    return section("The state", table(["", "forecast", "state", "k = 2"], rows))


def _touches(data: dict[str, Any]) -> str:
    rows = [
        [
            escape(t["at"].rsplit("/", 1)[-1]), escape(t["target"]),
            ", ".join(f"{v:.0f}" for v in t["from_forecast_um"]),
            *((f"{t['left_out_um']:.0f}", f"{t['E_n']:.2f}") if t["used"] else ("left out", "")),
        ]
        for t in data["touches"]
    ]  # fmt: skip
    head = ["touch", "target", "from the forecast [&micro;m]", "predicted by the others to [&micro;m]", "E_n"]
    return section("Touches", table(head, rows))


def _hypotheses(data: dict[str, Any]) -> str:
    rows = []
    for h in data["hypotheses"]:
        wrong = h["knocked"] or (h["wrong_touch"] or "").rsplit("/", 1)[-1]
        rows.append(
            [
                f"{h['times_the_forecast']:g} times the forecast", str(h["base_moved"]), escape(wrong),
                f"{h['times_the_noise']:g}", f"{h['log_evidence']:.1f}", f"{h['chi2']:.0f}",
            ]
        )  # fmt: skip
    chi2 = f"chi&sup2; of {data['innovation']['coordinates']}"
    head = ["what is open", "base", "left out", "times the noise", "log evidence", chi2]
    return section("What may have happened", table(head, rows))
