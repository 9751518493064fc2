"""A state and what speaks for it, as data: the verdict, the path before and after, each touch, each hypothesis."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.units import MDEG, UM
from compgen.core.version import __version__
from compgen.error_model.anchored_state import BASE
from compgen.pipelines.anchor import Anchored
from compgen.pipelines.anchor.hypotheses import Judged

SHOWN = 8  # hypotheses


def anchor_record(anchored: Anchored) -> dict[str, Any]:
    """All of an anchoring, in the units of its keys."""
    state, chosen, seen = anchored.state, anchored.chosen, anchored.seen
    K, sigma, used = len(state.nodes), state.sigma, set(anchored.left.touch.tolist())
    touches, left = seen.touches, anchored.left
    rows = []
    for n, (label, t) in enumerate(zip(touches.label, touches.target.tolist(), strict=True)):
        of_touch = seen.touch == n
        row: dict[str, Any] = {
            "at": label, "target": anchored.artefact.targets[t], "used": n in used,
            "from_forecast_um": _listed(seen.y[of_touch] / UM),
        }  # fmt: skip
        if n in used:
            k = int(np.flatnonzero(left.touch == n)[0])
            row |= {"left_out_um": round(float(left.error[k] / UM), 2), "E_n": round(float(left.E_n[k]), 3)}
        rows.append(row)
    before, after = anchored.rms
    return {
        "schema": 1,
        "command": Command.ANCHOR,
        "name": anchored.job.name,
        "anchored_state": True,
        "verdict": anchored.verdict,
        "reason": anchored.reason,
        "state": {
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
        },
        "path": {
            "before": {"rms_um": round(before / UM, 2), "p99_um": _p99(chosen.before)},
            "after": {"rms_um": round(after / UM, 2), "p99_um": _p99(chosen.after)},
            "corrected_rms_um": round(float(np.sqrt(np.mean(chosen.correction**2) * 3)) / UM, 2),
        },
        "innovation": {"coordinates": len(anchored.innovation.y), "chi2": round(anchored.as_forecast.chi2, 2)},
        "hypotheses": [_hypothesis(j, anchored) for j in anchored.judged[:SHOWN]],
        "moved": [
            {
                "what": m.what, "shift_um": _listed(m.shift / UM), "sigma_um": _listed(m.sigma / UM),
                "sure": m.is_sure,
            }
            for m in anchored.moved
        ],
        "touches": rows,
        "touch_next": [
            {"target": n.target, "along": n.axis, "leaves_rms_um": round(n.rms / UM, 2)} for n in anchored.touch_next
        ],
        "findings": [f.record() for f in anchored.findings],
        "provenance": {
            "compgen": __version__, "robot": anchored.job.robot.name, "overrides": list(anchored.job.overrides),
            "made_from": dict(state.made_from),
        },
    }  # fmt: skip


def _hypothesis(judged: Judged, anchored: Anchored) -> dict[str, Any]:
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
