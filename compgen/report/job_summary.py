"""A job as data; its schema is documented in docs/report.md and changes only with ``schema``."""

from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np

from compgen.core.arrays import row_norms
from compgen.core.commands import Command
from compgen.core.evaluation import kept_with
from compgen.core.pose import Pose
from compgen.core.units import DEG, KB, MDEG, MINUTE, MM, MS, UM
from compgen.core.version import __version__
from compgen.job.bounds import Bounds
from compgen.job.job import Job
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.pipelines.uncertainty.model_form import ModelForm
from compgen.planning.retiming import Trajectory
from compgen.program.pages import estimated_memory
from compgen.program.speeds import feed_errors
from compgen.report.band_words import DRAWN, band_record, guaranteed_record
from compgen.report.inputs import made_from
from compgen.report.many_starts import averaged_record, ensemble_record
from compgen.report.provenance import stretch_record
from compgen.verification.band import Band
from compgen.verification.deviation import statistics
from compgen.verification.motion_effect import MotionEffect
from compgen.verification.verdict import Verdict, bound_unit, verdict_of
from compgen.verification.written_motion import WrittenMotion

if TYPE_CHECKING:
    from compgen.pipelines.planned.written_program import WrittenFlight

SCHEMA = 1


@kept_with("planned")  # screen, report.json and page say it
def job_summary(planned: Planned, corrected: Corrected | None) -> dict[str, Any]:
    """Everything a job found, in plain types."""
    job, band = planned.job, job_band(planned, corrected)
    written = corrected.written if corrected else planned.written()
    before, on_part = statistics(planned.deviation()), statistics(planned.deviation(), on_part=True)
    after = statistics(corrected.deviation) if corrected else None
    effect = planned.effect(written)
    unknown = with_motion(planned.not_known(band), effect)
    return {
        "schema": SCHEMA,
        "command": Command.GENERATE if corrected else Command.PREDICT,
        "name": job.name,
        "title": job.title,
        "verdict": (Verdict.PREDICTED if corrected is None else corrected.verdict).value,
        "before": before,
        "after": after,
        "on_part": {
            "before": on_part,
            "after": statistics(corrected.deviation, on_part=True) if corrected else None,
        },
        "ratio": before["total"]["max_um"] / after["total"]["max_um"] if after else None,
        "band": band_record(band, unknown, corrected.draws if corrected else None),
        "bounds": _bounds(job.bounds),
        "findings": [f.record() for f in (corrected or planned).findings],
        "motion": motion_record(effect),
        "path": _path(planned),
        "timing": _timing(job, written, corrected.trajectory if corrected else planned.trajectory),
        "thermal": _thermal(planned, corrected),
        **({} if corrected is None else _of_correction(corrected)),
        **_average_over(job, corrected),
        "provenance": _provenance(job, written),
        "inputs": dict(job.inputs),
    }


def written_summary(flight: "WrittenFlight", file: str) -> dict[str, Any]:
    """The report of ``cgen check --written``: ``before`` is the planned program, ``after`` the text.

    Args:
        flight: Of the text.
        file: Its name.
    """
    summary = job_summary(flight.planned, None)
    before, after = summary["before"], statistics(flight.deviation)
    promised = None if flight.draws is None else flight.draws.guarantee
    flown = {} if promised is None else {key: getattr(promised, key) for key in DRAWN}
    return {
        **summary,
        "command": Command.CHECK,
        "band": {**summary["band"], **flown},
        "verdict": verdict_of(flight.findings).value,
        "after": after,
        "on_part": {"before": summary["on_part"]["before"], "after": statistics(flight.deviation, on_part=True)},
        "ratio": before["total"]["max_um"] / after["total"]["max_um"],
        "guaranteed": guaranteed_record(flight.draws),
        "findings": [finding.record() for finding in flight.findings],
        "written": {
            "file": file,
            "name": flight.program.name,
            "positions": len(flight.program.position),
            "made_as": list(flight.program.remarks),
            **_flown_start(flight),
        },
    }


def _flown_start(flight: "WrittenFlight") -> dict[str, Any]:
    """The start that was flown; those of a job count from its ``[start]``, whose delay is before the first of them."""
    start, begin = flight.start, flight.planned.job.inputs["path"].get("start") or {"run": 1, "delay_min": 0.0}
    return {
        "run": begin["run"] + start.run,
        "delay_s": start.delay + (begin["delay_min"] * MINUTE if start.run == 0 else 0.0),
        "override_percent": 100 * start.override,
    }


def _bounds(bounds: Bounds) -> dict[str, float]:
    """The bounds that were given, by their keys."""
    given = {
        "max_um": bounds.max,
        "p99_um": bounds.p99,
        "rms_um": bounds.rms,
        "feed_um": bounds.feed,
        "cross_um": bounds.cross,
        "normal_um": bounds.normal,
        "axis_mdeg": bounds.axis,
    }
    return {key: round(value / bound_unit(key)[0], 9) for key, value in given.items() if value is not None}


def _path(planned: Planned) -> dict[str, Any]:
    path = planned.path
    return {
        "waypoints": len(path.arc),
        "left_out": int(planned.rows[-1]) + 1 - len(path.arc),
        "length_m": float(path.arc[-1]),
        "contact_m": float(np.diff(path.arc)[path.contact[1:] & path.contact[:-1]].sum()),
        "stops": int(path.stop.sum()),
    }


def _timing(job: Job, written: WrittenMotion, trajectory: Trajectory) -> dict[str, Any]:
    use = zip(("speed", "acceleration", "jerk"), [*written.use, trajectory.utilisation[2]], strict=True)
    return {
        "duration_s": float(written.time[-1]),
        "planned_s": float(trajectory.time[-1]),
        "as_written_s": written.as_written,
        "rounded_up_s": written.rounded_up,
        "at_feed": written.at_feed,
        "joint_use": {kind: dict(zip(job.robot.joint_names, row.tolist(), strict=True)) for kind, row in use},
    }


def _thermal(planned: Planned, corrected: Corrected | None) -> dict[str, Any]:
    names = planned.job.heat.names
    return {
        "start_K": dict(zip(names, planned.rise[0].tolist(), strict=True)),
        "end_K": dict(zip(names, planned.rise[-1].tolist(), strict=True)),
        **({} if corrected is None else {"start_window_s": corrected.start_window}),
    }


def _of_correction(corrected: Corrected) -> dict[str, Any]:
    """What only a corrected program has: how it was found, what is guaranteed, its files."""
    solution = corrected.solution
    return {
        "compensation": {
            "status": solution.status.name.lower(),
            "meaning": solution.status.value,
            "iterations": solution.iterations,
            "last_step_m": solution.last_step,
            "active_limits": len(solution.active_limits),
            "largest_um": float(row_norms(solution.correction[:, :3]).max() / UM),
            "largest_mdeg": float(row_norms(solution.correction[:, 3:]).max() / MDEG),
            "mid_spatial_rms_nm": corrected.mid_spatial / UM * 1000,
            "predicted_residual_um": float(row_norms(solution.residual[:, :3]).max() / UM),
        },
        "guaranteed": guaranteed_record(corrected.draws),
        "model_form": _model_form(corrected.model_form),
        "program": _program(corrected),
    }


def _average_over(job: Job, corrected: Corrected | None) -> dict[str, Any]:
    """Of a file that serves many starts: which, and what it leaves over them."""
    if job.ensemble is None:
        return {}
    averaged = None if corrected is None else corrected.averaged
    return {"average_over": ensemble_record(job.ensemble) if averaged is None else averaged_record(averaged)}


def _provenance(job: Job, written: WrittenMotion) -> dict[str, Any]:
    state = job.cell.state
    record = {
        "compgen": __version__,
        **made_from(job),
        "sources": [source.NAME for source in job.sources],
        "overrides": list(job.overrides),
        "tool": _numbered_pose(job.tool.number, job.tool.pose),
        "frame": None if job.frame is None else _numbered_pose(job.frame.number, job.frame.register),
        "before": [stretch_record(duty) for duty in job.history.before],
        "joint_range_deg": _joint_range(job, written),
    }
    if state is not None:
        record["state"] = {
            "sha256": state.digest,
            "verdict": state.verdict,
            "time_s": state.time,
            "window_s": state.window,
            "age_s": job.history.clock,
        }
    return record


def _numbered_pose(number: int, pose: Pose) -> dict[str, Any]:
    return {"number": number, "position_mm": (pose.position / MM).tolist(), "rotation": pose.rotation.tolist()}


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


def job_band(planned: Planned, corrected: Corrected | None) -> Band:
    """What a job's files leave open."""
    return planned.band_of_plan() if corrected is None else corrected.band


def _program(corrected: Corrected) -> dict[str, Any]:
    """The files for the controller."""
    program, delivered = corrected.program, corrected.delivery
    feed_error, time_error = feed_errors(corrected.trajectory.speed, program.speed, program.lengths())
    record = {
        "file": delivered.files[-1][0],
        "positions": len(program.position),
        "arcs": int(program.via.sum()),
        "bytes": sum(len(content) for name, content in delivered.files if name.endswith(".LS")),
        "memory_kB": estimated_memory(len(program.position)) / KB,
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


def motion_record(effect: MotionEffect | None) -> dict[str, Any] | None:
    """The effect of the controller's motion on the written text; docs/report.md has the keys."""
    if effect is None:
        return None
    motion, seen = effect.motion, effect.expected
    return {
        "known": effect.known,
        "predistorted": motion.may_predistort,
        "space": motion.space,
        "moving_average_ms": [round(t / MS, 9) for t in motion.moving_averages],
        "first_order_ms": [round(t / MS, 9) for t in motion.first_orders],
        "lag_ms": round(motion.lag / MS, 9),
        "off_path_um": effect.largest / UM,
        "lowest_um": effect.lowest / UM,
        "highest_um": effect.highest / UM,
        "evidence": None if seen is None else seen.evidence,
        "source": None if seen is None else seen.source,
        "where_m": effect.where,
        "along_um": effect.along / UM,
        "behind_mm": effect.lag / MM,
    }


def _joint_range(job: Job, written: WrittenMotion) -> dict[str, list[float]]:
    robot, (low, high) = job.robot, written.joint_range
    ends = np.sort([robot.as_quoted(low), robot.as_quoted(high)], axis=0).T
    return dict(zip(robot.joint_names, (ends / DEG).tolist(), strict=True))
