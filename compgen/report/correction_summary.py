"""A correction of an existing program as data: JSON, and CSV with a row for each station."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array, IntArray, rms
from compgen.core.commands import Command
from compgen.core.units import MDEG, MM, UM
from compgen.pipelines.correct import Correction
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.uncertainty.band import not_known
from compgen.report.averaged import served_record
from compgen.report.band_words import band_record
from compgen.report.provenance import SCHEMA, correction_inputs, provenance
from compgen.verification.deviation import percentile99
from compgen.verification.flight import PoseErrors


def correction_summary(result: Correction) -> dict[str, Any]:
    """Everything that a correction found, in plain types; docs/report.md has the schema."""
    plan, heat = result.plan, result.cell.heat
    before, after = _statistics(result, result.error), _statistics(result, result.residual)
    start = result.plan.stations.start
    end = plan.stations.rise[-1] if len(plan.stations.rise) else start
    return {
        "schema": SCHEMA,
        "command": Command.CORRECT,
        "name": result.name,
        "verdict": result.verdict.value,
        "before": before,
        "after": after,
        "ratio": before["total"]["max_um"] / after["total"]["max_um"] if before and after["total"]["max_um"] else None,
        "band": band_of_correction(result),
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
            "start_K": dict(zip(heat.names, start.tolist(), strict=True)),
            "end_K": dict(zip(heat.names, end.tolist(), strict=True)),
        },
        **({} if result.served is None else {"average_over": served_record(result.served)}),
        "provenance": provenance(result),
        "inputs": correction_inputs(result),
    }


def band_of_correction(result: Correction) -> dict[str, Any] | None:
    """What the robot file leaves open at the corrected stations; None where nothing is corrected."""
    if result.band is None:
        return None
    return band_record(result.band, with_motion(not_known(result.cell, result.band), None))


def correction_columns(result: Correction) -> dict[str, Array | IntArray]:
    """A row for each station, (S,): its position, its time, its error before and after, and the rises there."""
    plan = result.plan
    rows = np.flatnonzero(result.execution.fraction == 1)
    station = result.execution.station[rows]
    pose = plan.drive.pose[station]
    position, rise = plan.poses.in_cell(pose) / MM, plan.stations.rise[station]
    return {
        "station": station + 1,
        "line": plan.program.motions.line[plan.drive.motion[station]],
        "position": plan.poses.number[pose],
        "time_s": plan.stations.time[station],
        **{f"{name}_mm": position[:, k] for k, name in enumerate("xyz")},
        "before_um": result.error.distance[rows] / UM,
        "after_um": result.residual.distance[rows] / UM,
        "corrected": result.judged[rows].astype(np.int64),
        **{f"rise_{name}_K": rise[:, k] for k, name in enumerate(result.cell.heat.names)},
        **_band_columns(result, station),
    }


def _band_columns(result: Correction, station: IntArray) -> dict[str, Array]:
    """Half-widths along World, k = 2, and the radius of 95 %, (S,) [um]; NaN where nothing is corrected."""
    columns = np.full((len(station), 4), np.nan)
    if result.band is not None:
        band, free = result.band, result.plan.free[station]
        values = np.column_stack([band.world(), band.radius]) / UM
        columns[free] = np.column_stack([np.interp(station[free], band.rows, column) for column in values.T])
    return dict(zip(("band_x_um", "band_y_um", "band_z_um", "band_um"), columns.T, strict=True))


def correction_csv(result: Correction) -> bytes:
    """The columns as a file, lengths and rises rounded."""
    decimals = {"s": 4, "mm": 4, "um": 3, "K": 5}
    table = correction_columns(result)
    columns = [
        np.round(values, decimals[name.rpartition("_")[2]]) + 0.0 if values.dtype.kind == "f" else values
        for name, values in table.items()
    ]
    rows = zip(*(c.tolist() for c in columns), strict=True)
    body = "".join(",".join("" if cell != cell else str(cell) for cell in row) + "\n" for row in rows)
    return f"{','.join(table)}\n{body}".encode("ascii")


def _statistics(result: Correction, error: PoseErrors) -> dict[str, dict[str, float]]:
    """Statistics over the path that was corrected: stations and places between them; empty when there is none."""
    statistics = {}
    length = result.length[result.judged]
    for name, values, unit, key in (("total", error.distance, UM, "um"), ("turn", error.angle, MDEG, "mdeg")):
        judged = values[result.judged] / unit
        if len(judged):
            statistics[name] = {
                f"max_{key}": float(judged.max()),
                f"p99_{key}": percentile99(judged, length),
                f"rms_{key}": rms(judged, length),
            }
    return statistics
