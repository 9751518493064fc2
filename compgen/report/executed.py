"""A judged log as data and as one page: what was run, how true, in which time, with pictures."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array, norm
from compgen.core.commands import Command
from compgen.core.units import MM, MS, UM
from compgen.core.version import __version__
from compgen.pipelines.executed.executed import ProgramText
from compgen.report.curves import curves_in_words
from compgen.report.figure import COOL, GREY, WARM, Figure, axis, figure, rows_to_draw, trace
from compgen.report.figure_in_space import Coloured, figure_in_space
from compgen.report.inputs import Inputs
from compgen.report.page import PageOptions, fixed, page
from compgen.robot.robot import Robot
from compgen.verification.executed.judgement import ExecutedRun
from compgen.verification.executed.path_deviation import speeds

SCHEMA = 1
FIGURES = {
    "space": "The path, coloured by how far the motion is off it",
    "time": "Deviation over time",
    "speed": "Speed along the path",
}
REMARK = (
    "The log shows what the controller knows of its joints, not where the tool was: heat, geometry, compliance and "
    "play are not in it."
)
LABELS = {"total": "off the path", "across": "across, in the surface", "normal": "along the tool's axis"}


def executed_summary(run: ExecutedRun, text: ProgramText, robot: Robot, bound: float | None) -> dict[str, Any]:
    """Everything that a log says of a run, in plain types; docs/executed.md has the keys."""
    course = run.course
    first, last = run.covered
    return {
        "schema": SCHEMA,
        "command": Command.EXECUTED,
        "name": text.name,
        "verdict": "inside" if run.inside else "outside",
        "findings": [f.record() for f in run.findings],
        "program": {
            "file": text.file,
            "sha256": text.sha256,
            "inputs": text.inputs,
            "length_mm": course.length / MM,
            "planned_s": float(course.planned[-1]),
        },
        "log": _log(run),
        "covered": {
            "from_mm": first / MM,
            "to_mm": last / MM,
            "share": course.share(first, last),
            "from": course.point_name(first),
            "to": course.point_name(last),
        },
        **_times(run),
        "deviation": _deviation(run),
        "bounds": {} if bound is None else {"max_um": round(bound / UM, 9)},
        "also": [
            {
                "name": like.name,
                "differs_um": like.differs / UM,
                "share": like.beta,
                "sigma": like.sigma if np.isfinite(like.sigma) else None,
            }
            for like in run.likeness
        ],
        "provenance": {"compgen": __version__, "robot": robot.name},
    }


def _deviation(run: ExecutedRun) -> dict[str, Any]:
    """Each kind of it, and where it is largest."""
    return {
        name: {
            "max_um": e.max / UM,
            "p99_um": e.p99 / UM,
            "rms_um": e.rms / UM,
            "at": run.course.point_name(e.where),
            "at_mm": e.where / MM,
        }
        for name, e in run.deviation.extents.items()
    }


def _log(run: ExecutedRun) -> dict[str, Any]:
    log = run.followed.log
    return {
        "file": log.table.source,
        "rows": len(log.time),
        "rows_without_position": log.gaps,
        "columns": "joints" if log.is_joints else "cartesian",
        "period_ms": log.period / MS,
        "noise_um": run.deviation.noise / UM,
    }


def _times(run: ExecutedRun) -> dict[str, Any]:
    """Stretches of override, how long the run took, and where it stood."""
    clock, steady = run.clock, run.steady
    late = clock.late[np.isfinite(clock.late)]
    return {
        "override": [
            {
                "from_s": s.begin,
                "to_s": s.end,
                "percent": 100 * s.override,
                "words": s.words,
                "rate": s.rate,
                "rate_sigma": s.sigma,
            }
            for s in clock.stretches
        ],
        "time": {
            "start_s": clock.start if np.isfinite(clock.start) else None,
            "from_s": steady[0] if steady else None,
            "to_s": steady[1] if steady else None,
            "took_s": clock.took,
            "expected_s": clock.expected,
            "off_percent": 100 * (clock.took / clock.expected - 1) if clock.expected > 0 else None,
            "whole_periods": clock.rounded,
            "late_max_ms": float(np.abs(late).max(initial=0.0) / MS),
        },
        "stands": [
            {
                "at_s": s.time,
                "at": run.course.point_name(s.arc),
                "stood_s": s.stood,
                "planned_s": s.planned,
                "beyond_s": s.beyond,
                "program_stops": s.at_stop,
            }
            for s in clock.stands
        ],
    }


def executed_csv(run: ExecutedRun) -> bytes:
    """Rows of the log where it is off the path most, along all of it: time, place, deviation, speed."""
    d = run.deviation
    rows = rows_to_draw(d.distance)
    numbers = np.column_stack(
        [
            d.time[rows],
            d.arc[rows] / MM,
            d.distance[rows] / UM,
            d.across[rows] / UM,
            d.normal[rows] / UM,
            _tool_speed(run)[rows] / MM,
        ]
    )
    head = "time_s,along_mm,off_um,across_um,normal_um,speed_mm_s,judged\n"
    lines = [
        f"{t:.4f},{s:.3f},{off:.2f},{across:.2f},{normal:.2f},{v:.2f},{int(judged)}\n"
        for (t, s, off, across, normal, v), judged in zip(numbers.tolist(), d.judged[rows].tolist(), strict=True)
    ]
    return (head + "".join(lines)).encode("ascii")


def executed_html(run: ExecutedRun, summary: dict[str, Any], inputs: Inputs, options: PageOptions) -> bytes:
    """One page, the same bytes for the same inputs."""
    bound = summary["bounds"].get("max_um")
    is_judged = bound is not None or not run.inside
    return page(
        "executed.html",
        f"{summary['name']}: executed",
        inputs=inputs,
        remark=REMARK,
        options=options,
        data=summary,
        bound=bound,
        is_judged=is_judged,
        overrides=", then ".join(s["words"] for s in summary["override"]) or "not known",
        rows=[
            [LABELS[name], *(fixed(d[key]) for key in ("max_um", "p99_um", "rms_um")), d["at"]]
            for name, d in summary["deviation"].items()
        ],
        findings=run.findings,
        figures={"space": _space(run), "time": _over_time(run), "speed": _speed(run)},
        titles=FIGURES,
    )


def _tool_speed(run: ExecutedRun) -> Array:
    """Of the logged places, (R,) [m/s]; at a corner that is cut the nearest point of the path runs faster."""
    return norm(speeds(run.deviation.time, run.followed.position[run.deviation.row]))


def _space(run: ExecutedRun) -> Figure:
    d = run.deviation
    rows = rows_to_draw(np.where(d.judged, d.distance, 0.0))
    places = run.followed.position[d.row] / MM
    off = np.round(np.where(d.judged, d.distance, np.nan)[rows] / UM, 3)
    path = Coloured("off the path", places[rows], off)
    return figure_in_space("How far the motion is off the path, in space", [path], places, d.judged)


def _over_time(run: ExecutedRun) -> Figure:
    d, traces = run.deviation, []
    for name, values, colour, dash in (
        (LABELS["across"], d.across, WARM, "solid"),
        (LABELS["normal"], d.normal, COOL, "dot"),
    ):
        rows = rows_to_draw(np.abs(values))
        x, y = np.round(d.time[rows], 3), np.round(values[rows] / UM, 3)
        traces.append(trace("scatter", x, y, name=name, line={"color": colour, "width": 1.2, "dash": dash}))
    alt = curves_in_words("Deviation over time", traces, "µm")
    return figure(traces, 320, alt, yaxis=axis("deviation [µm]"), xaxis=axis("the log's clock [s]"))


def _speed(run: ExecutedRun) -> Figure:
    d, course = run.deviation, run.course
    rows = rows_to_draw(np.arange(len(d.time), dtype=float))
    way = run.followed.projection.way[d.row[rows]]
    written = np.diff(course.arc)[way] / np.maximum(np.diff(course.cruise)[way], 1e-9)
    traces = [
        trace("scatter", np.round(d.time[rows], 3), np.round(v / MM, 3), name=name, line=line)
        for name, v, line in (
            ("written", written, {"color": GREY, "width": 1.0, "dash": "dash"}),
            ("executed", _tool_speed(run)[rows], {"color": WARM, "width": 1.4}),
        )
    ]
    alt = curves_in_words("Speed along the path", traces, "mm/s")
    return figure(traces, 300, alt, yaxis=axis("speed [mm/s]", rangemode="tozero"), xaxis=axis("the log's clock [s]"))
