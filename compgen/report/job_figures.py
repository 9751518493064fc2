"""The figures of a job: its error over time and in space, what the part will see, temperatures, joints."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.units import MM, UM
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.planning.toolpath import ToolPath
from compgen.report.averaged import averaged_figure
from compgen.report.band_page import budget_figure, radius_row
from compgen.report.figure import COOL, GREY, LINES, WARM, Figure, axis, figure, horizontal_line, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.figure_rows import Row, figure_in_rows
from compgen.report.figure_words import course, curves_in_words, sentence
from compgen.report.job_summary import band_of
from compgen.report.rise_figure import rise_figure
from compgen.verification.band import Band
from compgen.verification.deviation import Deviation

PATTERNS = ("", "/", "x")  # of bars


def job_figures(planned: Planned, corrected: Corrected | None, summary: dict[str, Any]) -> dict[str, Figure]:
    """Figures by the keys of ``job_page.FIGURES``."""
    curves = [_error_curves(planned.deviation())] + ([_error_curves(corrected.deviation)] if corrected else [])
    rises = (planned.job.heat.names, planned.trajectory.time, planned.rise)
    averaged = None if corrected is None else corrected.averaged
    band, path = band_of(planned, corrected), planned.path
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
    rows, words = [], []
    for name, curve, colour in zip(("before", "after"), curves, (WARM, COOL), strict=False):
        time = np.round(curve.time, 4)
        total, normal = {"color": colour, "width": 1.4}, {"color": GREY, "width": 1, "dash": "dot"}
        traces = [
            trace("scatter", time, curve.total, name=f"{name}: total", line=total),
            trace("scatter", time, curve.normal, name=f"{name}: normal to the surface", line=normal),
        ]
        words.append(course(name, curve.total, "µm"))
        limit = None
        if name == "after" and bound is not None:
            limit = (bound / UM, f"bound {bound / UM:g} µm")
            words.append(limit[1])
        rows.append(Row(f"{name} [µm]", traces, limit))
    rows.append(radius_row(curves[-1].time, radius))
    words.append(course("may be off (95 %)", radius / UM, "µm"))
    return figure_in_rows(rows, "time from leaving P[1] [s]", sentence("Error over time", words))


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
    traces = [
        trace(
            "bar", list(shares), [round(100 * v, 2) for v in shares.values()], name=kind,
            marker={"color": colour, "pattern": {"shape": pattern}},
        )
        for (kind, shares), colour, pattern in zip(use.items(), LINES[2:], PATTERNS, strict=False)
    ]  # fmt: skip
    alt = curves_in_words("Largest use of the joints' limits", traces, "%")
    return figure(traces, 320, alt, yaxis=axis("largest share of the limit [%]"), shapes=[horizontal_line(100)])
