"""What an identification came to, as data."""

import json
from typing import Any

import numpy as np

from compgen import __version__
from compgen.core.arrays import IntArray
from compgen.core.units import DEG, MM, UM
from compgen.identification.identify import Identification
from compgen.identification.validation import Validation, statistics


def identification_summary(found: Identification) -> dict[str, Any]:
    """Everything a machine may ask, SI left for the units in the names."""
    best, data = found.selected, found.data
    terms = found.model.parameters
    low, high = best.cross_validation.interval()
    span = np.ptp(data.theta, axis=0) / DEG
    limits = (found.robot.upper - found.robot.lower) / DEG
    return {
        "compgen": __version__,
        "robot": found.robot.name,
        "verdict": "refused" if found.refused else "accepted",
        "model": best.candidate.name,
        "poses": len(data.theta),
        "places": len(data.pose),
        "reflectors": list(data.reflectors),
        "noise_um": _um(best.fit.noise),
        "held_out_um": {"mean": _um(best.cross_validation.mean), "low": _um(low), "high": _um(high)},
        "ladder": [
            {
                "model": s.candidate.name,
                "parameters": int(s.fit.active.sum()),
                "effective": round(float(s.fit.gamma.sum()), 2),
                "held_out_um": {
                    "mean": _um(s.cross_validation.mean),
                    "low": _um(s.cross_validation.interval()[0]),
                    "high": _um(s.cross_validation.interval()[1]),
                },
                "noise_um": _um(s.fit.noise),
            }
            for s in found.candidates
        ],
        "condition": _finite(found.identifiability.condition),
        "frames_condition": _finite(found.identifiability.frames_condition),
        "coverage": {
            f"j{k + 1}": {"span_deg": round(float(span[k]), 3), "share": round(float(span[k] / limits[k]), 4)}
            for k in range(6)
        },
        "parameters": [
            {
                "name": t.name,
                "value": _nine(best.fit.p[k] / t.unit),
                "sigma": _nine(best.fit.sigma[k] / t.unit),
                "told": round(float(best.fit.gamma[k]), 4),
                "held_by_prior": k in found.identifiability.held_by_prior,
            }
            for k, t in enumerate(terms)
            if best.fit.active[k]
        ],
        "alike": [[terms[i].name, terms[j].name, round(r, 4)] for i, j, r in found.identifiability.correlated],
        "outliers": [
            {"row": data.label[n], "distance_um": _um(float(np.linalg.norm(best.fit.residual[n])))}
            for n in np.flatnonzero(best.fit.outlier).tolist()
        ],
        "findings": [f.record() for f in found.findings],
    }


def validation_summary(found: Validation) -> dict[str, Any]:
    """Errors per target and overall, in mm."""

    def told(rows: IntArray) -> dict[str, Any]:
        sides = {"nominal": found.before[rows], "identified": found.after[rows]}
        return {
            side: {k: (v if k == "count" else round(v / MM, 6)) for k, v in statistics(d).items()}
            for side, d in sides.items()
        }

    everything = np.arange(len(found.after))
    return {
        "unit": "mm",
        "overall": told(everything),
        "targets": {
            name: told(np.flatnonzero(found.data.reflector == r)) for r, name in enumerate(found.data.reflectors)
        },
    }


def identification_json(found: Identification) -> bytes:
    """The summary as a file."""
    return (json.dumps(identification_summary(found), indent=2, allow_nan=False) + "\n").encode()


def _um(value: float) -> float:
    return round(float(value) / UM, 4)


def _nine(value: float) -> float:
    return float(f"{float(value):.9g}")


def _finite(value: float) -> float | None:
    return round(value, 3) if np.isfinite(value) else None
