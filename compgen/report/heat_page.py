"""The temperatures of a job's day, and the error of each run: as a page, CSV tables, JSON and sentences."""

from typing import Any

import numpy as np

from compgen.core.arrays import Array
from compgen.core.commands import Command
from compgen.core.json_text import json_text
from compgen.core.units import HOUR, UM
from compgen.core.version import __version__
from compgen.job.job import Job
from compgen.pipelines.findings.motion_findings import with_motion
from compgen.pipelines.planned.many_starts import ensemble_words
from compgen.pipelines.study import Timeline
from compgen.pipelines.uncertainty.not_known import not_known
from compgen.report.band_page import LEFT_OPEN, band_facts
from compgen.report.band_words import band_record, known_words, rounded, unknown_in_short, unknown_words
from compgen.report.curves import CurveRow, course, curves_in_words, figure_in_rows, line_style
from compgen.report.figure import COOL, GREY, WARM, Figure, axis, figure, trace, vertical_line
from compgen.report.inputs import day_inputs, made_from
from compgen.report.page import PLAIN, PageOptions, fixed, page

COLD = 0.05  # a smaller rise than this is none [K]
REMARK = "Warmth by the robot file's heat model; errors by the sources active in it."


def heat_csv(job: Job, day: Timeline) -> bytes:
    """Temperature rises over time."""
    return _csv(job, {"time_s": day.time, "ambient_rise_K": day.air}, day.rise)


def runs_csv(job: Job, day: Timeline) -> bytes:
    """Error and temperature rises of each run of the program."""
    number = np.arange(1.0, len(day.run) + 1)
    sizes = {"error_um": day.error / UM, "residual_um": day.residual / UM}
    return _csv(job, {"run": number, "start_s": day.run, **sizes}, day.run_rise)


def _csv(job: Job, columns: dict[str, Array], rise: Array) -> bytes:
    """Columns (M,) by their names, and behind them the rises of a job's nodes, (M, K) [K]; times to the millisecond."""
    names = [*columns, *(f"rise_{name}_K" for name in job.heat.names)]
    rows = np.column_stack([*columns.values(), rise])
    formats = [_seconds if name.endswith("_s") else "{:.6g}".format for name in names]
    lines = (",".join(form(v) for form, v in zip(formats, row, strict=True)) for row in rows)
    return "\n".join([",".join(names), *lines, ""]).encode()


def _seconds(time: float) -> str:
    """A time of a day of any length, to the millisecond."""
    return f"{round(time, 3):.12g}"


def heat_json(job: Job, day: Timeline) -> bytes:
    """The day in numbers, and whose it is; docs/heat.md has the keys."""
    names = job.heat.names
    data = {
        "schema": 1,
        "command": Command.HEAT,
        "name": job.name,
        "title": job.title,
        "start_s": day.start,
        "duration_s": float(day.time[-1]),
        "findings": [finding.record() for finding in day.findings],
        "rise_K": {
            "start": dict(zip(names, day.run_rise[0].tolist(), strict=True)),
            "end": dict(zip(names, day.rise[-1].tolist(), strict=True)),
        },
        "runs": {
            "count": len(day.run),
            "error_max_um": float(day.error.max() / UM),
            "residual_max_um": float(day.residual.max() / UM),
        },
        "band": dict(zip(("first", "largest"), _bands(job, day), strict=False)),
        "provenance": {
            "compgen": __version__,
            **made_from(job),
            "overrides": list(job.overrides),
        },
        "inputs": dict(job.inputs),
    }
    return json_text(data)


def heat_sentences(job: Job, day: Timeline, *, verbose: bool = True) -> list[str]:
    """The day in a few sentences; without ``verbose`` only the largest of what is not measured has its name."""
    rises = ", ".join(f"{n} {r:z.2f}" for n, r in zip(job.heat.names, day.run_rise[0], strict=True))
    sentences = [f"the program starts after {day.start / HOUR:.2f} h at rises [K]: {rises}"]
    if len(day.run) > 1:
        worst = int(np.argmax(day.residual))
        sentences.append(
            f"{len(day.run)} runs: error {day.error.min() / UM:.1f} to {day.error.max() / UM:.1f} um uncorrected; "
            f"{_file_of(job)} is off by up to {day.residual[worst] / UM:.2f} um besides rounding and chords "
            f"(run {worst + 1})"
        )
    first, largest = _bands(job, day)
    by_model = f"by the model; uncertainty of the robot data: {known_words(first)}"
    if len(day.run) > 1:
        by_model += f"; that is the first run{_of_worst_run(day, largest, 'um')}, which errs most"
    unknown = unknown_words(first) if verbose else unknown_in_short(first)
    sentences.append(by_model + (f"; not measured on your robot: {unknown}" if unknown else ""))
    rises = ", ".join(f"{n} {r:z.2f}" for n, r in zip(job.heat.names, day.rise[-1], strict=True))
    sentences.append(f"at the end, {day.time[-1] / HOUR:.2f} h: {rises}")
    return sentences


def heat_html(job: Job, day: Timeline, options: PageOptions = PLAIN, max_um: float | None = None) -> bytes:
    """One page, the same bytes for the same inputs; ``max_um`` is the largest error allowed of one file [um]."""
    most, worst = int(np.argmax(day.error)), int(np.argmax(day.residual))
    left, count = float(day.residual[worst] / UM), len(day.run)
    return page(
        "heat.html",
        f"Heat: {job.title or job.name}",
        inputs=day_inputs(job),
        remark=REMARK,
        options=options,
        kind="predicted" if max_um is None else "inside" if left <= max_um else "outside",
        facts=_facts(job, day, max_um),
        before=day.error[most] / UM,
        most=most + 1,
        left=fixed(left, 1 if left >= 10 else 2),
        worst=worst + 1,
        count=count,
        file=_file_of(job),
        is_judged=max_um is not None,
        findings=day.findings,
        rises=_rises(job, day),
        runs=_runs(job, day, max_um) if count > 1 else None,
    )


def _facts(job: Job, day: Timeline, max_um: float | None) -> list[tuple[str, str]]:
    """What the files leave open, and how warm the robot is when the program starts and at the day's end."""
    first, largest = _bands(job, day)
    facts = [] if max_um is None else [("bound", f"{max_um:g} µm for one file in every run")]
    for name, words in band_facts(first):
        if name == LEFT_OPEN and len(day.run) > 1:
            words += f" in the first run{_of_worst_run(day, largest, 'µm')}"
        facts.append((name, words))
    for when, hours, rises in (
        ("as the program starts", day.start / HOUR, day.run_rise[0]),
        ("at the end", day.time[-1] / HOUR, day.rise[-1]),
    ):
        parts = ", ".join(f"{n} {r + 0.0:.1f}" for n, r in zip(job.heat.names, rises, strict=True))
        warmth = f"{parts} K warmer than the cold robot" if np.abs(rises).max() >= COLD else "the robot is cold"
        facts.append((when, f"after {hours:.1f} h: {warmth}"))
    return facts


def _bands(job: Job, day: Timeline) -> list[dict[str, Any]]:
    """What the files leave open in the first run and in the one that errs most; no text is written here and flown."""
    return [band_record(band, with_motion(not_known(job.cell, band, day.setting), None)) for band in day.band]


def _of_worst_run(day: Timeline, largest: dict[str, Any], unit: str) -> str:
    """The band of the run that errs most, where that is not the first."""
    worst = int(np.argmax(day.error)) + 1
    return "" if worst == 1 else f", {rounded(largest['p95_um'])} {unit} in run {worst}"


def _rises(job: Job, day: Timeline) -> Figure:
    hours = np.round(day.time / HOUR, 5)
    traces = [
        trace("scatter", hours, np.round(day.rise[:, i], 4), name=name, line={**line_style(i), "width": 1.5})
        for i, name in enumerate(job.heat.names)
    ]
    if day.air.any():
        line = {"color": GREY, "dash": "dash", "width": 1}
        traces.append(trace("scatter", hours, np.round(day.air, 4), name="air", line=line))
    alt = curves_in_words("Temperature over the day", traces, "K")
    return figure(
        traces,
        420,
        alt,
        shapes=[vertical_line(day.start / HOUR, WARM)],
        xaxis=axis("time [h]; dashed: the program starts"),
        yaxis=axis("rise [K]"),
    )


def _file_of(job: Job) -> str:
    """Which one file the runs are judged by."""
    return "a file made for the first run" if job.ensemble is None else f"one file for {ensemble_words(job.ensemble)}"


def _runs(job: Job, day: Timeline, max_um: float | None) -> Figure:
    runs, rows = np.arange(1, len(day.run) + 1), []
    for title, name, values, colour, symbol in (
        ("before", "uncorrected", day.error, WARM, "circle"),
        ("after", f"with {_file_of(job)}", day.residual, COOL, "diamond"),
    ):
        size, line, marker = np.round(values / UM, 3), {"color": colour}, {"symbol": symbol}
        curve = trace("scatter", runs, size, name=name, mode="lines+markers", line=line, marker=marker, showlegend=True)
        rows.append(CurveRow(f"{title} [µm]", [curve], course(name, size, "µm"), max_um if title == "after" else None))
    return figure_in_rows(rows, "run", "Largest error of each run")
