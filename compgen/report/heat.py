"""The warmth of a job's day as one page, a CSV table and sentences."""

import numpy as np
import plotly.graph_objects as go

from compgen.job import Job
from compgen.report.page import GREY, LINES, WARM, div, dress, page
from compgen.study import Timeline
from compgen.units import HOUR, UM


def heat_csv(job: Job, day: Timeline) -> bytes:
    """Rises over time."""
    head = ",".join(["time_s", "ambient_rise_K", *(f"rise_{n}_K" for n in job.heat.names)])
    rows = np.column_stack([day.time, day.air, day.rise])
    return "\n".join([head, *(",".join(f"{v:.6g}" for v in row) for row in rows), ""]).encode()


def runs_csv(job: Job, day: Timeline) -> bytes:
    """Each run of the program."""
    head = ",".join(["run", "start_s", "error_um", "residual_um", *(f"rise_{n}_K" for n in job.heat.names)])
    rows = np.column_stack([day.run, day.error / UM, day.residual / UM, day.run_rise])
    lines = [",".join([str(n), *(f"{v:.6g}" for v in row)]) for n, row in enumerate(rows, 1)]
    return "\n".join([head, *lines, ""]).encode()


def heat_sentences(job: Job, day: Timeline) -> list[str]:
    """What the day comes to."""
    rises = ", ".join(f"{n} {r:.2f}" for n, r in zip(job.heat.names, day.run_rise[0]))
    told = [f"the program starts after {day.start / HOUR:.2f} h at rises [K]: {rises}"]
    if len(day.run) > 1:
        worst = int(np.argmax(day.residual))
        told.append(
            f"{len(day.run)} runs: error {day.error.min() / UM:.1f} to {day.error.max() / UM:.1f} um uncorrected; "
            f"a file made for the first run is off by up to {day.residual[worst] / UM:.2f} um (run {worst + 1})"
        )
    rises = ", ".join(f"{n} {r:.2f}" for n, r in zip(job.heat.names, day.rise[-1]))
    told.append(f"at the end, {day.time[-1] / HOUR:.2f} h: {rises}")
    return told


def heat_html(job: Job, day: Timeline) -> bytes:
    """One self-contained page."""
    body = "".join(f'<p class="big predicted">{s}</p>' for s in heat_sentences(job, day))
    body += f"<h2>Temperature over the day</h2>{div(_rises(job, day), 'rises')}"
    if len(day.run) > 1:
        body += f"<h2>Each run of the program</h2>{div(_runs(day), 'runs')}"
    return page(f"Heat: {job.title or job.name}", body)


def _rises(job: Job, day: Timeline) -> go.Figure:
    figure = go.Figure()
    hours = np.round(day.time / HOUR, 5)
    for i, name in enumerate(job.heat.names):
        figure.add_scatter(
            x=hours, y=np.round(day.rise[:, i], 4), name=name, line={"color": LINES[i % len(LINES)], "width": 1.5,
            "dash": "solid" if i < len(LINES) else "dot"},
        )  # fmt: skip
    if day.air.any():
        figure.add_scatter(
            x=hours, y=np.round(day.air, 4), name="air", line={"color": GREY, "dash": "dash", "width": 1}
        )
    figure.add_vline(x=day.start / HOUR, line={"color": WARM, "dash": "dash", "width": 1})
    figure.update_xaxes(title_text="time [h]; dashed: the program starts")
    figure.update_yaxes(title_text="rise [K]")
    return dress(figure, 420)


def _runs(day: Timeline) -> go.Figure:
    figure = go.Figure()
    runs = np.arange(1, len(day.run) + 1)
    for name, values, tint in (("uncorrected", day.error, WARM), ("with the first run's file", day.residual, LINES[3])):
        figure.add_scatter(x=runs, y=np.round(values / UM, 3), name=name, mode="lines+markers", line={"color": tint})
    figure.update_xaxes(title_text="run")
    figure.update_yaxes(title_text="largest error [µm]", rangemode="tozero")
    return dress(figure, 380)
