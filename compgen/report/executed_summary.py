"""A judged log as data: JSON, and CSV with a row for each of the log's that a picture can show."""

from typing import Any

import numpy as np

from compgen.core.commands import Command
from compgen.core.units import MM, MS, UM
from compgen.core.version import __version__
from compgen.pipelines.executed.executed import ProgramText
from compgen.report.figure import rows_to_draw
from compgen.robot.robot import Robot
from compgen.verification.executed.judgement import ExecutedRun

SCHEMA = 1


def executed_summary(run: ExecutedRun, text: ProgramText, robot: Robot, bound: float | None) -> dict[str, Any]:
    """Everything that a log says of a run, in plain types; docs/executed.md has the keys."""
    course, clock, deviation = run.course, run.clock, run.deviation
    first, last = run.covered
    late = clock.late[np.isfinite(clock.late)]
    log = run.followed.log
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
        "log": {
            "file": log.table.source,
            "rows": len(log.time),
            "rows_without_position": log.gaps,
            "columns": "joints" if log.is_joints else "cartesian",
            "period_ms": log.period / MS,
            "noise_um": deviation.noise / UM,
        },
        "covered": {
            "from_mm": first / MM,
            "to_mm": last / MM,
            "share": (last - first) / course.length,
            "from": course.point_name(first),
            "to": course.point_name(last),
        },
        "override": [
            {
                "from_s": s.begin,
                "to_s": s.end,
                "percent": 100 * s.override,
                "rate": s.rate,
                "rate_sigma": s.sigma,
            }
            for s in clock.stretches
        ],
        "time": {
            "start_s": clock.start,
            "took_s": clock.took,
            "expected_s": clock.expected,
            "off_percent": 100 * (clock.took / clock.expected - 1) if clock.expected > 0 else None,
            "whole_periods": clock.rounded,
            "late_max_ms": float(np.abs(late).max(initial=0.0) / MS),
        },
        "stands": [
            {
                "at_s": s.time,
                "at": course.point_name(s.arc),
                "stood_s": s.duration + s.planned,
                "planned_s": s.planned,
                "program_stops": s.at_stop,
            }
            for s in clock.stands
        ],
        "deviation": {
            name: {
                "max_um": e.max / UM,
                "p99_um": e.p99 / UM,
                "rms_um": e.rms / UM,
                "at": course.point_name(e.where),
                "at_mm": e.where / MM,
            }
            for name, e in deviation.extents.items()
        },
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
            d.speed[rows] / MM,
        ]
    )
    head = "time_s,along_mm,off_um,across_um,normal_um,speed_mm_s,judged\n"
    lines = [
        f"{t:.4f},{s:.3f},{off:.2f},{across:.2f},{normal:.2f},{v:.2f},{int(judged)}\n"
        for (t, s, off, across, normal, v), judged in zip(numbers.tolist(), d.judged[rows].tolist(), strict=True)
    ]
    return (head + "".join(lines)).encode("ascii")
