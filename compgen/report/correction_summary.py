"""A correction of an existing program as data: JSON, and CSV with a row for each station."""

import json
from typing import Any

import numpy as np

from compgen.core.units import MDEG, MM, UM
from compgen.pipelines.correct import Correction
from compgen.report.provenance import SCHEMA, provenance
from compgen.verification.deviation import percentile99, rms


def correction_summary(result: Correction) -> dict[str, Any]:
    """Everything that a correction found, in plain types; docs/report.md has the schema."""
    plan, heat = result.plan, result.cell.heat
    before, after = _statistics(result, result.error), _statistics(result, result.residual)
    start = result.plan.stations.start
    end = plan.stations.rise[-1] if len(plan.stations.rise) else start
    return {
        "schema": SCHEMA,
        "name": result.name,
        "verdict": result.verdict.value,
        "before": before,
        "after": after,
        "ratio": before["total"]["max_um"] / after["total"]["max_um"] if before and after["total"]["max_um"] else None,
        "bounds": {} if result.options.bound is None else {"max_um": round(result.options.bound / UM, 9)},
        "findings": [f.record() for f in result.findings],
        "unsafe": [{"line": u.line, "text": u.text, "reason": u.reason} for u in plan.scope.unsafe],
        "positions": {
            "corrected": result.changed,
            "new": result.added,
            "unchanged": len(set(plan.poses.number.tolist())) - result.changed,
        },
        "mark": result.mark.value,
        "duration_s": float(plan.stations.time[-1]) if len(plan.stations.time) else 0.0,
        "thermal": {
            "start_K": dict(zip(heat.names, start.tolist())),
            "end_K": dict(zip(heat.names, end.tolist())),
        },
        "provenance": provenance(result),
    }


def correction_json(result: Correction) -> bytes:
    """The summary as a file."""
    return (json.dumps(correction_summary(result), indent=2, allow_nan=False) + "\n").encode()


def correction_csv(result: Correction) -> bytes:
    """One row for each station: its position, its time, and its error before and after."""
    plan = result.plan
    head = "station,line,position,time_s,x_mm,y_mm,z_mm,before_um,after_um,corrected,"
    head += ",".join(f"rise_{name}_K" for name in result.cell.heat.names)
    rows = np.flatnonzero(result.ride.fraction == 1)
    station = result.ride.station[rows]
    pose = plan.drive.pose[station]
    line = plan.program.motions.line[plan.drive.motion[station]]
    columns = [
        station + 1,
        line,
        plan.poses.number[pose],
        np.round(plan.stations.time[station], 4) + 0.0,
        *(np.round(plan.poses.position[pose].T / MM, 4) + 0.0),
        np.round(result.error[0][rows] / UM, 3) + 0.0,
        np.round(result.residual[0][rows] / UM, 3) + 0.0,
        result.judged[rows].astype(int),
        *(np.round(plan.stations.rise[station].T, 5) + 0.0),
    ]
    body = "".join(",".join(map(str, row)) + "\n" for row in zip(*(c.tolist() for c in columns)))
    return f"{head}\n{body}".encode("ascii")


def _statistics(result: Correction, error: tuple[Any, Any]) -> dict[str, dict[str, float]]:
    """Statistics over the path that was corrected: stations and places between them; empty when there is none."""
    statistics = {}
    length = result.length[result.judged]
    for name, values, unit, key in (("total", error[0], UM, "um"), ("turn", error[1], MDEG, "mdeg")):
        judged = values[result.judged] / unit
        if len(judged):
            statistics[name] = {
                f"max_{key}": float(judged.max()),
                f"p99_{key}": percentile99(judged, length),
                f"rms_{key}": rms(judged, length),
            }
    return statistics
