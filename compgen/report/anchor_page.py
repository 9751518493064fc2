"""A state and what speaks for it, as a page: verdict, path before and after, rises, touches, hypotheses."""

from html import escape
from typing import Any

import numpy as np

from compgen.core.codes import Code
from compgen.core.units import MINUTE, UM
from compgen.pipelines.anchor import Anchored
from compgen.report.anchor_record import anchor_record
from compgen.report.figure import COOL, GREY, WARM, trace
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, sentence
from compgen.report.inputs import SHORT, Inputs, job_inputs
from compgen.report.key_words import parameter_words
from compgen.report.page import PLAIN, PageOptions, figure_section, findings_list, in_words, page, section, verdict
from compgen.report.table import table

REMARK = "The state holds for the robot as it was touched, standing since, for as long as it says."


OF_JOB = ("path", "robot_file")  # files that the job's inputs have already


def anchor_html(anchored: Anchored, options: PageOptions = PLAIN) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = anchor_record(anchored)
    before, after = data["path"]["before"]["rms_um"], data["path"]["after"]["rms_um"]
    is_anchored = data["verdict"] == "anchored"
    kind = "inside" if is_anchored or data["verdict"] == "leave it" else "outside"
    reason = "" if is_anchored else f" {in_words(data['reason'])}."
    holds = f"{data['state']['window_s'] / MINUTE:.0f} min"
    lead = (
        f"<b>{data['verdict']}</b>.{reason} Along this path the tool's place is open by {before:.0f} &micro;m rms "
        f"before the touches and {after:.0f} &micro;m after; the state holds {holds}."
    )
    repeated = Code.ANCHOR_VERDICT if is_anchored else None  # the opening has its numbers
    body = findings_list(f for f in anchored.findings if f.code != repeated)
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
    along = 100 * np.linspace(0, 1, len(anchored.path.theta))
    sizes = {
        "before": (anchored.chosen.before, WARM, "dash"),
        "after": (anchored.chosen.after, COOL, "solid"),
        "moved": (np.linalg.norm(anchored.chosen.correction, axis=1), GREY, "solid"),
    }
    rows, words = [], []
    for name, (size, colour, dash) in sizes.items():
        line = {"color": colour, "dash": dash}
        curve = trace("scatter", along, size / UM, name=name, mode="lines", line=line, showlegend=False)
        rows.append(Row(f"{name} [µm]", [curve], options={"rangemode": "tozero"}))
        words.append(course(name, size / UM, "µm"))
    text = (
        f'<p class="lead">Before and after the touches: how far the tool may be off at {len(along)} places (standard '
        "deviation, all directions together). Moved: by how much the state moves it from the forecast.</p>"
    )
    drawn = figure_in_rows(rows, "along the part [%]", sentence("Along the part", words))
    return figure_section("Along the path", drawn, "path", text)


def _rises(data: dict[str, Any]) -> str:
    state = data["state"]
    rows = [
        [f"rise of {escape(name)} [K]", f"{state['forecast_K'][name]:.2f}", f"{rise:.2f}",
         f"{2 * state['sigma_K'][name]:.2f}"]
        for name, rise in state["rise_K"].items()
    ]  # fmt: skip
    rows += [
        [f"base {name}", "0", f"{round(value, 1) + 0.0:.1f}", f"{2 * sigma:.1f}"]
        for name, value, sigma in zip(
            (
                "x [&micro;m]", "y [&micro;m]", "z [&micro;m]", "turned about x [mdeg]", "turned about y [mdeg]",
                "turned about z [mdeg]",
            ),
            (*state["base_shift_um"], *state["base_turn_mdeg"]),
            (*state["base_sigma_um"], *state["base_sigma_mdeg"]),
            strict=True,
        )
    ]  # fmt: skip
    rows += [
        [escape(parameter_words(name)), "0", _as_sure(d["change"], d["sigma"]), _as_sure(2 * d["sigma"], d["sigma"])]
        for name, d in state["drifting"].items()
    ]
    return section("The state", table(["", "forecast", "state", "&plusmn; (k = 2)"], rows))


def _as_sure(value: float, sigma: float) -> str:
    """A value with the digits that its standard deviation leaves."""
    return f"{value:.{int(np.clip(1 - np.floor(np.log10(max(sigma, 1e-9))), 0, 9))}f}"


def _touches(data: dict[str, Any]) -> str:
    rows = [
        [
            escape(t["at"].rsplit("/", 1)[-1]), escape(t["target"]),
            ", ".join(f"{v:.0f}" for v in t["from_forecast_um"]),
            *((f"{t['left_out_um']:.0f}", f"{t['E_n']:.2f}") if t["used"] else ("left out", "")),
        ]
        for t in data["touches"]
    ]  # fmt: skip
    lead = '<p class="lead">E<sub>n</sub> up to 1: the other touches predict this one as well as they can.</p>'
    head = ["touch", "target", "off the forecast [&micro;m]", "off the other touches [&micro;m]", "E<sub>n</sub>"]
    return section("Touches", lead + table(head, rows, [1]))


def _hypotheses(data: dict[str, Any]) -> str:
    rows = [
        [escape(_happened(h)), f"{h['log_evidence']:.1f}", f"{h['chi2']:.0f}"]
        for h in data["hypotheses"]
    ]  # fmt: skip
    count = data["innovation"]["coordinates"]
    lead = (
        '<p class="lead">The likeliest first. Evidence: the natural logarithm of how likely it is beside the first. '
        f"Where it explains the touches, chi&sup2; is not much above {count}, their coordinates.</p>"
    )
    return section("What may have happened", lead + table(["explanation", "evidence", "chi&sup2;"], rows))


def _happened(hypothesis: dict[str, Any]) -> str:
    """A hypothesis in words."""
    h, day, noise = hypothesis, hypothesis["times_the_forecast"], hypothesis["times_the_noise"]
    parts = [
        *(["the forecast is better than it may be"] if day == 0 else []),
        *([f"the day went {day:g} times as far from the forecast as it may"] if day > 1 else []),
        *([f"the base {h['base_moved']}"] if h["base_moved"] else []),
        *([f"{h['knocked']} was knocked"] if h["knocked"] else []),
        *([f"{h['wrong_touch'].rsplit('/', 1)[-1]} went wrong"] if h["wrong_touch"] else []),
        *([f"touches scatter {noise:g} times their sigma"] if noise > 1 else []),
    ]
    return ", ".join(parts) or "the forecast holds"
