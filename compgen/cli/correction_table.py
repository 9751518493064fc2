"""What a correction says at its end, for a reader."""

import sys
from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from compgen.pipelines.correct import Correction
from compgen.report.correction_summary import correction_summary

LISTED = 40  # unsafe statements on the screen


def show_correction(result: Correction, folder: Path, files: Iterable[str]) -> None:
    """What ``correct`` did, for a reader."""
    data = correction_summary(result)
    console = Console(width=None if sys.stdout.isatty() else 100, highlight=False, markup=False)
    if data["before"]:
        table = Table(title=Text(f"{data['name']} on {data['provenance']['robot']}"), title_justify="left")
        table.title_style = "bold"
        table.add_column("error", no_wrap=True)
        for side in ("before", "after"):
            for part in ("max", "p99", "rms"):
                table.add_column(f"{side} {part}", justify="right")
        for key, label in (("total", "position, um"), ("turn", "orientation, mdeg")):
            table.add_row(label, *(f"{v:.2f}" for side in ("before", "after") for v in data[side][key].values()))
        console.print(table)
    count = data["positions"]
    console.print(
        f"{count['corrected']} positions corrected, {count['new']} new, {count['unchanged']} unchanged; "
        f"{data['duration_s']:.1f} s"
    )
    heat = data["thermal"]
    console.print(
        "rise [K]: " + ", ".join(f"{n} {v:.2f} to {heat['end_K'][n]:.2f}" for n, v in heat["start_K"].items())
    )
    for finding in data["findings"]:
        console.print(f"{finding['level']}: {finding['message']}")
    for item in data["unsafe"][:LISTED]:
        console.print(f"  line {item['line']}: {item['text']}: {item['reason']}")
    if len(data["unsafe"]) > LISTED:
        console.print(f"  and {len(data['unsafe']) - LISTED} more, all in report.json")
    console.print(f"wrote {', '.join(sorted(files))} to {folder}")
