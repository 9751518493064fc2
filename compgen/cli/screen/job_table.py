"""The table that a job prints at its end."""

import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from compgen.cli.screen.ci_reports import JudgedPath
from compgen.cli.screen.messages import print_findings, print_table, sizes_table, stdout_console
from compgen.core.exit_codes import ExitCode
from compgen.core.finding_codes import Code
from compgen.core.units import counted
from compgen.pipelines.planned.job_results import Corrected, Planned
from compgen.report import job_summary
from compgen.report.band_words import before_and_after, gain_words, guaranteed_text, is_corrected, not_known_words

ROWS = (  # row of the report, its label, its bound
    ("total", "TCP error, um", "max_um"),
    ("feed", "along feed, um", "feed_um"),
    ("cross", "cross feed, um", "cross_um"),
    ("normal", "along tool, um", "normal_um"),
    ("axis_angle", "tool axis, mdeg", "axis_mdeg"),
)
_SIZES = ("max_um", "p99_um", "rms_um")
STARTS = "one file for many starts, largest error on the part, um"
MOST_LISTED = 4  # numbered files of one name; of more, only the first and the last are


def show_job(
    planned: Planned, corrected: Corrected | None, folder: Path | None, files: Iterable[str], *, verbose: bool
) -> None:
    """Print the errors, then in four sentences: before and after, what is not known, what to read, what was written."""
    summary = job_summary(planned, corrected)
    console = stdout_console()
    console.print(Text(" ".join((planned.job.title or planned.job.name).split()), style="bold"))
    if is_corrected(summary) or corrected is None or verbose:
        console.print(_errors_table(summary))
    if summary.get("guaranteed"):
        console.print(guaranteed_text(summary["guaranteed"]))
    path, time, heat = summary["path"], summary["timing"], summary["thermal"]
    console.print(
        f"{path['waypoints']} waypoints, {path['length_m']:.2f} m, {time['duration_s']:.1f} s, "
        f"{100 * time['at_feed']:.1f} % of the length at feed, {counted(path['stops'], 'stop', 'stops')}"
    )
    if verbose:
        rises = ", ".join(f"{n} {heat['start_K'][n]:.2f} to {heat['end_K'][n]:.2f}" for n in heat["start_K"])
        console.print(f"rise [K]{' mean over the starts' if 'average_over' in summary else ''}: {rises}")
    if corrected and corrected.averaged is not None:
        print_table(console, STARTS, _starts_table(summary["average_over"]))
    console.print(f"{before_and_after(summary)}{gain_words(summary)}")
    console.print(not_known_words(summary["band"], verbose=verbose))
    print_findings(console, summary["findings"], verbose=verbose)
    robot_file = summary["provenance"]["robot_file"]
    console.print(f"robot file {robot_file['path']}, sha256 {robot_file['sha256'][:16]}")
    if folder is not None:
        console.print(f"wrote {name_list(files)} to {folder}")


def _errors_table(summary: dict[str, Any]) -> Table:
    """The error by its parts, and its bounds."""
    table = sizes_table("whole program", ["before", "after"] if summary["after"] else ["predicted"], "bound")
    for row, label, key in ROWS:
        cells = [f"{v:.2f}" for side in ("before", "after") if summary[side] for v in summary[side][row].values()]
        bound = summary["bounds"].get(key)
        table.add_row(label, *cells, "" if bound is None else f"{bound:g}")
    return table


def show_outcomes(outcomes: Sequence[JudgedPath]) -> None:
    """Print what became of each of several paths, what a project's file gave them, and how many are inside."""
    console = stdout_console()
    table = Table("path", "outcome", "before max, um", "after max, um", "bound, um", "s")
    for column in table.columns[2:]:
        column.justify = "right"
    for outcome in outcomes:
        report = outcome.summary
        kind = "" if outcome.code is None else ExitCode(outcome.code).kind
        words = kind if report is None else report["verdict"]
        sizes = ["", "", ""]
        if report is not None:
            bound = report["bounds"].get("max_um")
            sizes = [f"{report[side]['total']['max_um']:.2f}" for side in ("before", "after")]
            sizes.append("" if bound is None else f"{bound:g}")
        table.add_row(Text(outcome.path), words, *sizes, f"{outcome.seconds:.1f}")
    console.print(table)
    findings = [finding for outcome in outcomes for finding in (outcome.summary or {}).get("findings", ())]
    of_project = {finding["message"]: finding for finding in findings if finding["code"] == Code.PROJECT_FILE}
    print_findings(console, of_project.values(), verbose=False)
    inside = sum(outcome.code == 0 for outcome in outcomes)
    console.print(f"{inside} of {len(outcomes)} paths inside their bounds")


def _starts_table(average: dict[str, Any]) -> Table:
    """What one file leaves at each start that was flown, and what one made anew for it would."""
    table = Table()
    for column in ("start", "this file", "p99", "rms", "made anew"):
        table.add_column(column, justify="left" if column == "start" else "right")
    table.add_row("mean of the rises", *(f"{average['at_mean'][key]:.2f}" for key in _SIZES), "")
    for one in average["flown"]:
        words = f"run {one['run']}, {one['delay_s']:.0f} s late, {one['override_percent']:.4g} %"
        anew = one["remade_max_um"]
        table.add_row(words, *(f"{one[key]:.2f}" for key in _SIZES), "none is legal" if anew is None else f"{anew:.2f}")
    return table


def name_list(files: Iterable[str]) -> str:
    """Names of files, numbered ones in a row as the first and the last of them."""
    parts: list[str] = []
    for stem, group in groupby(sorted(files), lambda name: re.sub(r"_\d{2,}(?=\.LS$)", "", name)):
        group_names = list(group)
        numbered = [name for name in group_names if name != stem]
        if len(numbered) <= MOST_LISTED:
            parts += group_names
        else:
            parts += [name for name in group_names if name == stem] + [f"{numbered[0]} to {numbered[-1]}"]
    return ", ".join(parts)
