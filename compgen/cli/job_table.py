"""What a job says at its end, for a reader."""

import re
import sys
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from compgen.pipelines.generate import Corrected, Planned
from compgen.report import job_summary

FEW = 5  # numbered files of one name that are all told


def show_job(planned: Planned, corrected: Corrected | None, folder: Path | None, files: Iterable[str]) -> None:
    """The table at the end."""
    data = job_summary(planned, corrected)
    console = Console(width=None if sys.stdout.isatty() else 100)
    table = Table(title=Text(planned.job.title or planned.job.name), title_justify="left", title_style="bold")
    table.add_column("TCP error", no_wrap=True)
    names = ["before", "after"] if corrected else ["predicted"]
    for name in names:
        for part in ("max", "p99", "rms"):
            table.add_column(f"{name} {part}", justify="right")
    table.add_column("bound", justify="right")
    bound_keys = {
        "total": "max_um",
        "feed": "feed_um",
        "cross": "cross_um",
        "normal": "normal_um",
        "axis_angle": "axis_mdeg",
    }
    for row, label in (
        ("total", "total, um"),
        ("feed", "along feed, um"),
        ("cross", "cross feed, um"),
        ("normal", "normal, um"),
        ("axis_angle", "tool axis, mdeg"),
    ):
        cells = [f"{v:.2f}" for side in ("before", "after") if data[side] for v in data[side][row].values()]
        bound = data["bounds"].get(bound_keys[row])
        table.add_row(label, *cells, "" if bound is None else f"{bound:g}")
    console.print(table)
    path, time, heat = data["path"], data["timing"], data["thermal"]
    console.print(
        f"{path['waypoints']} waypoints, {path['length_m']:.2f} m, {time['duration_s']:.1f} s, "
        f"{100 * time['at_feed']:.1f} % of the length at feed, {path['stops']} stops"
    )
    rises = ", ".join(f"{n} {heat['start_K'][n]:.2f} to {heat['end_K'][n]:.2f}" for n in heat["start_K"])
    console.print(f"rise [K]: {rises}")
    if corrected:
        console.print(
            f"{data['ratio']:.0f} times smaller; start within {heat['start_window_s']:.0f} s of the state it is for"
        )
    for finding in data["findings"]:
        console.print(f"{finding['level']}: {finding['message']}", markup=False, highlight=False)
    if folder is not None:
        console.print(f"wrote {listed(files)} to {folder}", markup=False, highlight=False)


def listed(files: Iterable[str]) -> str:
    """Names of files, numbered ones in a row as the first and the last of them."""
    told: list[str] = []
    for stem, group in groupby(sorted(files), lambda name: re.sub(r"_\d{2,}(?=\.LS$)", "", name)):
        names = list(group)
        numbered = [name for name in names if name != stem]
        told += names if len(numbered) < FEW else [n for n in names if n == stem]
        told += [f"{numbered[0]} to {numbered[-1]}"] if len(numbered) >= FEW else []
    return ", ".join(told)
