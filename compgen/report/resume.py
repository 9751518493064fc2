"""A resumed job, a resumed program that existed, and one look at a running job: as data, in words, as one page each.

What was written anew and why, and what each page leaves before and after.
"""

from typing import Any

import numpy as np

from compgen.core.commands import Command
from compgen.core.units import HOUR, UM, limit_words
from compgen.core.version import __version__
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.resume.corrected_rest import ResumedProgram, resumed_words
from compgen.pipelines.resume.follow import Look
from compgen.pipelines.resume.result import Resumed
from compgen.report.band_page import band_facts
from compgen.report.band_words import band_record
from compgen.report.correction import band_of_correction
from compgen.report.curves import CurveRow, course, figure_in_rows
from compgen.report.figure import COOL, WARM, Figure, rows_to_draw, trace
from compgen.report.inputs import Inputs, correction_inputs, job_inputs, made_from, time_words
from compgen.report.job_page import KINDS, REMARK, VERDICTS
from compgen.report.page import PageOptions, fixed, page
from compgen.report.provenance import provenance
from compgen.verification.deviation import statistics

SCHEMA = 1
PARTS = {
    "total": "position [µm]",
    "feed": "along feed [µm]",
    "cross": "cross feed [µm]",
    "normal": "along the tool [µm]",
    "axis_angle": "tool axis [mdeg]",
}


def resume_summary(resumed: Resumed) -> dict[str, Any]:
    """Everything a resumed job found, in plain types."""
    planned, begun = resumed.planned, resumed.begun
    job = planned.job
    return {
        "schema": SCHEMA,
        "command": Command.RESUME,
        "name": job.name,
        "verdict": resumed.verdict.value,
        "from_page": resumed.from_page,
        "why": begun.why,
        **{key: value for key, value in begun.cause.items() if key != "state_toml"},
        "replaced": list(resumed.replaced),
        "thermal": {
            "start_K": dict(zip(job.heat.names, np.asarray(planned.rise[0]).tolist(), strict=True)),
            "planned_K": dict(zip(job.heat.names, np.asarray(resumed.planned_rise).tolist(), strict=True)),
            "start_window_s": resumed.starts[0].window,
        },
        "join": None if resumed.join is None else resumed.join.record(),
        "before": statistics(planned.deviation()),
        "after": statistics(resumed.deviation),
        "on_part": {
            "before": statistics(planned.deviation(), on_part=True),
            "after": statistics(resumed.deviation, on_part=True),
        },
        "band": band_of_resumed(resumed),
        "pages": _pages(resumed),
        "bounds": {"max_um": None if job.bounds.max is None else round(job.bounds.max / UM, 9)},
        "findings": [finding.record() for finding in resumed.findings],
        "provenance": {
            "compgen": __version__,
            **made_from(job),
            "manifest": resumed.written.manifest_file,
        },
    }


def _pages(resumed: Resumed) -> list[dict[str, Any]]:
    """What is said of each page, in order."""
    return [
        {
            "page": page.number,
            "file": page.file,
            "replaced": page.is_new,
            "start_s": start.time,
            "start_window_s": start.window,
            "before": page.before.record(),
            "after": page.after.record(),
        }
        for page, start in zip(resumed.pages, resumed.starts, strict=True)
    ]


def band_of_resumed(resumed: Resumed) -> dict[str, Any]:
    """What files and log leave open on the new pages."""
    return band_record(resumed.band, with_motion(resumed.planned.not_known(resumed.band), None))


def program_summary(resumed: ResumedProgram) -> dict[str, Any]:
    """Everything that was found, in plain types."""
    cell = resumed.correction.cell
    return {
        "schema": SCHEMA,
        "command": Command.RESUME,
        "name": resumed.correction.name,
        "verdict": resumed.verdict.value,
        "from_page": resumed.from_page,
        "why": resumed.begun.why,
        **resumed.begun.cause,
        "replaced": list(resumed.replaced),
        "join": None if resumed.join is None else {**resumed.join.record(), "on_the_part": None},
        "band": band_of_correction(resumed.correction),
        "pages": [
            {
                "page": p.number,
                "file": p.file,
                "replaced": p.is_new,
                "before": p.before.record(),
                "after": p.after.record(),
            }
            for p in resumed.pages
        ],
        "findings": [finding.record() for finding in resumed.findings],
        "provenance": {
            "compgen": __version__,
            "robot": cell.robot.name,
            "robot_file": {"path": cell.robot_file, "sha256": cell.robot_file_hash},
            "manifest": resumed.written.manifest_file,
        },
    }


def unwritten(record: dict[str, Any]) -> dict[str, Any]:
    """The record of a resume whose pages were not written: it replaced none."""
    return {**record, "replaced": [], "pages": [{**page, "replaced": False} for page in record["pages"]]}


def resume_html(resumed: Resumed, options: PageOptions) -> bytes:
    """The page of a resumed job, the same bytes for the same inputs."""
    data = resume_summary(resumed)
    late, thermal = data.get("late_s"), data["thermal"]
    why = f"it starts {time_words(late)} late" if late else str(data["why"])
    made = job_inputs(resumed.planned.job)  # but for its history: the pages begin in the middle of it
    rows = tuple(("history", f"the job's pages so far; {why}") if row[0] == "history" else row for row in made.rows)
    window = thermal["start_window_s"]
    return page(
        "resume.html",
        f"Resumed: {data['name']}",
        inputs=Inputs(rows, made.hashes).with_rows(("manifest", resumed.written.manifest_file)),
        remark=REMARK,
        options=options,
        data=data,
        kind=KINDS.get(data["verdict"], "outside"),
        verdict=VERDICTS[data["verdict"]],
        why=why,
        facts=band_facts(data["band"]),
        findings=resumed.findings,
        page_rows=[[row["file"], fixed(row["start_s"] / HOUR), *_sizes(row)] for row in data["pages"]],
        parts=PARTS,
        rise_rows=[
            [f"rise of {name} [K]", fixed(thermal["planned_K"][name]), fixed(rise)]
            for name, rise in thermal["start_K"].items()
        ],
        window=limit_words(window) if window else "",
        drawn=_figure(resumed),
    )


def program_html(resumed: ResumedProgram, options: PageOptions) -> bytes:
    """The page of a resumed program that existed, the same bytes for the same inputs."""
    data, made = program_summary(resumed), provenance(resumed.correction)
    inputs = correction_inputs(resumed.correction, made["planned_sha256"], made["corrected_sha256"])
    return page(
        "resumed_program.html",
        f"Resumed: {data['name']}",
        inputs=inputs.with_rows(("manifest", resumed.written.manifest_file)),
        options=options,
        kind="inside" if resumed.correction.inside else "outside",
        words="; ".join(resumed_words(resumed)),
        facts=band_facts(data["band"]) if data["band"] else [],
        findings=resumed.findings,
        page_rows=[[row["file"], *_sizes(row)] for row in data["pages"]],
    )


def _sizes(row: dict[str, Any]) -> list[str]:
    return [fixed(value) for side in ("before", "after") for value in row[side].values()]


def _figure(resumed: Resumed) -> Figure:
    rows = []
    for name, deviation, colour in (
        ("pages so far", resumed.planned.deviation(), WARM),
        ("new pages", resumed.deviation, COOL),
    ):
        size = deviation.total() / UM
        shown = rows_to_draw(size)
        line = {"color": colour, "width": 1}
        curve = trace("scatter", deviation.time[shown] / HOUR, size[shown], name=name, line=line, showlegend=False)
        bound = resumed.planned.job.bounds.max
        limit = None if bound is None or name != "new pages" else bound / UM
        rows.append(CurveRow(f"{name} [µm]", [curve], course(name, size, "µm"), limit))
    return figure_in_rows(rows, "time from the page's start [h]", "Error over time")


def look_record(
    look: Look | None, resumed: Resumed | ResumedProgram | None, within: float, *, force: bool
) -> dict[str, Any]:
    """A look in plain types.

    Args:
        look: None where the log has no reading yet since the job was planned to start.
        resumed: The pages that it led to.
        within: Largest error that a page may leave [um].
        force: Whether pages outside the job's bounds are written.
    """
    if look is None:
        return {"command": Command.FOLLOW, "time_s": None}
    band = None if resumed is None else resumed.band
    return {
        "command": Command.FOLLOW,
        "time_s": look.time,
        "page": look.running,
        "share": round(look.share, 4),
        "begun_behind_log": look.behind,
        "loaded": look.loaded,
        "over": look.over,
        "rise_K": [round(x, 3) for x in look.rise.tolist()],
        "sigma_K": [round(x, 3) for x in look.sigma.tolist()],
        "missed_K": [round(x, 3) for x in look.missed.tolist()],
        "within_um": within,
        "forecast": [
            {
                "page": f.page,
                "start_s": round(f.start, 1),
                "max_um": round(f.max / UM, 3),
                "rms_um": round(f.rms / UM, 3),
            }
            for f in look.forecasts
        ],
        "due": look.due,
        "written": list(resumed.replaced) if resumed is not None and (resumed.is_usable or force) else [],
        "after_um": None if resumed is None else max(round(p.after.max / UM, 3) for p in resumed.pages),
        "band_um": round(band.largest / UM, 3) if band is not None else None,
        "verdict": None if resumed is None else resumed.verdict.value,
        "notes": list(look.notes),
        "doubt": look.doubt,
    }


def look_words(look: Look | None, resumed: Resumed | ResumedProgram | None, within: float, *, force: bool) -> str:
    """A look in one line; see ``look_record``."""
    if look is None:
        return "no reading yet since the job was planned to start (--planned)"
    if look.doubt:
        return "; ".join([f"{look.time:.0f} s: {look.doubt}; the pages stay as they are", *look.notes])
    where = f"page {look.running} runs ({100 * look.share:.0f} %)" if look.running else "the robot stands"
    if look.over:
        where = "the last page has ended"
    if look.behind:
        where = f"by the log {where}; --pages says page {look.behind} has begun"
    rises = " ".join(f"{r:.2f}" for r in look.rise.tolist())
    parts = [f"{look.time:.0f} s: {where}; rises {rises} K, +- {2 * look.sigma.max():.1f} at 95 %"]
    parts += [f"page {f.page} forecast {f.max / UM:.1f} um (rms {f.rms / UM:.1f})" for f in look.forecasts]
    if resumed is not None:
        pages = f"pages {resumed.from_page} to {resumed.pages[-1].number}"
        left = f"{max(p.after.max for p in resumed.pages) / UM:.2f} um"
        if resumed.band is not None:
            left += f" +- {resumed.band.largest / UM:.0f} (95 %)"
        if resumed.is_usable or force:
            parts.append(
                f"over {within:g} um: {pages} {'written anew' if resumed.replaced else 'unchanged'}, {left} left"
            )
        else:
            parts.append(f"over {within:g} um: {pages} not written: {resumed.verdict}, {left}; --force writes them")
    elif any(f.max > within * UM for f in look.forecasts):
        parts.append(f"over {within:g} um, but the controller has that page already")
    return "; ".join([*parts, *look.notes])
