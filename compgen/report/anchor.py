"""A state and what speaks for it, as data and as a page: verdict, path before and after, rises, touches, hypotheses."""

from collections.abc import Iterator
from math import exp
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.finding_codes import Code
from compgen.core.units import MDEG, UM, limit_words
from compgen.core.version import __version__
from compgen.error_model.anchored_state import BASE
from compgen.pipelines.anchor import Anchored
from compgen.pipelines.anchor.hypotheses import Weighed
from compgen.pipelines.anchor.verdict import PLAUSIBLE, UNLIKELY, probability
from compgen.report.curves import figure_in_rows, size_row
from compgen.report.figure import COOL, GREY, WARM, Figure
from compgen.report.inputs import SHORT, Inputs, job_inputs
from compgen.report.key_words import parameter_words
from compgen.report.page import PageOptions, fixed, page

SHOWN = 8  # hypotheses
AS_LIKELY, EXCLUDED = 3.0, 1000.0  # times less likely than the likeliest
MOST_TIMES = 50.0  # natural logarithm
REMARK = "The state holds for the robot as it was touched, standing since, for as long as it says."
OF_JOB = ("path", "robot_file", "robot_overrides")  # files and values that the job's inputs have already
BASE_WORDS = ("x [µm]", "y [µm]", "z [µm]", "turned about x [mdeg]", "turned about y [mdeg]", "turned about z [mdeg]")


def anchor_record(anchored: Anchored) -> dict[str, Any]:
    """All of an anchoring, in the units of its keys."""
    state, chosen = anchored.state, anchored.chosen
    before, after = anchored.rms
    return {
        "schema": 1,
        "command": Command.ANCHOR,
        "name": anchored.job.name,
        "anchored_state": True,
        "verdict": anchored.verdict,
        "reason": anchored.reason,
        "state": _state(anchored),
        "path": {
            "before": {"rms_um": round(before / UM, 2), "p99_um": _p99(chosen.before)},
            "after": {"rms_um": round(after / UM, 2), "p99_um": _p99(chosen.after)},
            "corrected_rms_um": round(float(np.sqrt(np.mean(chosen.correction**2) * 3)) / UM, 2),
        },
        "innovation": {"coordinates": len(anchored.innovation.y), "chi2": round(anchored.as_forecast.chi2, 2)},
        "hypotheses": [_hypothesis(j, anchored) for j in anchored.judged[:SHOWN]],
        "moved": [
            {"what": m.what, "shift_um": _listed(m.shift / UM), "sigma_um": _listed(m.sigma / UM), "sure": m.is_sure}
            for m in anchored.moved
        ],
        "touches": list(_touches(anchored)),
        "touch_next": [
            {"target": n.target, "along": n.axis, "leaves_rms_um": round(n.rms / UM, 2)} for n in anchored.touch_next
        ],
        "findings": [f.record() for f in anchored.findings],
        "provenance": {
            "compgen": __version__,
            "robot": anchored.job.robot.name,
            "overrides": list(anchored.job.overrides),
            "made_from": dict(state.made_from),
        },
    }


def _state(anchored: Anchored) -> dict[str, Any]:
    """How warm each part is, where the base is, what drifts, each with its standard deviation."""
    state, K, sigma = anchored.state, len(anchored.state.nodes), anchored.state.sigma
    return {
        "time_s": state.time,
        "window_s": state.window,
        "air_K": state.air,
        "rise_K": dict(zip(state.nodes, _listed(state.rise, 4), strict=True)),
        "forecast_K": dict(zip(state.nodes, _listed(anchored.forecast.rise, 4), strict=True)),
        "sigma_K": dict(zip(state.nodes, _listed(sigma[:K], 4), strict=True)),
        "base_shift_um": _listed(state.base[:3] / UM),
        "base_turn_mdeg": _listed(state.base[3:] / MDEG, 4),
        "base_sigma_um": _listed(sigma[K : K + 3] / UM),
        "base_sigma_mdeg": _listed(sigma[K + 3 : K + BASE] / MDEG, 4),
        "drifting": {
            name: {"change": round(value, 6), "sigma": round(s, 6)}
            for name, value, s in zip(state.drifting, state.drift.tolist(), sigma[K + BASE :].tolist(), strict=True)
        },
    }


def _touches(anchored: Anchored) -> Iterator[dict[str, Any]]:
    """How far each touch is off the forecast, and of those that are used how far off what the others say."""
    seen, left = anchored.seen, anchored.left
    first = {touch: k for k, touch in reversed(list(enumerate(left.touch.tolist())))}  # coordinate of each touch
    for n, (label, target) in enumerate(zip(seen.touches.label, seen.touches.target.tolist(), strict=True)):
        off, k = _listed(seen.y[seen.touch == n] / UM), first.get(n)
        row = {"at": label, "target": anchored.artefact.targets[target], "used": k is not None, "from_forecast_um": off}
        if k is not None:
            row |= {"left_out_um": round(float(left.error[k] / UM), 2), "E_n": round(float(left.E_n[k]), 3)}
        yield row


def _hypothesis(judged: Weighed, anchored: Anchored) -> dict[str, Any]:
    h = judged.hypothesis
    return {
        "times_the_forecast": h.day,
        "base_moved": h.base,
        "knocked": None if h.target < 0 else anchored.artefact.targets[h.target],
        "wrong_touch": None if h.touch < 0 else anchored.seen.touches.label[h.touch],
        "times_the_noise": h.noise,
        "log_evidence": round(judged.evidence - anchored.judged[0].evidence, 3),
        "chi2": round(judged.chi2, 2),
    }


def _p99(sizes: Array) -> float:
    return round(float(np.percentile(sizes, 99)) / UM, 2)


def _listed(values: Any, digits: int = 2) -> list[float]:
    return [round(float(v), digits) + 0.0 for v in np.ravel(values)]


def anchor_html(anchored: Anchored, options: PageOptions) -> bytes:
    """One page, the same bytes for the same inputs."""
    data = anchor_record(anchored)
    is_anchored = data["verdict"] == "anchored"
    repeated = Code.ANCHOR_VERDICT if is_anchored else None  # the opening has its numbers
    return page(
        "anchor.html",
        f"What {anchored.job.robot.name} is now: {anchored.job.title or anchored.job.name}",
        inputs=_inputs(anchored),
        remark=REMARK,
        options=options,
        data=data,
        kind="inside" if is_anchored or data["verdict"] == "leave it" else "outside",
        is_anchored=is_anchored,
        holds=limit_words(data["state"]["window_s"]),
        findings=[f for f in anchored.findings if f.code != repeated],
        places=len(anchored.path.theta),
        path=_path(anchored),
        state=_state_rows(data["state"]),
        touches=[
            [
                t["at"].rsplit("/", 1)[-1],
                t["target"],
                ", ".join(f"{v:.0f}" for v in t["from_forecast_um"]),
                *((fixed(t["left_out_um"], 0), fixed(t["E_n"])) if t["used"] else ("left out", "")),
            ]
            for t in data["touches"]
        ],
        hypotheses=[
            [
                _happened(h),
                likely_words(h["log_evidence"]),
                explains_words(h["chi2"], data["innovation"]["coordinates"]),
                fixed(h["log_evidence"], 1),
                fixed(h["chi2"], 0),
            ]
            for h in data["hypotheses"]
        ],
    )


def _inputs(anchored: Anchored) -> Inputs:
    """The job's, and what was touched."""
    of_job, made_from = job_inputs(anchored.job), anchored.state.made_from
    hashes = [(name, digest) for name, digest in made_from.items() if name not in OF_JOB]
    files = {"touches": f"{anchored.seen.touches.file}, ", "artefact": f"{anchored.artefact.source}, "}
    rows = [(name, f"{files.get(name, '')}sha256 {digest[:SHORT]}") for name, digest in hashes]
    return Inputs((*of_job.rows, *rows), (*of_job.hashes, *hashes))


def _path(anchored: Anchored) -> Figure:
    along, chosen = 100 * np.linspace(0, 1, len(anchored.path.theta)), anchored.chosen
    rows = [
        size_row(name, along, size / UM, mode="lines", line={"color": colour, "dash": dash}, showlegend=False)
        for name, size, colour, dash in (
            ("before", chosen.before, WARM, "dash"),
            ("after", chosen.after, COOL, "solid"),
            ("moved", np.linalg.norm(chosen.correction, axis=1), GREY, "solid"),
        )
    ]
    return figure_in_rows(rows, "along the part [%]", "Along the part")


def _state_rows(state: dict[str, Any]) -> list[list[str]]:
    """What the state changes of the forecast: of each its forecast, its value, and how well that is known (k = 2)."""
    rows = [
        [f"rise of {name} [K]", fixed(state["forecast_K"][name]), fixed(rise), fixed(2 * state["sigma_K"][name])]
        for name, rise in state["rise_K"].items()
    ]
    base = [*state["base_shift_um"], *state["base_turn_mdeg"]]
    sigmas = [*state["base_sigma_um"], *state["base_sigma_mdeg"]]
    rows += [
        [f"base {name}", "0", fixed(round(value, 1) + 0.0, 1), fixed(2 * sigma, 1)]
        for name, value, sigma in zip(BASE_WORDS, base, sigmas, strict=True)
    ]
    rows += [
        [parameter_words(name), "0", _as_sure(d["change"], d["sigma"]), _as_sure(2 * d["sigma"], d["sigma"])]
        for name, d in state["drifting"].items()
    ]
    return rows


def _as_sure(value: float, sigma: float) -> str:
    """A value with the digits that its standard deviation leaves."""
    return f"{value:.{int(np.clip(1 - np.floor(np.log10(max(sigma, 1e-9))), 0, 9))}f}"


def likely_words(log_evidence: float) -> str:
    """How likely an explanation is beside the likeliest, for who does not read logarithms."""
    times = exp(min(-log_evidence, MOST_TIMES))
    if times < AS_LIKELY:
        return "the likeliest" if log_evidence >= 0 else "about as likely"
    return f"{float(f'{times:.1g}'):.0f} times less likely" if times < EXCLUDED else "can be left aside"


def explains_words(chi2: float, coordinates: int) -> str:
    """Whether the touches lie as an explanation lets them."""
    chance = probability(chi2, coordinates)
    return "yes" if chance > PLAUSIBLE else "hardly" if chance > UNLIKELY else "no"


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
