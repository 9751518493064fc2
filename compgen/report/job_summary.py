"""A job as data; its schema is documented in docs/report.md and changes only with ``schema``."""

from hashlib import sha256
from typing import Any

import numpy as np

from compgen import fanuc
from compgen.core.arrays import column_extremes, row_norms
from compgen.core.commands import Command
from compgen.core.units import DEG, HOUR, KB, MDEG, MM, UM
from compgen.core.version import __version__
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.uncertainty.band import not_known
from compgen.pipelines.uncertainty.model_form import ModelForm
from compgen.report.averaged import averaged_record, ensemble_record
from compgen.report.band_words import band_record
from compgen.report.guaranteed import guaranteed_record
from compgen.report.inputs import made_from
from compgen.report.motion_record import motion_record
from compgen.verification.band import Band
from compgen.verification.deviation import statistics
from compgen.verification.verdict import Verdict

SCHEMA = 1


def job_summary(planned: Planned, corrected: Corrected | None) -> dict[str, Any]:
    """Everything a job found, in plain types."""
    job, path = planned.job, planned.path
    trajectory = corrected.trajectory if corrected else planned.trajectory
    written = corrected.written if corrected else planned.written()
    before = statistics(planned.deviation())
    after = statistics(corrected.deviation) if corrected else None
    findings = corrected.findings if corrected else planned.findings
    names, band = job.heat.names, band_of(planned, corrected)
    report: dict[str, Any] = {
        "schema": SCHEMA,
        "command": Command.GENERATE if corrected else Command.PREDICT,
        "name": job.name,
        "title": job.title,
        "verdict": (Verdict.PREDICTED if corrected is None else corrected.verdict).value,
        "before": before,
        "after": after,
        "on_part": {
            "before": statistics(planned.deviation(), on_part=True),
            "after": statistics(corrected.deviation, on_part=True) if corrected else None,
        },
        "ratio": before["total"]["max_um"] / after["total"]["max_um"] if after else None,
        "band": band_record(
            band,
            with_motion(not_known(job.cell, band), planned.written().effect),
            corrected.draws if corrected else None,
        ),
        "bounds": {
            key: value
            for key, value in {
                "max_um": _in(job.bounds.max, UM),
                "p99_um": _in(job.bounds.p99, UM),
                "rms_um": _in(job.bounds.rms, UM),
                "feed_um": _in(job.bounds.feed, UM),
                "cross_um": _in(job.bounds.cross, UM),
                "normal_um": _in(job.bounds.normal, UM),
                "axis_mdeg": _in(job.bounds.axis, MDEG),
            }.items()
            if value is not None
        },
        "findings": [f.record() for f in findings],
        "motion": motion_record(planned.effect(written)),
        "path": {
            "waypoints": len(path.arc),
            "left_out": int(planned.rows[-1]) + 1 - len(path.arc),
            "length_m": float(path.arc[-1]),
            "contact_m": float(np.diff(path.arc)[path.contact[1:] & path.contact[:-1]].sum()),
            "stops": int(path.stop.sum()),
        },
        "timing": {
            "duration_s": float(written.time[-1]),
            "planned_s": float(trajectory.time[-1]),
            "as_written_s": written.as_written,
            "rounded_up_s": written.rounded_up,
            "at_feed": written.at_feed,
            "joint_use": {
                kind: dict(zip(job.robot.joint_names, row.tolist(), strict=True))
                for kind, row in zip(
                    ("speed", "acceleration", "jerk"), [*written.use, trajectory.utilisation[2]], strict=True
                )
            },
        },
        "thermal": {
            "start_K": dict(zip(names, planned.rise[0].tolist(), strict=True)),
            "end_K": dict(zip(names, planned.rise[-1].tolist(), strict=True)),
        },
    }
    if corrected:
        solution = corrected.solution
        report["thermal"]["start_window_s"] = corrected.start_window
        report["compensation"] = {
            "status": solution.status.name.lower(),
            "meaning": solution.status.value,
            "iterations": solution.iterations,
            "last_step_m": solution.last_step,
            "active_limits": len(solution.active_limits),
            "largest_um": float(row_norms(solution.correction[:, :3]).max() / UM),
            "largest_mdeg": float(row_norms(solution.correction[:, 3:]).max() / MDEG),
            "mid_spatial_rms_nm": corrected.mid_spatial / UM * 1000,
            "predicted_residual_um": float(row_norms(solution.residual[:, :3]).max() / UM),
        }
        report["guaranteed"] = guaranteed_record(corrected.draws)
        report["model_form"] = _model_form(corrected.model_form)
        report["program"] = _program(corrected)
    if job.ensemble is not None:
        averaged = None if corrected is None else corrected.averaged
        report["average_over"] = ensemble_record(job.ensemble) if averaged is None else averaged_record(averaged)
    report["provenance"] = {
        "compgen": __version__,
        **made_from(job),
        "sources": [source.NAME for source in job.sources],
        "overrides": list(job.overrides),
        "tool": {
            "number": job.tool.number,
            "position_mm": (job.tool.pose.position / MM).tolist(),
            "rotation": job.tool.pose.rotation.tolist(),
        },
        "frame": None
        if job.frame is None
        else {
            "number": job.frame.number,
            "position_mm": (job.frame.register.position / MM).tolist(),
            "rotation": job.frame.register.rotation.tolist(),
        },
        "before": [
            {"state": d.state, "feed_mm_s": d.feed / MM, "duration_h": d.duration / HOUR} for d in job.history.before
        ],
        "joint_range_deg": _joint_range(planned, corrected),
    }
    report["inputs"] = dict(job.inputs)
    if (state := job.cell.state) is not None:
        report["provenance"]["state"] = {
            "sha256": state.digest, "verdict": state.verdict, "time_s": state.time, "window_s": state.window,
            "age_s": job.history.clock,
        }  # fmt: skip
    return report


def _model_form(form: ModelForm | None) -> dict[str, Any] | None:
    """What the robot file's other heat model leaves of the correction."""
    if form is None:
        return None
    return {
        "corrected": form.corrected,
        "driven": form.driven,
        "max_um": form.largest / UM,
        "rms_um": form.rms / UM,
        "share": form.share,
    }


def band_of(planned: Planned, corrected: Corrected | None) -> Band:
    """What a job's files leave open."""
    return planned.band_of_plan() if corrected is None else corrected.band


def _program(corrected: Corrected) -> dict[str, Any]:
    """The files for the controller."""
    program, delivered = corrected.program, corrected.delivery
    feed_error, time_error = fanuc.feed_errors(corrected.trajectory.speed, program.speed, program.lengths())
    record = {
        "file": delivered.files[-1][0],
        "positions": len(program.position),
        "arcs": int(program.via.sum()),
        "bytes": sum(len(content) for name, content in delivered.files if name.endswith(".LS")),
        "memory_kB": fanuc.estimated_memory(program) / KB,
        "largest_feed_error": feed_error,
        "largest_time_error_s": time_error,
        "sha256": {name: sha256(text).hexdigest() for name, text in delivered.files if name.endswith(".LS")},
        "rounding_um": float(np.sqrt(3) / 2 * 10.0 ** (3 - program.decimals)),
        "pages": [],
    }
    if delivered.paged is not None:
        record["memory_kB"] = sum(page.size.memory for page in delivered.paged.pages) / KB
        record["pages"] = [
            {
                "file": f"{page.name}.LS",
                "load": page.load,
                "lines": page.size.lines,
                "positions": page.size.positions,
                "memory_kB": page.size.memory / KB,
                "start_s": start.time,
                "start_window_s": start.window,
            }
            for page, start in zip(delivered.paged.pages, delivered.starts, strict=True)
        ]
    return record


def _in(value: float | None, factor: float) -> float | None:
    return None if value is None else round(value / factor, 9)


def _joint_range(planned: Planned, corrected: Corrected | None) -> dict[str, list[float]]:
    robot = planned.job.robot
    low, high = column_extremes(corrected.solution.theta if corrected else planned.theta)
    ends = np.column_stack([low, high]) - robot.pendant_zero[:, None]
    return dict(zip(robot.joint_names, (ends / DEG).tolist(), strict=True))
