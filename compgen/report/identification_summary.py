"""An identification, and the validation of an identified robot, as data."""

from typing import Any

import numpy as np

from compgen.core.arrays import BoolArray
from compgen.core.codes import Level
from compgen.core.commands import Command
from compgen.core.units import DEG, MM, UM
from compgen.core.version import __version__
from compgen.identification.fit_limits import fit_limits_record
from compgen.identification.identifiability import largest_moves
from compgen.identification.identify import Identification
from compgen.identification.measurements import KINDS
from compgen.identification.validation import Validation, statistics

WARM = 0.5  # [K] from which a pose counts as hot


def identification_summary(identification: Identification) -> dict[str, Any]:
    """Everything an identification found, in plain types; units as the keys name them."""
    best, data = identification.selected, identification.data
    moves = dict(
        zip(
            np.flatnonzero(best.fit.active).tolist(),
            largest_moves(identification.model, best.fit).tolist(),
            strict=True,
        )
    )
    terms = identification.model.parameters
    low, high = best.cross_validation.interval()
    span = np.ptp(data.theta, axis=0) / DEG
    limits = (identification.robot.upper - identification.robot.lower) / DEG
    return {
        "command": Command.IDENTIFY,
        "compgen": __version__,
        "robot": identification.robot.name,
        "verdict": "refused" if identification.refused else "accepted",
        "model": best.candidate.name,
        "poses": len(data.theta),
        "places": len(data.pose),
        "kinds": _kinds(identification),
        "reflectors": list(data.reflectors),
        "noise_um": _um(best.fit.noise),
        "held_out_um": {
            "mean": _um(best.cross_validation.mean),
            "low": _um(low),
            "high": _um(high),
            "robust": _um(best.cross_validation.robust_mean),
        },
        "fit": fit_limits_record(identification.limits),
        "ladder": [
            {
                "model": s.candidate.name,
                "parameters": int(s.fit.active.sum()),
                "effective": round(float(s.fit.gamma.sum()), 2),
                "held_out_um": {
                    "mean": _um(s.cross_validation.mean),
                    "low": _um(s.cross_validation.interval()[0]),
                    "high": _um(s.cross_validation.interval()[1]),
                    "robust": _um(s.cross_validation.robust_mean),
                },
                "noise_um": _um(s.fit.noise),
            }
            for s in identification.candidates
        ],
        "condition": _finite_or_none(identification.identifiability.condition),
        "frames_condition": _finite_or_none(identification.identifiability.frames_condition),
        "coverage": {
            f"j{k + 1}": {"span_deg": round(float(span[k]), 3), "share": round(float(span[k] / limits[k]), 4)}
            for k in range(6)
        },
        "parameters": [
            {
                "name": t.name,
                "value": _nine_digits(best.fit.p[k] / t.unit),
                "sigma": _nine_digits(best.fit.sigma[k] / t.unit),
                "moves_um": _um(moves[k]),
                "told": round(float(best.fit.gamma[k]), 4),
                "held_by_prior": k in identification.identifiability.held_by_prior,
            }
            for k, t in enumerate(terms)
            if best.fit.active[k]
        ],
        "alike": [[terms[i].name, terms[j].name, round(r, 4)] for i, j, r in identification.identifiability.correlated],
        "outliers": [
            {"row": data.label[n], "distance_um": _um(float(np.linalg.norm(best.fit.residual[n])))}
            for n in np.flatnonzero(best.fit.outlier).tolist()
        ],
        "findings": [f.record() for f in identification.findings],
    }


def _kinds(identification: Identification) -> dict[str, Any]:
    """Of places, touches and distances: how many rows, their noise, and how well they are predicted unseen [um]."""
    best, kind = identification.selected, identification.data.kind
    return {
        KINDS[k]: {
            "rows": int((kind == k).sum()),
            "noise_um": _um(best.fit.noise_of_row[kind == k][0]),
            "held_out_um": _um(np.nanmean(best.cross_validation.distance[kind == k])),
        }
        for k in np.unique(kind).tolist()
    }


def limits_sentence(summary: dict[str, Any]) -> str:
    """What the fit leaves beside its parameters' covariance, and how well the whole foretells, in words."""
    fit = summary["fit"]
    repeats, missing = fit.get("repeatability_um"), fit.get("thermal_missing_percent")
    parts = [
        f"fit noise {fit['fit_noise_um']:.1f} um a coordinate" + (" (repeatability in it)" if repeats is None else ""),
        *([] if repeats is None else [f"repeatability {repeats:.1f} um"]),
        *([] if missing is None else [f"thermal physics misses {missing:.0f} % of what warmth does"]),
    ]
    blocks, scale = fit["forecast_blocks"], fit["forecast_scale"]
    parts.append(
        f"{blocks} blocks foretold in time scale the band by {scale:.2f}" if blocks else "nothing was foretold"
    )
    return f"beside the parameters: {'; '.join(parts)}"


def validation_summary(validation: Validation) -> dict[str, Any]:
    """Errors of each target, of cold and warm poses and overall [mm], less the rows set aside; then with them."""
    data, kept = validation.data, ~validation.outlier

    def sides(rows: BoolArray) -> dict[str, Any]:
        distances = {"nominal": validation.nominal[rows], "identified": validation.identified[rows]}
        return {
            side: {k: (v if k == "count" else round(v / MM, 6)) for k, v in statistics(distance).items()}
            for side, distance in distances.items()
        }

    warm = data.rise.max(axis=1, initial=0.0)[data.pose] > WARM
    states = {"cold": kept & ~warm, "hot": kept & warm} if warm.any() else {}
    is_outside = any(f.level is Level.OUTSIDE for f in validation.findings)
    return {
        "command": Command.VALIDATE,
        "unit": "mm",
        "verdict": "outside" if is_outside else "inside",
        "overall": sides(kept),
        "states": {name: sides(rows) for name, rows in states.items()},
        "targets": {name: sides(kept & (data.reflector == r)) for r, name in enumerate(data.reflectors)},
        "set_aside": [
            {"row": data.label[n], "distance_um": _um(float(validation.identified[n]))}
            for n in np.flatnonzero(validation.outlier).tolist()
        ],
        "all_rows": sides(np.ones(len(kept), dtype=bool)),
        "findings": [f.record() for f in validation.findings],
    }


def _um(value: float) -> float:
    return round(float(value) / UM, 4)


def _nine_digits(value: float) -> float:
    return float(f"{float(value):.9g}")


def _finite_or_none(value: float) -> float | None:
    return round(value, 3) if np.isfinite(value) else None
