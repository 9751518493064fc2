"""A correction of an existing program as data (JSON, and CSV with a row for each station) and as one page.

The files of a corrected program that existed, by their names; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from pathlib import PurePath
from typing import Any

import numpy as np
from markupsafe import Markup

from compgen.core.arrays import Array, IntArray, interpolated, rms
from compgen.core.commands import Command
from compgen.core.files import PROVENANCE
from compgen.core.json_text import json_text
from compgen.core.units import MDEG, MM, UM
from compgen.pipelines.correct import Correction
from compgen.pipelines.correct.station_band import is_tool_taught
from compgen.pipelines.files.program_course import chained_lines
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.uncertainty.not_known import not_known, setting_of
from compgen.report.band_page import band_facts, band_rows, budget_figure, radius_row
from compgen.report.band_words import band_record, guaranteed_record, guaranteed_text
from compgen.report.curves import figure_in_rows, rise_figure, size_row
from compgen.report.figure import COOL, WARM, Figure, rows_to_draw
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.inputs import correction_inputs
from compgen.report.many_starts import served_figure, served_record
from compgen.report.page import PLAIN, PageOptions, page
from compgen.report.provenance import SCHEMA, inputs_record, provenance, provenance_json
from compgen.report.view import close_together
from compgen.verification.deviation import percentile99
from compgen.verification.flight import PoseErrors
from compgen.verification.verdict import Verdict

#: Parts of the error, as the summary and as the table name them.
PARTS = {"total": "position [µm]", "turn": "orientation [mdeg]"}
VERDICTS = {
    Verdict.INSIDE: "inside its bound",
    Verdict.OUTSIDE: "outside",
    Verdict.NOT_LOADABLE: "more than the controller can load",
    Verdict.NO_BOUNDS: "nowhere worse; judged by no bound, for none is given (--max-um)",
    Verdict.NOT_CORRECTED: "nothing corrected",
}
FIGURES = {
    "average": "Error at each start that this file serves",
    "time": "Error over time",
    "budget": "What the part will see beyond the arithmetic",
    "space": "The program, coloured by its error",
    "heat": "Temperature while the program runs",
}
REMARK = "CNT is taken as passing through the points; jumps and calls are not followed."
MAX_STATEMENTS = 500  # unsafe ones on the page


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
        **({} if result.draws is None else {"guaranteed": guaranteed_record(result.draws)}),
        "findings": [f.record() for f in result.findings],
        "unsafe": [{"line": u.line, "text": u.text, "reason": u.reason} for u in plan.scope.unsafe],
        "positions": {
            "corrected": result.changed,
            "new": result.added,
            "unchanged": len(np.unique(result.written.positions.number)) - result.changed - result.added,
        },
        "mark": result.mark.value,
        "duration_s": float(plan.stations.time[-1]) if len(plan.stations.time) else 0.0,
        "thermal": {
            "start_K": dict(zip(heat.names, start.tolist(), strict=True)),
            "end_K": dict(zip(heat.names, end.tolist(), strict=True)),
        },
        **({} if result.served is None else {"average_over": served_record(result.served)}),
        "provenance": provenance(result),
        "inputs": inputs_record(result),
    }


def band_of_correction(result: Correction) -> dict[str, Any] | None:
    """What the robot file leaves open at the corrected stations; None where nothing is corrected."""
    if result.band is None:
        return None
    poses, rise = result.plan.poses, result.plan.stations.rise
    place = poses.in_cell(result.plan.drive.pose[result.plan.free])
    setting = setting_of(place, poses.tools.position, rise, is_tool_taught=is_tool_taught(result))
    unknown = not_known(result.cell, result.band, setting)
    motion = with_motion(unknown, result.motion, len(chained_lines(result.plan.program)))
    return band_record(result.band, motion, result.draws, of_job=False)


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
        columns[free] = interpolated(station[free], band.rows, values)
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


def correction_html(result: Correction, options: PageOptions, *, with_program: bool) -> bytes:
    """One page, the same bytes for the same inputs; it says of a program that it is not written, where it is not."""
    data = correction_summary(result)
    made, band, bound = data["provenance"], data["band"], data["bounds"].get("max_um")
    bounds = [] if bound is None else [f"{bound:g} µm"]
    bounds += [guaranteed_text(data["guaranteed"])] if result.draws is not None else []
    has_no_bounds = data["before"] and result.verdict is Verdict.NO_BOUNDS
    return page(
        "correction.html",
        f"{data['name']}: correction",
        inputs=correction_inputs(result, made["planned_sha256"], made["corrected_sha256"] if with_program else None),
        remark=REMARK,
        options=options,
        data=data,
        kind="inside" if data["before"] and result.inside else "warning" if has_no_bounds else "outside",
        verdict=VERDICTS.get(result.verdict, ""),
        facts=[*([("bound", "; ".join(bounds))] if bounds else []), *(band_facts(band) if band else [])],
        parts=PARTS,
        findings=result.findings,
        figures=correction_figures(result) if len(result.execution.station) else {},
        titles=FIGURES,
        band_rows=band_rows(band) if band else [],
        unsafe=[
            (u.line, Markup("<code>{}</code>").format(u.text), u.reason)
            for u in result.plan.scope.unsafe[:MAX_STATEMENTS]
        ],
    )


def correction_figures(result: Correction) -> dict[str, Figure]:
    """Figures by the keys of ``FIGURES``."""
    stations = result.plan.stations
    record = band_of_correction(result)
    return {
        **({} if result.served is None else {"average": served_figure(result.served)}),
        "time": _error_over_time(result),
        **({} if record is None else {"budget": budget_figure(record)}),
        "space": _program_in_space(result),
        "heat": rise_figure(result.cell.heat.names, stations.time, stations.rise, "time from the start [s]"),
    }


def _error_over_time(result: Correction) -> Figure:
    rows = []
    for name, error, colour, symbol in (
        ("before", result.error, WARM, "circle"),
        ("after", result.residual, COOL, "diamond"),
    ):
        drawn = rows_to_draw(error.distance)
        time, size = np.round(result.execution.time[drawn], 3), np.round(error.distance[drawn] / UM, 3)
        bound = None if result.options.bound is None or name == "before" else result.options.bound / UM
        marker, line = {"size": 4, "symbol": symbol}, {"color": colour, "width": 1.4}
        rows.append(size_row(name, time, size, bound, showlegend=True, mode="lines+markers", marker=marker, line=line))
    if result.band is not None:
        shown = rows_to_draw(result.band.radius)
        rows.append(radius_row(result.plan.stations.time[result.band.rows[shown]], result.band.radius[shown]))
    return figure_in_rows(rows, "time from the start [s]", "Error over time")


def _program_in_space(result: Correction) -> Figure:
    """Stations before and after; the view is chosen by those that are corrected and stand close together."""
    plan = result.plan
    rows = np.flatnonzero(result.execution.fraction == 1)
    pose = plan.drive.pose[result.execution.station[rows]]
    places = plan.poses.in_cell(pose) / MM
    part = result.judged[rows].copy()
    part[part] = close_together(places[part])
    shown = rows_to_draw(result.error.distance[rows])
    labels = [f"P[{n}]" for n in plan.poses.number[pose[shown]].tolist()]
    paths = [
        Coloured(name, places[shown], np.round(error.distance[rows[shown]] / UM, 3), labels)
        for name, error in (("before", result.error), ("after", result.residual))
    ]
    return figure_in_space("Error of the program's positions in space", paths, places, part)


def correction_files(
    correction: Correction, name: str, options: PageOptions = PLAIN, *, with_program: bool
) -> dict[str, bytes]:
    """The reports of a program that existed, and the program with its provenance.

    Args:
        correction: Of the program.
        name: The program's file.
        with_program: Whether it may be loaded.
        options: Of the page.
    """
    files = {
        "report.json": json_text(correction_summary(correction) | options.labelled()),
        "positions.csv": correction_csv(correction),
        "report.html": correction_html(correction, options, with_program=with_program),
    }
    if with_program:
        files[PurePath(name).stem + PROVENANCE] = provenance_json(correction)
        files[name] = correction.text
    return files
