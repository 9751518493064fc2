"""A job as one page that opens offline: findings first, then the error, the path, the temperatures, the joints.

The files of a planned program by their names, whole or in parts; who wants them on a disk writes them.

The first is the record that tells whose the others are.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.json_text import json_text
from compgen.core.units import MM, UM
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.planning.toolpath import ToolPath
from compgen.report.band_page import band_facts, band_rows, budget_figure, radius_row
from compgen.report.band_words import before_and_after, guaranteed_text, is_corrected, start_limit
from compgen.report.curves import CurveRow, course, curves_in_words, figure_in_rows, rise_figure
from compgen.report.figure import COOL, GREY, LINES, WARM, Figure, axis, figure, horizontal_line, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.inputs import SHORT, Inputs, job_inputs
from compgen.report.job_summary import job_band, job_summary
from compgen.report.many_starts import averaged_figure
from compgen.report.page import PLAIN, PageOptions, fixed, page
from compgen.report.waypoints_csv import waypoints_blocks
from compgen.verification.band import Band
from compgen.verification.deviation import Deviation

#: Parts of the error, as the summary and as the table name them.
PARTS = {
    "total": "total [µm]",
    "feed": "along feed [µm]",
    "cross": "cross feed [µm]",
    "normal": "along the tool [µm]",
    "axis_angle": "tool axis [mdeg]",
}

FIGURES = {
    "average": "Error at each start that this file serves",
    "time": "Error over time",
    "budget": "What the part will see beyond the arithmetic",
    "space": "The path, coloured by error",
    "band": "The path, coloured by how far off the tool may be (95 %)",
    "heat": "Temperature while the program runs",
    "joints": "Use of the joints",
}

REMARK = "CNT is taken as passing through the points; only the error sources active in the robot file are known here."

#: Bounds as the summary names them, and as the page does.
BOUNDS = {
    "max_um": "largest {} µm",
    "p99_um": "99th percentile {} µm",
    "rms_um": "rms {} µm",
    "feed_um": "along feed {} µm",
    "cross_um": "cross feed {} µm",
    "normal_um": "along the tool {} µm",
    "axis_mdeg": "tool axis {} mdeg",
}

VERDICTS = {
    "inside": "inside its bounds",
    "outside": "outside its bounds",
    "not loadable": "more than the controller can load",
    "no bounds": "judged by no bounds, for none are given",
    "nothing corrected": "nothing corrected",
}

#: Looks of verdicts; any other is ``outside``.
KINDS = {"inside": "inside", "predicted": "predicted", "no bounds": "warning"}

PATTERNS = ("", "/", "x")  # of bars


def job_html(
    planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN, *, with_program: bool = True
) -> bytes:
    """One page, the same bytes for the same inputs; it says of a program that it is not written, where it is not."""
    data = job_summary(planned, corrected)
    sides = [(name, data["on_part"][name]) for name in ("before", "after") if data[name]]
    return page(
        "job.html",
        data["title"] or data["name"],
        inputs=_inputs(planned, data, with_program=with_program),
        remark=REMARK,
        options=options,
        data=data,
        kind=KINDS.get(data["verdict"], "outside"),
        verdict=VERDICTS.get(data["verdict"], ""),
        nothing="" if corrected is None or is_corrected(data) else before_and_after(data),
        facts=[("bounds", _bounds(data)), *band_facts(data["band"]), *_served(data)],
        parts=PARTS,
        sides=sides,
        beyond=_beyond(data, sides),
        findings=corrected.findings if corrected else planned.findings,
        figures=job_figures(planned, corrected, data),
        titles=FIGURES,
        band_rows=band_rows(data["band"]),
    )


def _inputs(planned: Planned, data: dict[str, Any], *, with_program: bool) -> Inputs:
    """What the page was made from, and the programs that it speaks of."""
    made = job_inputs(planned.job)
    written = list(data["program"]["sha256"].items()) if data.get("program") else []
    if not written:
        return made
    if not with_program:
        return made.with_rows(("program", f"not written: {VERDICTS[data['verdict']]}"))
    file, digest = written[-1] if data["program"]["pages"] else written[0]
    pages = f" and {len(written) - 1} pages" if len(written) > 1 else ""
    return replace(
        made.with_rows(("program", f"{file}{pages}, sha256 {digest[:SHORT]}")),
        hashes=(*made.hashes, *((f"program {name}", whole) for name, whole in written)),
    )


def _bounds(data: dict[str, Any]) -> str:
    bounds = ", ".join(BOUNDS[key].format(f"{bound:g}") for key, bound in data["bounds"].items())
    guaranteed = f"; {guaranteed_text(data['guaranteed'])}" if data.get("guaranteed") else ""
    return f"{bounds or 'none'}{guaranteed}"


def _served(data: dict[str, Any]) -> list[tuple[str, str]]:
    """Which starts the file is right for."""
    if data["after"] is None:
        return []
    average = data.get("average_over", {})
    if not average.get("flown"):
        start = start_limit(data)
        return [("right for", f"a start within {start} of the planned time")] if start else []
    words = (
        f"many starts: with the mean of their rises it leaves {average['at_mean']['max_um']:.2f} µm, at the "
        f"worst of {len(average['flown'])} flown starts {average['max_um']:.2f}, {average['rms_um']:.2f} rms over all"
    )
    return [("right for", words)]


def _beyond(data: dict[str, Any], sides: list[tuple[str, Any]]) -> str:
    """What the error is over the whole program, where that is more than on the part."""
    largest = {name: fixed(data[name]["total"]["max_um"]) for name, _ in sides}
    if all(largest[name] == fixed(part["total"]["max_um"]) for name, part in sides):
        return ""
    return f"Largest with approach and retract: {', '.join(f'{size} µm {name}' for name, size in largest.items())}."


def job_figures(planned: Planned, corrected: Corrected | None, summary: dict[str, Any]) -> dict[str, Figure]:
    """Figures by the keys of ``job_page.FIGURES``."""
    curves = [_error_curves(planned.deviation())] + ([_error_curves(corrected.deviation)] if corrected else [])
    rises = (planned.job.heat.names, planned.trajectory.time, planned.rise)
    averaged = None if corrected is None else corrected.averaged
    band, path = job_band(planned, corrected), planned.path
    may = np.interp(curves[-1].arc, path.arc[band.rows], band.radius)
    return {
        **({} if averaged is None else {"average": averaged_figure(averaged)}),
        "time": _error_over_time(curves, planned.job.bounds.max, may),
        "budget": budget_figure(summary["band"]),
        "space": _path_in_space(curves, path),
        "band": _band_in_space(band, path),
        "heat": rise_figure(*rises, "time from leaving P[1] [s]"),
        "joints": _joint_use(summary),
    }


@dataclass(frozen=True, eq=False, slots=True)
class _ErrorCurves:
    """What the figures show of a deviation, at K samples."""

    arc: Array  # (K,) [m]
    time: Array  # (K,) [s]
    total: Array  # (K,) [um]
    normal: Array  # (K,) [um]


def _error_curves(deviation: Deviation) -> _ErrorCurves:
    error = deviation.total()
    rows = rows_to_draw(error)
    total, normal = (np.round(values[rows] / UM, 3) for values in (error, deviation.normal))
    return _ErrorCurves(deviation.arc[rows], deviation.time[rows], total, normal)


def _error_over_time(curves: list[_ErrorCurves], bound: float | None, radius: Array) -> Figure:
    """Before and after, and under them how far off the tool may be: ``radius`` (K,) [m] at the last curve's samples."""
    rows = []
    for name, curve, colour in zip(("before", "after"), curves, (WARM, COOL), strict=False):
        time = np.round(curve.time, 4)
        total, normal = {"color": colour, "width": 1.4}, {"color": GREY, "width": 1, "dash": "dot"}
        traces = [
            trace("scatter", time, curve.total, name=f"{name}: total", line=total),
            trace("scatter", time, curve.normal, name=f"{name}: along the tool", line=normal),
        ]
        limit = None if bound is None or name == "before" else bound / UM
        rows.append(CurveRow(f"{name} [µm]", traces, course(name, curve.total, "µm"), limit, {}))
    rows.append(radius_row(curves[-1].time, radius))
    return figure_in_rows(rows, "time from leaving P[1] [s]", "Error over time")


def _path_in_space(curves: list[_ErrorCurves], path: ToolPath) -> Figure:
    paths = [
        Coloured(name, np.column_stack(positions_at(path, curve.arc)), curve.total)
        for name, curve in zip(("before", "after"), curves, strict=False)
    ]
    return figure_in_space("Error along the path in space", paths, path.target.position / MM, path.contact)


def _band_in_space(band: Band, path: ToolPath) -> Figure:
    """The path, coloured by the radius that the tool stays within in 95 of 100 cases."""
    rows = rows_to_draw(band.radius)
    places = np.column_stack(positions_at(path, path.arc[band.rows[rows]]))
    radius = Coloured("may be off (95 %)", places, np.round(band.radius[rows] / UM, 3))
    subject = "How far off the tool may be along the path in space"
    return figure_in_space(subject, [radius], path.target.position / MM, path.contact)


def positions_at(path: ToolPath, arc: Array) -> list[Array]:
    """x, y and z [mm] at lengths along the path, (K,) each, linear between waypoints."""
    after = np.searchsorted(path.arc, arc, side="right").clip(1, len(path.arc) - 1)
    rows = np.unique(np.concatenate([after - 1, after]))
    return [np.round(np.interp(arc, path.arc[rows], path.target.position[rows, k]) / MM, 2) for k in range(3)]


def _joint_use(data: dict[str, Any]) -> Figure:
    use = data["timing"]["joint_use"]
    looks = [
        {"color": colour, "pattern": {"shape": pattern}} for colour, pattern in zip(LINES[2:], PATTERNS, strict=False)
    ]
    traces = [
        trace("bar", list(shares), [round(100 * v, 2) for v in shares.values()], name=kind, marker=look)
        for (kind, shares), look in zip(use.items(), looks, strict=False)
    ]
    alt = curves_in_words("Largest use of the joints' limits", traces, "%")
    return figure(traces, 320, alt, yaxis=axis("largest share of the limit [%]"), shapes=[horizontal_line(100)])


def job_reports(
    planned: Planned, corrected: Corrected | None, options: PageOptions = PLAIN, *, with_program: bool = True
) -> dict[str, bytes | Iterable[bytes]]:
    """The reports of a planned program, or of a corrected one.

    Args:
        planned: The program without its correction.
        corrected: With it; None: it was only predicted.
        options: Of the page.
        with_program: Whether the program is written; the page says of one that is not.
    """
    return {
        "report.json": json_text(job_summary(planned, corrected) | options.labelled()),
        "report.html": job_html(planned, corrected, options, with_program=with_program),
        "waypoints.csv": waypoints_blocks(planned, corrected),
    }
